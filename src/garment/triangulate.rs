//! A flat panel to triangles: constrained Delaunay over boundary samples and a hexagonal lattice.

use super::{GarmentError, Panel};
use crate::mesh::Csr;
use crate::mesh::smoothing::mean;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

/// Triangles of one panel. Boundary vertices come first, in the order of the outline.
pub(super) struct PanelMesh {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) faces: Vec<[u32; 3]>,
    /// For each edge: indices of its points from corner to corner, both included.
    pub(super) edges: Vec<Vec<u32>>,
    /// Smallest angle, degrees.
    pub(super) min_angle: f64,
}

/// Lattice points nearer to the outline than this share of the edge length are left out: at 0.55 the triangles along
/// the edge stay between a slim and a flat one.
const CLEARANCE: f64 = 0.58;
/// Triangles flatter than this (height over length) are rounding slivers outside a straight edge.
const FLAT: f64 = 1e-6;
/// Rounds of moving inner points to the middle of their neighbours.
const SMOOTHING: usize = 4;

pub(super) fn triangulate(
    panel: &Panel,
    pieces: &[usize],
    length: f64,
) -> Result<PanelMesh, GarmentError> {
    let fault = |why: String| GarmentError::Panel {
        panel: panel.name.clone(),
        why,
    };
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut edges = Vec::new();
    for (i, e) in panel.edges.iter().enumerate() {
        let samples = e.sample(panel.end(i), pieces[i]);
        let first = points.len() as u32;
        points.extend_from_slice(&samples[..samples.len() - 1]);
        edges.push((first..first + pieces[i] as u32 + 1).collect::<Vec<u32>>());
    }
    let boundary = points.len();
    if let Some(last) = edges.last_mut().and_then(|e| e.last_mut()) {
        *last = 0;
    }
    let outline = points.clone();
    let (lo, hi) = outline
        .iter()
        .fold(([f64::MAX; 2], [f64::MIN; 2]), |(lo, hi), p| {
            (
                [lo[0].min(p[0]), lo[1].min(p[1])],
                [hi[0].max(p[0]), hi[1].max(p[1])],
            )
        });
    let step_y = length * 3f64.sqrt() / 2.0;
    // Centred on x = 0, so that symmetric panels get symmetric triangles.
    let columns = ((hi[0].abs().max(lo[0].abs())) / length).ceil() as i64 + 1;
    let rows = ((hi[1] - lo[1]) / step_y).ceil() as i64 + 1;
    for r in 0..rows {
        for c in -columns..=columns {
            let p = [
                (c as f64 + if r % 2 == 0 { 0.0 } else { 0.5 }) * length,
                lo[1] + (r as f64 + 0.5) * step_y,
            ];
            if inside(&outline, p) && distance(&outline, p) > CLEARANCE * length {
                points.push(p);
            }
        }
    }
    let mut faces = Vec::new();
    for round in 0..=SMOOTHING {
        faces = delaunay(&points, boundary, &outline).map_err(fault)?;
        if round == SMOOTHING {
            break;
        }
        let pairs: Vec<(u32, u32)> = faces
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (a, c), (b, c), (b, a), (c, a), (c, b)])
            .collect();
        let around = Csr::from_pairs(points.len(), &pairs);
        let middle = |i| mean(around.row(i).iter().map(|n| &points[*n as usize]));
        let moved: Vec<_> = (boundary..points.len()).map(middle).collect();
        for (p, to) in points[boundary..].iter_mut().zip(moved) {
            *p = to.unwrap_or(*p);
        }
    }
    let min_angle = faces
        .iter()
        .map(|f| smallest_angle(f.map(|i| points[i as usize])))
        .fold(180.0, f64::min);
    let mut used = vec![false; points.len()];
    faces
        .iter()
        .flatten()
        .for_each(|&i| used[i as usize] = true);
    if let Some(vertex) = used.iter().position(|u| !u) {
        return Err(fault(format!(
            "point {vertex} of its triangulation has no triangle; the edge length is too coarse"
        )));
    }
    Ok(PanelMesh {
        points,
        faces,
        edges,
        min_angle,
    })
}

fn delaunay(
    points: &[[f64; 2]],
    boundary: usize,
    outline: &[[f64; 2]],
) -> Result<Vec<[u32; 3]>, String> {
    let vertices = points.iter().map(|p| Point2::new(p[0], p[1])).collect();
    let edges = (0..boundary).map(|i| [i, (i + 1) % boundary]).collect();
    let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::bulk_load_cdt(vertices, edges)
        .map_err(|e| format!("it cannot be triangulated: {e}"))?;
    if cdt.num_vertices() != points.len() {
        return Err("two points of its outline coincide".into());
    }
    let mut faces: Vec<[u32; 3]> = cdt
        .inner_faces()
        .map(|f| f.vertices().map(|v| v.fix().index() as u32))
        .filter(|f| {
            let c = f.map(|i| points[i as usize]);
            // Samples of a straight edge are collinear but for rounding: the slivers between them and the hull lie outside.
            super::mesh_area(&c)
                > FLAT * (c[1][0] - c[0][0]).powi(2).max((c[1][1] - c[0][1]).powi(2))
                && inside(
                    outline,
                    [
                        (c[0][0] + c[1][0] + c[2][0]) / 3.0,
                        (c[0][1] + c[1][1] + c[2][1]) / 3.0,
                    ],
                )
        })
        .collect();
    faces.sort_unstable();
    Ok(faces)
}

fn inside(outline: &[[f64; 2]], p: [f64; 2]) -> bool {
    let mut odd = false;
    for i in 0..outline.len() {
        let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]
        {
            odd = !odd;
        }
    }
    odd
}

fn distance(outline: &[[f64; 2]], p: [f64; 2]) -> f64 {
    (0..outline.len())
        .map(|i| {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            let d = [b[0] - a[0], b[1] - a[1]];
            let t = ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1])
                / (d[0] * d[0] + d[1] * d[1]).max(f64::MIN_POSITIVE);
            let t = t.clamp(0.0, 1.0);
            (p[0] - a[0] - t * d[0]).hypot(p[1] - a[1] - t * d[1])
        })
        .fold(f64::MAX, f64::min)
}

fn smallest_angle(p: [[f64; 2]; 3]) -> f64 {
    (0..3)
        .map(|k| {
            let (a, b, c) = (p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
            let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
            (u[0] * v[1] - u[1] * v[0])
                .abs()
                .atan2(u[0] * v[0] + u[1] * v[1])
                .to_degrees()
        })
        .fold(180.0, f64::min)
}
