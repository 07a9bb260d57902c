//! Virtual body scanner: visible points or triangles of a surface, with noise.

use super::camera_rig::CameraRig;
use super::paint::{PaintedSurface, tinted_shade};
use super::points::ScanPoints;
use super::random::{ScanSeed, gauss};
use super::sampling::{SurfaceSample, sample};
use super::surface::SceneSurface;
use super::view::ViewRing;
use tryon_geometry::math::V3;

/// Settings of the scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct ScannerSetting {
    /// Visible points.
    pub points: usize,
    /// Standard deviation of the depth noise along the view (m).
    pub noise: f64,
    /// Standard deviation of each tangential component of a normal.
    pub normal_noise: f64,
    /// Standard deviation of colour components, of 255.
    pub color_noise: f64,
    /// Colour of the lights: share by which the main light is warmer and the fill light colder than white.
    pub light_tint: f32,
    /// Depth cameras in place of the scanner; of the settings above only `points` matters to them.
    pub rig: Option<CameraRig>,
}

impl Default for ScannerSetting {
    /// A cloud of 150,000 points with 0.7 mm noise.
    fn default() -> Self {
        Self {
            points: 150_000,
            noise: 7e-4,
            normal_noise: 0.08,
            color_noise: 3.0,
            light_tint: 0.0,
            rig: None,
        }
    }
}

/// Stages with random numbers of their own.
const SAMPLING: u64 = 1;
const NOISE: u64 = 2;
const COLOR_NOISE: u64 = 3;
const NORMAL_NOISE: u64 = 4;

impl ScannerSetting {
    /// Scans a surface.
    pub(super) fn scan(&self, painted: PaintedSurface<'_>, seed: ScanSeed) -> ScanPoints {
        if let Some(rig) = &self.rig {
            return rig.scan(painted, self.points, seed);
        }
        let surface = painted.surface;
        let ring = ViewRing::draw(surface, surface.center());
        let openness = ring.openness(surface);
        let candidates = ring.candidates(surface, &openness);
        let mut rng = seed.stage(SAMPLING);
        let samples = sample(surface, &ring, &candidates, self.points, &mut rng);
        let brightness: Vec<V3> = (surface.normals.iter().zip(&openness))
            .map(|(n, open)| tinted_shade(&surface.settings, n, *open, self.light_tint))
            .collect();
        let mut out = ScanPoints::default();
        let [mut depth, mut tint, mut tilt] =
            [NOISE, COLOR_NOISE, NORMAL_NOISE].map(|stage| seed.stage(stage));
        for s in &samples {
            let color = lit_color(painted, &brightness, s);
            let color = color.map(|c| (c + gauss(&mut tint, self.color_noise)).clamp(0.0, 255.0));
            let point = s.point + s.toward * gauss(&mut depth, self.noise);
            let off = V3::from_fn(|_, _| gauss(&mut tilt, self.normal_noise));
            let normal = (s.normal + off).try_normalize(0.0).unwrap_or(s.normal);
            out.push(point, normal, color, s.label);
        }
        out
    }
}

/// Lit colour of a sample; `brightness` has the shape `[vertices]`.
fn lit_color(painted: PaintedSurface<'_>, brightness: &[V3], s: &SurfaceSample) -> [f32; 3] {
    let PaintedSurface { surface, paint } = painted;
    let face = &surface.faces[s.face as usize];
    let material = SceneSurface::blend(&surface.material, face, s.weights);
    let light = SceneSurface::blend(brightness, face, s.weights);
    let color = paint.color(s.label, &material);
    std::array::from_fn(|k| color[k] * light[k])
}
