//! A mesh made elsewhere as a garment: rest shape from its texture coordinates, or from its triangles as they are.

use crate::formats::sewn_obj::{SewnObj, Stitch};
use crate::garment::{GarmentError, GarmentKind, GarmentMesh, Material, Region, RenderMesh, Size};
use crate::math::P3;
use crate::mesh::{Face, Topology};

/// A mesh garment and where its vertices are in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedMesh {
    /// The garment, seams welded. It has no panels to place: it is worn where `positions` are.
    pub garment: GarmentMesh,
    /// Positions of the simulation vertices, metres: the middle of what is welded there.
    pub positions: Vec<P3>,
    /// Triangles that welding closed to a line; left out.
    pub closed: usize,
    /// Stitches left open because three and more layers meet there (pleats); the simulator needs a proper surface.
    pub open: usize,
    /// The rest shape is that of flat panels (texture coordinates in metres), not that of the triangles as they are.
    pub flat: bool,
}

/// Texture coordinates count as a flat rest shape when the median edge has its length in space within this share …
const SAME_SCALE: f64 = 0.05;
/// … and the quartiles have it within this one.
const ISOMETRIC: f64 = 0.25;
/// Rest triangles smaller than this are refused, m².
const SMALLEST: f64 = 1e-9;

/// Makes a garment of a mesh. Stitches within an edge are moved to its nearer end; those
/// that would join three layers along an edge are left open.
///
/// # Errors
/// Names the triangle without area, or the edge where welding makes the surface improper.
pub fn from_mesh(
    sewn: &SewnObj,
    name: &str,
    kind: GarmentKind,
    material: Material,
) -> Result<ImportedMesh, GarmentError> {
    let mesh = &sewn.obj.mesh;
    let topology = Topology::new(mesh)?;
    let (piece, pieces) = topology.components();
    let flat = flat_rest(sewn);
    let (welded, open) = weld_properly(mesh.vertices().len(), mesh.faces(), &sewn.stitches);
    let vertices = welded.iter().max().map_or(0, |m| *m as usize + 1);
    let mut sums = vec![(nalgebra::Vector3::<f32>::zeros(), 0.0f32); vertices];
    for (p, w) in mesh.vertices().iter().zip(&welded) {
        sums[*w as usize].0 += p.coords;
        sums[*w as usize].1 += 1.0;
    }
    let positions: Vec<P3> = sums.iter().map(|(s, n)| P3::from(s / n.max(1.0))).collect();
    let mut faces: Vec<Face> = Vec::new();
    let (mut rest, mut face_panel, mut loose) = (Vec::new(), Vec::new(), Vec::new());
    let mut closed = 0;
    for (i, f) in mesh.faces().iter().enumerate() {
        let w = f.map(|v| welded[v as usize]);
        if w[0] == w[1] || w[1] == w[2] || w[0] == w[2] {
            closed += 1;
            continue;
        }
        let t = match &flat {
            Some(flat) => flat[i],
            None => unfold(f.map(|v| mesh.vertices()[v as usize].cast::<f64>().coords)),
        };
        let area = crate::garment::mesh_area(&t);
        if !(area > SMALLEST) {
            return Err(GarmentError::Face {
                face: i,
                why: format!("its rest shape has an area of {area} m²"),
            });
        }
        faces.push(w);
        rest.push(t);
        face_panel.push(u16::try_from(piece[f[0] as usize]).unwrap_or(u16::MAX));
        loose.push(*f);
    }
    // Vertices that only closed triangles had stay unused: refuse them by name.
    let mut used = vec![false; vertices];
    faces
        .iter()
        .flatten()
        .for_each(|v| used[*v as usize] = true);
    if let Some(vertex) = used.iter().position(|u| !u) {
        return Err(GarmentError::Vertex {
            vertex,
            why: "no triangle is left around it".into(),
        });
    }
    let uv_of = |i: usize, k: usize| rest[i][k].map(|c: f64| c as f32);
    let mut uv = vec![[0.0; 2]; vertices];
    let mut corners = vec![Vec::new(); vertices];
    let mut render_uv = vec![[0.0; 2]; mesh.vertices().len()];
    for (i, f) in faces.iter().enumerate() {
        for k in 0..3 {
            let (w, l) = (f[k] as usize, loose[i][k] as usize);
            if corners[w].iter().all(|(p, _)| *p != face_panel[i]) {
                corners[w].push((face_panel[i], rest[i][k]));
            }
            uv[w] = uv_of(i, k);
            render_uv[l] = uv_of(i, k);
        }
    }
    let min_angle = rest.iter().map(smallest_angle).fold(180.0, f64::min);
    let seams = seam_pairs(&sewn.stitches, &welded);
    let garment = GarmentMesh {
        name: name.to_owned(),
        kind,
        size: Size::M,
        material,
        layer: u8::from(matches!(kind, GarmentKind::Top | GarmentKind::Dress)),
        vertices,
        faces,
        rest,
        face_panel,
        panels: (0..pieces).map(|k| format!("piece_{k}")).collect(),
        placements: vec![],
        corners,
        uv,
        regions: vec![Region::ALL; vertices],
        anchors: vec![],
        seams,
        render: RenderMesh {
            vertex: welded,
            uv: render_uv,
            faces: loose,
        },
        min_angle,
    };
    garment.topology()?;
    Ok(ImportedMesh {
        garment,
        positions,
        closed,
        open,
        flat: flat.is_some(),
    })
}

/// The texture coordinates are panels in metres: the rest shape is theirs.
pub fn panels_in_metres(sewn: &SewnObj) -> bool {
    flat_rest(sewn).is_some()
}

/// Rest triangles from texture coordinates, when these are panels in metres.
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
    ratio.sort_by(f64::total_cmp);
    let at = |share: usize| {
        ratio
            .get(ratio.len() * share / 100)
            .map(|r| (r - 1.0).abs())
    };
    (at(50)? < SAME_SCALE && at(25)? < ISOMETRIC && at(75)? < ISOMETRIC).then_some(rest)
}

/// A triangle laid flat: first edge along x.
pub(crate) fn unfold(p: [nalgebra::Vector3<f64>; 3]) -> [[f64; 2]; 3] {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    let x = a.norm().max(f64::MIN_POSITIVE);
    [[0.0; 2], [x, 0.0], [a.dot(&b) / x, a.cross(&b).norm() / x]]
}

fn smallest_angle(t: &[[f64; 2]; 3]) -> f64 {
    (0..3)
        .map(|k| {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
            (u[0] * v[1] - u[1] * v[0])
                .abs()
                .atan2(u[0] * v[0] + u[1] * v[1])
                .to_degrees()
        })
        .fold(180.0, f64::min)
}

/// Welds all stitches but those that make an edge with more than two faces, and says how many these are.
fn weld_properly(n: usize, faces: &[Face], stitches: &[Stitch]) -> (Vec<u32>, usize) {
    /// Rounds of taking stitches out; each opens every improper edge that is left.
    const ROUNDS: usize = 30;
    let mut active = stitches.to_vec();
    let mut welded = weld(n, &active);
    for _ in 0..ROUNDS {
        let mut uses: std::collections::BTreeMap<(u32, u32), [u32; 2]> =
            std::collections::BTreeMap::new();
        for f in faces {
            let w = f.map(|v| welded[v as usize]);
            if w[0] == w[1] || w[1] == w[2] || w[0] == w[2] {
                continue;
            }
            for k in 0..3 {
                let (a, b) = (w[k], w[(k + 1) % 3]);
                uses.entry((a.min(b), a.max(b))).or_default()[usize::from(a < b)] += 1;
            }
        }
        // A proper edge is used once in each direction.
        let bad: std::collections::BTreeSet<u32> = uses
            .iter()
            .filter(|(_, u)| u[0] > 1 || u[1] > 1)
            .flat_map(|((a, b), _)| [*a, *b])
            .collect();
        let before = active.len();
        let mut opened = std::collections::BTreeSet::new();
        // One stitch of each improper vertex a round, the last in the file.
        for k in (0..active.len()).rev() {
            let at = welded[active[k].vertex as usize];
            if bad.contains(&at) && opened.insert(at) {
                active.remove(k);
            }
        }
        if active.len() == before {
            break;
        }
        welded = weld(n, &active);
    }
    (welded, stitches.len() - active.len())
}

/// Consecutive numbers of vertices after welding each stitched vertex to the nearer end of its edge.
fn weld(n: usize, stitches: &[Stitch]) -> Vec<u32> {
    let mut root: Vec<u32> = (0..n as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for s in stitches {
        let end = if s.at < 0.5 { s.edge[0] } else { s.edge[1] };
        let (a, b) = (find(&mut root, s.vertex), find(&mut root, end));
        root[a.max(b) as usize] = a.min(b);
    }
    let mut label = vec![u32::MAX; n];
    let mut next = 0;
    (0..n as u32)
        .map(|i| {
            let r = find(&mut root, i) as usize;
            if label[r] == u32::MAX {
                label[r] = next;
                next += 1;
            }
            label[r]
        })
        .collect()
}

/// Neighbouring stitches as lines to draw.
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
    use crate::formats::sewn_obj::parse_sewn_obj;
    use std::path::Path;

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
    fn stitched_panels_become_one_surface_with_flat_rest() {
        let g = garment(SQUARES).expect("garment");
        assert_eq!(
            (g.garment.vertices, g.garment.faces.len(), g.closed),
            (6, 4, 0)
        );
        assert_eq!(g.garment.panels.len(), 2);
        let area: f64 = g.garment.rest.iter().map(crate::garment::mesh_area).sum();
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
        // Without texture coordinates the triangles keep the shape they have.
        let bare = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert!(
            (crate::garment::mesh_area(&garment(bare).expect("garment").garment.rest[0]) - 0.5)
                .abs()
                < 1e-9
        );
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
