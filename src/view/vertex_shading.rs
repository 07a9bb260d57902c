//! Vertex attributes of visible faces: normals, openness in folds, sides.

use super::config::Lights;
use super::surface::Surface;
use tryon_geometry::math::V3;
use tryon_geometry::mesh::face_normal;

/// Distance that is beyond every edge, metres.
const FAR: f32 = 1.0;

impl Surface {
    /// Fills `attributes` and `inner` of the visible faces; returns the number of vertices without one. Sums run over
    /// the same faces in the same order whatever is visible, so their bits equal those of a picture that shows all.
    pub(crate) fn shade_vertices(&mut self, lights: &Lights) -> usize {
        self.find_visible();
        self.compute_normals();
        self.compute_openness(lights);
        self.write_attributes()
    }

    /// Corners and sides of visible faces, and the faces that share a corner with them.
    fn find_visible(&mut self) {
        let wanted = &mut self.scratch.is_visible;
        wanted.clear();
        wanted.resize(self.vertices.len(), false);
        self.inner.resize(self.faces.len(), false);
        let visible = self.visible.of(0..self.faces.len());
        for ((f, visible), inner) in self.faces.iter().zip(visible).zip(&mut self.inner) {
            if visible {
                f.iter().for_each(|i| wanted[*i as usize] = true);
                *inner =
                    face_normal(&self.vertices, f).dot(&self.vertices[f[0] as usize].coords) > 0.0;
            }
        }
        self.scratch.faces.clear();
        let near = (0..).zip(&self.faces);
        let near = near.filter(|(_, f)| f.iter().any(|i| wanted[*i as usize]));
        self.scratch.faces.extend(near.map(|(id, _)| id));
    }

    /// Area-weighted normals of the visible vertices of garments that came without.
    fn compute_normals(&mut self) {
        for id in &self.scratch.faces {
            let f = &self.faces[*id as usize];
            if !self.layers[usize::from(self.garment[*id as usize])].has_normals {
                let n = face_normal(&self.vertices, f);
                f.iter().for_each(|i| self.normals[*i as usize] += n);
            }
        }
        for own in self.layers.iter().filter(|l| !l.has_normals) {
            let own = own.vertices.clone();
            let visible = &self.scratch.is_visible[own.clone()];
            for (n, _) in (self.normals[own].iter_mut().zip(visible)).filter(|(_, w)| **w) {
                *n = n.try_normalize(0.0).unwrap_or_else(V3::zeros);
            }
        }
    }

    /// Openness of the visible vertices: less where their neighbours rise above the tangent plane.
    fn compute_openness(&mut self, lights: &Lights) {
        let (openness, edges) = (&mut self.scratch.openness, &mut self.scratch.edges);
        openness.clear();
        openness.resize(self.vertices.len(), 0.0);
        edges.clear();
        edges.resize(self.vertices.len(), 0);
        for id in &self.scratch.faces {
            let f = &self.faces[*id as usize];
            for k in 0..3 {
                let (i, j) = (f[k] as usize, f[(k + 1) % 3] as usize);
                let e = self.vertices[j] - self.vertices[i];
                let length = e.norm().max(f32::MIN_POSITIVE);
                // Sine of the neighbour's elevation above the tangent plane.
                openness[i] += e.dot(&self.normals[i]) / length;
                openness[j] -= e.dot(&self.normals[j]) / length;
                edges[i] = edges[i].saturating_add(1);
                edges[j] = edges[j].saturating_add(1);
            }
        }
        let [least, most] = lights.openness;
        for (o, n) in openness.iter_mut().zip(edges) {
            *o = (1.0 - lights.fold_shade * *o / f32::from((*n).max(1))).clamp(least, most);
        }
    }

    fn write_attributes(&mut self) -> usize {
        let mut skipped = 0;
        self.attributes.resize(self.vertices.len(), [0.0; 12]);
        for (i, out) in self.attributes.iter_mut().enumerate() {
            if !self.scratch.is_visible[i] {
                skipped += 1;
                continue;
            }
            let (n, [u, v]) = (&self.normals[i], self.uv[i]);
            let (open, z) = (self.scratch.openness[i], self.vertices[i].z);
            let place = &self.places[i];
            // Beyond every edge a large number serves as well as infinity, and can be interpolated.
            let [free, seam] = [place.free, place.seam].map(|d| d.min(FAR));
            let upper = f32::from(u8::from(place.is_upper));
            *out = [
                n.x,
                n.y,
                n.z,
                open,
                u,
                v,
                z,
                free,
                place.along,
                seam,
                upper,
                0.0,
            ];
        }
        skipped
    }
}
