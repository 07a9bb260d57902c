//! Ablation of the tracker: one setting changed at a time, run time against error.

use super::tracking::follow;
use super::{DepthScene, EvaluateError, Row, scenes};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon_body::{Template, embedded};
use tryon_geometry::camera::NoiseModel;
use tryon_synth::{Actor, Room, Sequence, Setting};
use tryon_tracking::TrackerConfig;
use tryon_tracking::registration::Association;

/// Size of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Extent {
    /// Every variant on every scene.
    #[default]
    Full,
    /// A few variants on the first part of one scene.
    Quick,
}

/// A tracker to measure.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Name of the varied setting; its values are joined in plots.
    pub method: &'static str,
    /// Its value.
    pub value: String,
    /// The whole setting.
    pub config: TrackerConfig,
}

/// Origin of a scene, which is read or rendered only when a run needs it.
#[derive(Clone, Debug)]
enum SceneOrigin {
    Folder(PathBuf),
    Unseen(PathBuf, &'static str),
    Embedded(NoiseModel),
}

/// Scenes, template and variants of one measurement.
#[derive(Clone, Debug)]
pub struct Plan {
    template: Arc<Template>,
    sources: Vec<SceneOrigin>,
    variants: Vec<Variant>,
    frames: usize,
}

/// Frames of each scene in a quick run: calibration and a little more.
const QUICK_FRAMES: usize = 50;
/// Frames of the synthetic scene of the embedded body.
const EMBEDDED_FRAMES: u64 = 180;

/// Every variant: the default first, then one thing changed at a time, then the paper's own form.
pub fn variants() -> Vec<Variant> {
    let mut out = Vec::new();
    let mut add = |method, value: &str, change: &dyn Fn(&mut TrackerConfig)| {
        let mut config = TrackerConfig::default();
        change(&mut config);
        out.push(Variant {
            method,
            value: value.to_owned(),
            config,
        });
    };
    add("default", "", &|_| {});
    for n in [1usize, 2, 4, 8, 16] {
        add("iterations", &n.to_string(), &|c| {
            c.fit.track.iterations = n
        });
    }
    for mm in [0.8, 1.5, 3.0, 6.0] {
        add("converged, mm", &mm.to_string(), &|c| {
            c.converged = mm * 1e-3
        });
    }
    for n in [250usize, 500, 1000, 2000, 4000] {
        add("samples", &n.to_string(), &|c| c.samples = n);
    }
    for n in [1usize, 2, 4, 8] {
        add("data step", &n.to_string(), &|c| c.data_step = n);
    }
    for n in [2u32, 4, 8] {
        add("pixels per cell", &n.to_string(), &|c| c.stride = Some(n));
    }
    add("association", "projective", &|c| {
        c.association = Association::Projective
    });
    add("association", "kd-tree", &|c| {
        c.association = Association::KdTree
    });
    add("association", "kd-tree, one way", &|c| c.both_ways = false);
    add("metric", "symmetric + 0.05 point", &|_| {});
    add("metric", "symmetric", &|c| c.point_to_point = 0.0);
    add("metric", "point", &|c| {
        (c.point_to_point, c.point_to_plane) = (1.0, 0.0)
    });
    add("robust kernel", "off", &|c| c.robust = false);
    for damping in [1e-6, 1e-5, 1e-3] {
        add("damping", &format!("{damping:e}"), &|c| c.damping = damping);
    }
    add("rest pose", "off", &|c| c.rest_weight = 0.0);
    for calm in [0.0, 1.5] {
        add("last pose", &calm.to_string(), &|c| c.calm = calm);
    }
    add("hidden feet on the floor", "off", &|c| c.standing = false);
    add("repairs of lost limbs", "off", &|c| c.rescue = false);
    add("edges", "0.1", &|c| c.edge_weight = 0.1);
    add("edges", "1", &|c| c.edge_weight = 1.0);
    add("prediction", "off", &|c| c.fit.prediction.longest = 0.0);
    add("pull", "off", &|c| {
        (c.fit.track.pull, c.fit.start.pull) = (0.0, 0.0)
    });
    add("skipping", "nothing", &|c| {
        (c.skip_coarse, c.skip_unchanged) = (false, false);
        c.shape.surface.settled = 0.0;
    });
    add("size", "off", &|c| c.adapt_size = false);
    add("displacements", "off", &|c| c.displacements = false);
    add("displacements", "in the pose", &|c| c.displaced_pose = true);
    out.push(Variant {
        method: "the paper's form",
        value: String::new(),
        config: TrackerConfig::paper(),
    });
    out
}

/// Scenes and variants: with `data`, the shared sequences and unseen ones with its bodies and motions, tracked with its
/// template; without, the embedded body before two cameras.
///
/// # Errors
/// When the template of `data` cannot be read.
pub fn plan(data: Option<&Path>, extent: Extent) -> Result<Plan, EvaluateError> {
    let (template, mut sources) = match data {
        Some(data) => {
            let folders = [
                "charleston_m_heavy_tof_room",
                "jacks_f_avg_kinect1_room",
                "sword_m_tall_tof_noroom_upper",
            ];
            let mut sources: Vec<SceneOrigin> = folders
                .iter()
                .map(|f| SceneOrigin::Folder(data.join("sequences").join(f)))
                .collect();
            sources.extend(scenes::unseen_names().map(|n| SceneOrigin::Unseen(data.to_owned(), n)));
            (scenes::subject(data, "template")?, sources)
        }
        None => {
            let sources =
                [NoiseModel::KinectV1, NoiseModel::TimeOfFlight].map(SceneOrigin::Embedded);
            (embedded::template(), sources.to_vec())
        }
    };
    let mut variants = variants();
    let mut frames = usize::MAX;
    if extent == Extent::Quick {
        sources.truncate(1);
        frames = QUICK_FRAMES;
        variants.retain(|v| ["default", "iterations", "association"].contains(&v.method));
    }
    Ok(Plan {
        template,
        sources,
        variants,
        frames,
    })
}

impl SceneOrigin {
    fn scene(&self) -> Result<DepthScene, EvaluateError> {
        match self {
            Self::Folder(path) => DepthScene::open(path),
            Self::Unseen(data, name) => scenes::unseen(data, name),
            Self::Embedded(noise) => {
                let setting = Setting {
                    noise: *noise,
                    color: false,
                    room: Some(Room::default()),
                    ..Setting::default()
                };
                let sequence = Sequence::new(Actor::default(), setting);
                let name = if *noise == NoiseModel::KinectV1 {
                    "synthetic_kinect1"
                } else {
                    "synthetic_tof"
                };
                Ok(DepthScene::synthetic(name, &sequence, EMBEDDED_FRAMES))
            }
        }
    }
}

impl Plan {
    /// Number of rows that [`Plan::run`] returns.
    pub fn runs(&self) -> usize {
        self.sources.len() * self.variants.len()
    }
    /// Measures scene by scene, all variants on each; `done` receives each row as soon as it exists.
    ///
    /// # Errors
    /// Names the scene that cannot be read.
    pub fn run(&self, mut done: impl FnMut(Row)) -> Result<(), EvaluateError> {
        for source in &self.sources {
            let mut scene = source.scene()?;
            scene.frames.truncate(self.frames);
            for v in &self.variants {
                let outcome = follow(&self.template, &v.config, &scene, |_, _, _, _, _| {});
                let mut row = outcome.row(&scene, v.method);
                row.parameters.push(("value".to_owned(), v.value.clone()));
                done(row);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_differ_in_name_and_start_with_the_default() {
        let all = variants();
        assert_eq!(all[0].config, TrackerConfig::default());
        for (i, a) in all.iter().enumerate() {
            assert!(
                all[..i]
                    .iter()
                    .all(|b| (a.method, &a.value) != (b.method, &b.value)),
                "{} {}",
                a.method,
                a.value
            );
        }
    }

    #[test]
    fn a_quick_plan_measures_the_embedded_body_and_a_bad_folder_is_named() {
        let mut plan = plan(None, Extent::Quick).expect("embedded");
        plan.variants.truncate(1);
        plan.frames = 34;
        let mut rows = Vec::new();
        plan.run(|r| rows.push(r)).expect("runs");
        assert_eq!((rows.len(), plan.runs()), (1, 1));
        let error = rows[0].get("joints_mm").expect("compared");
        // The very body that made the scene: a few millimetres.
        assert!(error > 0.1 && error < 40.0, "{error} mm");
        assert!(plan_fails());
    }

    fn plan_fails() -> bool {
        matches!(plan(Some(Path::new("/nowhere")), Extent::Quick), Err(EvaluateError::Scene { scene, .. }) if scene == "template")
    }
}
