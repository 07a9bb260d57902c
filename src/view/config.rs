//! Settings of the compositor; immutable while a session runs.

use super::settings::{
    BareArmSettings, BlurSettings, ExposureSettings, FocusSettings, GrainSettings, MatteSettings,
    OffPersonSettings, OwnClothesSettings, PlateSettings, RoomLevelSettings, RoomLightSettings,
};
use super::srgb::ToSrgb;
use tryon_geometry::par::Par;
use tryon_geometry::settings;

settings! {
    /// Light in the room, in units in which a white wall facing the camera comes out as about 0.9.
    pub struct Lights {
        /// Direction of "up" in the camera's frame; the default suits a level camera.
        pub up: [f32; 3] = [0.0, -1.0, 0.0],
        /// Light from above (ceiling).
        pub sky: f32 = 0.66,
        /// Light from below (floor).
        pub ground: f32 = 0.36,
        /// Towards the key lamp, camera frame.
        pub key_direction: [f32; 3] = [-0.35, -0.62, -0.70],
        /// Strength of the key lamp.
        pub key: f32 = 0.52,
        /// Share of the light on the inner side of a garment (neck hole, sleeve ends).
        pub inside: f32 = 0.42,
        /// Strength of contact shadows: of a garment on what lies behind its edge, of an arm on the cloth; 0 = none.
        pub contact: f32 = 0.4,
        /// Reach of a contact shadow across the picture, metres.
        pub contact_reach: f32 = 0.025,
        /// Reach of a contact shadow behind a garment's edge, metres.
        pub contact_depth: f32 = 0.10,
        /// Ambient light lost in a fold whose flanks rise at 45°.
        pub fold_shade: f32 = 1.2,
        /// Share of the difference of a vertex's normal from those around it that is added to it: folds of a few edges, which
        /// the mean of face normals flattens (docs/benchmarks/folds.md).
        pub fold_gain: f32 = 1.5,
        /// Least and greatest openness.
        pub openness: [f32; 2] = [0.55, 1.1],
    }

    /// Depth margins by which a captured pixel hides a garment, metres, on top of twice the sensor's noise at that depth.
    pub struct Margins {
        /// Margin if nothing is known about the body.
        pub plain: f32 = 0.012,
        /// Margin if the tracked body itself is in front (an arm).
        pub limb: f32 = 0.004,
        /// Margin if the tracked body lies under the garment: own clothes and hair bulge by this much.
        pub covered: f32 = 0.035,
        /// Margin on the inner side of a garment, which is behind the body wherever there is a body.
        pub inner: f32 = 0.004,
        /// Further excess that some pixel of a patch must reach, else the patch counts as bulging clothes.
        pub clear: f32 = 0.012,
        /// Step in captured depth at an occluder's edge, on top of the noise.
        pub step: f32 = 0.012,
        /// Smallest patch, square metres; smaller ones are noise.
        pub patch: f32 = 6e-4,
        /// Least distance of the tracked body in front of the garment, metres; less is body that touches the garment over it.
        pub limb_gap: f32 = 0.02,
        /// Standard deviations of sensor noise added to every margin.
        pub noise_sigmas: f32 = 2.0,
        /// Share of a patch's edge on a depth step below which the patch belongs to the body under the garment.
        pub smooth_share: f32 = 0.35,
    }
}

/// Settings of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Threads.
    pub par: Par,
    /// Samples along each side of a pixel, 1 to 4. Edge error against 8×8 (grey levels) and time for 640×480 on one
    /// thread: 1 23.4, 2.8 ms; 2 9.5, 3.6 ms; 3 5.1, 4.3 ms; 4 4.6, over 5 ms.
    pub samples: u32,
    /// Margins of the visibility test.
    pub margins: Margins,
    /// Light on the garments.
    pub lights: Lights,
    /// Part of the captured picture that a cropped one shows.
    pub focus: FocusSettings,
    /// Depth bias of each garment over the one inside it, metres: layers a millimetre apart show through each other
    /// below it. Only for the depth test among garments (docs/decisions, depth biases).
    pub layer_bias: f32,
    /// Depth bias of inner sides away from the camera, metres: folds through each other, in elbows or armpits, show
    /// dark slits below it, linings vanish above it. Only for the depth test among garments.
    pub inner_bias: f32,
    /// Skips faces behind other garments or behind the garment's own front. Same picture, bit for bit; no effect on
    /// the graphics card, which tests depth in hardware.
    pub skip_hidden: bool,
    /// Computes normals and openness of visible faces only. Same picture, bit for bit; no effect on the graphics
    /// card, where visibility is known only while it shades.
    pub skip_unseen: bool,
    /// Seconds of the capture clock between two measurements of garments off the person
    /// ([`RenderReport::off_person`](super::RenderReport::off_person)); 0 = every picture, infinity = never.
    pub off_person_interval: f64,
    /// Brightness of the room while nobody is tracked, or too little surrounds the person.
    pub exposure: ExposureSettings,
    /// Mean light of the room.
    pub room_level: RoomLevelSettings,
    /// Light of the room.
    pub room_light: RoomLightSettings,
    /// Grain of the camera.
    pub grain: GrainSettings,
    /// Blur of the camera.
    pub blur: BlurSettings,
    /// Matte of the captured scene.
    pub matte: MatteSettings,
    /// Bare hands and forearms.
    pub bare_arms: BareArmSettings,
    /// Garments off the person.
    pub off_person: OffPersonSettings,
    /// The scene without the person.
    pub plate: PlateSettings,
    /// Own clothes that disappear.
    pub own_clothes: OwnClothesSettings,
}

impl Config {
    /// Samples along each side of a pixel, within the supported range.
    pub(crate) fn samples_per_side(&self) -> u32 {
        self.samples.clamp(1, 4)
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            par: Par::Rayon,
            samples: 3,
            margins: Margins::default(),
            lights: Lights::default(),
            focus: FocusSettings::default(),
            layer_bias: 15e-3,
            inner_bias: 10e-3,
            skip_hidden: true,
            skip_unseen: true,
            off_person_interval: 0.2,
            exposure: ExposureSettings::default(),
            room_level: RoomLevelSettings::default(),
            room_light: RoomLightSettings::default(),
            grain: GrainSettings::default(),
            blur: BlurSettings::default(),
            matte: MatteSettings::default(),
            bare_arms: BareArmSettings::default(),
            off_person: OffPersonSettings::default(),
            plate: PlateSettings::default(),
            own_clothes: OwnClothesSettings::default(),
        }
    }
}

/// Immutable part of compositing: settings and lookup tables.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Settings.
    pub config: Config,
    pub(crate) to_srgb: ToSrgb,
}

impl Model {
    /// A model with these settings.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            ..Self::default()
        }
    }
}
