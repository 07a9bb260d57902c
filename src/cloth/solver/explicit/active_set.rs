//! Which part of a patch is computed while the rest of it sleeps: sleeping vertices are seen by their neighbours and go
//! evenly, or not at all.

use super::patch_model::PatchModel;
use super::patch_state::PatchState;
use super::simd::At;
use std::ops::Range;

/// Vertices that are woken, and seen, together.
const GROUP: usize = 8;

/// What a step goes through. Stretches are in order.
#[derive(Clone, Debug, Default)]
pub(super) struct ActiveSet {
    /// Vertices that move by themselves.
    pub(super) vertices: Vec<Range<usize>>,
    /// They and all that pulls at them.
    pub(super) seen: Vec<Range<usize>>,
    /// Blocks of triangles with a corner that moves.
    pub(super) quads: Vec<Range<usize>>,
    /// Rows of bending, and where their pairs begin.
    pub(super) bend: Vec<(Range<usize>, usize)>,
    /// Blocks of bent hinges.
    pub(super) bent: Vec<Range<usize>>,
    /// Sleeping vertices that are seen.
    pub(super) rim: Vec<u32>,
    /// Of all vertices.
    pub(super) asleep: Vec<bool>,
}

/// Stretches of what is true.
fn stretches(all: impl Iterator<Item = bool>) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for (i, _) in all.enumerate().filter(|a| a.1) {
        match out.last_mut() {
            Some(last) if last.end == i => last.end = i + 1,
            _ => out.push(i..i + 1),
        }
    }
    out
}

impl ActiveSet {
    fn new(f: &PatchModel, asleep: &[bool]) -> Self {
        let n = f.vertices.len();
        let asleep: Vec<bool> = (0..n)
            .map(|i| asleep.get(i).copied().unwrap_or(false))
            .collect();
        let moves = |v: &[At; 4]| v.iter().flatten().any(|p| !asleep[p.index()]);
        let mut seen = vec![false; n.div_ceil(GROUP)];
        let mut see = |i: usize| seen[i / GROUP] = true;
        (0..n).filter(|i| !asleep[*i]).for_each(&mut see);
        let quads: Vec<bool> = f.quads.iter().map(|q| moves(&q.v)).collect();
        let bent: Vec<bool> = f.bent.iter().map(|b| moves(&b.v)).collect();
        let corners = f
            .quads
            .iter()
            .map(|q| &q.v)
            .zip(&quads)
            .chain(f.bent.iter().map(|b| &b.v).zip(&bent));
        corners
            .filter(|c| *c.1)
            .flat_map(|c| c.0.iter().flatten())
            .for_each(|p| see(p.index()));
        let mut rows = Vec::with_capacity(n);
        let mut offsets = Vec::with_capacity(n);
        let mut from = 0;
        for (i, count) in f.bend_count.iter().enumerate() {
            offsets.push(from);
            let row = &f.bend[from..from + usize::from(*count)];
            from += usize::from(*count);
            let needed =
                !row.is_empty() && (!asleep[i] || row.iter().any(|(p, _)| !asleep[p.index()]));
            if needed {
                see(i);
                row.iter().for_each(|(p, _)| see(p.index()));
            }
            rows.push(needed);
        }
        // Smoothing reaches along edges.
        for e in &f.ends {
            let [i, j] = e.map(usize::from);
            if asleep[i] != asleep[j] {
                see(i);
                see(j);
            }
        }
        let bend = stretches(rows.into_iter())
            .into_iter()
            .map(|r| (r.clone(), offsets[r.start]))
            .collect();
        Self {
            vertices: stretches(asleep.iter().map(|a| !a)),
            seen: stretches((0..n).map(|i| seen[i / GROUP])),
            quads: stretches(quads.into_iter()),
            bend,
            bent: stretches(bent.into_iter()),
            rim: (0..n)
                .filter(|i| asleep[*i] && seen[i / GROUP])
                .map(|i| i as u32)
                .collect(),
            asleep,
        }
    }
}

/// A kind of stretches, or everything if nothing sleeps.
#[inline(always)]
pub(super) fn part<'a>(
    awake: &'a Option<ActiveSet>,
    whole: &'a Range<usize>,
    of: impl Fn(&'a ActiveSet) -> &'a Vec<Range<usize>>,
) -> &'a [Range<usize>] {
    awake
        .as_ref()
        .map_or(std::slice::from_ref(whole), |a| of(a))
}

/// What lies before `end`.
#[inline(always)]
pub(super) fn before(r: &Range<usize>, end: usize) -> Range<usize> {
    r.start.min(end)..r.end.min(end)
}

impl PatchState {
    /// Leaves the vertices that sleep to themselves until the next outer call: nothing moves them but their own speed.
    pub fn set_sleeping(&mut self, f: &PatchModel, asleep: &[bool]) {
        self.scratch.awake = asleep.contains(&true).then(|| ActiveSet::new(f, asleep));
    }
}
