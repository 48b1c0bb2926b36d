//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004) of display luminance: 11x11 Gaussian window, sigma 1.5 pixels, K1 = 0.01,
//! K2 = 0.03, full scale 1; a window must fit in the picture.

const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Luminance of RGB with the primaries of BT.709, in the units of the RGB.
pub fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

/// The similarity around each pixel, `None` within 5 pixels of the border. Display values, full scale 1; both pictures of one size.
pub fn map(candidate: &[[f32; 3]], reference: &[[f32; 3]], width: usize) -> Vec<Option<f64>> {
    let height = candidate.len() / width;
    let x: Vec<f64> = candidate.iter().map(|&rgb| luminance(rgb)).collect();
    let y: Vec<f64> = reference.iter().map(|&rgb| luminance(rgb)).collect();
    let product =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let (xx, yy, xy) = (product(&x, &x), product(&y, &y), product(&x, &y));
    let [x, y, xx, yy, xy] = [x, y, xx, yy, xy].map(|values| blur(&values, width, height));
    let similarity = |pixel: usize| {
        let (mx, my) = (x[pixel], y[pixel]);
        let (vx, vy) = (xx[pixel] - mx * mx, yy[pixel] - my * my);
        let covariance = xy[pixel] - mx * my;
        (2.0 * mx * my + C1) * (2.0 * covariance + C2) / ((mx * mx + my * my + C1) * (vx + vy + C2))
    };
    let fits = |at: usize, size: usize| at >= RADIUS && at + RADIUS < size;
    (0..candidate.len())
        .map(|pixel| {
            (fits(pixel % width, width) && fits(pixel / width, height)).then(|| similarity(pixel))
        })
        .collect()
}

/// Separable Gaussian; pixels within `RADIUS` of the border are left at zero.
fn blur(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let mut weights: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
        let offset = i as f64 - RADIUS as f64;
        (-offset * offset / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    let pass = |from: &[f64],
                stride: usize,
                rows: std::ops::Range<usize>,
                columns: std::ops::Range<usize>| {
        let mut to = vec![0.0; from.len()];
        for row in rows {
            for column in columns.clone() {
                let at = row * width + column;
                let first = at - RADIUS * stride;
                to[at] = (0..weights.len())
                    .map(|i| weights[i] * from[first + i * stride])
                    .sum();
            }
        }
        to
    };
    let inner = |size: usize| RADIUS..size.saturating_sub(RADIUS).max(RADIUS);
    let across = pass(values, 1, 0..height, inner(width));
    pass(&across, width, inner(height), inner(width))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 24;

    fn mean(map: &[Option<f64>]) -> f64 {
        let values: Vec<f64> = map.iter().flatten().copied().collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn flat_pictures_differ_by_the_luminance_term_alone() {
        let (a, b) = (vec![[0.4; 3]; SIDE * SIDE], vec![[0.6; 3]; SIDE * SIDE]);
        let expected = (2.0 * 0.4 * 0.6 + C1) / (0.4 * 0.4 + 0.6 * 0.6 + C1);
        assert!((mean(&map(&a, &b, SIDE)) - expected).abs() < 1e-6);
        assert!((mean(&map(&a, &a, SIDE)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn inverted_structure_is_worse_than_none() {
        let stripes = |sign: f32| -> Vec<[f32; 3]> {
            (0..SIDE * SIDE)
                .map(|i| [0.5 + sign * if i % 4 < 2 { 0.3 } else { -0.3 }; 3])
                .collect()
        };
        let against = |other: &[[f32; 3]]| mean(&map(&stripes(1.0), other, SIDE));
        let (same, flat, inverted) = (
            against(&stripes(1.0)),
            against(&stripes(0.0)),
            against(&stripes(-1.0)),
        );
        assert!(
            same > 0.999_999 && flat < 0.1 && inverted < -0.5,
            "{same} {flat} {inverted}"
        );
    }

    #[test]
    fn a_picture_smaller_than_the_window_has_no_similarity() {
        let tiny = vec![[0.5; 3]; 10 * 4];
        assert!(map(&tiny, &tiny, 10).iter().all(Option::is_none));
    }
}
