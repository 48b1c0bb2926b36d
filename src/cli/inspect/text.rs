//! The page of `macula inspect` for people.

use std::fmt::Write as _;

use super::price::{base, price};
use super::{CameraSummary, Inspection, LightSummary, MaterialSummary, TextureSummary};
use crate::scene::effects::EffectReport;

impl Inspection {
    /// The page for people.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}\n  sha256 {}\n",
            self.scene.display(),
            self.content_sha256
        );
        section(&mut text, "Geometry", &self.geometry_rows());
        section(&mut text, "Lights", &self.light_rows());
        section(&mut text, "Materials", &self.material_rows());
        section(&mut text, "Textures", &self.texture_rows());
        section(&mut text, "Cameras", &self.camera_rows());
        section(&mut text, "Animation", &self.animation_rows());
        let memory = &self.memory;
        let memory_rows = [
            row(["host", &mebibytes(memory.host_bytes)]),
            row(["GPU geometry", &mebibytes(memory.gpu_geometry_bytes)]),
            row(["GPU textures", &mebibytes(memory.gpu_texture_bytes)]),
        ];
        section(&mut text, "Memory", &memory_rows);
        let effect = |report: &EffectReport| {
            let mut cells = vec![
                if report.on { "on" } else { "off" }.to_owned(),
                report.effect.to_owned(),
            ];
            if let Some(costs) = &self.effect_costs {
                let mut effects = costs.effects.iter();
                let cost = effects.find(|cost| cost.effect == report.effect);
                let price = cost.map(|cost| price(cost, costs.technique, costs.frame_ms));
                cells.push(price.unwrap_or("not measured".to_owned()));
            }
            cells.push(report.why.clone());
            cells
        };
        if let Some(costs) = &self.effect_costs {
            section(&mut text, "Frames that were timed", &base(costs));
        }
        section(
            &mut text,
            "Effects",
            &self.effects.iter().map(effect).collect::<Vec<_>>(),
        );
        let passes: Vec<_> = self
            .passes
            .iter()
            .map(|(technique, passes)| row([technique, passes.join(", ").as_str()]))
            .collect();
        section(&mut text, "Passes", &passes);
        let warnings: Vec<_> = self.warnings.iter().map(|w| row([w.as_str()])).collect();
        section(&mut text, "Warnings", &warnings);
        text
    }

    fn geometry_rows(&self) -> Vec<Vec<String>> {
        let geometry = &self.geometry;
        let triangles = format!(
            "{} static, {} moving",
            grouped(geometry.static_triangles),
            grouped(geometry.moving_triangles)
        );
        let (min, max) = (geometry.min_in_file_m, geometry.max_in_file_m);
        let bvh = format!(
            "{} nodes, depth {}",
            grouped(geometry.bvh_nodes),
            geometry.bvh_depth
        );
        vec![
            row(["triangles", &triangles]),
            row(["vertices", &grouped(geometry.vertices)]),
            row(["size", &format!("{} m", triple(geometry.size_m))]),
            row(["from, to", &format!("{}, {} m", triple(min), triple(max))]),
            row(["hierarchy", &bvh]),
        ]
    }

    fn light_rows(&self) -> Vec<Vec<String>> {
        let of = |light: &LightSummary| {
            let area = light
                .area_m2
                .map(|area| format!("{} m2", significant(area)));
            row([
                light.kind,
                &light.name,
                &format!("{} {}", triple(light.emission), light.unit),
                &area.unwrap_or_default(),
                if light.is_moving { "moving" } else { "" },
            ])
        };
        self.lights.iter().map(of).collect()
    }

    fn material_rows(&self) -> Vec<Vec<String>> {
        let of = |material: &MaterialSummary| {
            row([
                &material.name,
                &triple(material.base_color),
                &format!("{} triangles", grouped(material.triangles)),
                &material.surface,
            ])
        };
        self.materials.iter().map(of).collect()
    }

    fn texture_rows(&self) -> Vec<Vec<String>> {
        let of = |texture: &TextureSummary| {
            row([
                &format!("{}x{}", texture.width_px, texture.height_px),
                texture.color_space,
                texture.filter,
                &texture.wrap.join(", "),
            ])
        };
        self.textures.iter().map(of).collect()
    }

    fn camera_rows(&self) -> Vec<Vec<String>> {
        let of = |(index, camera): (usize, &CameraSummary)| {
            row([
                &index.to_string(),
                &camera.name,
                &format!("at {} m", triple(camera.position_in_file_m)),
                &format!("looking {}", triple(camera.forward)),
                &format!(
                    "{} deg high",
                    significant(f64::from(camera.yfov_rad).to_degrees())
                ),
                if camera.is_moving { "moving" } else { "" },
            ])
        };
        self.cameras.iter().enumerate().map(of).collect()
    }

    fn animation_rows(&self) -> Vec<Vec<String>> {
        if self.animation.duration_s == 0.0 {
            return Vec::new();
        }
        let loop_of = format!("{} s", significant(self.animation.duration_s));
        vec![
            row(["loop", &loop_of]),
            row(["objects", &self.animation.objects.join(", ")]),
        ]
    }
}

/// Lines of aligned columns under a heading; nothing where there are no lines.
fn section(text: &mut String, heading: &str, rows: &[Vec<String>]) {
    if rows.is_empty() {
        return;
    }
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let _ = writeln!(text, "\n{heading}");
    for row in rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            let _ = write!(line, "  {cell:<width$}");
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
}

pub(super) fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

/// 787188 as `787 188`.
pub(super) fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

fn mebibytes(bytes: usize) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

fn triple<T: Into<f64> + Copy>(values: [T; 3]) -> String {
    values.map(|value| significant(value.into())).join(" ")
}

/// Four significant digits without a tail of zeros.
pub(super) fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let decimals = (3.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_and_rounded_for_reading() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(787_188), "787 188");
        assert_eq!(grouped(1_000_000), "1 000 000");
        for (value, text) in [
            (0.0, "0"),
            (0.5, "0.5"),
            (-1.25, "-1.25"),
            (112.79886, "112.8"),
            (12048.179, "12048"),
            (1e-7, "1.000e-7"),
        ] {
            assert_eq!(significant(value), text);
        }
    }
}
