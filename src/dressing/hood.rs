//! Self-contact and speed limit of a hood that is put on.
//!
//! A placed hood is free of itself, but lies back in three layers with edges far from their lengths. Released, it would spring
//! through itself, and three intersecting layers cannot be untangled.

use super::settings::HoodDrapeSettings;
use tryon_cloth::Sheet;
use tryon_cloth::contact::SurfaceModel;
use tryon_cloth::self_contact::{Search, SelfContactFrame, SelfContactModel, SelfContactSettings};
use tryon_garment::{GarmentError, GarmentMesh, Placement};
use tryon_geometry::math::{P3, V3, V3d};
use tryon_geometry::par::Par;

/// Hood of one garment with its self-contacts.
#[derive(Debug)]
pub(super) struct Hood {
    settings: HoodDrapeSettings,
    model: SelfContactModel,
    frame: SelfContactFrame,
    search: Search,
    /// Its vertices.
    vertices: Vec<u32>,
    contacts: Vec<FoldContact>,
    neighbour_of: Vec<u32>,
}

/// Vertex against a triangle of another fold.
#[derive(Clone, Copy, Debug)]
struct FoldContact {
    /// The vertex, then the corners.
    vertices: [u32; 4],
    /// 1 of the vertex, then the negative barycentric weights of the corners.
    weights: [f64; 4],
    /// Unit normal of the triangle, on the vertex's side.
    normal: V3d,
    /// Distance to keep (m).
    distance: f64,
}

impl FoldContact {
    /// Signed distance of the vertex from the triangle (m).
    fn signed_distance(&self, x: &[V3d]) -> f64 {
        (0..4)
            .map(|k| self.weights[k] * self.normal.dot(&x[self.vertices[k] as usize]))
            .sum()
    }
}

impl Hood {
    /// Hood of a garment, `None` if it has none.
    pub(super) fn new(
        mesh: &GarmentMesh,
        sheet: &Sheet,
        settings: HoodDrapeSettings,
    ) -> Result<Option<Self>, GarmentError> {
        let on_hood = |c: &(u16, [f64; 2])| {
            matches!(
                mesh.placements.get(usize::from(c.0)),
                Some(Placement::Hood(_))
            )
        };
        let vertices: Vec<u32> = (0u32..)
            .zip(&mesh.corners)
            .filter(|(_, c)| c.iter().any(on_hood))
            .map(|(v, _)| v)
            .collect();
        if vertices.is_empty() {
            return Ok(None);
        }
        let parts = mesh.regions.iter().map(|r| r.decisive().0).collect();
        let surface = SurfaceModel::new(mesh.faces.clone(), mesh.topology()?, parts);
        let lengths = sheet.edges.iter().map(|e| e.1 as f32);
        let model = SelfContactModel::new(surface, lengths, SelfContactSettings::default());
        Ok(Some(Self {
            search: model.search_all(settings.thickness, settings.reach),
            settings,
            model,
            vertices,
            frame: SelfContactFrame::default(),
            contacts: Vec::new(),
            neighbour_of: vec![u32::MAX; mesh.vertices],
        }))
    }
    /// Finds contacts with other folds. A vertex that is `crossing` the sheet is on no side of it.
    pub(super) fn find_contacts(&mut self, x: &[V3d], crossing: impl Fn(u32) -> bool) {
        let frame = &mut self.frame;
        frame.surface.vertices.clear();
        frame
            .surface
            .vertices
            .extend(x.iter().map(|p| P3::from(p.cast::<f32>())));
        frame.velocities.resize(x.len(), V3::zeros());
        self.model
            .begin(Par::Seq, frame, Some(&self.search), x.len());
        self.contacts.clear();
        self.neighbour_of.fill(u32::MAX);
        for &v in self.vertices.iter().filter(|v| !crossing(**v)) {
            let p = frame.surface.vertices[v as usize];
            let corner = self
                .model
                .candidate(frame, v, &p, &self.search, &mut self.neighbour_of);
            let Some(hit) = corner.and_then(|c| self.model.other_fold(frame, v, &p, c)) else {
                continue;
            };
            let [a, b, c] = self.model.surface.faces()[hit.face as usize];
            let far = f64::from(hit.signed_distance.abs());
            if far < f64::from(self.settings.reach) && ![a, b, c].into_iter().any(&crossing) {
                let [wa, wb, wc] = hit.weights.map(f64::from);
                self.contacts.push(FoldContact {
                    vertices: [v, a, b, c],
                    weights: [1.0, -wa, -wb, -wc],
                    normal: hit.normal.cast() * f64::from(hit.signed_distance).signum(),
                    distance: f64::from(self.search.thickness).min(far + self.settings.separation),
                });
            }
        }
    }
    /// Separates folds and limits the hood's speed at the end of a substep of `h` seconds that began at `before`. `weight`:
    /// inverse masses.
    pub(super) fn resolve(
        &self,
        x: &mut [V3d],
        before: &[V3d],
        weight: impl Fn(u32) -> f64,
        h: f64,
    ) {
        for t in &self.contacts {
            let far = t.signed_distance(x);
            let w = t.vertices.map(&weight);
            let mass: f64 = (0..4).map(|k| w[k] * t.weights[k] * t.weights[k]).sum();
            if far < t.distance && mass > 0.0 {
                let push = t.normal * ((t.distance - far) / mass);
                (0..4).for_each(|k| x[t.vertices[k] as usize] += push * (w[k] * t.weights[k]));
            }
        }
        for v in self.vertices.iter().map(|v| *v as usize) {
            x[v] = before[v] + (x[v] - before[v]).cap_magnitude(self.settings.max_speed * h);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{Side, Size, Triangulation, library};

    fn sewn(name: &str) -> (GarmentMesh, Option<Hood>) {
        let pattern = library::pattern(name, Size::M).expect("pattern");
        let how = Triangulation {
            hood_length: 0.028,
            min_angle: 0.0,
            ..Triangulation::default()
        };
        let mesh = GarmentMesh::sew(&pattern, &how).expect("sewn");
        let sheet = Sheet::of_garment(&mesh).expect("sheet");
        let hood = Hood::new(&mesh, &sheet, HoodDrapeSettings::default()).expect("manifold");
        (mesh, hood)
    }

    /// Both halves of a hood in their plane, 6 mm apart, less towards their seam.
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
    fn only_hooded_garments_have_a_hood() {
        assert!(sewn("longsleeve").1.is_none());
        let (mesh, hood) = sewn("hoodie");
        let hood = hood.expect("a hood");
        assert!(
            hood.vertices.len() > 100 && hood.vertices.len() < mesh.vertices / 2,
            "{} of {}",
            hood.vertices.len(),
            mesh.vertices
        );
    }

    #[test]
    fn halves_are_separated_and_keep_their_centre_of_mass() {
        let (mesh, hood) = sewn("hoodie");
        let mut hood = hood.expect("a hood");
        let before = closed(&mesh);
        hood.find_contacts(&before, |_| false);
        assert!(hood.contacts.len() > 50, "{}", hood.contacts.len());
        // Pressed to a quarter of the distance.
        let pressed: Vec<V3d> = before
            .iter()
            .map(|p| V3d::new(p.x, p.y, if p.z < 1.0 { 0.25 * p.z } else { p.z }))
            .collect();
        let mean = |x: &[V3d]| {
            let all = hood.contacts.iter().map(|t| t.signed_distance(x));
            all.sum::<f64>() / hood.contacts.len() as f64
        };
        let mut x = pressed.clone();
        hood.resolve(&mut x, &before, |_| 1.0, 1.0);
        assert!(
            mean(&x) > 3.0 * mean(&pressed),
            "{} to {} m",
            mean(&pressed),
            mean(&x)
        );
        let sum: V3d = x.iter().zip(&pressed).map(|(a, b)| a - b).sum();
        assert!(sum.norm() < 1e-8, "moved as a whole by {sum}");
        // Pinned vertices stay.
        let mut x = pressed.clone();
        hood.resolve(&mut x, &before, |_| 0.0, 1.0);
        assert!(x.iter().zip(&pressed).all(|(a, b)| (a - b).norm() < 1e-15));
    }

    #[test]
    fn hood_is_slow_and_crossing_vertices_have_no_contact() {
        let (mesh, hood) = sewn("hoodie");
        let mut hood = hood.expect("a hood");
        let before = closed(&mesh);
        hood.find_contacts(&before, |_| true);
        assert!(hood.contacts.is_empty());
        let mut x: Vec<V3d> = before.iter().map(|p| p + V3d::new(0.1, 0.0, 0.0)).collect();
        hood.resolve(&mut x, &before, |_| 1.0, 2e-3);
        for (v, (x, before)) in x.iter().zip(&before).enumerate() {
            let most = if hood.vertices.contains(&(v as u32)) {
                hood.settings.max_speed * 2e-3
            } else {
                0.1
            };
            assert!(((x - before).norm() - most).abs() < 1e-12, "vertex {v}");
        }
        // A position that is not a number causes no panic.
        x[hood.vertices[0] as usize].x = f64::NAN;
        hood.find_contacts(&x, |_| false);
    }
}
