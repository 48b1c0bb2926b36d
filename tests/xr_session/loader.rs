//! The same session in a process of its own, through the standard loader and under the validation layers of OpenXR and Vulkan.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use macula::xr::{EndReason, Runtime, XrApp, XrOptions};

use super::script::FRAME_COUNT;
use super::{alone, config, play, session_folder};

/// Set in the process that plays the application's part.
const CHILD: &str = "MACULA_TEST_XR_SESSION_CHILD";
const CORE_VALIDATION: &str = "XR_APILAYER_LUNARG_core_validation";

#[test]
fn through_the_loader_the_validation_layers_have_nothing_to_say() {
    if std::env::var_os(CHILD).is_some() {
        return play_through_the_loader();
    }
    let _alone = alone();
    let Some(library) = loader_and_layers() else {
        return;
    };
    let folder = session_folder();
    let manifest = folder.path().join("xr-sim.json");
    xr_sim::write_manifest(&manifest, &library).expect("a manifest");
    let configuration = folder.path().join("config.json");
    let text = serde_json::to_string(&config(folder.path())).expect("JSON");
    fs::write(&configuration, text).expect("a configuration");
    let findings = folder.path().join("findings.txt");

    let output = Command::new(std::env::current_exe().expect("this program"))
        .args([
            "--exact",
            "loader::through_the_loader_the_validation_layers_have_nothing_to_say",
            "--nocapture",
        ])
        .env(CHILD, "1")
        .env("XR_RUNTIME_JSON", &manifest)
        .env("XR_SIM_CONFIG", &configuration)
        .env("XR_ENABLE_API_LAYERS", CORE_VALIDATION)
        .env("XR_CORE_VALIDATION_EXPORT_TYPE", "text")
        .env("XR_CORE_VALIDATION_FILE_NAME", &findings)
        .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
        .env("VK_LOADER_DEBUG", "layer")
        .output()
        .expect("the program runs again");
    let out = String::from_utf8_lossy(&output.stdout);
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{out}\n{err}", output.status);
    assert!(
        out.contains(&format!("played {FRAME_COUNT} frames")),
        "{out}\n{err}"
    );

    let findings = fs::read_to_string(&findings).unwrap_or_default();
    let (deliberate, others): (Vec<_>, Vec<_>) = findings
        .lines()
        .filter(|line| line.starts_with("[VALID_"))
        .partition(|line| line.contains("xrGetSystem"));
    // The child makes one mistake on purpose: a silent layer would be no layer.
    assert!(
        !deliberate.is_empty(),
        "the OpenXR layer was not there:\n{findings}"
    );
    assert!(others.is_empty(), "{findings}");
    if !err.contains("Insert instance layer \"VK_LAYER_KHRONOS_validation\"") {
        eprintln!(
            "SKIPPED: Vulkan validation of the session: the layer is not installed (Debian: vulkan-validationlayers)"
        );
    }
    let complaints: Vec<_> = out
        .lines()
        .chain(err.lines())
        .filter(|line| line.contains("VUID-") || line.contains("Validation Error"))
        .collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

fn play_through_the_loader() {
    let entry = Runtime::System.entry().expect("the loader");
    let mut app = XrApp::connect(entry, &XrOptions::default()).expect("a session");
    let (seen, reason) = play(&mut app, |frame| frame % 5 == 4);
    assert_eq!(reason, EndReason::Exit);
    drop(app);
    println!("played {} frames", seen.len());
    make_a_mistake();
}

/// Asks for a headset of a kind that does not exist.
fn make_a_mistake() {
    let entry = Runtime::System.entry().expect("the loader");
    let application = openxr::ApplicationInfo {
        application_name: "mistake",
        ..Default::default()
    };
    let instance = entry
        .create_instance(&application, &openxr::ExtensionSet::default(), &[], &())
        .expect("an instance");
    assert!(instance.system(openxr::FormFactor::from_raw(-7)).is_err());
}

/// The simulated runtime's shared library, if loader and layers are there to run it.
fn loader_and_layers() -> Option<PathBuf> {
    let skipped =
        |why: &str| eprintln!("SKIPPED: the run through the OpenXR loader under validation: {why}");
    let Ok(entry) = Runtime::System.entry() else {
        skipped("the OpenXR loader is not installed (Debian: libopenxr-loader1)");
        return None;
    };
    let layers = entry.enumerate_layers().unwrap_or_default();
    if !layers
        .iter()
        .any(|layer| layer.layer_name == CORE_VALIDATION)
    {
        skipped(
            "the OpenXR core validation layer is not installed (Debian: openxr-layer-corevalidation)",
        );
        return None;
    }
    let name = format!(
        "{}xr_sim{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    let library = std::env::current_exe().ok()?.with_file_name(name);
    assert!(
        library.is_file(),
        "cargo builds the simulated runtime beside the tests: {}",
        library.display()
    );
    Some(library)
}
