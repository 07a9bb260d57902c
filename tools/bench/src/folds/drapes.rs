//! A garment in a pose: worn by the live solver, then brought to rest by the offline solver on finer meshes.

use super::poses::FoldPose;
use crate::EvaluateError;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::mirror::{Choice, DressedOutfit, OfflineOutfit, PutOn, Subject};
use tryon_body::{BodyShape, BoneTransforms, Pose, RestBody, Template, embedded, measure};
use tryon_formats::obj::{read_obj, write_obj};
use tryon_geometry::math::{P3, Rigid, World};
use tryon_geometry::par::Par;

/// Steps of 1/30 s on the way from the rest pose to another one, and in that one.
const STEPS: [usize; 2] = [45, 30];
/// Length of a step (s).
const STEP: f64 = 1.0 / 30.0;

/// The embedded body.
pub(super) struct FoldBody {
    template: Arc<Template>,
    rest: RestBody,
}

/// Vertices of the offline solver's mesh at rest.
pub(super) struct OfflineRest {
    pub(super) outfit: OfflineOutfit,
    /// World (m), shape `[vertices]`.
    pub(super) positions: Vec<P3>,
    /// It came to rest; `None` if it was read from a file.
    pub(super) is_settled: Option<bool>,
}

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("folds", why)
}

impl FoldBody {
    pub(super) fn new() -> Self {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        Self { template, rest }
    }

    /// Puts a garment on at rest, moves to a pose within 1.5 s, and stands for a second, as the live chain does.
    pub(super) fn wear(
        &self,
        garment: &str,
        pose: FoldPose,
    ) -> Result<DressedOutfit, EvaluateError> {
        let Self { template, rest } = self;
        let from = FoldPose::Rest.of(template, rest);
        let to = pose.of(template, rest);
        let subject = Subject {
            template,
            rest,
            pose: &from,
            world_from_camera: Rigid::identity(),
        };
        let measures = measure::measure(template, rest).map_err(fault)?;
        let choice = Choice::library(garment, None).map_err(fault)?;
        let sized = vec![choice.sized(&measures).map_err(fault)?];
        let how = PutOn {
            any_size: true,
            ..PutOn::default()
        };
        let mut worn = DressedOutfit::put_on(&subject, sized, how).map_err(fault)?;
        worn.carry_to(&subject).map_err(fault)?;
        let (mut bones, mut body) = (BoneTransforms::default(), Vec::new());
        let mut skin = |pose: &Pose<World>, body: &mut Vec<P3>| {
            template.skin_pose(rest, pose, &mut bones, body);
        };
        for k in 1..=STEPS[0] + STEPS[1] {
            let share = (k as f64 / STEPS[0] as f64).min(1.0);
            skin(
                &from.towards(&to, template.skeleton(), rest, share),
                &mut body,
            );
            worn.step(&body, STEP).map_err(fault)?;
        }
        Ok(worn)
    }

    /// Rest of `worn` on meshes of about `vertices`, read from `known` if that file exists and written to it otherwise.
    pub(super) fn rest(
        &self,
        worn: &DressedOutfit,
        vertices: usize,
        known: Option<&Path>,
    ) -> Result<OfflineRest, EvaluateError> {
        let faces = self.template.mesh().faces();
        let outfit = OfflineOutfit::new(worn, faces, vertices).map_err(fault)?;
        if let Some(path) = known.filter(|path| path.exists()) {
            let positions = read_obj(path).map_err(fault)?.mesh.vertices().to_vec();
            if positions.len() != outfit.cloth().len() {
                let why = format!("{} vertices, not {}", positions.len(), outfit.cloth().len());
                return Err(EvaluateError::new(path.display(), why));
            }
            return Ok(OfflineRest {
                outfit,
                positions,
                is_settled: None,
            });
        }
        let (run, report) = outfit
            .drape(worn, Par::Rayon, |_, _| ControlFlow::Continue(()))
            .map_err(fault)?;
        let positions = run.solver().state().positions();
        if let Some(path) = known {
            write_obj(path, &positions, &outfit.cloth().faces, None).map_err(fault)?;
        }
        Ok(OfflineRest {
            is_settled: Some(report.is_settled()),
            positions,
            outfit,
        })
    }
}

/// File of a rest in a folder.
pub(super) fn rest_file(folder: &Path, garment: &str, pose: FoldPose, vertices: usize) -> PathBuf {
    folder.join(format!("{garment}_{}_{vertices}.obj", pose.name()))
}
