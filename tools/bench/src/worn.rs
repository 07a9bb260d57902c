//! Outfits worn through whole motions: crossings of cloth with cloth, speed of cloth at rest, stretch and run time.

use super::{BodyFilm, EvaluateError, OutfitSpec, Row};
use clap::ValueEnum;
use std::path::Path;
use std::time::Instant;
use tryon_body::measure;
use tryon_cloth::{Input, State, Workspace, step};
use tryon_dressing::{Dressed, suggest};
use tryon_formats::obj::write_obj;
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::spatial::intersections;
use tryon_synth::{Actor, Routine, Sequence, Setting};

/// Pictures a second.
const RATE: f64 = 30.0;
/// Pictures of somebody who stands.
const STANDING: u64 = 150;
/// Last pictures of a motion whose cloth may be at rest.
const AT_REST: usize = 30;

/// Motion that an outfit is worn through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WornMotion {
    /// Five seconds in the calibration pose, with breath and sway.
    Standing,
    /// The built-in routine of a try-on.
    Calm,
    /// A dance, as it is tracked.
    Charleston,
    /// Jumping jacks, as they are tracked.
    Jacks,
}

/// A person and the motion that they wear outfits through.
pub struct Wearer {
    motion: WornMotion,
    film: BodyFilm,
}

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("worn", why)
}

/// The first pictures of a routine, or all of it.
fn played(routine: Routine, pictures: Option<u64>) -> BodyFilm {
    let setting = Setting {
        routine,
        rate: RATE,
        color: false,
        room: None,
        ..Setting::default()
    };
    let pictures = pictures.unwrap_or((routine.period() * RATE) as u64);
    BodyFilm::played(&Sequence::new(Actor::default(), setting), pictures)
}

impl Wearer {
    /// Plays or tracks a motion; recordings lie below `data`.
    ///
    /// # Errors
    /// A recording that cannot be read, or shows nobody.
    pub fn new(motion: WornMotion, data: &Path) -> Result<Self, EvaluateError> {
        let tracked = |name: &str| BodyFilm::tracked(&data.join("sequences").join(name));
        let film = match motion {
            WornMotion::Standing => played(Routine::Still, Some(STANDING)),
            WornMotion::Calm => played(Routine::TryOn, None),
            WornMotion::Charleston => tracked("charleston_m_heavy_tof_room")?,
            WornMotion::Jacks => tracked("jacks_f_avg_kinect1_room")?,
        };
        Ok(Self { motion, film })
    }

    /// Wears an outfit in the suggested sizes through the motion, and shows each picture.
    ///
    /// # Errors
    /// A garment that is not known, or cannot be put on or simulated; what `show` returns.
    pub fn wear(
        &self,
        outfit: &OutfitSpec,
        mut show: impl FnMut(&WornPicture<'_>) -> Result<(), EvaluateError>,
    ) -> Result<WornReport, EvaluateError> {
        let BodyFilm {
            template,
            rest,
            start,
            bodies,
        } = &self.film;
        let measures = measure::measure(template, rest).map_err(fault)?;
        let size = |garment: &str| {
            let suggested = suggest(garment, &measures).map_err(|e| e.to_string())?;
            Ok(suggested.size)
        };
        let dressed = outfit.dress(template, rest, start, size);
        let Dressed {
            model, mut state, ..
        } = dressed.map_err(fault)?;
        let faces: Vec<_> = model.outfit.garments.iter().map(|g| &g.faces).collect();
        let cloth = ClothFaces::new(&faces, &state);
        let mut report = WornReport {
            vertices: cloth.owner.len(),
            ..WornReport::default()
        };
        let (mut work, dt) = (Workspace::default(), 1.0 / RATE);
        let mut before = Vec::new();
        for (i, body) in bodies.iter().enumerate() {
            let started = Instant::now();
            let r = step(&model, &mut state, &Input { body, dt }, &mut work).map_err(fault)?;
            report.ms.push(started.elapsed().as_secs_f64() * 1e3);
            report.stages_ms[0] += r.stages_ms.maps + r.stages_ms.contact;
            report.stages_ms[1] += r.stages_ms.solve;
            report.strain.push(r.p99_strain);
            report.faults += usize::from(r.kept_last_good.is_some());
            let garments = state.garments.iter();
            let positions: Vec<P3> = garments.flat_map(|g| g.positions.clone()).collect();
            let crossings = cloth.crossings(&positions);
            report.crossings.push(crossings);
            show(&WornPicture {
                number: i,
                faces: &cloth.faces,
                positions: &positions,
                crossings,
            })?;
            if i + AT_REST >= bodies.len() {
                let moved = positions.iter().zip(&before);
                let speed = |(p, q): (&P3, &P3)| f64::from((p - q).norm()) / dt;
                report.speeds.extend(moved.map(speed));
            }
            before = positions;
        }
        Ok(report)
    }

    /// Name of a scene: motion and garments.
    pub fn scene(&self, outfit: &OutfitSpec) -> String {
        format!("{}_{}", self.motion_name(), outfit.garments.join("+"))
    }

    fn motion_name(&self) -> String {
        let motion = self.motion.to_possible_value();
        motion.map_or_else(String::new, |m| m.get_name().to_owned())
    }

    /// Row of an outfit's report.
    pub fn row(&self, outfit: &OutfitSpec, report: &WornReport) -> Row {
        report.row(&self.motion_name(), &outfit.garments.join("+"))
    }
}

/// Cloth of one picture, vertices of all garments numbered through.
#[derive(Clone, Copy, Debug)]
pub struct WornPicture<'a> {
    /// Number of the picture.
    pub number: usize,
    /// Faces.
    pub faces: &'a [[u32; 3]],
    /// World, metres.
    pub positions: &'a [P3],
    /// Edges through faces of their own garment and of another one.
    pub crossings: [usize; 2],
}

impl WornPicture<'_> {
    /// Writes the cloth as OBJ.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), EvaluateError> {
        write_obj(path, self.positions, self.faces, None).map_err(fault)
    }
}

/// Faces of all garments, their vertices numbered through.
struct ClothFaces {
    faces: Vec<[u32; 3]>,
    /// Garment of each vertex.
    owner: Vec<usize>,
}

impl ClothFaces {
    fn new(faces: &[&Vec<[u32; 3]>], state: &State) -> Self {
        let (mut all, mut owner) = (Vec::new(), Vec::new());
        for (k, (own, g)) in faces.iter().zip(&state.garments).enumerate() {
            let first = owner.len() as u32;
            all.extend(own.iter().map(|f| f.map(|v| v + first)));
            owner.resize(owner.len() + g.positions.len(), k);
        }
        Self { faces: all, owner }
    }

    /// Edges through faces of their own garment, and of another one.
    fn crossings(&self, positions: &[P3]) -> [usize; 2] {
        let mut found = [0; 2];
        for i in intersections(&self.faces, positions) {
            let [edge, face] = [i.edge[0], self.faces[i.face as usize][0]];
            found[usize::from(self.owner[edge as usize] != self.owner[face as usize])] += 1;
        }
        found
    }
}

/// Cost and quality of one outfit in one motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WornReport {
    /// Vertices of all garments.
    pub vertices: usize,
    /// Run time of each step (ms).
    pub ms: Vec<f64>,
    /// Sums of the contact's and the solver's time (ms).
    pub stages_ms: [f64; 2],
    /// Edges through faces of their own garment and of another one, in each picture.
    pub crossings: Vec<[usize; 2]>,
    /// 99th percentile of the edges' stretch in each picture.
    pub strain: Vec<f64>,
    /// Speeds of all vertices in the last second, from picture to picture (m/s).
    pub speeds: Vec<f64>,
    /// Steps that kept the last good state.
    pub faults: usize,
}

impl WornReport {
    /// Row of a benchmark; its time is the mean.
    fn row(&self, scene: &str, method: &str) -> Row {
        let pictures = self.crossings.len().max(1) as f64;
        let all = || self.crossings.iter().map(|[own, others]| own + others);
        let sum = |k: usize| self.crossings.iter().map(|c| c[k]).sum::<usize>() as f64;
        let quantile = |v: &[f64], p| percentile(&mut v.to_vec(), p).unwrap_or(f64::NAN);
        let [contact, solve] = self.stages_ms.map(|ms| format!("{:.1}", ms / pictures));
        Row::new(scene, method, self.ms.iter().sum::<f64>() / pictures)
            .with("vertices", self.vertices)
            .with("contact_ms", contact)
            .with("solve_ms", solve)
            .with("faults", self.faults)
            .error("own_crossings", sum(0) / pictures)
            .error("layer_crossings", sum(1) / pictures)
            .error("most_crossings", all().max().unwrap_or(0) as f64)
            .error(
                "pictures_with_any_percent",
                all().filter(|n| *n > 0).count() as f64 / pictures * 100.0,
            )
            .error("p99_stretch_percent", quantile(&self.strain, 99) * 100.0)
            .error("p95_speed_mm_s", quantile(&self.speeds, 95) * 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_cloth::GarmentState;

    #[test]
    fn an_edge_through_a_face_is_counted_where_it_belongs() {
        // The upright triangle's first edge passes through the level one, whose longest edge passes through the other.
        let level = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(P3::from);
        let upright = [[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [5.0, 5.0, 0.5]].map(P3::from);
        let worn = |garments: &[(Vec<[u32; 3]>, Vec<P3>)]| {
            let mut state = State::default();
            for (_, positions) in garments {
                let mut garment = GarmentState::default();
                garment.positions.clone_from(positions);
                state.garments.push(garment);
            }
            let faces: Vec<_> = garments.iter().map(|g| &g.0).collect();
            let positions: Vec<P3> = garments.iter().flat_map(|g| g.1.clone()).collect();
            ClothFaces::new(&faces, &state).crossings(&positions)
        };
        let one = (vec![[0, 1, 2], [3, 4, 5]], [level, upright].concat());
        assert_eq!(worn(&[one]), [2, 0]);
        let two = [level, upright].map(|x| (vec![[0, 1, 2]], x.to_vec()));
        assert_eq!(worn(&two), [0, 2]);
    }
}
