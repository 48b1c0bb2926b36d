//! A gallery of three rooms joined by doorways, with many lights of every kind but the sun: a spot on each picture and sculpture, panels
//! in the ceilings, point lights in the wall lamps. It is closed all round.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::chamber::{self, Chamber, Side};
use super::furniture::{self, CREASE_DEG};
use super::glb::Glb;
use super::material::{glass, glossy, lambert, lamp, metal, textured};
use super::math::rotation;
use super::mesh::{Mesh, joined};
use super::painting;
use super::sculpture;
use super::shapes::{rod, rounded_cuboid};
use super::texture::{self, hex};

const HALL: Chamber = Chamber {
    name: "hall",
    min: DVec3::new(-5.0, 0.0, -3.5),
    max: DVec3::new(5.0, 4.2, 3.5),
};
const SIDE_ROOM: Chamber = Chamber {
    name: "side-room",
    min: DVec3::new(5.4, 0.0, -3.0),
    max: DVec3::new(10.4, 3.4, 3.0),
};
const CABINET: Chamber = Chamber {
    name: "cabinet",
    min: DVec3::new(-3.0, 0.0, -8.4),
    max: DVec3::new(3.5, 3.2, -3.9),
};
const DOOR_HEIGHT_M: f64 = 2.6;
/// From the hall to the side room, along z; to the cabinet, along x.
const SIDE_DOOR: (f64, f64) = (-0.9, 0.9);
const CABINET_DOOR: (f64, f64) = (1.5, 3.1);
/// How high pictures hang (their middles).
const EYE_LEVEL_M: f64 = 1.65;

/// The file being written, and what its pieces share.
struct Gallery {
    glb: Glb,
    white: usize,
    gilt: usize,
    brass: usize,
    panel: usize,
    pictures: Vec<usize>,
    housing: usize,
}

pub fn make() -> Vec<u8> {
    let mut glb = Glb::new("gallery");
    let pictures = painting::ALL.map(|(name, paint)| {
        let texture = glb.texture(name, &paint(256, 1.3));
        glb.material(name, textured(glossy([1.0; 3], 0.55), texture))
    });
    let black = glb.material("black metal", metal([0.12; 3], 0.5));
    let housing = spot_housing();
    let mut gallery = Gallery {
        white: glb.material("white plaster", lambert([0.8, 0.79, 0.77])),
        gilt: glb.material("gilt wood", metal([0.85, 0.62, 0.3], 0.45)),
        brass: glb.material("brushed brass", metal([0.91, 0.72, 0.4], 0.3)),
        panel: glb.material("ceiling panel", lamp([5.0, 4.9, 4.6])),
        housing: glb.mesh("spot housing", &[(&housing, black)]),
        pictures: pictures.to_vec(),
        glb,
    };
    gallery.shell();
    gallery.hang_all();
    gallery.stand_all();
    gallery.wall_lamps();
    gallery.benches();
    let glb = &mut gallery.glb;
    glb.camera(
        "hall",
        DVec3::new(-3.9, 1.65, 2.6),
        rotation(DVec3::Y, -0.95),
        60.0,
    );
    glb.camera(
        "side-room",
        DVec3::new(9.6, 1.65, 2.1),
        rotation(DVec3::Y, 1.15),
        60.0,
    );
    gallery.glb.finish()
}

/// The tin around a spot light, which sits at the origin and shines along -Z: two skins, open in front.
fn spot_housing() -> Mesh {
    let profile = [
        [0.0, -0.14],
        [0.05, -0.14],
        [0.055, 0.03],
        [0.052, 0.03],
        [0.047, -0.1],
        [0.0, -0.1],
    ];
    let tin = Mesh::lathe(&profile.map(DVec2::from_array), 24).shaded(CREASE_DEG);
    tin.turned(rotation(DVec3::X, -FRAC_PI_2))
}

impl Gallery {
    fn shell(&mut self) {
        let stone = self
            .glb
            .texture("stone tiles", &texture::stone_tiles(512, 4));
        let stone = self
            .glb
            .material("polished stone", textured(glossy([1.0; 3], 0.2), stone));
        let boards = self
            .glb
            .texture("floorboards", &texture::floorboards(512, 12));
        let boards = self
            .glb
            .material("lacquered boards", textured(glossy([1.0; 3], 0.35), boards));
        let felt = self.glb.material("felt", lambert([0.2, 0.17, 0.15]));
        let grey = self
            .glb
            .material("warm grey wall", lambert([0.6, 0.57, 0.52]));
        let green = self.glb.material("green wall", lambert([0.17, 0.34, 0.26]));
        let red = self.glb.material("red wall", lambert([0.42, 0.09, 0.07]));
        let oak = self
            .glb
            .texture("oak", &texture::wood(256, hex(0xc39a68), hex(0x8a5d35)));
        let oak = self
            .glb
            .material("oiled oak", textured(glossy([1.0; 3], 0.4), oak));

        let doors = |side: Side, from_m: f64, (low, high): (f64, f64)| {
            (side, [low - from_m, high - from_m])
        };
        let hall_doors = [
            doors(Side::East, HALL.min.z, SIDE_DOOR),
            doors(Side::North, HALL.min.x, CABINET_DOOR),
        ];
        let hall_panels = [1.4, 3.8, 6.2, 8.6]
            .into_iter()
            .flat_map(|x| [2.0, 5.0].map(|z| [x, z]));
        self.chamber(&HALL, grey, stone, &hall_doors, hall_panels.collect());
        let door = doors(Side::West, SIDE_ROOM.min.z, SIDE_DOOR);
        self.chamber(
            &SIDE_ROOM,
            green,
            boards,
            &[door],
            vec![[2.5, 2.0], [2.5, 4.0]],
        );
        let door = doors(Side::South, CABINET.min.x, CABINET_DOOR);
        self.chamber(&CABINET, red, felt, &[door], vec![[2.2, 2.25], [4.4, 2.25]]);

        let (low, high) = SIDE_DOOR;
        let to_side = chamber::doorway_along_x(
            DVec3::new(HALL.max.x, 0.0, low),
            DVec3::new(SIDE_ROOM.min.x, DOOR_HEIGHT_M, high),
        );
        // Turned a quarter, a passage along x becomes one along z.
        let (low, high) = CABINET_DOOR;
        let to_cabinet = chamber::doorway_along_x(
            DVec3::new(CABINET.max.z, 0.0, -high),
            DVec3::new(HALL.min.z, DOOR_HEIGHT_M, -low),
        );
        let to_cabinet = to_cabinet.turned(rotation(DVec3::Y, -FRAC_PI_2));
        let linings =
            joined([to_side, to_cabinet]).textured(|p, _| DVec2::new(p.y, p.x + p.z) / 0.8);
        self.place("doorways", linings, oak);
    }

    /// A room's floor, walls with their doors (a span along each), and ceiling with its lit panels (their middles).
    fn chamber(
        &mut self,
        chamber: &Chamber,
        wall: usize,
        floor: usize,
        doors: &[(Side, [f64; 2])],
        panels: Vec<[f64; 2]>,
    ) {
        const PANEL_HALF_M: [f64; 2] = [0.6, 0.3];
        let name = |part: &str| format!("{} {part}", chamber.name);
        self.place(&name("walls"), chamber.walls(doors, DOOR_HEIGHT_M), wall);
        let ground = chamber.floor().textured(|_, uv| uv / 2.4);
        self.place(&name("floor"), ground, floor);
        let [half_x, half_z] = PANEL_HALF_M;
        let holes: Vec<[f64; 4]> = panels
            .iter()
            .map(|[u, v]| [u - half_x, v - half_z, u + half_x, v + half_z])
            .collect();
        self.place(&name("ceiling"), chamber.ceiling(&holes), self.white);
        let top = chamber.min.with_y(chamber.max.y);
        for (number, hole) in holes.iter().enumerate() {
            let corner = top + DVec3::new(hole[0], 0.0, hole[1]);
            let panel = Mesh::wall(
                corner,
                (DVec3::X, 2.0 * half_x),
                (DVec3::Z, 2.0 * half_z),
                &[],
            );
            self.place(&name(&format!("panel {number}")), panel, self.panel);
        }
    }

    fn hang_all(&mut self) {
        let mut number = 0;
        let mut hang = |chamber: &Chamber, side: Side, places: &[f64]| {
            for along in places {
                self.hang(chamber, side, *along, number);
                number += 1;
            }
        };
        hang(&HALL, Side::North, &[-3.8, -1.9, 0.0, 4.1]);
        hang(&HALL, Side::South, &[3.8, 1.9, 0.0, -1.9, -3.8]);
        hang(&HALL, Side::West, &[1.6, -1.6]);
        hang(&HALL, Side::East, &[-2.3, 2.3]);
        hang(&SIDE_ROOM, Side::East, &[-1.5, 1.5]);
        hang(&SIDE_ROOM, Side::North, &[6.6, 9.0]);
        hang(&SIDE_ROOM, Side::South, &[9.0, 6.6]);
        hang(&CABINET, Side::North, &[-1.8, 0.25, 2.3]);
        hang(&CABINET, Side::West, &[-6.15]);
        hang(&CABINET, Side::East, &[-6.15]);
    }

    /// Hangs a picture with its frame and its spot.
    fn hang(&mut self, chamber: &Chamber, side: Side, along: f64, number: usize) {
        let height_m = [1.0, 0.85, 1.2][number % 3];
        let width_m = 1.3 * height_m;
        let (at, inward) = chamber.on_wall(side, along, EYE_LEVEL_M);
        let turn_rad = match side {
            Side::West => FRAC_PI_2,
            Side::East => -FRAC_PI_2,
            Side::North => 0.0,
            Side::South => PI,
        };
        let hung = |mesh: Mesh| {
            mesh.turned(rotation(DVec3::Y, turn_rad))
                .moved(at + inward * 0.001)
        };
        let picture = hung(furniture::picture(width_m, height_m, 0.06));
        let material = self.pictures[number * 3 % self.pictures.len()];
        self.glb
            .place(&format!("picture {number}"), &picture, material);
        let frame = hung(furniture::picture_frame(width_m, height_m, 0.06));
        self.glb
            .place(&format!("frame {number}"), &frame, self.gilt);
        let from = at.with_y(chamber.max.y - 0.25) + inward * 1.3;
        self.spot(&format!("picture spot {number}"), from, at, 9.0, 0.42);
    }

    /// A spot light in its tin, hung from the ceiling and aimed at a point.
    fn spot(
        &mut self,
        name: &str,
        from: DVec3,
        at: DVec3,
        intensity_w_per_sr: f64,
        half_angle_rad: f64,
    ) {
        let cone =
            json!({ "innerConeAngle": 0.6 * half_angle_rad, "outerConeAngle": half_angle_rad });
        let mut light = warm("spot", intensity_w_per_sr);
        light["spot"] = cone;
        let node = self.glb.light(name, light, from, (at - from).normalize());
        self.glb.attach_mesh(node, self.housing);
    }

    fn stand_all(&mut self) {
        let bronze = self.glb.material("bronze", metal([0.62, 0.4, 0.22], 0.28));
        let marble = self.glb.material("marble", glossy([0.8, 0.78, 0.74], 0.25));
        let steel = self
            .glb
            .material("polished steel", metal([0.78, 0.78, 0.8], 0.0));
        let gold = self.glb.material("gold", metal([1.0, 0.77, 0.34], 0.15));
        let glass = self.glb.material("glass", glass(1.5, 0.3));
        let blue = self
            .glb
            .material("blue glaze", glossy([0.04, 0.12, 0.3], 0.12));
        let jade = self
            .glb
            .material("jade glaze", glossy([0.2, 0.42, 0.3], 0.15));
        let vase = [
            [0.06, 0.0],
            [0.08, 0.02],
            [0.15, 0.18],
            [0.09, 0.34],
            [0.05, 0.4],
            [0.08, 0.46],
        ];
        let jar = [
            [0.09, 0.0],
            [0.11, 0.02],
            [0.16, 0.14],
            [0.16, 0.22],
            [0.09, 0.3],
            [0.1, 0.32],
        ];
        let pieces = [
            (
                &HALL,
                "knot",
                sculpture::knot(0.55),
                bronze,
                [0.0, 0.0],
                [0.9, 0.75],
            ),
            (
                &HALL,
                "column",
                sculpture::wound_column(1.1),
                marble,
                [-2.6, -1.2],
                [0.5, 0.8],
            ),
            (
                &HALL,
                "egg",
                sculpture::egg(0.5),
                steel,
                [2.6, -1.3],
                [0.5, 0.95],
            ),
            (
                &HALL,
                "drop",
                sculpture::drop(0.62),
                glass,
                [2.4, 1.5],
                [0.5, 0.95],
            ),
            (
                &SIDE_ROOM,
                "band",
                sculpture::moebius(0.3),
                gold,
                [7.9, 0.0],
                [0.5, 1.0],
            ),
            (
                &SIDE_ROOM,
                "rings",
                sculpture::rings(0.27),
                marble,
                [9.6, -2.2],
                [0.5, 1.0],
            ),
            (
                &CABINET,
                "vase",
                furniture::turned_vessel(vase, 0.008, 56),
                blue,
                [-1.6, -5.6],
                [0.4, 1.05],
            ),
            (
                &CABINET,
                "jar",
                furniture::turned_vessel(jar, 0.008, 56),
                jade,
                [0.25, -6.2],
                [0.4, 1.05],
            ),
            (
                &CABINET,
                "glass ball",
                Mesh::sphere(0.2, 4).moved(DVec3::Y * 0.2),
                glass,
                [2.1, -5.6],
                [0.4, 1.05],
            ),
        ];
        for (chamber, name, piece, material, [x, z], [width_m, height_m]) in pieces {
            let foot = DVec3::new(x, 0.0, z);
            let plinth = sculpture::plinth(width_m, height_m).moved(foot);
            self.glb
                .place(&format!("{name} plinth"), &plinth, self.white);
            let top = foot + DVec3::Y * (height_m + 0.0005);
            self.glb.place(name, &piece.moved(top), material);
            let from = DVec3::new(x + 0.9, chamber.max.y - 0.25, z + 0.7);
            self.spot(
                &format!("{name} spot"),
                from,
                top + DVec3::Y * 0.3,
                14.0,
                0.32,
            );
        }
    }

    /// Brass cups on the walls, each with a point light that shines up and out of it.
    fn wall_lamps(&mut self) {
        let cup = [[0.02, 0.0], [0.05, 0.02], [0.09, 0.1], [0.1, 0.16]];
        let cup = furniture::turned_vessel(cup, 0.004, 40);
        let cup = self.glb.mesh("lamp cup", &[(&cup, self.brass)]);
        let places: [(&Chamber, Side, f64); 9] = [
            (&HALL, Side::North, -2.85),
            (&HALL, Side::North, -0.95),
            (&HALL, Side::South, 2.85),
            (&HALL, Side::South, -2.85),
            (&HALL, Side::West, 0.0),
            (&SIDE_ROOM, Side::East, 0.0),
            (&SIDE_ROOM, Side::North, 7.8),
            (&CABINET, Side::West, -7.4),
            (&CABINET, Side::East, -7.4),
        ];
        for (number, (chamber, side, along)) in places.into_iter().enumerate() {
            let (at, inward) = chamber.on_wall(side, along, 2.05);
            let center = at + inward * 0.14;
            let place = json!({ "mesh": cup, "translation": center.to_array() });
            self.glb.node(&format!("lamp cup {number}"), place);
            let arm = rod(at, center + DVec3::Y * 0.012, 0.01, 12);
            self.place(&format!("lamp arm {number}"), arm, self.brass);
            let light = center + DVec3::Y * 0.13;
            self.glb.light(
                &format!("wall lamp {number}"),
                warm("point", 2.2),
                light,
                DVec3::NEG_Z,
            );
        }
    }

    fn benches(&mut self) {
        let leather = self
            .glb
            .material("leather", glossy([0.22, 0.09, 0.04], 0.4));
        for (number, (x, z)) in [(-2.4, 1.1), (7.6, 2.0)].into_iter().enumerate() {
            let half = DVec3::new(0.75, 0.06, 0.24);
            let seat = rounded_cuboid(half, 0.04, 4, 6).moved(DVec3::new(x, 0.42, z));
            self.place(&format!("bench {number}"), seat, leather);
            let legs = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(side, end)| {
                let foot = DVec3::new(x + 0.62 * side, 0.0, z + 0.16 * end);
                rod(foot, foot + DVec3::Y * 0.37, 0.018, 20)
            });
            self.place(&format!("bench legs {number}"), joined(legs), self.brass);
        }
    }

    fn place(&mut self, name: &str, mesh: Mesh, material: usize) {
        self.glb.place(name, &mesh.shaded(CREASE_DEG), material);
    }
}

/// A light of warm white.
fn warm(kind: &str, intensity_w_per_sr: f64) -> Value {
    json!({ "type": kind, "color": [1.0, 0.84, 0.66], "intensity": intensity_w_per_sr })
}
