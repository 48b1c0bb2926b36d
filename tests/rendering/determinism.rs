//! The same inputs on the same device give the same bits; another seed gives another picture of the same scene.

use macula::image::LinearImage;

use crate::maker::{Recipe, bundled, mean, means_agree};

fn bits(image: &LinearImage) -> Vec<u32> {
    let values = image.rgb.as_flattened();
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn a_picture_made_twice_is_the_same_to_the_bit() {
    let cornell = bundled("cornell.glb");
    for technique in ["pm-direct", "pm", "fpm", "path-filtered"] {
        let recipe = Recipe::new(technique).passes(2);
        let [first, second] = [(); 2].map(|()| recipe.render(&cornell).image);
        assert!(bits(&first) == bits(&second), "{technique}");

        let other = recipe.set("random.seed", "2").render(&cornell).image;
        let same = bits(&first)
            .iter()
            .zip(bits(&other))
            .filter(|(a, b)| **a == *b)
            .count();
        assert!(same * 10 < first.rgb.len() * 3, "{same} values are equal");
        means_agree(mean(&other), mean(&first), 0.05).unwrap();
    }
}
