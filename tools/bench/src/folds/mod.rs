//! Folds of drawn garments against the offline solver's in the same pose: energy, direction and places in pattern space.

pub mod band;
pub mod comparison;
mod curved;
mod drapes;
pub mod pattern_grid;
pub mod poses;

use super::{EvaluateError, Row, Table};
use band::{FoldBand, FoldCell, NormalField};
use comparison::FoldComparison;
use curved::curved;
use drapes::{FoldBody, OfflineRest, rest_file};
use pattern_grid::{CELL, PanelGrid};
use poses::FoldPose;
use std::path::PathBuf;
use std::time::Instant;
use tryon::mirror::{DrawnLook, DressedOutfit, library_appearance};
use tryon::view::{Appearance, DrawnPoint, GarmentView, drawn_normals};
use tryon_garment::GarmentMesh;
use tryon_geometry::math::P3;

/// Extent of the comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct FoldsBench {
    /// Garments of the library.
    pub garments: Vec<String>,
    /// Poses of the embedded body.
    pub poses: Vec<FoldPose>,
    /// Vertices of the offline solver's mesh, about.
    pub vertices: usize,
    /// Folder of the offline solver's meshes at rest, which are read if they are there and written otherwise.
    pub truth: Option<PathBuf>,
}

/// Garments judged: top, heavy top, flare, legs.
pub const GARMENTS: [&str; 4] = ["tshirt", "hoodie", "skirt", "trousers"];

/// Folds of a garment drawn at these vertices (drawn mesh, metres), and the time of its normals (ms).
fn folds(
    garment: &GarmentMesh,
    vertices: &[P3],
    appearance: &Appearance,
) -> (Vec<Option<FoldCell>>, f64) {
    let view = GarmentView {
        vertices,
        faces: &garment.render.faces,
        uv: &garment.render.uv,
        normals: &[],
        places: &[],
        appearance,
    };
    let (mut cells, mut ms) = (Vec::new(), 0.0);
    for grid in PanelGrid::of(garment) {
        let points: Vec<DrawnPoint> = grid.points.iter().flatten().copied().collect();
        let started = Instant::now();
        let mut normals = drawn_normals(&view, &points, CELL).into_iter();
        ms += started.elapsed().as_secs_f64() * 1e3;
        let field = NormalField {
            width: grid.width,
            normals: grid
                .points
                .iter()
                .map(|p| p.and_then(|_| normals.next()))
                .collect(),
        };
        cells.extend(field.folds(FoldBand::WRINKLES));
    }
    (cells, ms)
}

/// Rows of a garment: drawn smooth, on curved patches, and as it is drawn.
fn rows(scene: &str, worn: &DressedOutfit, truth: &OfflineRest) -> Result<Vec<Row>, EvaluateError> {
    let sheet = Appearance::default();
    let fine = &truth.outfit.garments()[0];
    let drawn = &truth.outfit.drawn_positions(&truth.positions)[0];
    let (truth_cells, _) = folds(fine, drawn, &sheet);

    let garment = &worn.model.outfit.garments[0];
    let positions = &worn.state.garments[0].positions;
    let (finer, curved) = curved(garment, positions).map_err(|e| EvaluateError::new(scene, e))?;
    let look = library_appearance(&garment.name);
    let cloth = DrawnLook::of(&garment.render, &garment.material.name, look).appearance;
    let methods = [
        ("mesh", garment, positions, &sheet),
        ("curved patches", &finer, &curved, &sheet),
        ("as drawn", garment, positions, &cloth),
    ];
    let settled = truth
        .is_settled
        .map_or("read".to_owned(), |is| is.to_string());
    let row =
        |(method, mesh, positions, appearance): (&str, &GarmentMesh, &Vec<P3>, &Appearance)| {
            let mut drawn = Vec::new();
            mesh.render_positions(positions, &mut drawn);
            let (cells, ms) = folds(mesh, &drawn, appearance);
            let row = Row::new(scene, method, ms)
                .with("vertices", mesh.vertices)
                .with("truth_vertices", fine.vertices)
                .with("settled", &settled);
            FoldComparison::of(&cells, &truth_cells).add_to(row)
        };
    Ok(methods.map(row).into())
}

/// Measures every garment in every pose; `progress` receives the rows of each. A garment that the offline solver cannot take
/// over is a row with its fault.
///
/// # Errors
/// A garment that is not known or cannot be worn; a folder or file that cannot be read or written.
pub fn measure_folds(
    bench: &FoldsBench,
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    if let Some(folder) = &bench.truth {
        std::fs::create_dir_all(folder).map_err(|e| EvaluateError::new(folder.display(), e))?;
    }
    let body = FoldBody::new();
    let mut table = Table::new("folds", "normals of all cells");
    for garment in &bench.garments {
        for pose in &bench.poses {
            let scene = format!("{garment}, {}", pose.name());
            let worn = body.wear(garment, *pose)?;
            let file = bench.truth.as_ref();
            let file = file.map(|folder| rest_file(folder, garment, *pose, bench.vertices));
            let found = match body.rest(&worn, bench.vertices, file.as_deref()) {
                Ok(truth) => rows(&scene, &worn, &truth)?,
                Err(fault) => vec![Row::new(&scene, fault.to_string(), f64::NAN)],
            };
            found.iter().for_each(&mut progress);
            table.rows.extend(found);
        }
    }
    Ok(table)
}
