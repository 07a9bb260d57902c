//! Cameras of public data sets whose folders have no `camera.json`, by the folder's name.
//!
//! TUM RGB-D benchmark ("Intrinsic camera calibration of the Kinect"; Sturm et al., IROS 2012) and the Bonn RGB-D dynamic
//! dataset (Palazzolo et al., IROS 2019): 640 × 480, depth registered to colour, 5000 units per metre.

use crate::CameraFile;
use std::path::Path;
use tryon_geometry::camera::{Distortion, Intrinsics, Lens, LensCalibration};
use tryon_geometry::math::Rigid;

/// Units of a metre in both data sets.
const DEPTH_SCALE: f64 = 5000.0;

/// Published parameters of a camera, pixels.
struct PublishedCamera {
    /// Words of a folder's name that state it.
    names: &'static [&'static str],
    /// fx, fy, cx, cy.
    pinhole: [f64; 4],
    /// k₁, k₂, k₃ and p₁, p₂.
    radial: [f64; 3],
    tangential: [f64; 2],
}

const CAMERAS: [PublishedCamera; 4] = [
    PublishedCamera {
        names: &["freiburg1", "fr1"],
        pinhole: [517.306_408, 516.469_215, 318.643_040, 255.313_989],
        radial: [0.262_383, -0.953_104, 1.163_314],
        tangential: [-0.005_358, 0.002_628],
    },
    PublishedCamera {
        names: &["freiburg2", "fr2"],
        pinhole: [520.908_620, 521.007_327, 325.141_442, 249.701_764],
        radial: [0.231_222, -0.784_899, 0.917_205],
        tangential: [-0.003_257, -0.000_105],
    },
    PublishedCamera {
        names: &["freiburg3", "fr3"],
        pinhole: [535.4, 539.2, 320.1, 247.6],
        radial: [0.0; 3],
        tangential: [0.0; 2],
    },
    PublishedCamera {
        names: &["bonn"],
        pinhole: [542.822_841, 542.576_870, 315.593_520, 237.756_098],
        radial: [0.039_903, -0.099_343, 0.0],
        tangential: [-0.000_730, -0.000_144],
    },
];

/// Camera that the folder's name states; `None` if it states none.
pub(super) fn camera_of(folder: &Path) -> Option<CameraFile> {
    let whole = folder.canonicalize().ok()?;
    let name = whole.file_name()?.to_str()?.to_ascii_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
    let states = |c: &&PublishedCamera| c.names.iter().any(|n| words.contains(n));
    CAMERAS.iter().find(states).map(PublishedCamera::file)
}

impl PublishedCamera {
    fn file(&self) -> CameraFile {
        let [fx, fy, cx, cy] = self.pinhole;
        let [k1, k2, k3] = self.radial;
        let depth = Lens {
            intrinsics: Intrinsics {
                width: 640,
                height: 480,
                fx,
                fy,
                cx,
                cy,
            },
            distortion: Distortion {
                radial: [k1, k2, k3, 0.0, 0.0, 0.0],
                tangential: self.tangential,
                limit: None,
            },
        };
        CameraFile {
            lenses: LensCalibration {
                depth,
                color: None,
                color_from_depth: Rigid::identity(),
            },
            depth_scale: DEPTH_SCALE,
            color_time_offset_s: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_stated_camera_is_known() {
        let root = tempfile::tempdir().expect("temporary folder");
        for (name, fx) in [
            ("rgbd_dataset_freiburg1_xyz", Some(517.306_408)),
            ("fr2_desk", Some(520.908_620)),
            ("rgbd_dataset_freiburg3_walking_static", Some(535.4)),
            ("rgbd_bonn_balloon", Some(542.822_841)),
            ("freiburg10", None),
            ("bonnet", None),
            ("recording", None),
        ] {
            let folder = root.path().join(name);
            std::fs::create_dir(&folder).expect("created");
            let found = camera_of(&folder).map(|c| c.lenses.depth.intrinsics.fx);
            assert_eq!(found, fx, "{name}");
        }
    }
}
