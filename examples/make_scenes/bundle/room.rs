//! A lived-in room of about 100 k triangles, glossy and textured: daylight from a window on the left, a warm lamp, a mirror.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec2, DVec3};

use super::furniture::{self, CREASE_DEG};
use super::glb::Glb;
use super::material::{glass, glossy, lambert, lamp, metal, textured};
use super::math::rotation;
use super::mesh::{Mesh, joined};
use super::painting;
use super::shapes::{leaf, rod, rounded_cuboid, tube};
use super::texture::{self, hash, hex};

const ROOM_MIN: DVec3 = DVec3::new(-2.6, 0.0, -2.6);
const ROOM_MAX: DVec3 = DVec3::new(2.6, 2.6, 2.2);
/// The window in the left wall: y and z from `ROOM_MIN`.
const WINDOW: [f64; 4] = [0.7, 1.0, 2.25, 2.9];
const WINDOW_DEPTH_M: f64 = 0.22;
const TABLE_TOP: DVec3 = DVec3::new(-0.1, 0.42, -0.95);

/// The room's file being written, and the materials that several pieces share.
struct Room {
    glb: Glb,
    white: usize,
    oak: usize,
    brass: usize,
    ceramic: usize,
}

pub fn make() -> Vec<u8> {
    let mut glb = Glb::new("room");
    let oak = texture::wood(256, hex(0xc39a68), hex(0x8a5d35));
    let oak = glb.texture("oak", &oak);
    let mut room = Room {
        white: glb.material("white paint", lambert([0.78, 0.77, 0.74])),
        oak: glb.material("oiled oak", textured(glossy([1.0; 3], 0.4), oak)),
        brass: glb.material("brushed brass", metal([0.91, 0.72, 0.4], 0.3)),
        ceramic: glb.material("glazed ceramic", glossy([0.75, 0.76, 0.74], 0.12)),
        glb,
    };
    room.shell();
    room.window();
    room.seats();
    room.coffee_table();
    room.bookcase();
    room.lamp_corner();
    room.right_wall();
    room.plant();
    room.glb
        .camera("viewer", DVec3::new(0.15, 1.2, 1.6), DQuat::IDENTITY, 60.0);
    room.glb.finish()
}

impl Room {
    fn shell(&mut self) {
        let boards = self
            .glb
            .texture("floorboards", &texture::floorboards(512, 12));
        let boards = self
            .glb
            .material("lacquered floor", textured(glossy([1.0; 3], 0.3), boards));
        let paper = self.glb.texture("wallpaper", &texture::wallpaper(256));
        let paper = self
            .glb
            .material("wallpaper", textured(lambert([1.0; 3]), paper));
        let size = ROOM_MAX - ROOM_MIN;
        let (x, y, z) = ((DVec3::X, size.x), (DVec3::Y, size.y), (DVec3::Z, size.z));
        // One texture spans 2 m of floor and 0.6 m of wall.
        let floor = Mesh::wall(ROOM_MIN, z, x, &[]).textured(|_, uv| uv / 2.0);
        self.place("floor", floor, boards);
        let on_wall = |wall: Mesh, is_side: bool| {
            wall.textured(|p, _| DVec2::new(if is_side { p.z } else { p.x }, -p.y) / 0.6)
        };
        let walls = joined([
            on_wall(Mesh::wall(ROOM_MIN, x, y, &[]), false),
            on_wall(Mesh::wall(ROOM_MIN.with_z(ROOM_MAX.z), y, x, &[]), false),
            on_wall(Mesh::wall(ROOM_MIN, y, z, &[WINDOW]), true),
            on_wall(Mesh::wall(ROOM_MIN.with_x(ROOM_MAX.x), z, y, &[]), true),
        ]);
        self.place("walls", walls, paper);
        let mut white = vec![Mesh::wall(ROOM_MIN.with_y(ROOM_MAX.y), x, z, &[])];
        // Skirting below and a moulding above, along each wall.
        for (low_m, high_m, deep_m) in [(0.0, 0.11, 0.015), (2.5, 2.54, 0.04), (2.54, 2.6, 0.07)] {
            let (low, high) = (ROOM_MIN.with_y(low_m), ROOM_MAX.with_y(high_m));
            white.push(Mesh::cuboid(low, high.with_x(low.x + deep_m)));
            white.push(Mesh::cuboid(low.with_x(high.x - deep_m), high));
            let (low, high) = (low + DVec3::X * deep_m, high - DVec3::X * deep_m);
            white.push(Mesh::cuboid(low, high.with_z(low.z + deep_m)));
            white.push(Mesh::cuboid(low.with_z(high.z - deep_m), high));
        }
        self.place("ceiling and mouldings", joined(white), self.white);
        let door = furniture::door(0.9, 2.05).turned(rotation(DVec3::Y, PI));
        let door = door.moved(DVec3::new(1.35, 0.0, ROOM_MAX.z));
        self.place("door", door, self.white);
    }

    fn window(&mut self) {
        let sky = self.glb.material("sky", lamp([15.0, 17.5, 21.0]));
        let linen = self.glb.material("linen", lambert([0.72, 0.66, 0.55]));
        let low = ROOM_MIN + DVec3::new(-WINDOW_DEPTH_M, WINDOW[0], WINDOW[1]);
        let (height_m, width_m) = (WINDOW[2] - WINDOW[0], WINDOW[3] - WINDOW[1]);
        let (up, along, out) = (
            (DVec3::Y, height_m),
            (DVec3::Z, width_m),
            (DVec3::X, WINDOW_DEPTH_M),
        );
        self.place("sky", Mesh::wall(low, up, along, &[]), sky);
        let reveal = joined([
            Mesh::wall(low, along, out, &[]),
            Mesh::wall(low + DVec3::Y * height_m, out, along, &[]),
            Mesh::wall(low, out, up, &[]),
            Mesh::wall(low + DVec3::Z * width_m, up, out, &[]),
        ]);
        self.place("window reveal", reveal, self.white);
        // Two casements of six panes.
        let mut bars = Vec::new();
        let mut bar = |min: DVec2, max: DVec2, thick_m: f64| {
            let low = low + DVec3::new(0.05, min.y, min.x);
            bars.push(Mesh::cuboid(
                low,
                low + DVec3::new(thick_m, max.y - min.y, max.x - min.x),
            ));
        };
        for (at, half, thick) in [
            (0.03, 0.03, 0.06),
            (0.5 * width_m, 0.05, 0.06),
            (width_m - 0.03, 0.03, 0.06),
        ] {
            bar(
                DVec2::new(at - half, 0.0),
                DVec2::new(at + half, height_m),
                thick,
            );
        }
        for at in [0.25 * width_m, 0.75 * width_m] {
            bar(
                DVec2::new(at - 0.0125, 0.0),
                DVec2::new(at + 0.0125, height_m),
                0.025,
            );
        }
        for at in [0.03, height_m / 3.0, height_m * 2.0 / 3.0, height_m - 0.03] {
            let half = if at < 0.1 || at > height_m - 0.1 {
                0.03
            } else {
                0.0125
            };
            bar(
                DVec2::new(0.0, at - half),
                DVec2::new(width_m, at + half),
                0.03,
            );
        }
        self.place("window bars", joined(bars), self.white);
        let sill = rounded_cuboid(DVec3::new(0.18, 0.02, 0.5 * width_m + 0.06), 0.01, 2, 1);
        let sill = sill.moved(DVec3::new(
            ROOM_MIN.x + 0.02,
            low.y - 0.02,
            low.z + 0.5 * width_m,
        ));
        self.place("window sill", sill, self.white);

        let quarter = rotation(DVec3::Y, FRAC_PI_2);
        let rail = DVec3::new(ROOM_MIN.x + 0.11, 2.4, low.z + 0.5 * width_m);
        for (name, start_z) in [
            ("left curtain", low.z + width_m + 0.42),
            ("right curtain", low.z + 0.08),
        ] {
            let hung = furniture::curtain(0.5, 2.3, 7.0).turned(quarter);
            self.place(name, hung.moved(rail.with_z(start_z)), linen);
        }
        let half = DVec3::Z * (0.5 * width_m + 0.55);
        let rod = rod(rail - half, rail + half, 0.012, 16).moved(DVec3::Y * 0.015);
        let ends = [-1.0, 1.0]
            .map(|side| Mesh::icosphere(0.03, 2).moved(rail + half * side + DVec3::Y * 0.015));
        self.place(
            "curtain rod",
            joined([rod].into_iter().chain(ends)),
            self.brass,
        );
    }

    fn seats(&mut self) {
        let velvet = self
            .glb
            .material("green velvet", lambert([0.1, 0.22, 0.18]));
        let wool = self.glb.material("ochre wool", lambert([0.62, 0.38, 0.1]));
        let leather = self
            .glb
            .material("leather", glossy([0.3, 0.12, 0.05], 0.45));
        let rug = self.glb.texture("carpet", &texture::carpet(512, 4.0 / 3.0));
        let rug = self
            .glb
            .material("carpet", textured(lambert([1.0; 3]), rug));

        let place = DVec3::new(-0.3, 0.0, -2.1);
        let (upholstery, feet) = furniture::sofa(2.1, 3);
        self.place_smooth("sofa", upholstery.moved(place), velvet);
        self.place_smooth("sofa feet", feet.moved(place), self.brass);
        for (name, x, turn) in [("left pillow", -0.68, 0.35), ("right pillow", 0.62, -0.3)] {
            let pillow = furniture::pillow(0.42).turned(rotation(DVec3::Y, turn));
            self.place_smooth(name, pillow.moved(place + DVec3::new(x, 0.68, 0.12)), wool);
        }
        let place = DVec3::new(1.62, 0.0, -0.62);
        let turn = rotation(DVec3::Y, -1.05);
        let (upholstery, feet) = furniture::sofa(0.95, 1);
        self.place_smooth("armchair", upholstery.turned(turn).moved(place), leather);
        self.place_smooth("armchair feet", feet.turned(turn).moved(place), self.brass);
        // The pile stands a little unevenly.
        let (half_x, half_z) = (1.2, 0.9);
        let pile = Mesh::sheet(48, 36, |u, v| {
            let (column, row) = ((u * 48.0).round() as i64, (v * 36.0).round() as i64);
            let is_edge = column % 48 == 0 || row % 36 == 0;
            let height_m = if is_edge {
                0.0
            } else {
                0.01 + 0.002 * hash(column, row)
            };
            DVec3::new(half_x * (2.0 * u - 1.0), height_m, half_z * (1.0 - 2.0 * v))
        });
        let pile = pile
            .textured(|_, uv| DVec2::new(uv.x, 1.0 - uv.y))
            .shaded(89.0);
        self.place_smooth("carpet", pile.moved(TABLE_TOP.with_y(0.001)), rug);
    }

    fn coffee_table(&mut self) {
        let glass = self.glb.material("glass", glass(1.5, 0.01));
        let steel = self
            .glb
            .material("brushed steel", metal([0.58, 0.57, 0.55], 0.35));
        let orange = self.glb.material("orange", glossy([0.8, 0.32, 0.03], 0.45));
        let leaves = self
            .glb
            .material("grey leaves", glossy([0.25, 0.36, 0.28], 0.5));
        let half = DVec3::new(0.58, 0.018, 0.33);
        let top = rounded_cuboid(half, 0.015, 4, 2).textured(|p, _| DVec2::new(p.x, p.z) / 0.6);
        self.place(
            "table top",
            top.moved(TABLE_TOP - DVec3::Y * half.y),
            self.oak,
        );
        let mut frame = Vec::new();
        for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let foot = TABLE_TOP + DVec3::new(0.5 * x, 0.013 - TABLE_TOP.y, 0.27 * z);
            frame.push(rod(
                foot,
                foot + DVec3::new(-0.03 * x, 0.373, -0.02 * z),
                0.014,
                20,
            ));
        }
        self.place("table legs", joined(frame), steel);

        let bowl = [[0.05, 0.0], [0.06, 0.012], [0.13, 0.05], [0.165, 0.1]];
        let bowl_at = TABLE_TOP + DVec3::new(0.2, 0.0, 0.06);
        self.place_smooth(
            "bowl",
            furniture::turned_vessel(bowl, 0.008, 64).moved(bowl_at),
            self.ceramic,
        );
        let mut fruit = Vec::new();
        for (x, y, z) in [
            (-0.06, 0.058, 0.03),
            (0.055, 0.058, 0.035),
            (0.0, 0.058, -0.065),
            (0.0, 0.118, 0.0),
        ] {
            let flat = DVec3::new(1.0, 0.94, 1.0);
            fruit.push(
                Mesh::icosphere(0.043, 3)
                    .deformed(|p| p * flat)
                    .moved(bowl_at + DVec3::new(x, y, z)),
            );
        }
        self.place("oranges", joined(fruit), orange);

        let vase = [
            [0.035, 0.0],
            [0.05, 0.02],
            [0.075, 0.09],
            [0.06, 0.17],
            [0.032, 0.22],
            [0.045, 0.26],
        ];
        let vase_at = TABLE_TOP + DVec3::new(-0.32, 0.0002, -0.05);
        self.place_smooth(
            "glass vase",
            furniture::turned_vessel(vase, 0.005, 48).moved(vase_at),
            glass,
        );
        let mut twigs = Vec::new();
        for (number, (x, z)) in [(0.12, 0.05), (-0.13, 0.02), (0.02, -0.1)]
            .into_iter()
            .enumerate()
        {
            let path = |t: f64| DVec3::new(x * t * t, 0.02 + 0.5 * t, z * t * t);
            twigs.push(tube(6, 14, |t| (path(t), 0.0025 * (1.001 - t), DVec3::X)));
            for step in 0..14 {
                let t = 0.5 + 0.5 * f64::from(step) / 13.0;
                let angle = f64::from(step) * 2.4 + number as f64;
                let blade =
                    leaf(0.075 * (1.4 - 0.6 * t), 0.03, 0.5).turned(rotation(DVec3::X, -0.3));
                twigs.push(blade.turned(rotation(DVec3::Y, angle)).moved(path(t)));
            }
        }
        self.place("twigs", joined(twigs).moved(vase_at), leaves);

        let cup = [[0.022, 0.0], [0.028, 0.008], [0.04, 0.04], [0.042, 0.065]];
        let saucer = [[0.035, 0.0], [0.045, 0.004], [0.075, 0.014]];
        let cup_at = TABLE_TOP + DVec3::new(-0.08, 0.0, 0.2);
        let cup = furniture::turned_vessel(cup, 0.003, 40).moved(cup_at + DVec3::Y * 0.0045);
        let saucer = furniture::turned_vessel(saucer, 0.004, 40).moved(cup_at);
        self.place_smooth("cup and saucer", joined([cup, saucer]), self.ceramic);
    }

    fn bookcase(&mut self) {
        let spines = self.glb.texture("book spines", &texture::spines(256));
        let cloth = self
            .glb
            .material("book cloth", textured(glossy([1.0; 3], 0.55), spines));
        let paper = self.glb.material("paper", lambert([0.75, 0.7, 0.58]));
        let (low, high) = (DVec3::new(1.3, 0.0, -2.585), DVec3::new(2.45, 2.1, -2.3));
        const BOARD_M: f64 = 0.025;
        const SHELVES: u32 = 6;
        let pitch_m = (high.y - BOARD_M) / f64::from(SHELVES);
        let mut boards = vec![
            Mesh::cuboid(low, high.with_x(low.x + BOARD_M)),
            Mesh::cuboid(low.with_x(high.x - BOARD_M), high),
            Mesh::cuboid(
                low + DVec3::X * BOARD_M,
                DVec3::new(high.x - BOARD_M, high.y, low.z + 0.01),
            ),
        ];
        let (mut covers, mut pages) = (Vec::new(), Vec::new());
        for shelf in 0..=SHELVES {
            let y = f64::from(shelf) * pitch_m;
            let from = DVec3::new(low.x + BOARD_M, y, low.z + 0.01);
            boards.push(Mesh::cuboid(
                from,
                DVec3::new(high.x - BOARD_M, y + BOARD_M, high.z - 0.005),
            ));
            if shelf < SHELVES {
                let inner_m = high.x - low.x - 2.0 * BOARD_M - 0.01;
                // Room is left for ornaments on two shelves.
                let share = if shelf == 2 || shelf == 4 { 0.62 } else { 0.97 };
                let (cover, leaves) =
                    furniture::row_of_books(inner_m * share, pitch_m - BOARD_M, i64::from(shelf));
                let place = DVec3::new(from.x + 0.005, y + BOARD_M, high.z - 0.03);
                covers.push(cover.moved(place));
                pages.push(leaves.moved(place));
            }
        }
        let boards = joined(boards).textured(|p, _| DVec2::new(p.y, p.x + p.z) / 0.6);
        self.place("bookcase", boards, self.oak);
        self.place_smooth("book covers", joined(covers), cloth);
        self.place_smooth("book pages", joined(pages), paper);
        let jar = [
            [0.04, 0.0],
            [0.06, 0.03],
            [0.075, 0.1],
            [0.05, 0.17],
            [0.03, 0.19],
            [0.035, 0.21],
        ];
        let jar_at = DVec3::new(2.24, 2.0 * pitch_m + BOARD_M, -2.43);
        self.place_smooth(
            "jar",
            furniture::turned_vessel(jar, 0.006, 36).moved(jar_at),
            self.ceramic,
        );
        let ball_at = DVec3::new(2.2, 4.0 * pitch_m + BOARD_M + 0.08, -2.43);
        self.place(
            "brass ball",
            Mesh::icosphere(0.08, 3).moved(ball_at),
            self.brass,
        );
    }

    fn lamp_corner(&mut self) {
        let bulb_light = self.glb.material("bulb", lamp([420.0, 290.0, 160.0]));
        let cloth = self.glb.material("lamp shade", lambert([0.8, 0.7, 0.52]));
        let glaze = self
            .glb
            .material("blue glaze", glossy([0.04, 0.12, 0.26], 0.15));
        let place = DVec3::new(1.02, 0.0, -2.22);
        let top_m = 0.58;
        let top = Mesh::lathe(
            &[
                [0.0, top_m - 0.02],
                [0.2, top_m - 0.02],
                [0.2, top_m],
                [0.0, top_m],
            ]
            .map(DVec2::from_array),
            64,
        );
        self.place(
            "side table",
            top.textured(|p, _| DVec2::new(p.x, p.z)).moved(place),
            self.oak,
        );
        let stem = rod(DVec3::Y * 0.02, DVec3::Y * (top_m - 0.02), 0.015, 24);
        let foot = Mesh::lathe(
            &[[0.0, 0.0], [0.14, 0.0], [0.14, 0.012], [0.0, 0.02]].map(DVec2::from_array),
            48,
        );
        self.place(
            "side table foot",
            joined([stem, foot]).moved(place),
            self.brass,
        );
        let [foot, stem, shade, bulb] =
            furniture::table_lamp().map(|part| part.moved(place + DVec3::Y * top_m));
        self.place_smooth("lamp foot", foot, glaze);
        self.place_smooth("lamp stem", stem, self.brass);
        self.place_smooth("lamp shade", shade, cloth);
        self.place_smooth("bulb", bulb, bulb_light);
    }

    fn right_wall(&mut self) {
        let mirror = self.glb.material("mirror", metal([0.95; 3], 0.0));
        let gilt = self
            .glb
            .material("gilt wood", metal([0.85, 0.62, 0.3], 0.45));
        let landscape = self
            .glb
            .texture("landscape", &painting::landscape(512, 1.457));
        let landscape = self
            .glb
            .material("landscape", textured(glossy([1.0; 3], 0.5), landscape));
        let face_left = rotation(DVec3::Y, -FRAC_PI_2);
        let (disc, frame) = furniture::round_mirror(0.42);
        let at = DVec3::new(ROOM_MAX.x - 0.001, 1.5, -1.25);
        self.place_smooth("mirror", disc.turned(face_left).moved(at), mirror);
        self.place_smooth(
            "mirror frame",
            frame.turned(face_left).moved(at),
            self.brass,
        );
        let (low, high) = (DVec3::new(2.2, 0.12, -1.95), DVec3::new(2.585, 0.82, -0.55));
        let chest = rounded_cuboid((high - low) * 0.5, 0.012, 3, 2).moved((low + high) * 0.5);
        let chest = chest.textured(|p, _| DVec2::new(p.z, p.y + p.x) / 0.6);
        self.place("chest", chest, self.oak);
        let mut knobs = Vec::new();
        for (y, z) in [(0.3, -1.6), (0.3, -0.9), (0.6, -1.6), (0.6, -0.9)] {
            knobs.push(Mesh::icosphere(0.016, 2).moved(DVec3::new(low.x - 0.014, y, z)));
        }
        for (x, z) in [(2.25, -1.9), (2.54, -1.9), (2.25, -0.6), (2.54, -0.6)] {
            knobs.push(rod(
                DVec3::new(x, 0.0, z),
                DVec3::new(x, 0.121, z),
                0.016,
                16,
            ));
        }
        self.place("chest fittings", joined(knobs), self.brass);
        let bottle = [
            [0.06, 0.0],
            [0.08, 0.02],
            [0.1, 0.12],
            [0.06, 0.24],
            [0.025, 0.3],
            [0.022, 0.37],
            [0.035, 0.39],
        ];
        let bottle =
            furniture::turned_vessel(bottle, 0.006, 40).moved(DVec3::new(2.4, high.y, -0.85));
        self.place_smooth("bottle vase", bottle, self.ceramic);

        let (width_m, height_m, moulding_m) = (1.1, 0.755, 0.06);
        let at = DVec3::new(-0.3, 1.62, ROOM_MIN.z + 0.001);
        self.place_smooth(
            "painting",
            furniture::picture(width_m, height_m, moulding_m).moved(at),
            landscape,
        );
        self.place_smooth(
            "painting frame",
            furniture::picture_frame(width_m, height_m, moulding_m).moved(at),
            gilt,
        );
    }

    fn plant(&mut self) {
        let terracotta = self
            .glb
            .material("glazed terracotta", glossy([0.55, 0.2, 0.1], 0.3));
        let earth = self.glb.material("earth", lambert([0.07, 0.045, 0.03]));
        let green = self.glb.material("leaves", glossy([0.07, 0.24, 0.06], 0.4));
        let place = DVec3::new(-2.05, 0.0, -2.1);
        let (pot, soil, greens) = furniture::plant(1.45, 34);
        self.place_smooth("pot", pot.moved(place), terracotta);
        self.place_smooth("earth", soil.moved(place), earth);
        self.place_smooth("leaves", greens.moved(place), green);
    }

    fn place(&mut self, name: &str, mesh: Mesh, material: usize) {
        self.glb.place(name, &mesh.shaded(CREASE_DEG), material);
    }

    /// Places a mesh that has its normals already.
    fn place_smooth(&mut self, name: &str, mesh: Mesh, material: usize) {
        self.glb.place(name, &mesh, material);
    }
}
