//! Immutable part of a tracker: template, camera, sample points, limbs and priors.

use super::girth_gradients::GirthGradients;
use super::leg::{Leg, legs};
use super::limb::{self, Limb};
use super::part_classes::PartClasses;
use super::trunk::Trunk;
use crate::segment::part_network::PartNetwork;
use crate::settings::{Association, TrackerConfig};
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};
use tryon_body::parts::{BodyPart, BodySegment, BodySide};
use tryon_body::{JointMotion, SkinWeights, Template};
use tryon_geometry::camera::Calibration;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::{OrganisedCloud, PointTree};

/// Linear change of the rest body: one shape coefficient or the scale of one bone.
#[derive(Clone, Debug)]
pub(crate) struct Direction {
    /// Offset of each sample per unit, metres.
    pub samples: Vec<V3>,
    /// Offset of each joint per unit, metres.
    pub joints: Vec<Vector3<f64>>,
    /// Joint whose bone it scales; `None` for a shape coefficient.
    pub bone: Option<usize>,
}

/// Immutable part of a tracker; share it by `Arc`.
#[derive(Clone, Debug)]
pub struct TrackerModel {
    pub(crate) template: Arc<Template>,
    pub(crate) calibration: Calibration,
    pub(crate) config: TrackerConfig,
    /// Vertex of each sample.
    pub(crate) samples: Vec<u32>,
    /// Skinning of each sample.
    pub(crate) weights: SkinWeights,
    /// Dominant bone of each sample.
    pub(crate) bones: Vec<u8>,
    /// Parent of each joint.
    pub(crate) parents: Vec<Option<usize>>,
    /// Mean distance between samples, metres.
    pub(crate) spacing: f32,
    /// Shape coefficients first, then bone scales.
    pub(crate) directions: Vec<Direction>,
    /// Pairs of directions with a prior on equal scales, and its weight (eq. 23).
    pub(crate) tied: Vec<(usize, usize, f64)>,
    /// Gradients of the girths along `directions`, found on first use; `None` for a template without girths.
    girth_gradients: OnceLock<Option<GirthGradients>>,
    /// Weight of the rest-pose prior of each angle.
    pub(crate) stiffness: Vec<f64>,
    /// Legs, for feet out of view.
    pub(crate) standing: Vec<Leg>,
    /// Arms, left and right, for hands beyond sleeves without return.
    pub(crate) arms: [Option<Limb>; 2],
    /// The trunk, which arms do not enter; `None` without arms.
    pub(crate) trunk: Option<Trunk>,
    /// Legs, left and right, for feet found at the start.
    pub(crate) legs: [Option<Limb>; 2],
    /// [`BodyPart`](tryon_body::parts::BodyPart) of each joint, as a number, for the pose filter.
    pub(crate) parts: Vec<usize>,
    /// Joint at the height of the torso's middle; the root for a skeleton without.
    pub(crate) chest: usize,
    /// End point or joint of the head; the root for a skeleton without.
    pub(crate) crown: usize,
    /// Classifier of body parts, and its classes on the template.
    pub(crate) part_network: Arc<PartNetwork>,
    pub(crate) part_classes: PartClasses,
    /// Angles of knees, ankles and feet.
    pub(crate) below_knee: Vec<bool>,
    /// Share of the rest-pose prior left for each angle when its bone is in full view.
    pub(crate) seen_shares: Vec<f64>,
}

impl TrackerModel {
    /// Tree of the subject's points, where the configured association queries one.
    pub(crate) fn point_tree(&self, grid: &OrganisedCloud, cells: &[u32]) -> Option<PointTree> {
        let has_tree = self.config.association == Association::KdTree;
        let points = cells.iter().map(|&c| grid.points[c as usize]);
        has_tree.then(|| PointTree::new(&points.collect::<Vec<P3>>()))
    }

    /// Prepares a template for tracking with one camera.
    pub fn new(template: Arc<Template>, calibration: Calibration, config: TrackerConfig) -> Self {
        let skeleton = template.skeleton();
        let parents: Vec<Option<usize>> = skeleton.joints().iter().map(|j| j.parent).collect();
        let samples = choose_samples(template.mesh().vertices(), config.samples);
        let pick = |i: &u32| *i as usize;
        let weights = SkinWeights {
            joints: samples
                .iter()
                .map(|i| template.weights().joints[pick(i)])
                .collect(),
            weights: samples
                .iter()
                .map(|i| template.weights().weights[pick(i)])
                .collect(),
        };
        let bones = samples
            .iter()
            .map(|i| template.weights().dominant(pick(i)) as u8)
            .collect();
        let spacing = (template.mesh().area() / samples.len().max(1) as f64).sqrt() as f32;
        let mut directions = Vec::new();
        if let Some(space) = template.shape_space() {
            directions.extend(
                space
                    .vertices
                    .iter()
                    .zip(&space.joints)
                    .map(|(v, j)| Direction {
                        samples: samples.iter().map(|i| v[pick(i)]).collect(),
                        joints: j.clone(),
                        bone: None,
                    }),
            );
        }
        let first = directions.len();
        directions.extend(bone_directions(&template, &samples, &weights));
        let tied = tied_bones(&template, &directions, first, config.model.tie_weights);
        let stiffness = per_angle(&template, stiffness);
        let standing = legs(&template);
        let arms = limb::arms(&template, &config.model);
        let trunk = Trunk::new(&template, &arms, config.model.trunk_slack);
        let legs = limb::legs(&template, &config.model);
        let parts = (0..skeleton.len())
            .map(|j| template.parts().part(j) as usize)
            .collect();
        let chest = skeleton.index("spine3").unwrap_or(0);
        let crown = ["head_end", "head"]
            .into_iter()
            .find_map(|n| skeleton.index(n))
            .unwrap_or(0);
        let below_knee = per_angle(&template, |s| s.is_leg() && s != BodySegment::Thigh);
        let seen_shares = per_angle(&template, seen_share);
        let part_classes = PartClasses::new(&template);
        Self {
            template,
            calibration,
            config,
            samples,
            weights,
            bones,
            parents,
            spacing,
            directions,
            tied,
            girth_gradients: OnceLock::new(),
            stiffness,
            standing,
            trunk,
            arms,
            legs,
            parts,
            chest,
            crown,
            part_network: PartNetwork::embedded(),
            part_classes,
            below_knee,
            seen_shares,
        }
    }
    /// Gradients of the girths along the directions of size.
    pub(crate) fn girth_gradients(&self) -> Option<&GirthGradients> {
        let find = || {
            let bones: Vec<Option<usize>> = self.directions.iter().map(|d| d.bone).collect();
            GirthGradients::new(&self.template, &bones)
        };
        self.girth_gradients.get_or_init(find).as_ref()
    }

    /// The same model for another camera, without the work of [`Self::new`].
    pub fn with_calibration(&self, calibration: Calibration) -> Self {
        Self {
            calibration,
            ..self.clone()
        }
    }
    /// Arms and legs with their parts, for a skeleton that has them.
    pub(crate) fn limbs(&self) -> impl Iterator<Item = (BodyPart, &Limb)> {
        let parts = [
            (BodyPart::LeftArm, &self.arms[0]),
            (BodyPart::RightArm, &self.arms[1]),
            (BodyPart::LeftLeg, &self.legs[0]),
            (BodyPart::RightLeg, &self.legs[1]),
        ];
        parts
            .into_iter()
            .filter_map(|(part, limb)| limb.as_ref().map(|l| (part, l)))
    }
    /// Template of the tracked body.
    pub fn template(&self) -> &Arc<Template> {
        &self.template
    }
    /// Calibration of the camera.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    /// Settings.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }
}

/// Cell sizes that enclose the sought one, metres.
const CELL_SIZES: [f32; 2] = [0.002, 0.2];
/// Bisections of the cell size: to a thousandth of its logarithm.
const BISECTIONS: usize = 12;

/// About `wanted` evenly spread vertices: one per cell of a voxel grid whose size is found by bisection.
fn choose_samples(vertices: &[P3], wanted: usize) -> Vec<u32> {
    if wanted >= vertices.len() {
        return (0..vertices.len() as u32).collect();
    }
    let pick = |size: f32| {
        let mut cells: BTreeMap<[i32; 3], (f32, u32)> = BTreeMap::new();
        for (i, v) in vertices.iter().enumerate() {
            let key = [v.x, v.y, v.z].map(|c| (c / size).floor() as i32);
            let middle = P3::new(
                key[0] as f32 + 0.5,
                key[1] as f32 + 0.5,
                key[2] as f32 + 0.5,
            ) * size;
            let d = (v - middle).norm_squared();
            let best = cells.entry(key).or_insert((d, i as u32));
            if d < best.0 {
                *best = (d, i as u32);
            }
        }
        cells.into_values().map(|(_, i)| i).collect::<Vec<u32>>()
    };
    let [mut fine, mut coarse] = CELL_SIZES;
    for _ in 0..BISECTIONS {
        let size = (fine * coarse).sqrt();
        if pick(size).len() > wanted {
            fine = size
        } else {
            coarse = size
        }
    }
    pick(coarse)
}

/// Derivatives of the rest body by the scale of each bone (eq. 18 to 20 at the template itself).
fn bone_directions(template: &Template, samples: &[u32], weights: &SkinWeights) -> Vec<Direction> {
    let skeleton = template.skeleton();
    let joints = skeleton.joints();
    let rest: Vec<Point3<f64>> = joints.iter().map(|j| j.rest).collect();
    let mut out = Vec::new();
    for (m, joint) in joints.iter().enumerate() {
        // End points have no skin; displacements and shape adapt their bones.
        let Some(parent) = joint.parent.filter(|_| joint.motion != JointMotion::Fixed) else {
            continue;
        };
        let bone = rest[m] - rest[parent];
        let moved: Vec<Vector3<f64>> = (0..joints.len())
            .map(|j| {
                if skeleton.is_ancestor(m, j) {
                    bone
                } else {
                    Vector3::zeros()
                }
            })
            .collect();
        let offset = |s: usize| {
            let v = template.mesh().vertices()[samples[s] as usize].cast::<f64>();
            let mut sum = Vector3::zeros();
            for k in 0..4 {
                let (j, w) = (
                    usize::from(weights.joints[s][k]),
                    f64::from(weights.weights[s][k]),
                );
                let mut foot = moved[j];
                if skeleton.primary_child(j) == Some(m) {
                    let t = (v - rest[j]).dot(&bone) / bone.norm_squared().max(f64::MIN_POSITIVE);
                    foot += bone * t.clamp(0.0, 1.0);
                }
                sum += foot * w;
            }
            sum.cast::<f32>()
        };
        out.push(Direction {
            samples: (0..samples.len()).map(offset).collect(),
            joints: moved,
            bone: Some(m),
        });
    }
    out
}

/// Pairs of bone scales tied by eq. 23.
fn tied_bones(
    template: &Template,
    directions: &[Direction],
    first: usize,
    [twin_weight, chain_weight]: [f64; 2],
) -> Vec<(usize, usize, f64)> {
    let (joints, parts) = (template.skeleton().joints(), template.parts());
    let of = |j: usize| directions.iter().position(|d| d.bone == Some(j));
    let mut out = Vec::new();
    for (i, d) in directions.iter().enumerate().skip(first) {
        let Some(j) = d.bone else { continue };
        if parts.side(j) == Some(BodySide::Left) {
            let twin = parts.twin(j).and_then(of);
            out.extend(twin.map(|k| (i, k, twin_weight)));
        }
        out.extend(joints[j].parent.and_then(of).map(|k| (i, k, chain_weight)));
    }
    out
}

/// A value of each angle, given by the segment that its joint moves.
fn per_angle<T: Copy>(template: &Template, value: impl Fn(BodySegment) -> T) -> Vec<T> {
    let joints = template.skeleton().joints().iter().enumerate();
    joints
        .flat_map(|(j, joint)| {
            std::iter::repeat_n(value(template.parts().segment(j)), joint.motion.dofs())
        })
        .collect()
}

/// Share of the rest-pose prior that is left for a joint in full view: the prior shortens every motion.
///
/// Hips and legs keep all of it: the little that is seen of a cut-off leg drags them. Neck and head keep it because of
/// hair.
fn seen_share(segment: BodySegment) -> f64 {
    use BodySegment::*;
    match segment {
        Abdomen | Chest | Collar => 0.5,
        UpperArm | Forearm | Hand => 0.25,
        _ => 1.0,
    }
}

/// Weight of the rest-pose prior, per point and squared radian.
///
/// A limb of fifty points with a lever of 15 cm has 7·10⁻⁴, so this yields where there is data. Joints that share a
/// motion (the spine) share it evenly.
fn stiffness(segment: BodySegment) -> f64 {
    use BodySegment::*;
    match segment {
        Abdomen | Chest | Neck | Head | Collar | Hand | Toes => 2e-5,
        Foot => 1e-5,
        _ => 2e-6,
    }
}
