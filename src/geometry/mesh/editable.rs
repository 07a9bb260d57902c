//! A triangle mesh under local edits: faces by vertex, edge split, edge collapse, edge flip.

use super::{Face, edges};
use crate::math::{P3d, V3d};

/// Positions, faces (`None` once removed) and the faces around each vertex.
pub(super) struct EditableMesh {
    /// Positions, metres.
    pub(super) points: Vec<P3d>,
    pub(super) faces: Vec<Option<Face>>,
    /// Faces around each vertex, in the order in which they came.
    pub(super) around: Vec<Vec<u32>>,
}

/// Two faces with a common edge, and the two that a flip of this edge makes of them.
pub(super) struct Flip {
    /// Their indices.
    pub(super) faces: [u32; 2],
    pub(super) before: [Face; 2],
    pub(super) after: [Face; 2],
    /// Corners opposite the edge.
    pub(super) opposite: [u32; 2],
}

impl EditableMesh {
    pub(super) fn new(points: Vec<P3d>, faces: Vec<Face>) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (i, f) in faces.iter().enumerate() {
            f.iter().for_each(|&v| around[v as usize].push(i as u32));
        }
        Self {
            points,
            faces: faces.into_iter().map(Some).collect(),
            around,
        }
    }
    /// Vertices in use, numbered anew in their order, and faces.
    pub(super) fn compact(self) -> (Vec<P3d>, Vec<Face>) {
        let mut index = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        for (i, _) in self.around.iter().enumerate().filter(|f| !f.1.is_empty()) {
            index[i] = points.len() as u32;
            points.push(self.points[i]);
        }
        let faces = self.faces.into_iter().flatten();
        (
            points,
            faces.map(|f| f.map(|v| index[v as usize])).collect(),
        )
    }
    pub(super) fn length(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }
    pub(super) fn corners(&self, f: &Face) -> [P3d; 3] {
        f.map(|i| self.points[i as usize])
    }
    pub(super) fn has_corner(&self, face: u32, v: u32) -> bool {
        self.faces[face as usize].is_some_and(|f| f.contains(&v))
    }
    pub(super) fn faces_around(&self, v: usize) -> impl Iterator<Item = Face> + '_ {
        self.around[v]
            .iter()
            .filter_map(|f| self.faces[*f as usize])
    }
    /// Edges, smaller vertex first, ascending.
    pub(super) fn edges(&self) -> Vec<[u32; 2]> {
        edges(&self.faces.iter().flatten().copied().collect::<Vec<_>>())
    }
    /// Faces with both vertices.
    pub(super) fn edge_faces(&self, a: u32, b: u32) -> Vec<u32> {
        let around = self.around[a as usize].iter().copied();
        around.filter(|f| self.has_corner(*f, b)).collect()
    }
    /// Neighbours of a vertex, sorted.
    pub(super) fn ring(&self, v: u32) -> Vec<u32> {
        let corners = self.faces_around(v as usize).flatten();
        let mut ring: Vec<u32> = corners.filter(|w| *w != v).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }
    /// Vertices on edges with one face, shape `[vertices]`.
    pub(super) fn open_vertices(&self) -> Vec<bool> {
        let mut open = vec![false; self.points.len()];
        for [a, b] in self.edges() {
            if self.edge_faces(a, b).len() == 1 {
                open[a as usize] = true;
                open[b as usize] = true;
            }
        }
        open
    }
    /// Replaces a face, or removes it.
    pub(super) fn put(&mut self, face: u32, f: Option<Face>) {
        for v in self.faces[face as usize].into_iter().flatten() {
            self.around[v as usize].retain(|&g| g != face);
        }
        self.faces[face as usize] = f;
        for v in f.into_iter().flatten() {
            self.around[v as usize].push(face);
        }
    }
    /// Adds a vertex on an edge and divides the faces beside it.
    pub(super) fn split(&mut self, a: u32, b: u32, middle: P3d) {
        let faces = self.edge_faces(a, b);
        let m = self.points.len() as u32;
        self.points.push(middle);
        self.around.push(Vec::new());
        for f in faces {
            let Some(old) = self.faces[f as usize] else {
                continue;
            };
            self.put(f, Some(old.map(|v| if v == b { m } else { v })));
            self.faces.push(None);
            let new = old.map(|v| if v == a { m } else { v });
            self.put(self.faces.len() as u32 - 1, Some(new));
        }
    }
    /// Makes one vertex at `p` of the ends of an edge; `shared` are the faces beside it.
    pub(super) fn collapse(&mut self, keep: u32, drop: u32, shared: &[u32], p: P3d) {
        for &f in shared {
            self.put(f, None);
        }
        for f in self.around[drop as usize].clone() {
            let new = self.faces[f as usize].map(|g| g.map(|v| if v == drop { keep } else { v }));
            self.put(f, new);
        }
        self.points[keep as usize] = p;
    }
    /// The flip of an edge; `None` on an open edge and where the new edge exists already.
    pub(super) fn flipped(&self, a: u32, b: u32) -> Option<Flip> {
        let &[f, g] = self.edge_faces(a, b).as_slice() else {
            return None;
        };
        let before = [self.faces[f as usize]?, self.faces[g as usize]?];
        let opposite = |t: &Face| t.iter().copied().find(|&v| v != a && v != b);
        let (c, d) = (opposite(&before[0])?, opposite(&before[1])?);
        if c == d || !self.edge_faces(c, d).is_empty() {
            return None;
        }
        Some(Flip {
            faces: [f, g],
            before,
            after: [
                before[0].map(|v| if v == b { d } else { v }),
                before[1].map(|v| if v == a { c } else { v }),
            ],
            opposite: [c, d],
        })
    }
}

/// Normal of a triangle times twice its area.
pub(super) fn normal(p: [P3d; 3]) -> V3d {
    (p[1] - p[0]).cross(&(p[2] - p[0]))
}

/// Sine of a triangle's smallest angle: twice the area over the product of the two long sides.
pub fn smallest_angle(c: [P3d; 3]) -> f64 {
    let l = [
        (c[1] - c[0]).norm(),
        (c[2] - c[1]).norm(),
        (c[0] - c[2]).norm(),
    ];
    let product = (l[0] * l[1]).max(l[1] * l[2]).max(l[2] * l[0]);
    if product > 0.0 {
        normal(c).norm() / product
    } else {
        0.0
    }
}
