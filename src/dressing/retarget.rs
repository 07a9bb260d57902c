//! Retargeting of points from one body to another: points near the skin of the first keep their distance on the second.
//!
//! Bone maps come first; then the remaining gap between the two skins is added, smoothed over the first one.

use super::body_sections::BodySections;
use super::bone_map::{BoneMap, bone_maps};
use super::settings::RetargetSettings;
use tryon_body::Template;
use tryon_body::parts::vertex_masks;
use tryon_garment::Region;
use tryon_geometry::math::{P3, P3d, V3, V3d};
use tryon_geometry::mesh::smoothing::mean;
use tryon_geometry::spatial::PointTree;

/// Map from a source body in its rest pose to a target body in the canonical pose.
#[derive(Clone, Debug)]
pub(super) struct Retargeting {
    /// Shape `[joints of the source]`.
    bones: Vec<BoneMap>,
    /// Gap that the bone maps leave between the skins, metres. Shape `[vertices of the source]`.
    residual: Vec<V3d>,
}

impl Retargeting {
    pub(super) fn new(
        source: &Template,
        target: &Template,
        sections: &BodySections,
        settings: &RetargetSettings,
    ) -> Self {
        let n = source.mesh().vertices().len();
        let mut out = Self {
            bones: bone_maps(source, target, sections, settings),
            residual: vec![V3d::zeros(); n],
        };
        let parts = vertex_masks(source);
        let skin = TargetSkin::new(target, sections, settings);
        for rounds in settings.smoothing {
            let mapped: Vec<P3> = (0..n).map(|i| out.skin_vertex(source, i)).collect();
            let normals = source.normals(&mapped);
            let mut gaps: Vec<Option<V3d>> = (0..n)
                .map(|i| skin.gap(parts[i], &mapped[i], &normals[i]))
                .collect();
            for _ in 0..rounds {
                gaps = (0..n).map(|i| mean_around(source, &gaps, i)).collect();
            }
            for (r, gap) in out.residual.iter_mut().zip(&gaps) {
                *r += gap.unwrap_or_else(V3d::zeros);
            }
        }
        out
    }
    fn skin_vertex(&self, source: &Template, i: usize) -> P3 {
        let w = source.weights();
        let row = (0..4).map(|k| (usize::from(w.joints[i][k]), f64::from(w.weights[i][k])));
        let p = self.blend(&source.mesh().vertices()[i], row) + self.residual[i];
        P3::from(p.cast::<f32>())
    }
    fn blend(&self, p: &P3, weights: impl Iterator<Item = (usize, f64)>) -> V3d {
        let p: P3d = p.cast();
        weights
            .filter(|w| w.1 > 0.0)
            .fold(V3d::zeros(), |s, (j, w)| s + self.bones[j].apply(&p) * w)
    }
    /// Target position of a point that follows joints with these weights and lies over these source skin vertices.
    pub(super) fn point(&self, p: &P3, joints: &[f32], vertices: &[(u32, f32)]) -> P3 {
        let weights = joints.iter().enumerate().map(|(j, w)| (j, f64::from(*w)));
        let residual = vertices.iter().fold(V3d::zeros(), |s, (v, w)| {
            s + self.residual[*v as usize] * f64::from(*w)
        });
        P3::from((self.blend(p, weights) + residual).cast::<f32>())
    }
}

/// Mean of the known values at a vertex and its neighbours.
fn mean_around(source: &Template, values: &[Option<V3d>], i: usize) -> Option<V3d> {
    let around = source.topology().vertex_neighbours().row(i).iter();
    let all = around.map(|v| *v as usize).chain([i]);
    mean(all.filter_map(|v| values[v].as_ref()))
}

/// The skin of the target, searchable by body part.
struct TargetSkin<'a> {
    vertices: &'a [P3],
    normals: Vec<V3>,
    /// Part, its vertices, and a tree over them.
    parts: Vec<(Region, Vec<usize>, PointTree)>,
    settings: &'a RetargetSettings,
}

impl<'a> TargetSkin<'a> {
    fn new(target: &Template, sections: &'a BodySections, settings: &'a RetargetSettings) -> Self {
        let (vertices, normals) = (&sections.vertices, target.normals(&sections.vertices));
        let search = |part: Region| {
            let own: Vec<usize> = (0..sections.parts.len())
                .filter(|i| sections.parts[*i] & part.0 != 0)
                .collect();
            let points: Vec<P3> = own
                .iter()
                .map(|i| vertices[*i] + normals[*i] * settings.offset)
                .collect();
            (part, own, PointTree::new(&points))
        };
        let parts = [
            Region::TRUNK,
            Region::LEFT_ARM,
            Region::RIGHT_ARM,
            Region::LEFT_LEG,
            Region::RIGHT_LEG,
        ]
        .map(search)
        .into();
        Self {
            vertices,
            normals,
            parts,
            settings,
        }
    }
    /// Displacement from `p` to the target skin along its normal; `None` without a counterpart in the same part.
    fn gap(&self, part: u8, p: &P3, normal: &V3) -> Option<V3d> {
        let (_, own, tree) = self.parts.iter().find(|(r, ..)| part & r.0 != 0)?;
        let s = self.settings;
        let (reach, same_side, offset) = (s.reach, s.same_side, s.offset);
        let (k, _) = tree.nearest(&(p + normal * offset), reach)?;
        let (q, m) = (self.vertices[own[k]], self.normals[own[k]]);
        // Across the skin only: along it the bone maps are more exact.
        (m.dot(normal) > same_side).then(|| (m * m.dot(&(q - p))).cast())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SectionSettings;
    use tryon_body::{BodyShape, embedded};

    #[test]
    fn a_body_retargeted_to_itself_keeps_its_hips_and_to_a_heavy_one_reaches_its_skin() {
        let t = embedded::template();
        let heavy = [0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0];
        for (coefficients, most) in [(&[][..], 0.004), (&heavy[..], 0.012)] {
            let rest = t.personalise(&BodyShape {
                coefficients: coefficients.to_vec(),
                ..BodyShape::default()
            });
            let sections = BodySections::new(&t, &rest, None, &SectionSettings::default());
            let map = Retargeting::new(&t, &t, &sections, &RetargetSettings::default());
            let parts = vertex_masks(&t);
            let trunk: Vec<usize> = (0..parts.len())
                .filter(|i| parts[*i] == Region::TRUNK.0)
                .collect();
            let far: f32 = trunk
                .iter()
                .map(|i| (map.skin_vertex(&t, *i) - sections.vertices[*i]).norm())
                .sum::<f32>()
                / trunk.len() as f32;
            assert!(far < most, "{far} m from the same vertex, mean");
        }
    }
}
