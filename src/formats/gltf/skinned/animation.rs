//! Animation of joints and morph weights (glTF 2.0, section 3.11).

use super::super::document::GlbDocument;
use super::scene::{GlbInterpolation, GlbJointMotion, GlbMorphMotion, SkinnedGlb};
use nalgebra::{UnitQuaternion, Vector4};
use serde_json::{Value, json};

/// Samplers and channels of one animation, one of each a moving property.
#[derive(Default)]
struct AnimationChannels {
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

impl AnimationChannels {
    /// Animates property `path` of a node; `input` and `output` are accessors.
    fn add(&mut self, sampler: Value, node: usize, path: &str) {
        let target = json!({"node": node, "path": path});
        self.channels
            .push(json!({"sampler": self.samplers.len(), "target": target}));
        self.samplers.push(sampler);
    }
}

/// Adds one animation of all that moves; `nodes` are those of the meshes, the node of joint `j` is node `j`.
pub(super) fn add_animation(document: &mut GlbDocument, scene: &SkinnedGlb<'_>, nodes: &[usize]) {
    let mut channels = AnimationChannels::default();
    if let Some(motion) = &scene.motion {
        add_joints(document, &mut channels, motion);
    }
    for (m, node) in scene.meshes.iter().zip(nodes) {
        if let Some(motion) = &m.target_motion {
            let sampler = weight_sampler(document, motion);
            channels.add(sampler, *node, "weights");
        }
    }

    if !channels.samplers.is_empty() {
        document.animations.push(json!({
            "name": "motion", "samplers": channels.samplers, "channels": channels.channels,
        }));
    }
}

/// Adds the translation of joint 0 and the rotations of all joints that leave the rest pose.
fn add_joints(
    document: &mut GlbDocument,
    channels: &mut AnimationChannels,
    motion: &GlbJointMotion<'_>,
) {
    let times = add_times(document, motion.seconds);
    let roots = motion.roots.iter().map(|p| p.coords.cast::<f32>().into());
    let roots = document.vectors("VEC3", roots, false);
    let roots = sampler(times, roots, GlbInterpolation::Linear);
    channels.add(roots, 0, "translation");

    let joints = motion.rotations.first().map_or(0, Vec::len);
    for j in 0..joints {
        let rotations = continuous(motion.rotations.iter().map(|row| row[j]));
        if rotations.iter().all(|q| *q == [0.0, 0.0, 0.0, 1.0]) {
            continue;
        }
        let output = document.vectors("VEC4", rotations.into_iter(), false);
        let rotations = sampler(times, output, GlbInterpolation::Linear);
        channels.add(rotations, j, "rotation");
    }
}

fn weight_sampler(document: &mut GlbDocument, motion: &GlbMorphMotion<'_>) -> Value {
    let times = add_times(document, motion.seconds);
    let weights = motion.weights.iter().flatten().map(|w| [*w]);
    let weights = document.vectors("SCALAR", weights, false);
    sampler(times, weights, motion.interpolation)
}

fn add_times(document: &mut GlbDocument, seconds: &[f64]) -> usize {
    document.vectors("SCALAR", seconds.iter().map(|s| [*s as f32]), false)
}

fn sampler(input: usize, output: usize, interpolation: GlbInterpolation) -> Value {
    json!({"input": input, "output": output, "interpolation": interpolation.name()})
}

/// Unit quaternions (x, y, z, w), each of the sign nearer to the one before it.
/// Blending components, as some viewers do, then takes the shorter arc.
pub(super) fn continuous(rotations: impl Iterator<Item = UnitQuaternion<f64>>) -> Vec<[f32; 4]> {
    let mut last = Vector4::w();
    rotations
        .map(|q| {
            let unit = q.coords.normalize();
            last = if unit.dot(&last) < 0.0 { -unit } else { unit };
            last.cast::<f32>().into()
        })
        .collect()
}
