//! Part of a patch that is computed while the rest sleeps. Sleeping vertices act on their neighbours and keep their
//! velocity.

use super::patch_model::PatchModel;
use super::simd::Slots;
use std::ops::Range;

/// Vertices that are marked as involved together. Larger computes more than needed; smaller makes more ranges.
const GROUP: usize = 8;

/// Ranges that a substep computes, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct ActiveSet {
    /// Awake vertices.
    pub(super) vertices: Vec<Range<usize>>,
    /// Awake vertices and all that act on them.
    pub(super) involved: Vec<Range<usize>>,
    /// Blocks of triangles with an awake corner.
    pub(super) quads: Vec<Range<usize>>,
    /// Rows of bending, and the index of their first pair.
    pub(super) bend: Vec<(Range<usize>, usize)>,
    /// Blocks of curved hinges with an awake corner.
    pub(super) bent: Vec<Range<usize>>,
    /// Sleeping vertices that are involved.
    pub(super) rim: Vec<u32>,
    /// Flag of every vertex.
    pub(super) asleep: Vec<bool>,
}

/// Ranges of true flags.
fn ranges(all: impl Iterator<Item = bool>) -> Vec<Range<usize>> {
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
    pub(super) fn new(f: &PatchModel, asleep: &[bool]) -> Self {
        let n = f.vertices.len();
        let asleep: Vec<bool> = (0..n)
            .map(|i| asleep.get(i).copied().unwrap_or(false))
            .collect();
        let moves = |v: &[Slots; 4]| v.iter().flatten().any(|p| !asleep[p.index()]);
        let mut involved = vec![false; n.div_ceil(GROUP)];
        let mut involve = |i: usize| involved[i / GROUP] = true;
        (0..n).filter(|i| !asleep[*i]).for_each(&mut involve);
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
            .for_each(|p| involve(p.index()));
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
                involve(i);
                row.iter().for_each(|(p, _)| involve(p.index()));
            }
            rows.push(needed);
        }
        // The mass filter acts along edges.
        for e in &f.ends {
            let [i, j] = e.map(usize::from);
            if asleep[i] != asleep[j] {
                involve(i);
                involve(j);
            }
        }
        let bend = ranges(rows.into_iter())
            .into_iter()
            .map(|r| (r.clone(), offsets[r.start]))
            .collect();
        Self {
            vertices: ranges(asleep.iter().map(|a| !a)),
            involved: ranges((0..n).map(|i| involved[i / GROUP])),
            quads: ranges(quads.into_iter()),
            bend,
            bent: ranges(bent.into_iter()),
            rim: (0..n)
                .filter(|i| asleep[*i] && involved[i / GROUP])
                .map(|i| i as u32)
                .collect(),
            asleep,
        }
    }
}

/// Ranges of one kind, or the whole if nothing sleeps.
#[inline(always)]
pub(super) fn active_ranges<'a>(
    active: &'a Option<ActiveSet>,
    whole: &'a Range<usize>,
    of: impl Fn(&'a ActiveSet) -> &'a Vec<Range<usize>>,
) -> &'a [Range<usize>] {
    active
        .as_ref()
        .map_or(std::slice::from_ref(whole), |a| of(a))
}

/// Part of a range below `end`.
#[inline(always)]
pub(super) fn clip(r: &Range<usize>, end: usize) -> Range<usize> {
    r.start.min(end)..r.end.min(end)
}
