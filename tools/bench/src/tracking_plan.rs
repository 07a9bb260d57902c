//! Tracking of the standard scenes under settings side by side: run time against error.

use super::tracking::follow;
use super::{DepthScene, EvaluateError, Row, scenes};
use clap::Args;
use std::path::PathBuf;
use tryon_body::embedded;
use tryon_geometry::camera::NoiseModel;
use tryon_synth::{Actor, Room, Sequence, Setting};
use tryon_tracking::TrackerConfig;

/// Extent of a measurement.
#[derive(Args, Clone, Debug, Default)]
pub struct TrackingPlan {
    /// Folder with bodies, motions and sequences that have truth; without it, synthetic scenes of the embedded body.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Only scenes whose name contains one of these.
    #[arg(long, value_name = "TEXT", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Settings of the tracker as JSON, or `paper`; without any, the tracker as it ships and the paper's own form.
    #[arg(long = "set", value_name = "JSON")]
    pub settings: Vec<String>,
    /// The subject's own body instead of the template.
    #[arg(long, requires = "data")]
    pub own: bool,
    /// Only every n-th frame arrives.
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub nth: usize,
    /// The first frames of one scene: a minute instead of many.
    #[arg(long)]
    pub quick: bool,
}

/// Frames of the scene in a quick run: calibration and a little more.
const QUICK_FRAMES: usize = 50;
/// Frames of the synthetic scenes of the embedded body.
const EMBEDDED_FRAMES: u64 = 180;

/// Tracker of a name or of JSON, with the name of its rows.
fn config(settings: &str) -> Result<(String, TrackerConfig), EvaluateError> {
    let fault = |e: serde_json::Error| EvaluateError::new(settings, e);
    Ok(match settings {
        "{}" => ("default".into(), TrackerConfig::default()),
        "paper" => ("the paper's form".into(), TrackerConfig::paper()),
        json => (json.into(), serde_json::from_str(json).map_err(fault)?),
    })
}

/// The embedded body before a camera.
fn embedded_scene(name: &str, noise: NoiseModel) -> DepthScene {
    let setting = Setting {
        noise,
        color: false,
        room: Some(Room::default()),
        ..Setting::default()
    };
    let sequence = Sequence::new(Actor::default(), setting);
    DepthScene::synthetic(name, &sequence, EMBEDDED_FRAMES)
}

impl TrackingPlan {
    /// Names of the wanted scenes.
    fn names(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> = match self.data {
            Some(_) => scenes::names().collect(),
            None => vec!["synthetic_kinect1", "synthetic_tof"],
        };
        names.retain(|n| self.only.is_empty() || self.only.iter().any(|o| n.contains(o)));
        names.truncate(if self.quick { 1 } else { usize::MAX });
        names
    }

    /// Measures scene by scene, all settings on each; `done` receives each row as soon as it exists.
    ///
    /// # Errors
    /// Names the scene, body or setting that cannot be read.
    pub fn run(&self, mut done: impl FnMut(Row)) -> Result<(), EvaluateError> {
        let settings = match self.settings.as_slice() {
            [] => ["{}", "paper"].map(config).into_iter().collect(),
            some => some
                .iter()
                .map(|s| config(s))
                .collect::<Result<Vec<_>, _>>(),
        }?;
        let template = match &self.data {
            Some(data) => scenes::subject(data, "template")?,
            None => embedded::template(),
        };
        for name in self.names() {
            let mut scene = match (&self.data, name) {
                (Some(data), _) => scenes::scene(data, name)?,
                (None, "synthetic_tof") => embedded_scene(name, NoiseModel::TimeOfFlight),
                (None, _) => embedded_scene(name, NoiseModel::KinectV1),
            };
            if self.quick {
                scene.frames.truncate(QUICK_FRAMES);
            }
            let scene = scene.every(self.nth);
            let body = match &self.data {
                Some(data) if self.own => scenes::subject(data, scenes::subject_of(name))?,
                _ => template.clone(),
            };
            for (method, config) in &settings {
                let outcome = follow(&body, config, &scene, |_, _, _, _, _| {});
                done(outcome.row(&scene, method));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_plan_measures_the_embedded_body_and_faults_are_named() {
        let mut plan = TrackingPlan {
            settings: vec!["{}".into()],
            quick: true,
            ..TrackingPlan::default()
        };
        let mut rows = Vec::new();
        plan.run(|r| rows.push(r)).expect("runs");
        let [row] = &rows[..] else {
            panic!("{} rows", rows.len());
        };
        // The very body that made the scene: a few millimetres.
        let error = row.get("joints_mm").expect("compared");
        assert!(error > 0.1 && error < 40.0, "{error} mm");
        plan.settings = vec!["{\"unknown\":1}".into()];
        assert!(plan.run(|_| {}).is_err());
        plan.settings.clear();
        plan.data = Some("/nowhere".into());
        let fault = plan.run(|_| {}).expect_err("no data").to_string();
        assert!(fault.contains("template"), "{fault}");
    }
}
