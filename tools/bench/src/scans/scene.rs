//! Scene of a scanned, dressed, moving subject.

use super::cloth_run::{ClothRun, ScanGarment, ScanWardrobe};
use super::defects::ScanDefects;
use super::motion::{PoseTrack, ScanMotion};
use super::paint::{ScanPalette, ScenePaint};
use super::points::ScanPoints;
use super::random::ScanSeed;
use super::scanner::ScannerSetting;
use super::skinned::SkinnedGarment;
use super::surface::SceneSurface;
use super::view::MAX_GARMENT;
use crate::EvaluateError;
use tryon::mirror::Choice;
use tryon_body::{BodyShape, Pose, RestBody};
use tryon_garment::{AnchorKind, GarmentError, GarmentKind, GarmentMesh};
use tryon_geometry::math::{P3, V3, World};
use tryon_geometry::mesh::Face;
use tryon_synth::Actor;

/// Least rate of the simulation (1/s).
const SIMULATION_RATE: f64 = 60.0;

/// 99th percentile of the stretch of a garment that is caught or torn: dances reach 0.25 for a frame.
const MAX_STRAIN: f64 = 0.25;

/// Settings of a sequence of scans.
#[derive(Clone, Debug)]
pub struct ScanScene {
    /// Body of the subject.
    pub actor: Actor,
    /// Outfit.
    pub garments: Vec<ScanGarment>,
    /// Garments that follow the bones, innermost first, over those of `garments`.
    pub skinned: Vec<SkinnedGarment>,
    /// Motion.
    pub motion: ScanMotion,
    /// Colours of the garments.
    pub palette: ScanPalette,
    /// Scanner.
    pub scanner: ScannerSetting,
    /// Defects.
    pub defects: ScanDefects,
    /// Number of scans.
    pub scans: usize,
    /// Scans per second.
    pub rate: f64,
    /// Edge length of garments cut from patterns (m).
    pub edge: f64,
    /// Seed of colours, points, noise and defects.
    pub seed: u64,
}

impl Default for ScanScene {
    /// One scan of the embedded body without garments.
    fn default() -> Self {
        Self {
            actor: Actor::default(),
            garments: Vec::new(),
            skinned: Vec::new(),
            motion: ScanMotion::default(),
            palette: ScanPalette::default(),
            scanner: ScannerSetting::default(),
            defects: ScanDefects::default(),
            scans: 1,
            rate: 10.0,
            edge: 0.021,
            seed: 1,
        }
    }
}

/// True surface of one garment, hidden parts included.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueGarment {
    /// Name of the garment; pieces of one file share it.
    pub name: String,
    /// Kind.
    pub kind: GarmentKind,
    /// Buttons, belts and other parts that keep their shape.
    pub is_rigid: bool,
    /// Posed vertices, world (m).
    pub vertices: Vec<P3>,
    /// Triangles, the same in all scans.
    pub faces: Vec<Face>,
}

/// Subject at the time of one scan.
#[derive(Clone, Copy)]
pub(super) struct SceneMoment<'a> {
    pub(super) index: usize,
    pub(super) surface: &'a SceneSurface,
    pub(super) paint: &'a ScenePaint,
    run: &'a ClothRun<'a>,
    rest: &'a RestBody,
    pose: &'a Pose<World>,
}

/// Scan with its truth. Arrays of points have the shape `[points]`.
#[derive(Clone, Debug)]
pub struct TrueScan {
    /// Number of the scan.
    pub index: usize,
    /// Time since the first scan (s).
    pub time: f64,
    /// Positions, world (m); y up, floor at y = 0.
    pub points: Vec<P3>,
    /// Unit normals on the side of the cameras; empty in clouds of a [`CameraRig`](super::CameraRig).
    pub normals: Vec<V3>,
    /// Triangles; empty for a cloud.
    pub faces: Vec<Face>,
    /// Colours, sRGB; black where lost.
    pub colors: Vec<[u8; 3]>,
    /// Rows whose colour is lost, ascending; in files they are NaN.
    pub uncolored: Vec<u32>,
    /// True garment from 1 in the order of `garments`, [`SKIN_LABEL`](super::SKIN_LABEL) or
    /// [`STRAY_LABEL`](super::STRAY_LABEL).
    pub labels: Vec<u8>,
    /// Posed body under the clothes, vertices of the template, world (m).
    ///
    /// Parts that press on each other are apart, as cloth meets them; elsewhere it is the skinned pose.
    pub body: Vec<P3>,
    /// Triangles of the body, those of the subject's template.
    pub body_faces: Vec<Face>,
    /// True garments, innermost first.
    pub garments: Vec<TrueGarment>,
    /// Pose of the template.
    pub pose: Pose<World>,
    /// Shape of the subject.
    pub shape: BodyShape,
    /// Largest 99th percentile of the cloth's stretch so far.
    pub strain: f64,
}

impl TrueScan {
    /// True if no garment is caught or torn.
    pub fn is_sound(&self) -> bool {
        self.strain < MAX_STRAIN
    }
}

impl ScanScene {
    /// A scene of library garments in the suggested sizes.
    ///
    /// # Errors
    /// A name that is not in the library.
    pub fn library(names: &[&str]) -> Result<Self, GarmentError> {
        let garments = names.iter().map(|name| Choice::library(name, None));
        let garments = garments.map(|choice| choice.map(ScanGarment::from));
        Ok(Self {
            garments: garments.collect::<Result<_, _>>()?,
            ..Self::default()
        })
    }

    /// Makes all scans.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn scans(&self) -> Result<Vec<TrueScan>, EvaluateError> {
        let mut all = Vec::new();
        self.run(|scan| {
            all.push(scan);
            Ok(())
        })?;
        Ok(all)
    }

    /// Makes the first scan once with each scanner and its seed of colours, points, noise and defects; the clothes are put on
    /// once.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn first_scans(
        &self,
        scanners: &[(ScannerSetting, u64)],
    ) -> Result<Vec<TrueScan>, EvaluateError> {
        let first = Self {
            scans: 1,
            ..self.clone()
        };
        let mut all = Vec::new();
        first.play(|moment| {
            for (scanner, seed) in scanners {
                let one = Self {
                    scanner: scanner.clone(),
                    seed: *seed,
                    ..first.clone()
                };
                let count = moment.run.garments().count();
                let template = &self.actor.template;
                let paint = ScenePaint::new(template, moment.rest, count, self.palette, *seed);
                let painted = SceneMoment {
                    paint: &paint,
                    ..moment
                };
                let points = one.scanned(&painted);
                all.push(one.truth(&painted, points));
            }
            Ok(())
        })?;
        Ok(all)
    }

    /// Makes the scans one after the other; `each` receives them.
    ///
    /// # Errors
    /// A garment that cannot be put on or simulated, a clip without a joint, or an error of `each`.
    pub fn run(
        &self,
        mut each: impl FnMut(TrueScan) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        self.play(|moment| {
            let points = self.scanned(&moment);
            each(self.truth(&moment, points))
        })
    }

    /// Scan points of the subject, with their defects.
    fn scanned(&self, moment: &SceneMoment<'_>) -> ScanPoints {
        let seed = ScanSeed {
            scene: self.seed,
            scan: moment.index as u64,
        };
        let mut points = self.scanner.scan(moment.surface, moment.paint, seed);
        (self.defects).apply(&mut points, moment.surface.center(), seed);
        if self.scanner.rig.is_some() {
            points.normals.clear();
        }
        points
    }

    /// Dresses the subject and simulates its motion; `each` receives the subject at the time of each scan.
    pub(super) fn play(
        &self,
        mut each: impl FnMut(SceneMoment<'_>) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        if !(self.rate > 0.0 && self.rate.is_finite()) {
            return Err(fault(format!("rate: {} is not positive", self.rate)));
        }
        let steps = (SIMULATION_RATE / self.rate).ceil().max(1.0) as u64;
        let rate = self.rate * steps as f64;
        let template = &self.actor.template;
        let rest = template.personalise(&self.actor.shape);
        let track = PoseTrack::new(&self.actor, &self.motion, rate).map_err(fault)?;
        let mut pose = track.pose(0);
        let wardrobe = ScanWardrobe {
            patterns: &self.garments,
            edge: self.edge,
            skinned: &self.skinned,
        };
        let dt = 1.0 / rate;
        let mut run = ClothRun::new(template, &rest, &pose, &wardrobe, dt).map_err(fault)?;
        let count = run.garments().count();
        if count > MAX_GARMENT {
            return Err(fault(format!("{count} garments do not fit the labels")));
        }
        let paint = ScenePaint::new(template, &rest, count, self.palette, self.seed);
        for index in 0..self.scans {
            if index > 0 {
                for k in 1..=steps {
                    pose = track.pose((index as u64 - 1) * steps + k);
                    run.step(&pose, dt).map_err(fault)?;
                }
            }
            let surface = SceneSurface::new(&run, template, &rest, self.defects.has_object);
            each(SceneMoment {
                index,
                surface: &surface,
                paint: &paint,
                run: &run,
                rest: &rest,
                pose: &pose,
            })?;
        }
        Ok(())
    }

    /// Truth of one time with the scan points of it.
    pub(super) fn truth(&self, moment: &SceneMoment<'_>, points: ScanPoints) -> TrueScan {
        let (index, run, pose) = (moment.index, moment.run, moment.pose);
        let is_lost = |c: &[f32; 3]| c.iter().any(|c| c.is_nan());
        let lost = (0..).zip(&points.colors).filter(|(_, c)| is_lost(c));
        let garment = |(mesh, vertices): (&GarmentMesh, &[P3])| TrueGarment {
            name: mesh.name.clone(),
            kind: mesh.kind,
            is_rigid: mesh.anchors.iter().any(|a| a.kind == AnchorKind::Rigid),
            vertices: vertices.to_vec(),
            faces: mesh.faces.clone(),
        };
        TrueScan {
            index,
            time: index as f64 / self.rate,
            uncolored: lost.map(|(row, _)| row).collect(),
            // A conversion of NaN is 0.
            colors: (points.colors.iter())
                .map(|c| c.map(|c| c.round() as u8))
                .collect(),
            points: points.points,
            normals: points.normals,
            faces: points.faces,
            labels: points.labels,
            body: run.body().to_vec(),
            body_faces: self.actor.template.mesh().faces().to_vec(),
            garments: run.garments().map(garment).collect(),
            pose: pose.clone(),
            shape: self.actor.shape.clone(),
            strain: run.strain,
        }
    }
}

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::Scene {
        scene: "scans".into(),
        why: why.to_string(),
    }
}
