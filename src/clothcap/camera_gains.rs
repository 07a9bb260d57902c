//! Gains of the cameras of a fused cloud, divided out of its colours.
//!
//! White balance and exposure of consumer cameras differ by tens of percent, and a cloud does not say which camera saw a
//! point. A camera sees the surfaces that face it: its gain is a function of their azimuth. Around a limb a garment has
//! one colour, so that each ring around a bone votes on that function.

use super::align::Alignment;
use super::scan::BodyScan;
use super::segment::{BodyRegion, bone_slices};
use super::settings::{CameraGainSettings, LabelSettings};
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;
use std::f32::consts::TAU;
use tryon_body::Template;
use tryon_geometry::math::V3;
use tryon_geometry::math::order_statistics::median;

/// Azimuths at which the gain is known, 15° apart.
const AZIMUTHS: usize = 24;

type Gains = SVector<f64, AZIMUTHS>;

/// Mean logarithms of the colours of a ring around a bone at one azimuth.
#[derive(Clone, Copy, Debug, Default)]
struct RingColor {
    logs: [f32; 3],
    /// Mean share of the gain.
    level: f32,
    count: f32,
}

/// A cloud in colours without the gains of the cameras that saw it; `None` for other scans.
pub(super) fn without_gains(
    scan: &BodyScan,
    alignment: &Alignment,
    template: &Template,
    settings: &LabelSettings,
) -> Option<BodyScan> {
    if !scan.is_cloud || scan.colors.is_empty() {
        return None;
    }
    let directions = Directions::of(alignment, template, settings.gains.level);
    let rings = rings(scan, alignment, template, &directions, settings);
    let gains: [Gains; 3] = std::array::from_fn(|channel| solve(&rings, channel, &settings.gains));
    let even = |(color, node): (&[u8; 3], usize)| {
        std::array::from_fn(|c| {
            let gain = directions.gain(node, &gains[c]);
            (f32::from(color[c]) * (-gain).exp()).round().min(255.0) as u8
        })
    };
    let points = scan.colors.iter().zip(nodes(alignment, template));
    Some(BodyScan {
        colors: points.map(even).collect(),
        ..scan.clone()
    })
}

/// Directions of the normals of the body model.
struct Directions {
    /// Azimuth in steps, within 0 to [`AZIMUTHS`]; shape `[vertices]`.
    azimuths: Vec<f32>,
    /// Share of the gain; shape `[vertices]`.
    levels: Vec<f32>,
}

impl Directions {
    fn of(alignment: &Alignment, template: &Template, level: f32) -> Self {
        let normals = template.normals(&alignment.model);
        let share = |n: &V3| (n.xz().norm() / level).min(1.0);
        let azimuth = |n: &V3| n.x.atan2(n.z).rem_euclid(TAU) / TAU * AZIMUTHS as f32;
        Self {
            azimuths: normals.iter().map(azimuth).collect(),
            levels: normals.iter().map(share).collect(),
        }
    }

    /// Logarithm of the gain at a vertex.
    fn gain(&self, vertex: usize, gains: &Gains) -> f32 {
        let at = self.azimuths[vertex] - 0.5;
        let (low, share) = (at.floor(), f64::from(at - at.floor()));
        let [a, b] =
            [low, low + 1.0].map(|k| gains[k.rem_euclid(AZIMUTHS as f32) as usize % AZIMUTHS]);
        self.levels[vertex] * (a * (1.0 - share) + b * share) as f32
    }
}

/// Nearest vertex of each scan point, shape `[points]`.
fn nodes(alignment: &Alignment, template: &Template) -> impl Iterator<Item = usize> {
    let faces = template.mesh().faces();
    let matches = alignment.matches.iter();
    matches.map(|m| m.nearest_vertex(faces) as usize)
}

/// Colours by ring and azimuth; heads have faces before and hair behind, and are left out.
fn rings(
    scan: &BodyScan,
    alignment: &Alignment,
    template: &Template,
    directions: &Directions,
    settings: &LabelSettings,
) -> Vec<Vec<(usize, RingColor)>> {
    let gains = &settings.gains;
    let regions = BodyRegion::of_vertices(template);
    let ring_of = bone_slices(template, gains.ring);
    let mut cells: BTreeMap<(usize, i32), BTreeMap<usize, RingColor>> = BTreeMap::new();
    let nodes = nodes(alignment, template).zip(&alignment.matches);
    for ((node, m), color) in nodes.zip(&scan.colors) {
        let is_used = m.weight > 0.0 && m.distance < settings.near;
        if !is_used || regions[node] == BodyRegion::Head {
            continue;
        }
        let azimuth = directions.azimuths[node] as usize % AZIMUTHS;
        let ring = cells.entry(ring_of[node]).or_default();
        let cell = ring.entry(azimuth).or_default();
        (0..3).for_each(|c| cell.logs[c] += (f32::from(color[c]) + gains.dark).ln());
        cell.level += directions.levels[node];
        cell.count += 1.0;
    }
    let mean = |(azimuth, sum): (usize, RingColor)| {
        let scale = 1.0 / sum.count;
        let mean = RingColor {
            logs: sum.logs.map(|l| l * scale),
            level: sum.level * scale,
            ..sum
        };
        (azimuth, mean)
    };
    let ring = |cells: BTreeMap<usize, RingColor>| {
        let is_voter = |s: &RingColor| s.count >= gains.least_points;
        let many = cells.into_iter().filter(|(_, s)| is_voter(s));
        many.map(mean).collect()
    };
    cells.into_values().map(ring).collect()
}

/// Logarithms of the gains of a channel by azimuth: with them, each ring has about one colour all around.
fn solve(
    rings: &[Vec<(usize, RingColor)>],
    channel: usize,
    settings: &CameraGainSettings,
) -> Gains {
    let mut gains = Gains::zeros();
    let mut weights: Vec<Vec<f64>> = rings.iter().map(|r| vec![1.0; r.len()]).collect();
    for _ in 0..settings.rounds {
        let mut h = SMatrix::<f64, AZIMUTHS, AZIMUTHS>::identity() * settings.own;
        let mut g = Gains::zeros();
        for k in 0..AZIMUTHS {
            let next = (k + 1) % AZIMUTHS;
            h[(k, k)] += settings.smooth;
            h[(next, next)] += settings.smooth;
            h[(k, next)] -= settings.smooth;
            h[(next, k)] -= settings.smooth;
        }
        // The colour of a ring is eliminated: its weighted mean less that of its gains.
        for (ring, weights) in rings.iter().zip(&weights) {
            let all: f64 = weights.iter().sum();
            let mut mean = (0.0, Gains::zeros());
            for ((k, cell), w) in ring.iter().zip(weights) {
                let level = f64::from(cell.level);
                mean.0 += w * f64::from(cell.logs[channel]);
                mean.1[*k] += w * level;
                h[(*k, *k)] += w * level * level;
                g[*k] += w * level * f64::from(cell.logs[channel]);
            }
            if all > 0.0 {
                h -= mean.1 * mean.1.transpose() / all;
                g -= mean.1 * (mean.0 / all);
            }
        }
        let Some(factor) = h.cholesky() else {
            return Gains::zeros();
        };
        gains = factor.solve(&g);
        let reweighed = |ring: &Vec<_>| robust_weights(ring, channel, &gains, settings.robust);
        weights = rings.iter().map(reweighed).collect();
    }
    gains.map(|g| g.clamp(-settings.largest, settings.largest))
}

/// Weights by which differences from the ring's colour count by their size, not its square, from `robust` on.
fn robust_weights(
    ring: &[(usize, RingColor)],
    channel: usize,
    gains: &Gains,
    robust: f64,
) -> Vec<f64> {
    let left = |(k, cell): &(usize, RingColor)| {
        f64::from(cell.logs[channel]) - f64::from(cell.level) * gains[*k]
    };
    let left: Vec<f64> = ring.iter().map(left).collect();
    let middle = median(&mut left.clone()).unwrap_or(0.0);
    let weight = |x: &f64| robust / (x - middle).abs().max(robust);
    left.iter().map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::{AlignedBody, AlignmentReport, SurfaceMatch};
    use tryon_body::{BodyShape, BoneTransforms, Pose, embedded};
    use tryon_geometry::math::{P3, Rigid};

    /// A point on each vertex of the template, painted by place, seen by a camera in front and one behind that differ by
    /// `gains`; and without their gains.
    fn evened(paint: impl Fn(&P3) -> [f32; 3], gains: [f32; 3]) -> (BodyScan, Vec<[u8; 3]>) {
        let template = embedded::template();
        let mesh = template.mesh();
        let points = mesh.vertices().to_vec();
        let mut matches = vec![SurfaceMatch::default(); points.len()];
        for (f, face) in mesh.faces().iter().enumerate() {
            for (k, v) in face.iter().enumerate() {
                let m = &mut matches[*v as usize];
                (m.face, m.corners, m.weight) = (f as u32, [0.0; 3], 1.0);
                m.corners[k] = 1.0;
            }
        }
        let normals = template.normals(&points);
        let seen = |(p, n): (&P3, &V3)| {
            let color = paint(p);
            let front = n.z > 0.0;
            std::array::from_fn(|c| {
                let gain = if front { gains[c] } else { 1.0 };
                (color[c] * gain).min(255.0) as u8
            })
        };
        let scan = BodyScan {
            colors: points.iter().zip(&normals).map(seen).collect(),
            points: points.clone(),
            is_cloud: true,
            ..BodyScan::default()
        };
        let alignment = Alignment {
            body: AlignedBody {
                pose: Pose::rest(template.skeleton(), Rigid::identity()),
                shape: BodyShape::default(),
            },
            bones: BoneTransforms::default(),
            model: points.clone(),
            surface: points,
            matches,
            report: AlignmentReport::default(),
        };
        let out = without_gains(&scan, &alignment, &template, &LabelSettings::default());
        (scan, out.expect("a cloud").colors)
    }

    /// Mean ratio of front to back of the thighs, by channel.
    fn ratio(scan: &BodyScan, colors: &[[u8; 3]]) -> [f32; 3] {
        let template = embedded::template();
        let regions = BodyRegion::of_vertices(&template);
        let mean = |front: bool, c: usize| {
            let own = (0..colors.len()).filter(|v| regions[*v] == BodyRegion::Thigh);
            let own = own.filter(|v| (scan.points[*v].z > 0.0) == front);
            let own: Vec<f32> = own.map(|v| f32::from(colors[v][c])).collect();
            own.iter().sum::<f32>() / own.len().max(1) as f32
        };
        std::array::from_fn(|c| mean(true, c) / mean(false, c))
    }

    #[test]
    fn gains_of_two_cameras_are_divided_out() {
        let paint = |p: &P3| match p.y > 1.0 {
            true => [60.0, 90.0, 150.0],
            false => [110.0, 100.0, 80.0],
        };
        let (scan, colors) = evened(paint, [1.3, 1.0, 0.8]);
        let [before, after] = [&scan.colors, &colors].map(|c| ratio(&scan, c));
        assert!((before[0] - 1.3).abs() < 0.1 && (before[2] - 0.8).abs() < 0.1);
        assert!(after.iter().all(|r| (r - 1.0).abs() < 0.05), "{after:?}");
    }

    #[test]
    fn a_front_in_another_colour_keeps_it() {
        let is_front = |p: &P3| (1.0..1.35).contains(&p.y) && p.z > 0.03 && p.x.abs() < 0.12;
        let paint = |p: &P3| match is_front(p) {
            true => [220.0; 3],
            false => [70.0, 80.0, 110.0],
        };
        let (scan, colors) = evened(paint, [1.0; 3]);
        let changed = scan.colors.iter().zip(&colors);
        let changed = changed.map(|(a, b)| a[0].abs_diff(b[0]));
        assert!(changed.max() < Some(15), "{:?}", ratio(&scan, &colors));
    }
}
