//! Bands of a sheet with few edges between them: the vertices of its patches.

use tryon_geometry::mesh::boundary_edges;

/// Cuts all vertices into `count` bands of equal size, in the order that separates the fewest edges. `around` lists the
/// neighbours of each vertex, `ends` the edges.
pub(crate) fn bands(
    around: &[Vec<u32>],
    ends: &[[u32; 2]],
    faces: &[[u32; 3]],
    count: usize,
) -> Vec<Vec<u32>> {
    let n = around.len();
    let orders = if count > 1 {
        orders(around, faces)
    } else {
        vec![by_distance(around)]
    };
    let slice = |order: Vec<u32>| -> Vec<Vec<u32>> {
        (0..count)
            .map(|p| order[p * n / count..(p + 1) * n / count].to_vec())
            .collect()
    };
    let separated = |sets: &Vec<Vec<u32>>| {
        let mut of = vec![0usize; n];
        for (p, set) in sets.iter().enumerate() {
            set.iter().for_each(|v| of[*v as usize] = p);
        }
        let apart = |e: &&[u32; 2]| of[e[0] as usize] != of[e[1] as usize];
        ends.iter().filter(apart).count()
    };
    let all = orders.into_iter().map(slice);
    all.min_by_key(separated).unwrap_or_default()
}

/// Candidate orders: by distance from a corner, from each boundary loop, and from a shortest path between two loops (which
/// halves a tube along its length).
fn orders(around: &[Vec<u32>], faces: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut orders = vec![by_distance(around)];
    let loops = longest_boundary_loops(around.len(), faces);
    for boundary in &loops {
        let paths = Paths::from(around, boundary);
        orders.push(paths.order.clone());
        let others = loops.iter().filter(|o| o[0] != boundary[0]).flatten();
        if let Some(mut v) = others.copied().min_by_key(|v| paths.distance[*v as usize]) {
            let mut line = vec![v];
            while paths.previous[v as usize] != v {
                v = paths.previous[v as usize];
                line.push(v);
            }
            orders.push(Paths::from(around, &line).order);
        }
    }
    orders
}

/// Vertices of the two longest boundary loops, the longest first.
fn longest_boundary_loops(vertices: usize, faces: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut edges: Vec<[u32; 2]> = boundary_edges(faces);
    edges.iter_mut().for_each(|e| e.sort_unstable());
    edges.sort_unstable();
    let mut next = vec![Vec::new(); vertices];
    for [a, b] in edges {
        next[a as usize].push(b);
        next[b as usize].push(a);
    }
    let Paths {
        order, distance, ..
    } = Paths::from(&next, &[]);
    let sets = order.chunk_by(|_, v| distance[*v as usize] > 0);
    let loops = sets.filter(|set| set.len() > 1);
    let mut loops: Vec<Vec<u32>> = loops.map(<[u32]>::to_vec).collect();
    loops.sort_by_key(|r| std::cmp::Reverse(r.len()));
    loops.truncate(2);
    loops
}

/// Shortest paths along edges.
struct Paths {
    /// All vertices, the nearest first.
    order: Vec<u32>,
    /// Distance in edges.
    distance: Vec<u32>,
    /// Previous vertex on the path; a start is its own.
    previous: Vec<u32>,
}

impl Paths {
    /// Paths from `starts`, then from any vertex of each component that these do not reach.
    fn from(around: &[Vec<u32>], starts: &[u32]) -> Self {
        let n = around.len();
        let mut paths = Self {
            order: Vec::with_capacity(n),
            distance: vec![u32::MAX; n],
            previous: (0..n as u32).collect(),
        };
        let mut next = 0;
        let rest = (0..n as u32).map(|v| vec![v]);
        for group in std::iter::once(starts.to_vec()).chain(rest) {
            for v in group {
                if paths.distance[v as usize] == u32::MAX {
                    paths.distance[v as usize] = 0;
                    paths.order.push(v);
                }
            }
            while next < paths.order.len() {
                let v = paths.order[next];
                for &o in &around[v as usize] {
                    if paths.distance[o as usize] == u32::MAX {
                        paths.distance[o as usize] = paths.distance[v as usize] + 1;
                        paths.previous[o as usize] = v;
                        paths.order.push(o);
                    }
                }
                next += 1;
            }
        }
        paths
    }
}

/// Vertices by their distance in edges from one end of the sheet: neighbours are close in memory, and slices of the order
/// are bands.
fn by_distance(around: &[Vec<u32>]) -> Vec<u32> {
    let last = Paths::from(around, &[]).order.last().copied();
    Paths::from(around, last.as_slice()).order
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::mesh::edges;

    /// Adjacency, edges and faces.
    type Strip = (Vec<Vec<u32>>, Vec<[u32; 2]>, Vec<[u32; 3]>);

    /// A strip of `n` squares.
    fn strip(n: u32) -> Strip {
        let faces: Vec<[u32; 3]> = (0..n)
            .flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]])
            .collect();
        let ends = edges(&faces);
        let mut around = vec![Vec::new(); 2 * n as usize + 2];
        for e in &ends {
            around[e[0] as usize].push(e[1]);
            around[e[1] as usize].push(e[0]);
        }
        (around, ends, faces)
    }

    #[test]
    fn bands_of_a_strip_are_cut_across_it() {
        let (around, ends, faces) = strip(29);
        let sets = bands(&around, &ends, &faces, 3);
        let mut all: Vec<u32> = sets.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..60), "every vertex once");
        for set in &sets {
            assert_eq!(set.len(), 20);
            let (low, high) = (set.iter().min(), set.iter().max());
            assert!(high.zip(low).is_some_and(|(h, l)| h - l < 22), "{set:?}");
        }
    }

    #[test]
    fn bands_cover_components_without_edges() {
        let sets = bands(&[vec![], vec![], vec![]], &[], &[], 2);
        assert_eq!(sets.iter().map(Vec::len).sum::<usize>(), 3);
        assert_eq!(bands(&[], &[], &[], 1).concat(), [0u32; 0]);
    }
}
