//! A sheet cut into compact pieces, fixed when it is made: what sleeps as one, and what is asked for folds as one.

/// Vertices piece by piece, and where each piece begins; shape `[pieces + 1]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Partition {
    /// Vertices in their new order.
    pub(crate) order: Vec<u32>,
    /// Beginnings in that order, and its length.
    pub(crate) starts: Vec<usize>,
}

/// Cuts `set` into pieces of at most `most` vertices that begin at multiples of `multiple`, halving along its length
/// until they are small enough. Within a piece neighbours come close together, as pieces do among each other.
/// `vertices` is more than any number in the set.
pub(crate) fn cut<'a>(
    vertices: usize,
    near: impl Fn(u32) -> &'a [u32],
    set: Vec<u32>,
    most: usize,
    multiple: usize,
) -> Partition {
    let (most, multiple) = (most.max(1), multiple.max(1));
    let mut pieces = Partition {
        order: Vec::with_capacity(set.len()),
        starts: vec![0],
    };
    // In which part each vertex is, and how often it was met.
    let (mut part, mut met) = (vec![0u32; vertices], vec![0u32; vertices]);
    let (mut parts, mut walks) = (0, 0);
    let mut left = vec![set];
    while let Some(set) = left.pop() {
        parts += 1;
        set.iter().for_each(|v| part[*v as usize] = parts);
        let mut walk = |from: &[u32]| {
            walks += 1;
            let mut order: Vec<u32> = Vec::with_capacity(set.len());
            let mut next = 0;
            // Where the part falls apart, what is not reached begins anew.
            for start in from.iter().chain(&set) {
                if std::mem::replace(&mut met[*start as usize], walks) != walks {
                    order.push(*start);
                }
                while next < order.len() {
                    let v = order[next];
                    next += 1;
                    for w in near(v) {
                        if part[*w as usize] == parts
                            && std::mem::replace(&mut met[*w as usize], walks) != walks
                        {
                            order.push(*w);
                        }
                    }
                }
            }
            order
        };
        // From an end of it, so that a cut through the middle is short.
        let end = walk(&[]).last().copied();
        let mut order = walk(end.as_slice());
        let half = order.len().div_ceil(2).next_multiple_of(multiple);
        if order.len() <= most || half >= order.len() {
            pieces.order.append(&mut order);
            pieces.starts.push(pieces.order.len());
        } else {
            let rest = order.split_off(half);
            left.push(rest);
            left.push(order);
        }
    }
    pieces.starts.dedup();
    pieces
}

impl Partition {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }
    /// Vertices of one.
    pub(crate) fn members(&self, piece: usize) -> &[u32] {
        &self.order[self.starts[piece]..self.starts[piece + 1]]
    }
    /// The piece of each of so many vertices.
    #[cfg(test)]
    pub(crate) fn of(&self, vertices: usize) -> Vec<u32> {
        let mut of = vec![0; vertices];
        for p in 0..self.len() {
            self.members(p)
                .iter()
                .for_each(|v| of[*v as usize] = p as u32);
        }
        of
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_falls_into_compact_pieces_and_nothing_is_lost() {
        let n = 40u32;
        let near: Vec<Vec<u32>> = (0..n * n)
            .map(|v| {
                let (i, j) = ((v % n) as i32, (v / n) as i32);
                let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(a, b)| (i + a, j + b));
                let inside = beside
                    .iter()
                    .filter(|(a, b)| (0..n as i32).contains(a) && (0..n as i32).contains(b));
                inside.map(|(a, b)| (b * n as i32 + a) as u32).collect()
            })
            .collect();
        let p = cut(
            (n * n) as usize,
            |v| &near[v as usize],
            (0..n * n).collect(),
            128,
            8,
        );
        let mut all = p.order.clone();
        all.sort_unstable();
        assert_eq!(all, (0..n * n).collect::<Vec<_>>());
        assert!(
            p.starts[..p.len()].iter().all(|s| s % 8 == 0) && p.starts.last() == Some(&1600),
            "{:?}",
            p.starts
        );
        let of = p.of(1600);
        for k in 0..p.len() {
            let members = p.members(k);
            assert!(
                members.len() <= 128 && members.len() > 32,
                "{}",
                members.len()
            );
            // Few of its neighbours are elsewhere: a band one vertex wide would have all of them there.
            let outside = members
                .iter()
                .flat_map(|v| &near[*v as usize])
                .filter(|w| of[**w as usize] != k as u32);
            let outside = outside.count();
            assert!(
                outside < members.len(),
                "piece {k}: {outside} edges leave {} vertices",
                members.len()
            );
        }
        assert_eq!(
            cut(3, |_| &[], vec![2, 0, 1], 2, 1).order.len(),
            3,
            "what hangs together by nothing"
        );
        assert_eq!(cut(0, |_| &[], vec![], 2, 1).len(), 0);
    }
}
