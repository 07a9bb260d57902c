//! Decisions of the compositor read from its pictures: the same garments in black and in white under flat light.

use super::fault;
use super::film::{DrawnScene, WornFilm};
use crate::EvaluateError;
use std::sync::Arc;
use tryon::mirror::DrawnBody;
use tryon::view::{
    Appearance, Config, ExposureSettings, GarmentView, Input, Lights, Model, RoomLightSettings,
    State, Workspace, render,
};
use tryon_body::embedded;
use tryon_geometry::camera::{ColorImage, RgbdFrame};

/// Light of a flat white sheet: below what is blown out.
const LIGHT: f32 = 0.8;

/// Compositor of signal colours, with its own memory of the person.
pub(super) struct SignalPainter {
    body: DrawnBody,
    model: Model,
    state: State,
    work: Workspace,
}

impl SignalPainter {
    /// As the chain composes, but for light, shadows and grain, which differ between garments of two colours.
    pub(super) fn new() -> Self {
        let config = Config {
            lights: Lights {
                sky: LIGHT,
                ground: LIGHT,
                key: 0.0,
                inside: 1.0,
                contact: 0.0,
                fold_shade: 0.0,
                openness: [1.0, 1.0],
                ..Lights::default()
            },
            exposure: ExposureSettings {
                range: [1.0, 1.0],
                ..ExposureSettings::default()
            },
            room_light: RoomLightSettings {
                interval: f64::INFINITY,
                ..RoomLightSettings::default()
            },
            off_person_interval: f64::INFINITY,
            ..Config::default()
        };
        Self {
            body: DrawnBody::new(Arc::clone(&embedded::template())),
            model: Model::new(config),
            state: State::default(),
            work: Workspace::default(),
        }
    }

    /// Share of each pixel that shows a garment, shape of the picture.
    pub(super) fn cover(
        &mut self,
        film: &WornFilm,
        frame: &RgbdFrame,
        scene: &DrawnScene,
    ) -> Result<Vec<f32>, EvaluateError> {
        let mut before = self.state.clone();
        let white = self.paint(film, frame, scene, [255; 3])?;
        std::mem::swap(&mut before, &mut self.state);
        let black = self.paint(film, frame, scene, [0; 3])?;
        let (white, black) = (white.data(), black.data());
        let pairs = white.chunks_exact(3).zip(black.chunks_exact(3));
        let difference = pairs.map(|(w, b)| {
            let sum: i32 = (0..3).map(|c| i32::from(w[c]) - i32::from(b[c])).sum();
            sum as f32
        });
        let mut out: Vec<f32> = difference.collect();
        let whole = out.iter().copied().fold(1.0, f32::max);
        out.iter_mut()
            .for_each(|d| *d = (*d / whole).clamp(0.0, 1.0));
        Ok(out)
    }

    fn paint(
        &mut self,
        film: &WornFilm,
        frame: &RgbdFrame,
        scene: &DrawnScene,
        base: [u8; 3],
    ) -> Result<ColorImage, EvaluateError> {
        let sheet = Appearance {
            base,
            roughness: 1.0,
            ..Appearance::default()
        };
        let meshes = scene.garments.iter().zip(&scene.faces);
        let view = |(vertices, faces)| GarmentView {
            vertices,
            faces,
            uv: &[],
            normals: &[],
            places: &[],
            appearance: &sheet,
        };
        let garments: Vec<GarmentView<'_>> = meshes
            .map(|(vertices, faces)| view((&vertices[..], &faces[..])))
            .collect();
        let input = Input {
            frame,
            calibration: film.calibration(),
            garments: &garments,
            body: Some(self.body.view(&scene.body)),
            output: None,
        };
        let painted = render(&self.model, &mut self.state, &input, &mut self.work);
        Ok(painted.map_err(fault)?.0)
    }
}
