//! Mesh garments: rest shape from texture coordinates in metres, or from the triangles in space.

use super::settings::ImportSettings;
use crate::flat_triangle::{rest_area, smallest_angle, unfold};
use crate::{GarmentError, GarmentKind, GarmentMesh, Material, Region, RenderMesh, Size};
use std::collections::BTreeSet;
use tryon_formats::sewn_obj::{SewnObj, Stitch};
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::mesh::{Face, Topology, TriMesh, UnionFind, sides};

/// Garment from a mesh, with the positions of its vertices in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedMesh {
    /// The garment, seams welded, without panels to place.
    pub garment: GarmentMesh,
    /// Positions of the simulation vertices, metres: means of the welded vertices.
    pub positions: Vec<P3>,
    /// Triangles that welding collapsed; left out.
    pub closed: usize,
    /// Stitches left open because three or more layers meet there (pleats): the simulator needs a manifold.
    pub open: usize,
    /// The rest shape is that of flat panels (texture coordinates in metres), not of the triangles in space.
    pub flat: bool,
}

/// Smallest area of a rest triangle, m²; smaller ones are refused.
const SMALLEST: f64 = 1e-9;
/// Iterations of opening stitches, one at each improper vertex.
const WELD_ITERATIONS: usize = 30;

/// Makes a garment of a mesh. A stitch within an edge moves to its nearer end; stitches that would join three layers
/// along an edge are left open.
///
/// # Errors
/// Names the triangle without area, or the edge at which welding makes the surface non-manifold.
pub fn from_mesh(
    sewn: &SewnObj,
    name: &str,
    kind: GarmentKind,
    material: Material,
) -> Result<ImportedMesh, GarmentError> {
    let mesh = &sewn.obj.mesh;
    let (piece, pieces) = Topology::new(mesh)?.components();
    let flat = flat_rest(sewn);
    let weld = Weld::new(mesh.vertices().len(), mesh.faces(), &sewn.stitches);
    let positions = weld.positions(mesh.vertices());
    let triangles = triangles(mesh, flat.as_deref(), &weld)?;
    let face_panel: Vec<u16> = triangles
        .loose
        .iter()
        .map(|f| u16::try_from(piece[f[0] as usize]).unwrap_or(u16::MAX))
        .collect();
    let mut uv = vec![[0.0; 2]; weld.vertices];
    let mut corners: Vec<Vec<(u16, [f64; 2])>> = vec![Vec::new(); weld.vertices];
    let mut render_uv = vec![[0.0; 2]; mesh.vertices().len()];
    for (i, f) in triangles.faces.iter().enumerate() {
        for k in 0..3 {
            let (w, l) = (f[k] as usize, triangles.loose[i][k] as usize);
            let rest = triangles.rest[i][k];
            if corners[w].iter().all(|(p, _)| *p != face_panel[i]) {
                corners[w].push((face_panel[i], rest));
            }
            uv[w] = rest.map(|c| c as f32);
            render_uv[l] = uv[w];
        }
    }
    let angles = triangles.rest.iter().map(smallest_angle);
    let garment = GarmentMesh {
        name: name.to_owned(),
        kind,
        size: Size::M,
        material,
        layer: u8::from(matches!(kind, GarmentKind::Top | GarmentKind::Dress)),
        vertices: weld.vertices,
        min_angle: angles.fold(180.0, f64::min),
        faces: triangles.faces,
        rest: triangles.rest,
        face_panel,
        panels: (0..pieces).map(|k| format!("piece_{k}")).collect(),
        placements: vec![],
        corners,
        uv,
        regions: vec![Region::ALL; weld.vertices],
        anchors: vec![],
        seams: seam_pairs(&sewn.stitches, &weld.number),
        render: RenderMesh {
            vertex: weld.number,
            uv: render_uv,
            faces: triangles.loose,
            trims: vec![],
        },
    };
    garment.topology()?;
    Ok(ImportedMesh {
        garment,
        positions,
        closed: triangles.closed,
        open: weld.open,
        flat: flat.is_some(),
    })
}

/// Triangles after welding.
struct Triangles {
    /// Over welded vertices, and over those of the file.
    faces: Vec<Face>,
    loose: Vec<Face>,
    rest: Vec<[[f64; 2]; 3]>,
    /// Triangles that welding collapsed.
    closed: usize,
}

/// Triangles that welding leaves, with their rest shapes: from `flat` if given, else unfolded from space.
fn triangles(
    mesh: &TriMesh,
    flat: Option<&[[[f64; 2]; 3]]>,
    weld: &Weld,
) -> Result<Triangles, GarmentError> {
    let mut out = Triangles {
        faces: Vec::new(),
        loose: Vec::new(),
        rest: Vec::new(),
        closed: 0,
    };
    for (face, f) in mesh.faces().iter().enumerate() {
        let Some(w) = weld.face(f) else {
            out.closed += 1;
            continue;
        };
        let t = match flat {
            Some(flat) => flat[face],
            None => unfold(f.map(|v| mesh.vertices()[v as usize].cast::<f64>().coords)),
        };
        let area = rest_area(&t);
        if !(area > SMALLEST) {
            let why = format!("its rest shape has an area of {area} m²");
            return Err(GarmentError::Face { face, why });
        }
        out.faces.push(w);
        out.rest.push(t);
        out.loose.push(*f);
    }
    // A vertex of collapsed triangles only stays unused: an error names it.
    let mut used = vec![false; weld.vertices];
    for v in out.faces.iter().flatten() {
        used[*v as usize] = true;
    }
    match used.iter().position(|u| !u) {
        None => Ok(out),
        Some(vertex) => Err(GarmentError::Vertex {
            vertex,
            why: "no triangle is left around it".into(),
        }),
    }
}

/// True if the texture coordinates are panels in metres.
pub fn panels_in_metres(sewn: &SewnObj) -> bool {
    flat_rest(sewn).is_some()
}

/// Rest triangles from texture coordinates that are panels in metres.
fn flat_rest(sewn: &SewnObj) -> Option<Vec<[[f64; 2]; 3]>> {
    let o = &sewn.obj;
    if o.face_uv.is_empty() {
        return None;
    }
    let rest: Vec<[[f64; 2]; 3]> = o
        .face_uv
        .iter()
        .map(|f| f.map(|t| o.uv[t as usize].map(f64::from)))
        .collect();
    let mut ratio: Vec<f64> = o
        .mesh
        .faces()
        .iter()
        .zip(&rest)
        .map(|(f, t)| {
            let p = f.map(|v| o.mesh.vertices()[v as usize].cast::<f64>());
            (t[1][0] - t[0][0]).hypot(t[1][1] - t[0][1])
                / (p[1] - p[0]).norm().max(f64::MIN_POSITIVE)
        })
        .collect();
    let settings = ImportSettings::default();
    let [scale, isometric] = [settings.same_scale, settings.isometric];
    let mut at = |share| percentile(&mut ratio, share).map(|r| (r - 1.0).abs());
    (at(50)? < scale && at(25)? < isometric && at(75)? < isometric).then_some(rest)
}

/// Vertices welded along stitches.
struct Weld {
    /// Welded vertex of each vertex of the file.
    number: Vec<u32>,
    /// Welded vertices.
    vertices: usize,
    /// Stitches left open.
    open: usize,
}

impl Weld {
    /// Welds all stitches but those that give an edge more than two faces.
    fn new(n: usize, faces: &[Face], stitches: &[Stitch]) -> Self {
        let mut active = stitches.to_vec();
        let mut weld = Self::along(n, &active);
        for _ in 0..WELD_ITERATIONS {
            let improper = weld.improper(faces);
            let before = active.len();
            let mut opened = BTreeSet::new();
            // One stitch of each improper vertex, the last in the file.
            for k in (0..active.len()).rev() {
                let at = weld.number[active[k].vertex as usize];
                if improper.contains(&at) && opened.insert(at) {
                    active.remove(k);
                }
            }
            if active.len() == before {
                break;
            }
            weld = Self::along(n, &active);
        }
        weld.open = stitches.len() - active.len();
        weld
    }
    /// Welds each stitched vertex to the nearer end of its edge.
    fn along(n: usize, stitches: &[Stitch]) -> Self {
        let mut sets = UnionFind::new(n);
        for s in stitches {
            sets.join(s.vertex, if s.at < 0.5 { s.edge[0] } else { s.edge[1] });
        }
        let (number, vertices) = sets.number();
        Self {
            number,
            vertices,
            open: 0,
        }
    }
    /// Face over welded vertices; `None` if it collapses.
    fn face(&self, f: &Face) -> Option<Face> {
        let w = f.map(|v| self.number[v as usize]);
        (w[0] != w[1] && w[1] != w[2] && w[0] != w[2]).then_some(w)
    }
    /// Ends of edges that are used twice in one direction.
    fn improper(&self, faces: &[Face]) -> BTreeSet<u32> {
        let welded = faces.iter().filter_map(|f| self.face(f));
        let mut all: Vec<[u32; 2]> = welded.flat_map(|f| sides(&f)).collect();
        all.sort_unstable();
        let repeated = all.windows(2).filter(|w| w[0] == w[1]);
        repeated.flat_map(|w| w[0]).collect()
    }
    /// Mean position of the vertices of each welded vertex, metres.
    fn positions(&self, vertices: &[P3]) -> Vec<P3> {
        let mut sums = vec![(nalgebra::Vector3::<f32>::zeros(), 0.0f32); self.vertices];
        for (p, w) in vertices.iter().zip(&self.number) {
            sums[*w as usize].0 += p.coords;
            sums[*w as usize].1 += 1.0;
        }
        sums.iter().map(|(s, n)| P3::from(s / n.max(1.0))).collect()
    }
}

/// Pairs of neighbouring stitches, for rendering.
fn seam_pairs(stitches: &[Stitch], welded: &[u32]) -> Vec<[u32; 2]> {
    let at: Vec<u32> = stitches.iter().map(|s| welded[s.vertex as usize]).collect();
    at.windows(2)
        .filter(|w| w[0] != w[1])
        .map(|w| [w[0], w[1]])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use tryon_formats::sewn_obj::parse_sewn_obj;

    fn garment(text: &str) -> Result<ImportedMesh, GarmentError> {
        let o = parse_sewn_obj(text, Path::new("g.obj")).expect("an OBJ");
        from_mesh(
            &o,
            "g",
            GarmentKind::Skirt,
            Material::preset("cotton").expect("preset"),
        )
    }

    /// Two unit squares beside each other, texture coordinates as in space.
    const SQUARES: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 .1\nv 2 0 .1\nv 2 1 .1\nv 1 1 .1\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 5 0\nvt 6 0\nvt 6 1\nvt 5 1\n\
        f 1/1 2/2 3/3 4/4\nf 5/5 6/6 7/7 8/8\nstitch 4 1 2 0\nstitch 7 1 2 0.9\n";

    #[test]
    fn stitched_panels_weld_to_one_surface_with_flat_rest() {
        let g = garment(SQUARES).expect("garment");
        assert_eq!(
            (g.garment.vertices, g.garment.faces.len(), g.closed),
            (6, 4, 0)
        );
        assert_eq!(g.garment.panels.len(), 2);
        let area: f64 = g.garment.rest.iter().map(rest_area).sum();
        assert!((area - 2.0).abs() < 1e-9);
        assert!(
            (g.positions[1].z - 0.05).abs() < 1e-6,
            "welded vertices meet in the middle"
        );
    }

    #[test]
    fn faults_name_triangle_and_edge() {
        let flat = SQUARES.replace("vt 1 1\nvt 0 1", "vt 1 0\nvt 0 0");
        assert!(matches!(
            garment(&flat),
            Err(GarmentError::Face { face: 0, .. })
        ));
        // Without texture coordinates the triangles in space are the rest shape.
        let bare = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert!((rest_area(&garment(bare).expect("garment").garment.rest[0]) - 0.5).abs() < 1e-9);
        // A third face on an edge.
        let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n";
        let o = parse_sewn_obj(three, Path::new("g.obj")).expect("an OBJ");
        let e = from_mesh(
            &o,
            "g",
            GarmentKind::Top,
            Material::preset("cotton").expect("preset"),
        )
        .expect_err("edge");
        assert!(e.to_string().contains("edge (0, 1)"), "{e}");
    }
}
