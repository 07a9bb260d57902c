//! Midpoint subdivision of a sewn garment: each triangle becomes four of its shape, as cut and as worn.
//!
//! The pieces lie in the triangle that they come from, so a surface without intersections keeps none.

use super::{GarmentMesh, Region, RenderMesh};
use std::collections::HashMap;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// A garment on the finer of two meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct GarmentSubdivision {
    /// The finer mesh. It begins with the vertices of the coarser one.
    pub mesh: GarmentMesh,
    /// Ends of the edge at whose middle each further vertex lies.
    pub parents: Vec<[u32; 2]>,
}

/// Middles of edges, numbered in order of first use.
struct Middles {
    first: u32,
    known: HashMap<[u32; 2], u32>,
    parents: Vec<[u32; 2]>,
}

impl Middles {
    fn new(vertices: usize) -> Self {
        Self {
            first: vertices as u32,
            known: HashMap::new(),
            parents: Vec::new(),
        }
    }

    /// Vertex in the middle of an edge.
    fn of(&mut self, a: u32, b: u32) -> u32 {
        let edge = [a.min(b), a.max(b)];
        let next = self.first + self.parents.len() as u32;
        let vertex = *self.known.entry(edge).or_insert(next);
        if vertex == next {
            self.parents.push(edge);
        }
        vertex
    }

    /// Middle of the edge after each corner of a triangle.
    fn around(&mut self, [a, b, c]: Face) -> Face {
        [self.of(a, b), self.of(b, c), self.of(c, a)]
    }
}

/// The three corners' pieces, then the inner one.
fn pieces<T: Copy>([a, b, c]: [T; 3], [ab, bc, ca]: [T; 3]) -> [[T; 3]; 4] {
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

impl GarmentSubdivision {
    /// Subdivides once. Anchors stay at the vertices of the coarser mesh.
    pub fn new(coarse: &GarmentMesh) -> Self {
        let mut middles = Middles::new(coarse.vertices);
        let around: Vec<Face> = coarse.faces.iter().map(|f| middles.around(*f)).collect();
        let mut mesh = coarse.clone();
        mesh.vertices += middles.parents.len();
        mesh.faces = (coarse.faces.iter().zip(&around))
            .flat_map(|(f, m)| pieces(*f, *m))
            .collect();
        mesh.face_panel = (coarse.face_panel.iter())
            .flat_map(|panel| [*panel; 4])
            .collect();
        let between = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let halves = |t: &[[f64; 2]; 3]| [0, 1, 2].map(|k| between(t[k], t[(k + 1) % 3]));
        mesh.rest = (coarse.rest.iter())
            .flat_map(|t| pieces(*t, halves(t)))
            .collect();

        for [a, b] in &middles.parents {
            let ends = [*a as usize, *b as usize];
            let [p, q] = ends.map(|v| coarse.regions[v]);
            let common = Region(p.0 & q.0);
            let has_common = common != Region::default();
            mesh.regions
                .push(if has_common { common } else { p.with(q) });
            let [s, t] = ends.map(|v| coarse.uv[v]);
            mesh.uv.push([0.5 * (s[0] + t[0]), 0.5 * (s[1] + t[1])]);
        }
        mesh.corners.resize(mesh.vertices, Vec::new());
        for ((t, m), panel) in coarse.rest.iter().zip(&around).zip(&coarse.face_panel) {
            for (at, v) in halves(t).into_iter().zip(m) {
                let known = &mut mesh.corners[*v as usize];
                if known.iter().all(|(p, _)| p != panel) {
                    known.push((*panel, at));
                }
            }
        }

        mesh.seams = (coarse.seams.iter())
            .flat_map(|[a, b]| {
                let middle = middles.of(*a, *b);
                [[*a, middle], [middle, *b]]
            })
            .collect();
        mesh.render = subdivide_drawn(&coarse.render, &mut middles);
        Self {
            mesh,
            parents: middles.parents,
        }
    }

    /// Positions (m) of the finer mesh from those of the coarser one.
    pub fn refine(&self, coarse: &[V3d]) -> Vec<V3d> {
        let middle = |[a, b]: &[u32; 2]| (coarse[*a as usize] + coarse[*b as usize]) * 0.5;
        let all = coarse.iter().copied();
        all.chain(self.parents.iter().map(middle)).collect()
    }
}

/// Drawn mesh over the finer vertices, of which `middles` knows all.
fn subdivide_drawn(coarse: &RenderMesh, middles: &mut Middles) -> RenderMesh {
    let mut own = Middles::new(coarse.vertex.len());
    let faces = (coarse.faces.iter())
        .flat_map(|f| pieces(*f, own.around(*f)))
        .collect();
    let (mut vertex, mut uv) = (coarse.vertex.clone(), coarse.uv.clone());
    for [a, b] in own.parents {
        let [a, b] = [a as usize, b as usize];
        vertex.push(middles.of(coarse.vertex[a], coarse.vertex[b]));
        uv.push([0, 1].map(|k| 0.5 * (coarse.uv[a][k] + coarse.uv[b][k])));
    }
    let trims = coarse.trims.clone();
    RenderMesh {
        vertex,
        uv,
        faces,
        trims,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Size, Triangulation, library};

    fn area(t: &[[f64; 2]; 3]) -> f64 {
        let [e, d] = [1, 2].map(|k| [t[k][0] - t[0][0], t[k][1] - t[0][1]]);
        0.5 * (e[0] * d[1] - e[1] * d[0])
    }

    #[test]
    fn every_garment_of_the_library_stays_whole() {
        for name in library::names() {
            let pattern = library::pattern(name, Size::M).expect("a pattern");
            let coarse = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
            let GarmentSubdivision { mesh, parents } = GarmentSubdivision::new(&coarse);

            let edges = coarse.topology().expect("a surface").edges().len();
            assert_eq!(parents.len(), edges, "{name}: a vertex an edge");
            assert_eq!(mesh.vertices, coarse.vertices + edges);
            assert_eq!(mesh.faces.len(), 4 * coarse.faces.len());
            mesh.topology().expect("a surface");
            for k in [mesh.corners.len(), mesh.uv.len(), mesh.regions.len()] {
                assert_eq!(k, mesh.vertices);
            }
            assert!(mesh.corners.iter().all(|c| !c.is_empty()));
            assert_eq!(mesh.render.uv.len(), mesh.render.vertex.len());
            for (drawn, simulated) in mesh.render.faces.iter().zip(&mesh.faces) {
                assert_eq!(drawn.map(|v| mesh.render.vertex[v as usize]), *simulated);
            }

            let [before, after] = [&coarse, &mesh].map(|m| m.rest.iter().map(area).sum::<f64>());
            assert!((before - after).abs() < 1e-9, "{name}: {before} {after} m²");
        }
    }

    #[test]
    fn middles_lie_on_their_edges() {
        let pattern = library::pattern("skirt", Size::M).expect("a pattern");
        let coarse = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let fine = GarmentSubdivision::new(&coarse);
        let x: Vec<V3d> = (0..coarse.vertices)
            .map(|v| V3d::new(v as f64, (v * v % 7) as f64, 1.0))
            .collect();
        let y = fine.refine(&x);
        assert_eq!(y[..x.len()], x[..]);
        let [a, b] = fine.parents[0].map(|v| x[v as usize]);
        assert_eq!(y[x.len()], (a + b) * 0.5);
    }
}
