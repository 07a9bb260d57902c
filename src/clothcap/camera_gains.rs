//! Gains of the cameras of a fused cloud, divided out of its colours.
//!
//! White balance and exposure of consumer cameras differ by tens of percent, and a cloud does not say which camera saw a
//! point. A camera sees the surfaces that face it: its gain is a function of their azimuth. Around a limb a garment has
//! one colour, so that each ring around a bone votes on that function.

use super::align::Alignment;
use super::scan::BodyScan;
use super::segment::{BodyRegion, bone_slices};
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;
use std::f32::consts::TAU;
use tryon_body::Template;
use tryon_geometry::math::V3;
use tryon_geometry::math::order_statistics::median;

/// Azimuths at which the gain is known, 15° apart.
const AZIMUTHS: usize = 24;
/// Height of a ring along its bone, metres.
const RING: f32 = 0.04;
/// Distance up to which a point shows the surface below it, metres.
const NEAR: f32 = 0.03;
/// Horizontal part of a normal from which it has an azimuth: less and less of a gain is known below.
const LEVEL: f32 = 0.3;
/// Least points of a ring at an azimuth that have a vote.
const LEAST_POINTS: f32 = 3.0;
/// Brightness added before logarithms, of 255: ratios of dark colours are noise.
const DARK: f32 = 12.0;
/// Logarithm of a ratio from which differences count by their size only: garments differ by more than light and gains.
const ROBUST: f64 = 0.05;
/// Rounds of reweighting.
const ROUNDS: usize = 30;
/// Weight of the difference of neighbouring azimuths, and of a gain itself, in votes.
const SMOOTH: [f64; 2] = [4.0, 0.5];
/// Largest logarithm of a gain: white balance and exposure of one camera type.
const LARGEST: f64 = 0.4;

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
) -> Option<BodyScan> {
    if !scan.is_cloud || scan.colors.is_empty() {
        return None;
    }
    let directions = Directions::of(alignment, template);
    let rings = rings(scan, alignment, (template, &directions));
    let gains: [Gains; 3] = std::array::from_fn(|channel| solve(&rings, channel));
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
    /// Share of the gain, see [`LEVEL`]; shape `[vertices]`.
    levels: Vec<f32>,
}

impl Directions {
    fn of(alignment: &Alignment, template: &Template) -> Self {
        let normals = template.normals(&alignment.model);
        let azimuth = |n: &V3| n.x.atan2(n.z).rem_euclid(TAU) / TAU * AZIMUTHS as f32;
        Self {
            azimuths: normals.iter().map(azimuth).collect(),
            levels: normals
                .iter()
                .map(|n| (n.xz().norm() / LEVEL).min(1.0))
                .collect(),
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
    matches.map(|m| faces[m.face as usize][m.nearest_corner()] as usize)
}

/// Colours by ring and azimuth; heads have faces before and hair behind, and are left out.
fn rings(
    scan: &BodyScan,
    alignment: &Alignment,
    (template, directions): (&Template, &Directions),
) -> Vec<Vec<(usize, RingColor)>> {
    let regions = BodyRegion::of_vertices(template);
    let ring_of = bone_slices(template, RING);
    let mut cells: BTreeMap<(usize, i32), BTreeMap<usize, RingColor>> = BTreeMap::new();
    let nodes = nodes(alignment, template).zip(&alignment.matches);
    for ((node, m), color) in nodes.zip(&scan.colors) {
        let is_used = m.weight > 0.0 && m.distance < NEAR;
        if !is_used || regions[node] == BodyRegion::Head {
            continue;
        }
        let azimuth = directions.azimuths[node] as usize % AZIMUTHS;
        let cell = cells
            .entry(ring_of[node])
            .or_default()
            .entry(azimuth)
            .or_default();
        (0..3).for_each(|c| cell.logs[c] += (f32::from(color[c]) + DARK).ln());
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
        let many = cells.into_iter().filter(|(_, s)| s.count >= LEAST_POINTS);
        many.map(mean).collect()
    };
    cells.into_values().map(ring).collect()
}

/// Logarithms of the gains of a channel by azimuth: with them, each ring has about one colour all around.
fn solve(rings: &[Vec<(usize, RingColor)>], channel: usize) -> Gains {
    let mut gains = Gains::zeros();
    let mut weights: Vec<Vec<f64>> = rings.iter().map(|r| vec![1.0; r.len()]).collect();
    for _ in 0..ROUNDS {
        let mut h = SMatrix::<f64, AZIMUTHS, AZIMUTHS>::identity() * SMOOTH[1];
        let mut g = Gains::zeros();
        for k in 0..AZIMUTHS {
            let next = (k + 1) % AZIMUTHS;
            h[(k, k)] += SMOOTH[0];
            h[(next, next)] += SMOOTH[0];
            h[(k, next)] -= SMOOTH[0];
            h[(next, k)] -= SMOOTH[0];
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
        for (ring, weights) in rings.iter().zip(&mut weights) {
            reweigh(ring, channel, (&gains, weights));
        }
    }
    gains.map(|g| g.clamp(-LARGEST, LARGEST))
}

/// Weights by which differences from the ring's colour count by their size, not its square.
fn reweigh(ring: &[(usize, RingColor)], channel: usize, (gains, weights): (&Gains, &mut [f64])) {
    let left = ring
        .iter()
        .map(|(k, cell)| f64::from(cell.logs[channel]) - f64::from(cell.level) * gains[*k]);
    let left: Vec<f64> = left.collect();
    let middle = median(&mut left.clone()).unwrap_or(0.0);
    for (w, x) in weights.iter_mut().zip(&left) {
        *w = ROBUST / (x - middle).abs().max(ROBUST);
    }
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
        let out = without_gains(&scan, &alignment, &template).expect("a cloud");
        (scan, out.colors)
    }

    /// Mean ratio of front to back of the thighs, by channel.
    fn ratio(scan: &BodyScan, colors: &[[u8; 3]]) -> [f32; 3] {
        let template = embedded::template();
        let regions = BodyRegion::of_vertices(&template);
        let mean = |front: bool, c: usize| {
            let own = (0..colors.len())
                .filter(|v| regions[*v] == BodyRegion::Thigh && (scan.points[*v].z > 0.0) == front);
            let own: Vec<f32> = own.map(|v| f32::from(colors[v][c])).collect();
            own.iter().sum::<f32>() / own.len().max(1) as f32
        };
        std::array::from_fn(|c| mean(true, c) / mean(false, c))
    }

    #[test]
    fn gains_of_two_cameras_are_divided_out() {
        let paint = |p: &P3| {
            if p.y > 1.0 {
                [60.0, 90.0, 150.0]
            } else {
                [110.0, 100.0, 80.0]
            }
        };
        let (scan, colors) = evened(paint, [1.3, 1.0, 0.8]);
        let [before, after] = [&scan.colors, &colors].map(|c| ratio(&scan, c));
        assert!(
            (before[0] - 1.3).abs() < 0.1 && (before[2] - 0.8).abs() < 0.1,
            "{before:?}"
        );
        assert!(after.iter().all(|r| (r - 1.0).abs() < 0.05), "{after:?}");
    }

    #[test]
    fn a_front_in_another_colour_keeps_it() {
        let is_front = |p: &P3| (1.0..1.35).contains(&p.y) && p.z > 0.03 && p.x.abs() < 0.12;
        let paint = |p: &P3| {
            if is_front(p) {
                [220.0; 3]
            } else {
                [70.0, 80.0, 110.0]
            }
        };
        let (scan, colors) = evened(paint, [1.0; 3]);
        let changed = scan
            .colors
            .iter()
            .zip(&colors)
            .map(|(a, b)| a[0].abs_diff(b[0]));
        assert!(changed.max() < Some(15), "{:?}", ratio(&scan, &colors));
    }
}
