//! What keeps a sheet from folding more sharply than its triangles can show.
//!
//! Quadratic bending gives way: the moment of a hinge goes with the sine of its angle, and one that is folded flat resists
//! no more. Where worn cloth is pressed together, in a groin or a hood, such hinges pass through their neighbours, too near on
//! the sheet for contact between folds to part them. A strut across each edge, which pushes and does not pull, holds the two
//! corners opposite it apart: a fold takes several edges, and its sides are seen as two folds.

use super::patch_model::PatchModel;
use super::patch_state::{Exemptions, PatchState, V4};
use crate::cloth::Sheet;
use std::collections::HashMap;

/// Two corners opposite each other across an edge, and how far apart they are where it is flat, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Diagonal {
    pub(super) ends: [u32; 2],
    pub(super) flat: f32,
}

/// Two vertices that may come too near each other soon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldLimit {
    ends: [u32; 2],
    /// They come no nearer, metres.
    least: f32,
    /// Share of the way apart that each of them goes.
    share: [f32; 2],
}

/// Speed that two vertices may gain towards each other until struts are looked for again, m/s.
const GAINED: f32 = 0.3;
/// Share of what a strut is too short by that one step takes away, and how fast it grows at most, m/s.
const RECOVERED: f32 = 0.2;
const RECOVERY: f32 = 1.0;
/// Nearer vertices have no direction from one to the other, metres.
const SHORTEST: f32 = 1e-6;

/// Wider folds are asked of no sheet, metres: on triangles of 3 cm there is no room for them under an arm.
const WIDEST: f32 = 0.02;

/// The corners across every hinge of a sheet and how far apart they are where it is flat, metres.
pub(super) fn diagonals(sheet: &Sheet) -> impl Iterator<Item = ([u32; 2], f64)> {
    let edges: HashMap<[u32; 2], f64> = sheet
        .edges
        .iter()
        .map(|(v, l)| ([v[0].min(v[1]), v[0].max(v[1])], *l))
        .collect();
    sheet.hinges.iter().filter_map(move |h| {
        let [a, b, c, d] = h.v;
        let length = |v: u32, w: u32| edges.get(&[v.min(w), v.max(w)]).copied();
        let along = length(a, b).filter(|l| *l > 0.0)?;
        let place = |corner: u32| {
            let (to_a, to_b) = (length(a, corner)?, length(b, corner)?);
            let x = (along * along + to_a * to_a - to_b * to_b) / (2.0 * along);
            Some((x, (to_a * to_a - x * x).max(0.0).sqrt()))
        };
        let (c_at, d_at) = (place(c)?, place(d)?);
        Some(([c, d], (c_at.0 - d_at.0).hypot(c_at.1 + d_at.1)))
    })
}

impl FoldLimit {
    /// Limits that may become active within `span` seconds: pairs that may come nearer than `limit` times their flat
    /// distance, none where that is 0.
    pub fn find_active(
        f: &PatchModel,
        state: &PatchState,
        limit: f32,
        span: f32,
        except: &Exemptions<'_>,
        out: &mut Vec<Self>,
    ) {
        out.clear();
        let all = if limit > 0.0 { &f.diagonals[..] } else { &[] };
        for s in all {
            let [a, b] = s.ends.map(|v| v as usize);
            let d = state.position(b) - state.position(a);
            let square = d.dot(d);
            // At rest, or as near as makes it worth a root.
            if square >= s.flat * s.flat || except.unlimited[a] || except.unlimited[b] {
                continue;
            }
            let (length, least) = (square.sqrt().max(SHORTEST), (limit * s.flat).min(WIDEST));
            let opening = d.dot(state.velocity[b] - state.velocity[a]) / length;
            let weight = [a, b].map(|v| {
                if except.fixed[v] {
                    0.0
                } else {
                    f.inverse_mass[v]
                }
            });
            let both = weight[0] + weight[1];
            if both > 0.0 && length - least < span * (GAINED - opening) {
                out.push(Self {
                    ends: s.ends,
                    least,
                    share: weight.map(|w| w / both),
                });
            }
        }
    }
    /// Takes from velocities what would violate the limits by the end of a step of `h`, and lets violated ones recover.
    /// Each impulse is equal and opposite: linear and angular momentum stay.
    pub fn apply(limits: &[Self], state: &mut PatchState, h: f32) {
        for s in limits {
            let [a, b] = s.ends.map(|v| v as usize);
            let d = state.position(b) - state.position(a);
            let length = d.dot(d).sqrt();
            if !(length > SHORTEST) {
                continue;
            }
            let normal: V4 = d.scale(1.0 / length);
            let gap = length - s.least;
            let push = -gap.max(0.0) / h - normal.dot(state.velocity[b] - state.velocity[a]);
            if push > 0.0 {
                state.velocity[a] = state.velocity[a] - normal.scale(push * s.share[0]);
                state.velocity[b] = state.velocity[b] + normal.scale(push * s.share[1]);
            }
            if gap < 0.0 {
                let way = (-gap * RECOVERED).min(RECOVERY * h);
                state.displacement[a] = state.displacement[a] - normal.scale(way * s.share[0]);
                state.displacement[b] = state.displacement[b] + normal.scale(way * s.share[1]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{cotton, grid, sheet};
    use super::super::{StableSheet, StepSpec, Substep};
    use super::*;
    use crate::math::V3d;

    const H: f64 = 2e-4;
    const LIMIT: f32 = 0.6;

    #[test]
    fn corners_across_an_edge_are_as_far_apart_as_in_the_flat_sheet() {
        let (x, faces, rest) = grid(5, 4, 0.02, 0.013);
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let all: Vec<_> = diagonals(&s).collect();
        assert_eq!(all.len(), s.hinges.len());
        for (ends, flat) in all {
            let is = (x[ends[0] as usize] - x[ends[1] as usize]).norm();
            assert!((flat - is).abs() < 1e-12, "{ends:?}: {flat} {is}");
        }
    }

    /// A strip whose halves are clapped together, after 0.1 s: its sharpest fold, as a share of the flat distance, and the
    /// change of momentum, kg m/s, and of its moment, kg m²/s, over what went in.
    fn clapped(limit: f32, held: Option<u32>) -> (f64, f64, f64) {
        let (x, faces, rest) = grid(20, 2, 0.012, 0.012);
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-6));
        let fit = StepSpec {
            h: H,
            ahead: 0.25,
            springs_only: false,
            bend_every: 3,
            smooth: 0,
        };
        let f = &StableSheet::new(&s, &fit).compile_patches(1, 0, 0)[0];
        let middle = 0.12;
        // A shallow roof whose eaves come down and together at 1.2 m/s.
        let at = |v: &u32| {
            let p = x[*v as usize];
            V4::new(p.x as f32, -0.3 * (p.x - middle).abs() as f32, p.z as f32)
        };
        let speed = |v: &u32| {
            let d = x[*v as usize].x - middle;
            V4::new((-10.0 * d) as f32, (-10.0 * d.abs()) as f32, 0.0)
        };
        let mut m = PatchState::default();
        m.reset(f.vertices.iter().map(at), f.vertices.iter().map(speed));
        let held: Vec<bool> = f.vertices.iter().map(|v| Some(*v) == held).collect();
        let v3 = |v: V4| V3d::new(f64::from(v.0[0]), f64::from(v.0[1]), f64::from(v.0[2]));
        let moments = |m: &PatchState| {
            let of = |i: usize| {
                let p = v3(m.velocity[i]) / f64::from(f.inverse_mass[i]);
                (p, v3(m.position(i)).cross(&p))
            };
            (0..x.len())
                .map(of)
                .fold((V3d::zeros(), V3d::zeros()), |s, o| (s.0 + o.0, s.1 + o.1))
        };
        let before = moments(&m);
        let (mut limits, mut sharpest) = (Vec::new(), f64::INFINITY);
        for k in 0..(0.1 / H) as usize {
            if k % 40 == 0 {
                let except = Exemptions {
                    fixed: &held,
                    unlimited: &vec![false; x.len()],
                };
                FoldLimit::find_active(f, &m, limit, 40.0 * H as f32, &except, &mut limits);
            }
            if k % 3 == 0 {
                m.update_bending(f, 1.5 * H as f32, usize::MAX);
            }
            let step = Substep {
                h: H as f32,
                t: 0.0,
                ahead: 0.25,
                gravity: V4::default(),
                rings: usize::MAX,
            };
            m.integrate_velocities(f, &step, &[], &[]);
            FoldLimit::apply(&limits, &mut m, step.h);
            if let Some(i) = held.iter().position(|h| *h) {
                m.velocity[i] = V4::default();
            }
            m.integrate_positions(f, &step, f32::INFINITY);
            for a in &f.diagonals {
                let d = v3(m.position(a.ends[0] as usize)) - v3(m.position(a.ends[1] as usize));
                sharpest = sharpest.min(d.norm() / f64::from(a.flat));
            }
        }
        if let Some(i) = held.iter().position(|h| *h) {
            assert_eq!(
                m.displacement[i],
                V4::default(),
                "nothing moves what is held"
            );
        }
        let after = moments(&m);
        let went_in: f64 = (0..x.len())
            .map(|i| v3(speed(&f.vertices[i])).norm() / f64::from(f.inverse_mass[i]))
            .sum();
        (
            sharpest,
            (after.0 - before.0).norm() / went_in,
            (after.1 - before.1).norm() / (0.1 * went_in),
        )
    }

    #[test]
    fn a_clapped_strip_folds_no_sharper_than_its_struts_allow_and_keeps_its_momentum() {
        let (free, ..) = clapped(0.0, None);
        let (braced, momentum, moment) = clapped(LIMIT, None);
        assert!(free < 0.1, "without struts it folds flat: {free}");
        // One pass a step: it gives way a little.
        assert!(braced > f64::from(LIMIT) - 0.15, "{braced}");
        assert!(momentum < 1e-4 && moment < 1e-4, "{momentum:e} {moment:e}");
        let (held, ..) = clapped(LIMIT, Some(31));
        assert!(held > f64::from(LIMIT) - 0.15, "{held}");
    }

    #[test]
    fn corners_in_one_place_have_no_direction_and_stay_there() {
        let mut m = PatchState::default();
        m.reset(
            [V4::default(); 2].into_iter(),
            [V4::default(); 2].into_iter(),
        );
        let limit = FoldLimit {
            ends: [0, 1],
            least: 0.01,
            share: [0.5; 2],
        };
        FoldLimit::apply(&[limit], &mut m, 1e-3);
        assert!(
            m.velocity
                .iter()
                .chain(&m.displacement)
                .all(|v| *v == V4::default())
        );
    }
}
