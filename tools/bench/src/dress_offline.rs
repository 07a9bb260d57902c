//! The sewn dress of Codim-IPC on its dancing body by the offline solver: time, work and intersections of each frame.

use super::dance_bodies::{DanceBodies, fault};
use super::sewn_sheet::SewnSheet;
use super::{EvaluateError, Row, Table};
use nalgebra::Vector2;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use tryon_cloth::contact::{ContactMesh, ContactSurface};
use tryon_cloth::elastic::RestSheet;
use tryon_cloth::fine::{
    DrapeSettings, FrameTargets, JoinedSurfaces, MotionState, NewtonReport, OfflineCloth,
    OfflineSettings, OfflineSolver, OfflineState, StitchSprings,
};
use tryon_formats::obj::read_obj;
use tryon_formats::sewn_obj::read_sewn_obj;
use tryon_garment::Material;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::par::Par;

/// Panels as cut with their stitches, and the same vertices draped on the standing body, 0.75 m below the dance.
const FILES: [&str; 2] = ["dress_knife/stage.obj", "dress_knife/drape.obj"];
const BELOW: f64 = 0.75;
/// Fabric; C-IPC's dresses are of cotton too.
const FABRIC: &str = "cotton";
/// Stiffness of a stitch (N/m): about that of cotton's membrane, so that seams give as the cloth does.
const STITCH: f64 = 1e3;
/// Time between frames (s).
const FRAME: f64 = 1.0 / 30.0;

/// The dress, draped, and the dance.
pub struct DressScene {
    sheet: SewnSheet,
    bodies: DanceBodies,
}

/// Extent of the measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DressBench {
    /// Vertices of the dress; no fewer than the file has.
    pub vertices: usize,
    /// Frames of 1/30 s.
    pub frames: usize,
    /// Solver; friction is the fabric's.
    pub settings: OfflineSettings,
}

fn vectors(points: &[P3]) -> Vec<V3d> {
    points.iter().map(|p| p.coords.cast()).collect()
}

impl DressScene {
    /// Reads dress and dance of `folder`, and divides the dress.
    ///
    /// # Errors
    /// A file that is missing or does not fit the others.
    pub fn load(folder: &Path, vertices: usize) -> Result<Self, EvaluateError> {
        let [stage, drape] = FILES.map(|f| folder.join(f));
        let panels = read_sewn_obj(&stage).map_err(fault)?;
        let draped = read_obj(&drape).map_err(fault)?;
        let count = panels.obj.mesh.vertices().len();
        let places =
            draped.mesh.vertices().get(..count).ok_or_else(|| {
                fault(format!("{}: fewer than {count} vertices", drape.display()))
            })?;
        let mut flat = vec![Vector2::zeros(); count];
        for (face, corners) in panels.obj.mesh.faces().iter().zip(&panels.obj.face_uv) {
            for (v, c) in face.iter().zip(corners) {
                flat[*v as usize] = Vector2::from(panels.obj.uv[*c as usize]).cast();
            }
        }
        let above = V3d::new(0.0, BELOW, 0.0);
        let mut sheet = SewnSheet {
            faces: panels.obj.mesh.faces().to_vec(),
            flat,
            x: vectors(places).iter().map(|p| p + above).collect(),
            stitches: panels.stitches,
        };
        sheet.divide(vertices);
        let bodies = DanceBodies::read(folder)?;
        Ok(Self { sheet, bodies })
    }

    /// Drapes the dress on the standing body, then simulates the dance from there; `progress` receives the row of each.
    ///
    /// # Errors
    /// A start that intersects, a step that is not solved.
    pub fn run(
        &self,
        bench: &DressBench,
        par: Par,
        mut progress: impl FnMut(Row),
    ) -> Result<(), EvaluateError> {
        let material = Material::preset(FABRIC).map_err(fault)?;
        let cloth = self.cloth(&material)?;
        let body = vectors(&self.bodies.at(0.0));
        let faces = self.bodies.mesh.faces();
        let obstacle = ContactSurface {
            vertices: body.len(),
            faces,
        };
        let mesh = cloth.contact_mesh(obstacle).map_err(fault)?;
        let state = start(&mesh, &self.sheet.x, body, par)?;
        let mut settings = bench.settings;
        if let Some(contact) = &mut settings.contact {
            contact.friction = material.friction;
        }
        let mut solver = OfflineSolver::new(&cloth, faces, state, settings, par).map_err(fault)?;
        let measured = |method: &str, started: Instant, solver: &OfflineSolver<'_>| {
            let ms = started.elapsed().as_secs_f64() * 1e3;
            let state = solver.state();
            let all = state.now.x.iter().chain(&state.obstacle[0]).copied();
            let crossings = JoinedSurfaces(&mesh).crossings(par, &all.collect::<Vec<V3d>>());
            Row::new("dress", method, ms)
                .with("vertices", cloth.len())
                .error("intersections", crossings.len() as f64)
        };
        let started = Instant::now();
        let work = solver
            .drape(&DrapeSettings::default(), |_| ControlFlow::Continue(()))
            .map_err(fault)?;
        let row = measured("drape", started, &solver).with("steps", work.steps);
        progress(newton(
            row.with("repeated_steps", work.unsolved),
            &work.newton,
        ));
        for frame in 1..=bench.frames {
            let obstacle = vectors(&self.bodies.at(frame as f64 * FRAME));
            let targets = FrameTargets {
                obstacle: &obstacle,
                ..FrameTargets::default()
            };
            let started = Instant::now();
            let work = solver.advance(FRAME, &targets).map_err(fault)?;
            let row = measured(&format!("frame {frame}"), started, &solver)
                .with("steps", work.steps)
                .with("repeated_steps", work.inaccurate + work.unsolved);
            progress(
                newton(row, &work.newton)
                    .with("queries", work.contact.queries)
                    .with("candidates", work.contact.candidates)
                    .with("in_reach", work.contact.in_reach)
                    .error("estimated_error_mm", work.largest_error * 1e3)
                    .error("skin_gave_mm", work.largest_give * 1e3),
            );
        }
        Ok(())
    }

    fn cloth(&self, material: &Material) -> Result<OfflineCloth, EvaluateError> {
        let sheet = &self.sheet;
        let rest = RestSheet::flat(sheet.faces.clone(), &sheet.flat).map_err(fault)?;
        let seams = StitchSprings {
            stitches: sheet.stitches.clone(),
            stiffness: STITCH,
        };
        let gravity = V3d::new(0.0, -9.81, 0.0);
        OfflineCloth::of_sewn_sheet(&rest, sheet.x.len(), material, seams, gravity).map_err(fault)
    }
}

/// Dress at rest on the body, freed where the middles of edges on seams were rounded across.
fn start(
    mesh: &ContactMesh,
    dress: &[V3d],
    body: Vec<V3d>,
    par: Par,
) -> Result<OfflineState, EvaluateError> {
    let mut x: Vec<V3d> = dress.iter().chain(&body).copied().collect();
    JoinedSurfaces(mesh).repair(par, &mut x).map_err(fault)?;
    let placed = x.split_off(dress.len());
    let v = vec![V3d::zeros(); dress.len()];
    Ok(OfflineState {
        now: MotionState { x, v },
        obstacle: [placed, body],
        ..OfflineState::default()
    })
}

fn newton(row: Row, work: &NewtonReport) -> Row {
    row.with("newton", work.iterations)
        .with("products", work.products)
        .with("evaluations", work.evaluations)
}

/// Measures the dress of `folder` (`../shared/data/garments/cipc_apache2`); `progress` receives each row.
///
/// # Errors
/// A file that does not fit; a step that is not solved.
pub fn dress_offline(
    folder: &Path,
    bench: DressBench,
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    let run_time = "milliseconds for a drape, and for 1/30 s of dance";
    let mut table = Table::new("dress-offline", "tryon-bench cloth --offline", run_time);
    let scene = DressScene::load(folder, bench.vertices)?;
    scene.run(&bench, Par::Rayon, |row| {
        progress(&row);
        table.rows.push(row);
    })?;
    Ok(table)
}
