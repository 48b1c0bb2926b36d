//! What the tests share: a recording to replay, an application's way to a Vulkan device, its frame loop.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk::{self, Handle as _};
use openxr as xr;
use xr_sim::{ClockKind, Config};

/// The first predicted display time of [`recording`].
pub const FIRST_NS: i64 = 5_000_000_000;
/// From frame to frame of [`recording`]: 90 Hz.
pub const PERIOD_NS: i64 = 11_111_111;

/// What is configured holds for the process: tests that configure take turns.
pub fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A test's configuration: virtual time and small images.
pub fn config() -> Config {
    Config {
        clock: ClockKind::Virtual,
        eye_width: 64,
        eye_height: 48,
        ..Config::default()
    }
}

/// The display time of a recorded frame.
pub fn frame_ns(frame: i64) -> i64 {
    FIRST_NS + frame * PERIOD_NS
}

/// Writes a session folder: the head moves right 1 cm a frame and turns left 1 degree a frame; gaze at
/// 200 Hz goes from ahead to the right, with a blink from 100 to 150 ms.
pub fn recording(folder: &Path, frame_count: i64) {
    let mut frames = String::from(
        "frame,trial,predicted_display_ns,period_ns,head_px,head_py,head_pz,head_qx,head_qy,head_qz,head_qw,head_flags,\
         l_px,l_py,l_pz,l_qx,l_qy,l_qz,l_qw,l_fov_l,l_fov_r,l_fov_u,l_fov_d,\
         r_px,r_py,r_pz,r_qx,r_qy,r_qz,r_qw,r_fov_l,r_fov_r,r_fov_u,r_fov_d,extra\n",
    );
    for frame in 0..frame_count {
        let half_angle = (frame as f64).to_radians() / 2.0;
        let (sin, cos) = half_angle.sin_cos();
        let x = 0.01 * frame as f64;
        writeln!(
            frames,
            "{frame},,{},{PERIOD_NS},{x},0,0,0,{sin},0,{cos},15,\
             -0.032,0,0,0,0,0,1,-0.8,0.7,0.75,-0.85,0.032,0,0,0,0,0,1,-0.7,0.8,0.75,-0.85,more",
            frame_ns(frame),
        )
        .unwrap();
    }
    fs::write(folder.join("frames.csv"), frames).unwrap();
    let mut gaze = String::from("time_ns,recv_ns,valid,ox,oy,oz,dx,dy,dz,confidence\n");
    for sample in 0..frame_count * 20 / 9 {
        let time_ns = gaze_ns(sample);
        let valid = u8::from(!is_blink(sample));
        let (dx, dz) = gaze_direction(sample);
        writeln!(
            gaze,
            "{time_ns},{},{valid},0,0.01,0,{dx},0,{dz},1",
            time_ns + 4_000_000
        )
        .unwrap();
    }
    fs::write(folder.join("gaze.csv"), gaze).unwrap();
}

/// The time of a gaze sample: 200 Hz, 2 ms off the frames.
pub fn gaze_ns(sample: i64) -> i64 {
    FIRST_NS - 2_000_000 + sample * 5_000_000
}

/// Whether the eyes are shut.
pub fn is_blink(sample: i64) -> bool {
    (20..30).contains(&sample)
}

/// x and z of the gaze.
pub fn gaze_direction(sample: i64) -> (f64, f64) {
    let angle = (0.1 * sample as f64).to_radians();
    (angle.sin(), -angle.cos())
}

/// The entry into the runtime linked into this test.
pub fn entry() -> xr::Entry {
    // SAFETY: the runtime's own entry point
    unsafe { xr::Entry::from_get_instance_proc_addr(xr_sim::get_instance_proc_addr, &()) }.unwrap()
}

/// An instance with the extensions of a gaze application, and its headset.
pub fn instance(entry: &xr::Entry, version: xr::Version) -> (xr::Instance, xr::SystemId) {
    let mut extensions = xr::ExtensionSet::default();
    extensions.khr_vulkan_enable2 = true;
    extensions.khr_composition_layer_depth = true;
    extensions.ext_eye_gaze_interaction = true;
    extensions.mnd_headless = true;
    let application = xr::ApplicationInfo {
        application_name: "test",
        api_version: version,
        ..Default::default()
    };
    let instance = entry
        .create_instance(&application, &extensions, &[], &())
        .unwrap();
    let system = instance
        .system(xr::FormFactor::HEAD_MOUNTED_DISPLAY)
        .unwrap();
    (instance, system)
}

/// OpenXR 1.0, as most applications ask for.
pub const V1_0: xr::Version = xr::Version::new(1, 0, 0);
/// OpenXR 1.1.
pub const V1_1: xr::Version = xr::Version::new(1, 1, 0);

/// An application's Vulkan, made through XR_KHR_vulkan_enable2.
pub struct Vulkan {
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    pub queue: vk::Queue,
    pool: vk::CommandPool,
    _entry: ash::Entry,
}

impl Vulkan {
    /// None, loudly, where the machine has no Vulkan device.
    pub fn new(xr_instance: &xr::Instance, system: xr::SystemId) -> Option<Self> {
        let made = Self::try_new(xr_instance, system);
        if made.is_none() {
            eprintln!("SKIPPED: no Vulkan device here");
        }
        made
    }

    fn try_new(xr_instance: &xr::Instance, system: xr::SystemId) -> Option<Self> {
        // SAFETY: plain use of Vulkan, by the application's part of XR_KHR_vulkan_enable2
        unsafe {
            let entry = ash::Entry::load().ok()?;
            xr_instance
                .graphics_requirements::<xr::Vulkan>(system)
                .unwrap();
            let get_instance_proc_addr = std::mem::transmute::<
                vk::PFN_vkGetInstanceProcAddr,
                xr::sys::platform::VkGetInstanceProcAddr,
            >(entry.static_fn().get_instance_proc_addr);
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_1);
            let info = vk::InstanceCreateInfo::default().application_info(&application);
            let raw = xr_instance
                .create_vulkan_instance(system, get_instance_proc_addr, (&raw const info).cast())
                .unwrap()
                .ok()?;
            let instance =
                ash::Instance::load(entry.static_fn(), vk::Instance::from_raw(raw as u64));
            if instance.enumerate_physical_devices().ok()?.is_empty() {
                return None;
            }
            let raw_device = xr_instance.vulkan_graphics_device(system, raw).unwrap();
            let physical_device = vk::PhysicalDevice::from_raw(raw_device as u64);
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(0)
                .queue_priorities(&[1.0])];
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues);
            let raw = xr_instance
                .create_vulkan_device(
                    system,
                    get_instance_proc_addr,
                    raw_device,
                    (&raw const info).cast(),
                )
                .unwrap()
                .unwrap();
            let device = ash::Device::load(instance.fp_v1_0(), vk::Device::from_raw(raw as u64));
            let queue = device.get_device_queue(0, 0);
            let pool = device
                .create_command_pool(&vk::CommandPoolCreateInfo::default(), None)
                .unwrap();
            Some(Self {
                instance,
                physical_device,
                device,
                queue,
                pool,
                _entry: entry,
            })
        }
    }

    /// What a session is made with.
    pub fn session_info(&self) -> xr::vulkan::SessionCreateInfo {
        xr::vulkan::SessionCreateInfo {
            instance: self.instance.handle().as_raw() as _,
            physical_device: self.physical_device.as_raw() as _,
            device: self.device.handle().as_raw() as _,
            queue_family_index: 0,
            queue_index: 0,
        }
    }

    /// Clears one layer of an image that is in COLOR_ATTACHMENT_OPTIMAL, and leaves it there.
    pub fn clear(&self, image: u64, layer: u32, color: [f32; 4]) {
        let image = vk::Image::from_raw(image);
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(1)
            .base_array_layer(layer)
            .layer_count(1);
        let (held, writable) = (
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        );
        let barrier = |from, to| {
            vk::ImageMemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
                .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
                .old_layout(from)
                .new_layout(to)
                .image(image)
                .subresource_range(range)
        };
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        // SAFETY: an acquired image; the queue is idle when this returns
        unsafe {
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.pool)
                .command_buffer_count(1);
            let commands = self.device.allocate_command_buffers(&info).unwrap();
            self.device
                .begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default())
                .unwrap();
            let step = |from, to| {
                let none = vk::DependencyFlags::empty();
                let barriers = [barrier(from, to)];
                self.device
                    .cmd_pipeline_barrier(commands[0], all, all, none, &[], &[], &barriers);
            };
            step(held, writable);
            let value = vk::ClearColorValue { float32: color };
            self.device
                .cmd_clear_color_image(commands[0], image, writable, &value, &[range]);
            step(writable, held);
            self.device.end_command_buffer(commands[0]).unwrap();
            let submit = vk::SubmitInfo::default().command_buffers(&commands);
            self.device
                .queue_submit(self.queue, &[submit], vk::Fence::null())
                .unwrap();
            self.device.queue_wait_idle(self.queue).unwrap();
            self.device.free_command_buffers(self.pool, &commands);
        }
    }
}

impl Drop for Vulkan {
    fn drop(&mut self) {
        // SAFETY: the session is gone, nothing is pending
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// The session states that wait in the queue.
pub fn poll_states(instance: &xr::Instance) -> Vec<xr::SessionState> {
    let mut buffer = xr::EventDataBuffer::new();
    let mut states = Vec::new();
    while let Some(event) = instance.poll_event(&mut buffer).unwrap() {
        if let xr::Event::SessionStateChanged(change) = event {
            states.push(change.state());
        }
    }
    states
}
