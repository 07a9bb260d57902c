//! Vertex attributes of visible faces: normals, openness in folds, sides.

use super::config::Lights;
use super::surface::{Surface, VertexAttributes};
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
        self.sharpen_normals(lights.fold_gain);
        self.compute_compression();
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
        // Their neighbours, whose normals theirs are compared with.
        let beside = &mut self.scratch.has_normal;
        beside.clone_from(wanted);
        for f in &self.faces {
            if f.iter().any(|i| wanted[*i as usize]) {
                f.iter().for_each(|i| beside[*i as usize] = true);
            }
        }
        self.scratch.faces.clear();
        let near = (0..).zip(&self.faces);
        let near = near.filter(|(_, f)| f.iter().any(|i| beside[*i as usize]));
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
            let wanted = &self.scratch.has_normal[own.clone()];
            for (n, _) in (self.normals[own].iter_mut().zip(wanted)).filter(|(_, w)| **w) {
                *n = n.try_normalize(0.0).unwrap_or_else(V3::zeros);
            }
        }
    }

    /// Deepens the folds in the normals of visible vertices of cloth that came without: the mean over the faces around a
    /// vertex takes from a fold three edges long five sixths of its slopes' energy.
    fn sharpen_normals(&mut self, gain: f32) {
        let sums = &mut self.scratch.around;
        sums.clear();
        sums.resize(self.vertices.len(), V3::zeros());
        for id in &self.scratch.faces {
            let [a, b, c] = self.faces[*id as usize].map(|i| i as usize);
            for [i, j, k] in [[a, b, c], [b, c, a], [c, a, b]] {
                sums[i] += self.normals[j] + self.normals[k];
            }
        }
        let layers = self.layers.iter().zip(&self.fabrics);
        for (own, _) in layers.filter(|(l, f)| !l.has_normals && f.cloth.is_some()) {
            for i in own.vertices.clone().filter(|i| self.scratch.is_visible[*i]) {
                let around = sums[i].try_normalize(0.0).unwrap_or_else(V3::zeros);
                let n = self.normals[i];
                let sharp = n + (n - around) * gain;
                self.normals[i] = sharp.try_normalize(0.0).unwrap_or(n);
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

    /// Compression of the simulated mesh against its pattern, of garments of cloth: wrinkles that it is too coarse for.
    fn compute_compression(&mut self) {
        let sums = &mut self.scratch.compression;
        sums.clear();
        sums.resize(self.vertices.len(), [0.0; 3]);
        for id in &self.scratch.faces {
            let fabric = &self.fabrics[usize::from(self.garment[*id as usize])];
            if fabric.cloth.is_none() {
                continue;
            }
            let f = self.faces[*id as usize].map(|i| i as usize);
            let flat = f.map(|i| self.uv[i].map(|t| t * fabric.metres_per_uv));
            let (compression, area) = compression(f.map(|i| self.vertices[i].coords), flat);
            for i in f {
                let sum = &mut sums[i];
                sum[0] += area * compression[0];
                sum[1] += area * compression[1];
                sum[2] += area;
            }
        }
    }

    fn write_attributes(&mut self) -> usize {
        let mut skipped = 0;
        let none = VertexAttributes::default();
        self.attributes.resize(self.vertices.len(), none);
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
            let [x, y, area] = self.scratch.compression[i];
            let ridges = ridges([x, y].map(|m| m / area.max(f32::MIN_POSITIVE)));
            *out = none;
            out[..4].copy_from_slice(&[n.x, n.y, n.z, open]);
            out[4..8].copy_from_slice(&[u, v, z, free]);
            out[8..11].copy_from_slice(&[place.along, seam, upper]);
            out[12..].copy_from_slice(&ridges);
        }
        skipped
    }
}

/// Compression below which no wrinkle is seen, and beyond which none gets steeper.
const COMPRESSED: [f32; 2] = [5e-4, 0.05];

/// Slopes (root mean square) of the four fields of ridges, across the directions 0, 45, 90 and 135° of the pattern, from a
/// compression ε (cos 2θ, sin 2θ). A sine of wavelength λ and amplitude a takes up ε = (π a/λ)², so that its slopes have
/// √(2 ε); the two fields beside θ share it, and as they are independent their squares add up to it.
fn ridges([x, y]: [f32; 2]) -> [f32; 4] {
    let strain = x.hypot(y);
    if strain < COMPRESSED[0] {
        return [0.0; 4];
    }
    let steep = (2.0 * (strain - COMPRESSED[0]).min(COMPRESSED[1])).sqrt();
    [x, y, -x, -y].map(|m| steep * (m / strain).max(0.0))
}

/// Greatest compression of a triangle in its plane against its flat shape (metres), less the stretch across it:
/// ε (cos 2θ, sin 2θ) with the strain ε ≥ 0 along θ in the pattern; and its flat area.
fn compression([a, b, c]: [V3; 3], flat: [[f32; 2]; 3]) -> ([f32; 2], f32) {
    let [p, q] = [1, 2].map(|k| [flat[k][0] - flat[0][0], flat[k][1] - flat[0][1]]);
    let double = p[0] * q[1] - p[1] * q[0];
    if double == 0.0 {
        return ([0.0; 2], 0.0);
    }
    // Deformation gradient, column by column.
    let (e, d) = (b - a, c - a);
    let x = (e * q[1] - d * p[1]) / double;
    let y = (d * p[0] - e * q[0]) / double;
    let strain = [
        0.5 * (x.dot(&x) - 1.0),
        0.5 * x.dot(&y),
        0.5 * (y.dot(&y) - 1.0),
    ];
    let mean = 0.5 * (strain[0] + strain[2]);
    let half = 0.5 * (strain[0] - strain[2]);
    let spread = half.hypot(strain[1]);
    // Yarns that turn against each other shorten one diagonal as they lengthen the other: no wrinkle takes that up.
    let sheared = (mean + spread).max(0.0);
    let wrinkled = (spread - mean - sheared).max(0.0);
    let unit = -wrinkled / spread.max(f32::MIN_POSITIVE);
    ([unit * half, unit * strain[1]], 0.5 * double.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat triangle shortened by `share` along an angle of its pattern, in a tilted plane.
    fn shortened(share: f32, angle: f32) -> [f32; 2] {
        let flat = [[0.0, 0.0], [0.02, 0.003], [0.004, 0.017]];
        let along = [angle.cos(), angle.sin()];
        let axes = [V3::new(0.6, 0.0, 0.8), V3::new(0.0, 1.0, 0.0)];
        let place = |p: [f32; 2]| {
            let t = p[0] * along[0] + p[1] * along[1];
            let moved = [p[0] - share * t * along[0], p[1] - share * t * along[1]];
            axes[0] * moved[0] + axes[1] * moved[1]
        };
        compression(flat.map(place), flat).0
    }

    #[test]
    fn compression_has_the_strain_and_the_direction_of_shortening() {
        for angle in [0.0f32, 0.4, 1.2, 2.8] {
            let [x, y] = shortened(0.05, angle);
            // Green's strain of a shortening by 5 %.
            let expected = 0.5 * (1.0 - 0.95 * 0.95);
            assert!((x.hypot(y) - expected).abs() < 1e-4, "{x} {y}");
            let off = (0.5 * y.atan2(x) - angle).rem_euclid(std::f32::consts::PI);
            assert!(off.min(std::f32::consts::PI - off) < 1e-3, "{angle}: {off}");
        }
    }

    #[test]
    fn ridges_share_the_slope_of_a_compression() {
        for angle in [0.0f32, 0.3, 1.0, 2.5] {
            let (s, c) = (2.0 * angle).sin_cos();
            let slopes = ridges([0.0205 * c, 0.0205 * s]);
            let sum = slopes.iter().map(|s| s * s).sum::<f32>().sqrt();
            assert!((sum - 0.2).abs() < 1e-3, "{slopes:?}");
            assert!(slopes.iter().filter(|s| **s > 1e-6).count() <= 2);
        }
        assert_eq!(ridges([3e-4, 0.0]), [0.0; 4]);
    }

    #[test]
    fn shear_of_the_yarns_is_no_compression() {
        let flat = [[0.0, 0.0], [0.02, 0.0], [0.0, 0.02]];
        let sheared = [
            V3::zeros(),
            V3::new(0.02, 0.0, 0.0),
            V3::new(0.003, 0.02, 0.0),
        ];
        let [x, y] = compression(sheared, flat).0;
        assert!(x.hypot(y) < 1e-3, "{x} {y}");
    }

    #[test]
    fn stretch_and_collapsed_patterns_are_no_compression() {
        assert_eq!(shortened(-0.05, 0.7), [0.0; 2]);
        let corners = [V3::zeros(), V3::x(), V3::y()];
        assert_eq!(compression(corners, [[0.0; 2]; 3]), ([0.0; 2], 0.0));
    }
}
