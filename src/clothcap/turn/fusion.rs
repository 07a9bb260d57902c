//! Fusion of key frames: all points in the pose of one frame, registered to each other, merged to one scan.

use super::fused_cloud::{Reference, merged};
use super::key_frames::{KeyFrame, KeyFrames, moved};
use super::moving_parts::MovingParts;
use super::multi_view::{RegisteredFrame, measure, register};
use super::{KeyFrameReport, TurnError, TurnReport};
use crate::align::{AlignedBody, FreeSurface, ModelFit, PosedSurface, Start};
use crate::scan::BodyScan;
use crate::segment::{BodyRegion, unseen_regions};
use crate::settings::{AlignmentSettings, FreeSurfaceSettings, LabelSettings, TurnConfig};
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Template, skin};
use tryon_geometry::math::{Camera, P3, P3d, Rigid, World};
use tryon_geometry::par::Par;

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
    let mut frames = posed_as(template, keys, reference, &parts, config);
    measure(&mut frames, &config.views);
    let tracked: Vec<f64> = frames.iter().map(|f| f.error).collect();
    register(&mut frames, &parts, reference, config)?;

    let points = frames.iter().flat_map(|f| &f.points);
    let is_single = frames.len() < 2;
    let least = if is_single {
        0.0
    } else {
        config.cloud.least_weight
    };
    let scan = merged(points, config.cell, least).checked()?;
    let body = body_of(keys, &keys.frames[reference]);
    let align = AlignmentSettings::default();
    let error = ModelFit::new(template, &scan, config.samples, &align.model).error(&body);
    let model = body.posed(template).vertices;
    let mut report = TurnReport {
        frames: keys.count,
        live: keys.live,
        used: key_reports(keys, &frames, &tracked),
        reference: keys.frames[reference].frame,
        points: scan.points.len(),
        unseen: unseen(template, &scan, model, align.surface)?,
        ..TurnReport::default()
    };
    report.measure_coverage(config.whole_turn_gap);
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
    let all = keys.frames.iter().zip(frames).zip(tracked);
    all.map(one).collect()
}

/// Tracked body of a frame in the world, without displacements.
fn body_of(keys: &KeyFrames, key: &KeyFrame) -> AlignedBody {
    AlignedBody {
        pose: key.pose.transformed(&keys.world_from_camera),
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
    config: &TurnConfig,
) -> Vec<RegisteredFrame> {
    let world = &keys.world_from_camera;
    let rest = template.personalise(&keys.shape);
    let bones_of = |key: &KeyFrame| {
        let mut bones = BoneTransforms::default();
        let pose = body_of(keys, key).pose;
        pose.bones(template.skeleton(), &rest, &mut bones);
        bones
    };
    let to = Reference {
        template,
        parts,
        bones: &bones_of(&keys.frames[reference]),
        eye: world.point(&P3d::origin()).cast(),
        settings: &config.cloud,
    };
    let one = |key: &KeyFrame| {
        let mut from = PosedSurface {
            bones: bones_of(key),
            ..PosedSurface::default()
        };
        let (weights, vertices) = (template.weights(), &mut from.vertices);
        skin(Par::Rayon, &rest.vertices, weights, &from.bones, vertices);
        let points = to.reposed(&moved(&key.points, world), &from);
        RegisteredFrame::new(points, key.yaw, parts, &to.bones.joints)
    };
    keys.frames.iter().map(one).collect()
}

/// Regions of which hardly a vertex has a point; `model` is the posed body.
fn unseen(
    template: &Template,
    scan: &BodyScan,
    model: Vec<P3>,
    settings: FreeSurfaceSettings,
) -> Result<Vec<BodyRegion>, TurnError> {
    let mut free = FreeSurface::new(template, settings)?;
    let mut surface = model.clone();
    free.run(scan, &model, &mut surface, &settings.later, true)?;
    let labels = LabelSettings::default();
    Ok(unseen_regions(template, free.matches(), &labels))
}
