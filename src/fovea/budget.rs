//! What the renderer spends in each region.

use super::Region;

/// The work for one pixel of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionBudget {
    /// Primary samples in the pixel, 1 or more.
    pub samples_per_pixel: u32,
    /// Shadow rays for direct light at each visible point, 1 or more.
    pub shadow_rays: u32,
    /// Factor on the photon gather radius, 0.1 to 10: larger is smoother, cheaper per photon and more biased.
    pub gather_radius_scale: f32,
}

/// The work for all regions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Where the eye resolves most.
    pub fovea: RegionBudget,
    /// Around it.
    pub transition: RegionBudget,
    /// All the rest.
    pub periphery: RegionBudget,
}

impl Default for Budget {
    /// 4, 2 and 1 samples and shadow rays; radius 1, 1.5 and 2. Suggestions of this project: the linear acuity of Guenter et al.
    /// falls below a tenth at the border of the fovea already, so that sampling by the eye's own limit would fall far more steeply.
    fn default() -> Self {
        let region = |samples: u32, gather_radius_scale: f32| RegionBudget {
            samples_per_pixel: samples,
            shadow_rays: samples,
            gather_radius_scale,
        };
        Self {
            fovea: region(4, 1.0),
            transition: region(2, 1.5),
            periphery: region(1, 2.0),
        }
    }
}

impl Budget {
    /// The work for one pixel of `region`.
    pub fn of(&self, region: Region) -> RegionBudget {
        match region {
            Region::Fovea => self.fovea,
            Region::Transition => self.transition,
            Region::Periphery => self.periphery,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fovea_gets_more_samples_and_smaller_radii_than_what_lies_around_it() {
        let budget = Budget::default();
        let by_distance =
            [Region::Fovea, Region::Transition, Region::Periphery].map(|region| budget.of(region));
        assert!(by_distance.windows(2).all(|pair| {
            pair[0].samples_per_pixel > pair[1].samples_per_pixel
                && pair[0].gather_radius_scale < pair[1].gather_radius_scale
        }));
    }
}
