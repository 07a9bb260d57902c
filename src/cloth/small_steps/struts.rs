//! What keeps a sheet from folding more sharply than its triangles can show.
//!
//! Quadratic bending gives way: the moment of a hinge goes with the sine of its angle, and one that is folded flat resists
//! no more. Where worn cloth is pressed together, in a groin or a hood, such hinges pass through their neighbours, too near on
//! the sheet for contact between folds to part them. A strut across each edge, which pushes and does not pull, holds the two
//! corners opposite it apart: a fold takes several edges, and its sides are seen as two folds.

use super::fabric::Fabric;
use super::motion::{Motion, V4};
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
pub struct Strut {
    ends: [u32; 2],
    /// They come no nearer, metres.
    least: f32,
    /// Share of the way apart that each of them goes.
    share: [f32; 2],
}

/// Vertices, by their numbers, that struts and limits of speed leave as they are.
#[derive(Clone, Copy, Debug)]
pub struct Excepted<'a> {
    /// They go nowhere.
    pub held: &'a [bool],
    /// They go as far and as fast as they must.
    pub free: &'a [bool],
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

impl Motion {
    /// Struts that may become shorter than `limit` times their flat length within `span` seconds, none if that is 0.
    pub fn short(
        &self,
        f: &Fabric,
        limit: f32,
        span: f32,
        except: &Excepted<'_>,
        out: &mut Vec<Strut>,
    ) {
        out.clear();
        let all = if limit > 0.0 { &f.diagonals[..] } else { &[] };
        for s in all {
            let [a, b] = s.ends.map(|v| v as usize);
            let d = self.position(b) - self.position(a);
            let square = d.dot(d);
            // At rest, or as near as makes it worth a root.
            if square >= s.flat * s.flat || except.free[a] || except.free[b] {
                continue;
            }
            let (length, least) = (square.sqrt().max(SHORTEST), (limit * s.flat).min(WIDEST));
            let opening = d.dot(self.velocity[b] - self.velocity[a]) / length;
            let weight = [a, b].map(|v| {
                if except.held[v] {
                    0.0
                } else {
                    f.inverse_mass[v]
                }
            });
            let both = weight[0] + weight[1];
            if both > 0.0 && length - least < span * (GAINED - opening) {
                out.push(Strut {
                    ends: s.ends,
                    least,
                    share: weight.map(|w| w / both),
                });
            }
        }
    }
    /// Takes from velocities what would make struts too short by the end of a step of `h`, and lets those that are grow. Each
    /// push is equal and opposite: momentum and its moment stay.
    pub fn brace(&mut self, struts: &[Strut], h: f32) {
        for s in struts {
            let [a, b] = s.ends.map(|v| v as usize);
            let d = self.position(b) - self.position(a);
            let length = d.dot(d).sqrt();
            if !(length > SHORTEST) {
                continue;
            }
            let normal: V4 = d.scale(1.0 / length);
            let gap = length - s.least;
            let push = -gap.max(0.0) / h - normal.dot(self.velocity[b] - self.velocity[a]);
            if push > 0.0 {
                self.velocity[a] = self.velocity[a] - normal.scale(push * s.share[0]);
                self.velocity[b] = self.velocity[b] + normal.scale(push * s.share[1]);
            }
            if gap < 0.0 {
                let way = (-gap * RECOVERED).min(RECOVERY * h);
                self.moved[a] = self.moved[a] - normal.scale(way * s.share[0]);
                self.moved[b] = self.moved[b] + normal.scale(way * s.share[1]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{cotton, grid, sheet};
    use super::super::{Fit, Plan, Step};
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
        let fit = Fit {
            h: H,
            ahead: 0.25,
            springs_only: false,
            bend_every: 3,
            smooth: 0,
        };
        let f = &Plan::new(&s, &fit).patches(1, 0, 0)[0];
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
        let mut m = Motion::default();
        m.begin(f.vertices.iter().map(at), f.vertices.iter().map(speed));
        let held: Vec<bool> = f.vertices.iter().map(|v| Some(*v) == held).collect();
        let v3 = |v: V4| V3d::new(f64::from(v.0[0]), f64::from(v.0[1]), f64::from(v.0[2]));
        let moments = |m: &Motion| {
            let of = |i: usize| {
                let p = v3(m.velocity[i]) / f64::from(f.inverse_mass[i]);
                (p, v3(m.position(i)).cross(&p))
            };
            (0..x.len())
                .map(of)
                .fold((V3d::zeros(), V3d::zeros()), |s, o| (s.0 + o.0, s.1 + o.1))
        };
        let before = moments(&m);
        let (mut struts, mut sharpest) = (Vec::new(), f64::INFINITY);
        for k in 0..(0.1 / H) as usize {
            if k % 40 == 0 {
                let except = Excepted {
                    held: &held,
                    free: &vec![false; x.len()],
                };
                m.short(f, limit, 40.0 * H as f32, &except, &mut struts);
            }
            if k % 3 == 0 {
                m.bend(f, 1.5 * H as f32, usize::MAX);
            }
            let step = Step {
                h: H as f32,
                t: 0.0,
                ahead: 0.25,
                gravity: V4::default(),
                rings: usize::MAX,
            };
            m.accelerate(f, &step, &[], &[]);
            m.brace(&struts, step.h);
            if let Some(i) = held.iter().position(|h| *h) {
                m.velocity[i] = V4::default();
            }
            m.advance(f, &step, f32::INFINITY);
            for a in &f.diagonals {
                let d = v3(m.position(a.ends[0] as usize)) - v3(m.position(a.ends[1] as usize));
                sharpest = sharpest.min(d.norm() / f64::from(a.flat));
            }
        }
        if let Some(i) = held.iter().position(|h| *h) {
            assert_eq!(m.moved[i], V4::default(), "nothing moves what is held");
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
        let mut m = Motion::default();
        m.begin(
            [V4::default(); 2].into_iter(),
            [V4::default(); 2].into_iter(),
        );
        m.brace(
            &[Strut {
                ends: [0, 1],
                least: 0.01,
                share: [0.5; 2],
            }],
            1e-3,
        );
        assert!(
            m.velocity
                .iter()
                .chain(&m.moved)
                .all(|v| *v == V4::default())
        );
    }
}
