//! Report of a repair: counts, and the first faces of each kind.

use std::fmt;

/// Most faces that a report names.
const NAMED: usize = 3;

/// Faces with one fault: their count and the first ones, by their numbers in the given mesh, from 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaceFinding {
    /// Faces, or edges with such faces.
    pub count: usize,
    /// The first faces, three at most.
    pub first: Vec<u32>,
}

impl FaceFinding {
    /// Adds a face.
    pub fn add(&mut self, face: u32) {
        self.count += 1;
        if self.first.len() < NAMED {
            self.first.push(face);
        }
    }
    /// Places of the first faces, in brackets; `place` names a face.
    fn places(&self, place: &dyn Fn(u32) -> String) -> String {
        let mut names: Vec<String> = self.first.iter().map(|f| place(*f)).collect();
        let more = if self.count > names.len() { " …" } else { "" };
        // Triangles of one polygon have one place.
        names.dedup();
        format!("({}{more})", names.join(", "))
    }
}

/// Changes of a repair.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshRepairReport {
    /// Vertices joined to another one at the same position.
    pub joined: usize,
    /// Faces that joining collapsed, removed.
    pub collapsed: FaceFinding,
    /// Faces with the vertices of an earlier one in either order, removed.
    pub repeated: FaceFinding,
    /// Faces without area, removed or merged into a neighbour.
    pub needles: FaceFinding,
    /// Edges with more than two faces, split; each names the faces that were split off.
    pub edges: FaceFinding,
    /// Vertices at which sheets met in a point, split.
    pub vertices: usize,
    /// Faces with a vertex that is left out of the surface, removed.
    pub cut: FaceFinding,
    /// Vertices without a face, removed.
    pub stray: usize,
    /// Faces whose orientation was reversed.
    pub turned: usize,
    /// Faces of inner sheets and rims of closed double layers, removed.
    pub inner: usize,
    /// Closed double layers that could not be reduced.
    pub unreduced: usize,
}

impl MeshRepairReport {
    /// True if the mesh was left as it was.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
    /// One clause a change; `place` names a face of the given mesh.
    pub fn clauses(&self, place: impl Fn(u32) -> String) -> Vec<String> {
        let at = |finding: &FaceFinding| finding.places(&place);
        let mut out = Vec::new();
        let mut say = |n: usize, one: &str, many: &str, rest: String| {
            if n > 0 {
                let noun = if n == 1 { one } else { many };
                out.push(format!("{n} {noun} {rest}"));
            }
        };
        say(
            self.joined,
            "vertex",
            "vertices",
            "joined to another at the same position".into(),
        );
        let collapsed = format!("that joining collapsed removed {}", at(&self.collapsed));
        say(self.collapsed.count, "face", "faces", collapsed);
        let cut = format!("with a vertex that is left out removed {}", at(&self.cut));
        say(self.cut.count, "face", "faces", cut);
        let repeated = format!("removed {}", at(&self.repeated));
        say(
            self.repeated.count,
            "repeated face",
            "repeated faces",
            repeated,
        );
        let needles = format!("without area removed {}", at(&self.needles));
        say(self.needles.count, "face", "faces", needles);
        let edges = format!("with more than two faces split {}", at(&self.edges));
        say(self.edges.count, "edge", "edges", edges);
        say(
            self.vertices,
            "vertex",
            "vertices",
            "split where sheets met in a point".into(),
        );
        say(
            self.stray,
            "vertex",
            "vertices",
            "without a face removed".into(),
        );
        say(
            self.turned,
            "face",
            "faces",
            "turned over to agree with their neighbours".into(),
        );
        say(
            self.inner,
            "face",
            "faces",
            "of the inner sheet and the rim of cloth with thickness removed".into(),
        );
        say(
            self.unreduced,
            "closed double layer",
            "closed double layers",
            "kept as modelled: its two sheets could not be told apart".into(),
        );
        out
    }
}

impl fmt::Display for MeshRepairReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.clauses(|face| format!("face {face}")).as_slice() {
            [] => f.write_str("nothing to repair"),
            clauses => f.write_str(&clauses.join("; ")),
        }
    }
}
