//! Regular grids over the panels of a garment, in pattern space: the same cells for every triangulation of a panel.

use tryon::view::DrawnPoint;
use tryon_garment::GarmentMesh;

/// Side of a cell (m): a third of the shortest fold, and a pixel at 1.5 m.
pub const CELL: f32 = 3e-3;

/// Points of the drawn mesh at the centres of a panel's cells.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelGrid {
    /// Cells in a row.
    pub width: usize,
    /// Rows of cells along v, shape `[height · width]`; `None` beside the panel.
    pub points: Vec<Option<DrawnPoint>>,
}

/// Cells between two texture coordinates (m), the end excluded.
fn cells(low: f32, high: f32) -> [i64; 2] {
    [
        (low / CELL).floor() as i64,
        (high / CELL).floor() as i64 + 1,
    ]
}

/// Barycentric coordinates of a point; `None` outside or of a collapsed triangle.
fn weights([a, b, c]: [[f32; 2]; 3], p: [f32; 2]) -> Option<[f32; 3]> {
    let cross = |o: [f32; 2], x: [f32; 2], y: [f32; 2]| {
        (x[0] - o[0]) * (y[1] - o[1]) - (x[1] - o[1]) * (y[0] - o[0])
    };
    let area = cross(a, b, c);
    let w = [cross(p, b, c), cross(p, c, a), cross(p, a, b)].map(|w| w / area);
    (area != 0.0 && w.iter().all(|w| *w >= 0.0)).then_some(w)
}

impl PanelGrid {
    /// Grids of all panels of a garment.
    pub fn of(garment: &GarmentMesh) -> Vec<Self> {
        let panels = 0..garment.panels.len();
        panels.map(|k| Self::of_panel(garment, k)).collect()
    }

    fn of_panel(garment: &GarmentMesh, panel: usize) -> Self {
        let drawn = &garment.render;
        let faces = drawn.faces.iter().zip(&garment.face_panel).enumerate();
        let faces = faces.filter(|(_, (_, own))| usize::from(**own) == panel);
        let faces: Vec<(u32, [[f32; 2]; 3])> = faces
            .map(|(id, (f, _))| (id as u32, f.map(|v| drawn.uv[v as usize])))
            .collect();
        let corners = || faces.iter().flat_map(|(_, f)| f);
        let range = |k: usize| {
            let low = corners().map(|c| c[k]).fold(f32::INFINITY, f32::min);
            let high = corners().map(|c| c[k]).fold(f32::NEG_INFINITY, f32::max);
            cells(low, high)
        };
        let [columns, rows] = [0, 1].map(range);
        let width = (columns[1] - columns[0]).max(0) as usize;
        let height = (rows[1] - rows[0]).max(0) as usize;
        let mut points = vec![None; width * height];
        for (face, corners) in &faces {
            let [own_columns, own_rows] = [0, 1].map(|k| {
                let along = corners.map(|c| c[k]);
                let low = along.into_iter().fold(f32::INFINITY, f32::min);
                cells(low, along.into_iter().fold(f32::NEG_INFINITY, f32::max))
            });
            for y in own_rows[0]..own_rows[1] {
                for x in own_columns[0]..own_columns[1] {
                    let centre = [x, y].map(|i| (i as f32 + 0.5) * CELL);
                    let cell = (y - rows[0]) as usize * width + (x - columns[0]) as usize;
                    if let Some(weights) = weights(*corners, centre) {
                        points[cell] = Some(DrawnPoint {
                            face: *face,
                            weights,
                        });
                    }
                }
            }
        }
        Self { width, points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{GarmentSubdivision, Size, Triangulation, library};

    #[test]
    fn two_triangulations_of_a_panel_have_the_same_cells() {
        let pattern = library::pattern("tank", Size::M).expect("a pattern");
        let coarse = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let fine = GarmentSubdivision::new(&coarse).mesh;
        let [a, b] = [&coarse, &fine].map(PanelGrid::of);
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            assert_eq!((a.width, a.points.len()), (b.width, b.points.len()));
            let count = |g: &PanelGrid| g.points.iter().flatten().count() as f32;
            assert!(count(a) > 1000.0 && (count(a) - count(b)).abs() < 3.0);
        }
    }
}
