//! Scenes by the live step: the sheet is a garment, the solids are its body, pins are anchors.

use super::solids::Solids;
use super::{Collider, Primitive, Scene, SceneError};
use crate::contact::{CollisionModel, CollisionParts};
use crate::live::{
    AnchorBinding, ClothError, Config, Input, Model, Outfit, State, Workspace, WornBody, step,
};
use crate::settings::SceneSettings;
use nalgebra::{Isometry3, Point3};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use tryon_body::SkinWeights;
use tryon_formats::FormatError;
use tryon_formats::npy::write_npy;
use tryon_garment::{GarmentKind, GarmentMesh, Region, RenderMesh, Size};
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::TriMesh;

/// Report of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunReport {
    /// Frames of the output, the start included.
    pub frames: usize,
    /// Vertices.
    pub vertices: usize,
    /// Substeps a frame.
    pub substeps: usize,
    /// Median computing time of a frame (ms).
    pub ms_median: f64,
    /// Mean computing time of a frame (ms).
    pub ms_mean: f64,
    /// Longest computing time of a frame (ms).
    pub ms_max: f64,
    /// 99th percentile of the edges' stretch at the end.
    pub p99_strain: f64,
    /// Largest depth of a vertex in a solid over all frames (m).
    pub penetration: f64,
    /// Kinetic plus elastic energy at the end (J).
    pub energy_end: f64,
    /// Share of the membrane stiffness that is kept.
    pub softened: f64,
}

/// Writes positions as f32, shape `[frames, vertices, 3]`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_positions(path: &Path, frames: &[Vec<P3>]) -> Result<(), FormatError> {
    let n = frames.first().map_or(0, Vec::len);
    let flat: Vec<f32> = frames
        .iter()
        .flatten()
        .flat_map(|p| [p.x, p.y, p.z])
        .collect();
    write_npy(path, &[frames.len() as u64, n as u64, 3], flat.into_iter())
}

/// Simulates a scene by [`fn@crate::step`]; `config` as from [`Scene::config`]. `frame` receives the positions of each frame
/// once they are known, the start as frame 0, and may break off; the report then covers the frames so far.
///
/// # Errors
/// A setting or solid at fault; a step that gave no result.
pub fn run(
    scene: &Scene,
    config: &Config,
    mut frame: impl FnMut(usize, &[P3]) -> ControlFlow<()>,
) -> Result<RunReport, SceneError> {
    let mut live = LiveScene::new(scene, *config)?;
    let mut flow = frame(0, &scene.start);
    let mut times = Vec::new();
    for index in 1..scene.frames() {
        if flow.is_break() {
            break;
        }
        let started = Instant::now();
        live.advance(index)?;
        times.push(started.elapsed().as_secs_f64() * 1e3);
        live.measure(index);
        flow = frame(index, &live.state.garments[0].positions);
    }
    Ok(live.finish(times))
}

/// A scene's sheet as an outfit, at its start.
#[cfg(test)]
pub(crate) fn outfit(scene: &Scene) -> (Model, State) {
    let LiveScene { model, state, .. } = LiveScene::new(scene, scene.config()).expect("a scene");
    (model, state)
}

/// A scene as an outfit on a body.
struct LiveScene<'a> {
    scene: &'a Scene,
    body: SceneBody<'a>,
    model: Model,
    state: State,
    work: Workspace,
    report: RunReport,
}

impl<'a> LiveScene<'a> {
    fn new(scene: &'a Scene, config: Config) -> Result<Self, SceneError> {
        let body = SceneBody::new(scene)?;
        let at = body.at(0.0);
        let outfit = Outfit {
            garments: vec![garment(scene)],
            anchors: vec![body.anchors()],
        };
        let sheet = |_: &GarmentMesh| {
            let mut sheet = scene.sheet.clone();
            sheet.friction = scene.friction();
            Ok(sheet)
        };
        let model = Model::on_body(body.worn(&at, &config)?, outfit, config, sheet)?;
        let state = State::new(&model, vec![scene.start.clone()], &at)?;
        Ok(Self {
            scene,
            body,
            model,
            state,
            work: Workspace::default(),
            report: RunReport::default(),
        })
    }

    /// Advances to frame `index` from the one before.
    fn advance(&mut self, index: usize) -> Result<(), SceneError> {
        let interval = 1.0 / self.scene.rate;
        let count = (interval / self.scene.settings.longest_step)
            .ceil()
            .max(1.0);
        let dt = interval / count;
        self.report.substeps = 0;
        for k in 1..=count as usize {
            let t = (index - 1) as f64 * interval + k as f64 * dt;
            let body = self.body.at(t);
            let input = Input { body: &body, dt };
            let report = step(&self.model, &mut self.state, &input, &mut self.work)?;
            if let Some(why) = report.kept_last_good {
                return Err(SceneError::Unsolved { frame: index, why });
            }
            self.report.substeps += report.steps;
            self.report.softened = report.softened;
        }
        Ok(())
    }

    /// Measures penetration at frame `index`.
    fn measure(&mut self, index: usize) {
        let t = index as f64 / self.scene.rate;
        let deepest = self.body.solids.deepest(t, &self.positions());
        self.report.penetration = self.report.penetration.max(deepest);
    }

    fn positions(&self) -> Vec<V3d> {
        let positions = self.state.garments[0].positions.iter();
        positions.map(|p| p.coords.cast()).collect()
    }

    /// Report of a run whose frames took these times (ms).
    fn finish(self, mut times: Vec<f64>) -> RunReport {
        let (x, sheet) = (self.positions(), &self.scene.sheet);
        let speeds = self.state.garments[0].velocities.iter().zip(&sheet.mass);
        let kinetic: f64 = speeds
            .map(|(v, m)| 0.5 * m * f64::from(v.norm_squared()))
            .sum();
        RunReport {
            frames: times.len() + 1,
            vertices: x.len(),
            ms_median: median(&mut times).unwrap_or(0.0),
            ms_mean: times.iter().sum::<f64>() / times.len().max(1) as f64,
            ms_max: percentile(&mut times, 100).unwrap_or(0.0),
            p99_strain: sheet.strain(&x).1,
            energy_end: kinetic + sheet.energy(&x),
            ..self.report
        }
    }
}

/// Body of a scene: the solids, then a triangle that belongs to no part and holds the pins.
struct SceneBody<'a> {
    scene: &'a Scene,
    solids: Solids<'a>,
}

impl<'a> SceneBody<'a> {
    fn new(scene: &'a Scene) -> Result<Self, SceneError> {
        for (number, collider) in scene.colliders.iter().enumerate() {
            check_size(number, collider, &scene.settings)?;
        }
        let solids = Solids::new(scene);
        Ok(Self { scene, solids })
    }

    /// Frame that the pins move with, at time `t` (s).
    fn carrier(&self, t: f64) -> Isometry3<f64> {
        let carrier = self.scene.pinned_to.map(|c| &self.scene.colliders[c]);
        carrier.map_or_else(Isometry3::identity, |c| c.placement(t))
    }

    /// Vertices at time `t` (s), in the world (m).
    fn at(&self, t: f64) -> Vec<P3> {
        let carrier = self.carrier(t);
        let edge = self.scene.settings.pin_frame;
        let corners = [V3d::zeros(), V3d::x() * edge, V3d::y() * edge];
        let corners = corners.map(|p| (carrier * Point3::from(p)).coords);
        let all = self.solids.at(t).into_iter().chain(corners);
        all.map(|p| P3::from(p.cast::<f32>())).collect()
    }

    /// Pins as anchors at the triangle.
    fn anchors(&self) -> Vec<AnchorBinding> {
        let (back, first) = (self.carrier(0.0).inverse(), self.solids.len() as u32);
        let edge = self.scene.settings.pin_frame;
        let anchor = |v: &u32| {
            let local = back * self.scene.start[*v as usize].cast::<f64>();
            let [x, y] = [local.x / edge, local.y / edge];
            AnchorBinding {
                vertex: *v,
                body: [first, first + 1, first + 2],
                weights: [1.0 - x - y, x, y].map(|w| w as f32),
                height: local.z as f32,
                strength: 1.0,
            }
        };
        self.scene.pins.iter().map(anchor).collect()
    }

    /// The body as an outfit is worn on it; `at`: its vertices at the start (m).
    fn worn(&self, at: &[P3], config: &Config) -> Result<WornBody, ClothError> {
        let (n, solid) = (at.len(), self.solids.len());
        let mut faces = self.solids.faces.clone();
        faces.push([0, 1, 2].map(|k| (solid + k) as u32));
        let own = (0..n).map(|v| if v < solid { Region::TRUNK.0 } else { 0 });
        let parts = CollisionParts {
            own: own.collect(),
            opposite: vec![0; n],
            pressing: vec![0; n],
            hinges: Vec::new(),
        };
        let mesh = TriMesh::new(at.to_vec(), faces)?;
        Ok(WornBody {
            collision: CollisionModel::new(&mesh, parts, config.collision())?,
            weights: SkinWeights {
                joints: vec![[0; 4]; n],
                weights: vec![[1.0, 0.0, 0.0, 0.0]; n],
            },
            joints: 1,
        })
    }
}

/// Checks that a solid is small enough for its mesh.
fn check_size(
    number: usize,
    collider: &Collider,
    settings: &SceneSettings,
) -> Result<(), ClothError> {
    let [radius, half] = match collider.shape {
        Primitive::Sphere { radius } => [radius, 0.0],
        Primitive::Capsule {
            radius,
            half_segment,
        } => [radius, half_segment],
    };
    let (most, longest) = (settings.largest_radius, settings.largest_half);
    if radius <= most && half <= longest {
        return Ok(());
    }
    let why =
        format!("a radius of at most {most} m and half length of {longest} m are simulated live");
    Err(ClothError::Field {
        field: format!("colliders[{number}]"),
        why,
    })
}

/// The sheet of a scene as a garment.
fn garment(scene: &Scene) -> GarmentMesh {
    let vertices = scene.start.len();
    GarmentMesh {
        name: "sheet".into(),
        kind: GarmentKind::Skirt,
        size: Size::M,
        material: scene.material.clone(),
        layer: 0,
        vertices,
        faces: scene.faces.clone(),
        rest: Vec::new(),
        face_panel: Vec::new(),
        panels: Vec::new(),
        placements: Vec::new(),
        corners: Vec::new(),
        uv: Vec::new(),
        regions: vec![Region::TRUNK; vertices],
        anchors: Vec::new(),
        seams: Vec::new(),
        render: RenderMesh::default(),
        min_angle: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fine::OfflineSettings;
    use crate::scene::{OfflineScene, parse};
    use tryon_geometry::par::{Par, with_threads};
    use tryon_geometry::spatial::intersections;

    /// OBJ text of a grid of cells whose vertex `i`, `j` lies at `at` (x, z); alternating diagonals if asked for.
    fn grid_obj(cells: [u32; 2], alternates: bool, at: impl Fn(u32, u32) -> [f64; 2]) -> String {
        let mut obj = String::new();
        for (i, j) in (0..=cells[0]).flat_map(|i| (0..=cells[1]).map(move |j| (i, j))) {
            let [x, z] = at(i, j);
            obj += &format!("v {x:.6} 0 {z:.6}\n");
        }
        for (i, j) in (0..cells[0]).flat_map(|i| (0..cells[1]).map(move |j| (i, j))) {
            let a = i * (cells[1] + 1) + j + 1;
            let [b, c, d] = [a + 1, a + cells[1] + 1, a + cells[1] + 2];
            let two = if alternates && (i + j) % 2 == 0 {
                [[a, b, d], [a, d, c]]
            } else {
                [[a, b, c], [b, d, c]]
            };
            two.iter()
                .for_each(|f| obj += &format!("f {} {} {}\n", f[0], f[1], f[2]));
        }
        obj
    }

    /// A square sheet of 0.3 m, held at two corners, that falls and swings.
    fn swing(bending: f64) -> Scene {
        const CELLS: u32 = 6;
        let obj = grid_obj([CELLS; 2], false, |i, j| {
            [i, j].map(|k| 0.05 * f64::from(k))
        });
        let scene = serde_json::json!({
            "mesh_obj": obj, "pinned_vertices": [0, CELLS],
            "material": {
                "area_density_kg_m2": 0.2, "thickness_m": 5e-4, "young_membrane_N_m": 100.0, "poisson": 0.3,
                "bending_rigidity_N_m": bending, "friction": 0.3,
            },
            "gravity": [0.0, -9.81, 0.0], "duration_s": 0.2, "output_fps": 60.0,
        });
        parse(&scene.to_string(), Path::new("swing"), None).expect("a scene")
    }

    /// Last positions of a run (m).
    fn end(scene: &Scene, config: &Config) -> Vec<P3> {
        let mut last = Vec::new();
        run(scene, config, |_, x| {
            last = x.to_vec();
            ControlFlow::Continue(())
        })
        .expect("a run");
        last
    }

    /// Root mean square distance (m).
    fn apart(a: &[P3], b: &[P3]) -> f64 {
        let sum: f64 = a
            .iter()
            .zip(b)
            .map(|(a, b)| f64::from((a - b).norm_squared()))
            .sum();
        (sum / a.len() as f64).sqrt()
    }

    #[test]
    fn patches_give_the_same_bits_on_any_number_of_threads() {
        let scene = swing(1e-3);
        let of = |patches: usize| Config {
            patch: scene.start.len().div_ceil(patches),
            ..scene.config()
        };
        for patches in [1, 2, 3] {
            let config = of(patches);
            let on = |threads| with_threads(threads, || end(&scene, &config)).expect("threads");
            let one = on(1);
            assert!(one == on(2) && one == on(5), "{patches} patches");
            let distance = apart(&one, &end(&scene, &of(1)));
            assert!(distance < 1e-4, "{patches} patches and one: {distance} m");
        }
    }

    #[test]
    fn live_and_offline_solvers_swing_to_the_same_place() {
        let scene = swing(1e-6);
        let offline = OfflineScene::new(&scene).expect("a scene");
        let settings = OfflineSettings {
            contact: None,
            ..OfflineSettings::default()
        };
        let mut reference = Vec::new();
        let keep = |_: &_, solver: &crate::fine::OfflineSolver<'_>| {
            reference = solver.state().positions();
            ControlFlow::Continue(())
        };
        offline.run(&settings, Par::Seq, None, keep).expect("a run");
        let distance = apart(&end(&scene, &scene.config()), &reference);
        assert!(distance < 2e-3, "{distance} m");
    }

    #[test]
    fn free_fall_is_that_of_a_point_at_any_rate() {
        for rate in [5.0, 60.0, 144.0] {
            let scene = Scene {
                pins: Vec::new(),
                rate,
                duration: 2.0,
                ..swing(1e-3)
            };
            let last = end(&scene, &scene.config());
            let fall = 0.5 * 9.81 * scene.duration * scene.duration;
            let y = f64::from(last[7].y);
            // Symplectic Euler of steps below 1 ms is ahead by half a step.
            assert!(
                (y + fall).abs() < 0.012,
                "{y} m at {rate}/s, {fall} m expected"
            );
        }
    }

    #[test]
    fn pins_follow_their_solid_and_solids_too_large_are_refused() {
        let at = |x: f64, angle: f64| {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&V3d::y_axis(), angle);
            Isometry3::from_parts(nalgebra::Translation3::new(x, 0.2, 0.0), turn)
        };
        let ball = |radius| Collider {
            shape: Primitive::Sphere { radius },
            friction: 0.3,
            motion: vec![(0.0, at(-0.5, 0.0)), (0.2, at(-0.3, 0.4))],
        };
        let mut scene = Scene {
            colliders: vec![ball(0.05)],
            pinned_to: Some(0),
            ..swing(1e-3)
        };
        let last = end(&scene, &scene.config());
        for v in scene.pins.iter().map(|v| *v as usize) {
            let start: Point3<f64> = scene.start[v].cast();
            let expected = at(-0.3, 0.4) * at(-0.5, 0.0).inverse() * start;
            let off = (last[v].cast::<f64>() - expected).norm();
            assert!(off < 1e-5, "pin {v}: {off} m");
        }
        scene.colliders = vec![ball(3.0)];
        let refused = run(&scene, &scene.config(), |_, _| ControlFlow::Continue(()));
        let why = refused.expect_err("too large").to_string();
        assert!(why.starts_with("colliders[0]:"), "{why}");
    }

    /// A strip of 0.3 m that falls over a thin rod: its halves swing down and meet at about 3 m/s.
    fn strip_over_a_rod() -> Scene {
        let obj = grid_obj([20, 6], true, |i, j| {
            let share = [f64::from(i) / 20.0, f64::from(j) / 6.0];
            [0.3 * share[0] - 0.145, 0.09 * share[1] - 0.045]
        });
        let turned = std::f64::consts::FRAC_1_SQRT_2;
        let scene = serde_json::json!({
            "mesh_obj": obj,
            "material": {
                "area_density_kg_m2": 0.2, "thickness_m": 5e-4, "young_membrane_N_m": 300.0, "poisson": 0.3,
                "bending_rigidity_N_m": 1e-4, "friction": 0.5,
            },
            "colliders": [{
                "type": "capsule", "radius": 0.01, "half_segment": 0.3, "friction": 0.5,
                "motion": [[0.0, 0.0, -0.012, 0.0, turned, 0.0, 0.0, turned]],
            }],
            "gravity": [0.0, -9.81, 0.0], "duration_s": 1.5, "output_fps": 60.0,
        });
        parse(&scene.to_string(), Path::new("strip"), None).expect("a scene")
    }

    #[test]
    fn self_collision_leaves_the_halves_of_a_strip_apart() {
        let scene = strip_over_a_rod();
        let crossings = |self_collision: bool| {
            let mut last = 0;
            let config = Config {
                self_collision,
                thickness: 0.005,
                ..scene.config()
            };
            let report = run(&scene, &config, |_, x| {
                last = intersections(&scene.faces, x).len();
                ControlFlow::Continue(())
            });
            (last, report.expect("a run"))
        };
        let ((off, _), (on, report)) = (crossings(false), crossings(true));
        assert!(off > 20, "{off}: nothing would be tested");
        // On the way up to 26 come and go: the halves meet at 6 m/s, and live contact lets folds close at 1 m/s.
        assert_eq!(on, 0, "{off} without");
        let energy = report.energy_end;
        assert!(energy < 0.1, "{energy} J: none is gained");
        assert!(report.penetration < 1e-4, "{} m", report.penetration);
    }
}
