//! Hard cases: scenes, settings and inputs at the border of what makes sense, by family, for every technique in the registry.
//!
//! A case is data: a scene, what its picture must be, and a control that shows that the judgement can fail (`runner`).

mod angles;
mod bounds;
mod capacity;
mod frames;
mod gaze;
mod geometry;
mod image_sizes;
mod intensities;
mod invariances;
mod mixtures;
mod photons_and_lights;
mod poses_and_views;
mod roughness;
mod runner;
mod scale_and_place;
mod stages;
mod time;
mod walls;

#[path = "../common/energy_bound.rs"]
mod energy_bound;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/glb.rs"]
mod glb;
#[allow(dead_code, reason = "other tests use the rest of it")]
#[path = "../common/maker.rs"]
mod maker;
#[path = "../common/shared.rs"]
mod shared;

/// Every family's cases, counted; and that each is judged by all techniques is what its own test shows.
#[test]
fn the_suite_counts_its_cases() {
    let families = [
        ("angles", angles::cases().len()),
        ("capacity", capacity::cases().len()),
        ("gaze", gaze::cases().len()),
        ("geometry", geometry::cases().len()),
        ("image sizes", image_sizes::cases().len()),
        ("intensities", intensities::cases().len()),
        ("invariances", invariances::variants().len()),
        ("mixtures", mixtures::cases().len()),
        ("photons and lights", photons_and_lights::cases().len()),
        ("poses and views", poses_and_views::cases().len()),
        ("roughness", roughness::cases().len()),
        ("scale and place", scale_and_place::cases().len()),
        ("time", time::cases().len()),
        ("walls", walls::cases().len()),
    ];
    for (family, count) in families {
        println!("{family}: {count} cases");
        assert!(count > 0, "{family}");
    }
    let pictures = [
        angles::cases(),
        capacity::cases(),
        geometry::cases(),
        image_sizes::cases(),
        intensities::cases(),
        mixtures::cases(),
        photons_and_lights::cases(),
        roughness::cases(),
        scale_and_place::cases(),
        walls::cases(),
    ];
    let pictures = || pictures.iter().flatten();
    let [bounded, vague] = [
        pictures()
            .filter(|case| case.bound_w_m2_sr().is_some())
            .count(),
        pictures().filter(|case| case.is_vague()).count(),
    ];
    let all = pictures().count();
    println!(
        "{bounded} of {all} cases with pictures have a bound of energy, {vague} ask for no more than some light"
    );
    assert!(2 * bounded > all, "most cases have a bound");
    let count: usize = families.iter().map(|(_, count)| count).sum();
    let techniques = runner::techniques().len();
    println!(
        "hard cases: {count} in {} families, for {techniques} techniques",
        families.len()
    );
}
