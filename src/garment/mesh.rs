//! Sewn garment: one welded simulation mesh whose triangles keep their flat rest shape.

use super::triangulate::{PanelMesh, Triangulation, triangulate};
use super::{
    Anchor, GarmentError, GarmentKind, Material, Panel, Pattern, PlacedTrim, Placement, Side, Size,
    Trim,
};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, Topology, TriMesh, UnionFind};

/// Gap between panels in texture space, metres.
const TEXTURE_GAP: f64 = 0.02;

/// Set of body parts that a vertex touches, as bits.
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
    /// All parts.
    pub const ALL: Self = Self(31);

    /// Union.
    pub const fn with(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
    /// Both arms.
    pub const ARMS: Self = Self::LEFT_ARM.with(Self::RIGHT_ARM);
    /// True for a part in common.
    pub fn meets(self, o: Self) -> bool {
        self.0 & o.0 != 0
    }
    /// Parts whose skin governs contact of cloth that touches these: at the seam of sleeve and trunk, the trunk.
    /// The arm counts as another part there, so that a closed armpit is detected.
    pub fn decisive(self) -> Self {
        if self.meets(Self::TRUNK) {
            Self(self.0 & !Self::ARMS.0)
        } else {
            self
        }
    }
    /// Parts that a panel covers.
    pub fn of(p: Placement) -> Self {
        match p {
            Placement::TrunkFront
            | Placement::TrunkBack
            | Placement::SkirtFront
            | Placement::SkirtBack => Self::TRUNK.with(Self::LEFT_LEG).with(Self::RIGHT_LEG),
            Placement::Hood(_) | Placement::Collar => Self::TRUNK,
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

/// Attachment of a set of anchors to the body.
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

/// Vertices attached to the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnchorSet {
    /// Attachment of the vertices.
    pub kind: AnchorKind,
    /// Simulation vertices.
    pub vertices: Vec<u32>,
    /// Strength, 0 to 1.
    pub strength: f64,
}

/// Mesh for rendering: panels keep their own vertices along seams, so that textures do not smear across them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderMesh {
    /// Simulation vertex under each render vertex, shape `[render vertices]`.
    pub vertex: Vec<u32>,
    /// Texture coordinates: panel coordinates in metres, laid out side by side. Shape `[render vertices]`.
    pub uv: Vec<[f32; 2]>,
    /// Triangles over render vertices, in the order of [`GarmentMesh::faces`].
    pub faces: Vec<Face>,
    /// Pockets, buttons and the like, in texture space.
    #[serde(default)]
    pub trims: Vec<PlacedTrim>,
}

/// Triangles of all garments of an outfit, vertices numbered through.
pub fn joined_faces(garments: &[GarmentMesh]) -> Vec<Face> {
    let (mut faces, mut first) = (Vec::new(), 0);
    for g in garments {
        faces.extend(g.faces.iter().map(|f| f.map(|v| v + first)));
        first += g.vertices as u32;
    }
    faces
}

/// Sewn garment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GarmentMesh {
    /// Garment name.
    pub name: String,
    /// Kind of garment.
    pub kind: GarmentKind,
    /// Letter size.
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
    /// Place of each panel.
    pub placements: Vec<Placement>,
    /// Panels and panel coordinates that meet in each simulation vertex (more than one along seams).
    pub corners: Vec<Vec<(u16, [f64; 2])>>,
    /// Texture coordinates of each simulation vertex (of the first panel that meets there), metres.
    pub uv: Vec<[f32; 2]>,
    /// Parts of the body each vertex belongs to.
    pub regions: Vec<Region>,
    /// Vertices attached to the body.
    pub anchors: Vec<AnchorSet>,
    /// Pairs of simulation vertices along the seams, for rendering the stitches.
    pub seams: Vec<[u32; 2]>,
    /// Mesh for rendering.
    pub render: RenderMesh,
    /// Smallest angle of all rest triangles, degrees.
    pub min_angle: f64,
}

/// Panels sewn: the simulation vertex of every panel vertex.
struct Sewn {
    meshes: Vec<PanelMesh>,
    /// First vertex of each panel, counting all panels' vertices.
    first: Vec<usize>,
    /// Simulation vertex of each panel vertex.
    welded: Vec<u32>,
    /// Simulation vertices.
    vertices: usize,
    /// Panel vertices along one side of each seam, in pairs.
    seams: Vec<[usize; 2]>,
}

impl Sewn {
    fn new(pattern: &Pattern, meshes: Vec<PanelMesh>) -> Self {
        let mut total = 0;
        let mut first = Vec::with_capacity(meshes.len());
        for m in &meshes {
            first.push(total);
            total += m.points.len();
        }
        let mut sets = UnionFind::new(total);
        let mut seams = Vec::new();
        for ((pa, ea), (pb, eb), reversed) in pattern.sewn() {
            let mut other = meshes[pb].edges[eb].clone();
            if reversed {
                other.reverse();
            }
            let mut last = None;
            for (&i, &j) in meshes[pa].edges[ea].iter().zip(&other) {
                let at = first[pa] + i as usize;
                sets.join(at as u32, (first[pb] + j as usize) as u32);
                if let Some(l) = last.replace(at) {
                    seams.push([l, at]);
                }
            }
        }
        let (welded, vertices) = sets.number();
        Self {
            meshes,
            first,
            welded,
            vertices,
            seams,
        }
    }

    /// Simulation vertices of the edges of an anchor, sorted.
    fn anchor(&self, pattern: &Pattern, a: &Anchor) -> AnchorSet {
        let edges = a.edges.iter().filter_map(|r| pattern.find(r));
        let mut vertices: Vec<u32> = edges
            .flat_map(|(p, e)| {
                let points = self.meshes[p].edges[e].iter();
                points.map(move |&i| self.welded[self.first[p] + i as usize])
            })
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        AnchorSet {
            kind: AnchorKind::of_pattern(&a.name),
            vertices,
            strength: a.strength,
        }
    }
}

impl GarmentMesh {
    /// Triangulates the panels and sews them.
    ///
    /// # Errors
    /// Faults of the pattern or of its triangulation, naming panel, edge or seam.
    pub fn sew(pattern: &Pattern, how: &Triangulation) -> Result<Self, GarmentError> {
        pattern.check()?;
        how.check()?;
        let sewn = Sewn::new(pattern, triangulate_all(pattern, how)?);
        let vertices = sewn.vertices;
        let angles = sewn.meshes.iter().map(|m| m.min_angle);
        let anchors = pattern.anchors.iter().map(|a| sewn.anchor(pattern, a));
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
            min_angle: angles.fold(180.0, f64::min),
            anchors: anchors.collect(),
            seams: sewn
                .seams
                .iter()
                .map(|s| s.map(|v| sewn.welded[v]))
                .collect(),
            render: RenderMesh {
                vertex: sewn.welded.clone(),
                ..RenderMesh::default()
            },
        };
        let mut offset = 0.0;
        for panel in 0..sewn.meshes.len() {
            let trims = pattern.trims.iter();
            let own = trims.filter(|t| t.panel == pattern.panels[panel].name);
            offset = out.add_panel(&sewn, panel, own, offset);
        }
        out.topology()?;
        Ok(out)
    }
    /// Adds the triangles and trims of a panel, laid out at `offset` in texture space; returns the offset of the next one, metres.
    fn add_panel<'a>(
        &mut self,
        sewn: &Sewn,
        panel: usize,
        trims: impl Iterator<Item = &'a Trim>,
        offset: f64,
    ) -> f64 {
        let (m, first) = (&sewn.meshes[panel], sewn.first[panel]);
        let lo = m
            .points
            .iter()
            .fold([f64::MAX; 2], |l, p| [l[0].min(p[0]), l[1].min(p[1])]);
        let hi = m.points.iter().map(|p| p[0]).fold(f64::MIN, f64::max);
        let region = Region::of(self.placements[panel]);
        let moved = [offset - lo[0], -lo[1]];
        self.render.trims.extend(trims.map(|t| t.placed(moved)));
        for (i, p) in m.points.iter().enumerate() {
            let w = sewn.welded[first + i] as usize;
            let uv = [(p[0] - lo[0] + offset) as f32, (p[1] - lo[1]) as f32];
            if self.corners[w].is_empty() {
                self.uv[w] = uv;
            }
            self.corners[w].push((panel as u16, *p));
            self.regions[w] = self.regions[w].with(region);
            self.render.uv.push(uv);
        }
        for f in &m.faces {
            let own = f.map(|i| first + i as usize);
            self.render.faces.push(own.map(|v| v as u32));
            self.faces.push(own.map(|v| sewn.welded[v]));
            self.rest.push(f.map(|i| m.points[i as usize]));
            self.face_panel.push(panel as u16);
        }
        offset + (hi - lo[0] + TEXTURE_GAP)
    }
    /// Connectivity of the simulation mesh.
    ///
    /// # Errors
    /// Seams that make it non-manifold or turn a panel inside out.
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

/// Triangulates all panels. Edges have pieces by their length, equally many on both sides of a seam.
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
            let of_panel = Triangulation {
                edge_length: length(p),
                ..*how
            };
            let m = triangulate(p, n, &of_panel)?;
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
