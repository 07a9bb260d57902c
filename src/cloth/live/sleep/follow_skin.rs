//! Motion of sleeping cloth with the skin below it.

use tryon_geometry::math::{P3, V3};

/// Smoothing iterations over cloth neighbours: a hand's width, so that cloth between two legs follows both.
const SMOOTHING: usize = 6;

/// Moves sleeping cloth with the skin at `nearest` (first vertex of each pair) from `from` to `to`.
///
/// Displacements are averaged over cloth neighbours. They add up, so a body that returns brings its cloth back.
pub(super) fn follow_skin(
    edges: &[([u32; 2], f64)],
    nearest: &[[u32; 2]],
    from: &[P3],
    to: &[P3],
    positions: &mut [P3],
) {
    let all = skin_displacements(edges, nearest, from, to, |_| true);
    positions.iter_mut().zip(&all).for_each(|(p, d)| *p += d);
}

/// Displacement of the skin below each vertex that `follows`, averaged over neighbours that follow too.
pub(super) fn skin_displacements(
    edges: &[([u32; 2], f64)],
    nearest: &[[u32; 2]],
    from: &[P3],
    to: &[P3],
    follows: impl Fn(usize) -> bool,
) -> Vec<V3> {
    let mut all: Vec<V3> = nearest
        .iter()
        .map(|n| to[n[0] as usize] - from[n[0] as usize])
        .collect();
    let mut counts = vec![1.0f32; all.len()];
    let edges: Vec<[usize; 2]> = edges
        .iter()
        .map(|(v, _)| v.map(|v| v as usize))
        .filter(|v| follows(v[0]) && follows(v[1]))
        .collect();
    edges.iter().flatten().for_each(|v| counts[*v] += 1.0);
    let mut sums = all.clone();
    for _ in 0..SMOOTHING {
        for &[a, b] in &edges {
            sums[a] += all[b];
            sums[b] += all[a];
        }
        sums.iter_mut().zip(&counts).for_each(|(s, n)| *s /= *n);
        all.copy_from_slice(&sums);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn cloth_follows_a_translation_and_returns_with_the_skin() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(4);
        let mut random =
            |by: f32| V3::new(0.0, 0.0, 0.0).map(|_: f32| by * rng.random_range(-1.0f32..1.0));
        // A strip over the first half of some skin.
        let skin: Vec<P3> = (0..40)
            .map(|i| P3::new(0.02 * i as f32, 0.0, 0.0))
            .collect();
        let above = V3::new(0.0, 0.01, 0.0);
        let cloth: Vec<P3> = skin[..20].iter().map(|p| p + above).collect();
        let nearest: Vec<[u32; 2]> = (0..20).map(|i| [i, i]).collect();
        let edges: Vec<([u32; 2], f64)> = (1..20).map(|i| ([i - 1, i], 0.02)).collect();
        let off = |at: &[P3], by: V3| {
            let pairs = at.iter().zip(&cloth);
            pairs.map(|(a, b)| (a - b - by).norm()).fold(0.0, f32::max)
        };
        let whole = random(0.01);
        let mut there = cloth.clone();
        let moved: Vec<P3> = skin.iter().map(|p| p + whole).collect();
        follow_skin(&edges, &nearest, &skin, &moved, &mut there);
        assert!(off(&there, whole) < 1e-6);
        let (mut at, mut last) = (cloth.clone(), skin.clone());
        for step in 0..1000 {
            let next: Vec<P3> = match step {
                999 => skin.clone(),
                _ => skin.iter().map(|p| p + random(0.01)).collect(),
            };
            follow_skin(&edges, &nearest, &last, &next, &mut at);
            last = next;
        }
        assert!(off(&at, V3::zeros()) < 2e-5);
    }
}
