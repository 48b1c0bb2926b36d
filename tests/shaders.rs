//! The shaders that macula carries: every file composes and is valid WGSL with the capabilities that the device is asked for.

use macula::gpu::shader::{self, stages};

#[test]
fn every_stage_is_valid_wgsl_however_its_arrays_are_split() {
    for chunks in [1, 3] {
        for stage in stages::ALL {
            let source = shader::compose(stage.name, &|_| chunks).unwrap();
            let reflection = shader::reflect(stage.name, &source, stage.name)
                .unwrap_or_else(|error| panic!("{error}"));
            assert!(
                !reflection.bindings.is_empty(),
                "{} binds nothing",
                stage.name
            );
        }
        for draw in stages::DRAWS {
            let source = shader::compose(draw, &|_| chunks).unwrap();
            shader::validate(draw, &source).unwrap_or_else(|error| panic!("{error}"));
        }
    }
}

#[test]
fn a_shader_with_a_mistake_is_refused_by_name() {
    let source = shader::compose("scan_add", &|_| 1)
        .unwrap()
        .replace("scan_sums[block]", "scan_summs[block]");
    let error = shader::reflect("scan_add", &source, "scan_add")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("scan_add") && error.contains("scan_summs"),
        "{error}"
    );
}

#[test]
fn every_shader_says_what_it_computes() {
    for (name, text) in shader::MODULES {
        let first = text
            .lines()
            .find(|line| !line.starts_with("//!"))
            .unwrap_or("");
        assert!(
            first.starts_with("// ") && first.len() > 20,
            "{name} starts with `{first}`"
        );
    }
}
