//! Files from outside, changed anywhere: what the fuzz targets run (`fuzz/`), over mutated seeds.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use proptest::sample::Index;

use crate::runner::hold;
use crate::untrusted::{gltf_scene, parameter_file, session_reader};

/// The seeds of a fuzz target, in the order of their names.
fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/seeds")
        .join(target);
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let seeds: Vec<_> = paths
        .iter()
        .map(|path| std::fs::read(path).unwrap())
        .collect();
    assert!(!seeds.is_empty(), "{} holds no seeds", folder.display());
    seeds
}

/// A change to bytes.
#[derive(Clone, Debug)]
enum Change {
    Set(Index, u8),
    Remove(Index, Index),
    Insert(Index, Vec<u8>),
    Repeat(Index, Index),
}

fn change() -> impl Strategy<Value = Change> {
    let telling = [
        "NaN",
        "-1",
        "1e39",
        "1e999",
        "4294967296",
        "18446744073709551616",
        "null",
        "{}",
        "[",
        "\"",
        ",",
        "\n",
        "\0",
        "=",
    ];
    let word = prop::sample::select(telling.to_vec()).prop_map(|word| word.as_bytes().to_vec());
    let bytes = prop_oneof![3 => word, 1 => prop::collection::vec(any::<u8>(), 0..6)];
    let at = any::<Index>;
    prop_oneof![
        4 => (at(), any::<u8>()).prop_map(|(at, byte)| Change::Set(at, byte)),
        1 => (at(), at()).prop_map(|(from, to)| Change::Remove(from, to)),
        4 => (at(), bytes).prop_map(|(at, bytes)| Change::Insert(at, bytes)),
        1 => (at(), at()).prop_map(|(from, to)| Change::Repeat(from, to)),
    ]
}

fn changed(mut bytes: Vec<u8>, changes: &[Change]) -> Vec<u8> {
    for change in changes {
        let place = |index: &Index| index.index(bytes.len() + 1);
        let span = |a: &Index, b: &Index| {
            let (a, b) = (place(a), place(b));
            let (from, to) = (a.min(b), a.max(b));
            // Long pieces leave nothing to read.
            from..to.min(from + 64)
        };
        match change {
            Change::Set(at, byte) => {
                let at = place(at);
                if let Some(old) = bytes.get_mut(at) {
                    *old = *byte;
                }
            }
            Change::Remove(from, to) => drop(bytes.drain(span(from, to))),
            Change::Insert(at, more) => {
                let at = place(at);
                bytes.splice(at..at, more.iter().copied());
            }
            Change::Repeat(from, to) => {
                let piece = bytes[span(from, to)].to_vec();
                bytes.extend(piece);
            }
        }
    }
    bytes
}

fn mutated(target: &str) -> impl Strategy<Value = Vec<u8>> + use<> {
    let changes = prop::collection::vec(change(), 0..6);
    (prop::sample::select(seeds(target)), changes)
        .prop_map(|(seed, changes)| changed(seed, &changes))
}

#[test]
fn no_scene_file_makes_the_loader_panic() {
    hold("scene files", 400, mutated("gltf_scene"), |bytes| {
        gltf_scene(&bytes, "mutated.gltf");
        gltf_scene(&bytes, "mutated.glb");
        Ok(())
    });
}

#[test]
fn no_session_makes_the_reader_panic() {
    hold("session folders", 300, mutated("session_reader"), |bytes| {
        session_reader(&bytes);
        Ok(())
    });
}

#[test]
fn no_parameter_file_makes_the_reader_panic() {
    hold(
        "parameter files from outside",
        600,
        mutated("parameter_file"),
        |bytes| {
            parameter_file(&bytes);
            Ok(())
        },
    );
}

#[test]
fn the_seeds_are_accepted_and_most_of_what_is_changed_in_them_is_not() {
    type Reader = fn(&[u8]) -> bool;
    let readers: [(&str, Reader); 3] = [
        ("gltf_scene", |bytes| gltf_scene(bytes, "seed.gltf")),
        ("session_reader", session_reader),
        ("parameter_file", parameter_file),
    ];
    for (target, reader) in readers {
        for seed in seeds(target) {
            assert!(
                reader(&seed),
                "{target}: {}",
                String::from_utf8_lossy(&seed)
            );
            assert!(
                !reader(&[&seed[..], b"\0"].concat()) || !reader(&seed[1..]),
                "{target}"
            );
        }
    }
}
