//! Strip of triangles between two lines of vertices.

use std::ops::{Add, Sub};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, face_normal};

/// Vertex between two others: share 0 is the first, 1 the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Between {
    pub(super) ends: [u32; 2],
    pub(super) share: f32,
}

impl Between {
    /// Its value between those of its ends.
    pub(super) fn at<T>(&self, all: &[T]) -> T
    where
        T: Copy + Sub<T, Output = V3> + Add<V3, Output = T>,
    {
        let [p, q] = self.ends.map(|v| all[v as usize]);
        p + (q - p) * self.share
    }
}

/// New vertices, numbered from the body's count on, and faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Strip {
    pub(super) vertices: Vec<Between>,
    pub(super) faces: Vec<Face>,
}

impl Strip {
    /// Joins two lines that begin at one vertex of a body with triangles of edges near `spacing`, metres. New vertices are
    /// numbered after the body's; faces point along `outward` (±z).
    pub(super) fn join(
        [left, right]: [&[u32]; 2],
        body: &[P3],
        spacing: f32,
        outward: f32,
    ) -> Self {
        let first = body.len() as u32;
        let mut out = Self::default();
        let rows = pairs(left, right, body).into_iter().map(|ends| {
            let [a, b] = ends.map(|v| body[v as usize]);
            let inner = ((a - b).norm() / spacing).round() as usize;
            let mut row = vec![ends[0]];
            for k in 1..inner {
                row.push(first + out.vertices.len() as u32);
                out.vertices.push(Between {
                    ends,
                    share: k as f32 / inner as f32,
                });
            }
            if ends[1] != ends[0] {
                row.push(ends[1]);
            }
            row
        });
        let rows: Vec<Vec<u32>> = rows.collect();
        let at = |v: u32| match v.checked_sub(first) {
            Some(k) => out.vertices[k as usize].at(body),
            None => body[v as usize],
        };
        for pair in rows.windows(2) {
            zip_rows(&pair[0], &pair[1], &at, &mut out.faces);
        }
        let all: Vec<P3> = (0..first + out.vertices.len() as u32).map(at).collect();
        let facing: f32 = out.faces.iter().map(|f| face_normal(&all, f).z).sum();
        if facing * outward < 0.0 {
            out.faces.iter_mut().for_each(|f| f.swap(1, 2));
        }
        out
    }
}

/// Vertices of two lines side by side, each line in order: the one that lags behind advances.
fn pairs(left: &[u32], right: &[u32], body: &[P3]) -> Vec<[u32; 2]> {
    let shares = |line: &[u32]| -> Vec<f32> {
        let mut way = vec![0.0];
        for e in line.windows(2) {
            let length = (body[e[0] as usize] - body[e[1] as usize]).norm();
            way.push(way[way.len() - 1] + length);
        }
        let whole = way[way.len() - 1].max(f32::MIN_POSITIVE);
        way.iter().map(|w| w / whole).collect()
    };
    let (a, b) = (shares(left), shares(right));
    let (mut i, mut j) = (0, 0);
    let mut out = vec![[left[0], right[0]]];
    while i + 1 < left.len() || j + 1 < right.len() {
        let next = |shares: &[f32], k: usize| shares.get(k + 1).copied().unwrap_or(f32::INFINITY);
        let (l, r) = (next(&a, i), next(&b, j));
        // Both advance where their next vertices lie within half a step of each other.
        let step = 0.5 * (l.min(r) - a[i].min(b[j])).max(0.0);
        let (both, left_first) = ((l - r).abs() <= step, l < r);
        i += usize::from(both || left_first);
        j += usize::from(both || !left_first);
        out.push([left[i], right[j]]);
    }
    out
}

/// Triangles between two rows; of two diagonals the shorter one is taken.
fn zip_rows(upper: &[u32], lower: &[u32], at: &impl Fn(u32) -> P3, faces: &mut Vec<Face>) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < upper.len() || j + 1 < lower.len() {
        let length = |a: Option<&u32>, b: Option<&u32>| match (a, b) {
            (Some(a), Some(b)) => (at(*a) - at(*b)).norm(),
            _ => f32::INFINITY,
        };
        let along_upper = length(upper.get(i + 1), lower.get(j));
        let along_lower = length(upper.get(i), lower.get(j + 1));
        let face = if along_upper < along_lower {
            i += 1;
            [upper[i - 1], upper[i], lower[j]]
        } else {
            j += 1;
            [upper[i], lower[j], lower[j - 1]]
        };
        // Rows may share an end, where one line waits for the other.
        if face[0] != face[1] && face[1] != face[2] && face[0] != face[2] {
            faces.push(face);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_between_two_lines_is_covered_once() {
        // Lines of different sampling down a triangle of height 1 and base 1.
        let line = |sign: f32, n: usize| -> Vec<P3> {
            let at = |k: usize| {
                let t = k as f32 / n as f32;
                P3::new(sign * 0.5 * t, -t, 0.0)
            };
            (0..=n).map(at).collect()
        };
        let (left, right) = (line(1.0, 7), line(-1.0, 11));
        let body: Vec<P3> = left.iter().chain(&right[1..]).copied().collect();
        let l: Vec<u32> = (0..8).collect();
        let r: Vec<u32> = std::iter::once(0).chain(8..19).collect();
        let strip = Strip::join([&l, &r], &body, 0.1, 1.0);
        let mut all = body.clone();
        all.extend(strip.vertices.iter().map(|b| b.at(&body)));
        let areas = strip.faces.iter().map(|f| face_normal(&all, f).z / 2.0);
        let area: f32 = areas.sum();
        assert!((area - 0.5).abs() < 1e-5, "{area}");
        let mesh = tryon_geometry::mesh::TriMesh::new(all, strip.faces).expect("faces in range");
        let topology = tryon_geometry::mesh::Topology::new(&mesh).expect("manifold");
        assert!(!topology.is_closed());
    }
}
