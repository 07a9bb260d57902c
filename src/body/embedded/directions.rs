//! The shape space: how the figure's vertices and joints move per standard deviation of each direction.
//!
//! Girths, breadths and sex: the vertices follow their bones, then are projected onto the surface of the changed
//! figure; a direction is half the difference between +1 and −1. Lengths: bones are stretched, sections grow less.
//! Each direction is then scaled until its own measure moves by its published standard deviation.

use super::field::Field;
use super::figure::{Figure, Joints};
use super::{carve, rig, statistics as stat};
use crate::body::measure::{Measurements, measure};
use crate::body::{BodyError, BodyShape, ShapeSpace, Skeleton, SkinWeights, Template};
use crate::math::{P3d, V3, V3d};
use crate::par::{self, Par};

/// Names of the directions, in order; `sex` +1 is the mean man, −1 the mean woman.
pub const DIRECTIONS: [&str; 9] = [
    "stature",
    "girth",
    "sex",
    "limb_length",
    "torso_length",
    "shoulder_width",
    "chest",
    "waist",
    "hip",
];

/// Coefficients of this size span 98.8 % of a normally distributed population; within them the surface stays sound.
pub const RANGE: f64 = 2.5;

/// Projection steps onto the changed surface; a third moves no vertex by 0.1 mm.
const STEPS: usize = 4;
/// Rounds of smoothing of the offsets along the surface.
const SMOOTHING: usize = 8;
/// Sections grow with stature by this share of the growth in length: at the same mass-for-height, r(stature, girths)
/// is about 0.3, and the deviation of girths is some 1.5 times that of stature, relative to the mean.
const SECTION_GROWTH: f64 = 0.45;
/// The head grows with stature by this share (head length has r ≈ 0.3 with stature).
const HEAD_GROWTH: f64 = 0.35;

/// Offsets of vertices and joints for one unit.
type Direction = (Vec<V3d>, Vec<V3d>);

/// What the directions are made from: the template without shape, its points (left and right) and mirror images.
pub(super) struct Source<'a> {
    pub template: &'a Template,
    pub points: &'a [P3d],
    /// For each point its image on the other side.
    pub mirror: &'a [u32],
}

impl Source<'_> {
    fn skeleton(&self) -> &Skeleton {
        self.template.skeleton()
    }
    fn weights(&self) -> &SkinWeights {
        self.template.weights()
    }
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
    fn smoothed(&self, mut offsets: Vec<V3d>) -> Vec<V3d> {
        for _ in 0..SMOOTHING {
            let mut next = Vec::new();
            par::map_into(Par::Rayon, offsets.len(), 512, &mut next, |i| {
                let around = self.template.topology().vertex_neighbours().row(i);
                // Neighbours of a left vertex in order; a right vertex copies its image, for symmetry to the bit.
                let sum: V3d = around.iter().map(|&n| offsets[n as usize]).sum();
                offsets[i] * 0.5 + sum * (0.5 / around.len() as f64)
            });
            offsets = self.mirrored(|i| next[i]);
        }
        offsets
    }

    /// The vertices of the figure `fig`: carried by the bones, then projected.
    fn reshaped(&self, fig: &Figure) -> (Vec<V3d>, Vec<P3d>) {
        let neutral = Figure::default();
        let (j, joints) = (fig.joints(), rest(&fig.joints()));
        let old = rest(&neutral.joints());
        let field: Field = carve(fig, &j);
        let size = |k: usize| {
            let name = &self.skeleton().joints()[k].name;
            if name.ends_with("wrist") {
                fig.hand() / neutral.hand()
            } else if name.ends_with("ankle") {
                fig.foot() / neutral.foot()
            } else {
                1.0
            }
        };
        let offsets = self.mirrored(|i| {
            let p = self.points[i];
            let carried =
                p + self.blend(i, |k| joints[k] - old[k] + (p - old[k]) * (size(k) - 1.0));
            field.project(&P3d::new(carried.x.max(0.0), carried.y, carried.z), STEPS) - p
        });
        (offsets, joints)
    }

    fn by_figure(&self, change: impl Fn(f64) -> Figure) -> Direction {
        let ((v1, j1), (v0, j0)) = (self.reshaped(&change(1.0)), self.reshaped(&change(-1.0)));
        let vertices = v1.iter().zip(&v0).map(|(a, b)| (a - b) * 0.5).collect();
        (
            self.smoothed(vertices),
            j1.iter().zip(&j0).map(|(a, b)| (a - b) * 0.5).collect(),
        )
    }

    /// Stretches bones: `length(name)` is the growth of the bone that ends at a joint, `section(name)` that of the
    /// sections around the bone that starts there; both relative. Soles stay on the floor.
    fn by_lengths(&self, length: impl Fn(&str) -> f64, section: impl Fn(&str) -> f64) -> Direction {
        let joints = self.skeleton().joints();
        let mut moved = vec![V3d::zeros(); joints.len()];
        for (k, j) in joints.iter().enumerate() {
            if let Some(p) = j.parent {
                moved[k] = moved[p] + (j.rest - joints[p].rest) * length(&j.name);
            }
        }
        let grow: Vec<(f64, f64)> = joints
            .iter()
            .enumerate()
            .map(|(k, j)| {
                let child = self.skeleton().primary_child(k);
                (
                    child.map_or(0.0, |c| length(&joints[c].name)),
                    section(&j.name),
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
        (vertices, moved)
    }
}

fn rest(j: &Joints) -> Vec<P3d> {
    rig::joints(j).into_iter().map(|j| j.rest).collect()
}

fn scaled((v, j): Direction, s: f64) -> Direction {
    (
        v.into_iter().map(|o| o * s).collect(),
        j.into_iter().map(|o| o * s).collect(),
    )
}

/// All directions of the shape space.
///
/// # Errors
/// When the body cannot be measured; never in a correct build.
pub(super) fn shape_space(source: &Source) -> Result<ShapeSpace, BodyError> {
    let leg = |n: &str| ["knee", "ankle"].iter().any(|s| n.ends_with(s));
    let arm = |n: &str| ["elbow", "wrist"].iter().any(|s| n.ends_with(s));
    let spine = |n: &str| n.starts_with("spine") || n == "neck" || n.ends_with("collar");
    let growth = stat::STATURE.deviation() / stat::STATURE.mean();
    let head = |n: &str| n.starts_with("head");
    let stature = source.by_lengths(
        |n| growth * if head(n) { HEAD_GROWTH } else { 1.0 },
        |n| {
            let share = if head(n) {
                HEAD_GROWTH
            } else if n.ends_with("ankle") || n.ends_with("wrist") {
                // Hands and feet keep their proportions.
                1.0
            } else {
                SECTION_GROWTH
            };
            growth * share
        },
    );
    let none = Figure::default();
    let raw: [(Direction, Option<Target>); 9] = [
        (stature, Some((|m| m.stature, stat::STATURE.deviation()))),
        (
            source.by_figure(|c| Figure { girth: c, ..none }),
            Some((|m| m.waist, stat::MASS_WAIST * stat::WAIST.deviation())),
        ),
        (source.by_figure(|c| Figure { sex: c, ..none }), None),
        (
            source.by_lengths(|n| if leg(n) || arm(n) { 0.028 } else { 0.0 }, |_| 0.0),
            Some((|m| m.inseam, stat::CROTCH.residual(stat::STATURE_CROTCH))),
        ),
        (
            source.by_lengths(|n| if spine(n) { 0.04 } else { 0.0 }, |_| 0.0),
            Some((
                |m| m.torso_length,
                stat::SITTING.residual(stat::STATURE_SITTING),
            )),
        ),
        (
            source.by_figure(|c| Figure {
                shoulder: c,
                ..none
            }),
            Some((
                |m| m.shoulder_width,
                stat::SHOULDERS.residual(stat::STATURE_SHOULDERS),
            )),
        ),
        (
            source.by_figure(|c| Figure { chest: c, ..none }),
            Some((|m| m.chest, stat::CHEST.residual(stat::MASS_CHEST))),
        ),
        (
            source.by_figure(|c| Figure { waist: c, ..none }),
            Some((|m| m.waist, stat::WAIST.residual(stat::MASS_WAIST))),
        ),
        (
            source.by_figure(|c| Figure { hip: c, ..none }),
            Some((|m| m.hip, stat::HIP.residual(stat::MASS_HIP))),
        ),
    ];
    let mut space = ShapeSpace::default();
    let mut stature_unit = None;
    for (name, (mut direction, target)) in DIRECTIONS.iter().zip(raw) {
        if let Some((of, deviation)) = target {
            let change = 0.5
                * (of(&probe(source, &direction, 1.0)?) - of(&probe(source, &direction, -1.0)?));
            direction = scaled(direction, deviation / change);
        }
        if *name == "stature" {
            stature_unit = Some(direction.clone());
        }
        if let ("sex", Some(unit)) = (*name, &stature_unit) {
            // Men are taller: the figure's sex is at equal stature, the direction's is not.
            let taller = scaled(
                unit.clone(),
                stat::STATURE.sex() / stat::STATURE.deviation(),
            );
            direction
                .0
                .iter_mut()
                .zip(&taller.0)
                .for_each(|(a, b)| *a += b);
            direction
                .1
                .iter_mut()
                .zip(&taller.1)
                .for_each(|(a, b)| *a += b);
        }
        space.names.push((*name).to_owned());
        space.vertices.push(
            direction
                .0
                .iter()
                .map(|o| V3::new(o.x as f32, o.y as f32, o.z as f32))
                .collect(),
        );
        space.joints.push(direction.1);
    }
    Ok(space)
}

/// A measure and the published deviation that one unit of a direction must change it by, metres.
type Target = (fn(&Measurements) -> f64, f64);

/// Measures the body moved by `c` units of a direction.
fn probe(source: &Source, direction: &Direction, c: f64) -> Result<Measurements, BodyError> {
    let mut body = source.template.personalise(&BodyShape::default());
    body.vertices
        .iter_mut()
        .zip(&direction.0)
        .for_each(|(p, o)| *p += (o * c).cast::<f32>());
    body.joints
        .iter_mut()
        .zip(&direction.1)
        .for_each(|(p, o)| *p += o * c);
    measure(source.template, &body).map_err(|e| BodyError::Array {
        array: "shapedirs".into(),
        why: e.to_string(),
    })
}
