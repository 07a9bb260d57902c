//! Affine map of each bone from one body to another: turned, stretched to the other's length and widened to its girth.

use super::body_sections::BodySections;
use super::settings::RetargetSettings;
use nalgebra::{Matrix3, UnitQuaternion, center};
use tryon_body::parts::mean_radius;
use tryon_body::{Joint, Template};
use tryon_geometry::math::{P3, P3d, V3d};

/// x ↦ to + m (x − from), metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoneMap {
    m: Matrix3<f64>,
    from: P3d,
    to: P3d,
}

impl BoneMap {
    pub(super) fn apply(&self, p: &P3d) -> V3d {
        self.to.coords + self.m * (p - self.from)
    }
}

/// Maps of the joints of `source`, in its rest pose, to `target` in the canonical pose. Shape `[joints of source]`.
pub(super) fn bone_maps(
    source: &Template,
    target: &Template,
    sections: &BodySections,
    settings: &RetargetSettings,
) -> Vec<BoneMap> {
    let pair = BodyPair {
        source,
        target,
        sections,
        settings,
    };
    let trunk = pair.trunk();
    let mut out: Vec<BoneMap> = Vec::with_capacity(source.skeleton().len());
    for joint in source.skeleton().joints() {
        let above = joint.parent.map(|p| out[p]);
        out.push(pair.bone(joint, above).unwrap_or(trunk));
    }
    out
}

struct BodyPair<'a> {
    source: &'a Template,
    target: &'a Template,
    sections: &'a BodySections,
    settings: &'a RetargetSettings,
}

impl BodyPair<'_> {
    /// Ratio of two lengths, metres; one where either is missing or too short.
    fn ratio(&self, from: Option<f64>, to: Option<f64>) -> f64 {
        let [least, most] = self.settings.ratio;
        match (from, to) {
            (Some(a), Some(b)) if a > self.settings.shortest => (b / a).clamp(least, most),
            _ => 1.0,
        }
    }
    /// A joint on the source and on the target.
    fn joint(&self, name: &str) -> [Option<P3d>; 2] {
        let source = self.source.skeleton();
        let target = self.target.skeleton().index(name);
        [
            source.index(name).map(|j| source.joints()[j].rest),
            target.map(|j| self.sections.joints[j]),
        ]
    }
    fn both(&self, name: &str) -> Option<[P3d; 2]> {
        let [a, b] = self.joint(name);
        Some([a?, b?])
    }
    /// `[left, right]` of a paired joint, on the source and on the target.
    fn sides(&self, name: &str) -> [Option<[P3d; 2]>; 2] {
        let left = self.joint(&format!("left_{name}"));
        let right = self.joint(&format!("right_{name}"));
        std::array::from_fn(|k| Some([left[k]?, right[k]?]))
    }
    /// One map: along the spine joints of skeletons differ, hips and shoulders agree.
    fn trunk(&self) -> BoneMap {
        let middle = |pair: Option<[P3d; 2]>| pair.map(|[l, r]| center(&l, &r));
        let shoulders = self.sides("shoulder");
        let hips = self.sides("hip").map(middle);
        let [from, to] = shoulders.map(|pair| pair.map(|[l, r]| (l - r).norm()));
        let wide = self.ratio(from, to);
        let height = |k: usize| Some((middle(shoulders[k])? - hips[k]?).y);
        let high = self.ratio(height(0), height(1));
        BoneMap {
            m: Matrix3::from_diagonal(&V3d::new(wide, high, wide)),
            from: hips[0].unwrap_or_else(P3d::origin),
            to: hips[1].unwrap_or_else(P3d::origin),
        }
    }
    /// `None` for the bones of the trunk; `above`: the parent's map.
    fn bone(&self, joint: &Joint, above: Option<BoneMap>) -> Option<BoneMap> {
        let name = joint.name.as_str();
        let (side, part) = name.split_once('_').unwrap_or_default();
        match part {
            "shoulder" => self.limb(name, &format!("{side}_elbow")),
            "elbow" => self.limb(name, &format!("{side}_wrist")),
            "hip" => self.limb(name, &format!("{side}_knee")),
            "knee" => self.limb(name, &format!("{side}_ankle")),
            "wrist" => self.hand(name, above),
            "ankle" => {
                let foot = format!("{side}_foot");
                self.both(&foot).and_then(|_| self.scaled(name, &foot))
            }
            _ if name == "head" => self.scaled(name, "head_end"),
            _ if name == "neck"
                || part == "collar"
                || name.starts_with("spine")
                || joint.parent.is_none() =>
            {
                None
            }
            _ => above,
        }
    }
    fn limb(&self, joint: &str, end: &str) -> Option<BoneMap> {
        let ([a, c], [b, d]) = (self.both(joint)?, self.both(end)?);
        let (u, v) = ((b - a).try_normalize(0.0)?, (d - c).try_normalize(0.0)?);
        let along = self.ratio(Some((b - a).norm()), Some((d - c).norm()));
        let radius = |body: &Template, vertices: &[P3], bone| {
            mean_radius(body, vertices, body.skeleton().index(joint)?, bone)
        };
        let around = self.ratio(
            radius(self.source, self.source.mesh().vertices(), [a, b]),
            radius(self.target, &self.sections.vertices, [c, d]),
        );
        let q = UnitQuaternion::rotation_between(&u, &v)?.to_rotation_matrix();
        let stretch = Matrix3::identity() * around + u * u.transpose() * (along - around);
        Some(BoneMap {
            m: q.matrix() * stretch,
            from: a,
            to: c,
        })
    }
    /// Hands keep their size and turn with the forearm.
    fn hand(&self, joint: &str, forearm: Option<BoneMap>) -> Option<BoneMap> {
        let ([from, to], forearm) = (self.both(joint)?, forearm?);
        let turn = UnitQuaternion::from_matrix(&forearm.m).to_rotation_matrix();
        Some(BoneMap {
            m: *turn.matrix(),
            from,
            to,
        })
    }
    /// Keeps its orientation, scaled by the ratio of the lengths from `joint` to `end`.
    fn scaled(&self, joint: &str, end: &str) -> Option<BoneMap> {
        let [from, to] = self.both(joint)?;
        let [a, b] = self.joint(end);
        let s = self.ratio(a.map(|p| (p - from).norm()), b.map(|p| (p - to).norm()));
        Some(BoneMap {
            m: Matrix3::identity() * s,
            from,
            to,
        })
    }
}
