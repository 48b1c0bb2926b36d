//! Makes the pictures that tests judge, and the scenes that they build themselves.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use glam::Vec3;
use macula::gpu::{GpuDevice, Headless};
use macula::image::LinearImage;
use macula::params::Params;
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;
use macula::still::Still;
use macula::technique::{self, Statistics};
use serde_json::{Value, json};

use crate::glb::Glb;

/// The device, one for all tests of the process.
pub fn gpu() -> &'static GpuDevice {
    static GPU: LazyLock<GpuDevice> =
        LazyLock::new(|| GpuDevice::create(&Headless::default()).expect("a Vulkan device"));
    &GPU
}

/// A texture that an eye's frame of this size can be shown on.
pub fn eye_target([width, height]: [u32; 2]) -> wgpu::TextureView {
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: EYE_FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// The format of [`eye_target`].
pub const EYE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// How a picture is made.
#[derive(Clone)]
pub struct Recipe {
    technique: &'static str,
    size: (u32, u32),
    passes: u32,
    params: Params,
}

/// A picture and what its last pass counted.
pub struct Picture {
    pub image: LinearImage,
    pub statistics: Statistics,
}

impl Recipe {
    /// 64x64 pixels in one pass of 20 000 photon paths.
    pub fn new(technique: &'static str) -> Self {
        Self {
            technique,
            size: (64, 64),
            passes: 1,
            params: Params::default(),
        }
        .set("photon.count", "20000")
    }

    pub fn size(self, width: u32, height: u32) -> Self {
        let size = (width, height);
        Self { size, ..self }
    }

    pub fn passes(self, passes: u32) -> Self {
        Self { passes, ..self }
    }

    pub fn set(mut self, key: &str, value: &str) -> Self {
        self.params.set(key, value).unwrap();
        self
    }

    /// Renders what the scene's first camera sees.
    pub fn render(&self, scene: &Path) -> Picture {
        self.render_scene(&Scene::load(scene).unwrap())
    }

    pub fn render_scene(&self, scene: &Scene) -> Picture {
        let loaded = LoadedScene::new(gpu(), scene.clone()).unwrap();
        let mut still = self.still(&loaded);
        for _ in 0..self.passes {
            still.add_pass().unwrap();
        }
        Picture {
            image: still.read().unwrap(),
            statistics: still.statistics().unwrap(),
        }
    }

    /// What the scene's first camera sees, before the first pass.
    pub fn still<'a>(&self, loaded: &'a LoadedScene) -> Still<'a> {
        let view = loaded.scene.cameras[0].view(self.size.0, self.size.1);
        let entry = technique::find(self.technique).unwrap();
        Still::start(gpu(), loaded, &self.params, entry, view, self.size, None).unwrap()
    }
}

impl Picture {
    /// A count of the last pass, by its name in the statistics.
    pub fn count(&self, name: &str) -> f64 {
        let found = self.statistics.counts.iter().find(|(n, _)| *n == name);
        found.unwrap_or_else(|| panic!("no count {name}")).1
    }
}

/// Mean radiance of each channel.
pub fn mean(image: &LinearImage) -> [f64; 3] {
    let pixels = image.rgb.len() as f64;
    [0, 1, 2].map(|c| image.rgb.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels)
}

/// The means of `side` × `side` pixels: what the same view gives with that many pixels fewer, as a pixel is the mean over its square.
pub fn reduced(image: &LinearImage, side: u32) -> LinearImage {
    let (width, height) = (image.width / side, image.height / side);
    let block = |x: u32, y: u32| {
        let pixels = (0..side * side).map(|i| {
            let (x, y) = (x * side + i % side, y * side + i / side);
            image.rgb[(y * image.width + x) as usize]
        });
        let sums = pixels.fold([0.0; 3], |sum: [f64; 3], p| {
            [0, 1, 2].map(|c| sum[c] + f64::from(p[c]))
        });
        sums.map(|sum| (sum / f64::from(side * side)) as f32)
    };
    let rgb = (0..width * height).map(|i| block(i % width, i / width));
    LinearImage {
        width,
        height,
        rgb: rgb.collect(),
    }
}

/// The largest |a - b| / max(b, floor) over all channels, where `floor` is a share of `b`'s mean.
pub fn largest_relative_difference(a: &LinearImage, b: &LinearImage, floor_share: f64) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let floor = floor_share * mean(b).iter().sum::<f64>() / 3.0;
    let pairs = a.rgb.as_flattened().iter().zip(b.rgb.as_flattened());
    pairs
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs() / f64::from(*b).max(floor))
        .fold(0.0, f64::max)
}

/// Whether each channel's mean is the reference's within `tolerance`; the ratios where it is not.
pub fn means_agree(means: [f64; 3], reference: [f64; 3], tolerance: f64) -> Result<(), String> {
    let ratios = [0, 1, 2].map(|c| means[c] / reference[c]);
    let is_near = |ratio: &f64| (ratio - 1.0).abs() <= tolerance;
    let report = || format!("mean over reference is {ratios:?}");
    ratios.iter().all(is_near).then_some(()).ok_or_else(report)
}

/// A bundled scene.
pub fn bundled(name: &str) -> PathBuf {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    assets.join(name)
}

/// A material that reflects `base_color`/pi in all directions and nothing else.
pub fn lambert(base_color: [f32; 3]) -> Value {
    let [r, g, b] = base_color;
    json!({
        "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}},
        "doubleSided": true,
    })
}

/// A black material of its own radiance, W/(m2 sr).
pub fn glowing(radiance: [f32; 3]) -> Value {
    let mut material = lambert([0.0; 3]);
    material["emissiveFactor"] = json!(radiance);
    material
}

/// A perfect mirror.
pub fn mirror() -> Value {
    json!({"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}, "doubleSided": true})
}

/// A scene under construction.
pub struct Stage {
    pub glb: Glb,
}

impl Stage {
    /// With the camera at `eye`, which looks at `target`, 60 degrees high.
    pub fn new(eye: Vec3, target: Vec3) -> Self {
        let mut glb = Glb::new();
        glb.json["extensionsUsed"] = json!(["KHR_materials_specular", "KHR_lights_punctual"]);
        let camera = json!({"type": "perspective", "perspective": {"yfov": 60f32.to_radians(), "znear": 0.01}});
        let camera = glb.push("cameras", camera);
        let dir = (target - eye).normalize();
        let up = if dir.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y };
        let rotation = glam::Quat::from_mat3(&glam::Mat3::from_cols(
            dir.cross(up).normalize(),
            dir.cross(up).cross(dir).normalize(),
            -dir,
        ));
        glb.root(json!({"camera": camera, "translation": eye.to_array(), "rotation": rotation.to_array()}));
        Self { glb }
    }

    /// A parallelogram with a corner at `corner` and sides `u`, `v`; its front is towards u × v.
    pub fn quad(self, corner: Vec3, u: Vec3, v: Vec3, material: Value) -> Self {
        let corners = [corner, corner + u, corner + u + v, corner + v];
        self.triangles(&corners, &[0, 1, 2, 0, 2, 3], material)
    }

    /// Triangles by their corners' places in `positions`; their fronts are where the corners run anticlockwise.
    pub fn triangles(mut self, positions: &[Vec3], corners: &[u32], material: Value) -> Self {
        let positions: Vec<[f32; 3]> = positions.iter().map(|p| p.to_array()).collect();
        let mesh = self.glb.mesh("triangles", &positions, corners);
        let material = self.glb.push("materials", material);
        self.glb.json["meshes"][mesh]["primitives"][0]["material"] = json!(material);
        self.glb.root(json!({"mesh": mesh}));
        self
    }

    /// The six faces of a box about `center`, fronts outward; inward where `half_m` is negative.
    pub fn cuboid(mut self, center: Vec3, half_m: Vec3, material: Value) -> Self {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let [out, u, v] = [0, 1, 2].map(|turn| {
                    let axis = (axis + turn) % 3;
                    Vec3::AXES[axis] * half_m[axis]
                });
                let (u, v) = if side > 0.0 { (u, v) } else { (v, u) };
                let corner = center + side * out - u - v;
                self = self.quad(corner, 2.0 * u, 2.0 * v, material.clone());
            }
        }
        self
    }

    /// A point light of the given intensity, W/sr.
    pub fn point_light(self, position_m: Vec3, intensity: f32) -> Self {
        let light = json!({"type": "point", "intensity": intensity});
        self.light(light, json!({"translation": position_m.to_array()}))
    }

    /// A light of KHR_lights_punctual at a node.
    pub fn light(mut self, light: Value, mut node: Value) -> Self {
        if self.glb.json["extensions"].is_null() {
            self.glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": []}});
        }
        let lights = &mut self.glb.json["extensions"]["KHR_lights_punctual"]["lights"];
        let lights = lights.as_array_mut().unwrap();
        lights.push(light);
        let index = lights.len() - 1;
        node["extensions"] = json!({"KHR_lights_punctual": {"light": index}});
        self.glb.root(node);
        self
    }

    /// All of it, camera too, under a node that moves, turns or scales it.
    pub fn under_node(mut self, mut node: Value) -> Self {
        node["children"] = self.glb.json["scenes"][0]["nodes"].take();
        self.glb.json["scenes"][0]["nodes"] = json!([]);
        self.glb.root(node);
        self
    }

    pub fn load(&self) -> Scene {
        Scene::load(&self.glb.save().path).unwrap()
    }
}
