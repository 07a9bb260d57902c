//! Trimming of a captured part into cloth that can be worn: narrow tabs cut off, hems smoothed, self-intersections removed.

use super::part::{ClothPart, compact, drop_fans, drop_small_pieces};
use crate::settings::PartCutSettings;
use std::collections::BTreeSet;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::smoothing::half_mean;
use tryon_geometry::mesh::{Csr, Face, TriMesh, boundary_edges, edges};
use tryon_geometry::spatial::intersections;

impl ClothPart {
    /// Surface of the part at these vertices (m, shape `[vertices]`) as cloth to wear; `None` where nothing is left.
    pub fn trimmed(&self, vertices: &[P3]) -> Option<TriMesh> {
        let settings = PartCutSettings::default();
        let mut faces = opened(&self.faces, self.nodes.len(), settings.opening);
        drop_fans(&mut faces);
        let least = (faces.len() / settings.least_share).max(settings.least_faces);
        drop_small_pieces(&mut faces, least);
        if faces.is_empty() {
            return None;
        }
        let (used, faces) = compact(&faces);
        let mut cloth = Cloth::new(faces, used.iter().map(|v| vertices[*v as usize]).collect());
        cloth.smooth_hems(&settings);
        cloth.clear_intersections(&settings);
        TriMesh::new(cloth.x, cloth.faces).ok()
    }
}

/// Faces that remain after so many rings are taken off at the boundary and put on again.
fn opened(faces: &[Face], vertices: usize, rings: usize) -> Vec<Face> {
    let around = Csr::of_edges(vertices, &edges(faces));
    let boundary: BTreeSet<u32> = boundary_edges(faces).into_iter().flatten().collect();
    let off = (0..vertices as u32).map(|v| boundary.contains(&v));
    let mut off: Vec<bool> = off.collect();
    (1..rings).for_each(|_| grow(&around, &mut off));
    let mut on: Vec<bool> = off.iter().map(|off| !off).collect();
    (0..rings).for_each(|_| grow(&around, &mut on));
    let is_on = |f: &&Face| f.iter().all(|v| on[*v as usize]);
    faces.iter().filter(is_on).copied().collect()
}

/// Marks the neighbours of marked vertices too.
pub(crate) fn grow(around: &Csr, marked: &mut [bool]) {
    let before = marked.to_vec();
    for (v, m) in marked.iter_mut().enumerate() {
        *m |= around.row(v).iter().any(|w| before[*w as usize]);
    }
}

struct Cloth {
    faces: Vec<Face>,
    x: Vec<P3>,
    around: Csr,
    /// Neighbours along the boundary.
    along: Csr,
}

impl Cloth {
    fn new(faces: Vec<Face>, x: Vec<P3>) -> Self {
        let mut hems = boundary_edges(&faces);
        hems.iter_mut().for_each(|e| e.sort_unstable());
        Self {
            around: Csr::of_edges(x.len(), &edges(&faces)),
            along: Csr::of_edges(x.len(), &hems),
            faces,
            x,
        }
    }

    fn is_hem(&self, v: usize) -> bool {
        !self.along.row(v).is_empty()
    }

    /// Smooths the boundary along itself, then the cloth near it.
    fn smooth_hems(&mut self, settings: &PartCutSettings) {
        for _ in 0..settings.hem_rounds {
            self.smooth(|cloth, v| cloth.is_hem(v), |cloth| &cloth.along);
        }
        let mut near: Vec<bool> = (0..self.x.len()).map(|v| self.is_hem(v)).collect();
        (0..settings.near_hem).for_each(|_| grow(&self.around, &mut near));
        for _ in 0..settings.near_hem_rounds {
            self.smooth_inner(&near);
        }
    }

    /// Smooths the cloth around self-intersections until there is none.
    fn clear_intersections(&mut self, settings: &PartCutSettings) {
        for _ in 0..settings.clearing_rounds {
            let found = intersections(&self.faces, &self.x);
            if found.is_empty() {
                return;
            }
            let mut near = vec![false; self.x.len()];
            for i in &found {
                let corners = self.faces[i.face as usize];
                let all = i.edge.iter().chain(&corners);
                all.for_each(|v| near[*v as usize] = true);
            }
            (0..settings.clearing_rings).for_each(|_| grow(&self.around, &mut near));
            self.smooth_inner(&near);
            self.smooth(|cloth, v| near[v] && cloth.is_hem(v), |cloth| &cloth.along);
        }
    }

    /// Smooths marked vertices off the hems.
    fn smooth_inner(&mut self, near: &[bool]) {
        self.smooth(
            |cloth, v| near[v] && !cloth.is_hem(v),
            |cloth| &cloth.around,
        );
    }

    /// Moves some vertices halfway to the mean of their neighbours.
    fn smooth(
        &mut self,
        is_moved: impl Fn(&Self, usize) -> bool,
        neighbours: impl Fn(&Self) -> &Csr,
    ) {
        let before: Vec<_> = self.x.iter().map(|p| p.coords).collect();
        let moved = |v: usize| {
            if !is_moved(self, v) {
                return self.x[v];
            }
            let around = neighbours(self).row(v).iter();
            let around = around.map(|w| &before[*w as usize]);
            P3::from(half_mean(&before[v], around))
        };
        let x = (0..self.x.len()).map(moved);
        self.x = x.collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Slot;

    /// A sheet of 20 by 20 cm with a tab 2 cm wide and 8 cm long at its upper side, quads of 1 cm.
    fn sheet_with_tab() -> (ClothPart, Vec<P3>) {
        let is_in = |i: i32, j: i32| {
            (0..20).contains(&i) && ((0..20).contains(&j) || ((9..11).contains(&i) && j < 28))
        };
        let at = |i: i32, j: i32| (j * 21 + i) as u32;
        let cells = (0..28).flat_map(|j| (0..20).map(move |i| (i, j)));
        let cells = cells.filter(|(i, j)| is_in(*i, *j)).flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        let faces = cells.collect();
        let point = |k: i32| P3::new(0.01 * (k % 21) as f32, 0.01 * (k / 21) as f32, 0.0);
        let x: Vec<P3> = (0..21 * 29).map(point).collect();
        let part = ClothPart {
            slot: Slot::Top,
            label: 1,
            below: (0..x.len() as u32).collect(),
            nodes: (0..x.len() as u32).collect(),
            faces,
            rings: Vec::new(),
            hidden: vec![false; x.len()],
        };
        (part, x)
    }

    #[test]
    fn tabs_are_cut_off_and_the_sheet_stays() {
        let (part, x) = sheet_with_tab();
        let mesh = part.trimmed(&x).expect("cloth");
        let (lo, hi) = mesh.bounds().expect("vertices");
        assert!(hi.y < 0.225 && hi.y > 0.19 && lo.y < 0.01, "{lo} {hi}");
        assert!((mesh.area() - 0.04).abs() < 0.002, "{}", mesh.area());
    }

    #[test]
    fn a_sheet_pushed_through_itself_comes_free() {
        let (part, mut x) = sheet_with_tab();
        // A patch shifted over the sheet beside it, and tilted through it.
        let is_patch = |p: &P3| (p.x - 0.1).abs() < 0.025 && (0.05..0.12).contains(&p.y);
        for p in x.iter_mut().filter(|p| is_patch(p)) {
            *p += nalgebra::Vector3::new(0.053, 0.003, 0.003 + 0.4 * (p.x - 0.1));
        }
        assert!(!intersections(&part.faces, &x).is_empty());
        let mesh = part.trimmed(&x).expect("cloth");
        assert!(intersections(mesh.faces(), mesh.vertices()).is_empty());
    }

    #[test]
    fn nothing_is_left_of_a_strip() {
        let (mut part, x) = sheet_with_tab();
        part.faces.retain(|f| f.iter().all(|v| *v >= 21 * 20));
        assert!(part.trimmed(&x).is_none());
    }
}
