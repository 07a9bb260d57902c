//! A hood while it is put on: slow, and its folds held off each other.
//!
//! Placed, a hood passes nowhere through itself, but it is laid back in three layers, and its edges are far from their
//! lengths. Let go, it springs and falls through itself at once, and what is jammed in three layers nothing takes apart.

use crate::cloth::Sheet;
use crate::cloth::contact::self_contact::{Search, SelfContactFrame, SelfContactModel};
use crate::contact::SurfaceModel;
use crate::garment::{GarmentError, GarmentMesh, Placement};
use crate::math::{P3, V3, V3d};
use crate::par::Par;

/// Distance of two folds, metres; at most a quarter of the edges.
const THICKNESS: f32 = 0.01;
/// Folds nearer than this hold each other, metres. As near as in worn garments (18 mm) hoods had a quarter more crossings
/// after a second and a half.
const REACH: f32 = 0.026;
/// What is nearer goes apart by so much between two looks, metres.
const APART: f64 = 0.001;
/// It moves no faster, m/s: between two looks two millimetres. Where only what has another fold near it was slow, one in
/// seven hoods passed through itself.
const FASTEST: f64 = 0.3;

/// The hood of one garment, and where it is near another fold.
#[derive(Debug)]
pub(super) struct Hood {
    model: SelfContactModel,
    frame: SelfContactFrame,
    search: Search,
    /// Its vertices.
    of: Vec<u32>,
    touches: Vec<Touch>,
    neighbour_of: Vec<u32>,
}

/// A vertex, and the corners of a triangle of another fold.
#[derive(Clone, Copy, Debug)]
struct Touch {
    vertices: [u32; 4],
    /// 1 of the vertex, and what the corners' are less.
    weights: [f64; 4],
    /// Out of the triangle, on the vertex's side.
    normal: V3d,
    /// They keep this distance, metres.
    apart: f64,
}

impl Hood {
    /// `None` where a garment has no hood.
    pub(super) fn of(mesh: &GarmentMesh, sheet: &Sheet) -> Result<Option<Self>, GarmentError> {
        let on_hood = |c: &(u16, [f64; 2])| {
            matches!(
                mesh.placements.get(usize::from(c.0)),
                Some(Placement::Hood(_))
            )
        };
        let of: Vec<u32> = (0u32..)
            .zip(&mesh.corners)
            .filter(|(_, c)| c.iter().any(on_hood))
            .map(|(v, _)| v)
            .collect();
        if of.is_empty() {
            return Ok(None);
        }
        let parts = mesh.regions.iter().map(|r| r.decisive().0).collect();
        let surface = SurfaceModel::new(mesh.faces.clone(), mesh.topology()?, parts);
        let model = SelfContactModel::new(surface, sheet.edges.iter().map(|e| e.1 as f32));
        Ok(Some(Self {
            search: model.search_all(THICKNESS, REACH),
            model,
            of,
            frame: SelfContactFrame::default(),
            touches: Vec::new(),
            neighbour_of: vec![u32::MAX; mesh.vertices],
        }))
    }
    /// Looks for what is near another fold. What is `passing` through the sheet is on no side of it.
    pub(super) fn look(&mut self, x: &[V3d], passing: impl Fn(u32) -> bool) {
        let frame = &mut self.frame;
        frame.surface.vertices.clear();
        frame
            .surface
            .vertices
            .extend(x.iter().map(|p| P3::from(p.cast::<f32>())));
        frame.velocities.resize(x.len(), V3::zeros());
        self.model
            .begin(Par::Seq, frame, Some(&self.search), x.len());
        self.touches.clear();
        self.neighbour_of.fill(u32::MAX);
        for &v in self.of.iter().filter(|v| !passing(**v)) {
            let p = frame.surface.vertices[v as usize];
            let corner = self
                .model
                .candidate(frame, v, &p, &self.search, &mut self.neighbour_of);
            let Some(hit) = corner.and_then(|(c, _)| self.model.other_fold(frame, v, &p, c)) else {
                continue;
            };
            let [a, b, c] = self.model.surface.faces()[hit.face as usize];
            let far = f64::from(hit.signed_distance.abs());
            if far < f64::from(REACH) && ![a, b, c].into_iter().any(&passing) {
                let [wa, wb, wc] = hit.weights.map(f64::from);
                self.touches.push(Touch {
                    vertices: [v, a, b, c],
                    weights: [1.0, -wa, -wb, -wc],
                    normal: hit.normal.cast() * f64::from(hit.signed_distance).signum(),
                    apart: f64::from(self.search.thickness).min(far + APART),
                });
            }
        }
    }
    /// Holds folds apart, and the hood back, at the end of a substep of `h` seconds that began at `before`; `weight`: inverse
    /// masses.
    pub(super) fn hold(&self, x: &mut [V3d], before: &[V3d], weight: impl Fn(u32) -> f64, h: f64) {
        for t in &self.touches {
            let far: f64 = (0..4)
                .map(|k| t.weights[k] * t.normal.dot(&x[t.vertices[k] as usize]))
                .sum();
            let w = t.vertices.map(&weight);
            let mass: f64 = (0..4).map(|k| w[k] * t.weights[k] * t.weights[k]).sum();
            if far < t.apart && mass > 0.0 {
                let push = t.normal * ((t.apart - far) / mass);
                (0..4).for_each(|k| x[t.vertices[k] as usize] += push * (w[k] * t.weights[k]));
            }
        }
        for v in self.of.iter().map(|v| *v as usize) {
            x[v] = before[v] + (x[v] - before[v]).cap_magnitude(FASTEST * h);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::garment::{Side, Size, Triangulation, library};

    fn sewn(name: &str) -> (GarmentMesh, Option<Hood>) {
        let pattern = library::pattern(name, Size::M).expect("pattern");
        let how = Triangulation {
            hood_length: 0.028,
            min_angle: 0.0,
            ..Triangulation::default()
        };
        let mesh = GarmentMesh::sew(&pattern, &how).expect("sewn");
        let sheet = Sheet::of_garment(&mesh).expect("sheet");
        let hood = Hood::of(&mesh, &sheet).expect("manifold");
        (mesh, hood)
    }

    /// Both halves of a hood in their plane, 6 mm apart away from their seam and less towards it.
    fn closed(mesh: &GarmentMesh) -> Vec<V3d> {
        let at = |c: &Vec<(u16, [f64; 2])>| {
            let (panel, [x, y]) = c[0];
            match mesh.placements[usize::from(panel)] {
                Placement::Hood(_) if c.len() > 1 => V3d::new(x.abs(), y, 0.0),
                Placement::Hood(Side::Left) => V3d::new(x.abs(), y, 0.003),
                Placement::Hood(_) => V3d::new(x.abs(), y, -0.003),
                _ => V3d::new(x, y, 5.0 + f64::from(panel)),
            }
        };
        mesh.corners.iter().map(at).collect()
    }

    #[test]
    fn only_hooded_garments_have_one_and_it_is_no_more_than_the_hood() {
        assert!(sewn("longsleeve").1.is_none());
        let (mesh, hood) = sewn("hoodie");
        let hood = hood.expect("a hood");
        assert!(
            hood.of.len() > 100 && hood.of.len() < mesh.vertices / 2,
            "{} of {}",
            hood.of.len(),
            mesh.vertices
        );
    }

    #[test]
    fn halves_that_come_together_are_parted_and_none_is_carried_along() {
        let (mesh, hood) = sewn("hoodie");
        let mut hood = hood.expect("a hood");
        let before = closed(&mesh);
        hood.look(&before, |_| false);
        assert!(hood.touches.len() > 50, "{}", hood.touches.len());
        // Pressed to a quarter of the way.
        let pressed: Vec<V3d> = before
            .iter()
            .map(|p| V3d::new(p.x, p.y, if p.z < 1.0 { 0.25 * p.z } else { p.z }))
            .collect();
        let far = |x: &[V3d], t: &Touch| {
            (0..4)
                .map(|k| t.weights[k] * t.normal.dot(&x[t.vertices[k] as usize]))
                .sum::<f64>()
        };
        let mean = |x: &[V3d]| {
            hood.touches.iter().map(|t| far(x, t)).sum::<f64>() / hood.touches.len() as f64
        };
        let mut x = pressed.clone();
        hood.hold(&mut x, &before, |_| 1.0, 1.0);
        assert!(
            mean(&x) > 3.0 * mean(&pressed),
            "{} to {} m",
            mean(&pressed),
            mean(&x)
        );
        let sum: V3d = x.iter().zip(&pressed).map(|(a, b)| a - b).sum();
        assert!(sum.norm() < 1e-8, "moved as a whole by {sum}");
        // What is pinned stays.
        let mut x = pressed.clone();
        hood.hold(&mut x, &before, |_| 0.0, 1.0);
        assert!(x.iter().zip(&pressed).all(|(a, b)| (a - b).norm() < 1e-15));
    }

    #[test]
    fn it_is_slow_and_what_passes_through_is_let_go() {
        let (mesh, hood) = sewn("hoodie");
        let mut hood = hood.expect("a hood");
        let before = closed(&mesh);
        hood.look(&before, |_| true);
        assert!(hood.touches.is_empty());
        let mut x: Vec<V3d> = before.iter().map(|p| p + V3d::new(0.1, 0.0, 0.0)).collect();
        hood.hold(&mut x, &before, |_| 1.0, 2e-3);
        for (v, (x, before)) in x.iter().zip(&before).enumerate() {
            let most = if hood.of.contains(&(v as u32)) {
                FASTEST * 2e-3
            } else {
                0.1
            };
            assert!(((x - before).norm() - most).abs() < 1e-12, "vertex {v}");
        }
        // A place that is none breaks nothing.
        x[hood.of[0] as usize].x = f64::NAN;
        hood.look(&x, |_| false);
    }
}
