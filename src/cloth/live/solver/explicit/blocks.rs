//! Triangles and hinges in blocks of eight: the unit of one pass of the kernels.

use super::elements::{CurvedHinge, EdgeTriangle};
use super::simd::{LANES, Slot, Slots};
use std::collections::BTreeSet;
use tryon_geometry::mesh::{Face, edge_faces};

/// Eight pairs of triangles a b c and b a d. A triangle without partner has no stiffness in the second; the last block is
/// padded with pairs without stiffness.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct QuadBlock {
    /// Lengths at rest of ab, ac, bc, ad, bd (m).
    pub(super) rest: [[f32; LANES]; 5],
    /// Stiffness between their lengthenings (N/m): of each by itself, ab with the others, ac with bc, ad with bd.
    pub(super) k: [[f32; LANES]; 11],
    /// a, b, c, d.
    pub(super) v: [Slots; 4],
}

/// Eight hinges bent at rest; the last block is padded.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct HingeBlock {
    /// Coefficients of all but the first vertex; all four sum to zero.
    pub(super) c: [[f32; LANES]; 3],
    pub(super) w: [f32; LANES],
    pub(super) rest: [f32; LANES],
    pub(super) v: [Slots; 4],
}

/// Lowest vertex of a block. Blocks are sorted by it.
pub(super) fn lowest(v: &[Slots; 4]) -> usize {
    v.iter().map(|v| v[0].index()).min().unwrap_or(0)
}

/// Matching of triangles across edges. Those with the fewest free neighbours choose first, which leaves few unmatched.
fn partners(all: &[EdgeTriangle]) -> Vec<Option<usize>> {
    let faces: Vec<Face> = all.iter().map(|t| t.v).collect();
    let mut near: Vec<Vec<usize>> = vec![Vec::new(); all.len()];
    for same in edge_faces(&faces).chunk_by(|a, b| a.0 == b.0) {
        for (_, a) in same {
            let others = same.iter().map(|s| s.1).filter(|b| b != a);
            near[*a as usize].extend(others.map(|b| b as usize));
        }
    }
    let mut free: Vec<usize> = near.iter().map(Vec::len).collect();
    let mut queue: BTreeSet<(usize, usize)> =
        free.iter().enumerate().map(|(t, f)| (*f, t)).collect();
    let mut partner = vec![None; all.len()];
    while let Some((_, t)) = queue.pop_first() {
        let Some(other) = near[t]
            .iter()
            .copied()
            .filter(|o| queue.contains(&(free[*o], *o)))
            .min_by_key(|o| free[*o])
        else {
            continue;
        };
        queue.remove(&(free[other], other));
        (partner[t], partner[other]) = (Some(other), Some(t));
        for gone in [t, other] {
            for n in near[gone].iter().copied() {
                if queue.remove(&(free[n], n)) {
                    free[n] -= 1;
                    queue.insert((free[n], n));
                }
            }
        }
    }
    partner
}

/// One lane of a [`QuadBlock`].
struct Quad {
    v: [u32; 4],
    rest: [f32; 5],
    k: [f32; 11],
}

impl Quad {
    fn new(t: &EdgeTriangle, other: Option<&EdgeTriangle>) -> Self {
        // Corner that the other triangle lacks.
        let i = other.map_or(0, |o| (0..3).find(|i| !o.v.contains(&t.v[*i])).unwrap_or(0));
        let (j, l) = ((i + 1) % 3, (i + 2) % 3);
        let (a, b, c) = (t.v[j], t.v[l], t.v[i]);
        // Edge k lies opposite corner k.
        let k = |x, y| t.stiffness(x, y);
        let mut quad = Self {
            v: [a, b, c, c],
            rest: [t.rest[i], t.rest[l], t.rest[j], t.rest[l], t.rest[j]],
            k: [
                k(i, i),
                k(l, l),
                k(j, j),
                0.0,
                0.0,
                k(i, l),
                k(i, j),
                0.0,
                0.0,
                k(l, j),
                0.0,
            ],
        };
        let corner = |v: u32| other.and_then(|o| o.v.iter().position(|w| *w == v));
        if let (Some(o), Some(p), Some(q)) = (other, corner(a), corner(b)) {
            let d = 3 - p - q;
            let k = |x, y| o.stiffness(x, y);
            quad.v[3] = o.v[d];
            (quad.rest[3], quad.rest[4]) = (o.rest[q], o.rest[p]);
            quad.k[0] += k(d, d);
            (quad.k[3], quad.k[4]) = (k(q, q), k(p, p));
            (quad.k[7], quad.k[8], quad.k[10]) = (k(d, q), k(d, p), k(p, q));
        }
        quad
    }
}

/// Pairs of triangles in blocks, sorted by their lowest corner.
pub(super) fn quad_blocks(all: &[EdgeTriangle]) -> Vec<QuadBlock> {
    let partner = partners(all);
    let firsts = (0..all.len()).filter(|t| partner[*t].is_none_or(|p| *t < p));
    let mut quads: Vec<Quad> = firsts
        .map(|t| Quad::new(&all[t], partner[t].map(|p| &all[p])))
        .collect();
    quads.sort_by_key(|q| q.v.iter().min().copied());
    let block = |of: &[Quad]| {
        let mut out = QuadBlock::default();
        for (lane, q) in of.iter().enumerate() {
            (0..4).for_each(|i| out.v[i][lane] = Slot::new(q.v[i] as usize));
            (0..5).for_each(|i| out.rest[i][lane] = q.rest[i]);
            (0..11).for_each(|i| out.k[i][lane] = q.k[i]);
        }
        out
    };
    quads.chunks(LANES).map(block).collect()
}

/// Hinges in blocks, sorted by their lowest vertex.
pub(super) fn hinge_blocks(mut all: Vec<CurvedHinge>) -> Vec<HingeBlock> {
    all.sort_by_key(|b| b.v.iter().min().copied());
    let block = |of: &[CurvedHinge]| {
        let mut out = HingeBlock::default();
        for (lane, b) in of.iter().enumerate() {
            (0..4).for_each(|i| out.v[i][lane] = Slot::new(b.v[i] as usize));
            (0..3).for_each(|i| out.c[i][lane] = b.c[i + 1]);
            (out.w[lane], out.rest[lane]) = (b.w, b.rest);
        }
        out
    };
    all.chunks(LANES).map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matching_is_symmetric_and_leaves_few_triangles_unmatched() {
        // A strip of 20 by 9 squares cut into triangles.
        let at = |i: u32, j: u32| j * 21 + i;
        let mut all = Vec::new();
        for j in 0..9 {
            for i in 0..20 {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                all.extend([[a, b, c], [a, c, d]].map(|v| EdgeTriangle {
                    v,
                    ..EdgeTriangle::default()
                }));
            }
        }
        let partner = partners(&all);
        for (t, p) in partner.iter().enumerate() {
            let Some(p) = p else { continue };
            assert_eq!(partner[*p], Some(t));
            assert_eq!(
                all[t].v.iter().filter(|v| all[*p].v.contains(v)).count(),
                2,
                "{t} and {p} share an edge"
            );
        }
        let alone = partner.iter().filter(|p| p.is_none()).count();
        assert!(alone <= all.len() / 50, "{alone} of {} alone", all.len());
        assert_eq!(partners(&all[..1]), [None]);
    }
}
