//! Prints that meet at seams: panels are moved over the repeat of the cloth, as a tailor cuts them.

use std::collections::BTreeMap;
use std::f32::consts::TAU;
use tryon_geometry::mesh::{Face, UnionFind};

/// Least gap between panels in texture space, metres.
const GAP: f32 = 0.02;

/// Drawn vertices over one simulated vertex, in two panels.
#[derive(Clone, Copy)]
struct SeamPair {
    panels: [usize; 2],
    vertices: [usize; 2],
}

/// Panels of a drawn mesh and their moves in texture space.
pub struct PrintLayout {
    /// Panel of each drawn vertex.
    panel: Vec<u32>,
    /// Move of each panel, metres.
    moves: Vec<[f32; 2]>,
    pairs: Vec<SeamPair>,
}

impl PrintLayout {
    /// Moves for a print that repeats after `period` metres along u and v; 0 along an axis without a repeat. `vertex` is the
    /// simulated vertex under each drawn one.
    ///
    /// The first panel stays. Then the one with most vertices sewn to placed ones follows, at the mean of the phases that they
    /// ask for: both side seams of a trunk share what its girth leaves over whole repeats.
    pub fn new(faces: &[Face], uv: &[[f32; 2]], vertex: &[u32], period: [f32; 2]) -> Self {
        let mut panels = UnionFind::new(uv.len());
        for [a, b, c] in faces {
            panels.join(*a, *b);
            panels.join(*b, *c);
        }
        let (panel, count) = panels.number();
        let mut layout = Self {
            pairs: pairs(&panel, vertex),
            moves: vec![[0.0; 2]; count],
            panel,
        };
        let mut is_placed = vec![false; count];
        if let Some(first) = is_placed.first_mut() {
            *first = true;
        }
        while let Some(next) = layout.next_panel(&is_placed) {
            for axis in [0, 1] {
                if period[axis] > 0.0 {
                    layout.moves[next][axis] =
                        layout.phase(next, &is_placed, uv, axis, period[axis]);
                }
            }
            is_placed[next] = true;
        }
        if period[0] > 0.0 {
            layout.spread(uv, period[0]);
        }
        layout
    }

    /// Texture coordinates after the moves.
    pub fn moved(&self, uv: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let at = |(p, panel): (&[f32; 2], &u32)| {
            let by = self.moves[*panel as usize];
            [p[0] + by[0], p[1] + by[1]]
        };
        uv.iter().zip(&self.panel).map(at).collect()
    }

    /// Move at a place of the texture (metres): that of the panel with the nearest vertex.
    pub fn move_at(&self, uv: &[[f32; 2]], at: [f32; 2]) -> [f32; 2] {
        let distance = |p: &[f32; 2]| (p[0] - at[0]).hypot(p[1] - at[1]);
        let nearest =
            (uv.iter().zip(&self.panel)).min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
        nearest.map_or([0.0; 2], |(_, panel)| self.moves[*panel as usize])
    }

    /// The panel with most vertices sewn to placed ones; without any the first that is left.
    fn next_panel(&self, is_placed: &[bool]) -> Option<usize> {
        let mut sewn = vec![0usize; is_placed.len()];
        for SeamPair { panels: [a, b], .. } in &self.pairs {
            match [is_placed[*a], is_placed[*b]] {
                [true, false] => sewn[*b] += 1,
                [false, true] => sewn[*a] += 1,
                _ => {}
            }
        }
        let left = (0..is_placed.len()).filter(|p| !is_placed[*p]);
        left.min_by_key(|p| (std::cmp::Reverse(sewn[*p]), *p))
    }

    /// Circular mean of the moves that seams with placed panels ask for, metres.
    fn phase(
        &self,
        next: usize,
        is_placed: &[bool],
        uv: &[[f32; 2]],
        axis: usize,
        period: f32,
    ) -> f32 {
        let mut sum = [0.0f32; 2];
        for pair in &self.pairs {
            for (own, other) in [(0, 1), (1, 0)] {
                let placed = pair.panels[other];
                if pair.panels[own] != next || !is_placed[placed] {
                    continue;
                }
                let there = uv[pair.vertices[other]][axis] + self.moves[placed][axis];
                let (s, c) = (TAU * (there - uv[pair.vertices[own]][axis]) / period).sin_cos();
                (sum[0], sum[1]) = (sum[0] + c, sum[1] + s);
            }
        }
        sum[1].atan2(sum[0]) / TAU * period
    }

    /// Moves panels by whole repeats along u until none lies over another.
    fn spread(&mut self, uv: &[[f32; 2]], period: f32) {
        let mut from = f32::NEG_INFINITY;
        for panel in 0..self.moves.len() {
            let own = (uv.iter().zip(&self.panel)).filter(|(_, p)| **p as usize == panel);
            let (lo, hi) = own.fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), (p, _)| {
                (lo.min(p[0]), hi.max(p[0]))
            });
            let at = &mut self.moves[panel][0];
            if from.is_finite() {
                *at += ((from + GAP - lo - *at) / period).ceil() * period;
            }
            from = hi + *at;
        }
    }
}

/// Pairs of drawn vertices of different panels over the same simulated vertex.
fn pairs(panel: &[u32], vertex: &[u32]) -> Vec<SeamPair> {
    let mut over: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (drawn, simulated) in vertex.iter().enumerate() {
        over.entry(*simulated).or_default().push(drawn);
    }
    let mut out = Vec::new();
    for drawn in over.values() {
        for (k, a) in drawn.iter().enumerate() {
            for b in &drawn[k + 1..] {
                if panel[*a] != panel[*b] {
                    out.push(SeamPair {
                        panels: [panel[*a] as usize, panel[*b] as usize],
                        vertices: [*a, *b],
                    });
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{GarmentMesh, Size, Triangulation, library};

    const PERIOD: f32 = 0.05;

    /// Mismatch along an axis at the seams between the first two panels, in periods (0 to ½), sorted.
    fn mismatches(layout: &PrintLayout, uv: &[[f32; 2]], axis: usize) -> Vec<f32> {
        let trunk = layout.pairs.iter().filter(|p| p.panels == [0, 1]);
        let mut out: Vec<f32> = trunk
            .map(|p| {
                let [a, b] = p.vertices.map(|v| uv[v][axis]);
                let turns = (a - b) / PERIOD;
                (turns - turns.round()).abs()
            })
            .collect();
        out.sort_by(f32::total_cmp);
        out
    }

    #[test]
    fn a_check_meets_at_the_side_seams_of_skirts() {
        // Along v both seams agree. Along u those of a straight skirt share what its girth leaves; those of a flared one cross
        // the check at an angle.
        for (name, axis, most) in [
            ("straight_skirt", 0, 0.25),
            ("straight_skirt", 1, 0.05),
            ("skirt", 1, 0.05),
        ] {
            let pattern = library::pattern(name, Size::M).expect("a pattern");
            let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
            let drawn = &mesh.render;
            let layout = PrintLayout::new(&drawn.faces, &drawn.uv, &drawn.vertex, [PERIOD; 2]);
            let after = mismatches(&layout, &layout.moved(&drawn.uv), axis);
            assert!(after.len() > 20);
            let median = after[after.len() / 2];
            assert!(median < most, "{name} {axis}: {median}");
        }
    }

    #[test]
    fn panels_keep_apart_and_stripes_leave_them_in_place() {
        let pattern = library::pattern("tshirt", Size::M).expect("a pattern");
        let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let drawn = &mesh.render;
        let of = |period| PrintLayout::new(&drawn.faces, &drawn.uv, &drawn.vertex, period);
        let check = of([PERIOD; 2]);
        let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; check.moves.len()];
        for (p, panel) in check.moved(&drawn.uv).iter().zip(&check.panel) {
            let range = &mut ranges[*panel as usize];
            *range = [range[0].min(p[0]), range[1].max(p[0])];
        }
        assert!(ranges.windows(2).all(|w| w[1][0] > w[0][1]), "{ranges:?}");
        let stripes = of([0.0, PERIOD]);
        assert!(stripes.moves.iter().all(|m| m[0] == 0.0));
        assert_eq!(
            stripes.move_at(&drawn.uv, drawn.uv[3]),
            stripes.moves[stripes.panel[3] as usize]
        );
        assert!(of([0.0; 2]).moved(&drawn.uv) == drawn.uv);
    }
}
