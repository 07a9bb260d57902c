//! Extent of a run: rows, pictures, data and progress.

use super::gallery::Gallery;
use super::own_cloth::{OwnClothCase, SceneSeen};
use super::photo_match::PhotoCase;
use super::shimmer::{ShimmerCase, StillSource};
use super::visibility::VisibilityCase;
use crate::{EvaluateError, Row};
use std::path::{Path, PathBuf};
use tryon_synth::{Actor, ActorAppearance, FigureSettings, Routine, Setting, StreetClothes};

/// Person and room of a synthetic film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PersonLook {
    /// `synth`: somebody in everyday clothes, hard edges, no grain.
    Everyday,
    /// `studio`: the display figure, soft edges and grain.
    Studio,
}

impl PersonLook {
    /// Actor and setting of a routine.
    pub(super) fn scene(self, routine: Routine) -> (Actor, Setting) {
        let (actor, setting) = match self {
            Self::Everyday => (Actor::default(), Setting::default()),
            Self::Studio => (Actor::figure(), Setting::studio()),
        };
        (actor, Setting { routine, ..setting })
    }
}

/// Extent of a run.
#[derive(Clone, Debug, Default)]
pub struct PicturePlan {
    /// Folder with recordings; without it their rows are skipped.
    pub data: Option<PathBuf>,
    /// Only rows whose name contains one of these.
    pub only: Vec<String>,
    /// A third of the pictures of each row, or less.
    pub quick: bool,
    /// Folder of the sheets.
    pub pictures: Option<PathBuf>,
}

/// A row of the table.
pub(super) enum Case {
    Visibility(VisibilityCase),
    Shimmer(ShimmerCase),
    Photo(PhotoCase),
    OwnCloth(OwnClothCase),
}

const TOP: &[&str] = &["tshirt"];
const OUTFIT: &[&str] = &["tshirt", "skirt"];
const LONG: &[&str] = &["longsleeve"];

/// All rows by name; `data` is the folder of recordings.
pub(super) fn cases(data: Option<&Path>) -> Vec<(String, Case)> {
    let mut out = Vec::new();
    let looks = [
        ("studio-720", PersonLook::Studio),
        ("synth-720", PersonLook::Everyday),
    ];
    for (name, look) in looks {
        for garments in [TOP, OUTFIT, LONG] {
            let scene = format!("visibility {name} {}", garments.join("+"));
            out.push((scene, Case::Visibility(VisibilityCase { look, garments })));
        }
    }
    let recording = |name: &str| {
        data.map(|d| d.join("rgbd").join(name))
            .filter(|p| p.exists())
    };
    let mut stills = vec![
        ("studio:still", StillSource::Synth(PersonLook::Studio)),
        ("synth:still", StillSource::Synth(PersonLook::Everyday)),
    ];
    if let Some(folder) = recording("depthkit_still") {
        stills.push(("depthkit_still", StillSource::Repeated(folder)));
    }
    for (name, source) in stills {
        let scene = format!("shimmer {name}");
        let garments = OUTFIT;
        out.push((scene, Case::Shimmer(ShimmerCase { source, garments })));
    }
    for (name, repeats) in [("uva_turn", 1), ("autumn_still", 90)] {
        if let Some(folder) = recording(name) {
            let case = PhotoCase {
                folder,
                repeats,
                garments: TOP,
            };
            out.push((format!("match {name}"), Case::Photo(case)));
        }
    }
    out.extend(own_cloth_cases());
    out
}

fn own_cloth_cases() -> impl Iterator<Item = (String, Case)> {
    let plain = StreetClothes::default();
    let coat = StreetClothes {
        coat: [0.05, 0.07, 0.03],
        ..plain
    };
    let street = ActorAppearance::Street;
    let figure = ActorAppearance::Figure(FigureSettings::default());
    // Colours of everyday people, the top's near those of skin in the shade.
    let short = StreetClothes {
        top: [150, 154, 160],
        trousers: [46, 48, 56],
        has_long_sleeves: false,
        ..plain
    };
    let clothes = [
        ("sleeves", street(plain), TOP),
        ("trousers", street(plain), OUTFIT),
        ("coat", street(coat), OUTFIT),
        ("figure's leggings", figure, OUTFIT),
        ("short sleeves' trousers", street(short), OUTFIT),
    ];
    let seen = [
        ("never seen", SceneSeen::Never),
        ("seen empty", SceneSeen::Empty),
        ("walked", SceneSeen::Walked),
        ("tried on", SceneSeen::TriedOn),
    ];
    clothes
        .into_iter()
        .flat_map(move |(name, clothes, garments)| {
            seen.into_iter().map(move |(how, seen)| {
                let case = OwnClothCase {
                    clothes,
                    is_lower: name.ends_with("trousers") || name.ends_with("leggings"),
                    garments,
                    seen,
                };
                (format!("own {name}: scene {how}"), Case::OwnCloth(case))
            })
        })
}

impl Case {
    /// Measures the row.
    pub(super) fn measure(&self, progress: &Progress<'_>) -> Result<Row, EvaluateError> {
        match self {
            Self::Visibility(case) => case.measure(progress),
            Self::Shimmer(case) => case.measure(progress),
            Self::Photo(case) => case.measure(progress),
            Self::OwnCloth(case) => case.measure(progress),
        }
    }
}

/// A row in the making: its name and the folder of its sheet.
pub(super) struct Progress<'a> {
    pub(super) plan: &'a PicturePlan,
    pub(super) name: &'a str,
}

impl Progress<'_> {
    /// Name of the scene.
    pub(super) fn scene(&self) -> &str {
        self.name
    }

    /// Fewer pictures are judged.
    pub(super) fn is_quick(&self) -> bool {
        self.plan.quick
    }

    /// A sheet is wanted.
    pub(super) fn has_pictures(&self) -> bool {
        self.plan.pictures.is_some()
    }

    /// Writes the sheet of the row.
    pub(super) fn write(&self, gallery: Gallery) -> Result<(), EvaluateError> {
        let Some(folder) = &self.plan.pictures else {
            return Ok(());
        };
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '+';
        let file: String = (self.name.chars())
            .map(|c| if is_plain(c) { c } else { '_' })
            .collect();
        gallery.write(&folder.join(format!("{file}.png")))
    }
}
