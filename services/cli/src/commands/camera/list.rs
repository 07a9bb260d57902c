//! `tryon camera list`: the cameras of this machine by family, and what each family lacks.

use crate::args::CameraListArgs;
use crate::{cameras, findings};
use anyhow::Result;
use serde::Serialize;
use std::process::ExitCode;
use tryon_devices::{Device, FamilyReport};

/// A family with a driver.
#[derive(Debug, Serialize)]
struct ListedFamily {
    family: &'static str,
    cameras: Vec<ListedCamera>,
    /// The library or package that is missing, or the driver's fault.
    missing: Option<String>,
}

#[derive(Debug, Serialize)]
struct ListedCamera {
    /// Source in configurations and commands.
    source: String,
    serial: String,
    name: String,
    modes: Vec<ListedMode>,
}

#[derive(Debug, Serialize)]
struct ListedMode {
    stream: &'static str,
    width: u32,
    height: u32,
    rate: f64,
}

/// A family without a driver here.
#[derive(Debug, Serialize)]
struct ListedFed {
    family: &'static str,
    way: String,
}

#[derive(Debug, Serialize)]
struct Listed {
    families: Vec<ListedFamily>,
    fed: Vec<ListedFed>,
}

/// Runs the command.
///
/// # Errors
/// Only when the list cannot be printed.
pub(super) fn run(args: &CameraListArgs) -> Result<ExitCode> {
    let reports = tryon_devices::list();
    if !args.json {
        findings::print(&cameras::findings(&reports));
        return Ok(ExitCode::SUCCESS);
    }
    let fed = cameras::FED.iter().map(|f| ListedFed {
        family: f.name,
        way: f.way(),
    });
    findings::print_json(&Listed {
        families: reports.iter().map(family).collect(),
        fed: fed.collect(),
    })?;
    Ok(ExitCode::SUCCESS)
}

fn family(report: &FamilyReport) -> ListedFamily {
    let (cameras, missing) = match &report.devices {
        Ok(devices) => (devices.iter().map(camera).collect(), None),
        Err(e) => (Vec::new(), Some(cameras::fault(report, e))),
    };
    ListedFamily {
        family: report.family.name(),
        cameras,
        missing,
    }
}

fn camera(device: &Device) -> ListedCamera {
    let modes = device.modes.iter().map(|mode| ListedMode {
        stream: cameras::stream_name(mode.stream),
        width: mode.width,
        height: mode.height,
        rate: mode.rate,
    });
    ListedCamera {
        source: cameras::source(device),
        serial: device.serial.clone(),
        name: device.name.clone(),
        modes: modes.collect(),
    }
}
