//! Flat panels with stitches, divided at their longest edges until they have as many vertices as wanted.

use nalgebra::Vector2;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use tryon_formats::sewn_obj::Stitch;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::{Face, edge_faces, undirected};

/// Largest distance between the two sides of a seam (m).
const SEAM_GAP: f64 = 5e-4;

/// Panels as cut, where their vertices are, and what is sewn.
#[derive(Clone, Debug, Default)]
pub(super) struct SewnSheet {
    pub(super) faces: Vec<Face>,
    /// Material coordinates (m), shape `[vertices]`.
    pub(super) flat: Vec<Vector2<f64>>,
    /// Positions (m), shape `[vertices]`.
    pub(super) x: Vec<V3d>,
    pub(super) stitches: Vec<Stitch>,
}

/// Edges by their length; positive lengths order as their bits.
type Longest = BinaryHeap<(u64, Reverse<[u32; 2]>)>;

impl SewnSheet {
    /// Halves the longest edge as cut, with the triangles beside it, until there are `wanted` vertices. Positions stay on
    /// the same surface; a new vertex on a seam is sewn to the other side.
    pub(super) fn divide(&mut self, wanted: usize) {
        let mut beside: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (edge, face) in edge_faces(&self.faces) {
            beside.entry(edge).or_default().push(face);
        }
        let mut sewn: BTreeSet<u32> = (self.stitches.iter())
            .flat_map(|s| [s.vertex, s.edge[0], s.edge[1]])
            .collect();
        let mut longest: Longest = beside.keys().map(|e| self.ranked(*e)).collect();
        while self.x.len() < wanted {
            let Some((_, Reverse(edge))) = longest.pop() else {
                return;
            };
            let Some(faces) = beside.remove(&edge) else {
                continue;
            };
            let middle = self.middle(edge);
            if faces.len() == 1 && edge.iter().all(|v| sewn.contains(v)) {
                let stitch = self.stitch_of(middle, edge, &beside, &sewn);
                sewn.extend(stitch.map(|s| s.vertex));
                self.stitches.extend(stitch);
            }
            for e in edge {
                beside.insert(undirected([e, middle]), Vec::new());
            }
            for face in faces {
                self.halve(face, edge, middle, &mut beside);
            }
            let new = beside.range([0, middle]..).map(|(e, _)| *e);
            let new = new.filter(|e| e[1] == middle);
            longest.extend(new.map(|e| self.ranked(e)));
        }
    }

    fn ranked(&self, edge: [u32; 2]) -> (u64, Reverse<[u32; 2]>) {
        let [a, b] = edge.map(|v| self.flat[v as usize]);
        ((a - b).norm().to_bits(), Reverse(edge))
    }

    /// Adds the middle of an edge; stitches to the edge go to its halves.
    fn middle(&mut self, edge: [u32; 2]) -> u32 {
        let middle = self.x.len() as u32;
        let [a, b] = edge.map(|v| v as usize);
        self.x.push((self.x[a] + self.x[b]) * 0.5);
        self.flat.push((self.flat[a] + self.flat[b]) * 0.5);
        for s in &mut self.stitches {
            if undirected([s.edge[0], s.edge[1]]) == edge {
                (s.edge, s.at) = if s.at <= 0.5 {
                    ([s.edge[0], middle], 2.0 * s.at)
                } else {
                    ([middle, s.edge[1]], 2.0 * s.at - 1.0)
                };
            }
        }
        middle
    }

    /// Stitch of a new vertex between two sewn ones to the border across the seam; `None` off the seams.
    fn stitch_of(
        &self,
        vertex: u32,
        edge: [u32; 2],
        beside: &BTreeMap<[u32; 2], Vec<u32>>,
        sewn: &BTreeSet<u32>,
    ) -> Option<Stitch> {
        let x = self.x[vertex as usize];
        let apart = |&[a, b]: &[u32; 2]| {
            let (from, to) = (self.x[a as usize], self.x[b as usize]);
            let along = to - from;
            let at = ((x - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (at, (from + along * at - x).norm())
        };
        let borders = beside.iter().filter(|(e, faces)| {
            faces.len() == 1 && e.iter().all(|v| sewn.contains(v) && !edge.contains(v))
        });
        let (across, (at, gap)) = borders
            .map(|(e, _)| (*e, apart(e)))
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        (gap <= SEAM_GAP).then_some(Stitch {
            vertex,
            edge: across,
            at: at as f32,
        })
    }

    /// Halves a triangle from `middle` of its `edge` to the corner opposite.
    fn halve(
        &mut self,
        face: u32,
        edge: [u32; 2],
        middle: u32,
        beside: &mut BTreeMap<[u32; 2], Vec<u32>>,
    ) {
        let f = self.faces[face as usize];
        let Some(k) = (0..3).find(|k| !edge.contains(&f[*k])) else {
            return;
        };
        let (corner, next, last) = (f[k], f[(k + 1) % 3], f[(k + 2) % 3]);
        let other = self.faces.len() as u32;
        self.faces[face as usize] = [corner, next, middle];
        self.faces.push([corner, middle, last]);
        for (v, own) in [(next, face), (last, other)] {
            if let Some(faces) = beside.get_mut(&undirected([v, middle])) {
                faces.push(own);
            }
        }
        beside.insert(undirected([corner, middle]), vec![face, other]);
        if let Some(faces) = beside.get_mut(&undirected([corner, last])) {
            let moved = faces.iter_mut().filter(|f| **f == face);
            moved.for_each(|f| *f = other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit squares beside each other, sewn along x = 1.
    fn squares() -> SewnSheet {
        let at = [
            [0, 0],
            [1, 0],
            [0, 1],
            [1, 1],
            [1, 0],
            [2, 0],
            [1, 1],
            [2, 1],
        ];
        let flat: Vec<_> = at.map(|p| Vector2::from(p.map(f64::from))).to_vec();
        let stitch = |vertex, at| Stitch {
            vertex,
            edge: [1, 3],
            at,
        };
        SewnSheet {
            faces: vec![[0, 1, 2], [2, 1, 3], [4, 5, 6], [6, 5, 7]],
            x: flat.iter().map(|p| V3d::new(p.x, p.y, 0.0)).collect(),
            flat,
            stitches: vec![stitch(4, 0.0), stitch(6, 1.0)],
        }
    }

    #[test]
    fn divided_panels_keep_their_area_and_stay_sewn() {
        let mut sheet = squares();
        sheet.divide(300);
        assert_eq!(sheet.x.len(), 300);
        let area = |f: &Face| {
            let [a, b, c] = f.map(|v| sheet.flat[v as usize]);
            0.5 * (b - a).perp(&(c - a))
        };
        assert!(sheet.faces.iter().all(|f| area(f) > 0.0));
        let total: f64 = sheet.faces.iter().map(area).sum();
        assert!((total - 2.0).abs() < 1e-12, "{total}");
        for s in &sheet.stitches {
            let [v, a, b] = [s.vertex, s.edge[0], s.edge[1]].map(|v| sheet.x[v as usize]);
            assert!((a.lerp(&b, f64::from(s.at)) - v).norm() < 1e-6, "{s:?}");
        }
        let on_seam = |v: &Vector2<f64>| v.x == 1.0;
        let seam = sheet.flat.iter().filter(|v| on_seam(v)).count();
        assert!(
            seam > 20 && sheet.stitches.len() + 2 >= seam,
            "{seam} vertices, {} stitches",
            sheet.stitches.len()
        );
        // Conforming: an edge has two triangles unless it lies on the border.
        for of_edge in edge_faces(&sheet.faces).chunk_by(|a, b| a.0 == b.0) {
            let (e, count) = (of_edge[0].0, of_edge.len());
            let [a, b] = e.map(|v| sheet.flat[v as usize]);
            let border = (0..2).any(|d| a[d] == b[d] && a[d].fract() == 0.0);
            assert_eq!(count, if border { 1 } else { 2 });
        }
    }
}
