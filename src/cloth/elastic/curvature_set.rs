//! Bending by one curvature tensor a vertex, the weighted sum of the dihedral angles around it.

use super::curvature_weights::{exact_weights, least_weights};
use super::edges::InteriorEdge;
use super::element_set::CHUNK;
use super::fan_expansion::{CurvatureBuffers, FanExpansion, Place};
use super::fans::RestMesh;
use super::{BendLaw, Dihedral, ElasticExpansion, RestSheet, RestTriangle, SheetMotion};
use nalgebra::{Matrix3, Vector3};
use tryon_geometry::mesh::Csr;
use tryon_geometry::par::{Par, for_chunks, map_into};

/// Hinge whose angle counts from its rest angle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RestHinge {
    /// Edge start, edge end, left apex, right apex.
    corners: [u32; 4],
    /// Rest angle (rad).
    angle: f64,
}

/// Angle of a fan's hinge in its curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FanTerm {
    hinge: u32,
    /// Places of the hinge's corners among the fan's vertices.
    places: [u16; 4],
    /// Curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ) by the angle (1/m).
    weight: Vector3<f64>,
}

/// Curvature of one fan.
#[derive(Clone, Debug, Default, PartialEq)]
struct FanCurvature {
    /// Area for which it stands (m²).
    area: f64,
    vertices: Vec<u32>,
    terms: Vec<FanTerm>,
}

/// Curvature elements of a mesh and the lists that sum their expansions.
#[derive(Clone, Debug, Default)]
pub(super) struct CurvatureSet {
    hinges: Vec<RestHinge>,
    fans: Vec<FanCurvature>,
    at_vertices: Csr<Place>,
    at_pairs: Csr<Place>,
}

impl CurvatureSet {
    /// Elements of a mesh; `stiffness` is that at rest (N·m).
    pub(super) fn new(
        rest: &RestSheet,
        triangles: &[RestTriangle],
        edges: &[InteriorEdge],
        stiffness: &Matrix3<f64>,
    ) -> Self {
        let fans = RestMesh::new(&rest.faces, triangles, edges).fans();
        let hinge = |e: &InteriorEdge| RestHinge {
            corners: e.corners,
            angle: e.rest_angle(rest.folded.as_deref()),
        };
        let mut out = Self {
            hinges: edges.iter().map(hinge).collect(),
            ..Self::default()
        };
        for fan in &fans {
            let weights = exact_weights(fan).unwrap_or_else(|| least_weights(fan, stiffness));
            let mut element = FanCurvature {
                area: fan.area,
                ..FanCurvature::default()
            };
            for (h, weight) in fan.hinges.iter().zip(weights) {
                let corners = edges[h.edge as usize].corners;
                let places = corners.map(|v| element.place(v));
                element.terms.push(FanTerm {
                    hinge: h.edge,
                    places,
                    weight,
                });
            }
            out.fans.push(element);
        }
        out
    }
    /// Pairs of vertices that share a fan, smaller first, with repetitions.
    pub(super) fn pairs(&self) -> Vec<[u32; 2]> {
        let mut out = Vec::new();
        for fan in &self.fans {
            for (k, &i) in fan.vertices.iter().enumerate() {
                out.extend(fan.vertices[k + 1..].iter().map(|&j| [i.min(j), i.max(j)]));
            }
        }
        out
    }
    /// Makes the lists of sums over `vertices` vertices and sorted `pairs`.
    pub(super) fn list(&mut self, vertices: usize, pairs: &[[u32; 2]]) {
        let (mut at_vertices, mut at_pairs) = (Vec::new(), Vec::new());
        for (number, fan) in self.fans.iter().enumerate() {
            for (a, &i) in fan.vertices.iter().enumerate() {
                at_vertices.push((i, (number as u32, a as u16, a as u16)));
                for (b, &j) in fan.vertices.iter().enumerate().filter(|(_, j)| i < **j) {
                    if let Ok(row) = pairs.binary_search(&[i, j]) {
                        at_pairs.push((row as u32, (number as u32, a as u16, b as u16)));
                    }
                }
            }
        }
        self.at_vertices = Csr::from_pairs(vertices, &at_vertices);
        self.at_pairs = Csr::from_pairs(pairs.len(), &at_pairs);
    }
    /// Energy (J).
    pub(super) fn energy(&self, law: &BendLaw, par: Par, at: &SheetMotion<'_>) -> f64 {
        let (mut angles, mut values) = (Vec::new(), Vec::new());
        map_into(par, self.hinges.len(), CHUNK, &mut angles, |k| {
            let hinge = &self.hinges[k];
            Dihedral::continued_angle(&at.corners(&hinge.corners)) - hinge.angle
        });
        map_into(par, self.fans.len(), CHUNK, &mut values, |k| {
            let fan = &self.fans[k];
            if at.is_asleep(&fan.vertices) {
                return 0.0;
            }
            fan.area * law.expand(&fan.curvature(|h| angles[h])).value
        });
        values.iter().sum()
    }
    /// Adds value, gradient and positive semi-definite Hessian (Gauss–Newton in the angles) to the sums.
    pub(super) fn assemble(
        &self,
        law: &BendLaw,
        par: Par,
        at: &SheetMotion<'_>,
        buffers: &mut CurvatureBuffers,
        out: &mut ElasticExpansion,
    ) {
        map_into(par, self.hinges.len(), CHUNK, &mut buffers.angles, |k| {
            Some(Dihedral::continued(&at.corners(&self.hinges[k].corners)))
        });
        let angles = &buffers.angles;
        buffers
            .fans
            .resize(self.fans.len(), FanExpansion::default());
        for_chunks(par, &mut buffers.fans, CHUNK, |start, chunk| {
            for (k, e) in chunk.iter_mut().enumerate() {
                let fan = &self.fans[start + k];
                if at.is_asleep(&fan.vertices) {
                    e.clear(fan.vertices.len());
                } else {
                    fan.expand(law, &self.hinges, angles, e);
                }
            }
        });
        let fans = &buffers.fans;
        out.value += fans.iter().map(|f| f.value).sum::<f64>();
        for_chunks(par, &mut out.gradient, CHUNK, |start, chunk| {
            for (k, g) in chunk.iter_mut().enumerate() {
                for &(fan, a, _) in self.at_vertices.row(start + k) {
                    *g += fans[fan as usize].gradient[a as usize];
                }
            }
        });
        for (lists, sums) in [
            (&self.at_vertices, &mut out.diagonal),
            (&self.at_pairs, &mut out.off_diagonal),
        ] {
            for_chunks(par, sums, CHUNK, |start, chunk| {
                for (k, sum) in chunk.iter_mut().enumerate() {
                    for place in lists.row(start + k) {
                        *sum += fans[place.0 as usize].block(place);
                    }
                }
            });
        }
    }
}

impl FanCurvature {
    /// Place of a vertex, added if it is new.
    fn place(&mut self, v: u32) -> u16 {
        let found = self.vertices.iter().position(|w| *w == v);
        found.unwrap_or_else(|| {
            self.vertices.push(v);
            self.vertices.len() - 1
        }) as u16
    }
    /// Curvature (1/m) of angles beyond rest.
    fn curvature(&self, angle: impl Fn(usize) -> f64) -> Vector3<f64> {
        let sum = |s, t: &FanTerm| s + t.weight * angle(t.hinge as usize);
        self.terms.iter().fold(Vector3::zeros(), sum)
    }
    fn expand(
        &self,
        law: &BendLaw,
        hinges: &[RestHinge],
        angles: &[Option<Dihedral>],
        out: &mut FanExpansion,
    ) {
        out.by_vertex.clear();
        out.by_vertex.resize(self.vertices.len(), Matrix3::zeros());
        let mut curvature = Vector3::zeros();
        for t in &self.terms {
            let Some(theta) = &angles[t.hinge as usize] else {
                continue;
            };
            curvature += t.weight * (theta.angle - hinges[t.hinge as usize].angle);
            for (i, &place) in t.places.iter().enumerate() {
                let slope = theta.gradient.fixed_rows::<3>(3 * i);
                out.by_vertex[place as usize] += t.weight * slope.transpose();
            }
        }
        let w = law.expand(&curvature) * self.area;
        out.value = w.value;
        let tangent = w.positive_hessian();
        out.moments.clear();
        out.moments
            .extend(out.by_vertex.iter().map(|j| tangent * j));
        out.gradient.clear();
        out.gradient
            .extend(out.by_vertex.iter().map(|j| j.tr_mul(&w.gradient)));
    }
}

#[cfg(test)]
mod tests {
    use super::super::edges::interior_edges;
    use super::*;
    use crate::specimens::strip::{StripMesh, StripPattern, strip};
    use nalgebra::{DMatrix, Rotation2, Vector2};
    use tryon_geometry::math::V3d;

    const PATTERNS: [StripPattern; 4] = [
        StripPattern::Uniform,
        StripPattern::Alternating,
        StripPattern::Staggered,
        StripPattern::Unstructured(3),
    ];

    fn elements(rest: &RestSheet, vertices: usize, law: &BendLaw) -> CurvatureSet {
        let triangles = rest.triangles(vertices).expect("valid");
        let edges = interior_edges(&rest.faces);
        CurvatureSet::new(rest, &triangles, &edges, &law.at_rest())
    }

    fn mesh(pattern: StripPattern) -> (StripMesh, RestSheet) {
        let s = strip(1.0, 8, 4, pattern);
        let rest = RestSheet::flat(s.faces.clone(), &s.at).expect("faces");
        (s, rest)
    }

    fn anisotropic() -> BendLaw {
        BendLaw::Linear(Matrix3::new(3.0, 0.4, 0.1, 0.4, 1.0, -0.2, 0.1, -0.2, 0.8))
    }

    /// Height field of a small constant curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ).
    fn curved(s: &StripMesh, z: &Vector3<f64>) -> Vec<V3d> {
        let height = |p: &Vector2<f64>| {
            0.5 * (z[0] * p.x * p.x + z[1] * p.y * p.y + z[2] * p.x * p.y) + 1e-4 * p.x
        };
        s.at.iter().map(|p| V3d::new(p.x, p.y, height(p))).collect()
    }

    #[test]
    fn constant_curvature_has_its_energy_on_any_mesh() {
        let law = anisotropic();
        for pattern in PATTERNS {
            let (s, rest) = mesh(pattern);
            let set = elements(&rest, s.at.len(), &law);
            let area: f64 = set.fans.iter().map(|f| f.area).sum();
            for z in [[1.0, 0.0, 0.0], [0.3, -0.8, 0.5], [0.2, 0.1, -1.4]] {
                let z = Vector3::from(z) * 1e-4;
                let bent = curved(&s, &z);
                let energy = set.energy(&law, Par::Seq, &SheetMotion::still(&bent));
                let expected = area * law.expand(&z).value;
                let error = energy / expected - 1.0;
                // Corners, and boundary vertices whose neighbours lie on a conic, take the least curvature.
                assert!((-0.08..1e-5).contains(&error), "{pattern:?} {z} {error}");
            }
        }
    }

    /// Each face may lie in its panel as it likes; what counts is its grain.
    #[test]
    fn frames_of_faces_carry_the_grain() {
        let law = anisotropic();
        let (s, rest) = mesh(StripPattern::Unstructured(3));
        let z = Vector3::new(0.3, -0.8, 0.5) * 1e-4;
        let x = curved(&s, &z);
        let mut moved = rest.clone();
        for (k, corners) in moved.corners.iter_mut().enumerate() {
            for c in corners {
                *c += Vector2::new(k as f64, -2.0);
            }
        }
        let set = elements(&moved, s.at.len(), &law);
        let expected =
            elements(&rest, s.at.len(), &law).energy(&law, Par::Seq, &SheetMotion::still(&x));
        assert!(
            (set.energy(&law, Par::Seq, &SheetMotion::still(&x)) / expected - 1.0).abs() < 1e-9
        );
        // The grain turned by 30°: the curvature is the same tensor in the turned frame.
        let turn = Rotation2::new(-std::f64::consts::FRAC_PI_6);
        let mut turned = rest.clone();
        for c in turned.corners.iter_mut().flatten() {
            *c = turn * *c;
        }
        let set = elements(&turned, s.at.len(), &law);
        let tensor = nalgebra::Matrix2::new(z[0], 0.5 * z[2], 0.5 * z[2], z[1]);
        let t = turn * tensor * turn.inverse();
        let there = Vector3::new(t[(0, 0)], t[(1, 1)], 2.0 * t[(0, 1)]);
        let area: f64 = set.fans.iter().map(|f| f.area).sum();
        let expected = area * law.expand(&there).value;
        assert!(
            (set.energy(&law, Par::Seq, &SheetMotion::still(&x)) / expected - 1.0).abs() < 0.005
        );
    }

    /// Only affine heights are free: no hourglass mode on any mesh.
    #[test]
    fn every_bending_mode_costs_energy() {
        let law = BendLaw::isotropic(1.0, 0.2);
        for pattern in PATTERNS {
            let (s, rest) = mesh(pattern);
            let mut set = elements(&rest, s.at.len(), &law);
            let mut pairs = set.pairs();
            pairs.sort_unstable();
            pairs.dedup();
            set.list(s.at.len(), &pairs);
            let mut out = ElasticExpansion::default();
            out.reset(s.at.len(), pairs.len());
            let flat = curved(&s, &Vector3::zeros());
            let buffers = &mut CurvatureBuffers::default();
            set.assemble(
                &law,
                Par::Seq,
                &SheetMotion::still(&flat),
                buffers,
                &mut out,
            );
            let mut h = DMatrix::zeros(s.at.len(), s.at.len());
            for (i, d) in out.diagonal.iter().enumerate() {
                h[(i, i)] = d[(2, 2)];
            }
            for (&[i, j], b) in pairs.iter().zip(&out.off_diagonal) {
                h[(i as usize, j as usize)] = b[(2, 2)];
                h[(j as usize, i as usize)] = b[(2, 2)];
            }
            let mut modes: Vec<f64> = h.symmetric_eigenvalues().iter().copied().collect();
            modes.sort_by(f64::total_cmp);
            let stiffest = modes[modes.len() - 1];
            assert!(modes[2].abs() < 1e-9 * stiffest, "{pattern:?} {modes:?}");
            assert!(modes[3] > 1e-6 * stiffest, "{pattern:?} {modes:?}");
        }
    }
}
