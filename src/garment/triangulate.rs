//! Triangulation of a flat panel: constrained Delaunay over boundary samples and a hexagonal lattice.

use super::flat_triangle::{rest_area, smallest_angle};
use super::{GarmentError, Panel};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use tryon_geometry::mesh::Csr;
use tryon_geometry::mesh::smoothing::mean;
use tryon_geometry::settings;

settings! {
    /// Settings of the triangulation. 21 mm gives a T-shirt or a skirt about 2,000 vertices; the panels of the library stay
    /// above 20°.
    pub struct Triangulation {
        /// Target edge length, metres.
        pub edge_length: f64 = 0.021,
        /// Longest edges of a hood, metres: longer ones do not resolve the folds of a hood worn down.
        pub hood_length: f64 = 0.014,
        /// Smallest angle of a panel, degrees; a panel with a smaller one is refused.
        pub min_angle: f64 = 12.0,
        /// Least distance of lattice points from the outline, edge lengths: with 0.55 the triangles along the edge stay between a
        /// slim and a flat one.
        pub clearance: f64 = 0.58,
        /// Iterations of Laplacian smoothing of inner points. Fewer leave slim triangles.
        pub smoothing: usize = 4,
    }
}

impl Triangulation {
    /// Shortest and longest edge length, metres.
    const LENGTHS: [f64; 2] = [0.001, 0.5];

    pub(super) fn check(&self) -> Result<(), GarmentError> {
        let [least, most] = Self::LENGTHS;
        for (field, length) in [
            ("edge_length", self.edge_length),
            ("hood_length", self.hood_length),
        ] {
            if !(length > least && length < most) {
                return Err(GarmentError::Field {
                    field: field.into(),
                    why: format!("{length} m is not between {least} and {most}"),
                });
            }
        }
        Ok(())
    }
}

/// Triangles of one panel. Boundary vertices come first, in the order of the outline.
pub(super) struct PanelMesh {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Points of each edge from corner to corner, both included.
    pub(super) edges: Vec<Vec<u32>>,
    /// Smallest angle, degrees.
    pub(super) min_angle: f64,
}

/// Height over length below which a triangle is a rounding sliver outside a straight edge.
const FLAT: f64 = 1e-6;
/// Triangulates a panel with `pieces` segments on each edge.
///
/// # Errors
/// Names the panel: coinciding points, or a point without a triangle.
pub(super) fn triangulate(
    panel: &Panel,
    pieces: &[usize],
    how: &Triangulation,
) -> Result<PanelMesh, GarmentError> {
    let fault = |why: String| GarmentError::Panel {
        panel: panel.name.clone(),
        why,
    };
    let (outline, edges) = boundary(panel, pieces);
    let mut points = outline.clone();
    points.extend(lattice(&outline, how));
    for _ in 0..how.smoothing {
        let faces = delaunay(&points, &outline).map_err(fault)?;
        smooth(&mut points, &faces, outline.len());
    }
    let faces = delaunay(&points, &outline).map_err(fault)?;
    let angles = faces
        .iter()
        .map(|f| smallest_angle(&f.map(|i| points[i as usize])));
    let min_angle = angles.fold(180.0, f64::min);
    let mut used = vec![false; points.len()];
    for &i in faces.iter().flatten() {
        used[i as usize] = true;
    }
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

/// Samples of the outline, and the point numbers of each edge.
fn boundary(panel: &Panel, pieces: &[usize]) -> (Vec<[f64; 2]>, Vec<Vec<u32>>) {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut edges: Vec<Vec<u32>> = Vec::new();
    for (i, e) in panel.edges.iter().enumerate() {
        let samples = e.sample(panel.end(i), pieces[i]);
        let first = points.len() as u32;
        points.extend_from_slice(&samples[..samples.len() - 1]);
        edges.push((first..first + pieces[i] as u32 + 1).collect());
    }
    if let Some(last) = edges.last_mut().and_then(|e| e.last_mut()) {
        *last = 0;
    }
    (points, edges)
}

/// Hexagonal lattice inside the outline, centred on x = 0 so that symmetric panels get symmetric triangles.
fn lattice(outline: &[[f64; 2]], how: &Triangulation) -> Vec<[f64; 2]> {
    let length = how.edge_length;
    let side = |k: usize| {
        let coordinates = outline.iter().map(move |p| p[k]);
        let lo = coordinates.clone().fold(f64::MAX, f64::min);
        (lo, coordinates.fold(f64::MIN, f64::max))
    };
    let ((left, right), (bottom, top)) = (side(0), side(1));
    let step_y = length * 3f64.sqrt() / 2.0;
    let columns = (right.abs().max(left.abs()) / length).ceil() as i64 + 1;
    let rows = ((top - bottom) / step_y).ceil() as i64 + 1;
    let mut points = Vec::new();
    for r in 0..rows {
        for c in -columns..=columns {
            let p = [
                (c as f64 + if r % 2 == 0 { 0.0 } else { 0.5 }) * length,
                bottom + (r as f64 + 0.5) * step_y,
            ];
            if inside(outline, p) && distance(outline, p) > how.clearance * length {
                points.push(p);
            }
        }
    }
    points
}

/// Moves inner points to the mean of their neighbours.
fn smooth(points: &mut [[f64; 2]], faces: &[[u32; 3]], boundary: usize) {
    let pairs: Vec<(u32, u32)> = faces
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (a, c), (b, c), (b, a), (c, a), (c, b)])
        .collect();
    let neighbours = Csr::from_pairs(points.len(), &pairs);
    let middle = |i| mean(neighbours.row(i).iter().map(|n| &points[*n as usize]));
    let moved: Vec<_> = (boundary..points.len()).map(middle).collect();
    for (p, to) in points[boundary..].iter_mut().zip(moved) {
        *p = to.unwrap_or(*p);
    }
}

/// Constrained Delaunay triangles inside the outline, sorted; the outline is the start of `points`.
fn delaunay(points: &[[f64; 2]], outline: &[[f64; 2]]) -> Result<Vec<[u32; 3]>, String> {
    let boundary = outline.len();
    let vertices = points.iter().map(|p| Point2::new(p[0], p[1])).collect();
    let edges = (0..boundary).map(|i| [i, (i + 1) % boundary]).collect();
    let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::bulk_load_cdt(vertices, edges)
        .map_err(|e| format!("it cannot be triangulated: {e}"))?;
    if cdt.num_vertices() != points.len() {
        return Err("two points of its outline coincide".into());
    }
    let is_inside = |f: &[u32; 3]| {
        let c = f.map(|i| points[i as usize]);
        let longer = (c[1][0] - c[0][0]).powi(2).max((c[1][1] - c[0][1]).powi(2));
        let middle = [0, 1].map(|k| (c[0][k] + c[1][k] + c[2][k]) / 3.0);
        // Samples of a straight edge are collinear but for rounding: slivers between them and the hull lie outside.
        rest_area(&c) > FLAT * longer && inside(outline, middle)
    };
    let mut faces: Vec<[u32; 3]> = cdt
        .inner_faces()
        .map(|f| f.vertices().map(|v| v.fix().index() as u32))
        .filter(is_inside)
        .collect();
    faces.sort_unstable();
    Ok(faces)
}

/// Even–odd test of a point against a closed outline.
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

/// Distance of a point from a closed outline, metres.
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
