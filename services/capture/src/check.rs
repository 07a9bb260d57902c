//! Check of the files that `[capture]` names: the folder of recordings and the cameras' sources.

use crate::source;
use std::fs::{File, remove_file};
use std::io;
use std::path::Path;
use tryon_kit::config::{CameraConfig, Config, ROS2};
use tryon_kit::server::StartError;

/// Opens every recording that is a source, and writes into the folder of recordings.
///
/// # Errors
/// Names the key of a folder that takes no files, or of a source that cannot be opened.
pub fn check(config: &Config) -> Result<(), StartError> {
    let c = &config.capture;
    let fault = |key: String, why: String| StartError::Config { key, why };
    if !c.recordings.as_os_str().is_empty() {
        check_writable(&c.recordings).map_err(|e| {
            let why = format!(
                "{}: no recording can be made here: {e}",
                c.recordings.display()
            );
            fault("capture.recordings".into(), why)
        })?;
    }
    for (i, camera) in c.cameras.iter().enumerate() {
        let key = format!("capture.cameras.{i}.source");
        source::check(camera).map_err(|e| fault(key, e.to_string()))?;
    }
    Ok(())
}

/// As [`check`], for a process that listens on the bus: cameras of ROS 2 are not looked for there.
///
/// # Errors
/// As [`check`], and an endpoint that both networks have.
pub fn check_process(config: &Config) -> Result<(), StartError> {
    let is_ros2 = |c: &CameraConfig| c.source.starts_with(ROS2);
    let ros2 = &config.capture.ros2.connect;
    let shared = ros2.iter().find(|e| config.bus.listen.contains(e));
    if let Some(endpoint) = shared.filter(|_| config.capture.cameras.iter().any(is_ros2)) {
        let why = format!(
            "{endpoint} is where this process itself listens (bus.listen): give the bus another port than ROS's router"
        );
        return Err(StartError::Config {
            key: "capture.ros2.connect".into(),
            why,
        });
    }
    check(config)
}

/// Makes a file in a folder and removes it: permissions alone do not show a read-only disk.
fn check_writable(folder: &Path) -> io::Result<()> {
    let file = folder.join(format!(".tryon-check-{}", std::process::id()));
    File::create_new(&file)?;
    remove_file(&file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_files_are_named_by_their_key() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("file");
        std::fs::write(&file, "").expect("written");
        let check = |key: &str, value: &Path| {
            let set = format!("{key}={}", value.display());
            check(&Config::load(None, &[set]).expect("loads")).map_err(|e| e.to_string())
        };
        let recordings = |folder: &Path| check("capture.recordings", folder);
        recordings(dir.path()).expect("writable");
        assert_eq!(std::fs::read_dir(dir.path()).expect("there").count(), 1);
        // procfs takes no files, not even of root.
        for bad in [&file, &dir.path().join("missing"), Path::new("/proc")] {
            let fault = recordings(bad).expect_err("not writable");
            let named = format!("capture.recordings: {}", bad.display());
            assert!(fault.starts_with(&named), "{fault}");
        }
        let ros2 = "capture.cameras=[{source=\"ros2:/depth\"}]";
        let load = |more: &str| Config::load(None, &[ros2.into(), more.into()]).expect("loads");
        let shared = load("capture.store=store");
        super::check(&shared).expect("without a bus");
        let fault = check_process(&shared).expect_err("one port").to_string();
        assert!(fault.starts_with("capture.ros2.connect: tcp/"), "{fault}");
        check_process(&load("bus.listen=[\"tcp/127.0.0.1:7448\"]")).expect("two ports");
        let missing = dir.path().join("missing.mcap");
        let cameras = format!("[{{source=\"{}\"}}]", missing.display());
        let fault = check("capture.cameras", Path::new(&cameras)).expect_err("missing");
        let named = format!("capture.cameras.0.source: {}", missing.display());
        assert!(fault.starts_with(&named), "{fault}");
    }
}
