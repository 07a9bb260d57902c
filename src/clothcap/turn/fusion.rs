//! Fusion of key frames: all points in the pose of one frame, registered to each other, merged to one scan.

use super::fused_cloud::{PosedSurface, merged, reposed};
use super::key_frames::{KeyFrame, KeyFrames, moved};
use super::moving_parts::MovingParts;
use super::multi_view::{self, RegisteredFrame, measure, register};
use super::{KeyFrameReport, TurnError, TurnReport};
use crate::align::{AlignedBody, FreeSurface, ModelFit, Start, SurfaceFitConfig};
use crate::scan::BodyScan;
use crate::segment::{BodyRegion, unseen_regions};
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Pose, Template, skin};
use tryon_geometry::math::{Camera, P3, P3d, Rigid, World};
use tryon_geometry::par::Par;

/// Points in the comparison of scan and body.
const SAMPLES: usize = 1500;

/// Settings of a fusion.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnConfig {
    /// Iterations of the registration; 0 fuses the tracked poses as they are.
    pub iterations: usize,
    /// Side of a cell whose points are one in the scan, metres.
    pub cell: f32,
}

impl Default for TurnConfig {
    fn default() -> Self {
        Self {
            iterations: multi_view::iterations(),
            cell: 0.006,
        }
    }
}

/// Scan of a subject fused from the frames of one camera.
#[derive(Clone, Debug)]
pub struct FusedTurn {
    /// Scan in the pose of the reference frame, world, metres.
    pub scan: BodyScan,
    /// Person in it.
    pub start: Start,
    /// Upright world of the recording.
    pub world_from_camera: Rigid<World, Camera>,
    /// Report.
    pub report: TurnReport,
}

/// Fuses key frames to one scan.
///
/// # Errors
/// [`TurnError::Fit`] for a registration without a solution, or too few points.
pub fn fuse(
    template: &Arc<Template>,
    keys: &KeyFrames,
    config: &TurnConfig,
) -> Result<FusedTurn, TurnError> {
    let frontal = keys.frames.iter().enumerate();
    let frontal = frontal.min_by(|a, b| a.1.yaw.abs().total_cmp(&b.1.yaw.abs()));
    let reference = frontal.map_or(0, |(k, _)| k);
    let parts = MovingParts::new(template);
    let mut frames = posed_as(template, keys, reference, &parts);
    measure(&mut frames);
    let tracked: Vec<f64> = frames.iter().map(|f| f.error).collect();
    register(&mut frames, &parts, reference, config.iterations)?;

    let points = frames.iter().flat_map(|f| &f.points);
    let scan = merged(points, config.cell, frames.len()).checked()?;
    let body = body_of(keys, &keys.frames[reference]);
    let mut fit = ModelFit::new(template, &scan, SAMPLES);
    let error = fit.error(&body);
    let (model, _) = fit.posed(&body);
    let mut report = TurnReport {
        frames: keys.count,
        live: keys.live,
        used: key_reports(keys, &frames, &tracked),
        reference: keys.frames[reference].frame,
        points: scan.points.len(),
        unseen: unseen(template, &scan, model)?,
        ..TurnReport::default()
    };
    report.measure_coverage();
    Ok(FusedTurn {
        start: Start {
            error,
            body,
            compared: 1,
        },
        world_from_camera: keys.world_from_camera,
        scan,
        report,
    })
}

fn key_reports(
    keys: &KeyFrames,
    frames: &[RegisteredFrame],
    tracked: &[f64],
) -> Vec<KeyFrameReport> {
    let one = |((key, frame), tracked): ((&KeyFrame, &RegisteredFrame), &f64)| KeyFrameReport {
        frame: key.frame,
        yaw_degrees: key.yaw.to_degrees(),
        quality: key.quality,
        points: key.points.points.len(),
        tracked_error: *tracked,
        registered_error: frame.error,
    };
    keys.frames
        .iter()
        .zip(frames)
        .zip(tracked)
        .map(one)
        .collect()
}

/// Tracked body of a frame in the world, without displacements.
fn body_of(keys: &KeyFrames, key: &KeyFrame) -> AlignedBody {
    AlignedBody {
        pose: Pose {
            root: keys.world_from_camera * key.pose.root,
            angles: key.pose.angles.clone(),
        },
        shape: BodyShape {
            displacements: Vec::new(),
            ..keys.shape.clone()
        },
    }
}

/// Points of all frames in the pose of the reference, world, metres.
fn posed_as(
    template: &Template,
    keys: &KeyFrames,
    reference: usize,
    parts: &MovingParts,
) -> Vec<RegisteredFrame> {
    let world = &keys.world_from_camera;
    let eye: P3 = world.point(&P3d::origin()).cast();
    let rest = template.personalise(&keys.shape);
    let bones_of = |key: &KeyFrame| {
        let mut bones = BoneTransforms::default();
        let pose = body_of(keys, key).pose;
        pose.bones(template.skeleton(), &rest, &mut bones);
        bones
    };
    let to = bones_of(&keys.frames[reference]);
    let one = |key: &KeyFrame| {
        let bones = bones_of(key);
        let mut vertices = Vec::new();
        skin(
            Par::Rayon,
            &rest.vertices,
            template.weights(),
            &bones,
            &mut vertices,
        );
        let from = PosedSurface {
            vertices: &vertices,
            bones: &bones,
        };
        let points = moved(&key.points, world);
        let points = reposed((template, parts), (&points, &eye), &from, &to);
        RegisteredFrame::new(points, key.yaw, (parts, &to.joints))
    };
    keys.frames.iter().map(one).collect()
}

/// Regions of which hardly a vertex has a point; `model` is the posed body.
fn unseen(
    template: &Template,
    scan: &BodyScan,
    model: Vec<P3>,
) -> Result<Vec<BodyRegion>, TurnError> {
    let mut free = FreeSurface::new(template)?;
    let mut surface = model.clone();
    free.run(scan, &model, &mut surface, &SurfaceFitConfig::later())?;
    Ok(unseen_regions(template, free.matches()))
}
