//! Bytes of a scene: the .gltf or .glb file, and the buffers and images that it names. Everything is untrusted and bounded.

use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use sha2::{Digest, Sha256};

use super::error::SceneProblem;
use super::limits::LoadLimits;
use crate::file_kind::kind_of;

/// Reads files of one scene within one budget of bytes, and hashes them in the order read.
pub(super) struct SceneFiles {
    folder: PathBuf,
    bytes_left: u64,
    bytes_limit: u64,
    hash: Sha256,
}

impl SceneFiles {
    /// Reads the scene file itself.
    pub fn open(path: &Path, limits: &LoadLimits) -> Result<(Self, Vec<u8>), SceneProblem> {
        let mut files = Self {
            folder: path.parent().unwrap_or(Path::new("")).to_path_buf(),
            bytes_left: limits.file_bytes,
            bytes_limit: limits.file_bytes,
            hash: Sha256::new(),
        };
        let metadata = std::fs::metadata(path);
        if metadata.as_ref().is_ok_and(std::fs::Metadata::is_dir) {
            return Err(SceneProblem::NotAScene("it is a folder".into()));
        }
        if metadata.is_err_and(|error| error.kind() == ErrorKind::NotFound) {
            return Err(SceneProblem::NotAScene("there is no such file".into()));
        }
        let bytes = files.read(path)?;
        Ok((files, bytes))
    }

    /// SHA-256 of all bytes read, as lower-case hex.
    pub fn into_sha256(self) -> String {
        self.hash
            .finalize()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// The bytes behind the URI of `what`: a data: URI, or a file in the scene's folder or below it.
    pub fn fetch(&mut self, uri: &str, what: &str) -> Result<Vec<u8>, SceneProblem> {
        if let Some(data) = uri.strip_prefix("data:") {
            return decode_data_uri(data, what);
        }
        let forbidden = || SceneProblem::ForbiddenUri {
            what: what.to_owned(),
            uri: uri.chars().take(80).collect(),
        };
        let relative = percent_decode(uri).ok_or_else(forbidden)?;
        // A colon is a scheme or a drive; a backslash separates folders on Windows only, so the file would mean two things.
        let has_foreign_syntax = relative.contains([':', '\\', '\0']);
        let leaves_folder =
            relative.starts_with('/') || relative.split('/').any(|part| part == "..");
        if relative.is_empty() || has_foreign_syntax || leaves_folder {
            return Err(forbidden());
        }
        self.read(&self.folder.join(relative))
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, SceneProblem> {
        let io = |source| SceneProblem::Io {
            path: path.to_path_buf(),
            source,
        };
        // Asked before opening: opening a pipe would wait for its other end.
        let metadata = std::fs::metadata(path).map_err(io)?;
        if !metadata.is_file() {
            return Err(io(std::io::Error::other("not a regular file")));
        }
        self.check_budget(path, metadata.len())?;
        let mut bytes = Vec::with_capacity(usize::try_from(metadata.len()).unwrap_or(0));
        let file = File::open(path).map_err(io)?;
        file.take(self.bytes_left + 1)
            .read_to_end(&mut bytes)
            .map_err(io)?;
        self.check_budget(path, bytes.len() as u64)?;
        self.bytes_left -= bytes.len() as u64;
        self.hash.update(&bytes);
        Ok(bytes)
    }

    fn check_budget(&self, path: &Path, bytes: u64) -> Result<(), SceneProblem> {
        let already_read = self.bytes_limit - self.bytes_left;
        let what = format!("bytes of the scene's files up to {}", path.display());
        let claimed = already_read.saturating_add(bytes);
        SceneProblem::check_limit(what, claimed, self.bytes_limit, "file_bytes")
    }
}

/// `[mime][;params];base64,payload` of a data: URI; its size is bounded by that of the JSON that holds it.
fn decode_data_uri(data: &str, what: &str) -> Result<Vec<u8>, SceneProblem> {
    const BASE64: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let payload = data
        .split_once(',')
        .and_then(|(header, payload)| header.ends_with(";base64").then_some(payload))
        .ok_or_else(|| SceneProblem::Invalid(format!("{what}: its data: URI is not base64")))?;
    BASE64
        .decode(payload)
        .map_err(|e| SceneProblem::Invalid(format!("{what}: its data: URI is damaged: {e}")))
}

/// Undoes %XX escapes (RFC 3986, 2.1), or `None` where they are malformed or not UTF-8.
fn percent_decode(uri: &str) -> Option<String> {
    let mut bytes = uri.bytes();
    let mut decoded = Vec::with_capacity(uri.len());
    while let Some(byte) = bytes.next() {
        if byte == b'%' {
            let mut digit = || char::from(bytes.next()?).to_digit(16);
            decoded.push((digit()? * 16 + digit()?) as u8);
        } else {
            decoded.push(byte);
        }
    }
    String::from_utf8(decoded).ok()
}

/// The JSON and the binary chunk of a scene file (glTF 2.0, section 4.4, GLB container).
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Splits the bytes of a .glb, or takes those of a .gltf as they are. Decided by the magic, not by the name.
    pub fn split(bytes: &'a [u8]) -> Result<Self, SceneProblem> {
        if !bytes.starts_with(b"glTF") {
            let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
            if first != Some(&b'{') {
                let kind = kind_of(bytes).unwrap_or("neither JSON text nor a GLB container");
                return Err(SceneProblem::NotAScene(format!("it is {kind}")));
            }
            return Ok(Self {
                json: bytes,
                binary: None,
            });
        }
        let truncated = || SceneProblem::Container("the GLB container is cut short".to_owned());
        let (header, rest) = bytes.split_at_checked(12).ok_or_else(truncated)?;
        let version = u32_at(header, 4);
        if version != 2 {
            let message = format!("the GLB container has version {version}, not 2");
            return Err(SceneProblem::Container(message));
        }
        let body_len = (u32_at(header, 8) as usize)
            .checked_sub(12)
            .ok_or_else(truncated)?;
        let body = rest.get(..body_len).ok_or_else(truncated)?;
        let (kind, json, body) = split_chunk(body).ok_or_else(truncated)?;
        if kind != b"JSON" {
            let message = "the GLB container does not start with its JSON chunk";
            return Err(SceneProblem::Container(message.to_owned()));
        }
        let binary = if body.is_empty() {
            None
        } else {
            let (kind, binary, _) = split_chunk(body).ok_or_else(truncated)?;
            (kind == b"BIN\0").then_some(binary)
        };
        Ok(Self { json, binary })
    }
}

/// Type, contents and rest of the first chunk.
fn split_chunk(bytes: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let (header, rest) = bytes.split_at_checked(8)?;
    let (contents, rest) = rest.split_at_checked(u32_at(header, 0) as usize)?;
    Some((&header[4..], contents, rest))
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Number of objects, arrays and elements in a JSON text, by its `{`, `[` and `,` outside of strings.
///
/// Parsing turns three bytes (`{},`) into hundreds, so this is bounded before.
pub(super) fn count_json_items(json: &[u8]) -> u64 {
    let (mut count, mut in_string, mut escaped) = (0, false, false);
    for &byte in json {
        match (in_string, byte) {
            (true, _) if escaped => escaped = false,
            (true, b'\\') => escaped = true,
            (_, b'"') => in_string = !in_string,
            (false, b'{' | b'[' | b',') => count += 1,
            _ => {}
        }
    }
    count
}

/// The contents of every buffer of the document.
pub(super) fn read_buffers<'a>(
    root: &gltf::json::Root,
    binary: Option<&'a [u8]>,
    files: &mut SceneFiles,
) -> Result<Vec<Cow<'a, [u8]>>, SceneProblem> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (index, buffer) in root.buffers.iter().enumerate() {
        let bytes = match (&buffer.uri, binary) {
            (Some(uri), _) => Cow::Owned(files.fetch(uri, &format!("buffer {index}"))?),
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => {
                let message = format!("buffer {index} has neither a URI nor a GLB chunk");
                return Err(SceneProblem::Invalid(message));
            }
        };
        let claimed = buffer.byte_length.0;
        if (bytes.len() as u64) < claimed {
            let message = format!(
                "buffer {index} is cut short: it claims {claimed} bytes and holds {}",
                bytes.len()
            );
            return Err(SceneProblem::Container(message));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}
