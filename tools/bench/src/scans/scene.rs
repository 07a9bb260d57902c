//! Scene of a scanned, dressed, moving subject.

use super::cloth_run::{ClothRun, ScanGarment, ScanWardrobe};
use super::motion::{PoseTrack, ScanMotion};
use super::paint::{HeadFrame, PaintedSurface, ScanPalette, ScenePaint};
use super::points::ScanPoints;
use super::random::ScanSeed;
use super::scanner::ScannerSetting;
use super::settings::ScanSettings;
use super::skinned::SkinnedGarment;
use super::surface::SceneSurface;
use super::view::MAX_GARMENT;
use crate::EvaluateError;
use tryon::mirror::Choice;
use tryon_garment::{GarmentError, GarmentMesh};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_synth::Actor;

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
    /// Number of scans.
    pub scans: usize,
    /// Scans per second.
    pub rate: f64,
    /// Edge length of garments cut from patterns (m).
    pub edge: f64,
    /// Seed of colours, points and noise.
    pub seed: u64,
    /// Cloth, cameras and light.
    pub settings: ScanSettings,
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
            scans: 1,
            rate: 10.0,
            edge: 0.021,
            seed: 1,
            settings: ScanSettings::default(),
        }
    }
}

/// True surface of one garment, hidden parts included.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueGarment {
    /// Name of the garment; pieces of one file share it.
    pub name: String,
    /// Posed vertices, world (m).
    pub vertices: Vec<P3>,
    /// Triangles, the same in all scans.
    pub faces: Vec<Face>,
}

/// Subject at the time of one scan.
#[derive(Clone, Copy)]
pub(super) struct SceneMoment<'a> {
    pub(super) index: usize,
    pub(super) painted: PaintedSurface<'a>,
    run: &'a ClothRun<'a>,
}

/// Scan with its truth. Arrays of points have the shape `[points]`.
#[derive(Clone, Debug)]
pub struct TrueScan {
    /// Positions, world (m); y up, floor at y = 0.
    pub points: Vec<P3>,
    /// Unit normals on the side of the cameras; empty in clouds of a [`CameraRig`](super::CameraRig).
    pub normals: Vec<V3>,
    /// Colours, sRGB.
    pub colors: Vec<[u8; 3]>,
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
    /// Largest 99th percentile of the cloth's stretch so far.
    pub strain: f64,
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

    /// Scan points of the subject.
    fn scanned(&self, moment: &SceneMoment<'_>) -> ScanPoints {
        let mut points = self.scanner.scan(moment.painted, self.seed(moment.index));
        if self.scanner.rig.is_some() {
            points.normals.clear();
        }
        points
    }

    /// Random numbers of one scan.
    pub(super) fn seed(&self, index: usize) -> ScanSeed {
        ScanSeed {
            scene: self.seed,
            scan: index as u64,
        }
    }

    /// Dresses the subject and simulates its motion; `each` receives the subject at the time of each scan.
    pub(super) fn play(
        &self,
        mut each: impl FnMut(SceneMoment<'_>) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        if !(self.rate > 0.0 && self.rate.is_finite()) {
            return Err(fault(format!("rate: {} is not positive", self.rate)));
        }
        let steps = (self.settings.simulation_rate / self.rate).ceil().max(1.0) as u64;
        let rate = self.rate * steps as f64;
        let template = &self.actor.template;
        let rest = template.personalise(&self.actor.shape);
        let track = PoseTrack::new(&self.actor, &self.motion, rate).map_err(fault)?;
        let mut pose = track.pose(0);
        let wardrobe = ScanWardrobe {
            patterns: &self.garments,
            edge: self.edge,
            skinned: &self.skinned,
            settings: &self.settings,
        };
        let dt = 1.0 / rate;
        let mut run = ClothRun::new(template, &rest, &pose, &wardrobe, dt).map_err(fault)?;
        let count = run.garments().count();
        if count > MAX_GARMENT {
            return Err(fault(format!("{count} garments do not fit the labels")));
        }
        let head = HeadFrame::new(template, &rest);
        let paint = ScenePaint::new(head, count, self.palette, &self.settings, self.seed);
        for index in 0..self.scans {
            if index > 0 {
                for k in 1..=steps {
                    pose = track.pose((index as u64 - 1) * steps + k);
                    run.step(&pose, dt).map_err(fault)?;
                }
            }
            let surface = SceneSurface::new(&run, template, &rest, self.settings);
            let painted = PaintedSurface {
                surface: &surface,
                paint: &paint,
            };
            each(SceneMoment {
                index,
                painted,
                run: &run,
            })?;
        }
        Ok(())
    }

    /// Truth of one time with the scan points of it.
    pub(super) fn truth(&self, moment: &SceneMoment<'_>, points: ScanPoints) -> TrueScan {
        let run = moment.run;
        let garment = |(mesh, vertices): (&GarmentMesh, &[P3])| TrueGarment {
            name: mesh.name.clone(),
            vertices: vertices.to_vec(),
            faces: mesh.faces.clone(),
        };
        TrueScan {
            colors: (points.colors.iter())
                .map(|c| c.map(|c| c.round() as u8))
                .collect(),
            points: points.points,
            normals: points.normals,
            labels: points.labels,
            body: run.body().to_vec(),
            body_faces: self.actor.template.mesh().faces().to_vec(),
            garments: run.garments().map(garment).collect(),
            strain: run.strain,
        }
    }
}

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("scans", why)
}
