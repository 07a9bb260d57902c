//! Partition of a sheet into compact parts, fixed when the garment is made.

/// Vertices in the order of the parts, and the start of each part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Partition {
    /// Vertices in their new order.
    pub(crate) order: Vec<u32>,
    /// First index of each part in that order, then its length; shape `[parts + 1]`.
    pub(crate) starts: Vec<usize>,
}

/// Cuts `set` into parts of at most `most` vertices that begin at multiples of `multiple`, by halves along its length.
/// Neighbours are close together in the order. `vertices` is above any number in the set.
pub(crate) fn cut<'a>(
    vertices: usize,
    near: impl Fn(u32) -> &'a [u32],
    set: Vec<u32>,
    most: usize,
    multiple: usize,
) -> Partition {
    let (most, multiple) = (most.max(1), multiple.max(1));
    let mut partition = Partition {
        order: Vec::with_capacity(set.len()),
        starts: vec![0],
    };
    // Part of each vertex, and the last walk that visited it.
    let (mut part, mut visited) = (vec![0u32; vertices], vec![0u32; vertices]);
    let (mut parts, mut walks) = (0, 0);
    let mut left = vec![set];
    while let Some(set) = left.pop() {
        parts += 1;
        set.iter().for_each(|v| part[*v as usize] = parts);
        let mut walk = |from: &[u32]| {
            walks += 1;
            let mut order: Vec<u32> = Vec::with_capacity(set.len());
            let mut next = 0;
            // Components that the first start does not reach follow.
            for start in from.iter().chain(&set) {
                if std::mem::replace(&mut visited[*start as usize], walks) != walks {
                    order.push(*start);
                }
                while next < order.len() {
                    let v = order[next];
                    next += 1;
                    for w in near(v) {
                        if part[*w as usize] == parts
                            && std::mem::replace(&mut visited[*w as usize], walks) != walks
                        {
                            order.push(*w);
                        }
                    }
                }
            }
            order
        };
        // A walk from one end makes the cut through the middle short.
        let end = walk(&[]).last().copied();
        let mut order = walk(end.as_slice());
        let half = order.len().div_ceil(2).next_multiple_of(multiple);
        if order.len() <= most || half >= order.len() {
            partition.order.append(&mut order);
            partition.starts.push(partition.order.len());
        } else {
            let rest = order.split_off(half);
            left.push(rest);
            left.push(order);
        }
    }
    partition.starts.dedup();
    partition
}

impl Partition {
    /// One part.
    pub(crate) fn whole(set: Vec<u32>) -> Self {
        Self {
            starts: vec![0, set.len()],
            order: set,
        }
    }
    /// Number of parts.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }
    /// Vertices of one part.
    pub(crate) fn members(&self, part: usize) -> &[u32] {
        &self.order[self.starts[part]..self.starts[part + 1]]
    }
    /// Part of each vertex.
    #[cfg(test)]
    fn of(&self, vertices: usize) -> Vec<u32> {
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
    fn parts_of_a_square_are_compact_and_cover_it() {
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
            // A band one vertex wide would have all neighbours outside.
            let outside = members
                .iter()
                .flat_map(|v| &near[*v as usize])
                .filter(|w| of[**w as usize] != k as u32);
            let outside = outside.count();
            assert!(
                outside < members.len(),
                "part {k}: {outside} edges leave {} vertices",
                members.len()
            );
        }
        assert_eq!(
            cut(3, |_| &[], vec![2, 0, 1], 2, 1).order.len(),
            3,
            "without edges"
        );
        assert_eq!(cut(0, |_| &[], vec![], 2, 1).len(), 0);
    }
}
