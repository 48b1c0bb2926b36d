//! Semantic paths and their atoms (specification, chapter "Semantic Paths and Interaction Profiles").

use std::collections::HashMap;

use openxr_sys as sys;

use crate::XrResult;

/// How many paths an instance takes before it answers `PATH_COUNT_EXCEEDED`.
const MAX_PATHS: usize = 1 << 16;

/// The user paths that actions may be split by.
pub(crate) const TOP_LEVEL_USER_PATHS: &[&str] = &[
    "/user/hand/left",
    "/user/hand/right",
    "/user/head",
    "/user/gamepad",
    "/user/treadmill",
    EYES,
];

/// The eyes' user path, of XR_EXT_eye_gaze_interaction.
pub(crate) const EYES: &str = "/user/eyes_ext";

/// An instance's paths. The atom of the n-th is n, counted from 1: 0 is `XR_NULL_PATH`.
#[derive(Debug, Default)]
pub(crate) struct PathTable {
    strings: Vec<String>,
    atoms: HashMap<String, u64>,
}

impl PathTable {
    /// The atom of a path, made where it is new.
    pub fn atom(&mut self, string: &str) -> XrResult<sys::Path> {
        if let Some(atom) = self.atoms.get(string) {
            return Ok(sys::Path::from_raw(*atom));
        }
        if !is_well_formed(string) {
            return Err(sys::Result::ERROR_PATH_FORMAT_INVALID);
        }
        if self.strings.len() == MAX_PATHS {
            return Err(sys::Result::ERROR_PATH_COUNT_EXCEEDED);
        }
        self.strings.push(string.to_owned());
        let atom = self.strings.len() as u64;
        self.atoms.insert(string.to_owned(), atom);
        Ok(sys::Path::from_raw(atom))
    }

    /// The string of an atom; `PATH_INVALID` for one that this instance never gave.
    pub fn string(&self, path: sys::Path) -> XrResult<&str> {
        usize::try_from(path.into_raw())
            .ok()
            .and_then(|atom| self.strings.get(atom.checked_sub(1)?))
            .map(String::as_str)
            .ok_or(sys::Result::ERROR_PATH_INVALID)
    }
}

/// Whether `name` may be a level of a path: the rule for names of actions and action sets too.
pub(crate) fn is_well_formed_name(name: &str) -> bool {
    !name.is_empty()
        && name
            .bytes()
            .all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.'))
        && !name.bytes().all(|byte| byte == b'.')
}

fn is_well_formed(string: &str) -> bool {
    string.len() < sys::MAX_PATH_LENGTH
        && string
            .strip_prefix('/')
            .is_some_and(|levels| levels.split('/').all(is_well_formed_name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_and_its_atom_find_each_other() {
        let mut paths = PathTable::default();
        let left = paths.atom("/user/hand/left").expect("well formed");
        let right = paths.atom("/user/hand/right").expect("well formed");
        assert_ne!(left, right);
        assert_eq!(paths.atom("/user/hand/left"), Ok(left));
        assert_eq!(paths.string(right), Ok("/user/hand/right"));
        for stranger in [
            sys::Path::NULL,
            sys::Path::from_raw(3),
            sys::Path::from_raw(u64::MAX),
        ] {
            assert_eq!(paths.string(stranger), Err(sys::Result::ERROR_PATH_INVALID));
        }
    }

    #[test]
    fn malformed_paths_are_refused() {
        let long = format!("/{}", "a".repeat(sys::MAX_PATH_LENGTH));
        for path in [
            "", "/", "user", "/user/", "//user", "/User", "/a b", "/a/../b", "/...", &long,
        ] {
            assert_eq!(
                PathTable::default().atom(path),
                Err(sys::Result::ERROR_PATH_FORMAT_INVALID),
                "{path:?}"
            );
        }
    }
}
