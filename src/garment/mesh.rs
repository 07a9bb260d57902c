//! A pattern sewn: one welded simulation mesh whose triangles keep their flat rest shape.

use super::triangulate::{PanelMesh, triangulate};
use super::{GarmentError, GarmentKind, Material, Panel, Pattern, Placement, Side, Size};
use crate::math::P3;
use crate::mesh::{Face, Topology, TriMesh};
use serde::{Deserialize, Serialize};

/// How finely to triangulate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triangulation {
    /// Target edge length, metres.
    pub edge_length: f64,
    /// Longest edges of a hood, metres: worn down it lies in folds that longer ones cannot show.
    pub hood_length: f64,
    /// Refuse a panel with a smaller angle than this, degrees.
    pub min_angle: f64,
}

impl Default for Triangulation {
    fn default() -> Self {
        // 21 mm gives a T-shirt or a skirt about 2,000 vertices; the library's panels stay above 20°.
        Self {
            edge_length: 0.021,
            hood_length: 0.014,
            min_angle: 12.0,
        }
    }
}

/// Parts of the body a vertex touches, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Region(pub u8);

impl Region {
    /// Trunk, neck and head.
    pub const TRUNK: Self = Self(1);
    /// Left arm and hand.
    pub const LEFT_ARM: Self = Self(2);
    /// Right arm and hand.
    pub const RIGHT_ARM: Self = Self(4);
    /// Left leg and foot.
    pub const LEFT_LEG: Self = Self(8);
    /// Right leg and foot.
    pub const RIGHT_LEG: Self = Self(16);
    /// Everything.
    pub const ALL: Self = Self(31);

    /// Both.
    pub const fn with(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
    /// Both arms.
    pub const ARMS: Self = Self::LEFT_ARM.with(Self::RIGHT_ARM);
    /// Has a part in common.
    pub fn meets(self, o: Self) -> bool {
        self.0 & o.0 != 0
    }
    /// The parts whose skin decides for cloth that touches these: where a sleeve meets the trunk, the trunk. Its arm
    /// counts as another part there, so that an armpit that closes is known to be closed.
    pub fn decisive(self) -> Self {
        if self.meets(Self::TRUNK) {
            Self(self.0 & !Self::ARMS.0)
        } else {
            self
        }
    }
    /// What a panel wraps.
    pub fn of(p: Placement) -> Self {
        match p {
            Placement::TrunkFront
            | Placement::TrunkBack
            | Placement::SkirtFront
            | Placement::SkirtBack => Self::TRUNK.with(Self::LEFT_LEG).with(Self::RIGHT_LEG),
            Placement::Hood(_) => Self::TRUNK,
            Placement::Sleeve(Side::Left) => Self::LEFT_ARM,
            Placement::Sleeve(Side::Right) => Self::RIGHT_ARM,
            Placement::LegFront(Side::Left) | Placement::LegBack(Side::Left) => {
                Self::LEFT_LEG.with(Self::TRUNK)
            }
            Placement::LegFront(Side::Right) | Placement::LegBack(Side::Right) => {
                Self::RIGHT_LEG.with(Self::TRUNK)
            }
        }
    }
}

/// How a set of anchors is tied to the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnchorKind {
    /// A band around the body: its vertices are spread evenly before they are tied.
    Band,
    /// Cloth that lies on the shoulders: each vertex is tied to the nearest skin.
    Shoulders,
    /// A rigid accessory: each vertex keeps its exact place over the skin.
    Rigid,
}

impl AnchorKind {
    /// Kind of a pattern's anchor: patterns call theirs `shoulders` or by the edge that holds them.
    fn of_pattern(name: &str) -> Self {
        if name == "shoulders" {
            Self::Shoulders
        } else {
            Self::Band
        }
    }
}

/// Vertices that are tied to the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnchorSet {
    /// How they are tied.
    pub kind: AnchorKind,
    /// Simulation vertices.
    pub vertices: Vec<u32>,
    /// How firmly, 0 to 1.
    pub strength: f64,
}

/// The mesh for drawing: panels keep their own vertices along seams, so that textures don't smear across them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderMesh {
    /// Simulation vertex under each render vertex, shape `[render vertices]`.
    pub vertex: Vec<u32>,
    /// Texture coordinates: panel coordinates in metres, laid out side by side. Shape `[render vertices]`.
    pub uv: Vec<[f32; 2]>,
    /// Triangles over render vertices, in the order of [`GarmentMesh::faces`].
    pub faces: Vec<Face>,
}

/// A sewn garment, ready to be put on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GarmentMesh {
    /// Garment name.
    pub name: String,
    /// What it is.
    pub kind: GarmentKind,
    /// Its size.
    pub size: Size,
    /// Fabric.
    pub material: Material,
    /// Order on the body, 0 innermost.
    pub layer: u8,
    /// Number of simulation vertices.
    pub vertices: usize,
    /// Triangles over simulation vertices, counter-clockwise seen from outside.
    pub faces: Vec<Face>,
    /// Rest shape of each triangle: its corners in panel coordinates, metres.
    pub rest: Vec<[[f64; 2]; 3]>,
    /// Panel of each triangle.
    pub face_panel: Vec<u16>,
    /// Panel names.
    pub panels: Vec<String>,
    /// Where each panel goes.
    pub placements: Vec<Placement>,
    /// Panels and panel coordinates that meet in each simulation vertex (more than one along seams).
    pub corners: Vec<Vec<(u16, [f64; 2])>>,
    /// Texture coordinates of each simulation vertex (of the first panel that meets there), metres.
    pub uv: Vec<[f32; 2]>,
    /// Parts of the body each vertex belongs to.
    pub regions: Vec<Region>,
    /// What hangs on the body.
    pub anchors: Vec<AnchorSet>,
    /// Pairs of simulation vertices along the seams, for drawing the stitches.
    pub seams: Vec<[u32; 2]>,
    /// The mesh for drawing.
    pub render: RenderMesh,
    /// Smallest angle of all rest triangles, degrees.
    pub min_angle: f64,
}

impl GarmentMesh {
    /// Triangulates the panels and sews them.
    ///
    /// # Errors
    /// Faults of the pattern or of its triangulation, naming panel, edge or seam.
    pub fn sew(pattern: &Pattern, how: &Triangulation) -> Result<Self, GarmentError> {
        pattern.check()?;
        for (field, length) in [
            ("edge_length", how.edge_length),
            ("hood_length", how.hood_length),
        ] {
            if !(length > 1e-3 && length < 0.5) {
                let why = format!("{length} m is not between 0.001 and 0.5");
                return Err(GarmentError::Field {
                    field: field.into(),
                    why,
                });
            }
        }
        let meshes = triangulate_all(pattern, how)?;
        let first: Vec<usize> = meshes
            .iter()
            .scan(0, |s, m| {
                let at = *s;
                *s += m.points.len();
                Some(at)
            })
            .collect();
        let loose: usize = meshes.iter().map(|m| m.points.len()).sum();
        let mut sets = UnionFind::new(loose);
        let mut stitched: Vec<(usize, usize)> = Vec::new();
        for ((pa, ea), (pb, eb), reversed) in pattern.sewn() {
            let mut other = meshes[pb].edges[eb].clone();
            if reversed {
                other.reverse();
            }
            let mut last = None;
            for (&i, &j) in meshes[pa].edges[ea].iter().zip(&other) {
                let at = first[pa] + i as usize;
                sets.join(at, first[pb] + j as usize);
                if let Some(l) = last.replace(at) {
                    stitched.push((l, at));
                }
            }
        }
        let welded = sets.number();
        let vertices = welded.iter().max().map_or(0, |m| *m as usize + 1);
        let mut out = Self {
            name: pattern.name.clone(),
            kind: pattern.kind,
            size: pattern.size,
            material: pattern.material.clone(),
            layer: pattern.layer,
            vertices,
            faces: Vec::new(),
            rest: Vec::new(),
            face_panel: Vec::new(),
            panels: pattern.panels.iter().map(|p| p.name.clone()).collect(),
            placements: pattern.panels.iter().map(|p| p.placement).collect(),
            corners: vec![Vec::new(); vertices],
            uv: vec![[0.0; 2]; vertices],
            regions: vec![Region::default(); vertices],
            anchors: Vec::new(),
            seams: stitched
                .into_iter()
                .map(|(a, b)| [welded[a], welded[b]])
                .collect(),
            render: RenderMesh {
                vertex: welded.clone(),
                ..RenderMesh::default()
            },
            min_angle: meshes.iter().map(|m| m.min_angle).fold(180.0, f64::min),
        };
        let mut offset = 0.0;
        for (k, m) in meshes.iter().enumerate() {
            let lo = m
                .points
                .iter()
                .fold([f64::MAX; 2], |l, p| [l[0].min(p[0]), l[1].min(p[1])]);
            let hi = m.points.iter().map(|p| p[0]).fold(f64::MIN, f64::max);
            for (i, p) in m.points.iter().enumerate() {
                let w = welded[first[k] + i] as usize;
                let uv = [(p[0] - lo[0] + offset) as f32, (p[1] - lo[1]) as f32];
                if out.corners[w].is_empty() {
                    out.uv[w] = uv;
                }
                out.corners[w].push((k as u16, *p));
                out.regions[w] = out.regions[w].with(Region::of(pattern.panels[k].placement));
                out.render.uv.push(uv);
            }
            /// Gap between panels in texture space, metres.
            const GAP: f64 = 0.02;
            offset += hi - lo[0] + GAP;
            for f in &m.faces {
                out.render
                    .faces
                    .push(f.map(|i| (first[k] + i as usize) as u32));
                out.faces.push(f.map(|i| welded[first[k] + i as usize]));
                out.rest.push(f.map(|i| m.points[i as usize]));
                out.face_panel.push(k as u16);
            }
        }
        for a in &pattern.anchors {
            let mut vertices: Vec<u32> = a
                .edges
                .iter()
                .filter_map(|r| pattern.find(r))
                .flat_map(|(p, e)| meshes[p].edges[e].iter().map(move |&i| (p, i)))
                .map(|(p, i)| welded[first[p] + i as usize])
                .collect();
            vertices.sort_unstable();
            vertices.dedup();
            out.anchors.push(AnchorSet {
                kind: AnchorKind::of_pattern(&a.name),
                vertices,
                strength: a.strength,
            });
        }
        out.topology()?;
        Ok(out)
    }
    /// Connectivity of the simulation mesh.
    ///
    /// # Errors
    /// When seams make it non-manifold or turn a panel inside out.
    pub fn topology(&self) -> Result<Topology, GarmentError> {
        Ok(Topology::new(&TriMesh::new(
            vec![P3::origin(); self.vertices],
            self.faces.clone(),
        )?)?)
    }
    /// Positions of the render vertices from those of the simulation vertices. Metres.
    pub fn render_positions(&self, simulated: &[P3], out: &mut Vec<P3>) {
        out.clear();
        out.extend(self.render.vertex.iter().map(|&v| simulated[v as usize]));
    }
}

/// Pieces of each edge of each panel: by length, equal on both sides of a seam.
fn triangulate_all(pattern: &Pattern, how: &Triangulation) -> Result<Vec<PanelMesh>, GarmentError> {
    let length = |p: &Panel| match p.placement {
        Placement::Hood(_) => how.edge_length.min(how.hood_length),
        _ => how.edge_length,
    };
    let mut pieces: Vec<Vec<usize>> = pattern
        .panels
        .iter()
        .map(|p| {
            (0..p.edges.len())
                .map(|i| ((p.edges[i].length(p.end(i)) / length(p)).round() as usize).max(1))
                .collect()
        })
        .collect();
    for ((pa, ea), (pb, eb), _) in pattern.sewn() {
        let n = (pieces[pa][ea] + pieces[pb][eb]).div_ceil(2);
        (pieces[pa][ea], pieces[pb][eb]) = (n, n);
    }
    pattern
        .panels
        .iter()
        .zip(&pieces)
        .map(|(p, n)| {
            let m = triangulate(p, n, length(p))?;
            if m.min_angle < how.min_angle {
                return Err(GarmentError::Panel {
                    panel: p.name.clone(),
                    why: format!(
                        "its smallest angle is {:.1}°, below the {}° asked for",
                        m.min_angle, how.min_angle
                    ),
                });
            }
            Ok(m)
        })
        .collect()
}

struct UnionFind(Vec<u32>);

impl UnionFind {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }
    fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] as usize != i {
            self.0[i] = self.0[self.0[i] as usize];
            i = self.0[i] as usize;
        }
        i
    }
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }
    /// Consecutive numbers of the sets, in order of their first member.
    fn number(&mut self) -> Vec<u32> {
        let mut label = vec![u32::MAX; self.0.len()];
        let mut next = 0;
        (0..self.0.len())
            .map(|i| {
                let r = self.root(i);
                if label[r] == u32::MAX {
                    label[r] = next;
                    next += 1;
                }
                label[r]
            })
            .collect()
    }
}

/// Signed area of a flat triangle, m².
pub fn mesh_area(t: &[[f64; 2]; 3]) -> f64 {
    0.5 * ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]))
}
