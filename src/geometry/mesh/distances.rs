//! Shortest paths along edges.

/// Length of the shortest path along edges (ends, length) from each of `n` vertices to the nearest source, metres.
///
/// Infinite without a path, and unreliable beyond `up_to`.
pub fn distances(
    n: usize,
    edges: &[([u32; 2], f64)],
    up_to: f64,
    from: impl Fn(usize) -> bool,
) -> Vec<f64> {
    let mut far: Vec<f64> = (0..n)
        .map(|i| if from(i) { 0.0 } else { f64::INFINITY })
        .collect();
    loop {
        let mut moved = false;
        for ([a, b], l) in edges.iter().map(|(v, l)| (v.map(|v| v as usize), l)) {
            for (p, q) in [(a, b), (b, a)] {
                if far[p] + l < far[q] && far[p] <= up_to {
                    far[q] = far[p] + l;
                    moved = true;
                }
            }
        }
        if !moved {
            return far;
        }
    }
}
