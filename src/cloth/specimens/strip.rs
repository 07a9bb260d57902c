//! Meshes of rectangular strips: structured and unstructured.

use nalgebra::Vector2;

/// Triangulation of a strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StripPattern {
    /// Squares cut along one diagonal.
    #[cfg(test)]
    Uniform,
    /// Squares cut along alternating diagonals.
    Alternating,
    /// Rows shifted by half a square: nearly equilateral triangles.
    #[cfg(test)]
    Staggered,
    /// Delaunay triangles of a grid jittered by 0.3 squares, by this seed.
    Unstructured(u32),
}

/// Flat mesh of a strip, u along its length.
#[derive(Clone, Debug)]
pub(crate) struct StripMesh {
    /// Vertices (m).
    pub(crate) at: Vec<Vector2<f64>>,
    /// Triangles.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Vertices of one column.
    pub(crate) rows: usize,
}

/// Strip from u = −3h/2 to `length`, with `columns` squares of size h along it and `rows` across, v from 0.
///
/// The first three columns of vertices are straight: held, they clamp the strip at u = 0 to second order in h, and no
/// element at its end sees it bend.
pub(crate) fn strip(length: f64, columns: usize, rows: usize, pattern: StripPattern) -> StripMesh {
    let h = length / (columns as f64 - 1.5);
    let across = rows + 1;
    let mut random = Random(match pattern {
        StripPattern::Unstructured(seed) => seed,
        _ => 0,
    });
    let mut at = Vec::new();
    for i in 0..=columns {
        for j in 0..across {
            let mut p = Vector2::new(i as f64 - 1.5, j as f64);
            let inside = [i > 2 && i < columns, j > 0 && j < rows];
            match pattern {
                StripPattern::Unstructured(_) if i > 2 => {
                    // Boundary vertices slide along their side.
                    let slides = [inside[0], inside[1]];
                    for d in 0..2 {
                        p[d] += if slides[d] {
                            0.6 * random.next() - 0.3
                        } else {
                            0.0
                        };
                    }
                }
                #[cfg(test)]
                StripPattern::Staggered if inside[0] && j % 2 == 1 => p.x += 0.5,
                _ => {}
            }
            at.push(p * h);
        }
    }
    let mut faces = Vec::new();
    for i in 0..columns {
        for j in 0..rows {
            let k = (i * across + j) as u32;
            let [a, b, c, d] = [k, k + across as u32, k + across as u32 + 1, k + 1];
            let other = match pattern {
                StripPattern::Alternating => (i + j) % 2 == 1,
                #[cfg(test)]
                StripPattern::Staggered => j % 2 == 1,
                _ => false,
            };
            if other {
                faces.extend([[a, b, c], [a, c, d]]);
            } else {
                faces.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    if matches!(pattern, StripPattern::Unstructured(_)) {
        flip_to_delaunay(&at, &mut faces);
    }
    StripMesh {
        at,
        faces,
        rows: across,
    }
}

/// Numbers in [0, 1) of a linear congruential generator.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1u32 << 24)
    }
}

/// Flips edges whose opposite angles sum to more than π until none is left (Lawson).
fn flip_to_delaunay(at: &[Vector2<f64>], faces: &mut [[u32; 3]]) {
    let p = |v: u32| at[v as usize];
    let cotangent = |apex: u32, a: u32, b: u32| {
        let (x, y) = (p(a) - p(apex), p(b) - p(apex));
        x.dot(&y) / x.perp(&y)
    };
    'again: loop {
        for f in 0..faces.len() {
            for g in f + 1..faces.len() {
                let (s, t) = (faces[f], faces[g]);
                // Edge a→b of s, b→a of t.
                let Some(k) = (0..3).find(|&k| {
                    let (a, b) = (s[(k + 1) % 3], s[(k + 2) % 3]);
                    (0..3).any(|m| t[(m + 1) % 3] == b && t[(m + 2) % 3] == a)
                }) else {
                    continue;
                };
                let (a, b) = (s[(k + 1) % 3], s[(k + 2) % 3]);
                let Some(&apex) = t.iter().find(|v| **v != a && **v != b) else {
                    continue;
                };
                if cotangent(s[k], a, b) + cotangent(apex, b, a) < -1e-9 {
                    faces[f] = [s[k], a, apex];
                    faces[g] = [apex, b, s[k]];
                    continue 'again;
                }
            }
        }
        return;
    }
}
