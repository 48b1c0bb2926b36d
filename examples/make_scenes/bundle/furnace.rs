//! A furnace: in a closed room of albedo ρ whose surfaces all emit 1, the radiance is 1 / (1 - ρ) everywhere.

use glam::DVec3;

use super::glb::Glb;
use super::material;
use super::math::rotation;
use super::mesh::{Mesh, joined};

/// ρ = ½, so that every pixel is exactly 2. A turned cube in the middle is of the same stuff, and is therefore not to be seen.
pub fn make() -> Vec<u8> {
    let mut glb = Glb::new("furnace");
    let mut glowing = material::lambert([0.5; 3]);
    material::emit(&mut glowing, [1.0; 3]);
    glowing["doubleSided"] = false.into();
    let glowing = glb.material("glowing", glowing);

    let half = DVec3::splat(0.2);
    let tilt = rotation(DVec3::new(0.6, 0.8, 0.0), 0.7);
    let cube = Mesh::cuboid(-half, half).turned(tilt);
    let shell = Mesh::icosphere(1.0, 3).flipped();
    glb.place("furnace", &joined([shell, cube]), glowing);

    let turn = rotation(DVec3::Y, 0.6);
    glb.camera("viewer", DVec3::new(0.3, 0.1, 0.5), turn, 60.0);
    glb.finish()
}
