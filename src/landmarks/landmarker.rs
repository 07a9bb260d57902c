//! Finds one person's landmarks: in the region of the last frame, else by the detector.

use crate::anchors::anchors;
use crate::crop::{CropBorder, CropForm, crop};
use crate::decode::decode;
use crate::detection::likeliest_person;
use crate::network::{DETECTOR_PIXELS, LANDMARK_PIXELS, LandmarkNetwork};
use crate::{LandmarkError, LandmarkSettings, PersonRegion, PoseLandmarks, model_file};
use std::path::Path;
use std::sync::Arc;
use tryon_geometry::camera::ColorImage;

/// Input of the detector, of MediaPipe's graph `pose_detection`.
const DETECTOR_FORM: CropForm = CropForm {
    pixels: DETECTOR_PIXELS,
    range: [-1.0, 1.0],
    border: CropBorder::Black,
};
/// Input of the landmarks' network, of MediaPipe's graph `pose_landmark_by_roi`.
const LANDMARK_FORM: CropForm = CropForm {
    pixels: LANDMARK_PIXELS,
    range: [0.0, 1.0],
    border: CropBorder::Nearest,
};

/// Quarter turns of a picture.
const QUARTERS: usize = 4;

/// Finder of one person's landmarks in a stream of colour images; a clone shares the networks and follows its own person.
#[derive(Clone)]
pub struct Landmarker {
    network: Arc<LandmarkNetwork>,
    anchors: Arc<[[f32; 2]]>,
    settings: LandmarkSettings,
    /// Region of the person who is followed.
    region: Option<PersonRegion>,
    /// Quarter turns of the picture in which somebody was found last, or that are tried next.
    quarters: usize,
    /// Input of a network.
    input: Vec<f32>,
}

impl Landmarker {
    /// Loads the file that `tools/landmarks/convert` writes; 0.2 s.
    ///
    /// # Errors
    /// [`LandmarkError`] for a file that is missing, unreadable or not that one.
    pub fn open(model: impl AsRef<Path>) -> Result<Self, LandmarkError> {
        Self::open_with(model, LandmarkSettings::default())
    }

    /// [`Self::open`] with settings.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_with(
        model: impl AsRef<Path>,
        settings: LandmarkSettings,
    ) -> Result<Self, LandmarkError> {
        let content = model_file::read(model.as_ref())?;
        Ok(Self {
            network: Arc::new(LandmarkNetwork::load(content)?),
            anchors: anchors().into(),
            settings,
            region: None,
            quarters: 0,
            input: Vec::new(),
        })
    }

    /// Landmarks of the person who was found in the last image, else of the likeliest person in the picture, at any roll.
    ///
    /// `None` where nobody is found. Costs one run of the landmarks' network for a person who is followed; else also one of
    /// the detector for each quarter turn that is tried.
    ///
    /// # Errors
    /// [`LandmarkError::Network`], which a file that loaded does not give.
    pub fn find(&mut self, image: &ColorImage) -> Result<Option<PoseLandmarks>, LandmarkError> {
        let followed = match self.region.take() {
            Some(region) => self.find_in(image, region)?,
            None => None,
        };
        let pose = match followed {
            Some(pose) => Some(pose),
            None => self.search(image)?,
        };
        self.region = pose.as_ref().and_then(|pose| pose.next_region);
        Ok(pose)
    }

    /// Landmarks of a person in a region that the caller knows; `None` if it shows nobody. Changes nothing for
    /// [`Self::find`].
    ///
    /// # Errors
    /// As [`Self::find`].
    pub fn find_in(
        &mut self,
        image: &ColorImage,
        region: PersonRegion,
    ) -> Result<Option<PoseLandmarks>, LandmarkError> {
        let size = [image.width(), image.height()];
        if size.contains(&0) {
            return Ok(None);
        }
        crop(image, &region, &LANDMARK_FORM, &mut self.input);
        let output = self.network.landmarks(&self.input)?;
        if !(output.presence >= self.settings.presence) {
            return Ok(None);
        }
        decode(&output, region, size).map(Some)
    }

    /// Lets [`Self::find`] look for this person in the next image.
    pub fn follow(&mut self, region: PersonRegion) {
        self.region = Some(region);
    }

    /// Lets [`Self::find`] search the whole of the next image.
    pub fn forget(&mut self) {
        self.region = None;
    }

    /// Runs the detector on the picture's quarter turns, the last successful one first.
    fn search(&mut self, image: &ColorImage) -> Result<Option<PoseLandmarks>, LandmarkError> {
        let size = [image.width(), image.height()];
        if size.contains(&0) {
            return Ok(None);
        }
        for _ in 0..self.settings.turns.clamp(1, QUARTERS) {
            let seen = PersonRegion::whole(size, self.quarters);
            crop(image, &seen, &DETECTOR_FORM, &mut self.input);
            let output = self.network.detect(&self.input)?;
            let person = likeliest_person(&output, &self.anchors, &seen, &self.settings);
            if let Some(region) = person
                && let Some(pose) = self.find_in(image, region)?
            {
                return Ok(Some(pose));
            }
            self.quarters = (self.quarters + 1) % QUARTERS;
        }
        Ok(None)
    }
}
