//! Files of a simulation, valid after every frame: positions.npy and report.json, and outfit.glb at the end.

use super::outfit::write_outfit;
use super::report::{FineReport, parts};
use crate::input;
use crate::offline_files::replace;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use tryon::formats::NpyFrames;
use tryon_kit::simulations::FineFrame;
use tryon_proto::convert::garment::WornGarment;

/// Positions and report of the frames so far.
#[derive(Debug)]
pub(super) struct FineFiles {
    out: PathBuf,
    positions: NpyFrames,
    report: FineReport,
}

impl FineFiles {
    /// Files in the folder `out` of a simulation without frames, in place of those of another.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn create(out: &Path, report: FineReport) -> Result<Self> {
        let positions = NpyFrames::create(&out.join("positions.npy"), report.vertices())?;
        let files = Self {
            out: out.to_owned(),
            positions,
            report,
        };
        files.save()?;
        Ok(files)
    }

    /// Files of an earlier run in `out`, which followed `simulation`.
    ///
    /// # Errors
    /// Files that cannot be read, are those of another simulation, or do not fit one another.
    pub(super) fn open(out: &Path, simulation: &str) -> Result<Self> {
        let path = out.join("report.json");
        let report = serde_json::from_value(input::json(&path)?);
        let report: FineReport =
            report.with_context(|| format!("{} is of no simulation", path.display()))?;
        ensure!(
            report.simulation == simulation,
            "{} is of simulation {}",
            path.display(),
            report.simulation
        );
        let file = out.join("positions.npy");
        let positions = NpyFrames::resume(&file, report.vertices(), report.frames.len())?;
        Ok(Self {
            out: out.to_owned(),
            positions,
            report,
        })
    }

    /// The same files for a simulation that goes on after some of these frames, or after later ones of that before it.
    ///
    /// # Errors
    /// Other garments than those of the files, or files that cannot be written.
    pub(super) fn continued(mut self, simulation: &str, garments: &[WornGarment]) -> Result<Self> {
        ensure!(
            self.report.garments == parts(garments),
            "{}: the simulation goes on with other garments",
            self.out.join("report.json").display()
        );
        simulation.clone_into(&mut self.report.simulation);
        self.save()?;
        Ok(self)
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// A frame of another number of vertices, or a file that cannot be written.
    pub(super) fn push(&mut self, frame: &FineFrame) -> Result<()> {
        self.positions.push(&frame.positions)?;
        self.report.push(frame);
        self.save()
    }

    /// Writes outfit.glb of all frames; none without frames.
    ///
    /// # Errors
    /// A file that cannot be read or written, or garments that do not fit the positions.
    pub(super) fn finish(&mut self, garments: &[WornGarment]) -> Result<()> {
        let frames = self.positions.read()?;
        let (path, interval) = (self.out.join("outfit.glb"), self.report.interval());
        write_outfit(&path, garments, &frames, interval)
    }

    /// Number of frames.
    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Vertices of all garments.
    pub(super) fn vertices(&self) -> usize {
        self.report.vertices()
    }

    fn save(&self) -> Result<()> {
        let path = self.out.join("report.json");
        let mut text = serde_json::to_vec_pretty(&self.report)?;
        text.push(b'\n');
        replace(&path, &text).with_context(|| format!("cannot write {}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon::formats::npy::read_npy;
    use tryon::geometry::math::P3;
    use tryon_proto::v1::{FrameId, GarmentLook, StartSimulationResponse};

    fn dot(name: &str) -> WornGarment {
        WornGarment {
            garment: name.into(),
            size: "M".into(),
            vertices: 1,
            drawn: vec![0],
            faces: Vec::new(),
            uvs: vec![[0.0; 2]],
            look: GarmentLook::default(),
            image: None,
            trims: vec![],
        }
    }

    #[test]
    fn a_later_run_goes_on_after_the_frames_of_the_report() {
        let dir = tempfile::tempdir().expect("a folder");
        let out = dir.path();
        let garments = [dot("top")];
        let started = StartSimulationResponse {
            simulation_id: "one".into(),
            ..Default::default()
        };
        assert!(FineFiles::open(out, "one").is_err(), "no files");
        let report = FineReport::new(&started, &garments).expect("valid");
        let mut files = FineFiles::create(out, report).expect("created");
        let frame = |n: u8| FineFrame {
            positions: vec![P3::new(f32::from(n), 0.0, 0.0)],
            exposure: FrameId::default(),
            ms: 5.0,
        };
        for n in [0, 1] {
            files.push(&frame(n)).expect("written");
        }

        let other = FineFiles::open(out, "two").expect_err("another");
        assert!(other.to_string().contains("simulation one"), "{other}");
        let open = || FineFiles::open(out, "one").expect("opened");
        let wrong = open().continued("two", &[dot("skirt")]);
        assert!(
            wrong
                .expect_err("refused")
                .to_string()
                .contains("other garments")
        );
        let mut files = open().continued("two", &garments).expect("written");
        files.push(&frame(2)).expect("written");
        assert_eq!((files.len(), files.vertices()), (3, 1));
        let (shape, values) = read_npy(&out.join("positions.npy")).expect("read");
        assert_eq!((shape, values[6]), (vec![3, 1, 3], 2.0));
        let read = FineFiles::open(out, "two").expect("opened");
        assert_eq!(read.report, files.report);
    }
}
