//! The sewn dress of Codim-IPC on its dancing body by the offline solver: time, work and intersections of each frame.

use super::dance_bodies::{DanceBodies, fault};
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
use tryon_formats::sewn_obj::{Stitch, read_sewn_obj};
use tryon_garment::Material;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;
use tryon_geometry::settings;

/// Panels as cut with their stitches, and the same vertices draped on the standing body.
const FILES: [&str; 2] = ["dress_knife/stage.obj", "dress_knife/drape.obj"];

settings! {
    /// Settings of the scene.
    pub struct DressSceneSettings {
        /// Frames a second of the dance.
        pub rate: f64 = 30.0,
        /// Height of the dance over the draped dress of the files (m).
        pub above: f64 = 0.75,
        /// Stiffness of a stitch (N/m): about that of cotton's membrane, so that seams give as the cloth does.
        pub stitch: f64 = 1e3,
    }
}

/// The dress, draped, and the dance.
struct DressScene {
    settings: DressSceneSettings,
    faces: Vec<Face>,
    /// Material coordinates (m), shape `[vertices]`.
    flat: Vec<Vector2<f64>>,
    /// Positions (m), shape `[vertices]`.
    x: Vec<V3d>,
    stitches: Vec<Stitch>,
    bodies: DanceBodies,
}

fn vectors(points: &[P3]) -> Vec<V3d> {
    points.iter().map(|p| p.coords.cast()).collect()
}

impl DressScene {
    fn load(folder: &Path) -> Result<Self, EvaluateError> {
        let settings = DressSceneSettings::default();
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
        let above = V3d::new(0.0, settings.above, 0.0);
        Ok(Self {
            settings,
            faces: panels.obj.mesh.faces().to_vec(),
            flat,
            x: vectors(places).iter().map(|p| p + above).collect(),
            stitches: panels.stitches,
            bodies: DanceBodies::read(folder)?,
        })
    }

    /// Drapes the dress on the standing body, then simulates frames of the dance; `progress` receives the row of each.
    fn run(&self, frames: usize, mut progress: impl FnMut(Row)) -> Result<(), EvaluateError> {
        let par = Par::Rayon;
        // C-IPC's dresses are of cotton too.
        let material = Material::preset("cotton").map_err(fault)?;
        let cloth = self.cloth(&material)?;
        let body = vectors(&self.bodies.at(0.0));
        let faces = self.bodies.mesh.faces();
        let obstacle = ContactSurface {
            vertices: body.len(),
            faces,
        };
        let mesh = cloth.contact_mesh(obstacle).map_err(fault)?;
        let state = start(&mesh, &self.x, body, par)?;
        let mut settings = OfflineSettings::default();
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
        let interval = 1.0 / self.settings.rate;
        for frame in 1..=frames {
            let obstacle = vectors(&self.bodies.at(frame as f64 * interval));
            let targets = FrameTargets {
                obstacle: &obstacle,
                ..FrameTargets::default()
            };
            let started = Instant::now();
            let work = solver.advance(interval, &targets).map_err(fault)?;
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
        let rest = RestSheet::flat(self.faces.clone(), &self.flat).map_err(fault)?;
        let seams = StitchSprings {
            stitches: self.stitches.clone(),
            stiffness: self.settings.stitch,
        };
        let gravity = V3d::new(0.0, -9.81, 0.0);
        OfflineCloth::of_sewn_sheet(&rest, self.x.len(), material, seams, gravity).map_err(fault)
    }
}

/// Dress at rest on the body, freed of crossings.
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

/// Measures a drape and `frames` of the dress of `folder` (`../shared/data/garments/cipc_apache2`); `progress` receives each row.
///
/// # Errors
/// A file that does not fit; a step that is not solved.
pub fn dress_offline(
    folder: &Path,
    frames: usize,
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    let run_time = "milliseconds for a drape, and for 1/30 s of dance";
    let mut table = Table::new("dress-offline", run_time);
    DressScene::load(folder)?.run(frames, |row| {
        progress(&row);
        table.rows.push(row);
    })?;
    Ok(table)
}
