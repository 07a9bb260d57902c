//! Frames of reference and the poses between them, as `/tf` states them.

use super::fault::MessageFault;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Smallest length of a quaternion that is a rotation; writers leave zeros in unset ones.
const SMALLEST_QUATERNION: f64 = 1e-6;

/// Pose of one frame in another.
#[derive(Clone, Debug)]
pub(super) struct FrameEdge {
    pub(super) parent: String,
    pub(super) child: String,
    /// Maps points of `child` to `parent`, metres.
    pub(super) pose: Isometry3<f64>,
}

/// Pose from a translation \[m\] and a quaternion x, y, z, w; zeros are no rotation.
///
/// # Errors
/// A number that is not finite.
pub(super) fn pose(
    translation: [f64; 3],
    [x, y, z, w]: [f64; 4],
) -> Result<Isometry3<f64>, MessageFault> {
    if ![x, y, z, w]
        .iter()
        .chain(&translation)
        .all(|v| v.is_finite())
    {
        return Err(MessageFault::new("transform", "not a finite pose"));
    }
    let quaternion = Quaternion::new(w, x, y, z);
    let rotation = UnitQuaternion::try_new(quaternion, SMALLEST_QUATERNION).unwrap_or_default();
    Ok(Isometry3::from_parts(
        Translation3::from(translation),
        rotation,
    ))
}

/// All poses of a recording's start; of each pair of frames the first one stated.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameGraph {
    /// Neighbours of a frame: `from → to → pose that maps points of `from` to `to``.
    poses: BTreeMap<String, BTreeMap<String, Isometry3<f64>>>,
}

impl FrameGraph {
    /// Adds a pose.
    pub(super) fn insert(&mut self, edge: FrameEdge) {
        let FrameEdge {
            parent,
            child,
            pose,
        } = edge;
        let mut put = |from: &String, to: &String, pose| {
            let neighbours = self.poses.entry(from.clone()).or_default();
            neighbours.entry(to.clone()).or_insert(pose);
        };
        put(&child, &parent, pose);
        put(&parent, &child, pose.inverse());
    }

    /// Transform that maps points of `from` to `to`, by the fewest poses; `None` without a path.
    pub(super) fn transform(&self, from: &str, to: &str) -> Option<Isometry3<f64>> {
        let mut known = BTreeSet::from([from]);
        let mut queue = VecDeque::from([(from, Isometry3::identity())]);
        while let Some((frame, to_frame)) = queue.pop_front() {
            if frame == to {
                return Some(to_frame);
            }
            for (next, pose) in self.poses.get(frame).into_iter().flatten() {
                if known.insert(next) {
                    queue.push_back((next, pose * to_frame));
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_chain_over_common_parents_and_loops_end() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let edge = |parent: &str, child: &str, t: [f64; 3], q: [f64; 4]| FrameEdge {
            parent: parent.into(),
            child: child.into(),
            pose: pose(t, q).expect("finite"),
        };
        let mut graph = FrameGraph::default();
        graph.insert(edge(
            "link",
            "depth",
            [0.0, 0.1, 0.0],
            [0.0, 0.0, half, half],
        ));
        graph.insert(edge(
            "link",
            "color",
            [0.0, 0.3, 0.0],
            [0.0, 0.0, half, half],
        ));
        graph.insert(edge("color", "depth2", [0.0; 3], [0.0; 4]));
        graph.insert(edge("depth2", "link", [9.0; 3], [0.0; 4]));
        let t = graph.transform("depth", "color").expect("a path");
        // 0.2 m along the link's y is 0.2 m along x of frames turned by 90° about z.
        assert!((t.translation.vector - nalgebra::Vector3::new(-0.2, 0.0, 0.0)).norm() < 1e-12);
        assert!(t.rotation.angle() < 1e-7);
        assert!(graph.transform("depth", "nowhere").is_none());
        assert!(graph.transform("a", "a").is_some());
        assert!(pose([f64::NAN; 3], [0.0; 4]).is_err());
    }
}
