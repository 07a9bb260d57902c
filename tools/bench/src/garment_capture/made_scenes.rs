//! Capture scenes of things made by others: MakeHuman's clothes on MakeHuman's bodies, moving by CMU clips.

use super::CaptureScene;
use super::settings::CaptureBenchSettings;
use crate::EvaluateError;
use crate::scans::{
    GarmentParts, ScanGarment, ScanMotion, ScanPalette, ScanScene, ScanSettings, ScannerSetting,
    SkinnedGarment,
};
use crate::scenes::subject;
use std::path::{Path, PathBuf};
use tryon::mirror::Choice;
use tryon_dressing::{MeshGarment, MeshGarmentSettings};
use tryon_formats::read_motion;
use tryon_garment::Material;
use tryon_synth::Actor;

/// Folders below the data, and the base mesh to which the clothes are bound.
const CLOTHES: &str = "garments/makehuman_clothes_cc0";
const BODIES: &str = "body/makehuman_smpl_layout";
const CLIPS: &str = "motion";
const BASE: &str = "body/makehuman_hm08_cc0/makehuman_app/3dobjs/base.obj";
/// Seed of the first scene.
const SEED: u64 = 300;

/// Scenes whose data is there.
#[derive(Clone, Debug, Default)]
pub struct MadeScenes {
    /// Scenes.
    pub scenes: Vec<CaptureScene>,
    /// Scenes left out, each with the file that is missing.
    pub skipped: Vec<String>,
}

/// Recipe of a scene.
struct MadeSpec {
    name: &'static str,
    /// Subject below [`BODIES`].
    body: &'static str,
    /// Files below [`CLOTHES`] without their ending, innermost first.
    clothes: &'static [(&'static str, GarmentParts)],
    /// The clothes follow the bones. Simulated, straps, bibs and scarves fall off, and trousers tear on wide hips.
    is_skinned: bool,
    /// File below [`CLIPS`] and the time in it at the first scan (s).
    clip: (&'static str, f64),
    palette: ScanPalette,
    /// See [`ScannerSetting::light_tint`].
    light_tint: f32,
    /// See [`CaptureScene::is_unseen`].
    is_unseen: bool,
}

/// Shoes and hats.
const ALL: GarmentParts = GarmentParts::All;
/// Suits.
const EACH: GarmentParts = GarmentParts::Each;

/// Simulated clothes of distinct colours in white light.
const PLAIN: MadeSpec = MadeSpec {
    name: "",
    body: "",
    clothes: &[],
    is_skinned: false,
    clip: ("", 0.0),
    palette: ScanPalette::Distinct,
    light_tint: 0.0,
    is_unseen: false,
};

/// The scenes, a third of them unseen.
#[rustfmt::skip]
const SPECS: [MadeSpec; 13] = [
    MadeSpec { name: "made: shirt, trousers, shoes", body: "subject_m_tall", clothes: &[("shoes01/shoes01", ALL), ("male_casualsuit04/male_casualsuit04", EACH)],
        clip: ("cmu_bvh/02_02_makehuman.bvh", 0.6), ..PLAIN },
    MadeSpec { name: "made: open jacket over shirt", body: "subject_m_heavy", clothes: &[("shoes03/shoes03", ALL), ("male_casualsuit05/male_casualsuit05", EACH)],
        is_skinned: true, clip: ("cmu_asf_amc/13_29.amc", 2.0), light_tint: 0.5, ..PLAIN },
    MadeSpec { name: "made: elegant suit", body: "subject_m_tall", clothes: &[("shoes02/shoes02", ALL), ("male_elegantsuit01/male_elegantsuit01", EACH)],
        is_skinned: true, clip: ("cmu_asf_amc/93_04.amc", 1.0), light_tint: 0.5, is_unseen: true, ..PLAIN },
    MadeSpec { name: "made: top and short skirt", body: "subject_f_avg", clothes: &[("shoes05/shoes05", ALL), ("female_elegantsuit01/female_elegantsuit01", EACH)],
        clip: ("cmu_asf_amc/13_31.amc", 2.0), light_tint: 0.5, ..PLAIN },
    MadeSpec { name: "made: low contrast", body: "subject_m_heavy", clothes: &[("shoes04/shoes04", ALL), ("male_casualsuit02/male_casualsuit02", EACH)],
        clip: ("cmu_asf_amc/02_07.amc", 2.0), palette: ScanPalette::LowContrast, ..PLAIN },
    MadeSpec { name: "made: shorts, shirt, hat", body: "subject_f_short_heavy", clothes: &[("shoes06/shoes06", ALL), ("female_casualsuit02/female_casualsuit02", EACH), ("fedora01/fedora_cocked", ALL)],
        is_skinned: true, clip: ("cmu_asf_amc/13_29.amc", 10.0), ..PLAIN },
    MadeSpec { name: "made: overalls and hat", body: "subject_m_tall", clothes: &[("shoes06/shoes06", ALL), ("male_worksuit01/male_worksuit01", EACH), ("fedora01/fedora", ALL)],
        is_skinned: true, clip: ("cmu_asf_amc/93_04.amc", 1.0), ..PLAIN },
    MadeSpec { name: "made: woman, low contrast, tinted", body: "subject_f_short_heavy", clothes: &[("shoes05/shoes05", ALL), ("female_casualsuit01/female_casualsuit01", EACH)],
        is_skinned: true, clip: ("cmu_bvh/02_03.bvh", 0.2), palette: ScanPalette::LowContrast, light_tint: 0.5, ..PLAIN },
    MadeSpec { name: "made: sportswear", body: "subject_f_avg", clothes: &[("shoes01/shoes01", ALL), ("female_sportsuit01/female_sportsuit01", EACH)],
        clip: ("cmu_asf_amc/13_31.amc", 8.0), palette: ScanPalette::LowContrast, ..PLAIN },
    MadeSpec { name: "made: suit without shoes", body: "subject_m_heavy", clothes: &[("male_casualsuit06/male_casualsuit06", EACH)],
        is_skinned: true, clip: ("cmu_asf_amc/93_04.amc", 2.5), light_tint: 0.5, is_unseen: true, ..PLAIN },
    MadeSpec { name: "made: woman in sports clothes, tinted", body: "subject_f_short_heavy", clothes: &[("shoes02/shoes02", ALL), ("female_sportsuit01/female_sportsuit01", EACH)],
        is_skinned: true, clip: ("cmu_bvh/02_03.bvh", 0.6), light_tint: 0.5, is_unseen: true, ..PLAIN },
    MadeSpec { name: "made: man, low contrast", body: "subject_m_tall", clothes: &[("shoes03/shoes03", ALL), ("male_casualsuit03/male_casualsuit03", EACH)],
        is_skinned: true, clip: ("cmu_asf_amc/02_07.amc", 1.0), palette: ScanPalette::LowContrast, is_unseen: true, ..PLAIN },
    MadeSpec { name: "made: woman, shorts and shirt", body: "subject_f_avg", clothes: &[("shoes04/shoes04", ALL), ("female_casualsuit02/female_casualsuit02", EACH)],
        is_skinned: true, clip: ("cmu_asf_amc/13_31.amc", 5.0), palette: ScanPalette::LowContrast, light_tint: 0.5, ..PLAIN },
];

/// Scenes of the data in a folder; all are skipped without one.
///
/// # Errors
/// Names the scene whose files are there but cannot be read.
pub fn made_scenes(data: Option<&Path>) -> Result<MadeScenes, EvaluateError> {
    let mut out = MadeScenes::default();
    for (k, spec) in SPECS.iter().enumerate() {
        let Some(data) = data else {
            out.skipped.push(format!("{}: no data", spec.name));
            continue;
        };
        if let Some(path) = spec.files(data).into_iter().find(|p| !p.exists()) {
            let why = format!("{}: {} is missing", spec.name, path.display());
            out.skipped.push(why);
            continue;
        }
        let scene = spec.scene(data, SEED + k as u64);
        out.scenes.push(CaptureScene {
            name: spec.name.into(),
            scene: scene.map_err(|why| EvaluateError::new(spec.name, why))?,
            is_unseen: spec.is_unseen,
        });
    }
    Ok(out)
}

impl MadeSpec {
    /// Files that the scene is made of.
    fn files(&self, data: &Path) -> Vec<PathBuf> {
        let body = data.join(BODIES).join(format!("{}.npz", self.body));
        let clothes = self
            .clothes
            .iter()
            .map(|(name, _)| clothes_file(data, name));
        let others = [body, data.join(CLIPS).join(self.clip.0), data.join(BASE)];
        clothes.chain(others).collect()
    }

    fn simulated(
        &self,
        settings: &CaptureBenchSettings,
        data: &Path,
    ) -> Result<Vec<ScanGarment>, String> {
        let cotton = Material::preset("cotton").map_err(|e| e.to_string())?;
        let base = data.join(BASE);
        let garment = |(layer, (name, _)): (u8, &(&str, GarmentParts))| {
            let mesh_settings = MeshGarmentSettings::with_edge(settings.edge);
            let file = clothes_file(data, name);
            let mesh = MeshGarment::read(&file, Some(&base), &cotton, &mesh_settings);
            let mesh = mesh.map_err(|e| format!("{name}: {e}"))?;
            Ok(Choice::mesh(mesh.in_layer(layer), None).into())
        };
        (0..).zip(self.clothes).map(garment).collect()
    }

    fn skinned(
        &self,
        settings: &CaptureBenchSettings,
        data: &Path,
    ) -> Result<Vec<SkinnedGarment>, String> {
        let (base, scan) = (data.join(BASE), ScanSettings::default());
        let read = |(name, parts): &(&str, GarmentParts)| {
            SkinnedGarment::read(
                &clothes_file(data, name),
                &base,
                *parts,
                settings.edge,
                &scan,
            )
        };
        let files: Vec<_> = self.clothes.iter().map(read).collect::<Result<_, _>>()?;
        Ok(files.concat())
    }

    fn scene(&self, data: &Path, seed: u64) -> Result<ScanScene, String> {
        let settings = CaptureBenchSettings::default();
        let (garments, skinned) = match self.is_skinned {
            true => (Vec::new(), self.skinned(&settings, data)?),
            false => (self.simulated(&settings, data)?, Vec::new()),
        };
        let (clip, start) = self.clip;
        let clip = read_motion(&data.join(CLIPS).join(clip)).map_err(|e| e.to_string())?;
        Ok(ScanScene {
            actor: Actor {
                template: subject(data, self.body).map_err(|e| e.to_string())?,
                ..Actor::default()
            },
            garments,
            skinned,
            motion: ScanMotion::Clip {
                clip: Box::new(clip),
                start,
            },
            palette: self.palette,
            scanner: ScannerSetting {
                points: settings.points,
                noise: settings.noise,
                light_tint: self.light_tint,
                ..ScannerSetting::default()
            },
            scans: settings.scans,
            rate: settings.rate,
            edge: settings.edge,
            seed,
            ..ScanScene::default()
        })
    }
}

fn clothes_file(data: &Path, name: &str) -> PathBuf {
    data.join(CLOTHES).join(format!("{name}.mhclo"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_formats::shared_data;

    #[test]
    fn without_data_all_scenes_are_skipped_by_name() {
        let none = made_scenes(None).expect("nothing to read");
        assert!(none.scenes.is_empty());
        assert_eq!(none.skipped.len(), SPECS.len());
        let nowhere = made_scenes(Some(Path::new("/nowhere"))).expect("nothing to read");
        assert!(nowhere.skipped.iter().all(|s| s.contains("/nowhere")));
    }

    #[test]
    fn a_scan_has_points_of_every_garment() {
        let Some(data) = shared_data(CLOTHES)
            .and(shared_data(BODIES))
            .and(shared_data(""))
        else {
            return;
        };
        // Shirt, trousers and shoes that are simulated; jacket, shirt, scarf, trousers and shoes that follow the bones.
        for (spec, garments) in SPECS.iter().zip([3u8, 5]) {
            let missing = spec.files(&data).into_iter().find(|p| !p.exists());
            assert_eq!(missing, None);
            let mut scene = spec.scene(&data, SEED).expect(spec.name);
            (scene.scans, scene.scanner.points) = (1, 8000);
            let scan = scene.scans().expect("a scan").remove(0);
            assert_eq!(scan.garments.len(), usize::from(garments));
            for label in 0..=garments {
                let of = scan.labels.iter().filter(|l| **l == label).count();
                assert!(of > 80, "{}, label {label}: {of} points", spec.name);
            }
        }
    }
}
