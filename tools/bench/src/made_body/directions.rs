//! The shape space: how the figure's vertices and joints move per standard deviation of each direction.
//!
//! Girths, breadths and sex: the vertices follow their bones, then are projected onto the surface of the changed
//! figure; a direction is half the difference between +1 and −1. Lengths: bones are stretched, sections grow less.
//! Each direction but the belly is then scaled until its own measure moves by its published standard deviation.

use super::field::Field;
use super::figure::{Figure, Joints};
use super::{BodySettings, carve, rig, statistics as stat};
use tryon_body::embedded::DIRECTIONS;
use tryon_body::measure::{Measurements, measure};
use tryon_body::parts::BodySegment;
use tryon_body::{BodyError, BodyShape, ShapeSpace, Skeleton, SkinWeights, Template};
use tryon_geometry::math::{P3d, V3d};
use tryon_geometry::mesh::smoothing::smoothed;
use tryon_geometry::par::{self, Par};

/// Offsets of vertices and joints for one unit.
#[derive(Clone)]
struct Direction {
    vertices: Vec<V3d>,
    joints: Vec<V3d>,
}

/// Source of the directions: the template without shape, its points (left and right) and mirror images.
pub(super) struct ShapeSource<'a> {
    pub template: &'a Template,
    pub points: &'a [P3d],
    /// Image of each point on the other side.
    pub mirror: &'a [u32],
    pub settings: &'a BodySettings,
}

impl ShapeSource<'_> {
    fn skeleton(&self) -> &Skeleton {
        self.template.skeleton()
    }
    fn weights(&self) -> &SkinWeights {
        self.template.weights()
    }
    /// Mean of a function of the joints of a point, by its skinning weights.
    fn blend(&self, i: usize, f: impl Fn(usize) -> V3d) -> V3d {
        let w = self.weights();
        (0..4)
            .filter(|&k| w.weights[i][k] > 0.0)
            .map(|k| f(usize::from(w.joints[i][k])) * f64::from(w.weights[i][k]))
            .sum()
    }
    /// Offsets from the left half, mirrored.
    fn mirrored(&self, left: impl Fn(usize) -> V3d + Sync) -> Vec<V3d> {
        let mut out = Vec::new();
        par::map_into(Par::Rayon, self.points.len(), 256, &mut out, |i| {
            let p = self.points[i];
            if p.x < 0.0 {
                return V3d::zeros();
            }
            let mut d = left(i);
            if p.x == 0.0 {
                d.x = 0.0;
            }
            d
        });
        for i in 0..out.len() {
            if self.points[i].x < 0.0 {
                let d = out[self.mirror[i] as usize];
                out[i] = V3d::new(-d.x, d.y, d.z);
            }
        }
        out
    }
    /// Smoothed offsets, still symmetric.
    fn smoothed(&self, mut offsets: Vec<V3d>) -> Vec<V3d> {
        let neighbours = self.template.topology().vertex_neighbours();
        for _ in 0..self.settings.shape_smoothing {
            let next = smoothed(Par::Rayon, neighbours, &offsets);
            // A right vertex copies its image, for symmetry to the bit.
            offsets = self.mirrored(|i| next[i]);
        }
        offsets
    }

    /// Offsets to the figure `fig`, and its joints: vertices follow the bones, then are projected.
    fn reshaped(&self, fig: &Figure) -> (Vec<V3d>, Vec<P3d>) {
        let neutral = Figure::default();
        let (j, joints) = (fig.joints(), rest(&fig.joints()));
        let old = rest(&neutral.joints());
        let field: Field = carve(fig, &j);
        let size = |k: usize| match self.template.parts().segment(k) {
            BodySegment::Hand => fig.hand() / neutral.hand(),
            BodySegment::Foot => fig.foot() / neutral.foot(),
            _ => 1.0,
        };
        let offsets = self.mirrored(|i| {
            let p = self.points[i];
            let carried =
                p + self.blend(i, |k| joints[k] - old[k] + (p - old[k]) * (size(k) - 1.0));
            field.project(
                &P3d::new(carried.x.max(0.0), carried.y, carried.z),
                self.settings.shape_steps,
            ) - p
        });
        (offsets, joints)
    }

    /// Half the difference between the figures of +1 and −1.
    fn by_figure(&self, change: impl Fn(f64) -> Figure) -> Direction {
        let ((v1, j1), (v0, j0)) = (self.reshaped(&change(1.0)), self.reshaped(&change(-1.0)));
        let vertices = v1.iter().zip(&v0).map(|(a, b)| (a - b) * 0.5).collect();
        Direction {
            vertices: self.smoothed(vertices),
            joints: j1.iter().zip(&j0).map(|(a, b)| (a - b) * 0.5).collect(),
        }
    }

    /// Stretches bones; soles stay on the floor. Both functions give relative growth.
    ///
    /// `length(s)` is that of the bone that ends where segment `s` begins, `section(s)` that of the sections of `s`.
    fn by_lengths(
        &self,
        length: impl Fn(BodySegment) -> f64,
        section: impl Fn(BodySegment) -> f64,
    ) -> Direction {
        let joints = self.skeleton().joints();
        let segment = |k: usize| self.template.parts().segment(k);
        let mut moved = vec![V3d::zeros(); joints.len()];
        for (k, j) in joints.iter().enumerate() {
            if let Some(p) = j.parent {
                moved[k] = moved[p] + (j.rest - joints[p].rest) * length(segment(k));
            }
        }
        let grow: Vec<(f64, f64)> = (0..joints.len())
            .map(|k| {
                let child = self.skeleton().primary_child(k);
                (
                    child.map_or(0.0, |c| length(segment(c))),
                    section(segment(k)),
                )
            })
            .collect();
        let mut vertices = self.mirrored(|i| {
            let p = self.points[i];
            self.blend(i, |k| {
                let from = joints[k].rest;
                let foot = self.skeleton().primary_child(k).map_or(from, |c| {
                    let d = joints[c].rest - from;
                    from + d
                        * ((p - from).dot(&d) / d.norm_squared().max(f64::MIN_POSITIVE))
                            .clamp(0.0, 1.0)
                });
                moved[k] + (foot - from) * grow[k].0 + (p - foot) * grow[k].1
            })
        });
        let lowest =
            (0..self.points.len()).min_by(|&a, &b| self.points[a].y.total_cmp(&self.points[b].y));
        let floor = V3d::new(0.0, lowest.map_or(0.0, |i| vertices[i].y), 0.0);
        vertices
            .iter_mut()
            .chain(&mut moved)
            .for_each(|v| *v -= floor);
        Direction {
            vertices,
            joints: moved,
        }
    }
}

fn rest(j: &Joints) -> Vec<P3d> {
    rig::joints(j).into_iter().map(|j| j.rest).collect()
}

fn scaled(direction: Direction, s: f64) -> Direction {
    let scale = |all: Vec<V3d>| all.into_iter().map(|o| o * s).collect();
    Direction {
        vertices: scale(direction.vertices),
        joints: scale(direction.joints),
    }
}

/// A measure and the published deviation that one unit of a direction must change it by, metres.
type Target = (fn(&Measurements) -> f64, f64);

/// Growth of a segment's sections with stature, relative to the growth in length.
fn section_growth(settings: &BodySettings, segment: BodySegment) -> f64 {
    match segment {
        BodySegment::Head => settings.head_growth,
        // Hands and feet keep their proportions.
        BodySegment::Hand | BodySegment::Foot => 1.0,
        _ => settings.section_growth,
    }
}

/// The directions before they are scaled to their targets, in the order of [`DIRECTIONS`].
fn raw_directions(source: &ShapeSource) -> [(Direction, Option<Target>); 10] {
    use BodySegment::{Abdomen, Chest, Collar, Foot, Forearm, Hand, Head, Neck, Shin};
    let settings = source.settings;
    let growth = stat::STATURE.deviation() / stat::STATURE.mean();
    let along = |s: BodySegment| growth * if s == Head { settings.head_growth } else { 1.0 };
    let stature = source.by_lengths(along, |s| growth * section_growth(settings, s));
    let only = |segments: &'static [BodySegment], growth: f64| {
        let length = move |s: BodySegment| if segments.contains(&s) { growth } else { 0.0 };
        source.by_lengths(length, |_| 0.0)
    };
    let limbs = only(&[Shin, Foot, Forearm, Hand], settings.limb_probe);
    let torso = only(&[Abdomen, Chest, Neck, Collar], settings.torso_probe);
    let figure = |of: fn(&mut Figure) -> &mut f64| {
        source.by_figure(|c| {
            let mut figure = Figure::default();
            *of(&mut figure) = c;
            figure
        })
    };
    let mass_waist = stat::WAIST.correlation * stat::WAIST.deviation();
    let inseam = stat::CROTCH.residual();
    let torso_length = stat::SITTING.residual();
    let shoulders = stat::SHOULDERS.residual();
    let [chest, waist, hip] = [stat::CHEST, stat::WAIST, stat::HIP].map(|s| s.residual());
    [
        (stature, Some((|m| m.stature, stat::STATURE.deviation()))),
        (figure(|f| &mut f.girth), Some((|m| m.waist, mass_waist))),
        (figure(|f| &mut f.sex), None),
        (limbs, Some((|m| m.inseam, inseam))),
        (torso, Some((|m| m.torso_length, torso_length))),
        (
            figure(|f| &mut f.shoulder),
            Some((|m| m.shoulder_width, shoulders)),
        ),
        (figure(|f| &mut f.chest), Some((|m| m.chest, chest))),
        (figure(|f| &mut f.waist), Some((|m| m.waist, waist))),
        (figure(|f| &mut f.hip), Some((|m| m.hip, hip))),
        (figure(|f| &mut f.belly), None),
    ]
}

/// All directions of the shape space.
///
/// # Errors
/// When the body cannot be measured; never in a correct build.
pub(super) fn shape_space(source: &ShapeSource) -> Result<ShapeSpace, BodyError> {
    let mut space = ShapeSpace::default();
    let mut stature_unit = None;
    for (name, (mut direction, target)) in DIRECTIONS.iter().zip(raw_directions(source)) {
        if let Some((of, deviation)) = target {
            let [more, less] = [1.0, -1.0].map(|c| probe(source, &direction, c));
            let change = 0.5 * (of(&more?) - of(&less?));
            direction = scaled(direction, deviation / change);
        }
        if *name == "stature" {
            stature_unit = Some(direction.clone());
        }
        if let ("sex", Some(unit)) = (*name, &stature_unit) {
            // Men are taller: the figure's sex is at equal stature, the direction's is not.
            let growth = stat::STATURE.sex() / stat::STATURE.deviation();
            let taller = scaled(unit.clone(), growth);
            let add = |to: &mut [V3d], by: &[V3d]| {
                to.iter_mut().zip(by).for_each(|(a, b)| *a += b);
            };
            add(&mut direction.vertices, &taller.vertices);
            add(&mut direction.joints, &taller.joints);
        }
        let Direction { vertices, joints } = direction;
        space.names.push((*name).to_owned());
        space
            .vertices
            .push(vertices.iter().map(|o| o.cast()).collect());
        space.joints.push(joints);
    }
    Ok(space)
}

/// Measures the body moved by `c` units of a direction.
fn probe(source: &ShapeSource, direction: &Direction, c: f64) -> Result<Measurements, BodyError> {
    let mut body = source.template.personalise(&BodyShape::default());
    body.vertices
        .iter_mut()
        .zip(&direction.vertices)
        .for_each(|(p, o)| *p += (o * c).cast::<f32>());
    body.joints
        .iter_mut()
        .zip(&direction.joints)
        .for_each(|(p, o)| *p += o * c);
    measure(source.template, &body).map_err(|e| BodyError::Array {
        array: "shapedirs".into(),
        why: e.to_string(),
    })
}
