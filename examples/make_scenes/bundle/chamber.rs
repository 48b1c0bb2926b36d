//! Rooms as boxes that face inward, with doors in their walls and holes in their ceilings.

use glam::DVec3;

use super::mesh::{Mesh, joined};

/// One room: its corners, metres.
pub struct Chamber {
    pub name: &'static str,
    pub min: DVec3,
    pub max: DVec3,
}

/// The walls of a chamber, named as on a map with north at -Z.
#[derive(Clone, Copy, PartialEq)]
pub enum Side {
    West,
    East,
    North,
    South,
}

impl Chamber {
    /// The point on a wall `along` it (x or z) at a height, and the direction into the room.
    pub fn on_wall(&self, side: Side, along: f64, height_m: f64) -> (DVec3, DVec3) {
        match side {
            Side::West => (DVec3::new(self.min.x, height_m, along), DVec3::X),
            Side::East => (DVec3::new(self.max.x, height_m, along), DVec3::NEG_X),
            Side::North => (DVec3::new(along, height_m, self.min.z), DVec3::Z),
            Side::South => (DVec3::new(along, height_m, self.max.z), DVec3::NEG_Z),
        }
    }

    /// The four walls, with doors from the floor to `door_height_m` over a span along each, measured from the corner `min`.
    pub fn walls(&self, doors: &[(Side, [f64; 2])], door_height_m: f64) -> Mesh {
        let [x, y, z] = self.axes();
        let span = |side: Side| {
            doors
                .iter()
                .filter(move |door| door.0 == side)
                .map(|door| door.1)
        };
        // Two walls have their height along u, two along v, so that all face in.
        let upright = |side| -> Vec<[f64; 4]> {
            span(side)
                .map(|[low, high]| [0.0, low, door_height_m, high])
                .collect()
        };
        let lying = |side| -> Vec<[f64; 4]> {
            span(side)
                .map(|[low, high]| [low, 0.0, high, door_height_m])
                .collect()
        };
        joined([
            Mesh::wall(self.min, x, y, &lying(Side::North)),
            Mesh::wall(self.min.with_z(self.max.z), y, x, &upright(Side::South)),
            Mesh::wall(self.min, y, z, &upright(Side::West)),
            Mesh::wall(self.min.with_x(self.max.x), z, y, &lying(Side::East)),
        ])
    }

    /// The floor.
    pub fn floor(&self) -> Mesh {
        let [x, _, z] = self.axes();
        Mesh::wall(self.min, z, x, &[])
    }

    /// The ceiling, with holes `[x0, z0, x1, z1]` measured from `min`.
    pub fn ceiling(&self, holes: &[[f64; 4]]) -> Mesh {
        let [x, _, z] = self.axes();
        Mesh::wall(self.min.with_y(self.max.y), x, z, holes)
    }

    fn axes(&self) -> [(DVec3, f64); 3] {
        let size = self.max - self.min;
        [(DVec3::X, size.x), (DVec3::Y, size.y), (DVec3::Z, size.z)]
    }
}

/// The lining of a passage along x through a wall: floor, lintel and two jambs, open at both ends.
pub fn doorway_along_x(min: DVec3, max: DVec3) -> Mesh {
    let passage = Chamber {
        name: "passage",
        min,
        max,
    };
    let [x, y, _] = passage.axes();
    joined([
        passage.floor(),
        passage.ceiling(&[]),
        Mesh::wall(min, x, y, &[]),
        Mesh::wall(min.with_z(max.z), y, x, &[]),
    ])
}
