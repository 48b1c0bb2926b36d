//! Writing a session folder: each line reaches the system whole and at once, so that a crash costs at most the last one.

use std::fmt::{Display, Write as _};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use serde::Serialize;

use super::{
    EYE_PREFIXES, EventRecord, FORMAT, FrameRecord, Metadata, Session, TraceError, VERSION, files,
};
use crate::gaze::sample::{unit, unit_rotation};
use crate::gaze::{GazeRay, GazeSample};
use crate::view::Pose;

#[derive(Serialize)]
struct Envelope<'a> {
    format: &'a str,
    version: u32,
    #[serde(flatten)]
    metadata: &'a Metadata,
}

/// Writes a session folder line by line while it is recorded.
pub struct SessionWriter {
    folder: PathBuf,
    gaze: Log,
    frames: Log,
    events: Log,
}

impl SessionWriter {
    /// Makes the folder, where it is missing, and its files. Files of an earlier session are never written over.
    pub fn create(folder: &Path, metadata: &Metadata) -> Result<Self, TraceError> {
        fs::create_dir_all(folder).map_err(|source| write_error(folder, source))?;
        let writer = Self {
            folder: folder.to_owned(),
            gaze: Log::create(folder.join(files::GAZE), &gaze_header())?,
            frames: Log::create(folder.join(files::FRAMES), &frames_header())?,
            events: Log::create(folder.join(files::EVENTS), "time_ns,event,trial,value")?,
        };
        writer.write_metadata(metadata)?;
        Ok(writer)
    }

    /// Replaces `session.json`, e.g. with the clock pair at the end. A crash leaves the old one or the new one.
    pub fn write_metadata(&self, metadata: &Metadata) -> Result<(), TraceError> {
        let path = self.folder.join(files::METADATA);
        let envelope = Envelope {
            format: FORMAT,
            version: VERSION,
            metadata,
        };
        let new = path.with_extension("json.new");
        serde_json::to_string_pretty(&envelope)
            .map_err(io::Error::from)
            .and_then(|text| fs::write(&new, text + "\n"))
            .and_then(|()| fs::rename(&new, &path))
            .map_err(|source| write_error(&path, source))
    }

    /// Adds a sample. `false`: it is not newer than the last one (trackers hand the same sample out twice) and is left out.
    pub fn gaze(&mut self, sample: &GazeSample) -> Result<bool, TraceError> {
        self.gaze.append_newer(sample.time_ns, || gaze_line(sample))
    }

    /// Adds a frame. `false`: it is left out, because it is not later than the last one (time stood still or ran
    /// backwards), or because an eye has no finite pose and valid field of view. A head pose that is not finite is left empty.
    pub fn frame(&mut self, frame: &FrameRecord) -> Result<bool, TraceError> {
        if !frame
            .head_from_eyes
            .iter()
            .all(|view| finite_pose(view.pose).is_some() && view.fov.is_valid())
        {
            return Ok(false);
        }
        self.frames
            .append_newer(frame.predicted_display_ns, || frame_line(frame))
    }

    /// Adds an event; one that is older than the last is given the last one's time. Line breaks become spaces.
    pub fn event(&mut self, event: &EventRecord) -> Result<(), TraceError> {
        let time_ns = event.time_ns.max(self.events.last_time_ns).max(1);
        let mut line = Line::default();
        line.cell(time_ns);
        line.text(&event.event);
        line.maybe(event.trial);
        line.text(&event.value);
        self.events.last_time_ns = time_ns;
        self.events.append(line)
    }

    /// Makes sure that all lines are on the disk (and survive a loss of power, not only of the program).
    pub fn sync(&mut self) -> Result<(), TraceError> {
        for log in [&self.gaze, &self.frames, &self.events] {
            log.file
                .sync_data()
                .map_err(|source| write_error(&log.path, source))?;
        }
        Ok(())
    }
}

impl Session {
    /// Writes the whole session into `folder`, which must not hold one.
    pub fn save(&self, folder: &Path) -> Result<(), TraceError> {
        let mut writer = SessionWriter::create(folder, &self.metadata)?;
        for sample in &self.gaze {
            writer.gaze(sample)?;
        }
        for frame in &self.frames {
            writer.frame(frame)?;
        }
        for event in &self.events {
            writer.event(event)?;
        }
        writer.sync()
    }
}

fn write_error(path: &Path, source: io::Error) -> TraceError {
    TraceError::Write {
        file: path.display().to_string(),
        source,
    }
}

/// One append-only file.
struct Log {
    path: PathBuf,
    file: File,
    last_time_ns: i64,
}

impl Log {
    fn create(path: PathBuf, header: &str) -> Result<Self, TraceError> {
        let mut file = OpenOptions::new()
            .append(true)
            .create_new(true)
            .open(&path)
            .map_err(|source| write_error(&path, source))?;
        writeln!(file, "{header}").map_err(|source| write_error(&path, source))?;
        Ok(Self {
            path,
            file,
            last_time_ns: 0,
        })
    }

    fn append_newer(
        &mut self,
        time_ns: i64,
        line: impl FnOnce() -> Line,
    ) -> Result<bool, TraceError> {
        if time_ns <= self.last_time_ns {
            return Ok(false);
        }
        self.append(line())?;
        self.last_time_ns = time_ns;
        Ok(true)
    }

    /// One write a line, no buffer in between: what is written is in the system's hands.
    fn append(&mut self, Line { mut text }: Line) -> Result<(), TraceError> {
        text.pop();
        text.push('\n');
        self.file
            .write_all(text.as_bytes())
            .map_err(|source| write_error(&self.path, source))
    }
}

/// A line in the making; every cell ends with a comma. Rust writes the shortest decimal that reads back bit for bit.
#[derive(Default)]
struct Line {
    text: String,
}

impl Line {
    fn cell(&mut self, value: impl Display) {
        // Writing into a string can't fail.
        let _ = write!(self.text, "{value},");
    }

    fn maybe<T: Display>(&mut self, value: Option<T>) {
        match value {
            Some(value) => self.cell(value),
            None => self.text.push(','),
        }
    }

    fn vector(&mut self, vector: Option<Vec3>) {
        for axis in 0..3 {
            self.maybe(vector.map(|vector| vector[axis]));
        }
    }

    fn rotation(&mut self, rotation: Option<Quat>) {
        for axis in 0..4 {
            self.maybe(rotation.map(|rotation| rotation.to_array()[axis]));
        }
    }

    fn pose(&mut self, pose: Option<Pose>) {
        self.vector(pose.map(|pose| pose.position_m));
        self.rotation(pose.map(|pose| pose.orientation));
    }

    fn ray(&mut self, ray: Option<GazeRay>) {
        self.cell(u8::from(ray.is_some()));
        self.vector(ray.map(|ray| ray.origin_m()));
        self.vector(ray.map(|ray| ray.dir()));
    }

    fn text(&mut self, text: &str) {
        let text = text.replace(['\n', '\r'], " ");
        match text.contains([',', '"']) || text.trim() != text {
            true => self.cell(format_args!("\"{}\"", text.replace('"', "\"\""))),
            false => self.cell(text),
        }
    }
}

fn gaze_header() -> String {
    let eyes = EYE_PREFIXES.map(|e| {
        format!("{e}_valid,{e}_ox,{e}_oy,{e}_oz,{e}_dx,{e}_dy,{e}_dz,{e}_openness,{e}_pupil_mm")
    });
    format!(
        "time_ns,recv_ns,valid,ox,oy,oz,dx,dy,dz,confidence,{}",
        eyes.join(",")
    )
}

fn gaze_line(sample: &GazeSample) -> Line {
    let mut line = Line::default();
    line.cell(sample.time_ns);
    line.maybe(sample.recv_ns);
    line.ray(sample.combined);
    line.maybe(finite(sample.confidence));
    for eye in &sample.eyes {
        line.ray(eye.ray);
        line.maybe(finite(eye.openness));
        line.maybe(finite(eye.pupil_mm));
    }
    line
}

fn frames_header() -> String {
    let pose = |prefix: &str| {
        ["px", "py", "pz", "qx", "qy", "qz", "qw"]
            .map(|part| format!("{prefix}_{part}"))
            .join(",")
    };
    let eyes = EYE_PREFIXES.map(|e| format!("{},{e}_fov_l,{e}_fov_r,{e}_fov_u,{e}_fov_d", pose(e)));
    format!(
        "frame,trial,predicted_display_ns,period_ns,{},head_flags,{},gaze_time_ns,gaze_dx,gaze_dy,gaze_dz,gaze_state,cpu_ms,gpu_ms,missed",
        pose("head"),
        eyes.join(",")
    )
}

fn frame_line(frame: &FrameRecord) -> Line {
    let mut line = Line::default();
    line.cell(frame.frame);
    line.maybe(frame.trial);
    line.cell(frame.predicted_display_ns);
    line.maybe(frame.period_ns);
    let local_from_head = frame.local_from_head.and_then(finite_pose);
    line.pose(local_from_head);
    line.cell(if local_from_head.is_some() {
        frame.head_flags
    } else {
        0
    });
    for view in &frame.head_from_eyes {
        line.pose(finite_pose(view.pose));
        for angle in [
            view.fov.left_rad,
            view.fov.right_rad,
            view.fov.up_rad,
            view.fov.down_rad,
        ] {
            line.cell(angle);
        }
    }
    let gaze = frame.gaze.filter(|gaze| unit(gaze.dir_in_view).is_some());
    line.maybe(gaze.and_then(|gaze| gaze.sample_time_ns));
    line.vector(gaze.and_then(|gaze| unit(gaze.dir_in_view)));
    line.maybe(gaze.map(|gaze| gaze.state));
    line.maybe(finite(frame.cpu_ms));
    line.maybe(finite(frame.gpu_ms));
    line.maybe(frame.missed);
    line
}

fn finite(value: Option<f32>) -> Option<f32> {
    value.filter(|value| value.is_finite())
}

/// The pose with a unit quaternion, or `None` if a part of it is not finite or the quaternion is zero.
fn finite_pose(pose: Pose) -> Option<Pose> {
    Some(Pose {
        orientation: unit_rotation(pose.orientation)?,
        position_m: pose.position_m.is_finite().then_some(pose.position_m)?,
    })
}
