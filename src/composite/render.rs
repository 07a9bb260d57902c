//! The pipeline: captured picture, garments, visibility, light, blending.

use super::background::{brightness, captured, depth_from_picture};
use super::framing::Stage;
use super::hand::HandReport;
use super::hand::{self, Behind, Hands};
use super::input::{Input, Model, RenderError, RenderReport};
use super::occlusion::{Matte, Seen, evidence, says};
use super::shade::{Cache, Shader};
use super::shadow::Shadows;
use super::skin::State;
use super::surface::{Area, Surface, TILE, part_of};
use crate::camera::ColorImage;
use crate::par::{self, Par};
use crate::raster::{Cull, Options, VisibilityBuffer, rasterise_with};
use std::borrow::Cow;
use std::time::Instant;

/// Scratch of [`render`]; dropping it changes no picture.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    pub(crate) surface: Surface,
    pub(crate) matte: Matte,
    pub(crate) pixels: Vec<Pixel>,
    pub(crate) shade: Shadows,
    body: VisibilityBuffer,
    body_vertices: Vec<crate::math::P3>,
    hands: Hands,
}

/// What the samples of one picture pixel agree on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pixel {
    /// Nearest garment depth; infinity where none.
    pub(crate) depth: f32,
    /// Its face.
    pub(crate) face: u32,
    /// Samples on a garment.
    pub(crate) covered: u8,
    /// One surface, so that one shading will do.
    pub(crate) simple: bool,
}

/// Samples of one pixel farther apart than this (metres) lie on different folds and are shaded apart.
pub(crate) const FOLD_GAP: f32 = 0.012;
/// Rows of the picture shaded by one task.
const ROWS: usize = 8;
/// How far a contact shadow reaches, metres.
const SHADOW_REACH: f32 = 0.025;

/// One picture: what the camera saw with the garments on. `state` is one person's in front of one camera.
///
/// # Errors
/// [`RenderError`] when the input cannot be drawn; it names what is wrong.
pub fn render(
    model: &Model,
    state: &mut State,
    input: &Input<'_>,
    work: &mut Workspace,
) -> Result<(ColorImage, RenderReport), RenderError> {
    let config = &model.config;
    state.keep_if(input.body.is_some());
    let mut scene = Scene::begin(model, input, work)?;
    let Some(area) = scene.area else {
        return Ok(scene.end(work));
    };
    let samples = config.samples.clamp(1, 4);
    scene.report.faces_hidden = work.surface.rasterise(config, &scene.stage, &area, samples);
    work.surface
        .seen
        .reset(work.surface.faces.len(), !config.skip_unseen);
    resolve(config.par, &work.surface, &area, samples, &mut work.pixels);
    scene.report.garments_hidden = work.surface.garments_hidden();
    scene.lap("garments");
    scene.report.normals_skipped = work.surface.light();
    scene.lap("normals");

    let look_up = scene.judge(model, state, input, work, &area);
    let shader = Shader::new(
        &work.surface,
        scene.stage.camera,
        &model.to_srgb,
        &config.lights,
        scene.report.brightness,
    );
    blend(
        config.par,
        &shader,
        work,
        &area,
        samples,
        config.lights.contact,
        &look_up,
        &mut scene.image,
    );
    scene.lap("shading");
    Ok(scene.end(work))
}

/// What the processor's and the graphics card's renderer share: everything but drawing and shading.
pub(crate) struct Scene<'a> {
    pub(crate) stage: Stage,
    /// The captured picture, then the result.
    pub(crate) image: ColorImage,
    pub(crate) report: RenderReport,
    /// What garments can touch.
    pub(crate) area: Option<Area>,
    /// Reach of shadows, pixels.
    reach: f32,
    samples: u32,
    depth: Cow<'a, [u16]>,
    clock: Instant,
}

impl<'a> Scene<'a> {
    pub(crate) fn begin(
        model: &Model,
        input: &Input<'a>,
        work: &mut Workspace,
    ) -> Result<Self, RenderError> {
        input.check()?;
        let clock = Instant::now();
        let config = &model.config;
        let stage = Stage::new(input, config.framing);
        let mut scene = Self {
            image: captured(config.par, input, &stage),
            depth: depth_from_picture(input, &stage),
            report: RenderReport {
                brightness: brightness(input),
                ..RenderReport::default()
            },
            area: None,
            reach: 0.0,
            samples: config.samples.clamp(1, 4),
            stage,
            clock,
        };
        scene.lap("captured");
        work.surface.build(input, config);
        scene.reach = SHADOW_REACH * stage.camera.fx as f32 / work.surface.distance;
        scene.area = work.surface.area(&stage, 2.0 * scene.reach + 2.0);
        Ok(scene)
    }

    pub(crate) fn lap(&mut self, stage: &'static str) {
        self.report
            .stages_ms
            .push((stage, self.clock.elapsed().as_secs_f32() * 1e3));
        self.clock = Instant::now();
    }

    /// From `work.pixels` to what hides them and the shadows between.
    pub(crate) fn judge(
        &mut self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
        area: &Area,
    ) -> DepthLookUp {
        let config = &model.config;
        let tracked = draw_body(
            config.par,
            input,
            &self.stage,
            area,
            &mut work.body,
            &mut work.body_vertices,
        );
        let look_up = DepthLookUp::new(&self.stage, area, &self.depth);
        collect_evidence(model, work, area, &look_up, tracked);
        self.lap("evidence");
        if tracked {
            self.report.hands = self.find_hands(state, input, work, area);
            self.lap("hands");
        }
        self.report.specks_dropped = work.matte.decide(
            config.par,
            &config.margins,
            &self.stage,
            area,
            work.surface.distance,
            &self.image,
            &look_up.metres,
        );
        self.lap("visibility");
        let full = 1.0 / (self.samples * self.samples) as f32;
        let covered = work
            .pixels
            .iter()
            .map(|p| [f32::from(p.covered) * full, p.depth]);
        work.shade
            .cast(covered, &work.matte.alpha, area, self.reach);
        self.lap("shadows");
        look_up
    }

    /// Bare hands and forearms in front of loose cloth, by their colour.
    fn find_hands(
        &self,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
        area: &Area,
    ) -> HandReport {
        let (Some(body), Some(_)) = (input.body, &input.frame.color) else {
            return HandReport::default();
        };
        let vertices = if input.calibration.color.is_some() {
            &work.body_vertices
        } else {
            body.vertices
        };
        let seen = hand::Seen {
            stage: &self.stage,
            image: &self.image,
            depth: &self.depth,
        };
        let (pixels, drawn, width) = (&work.pixels, &work.body, area.width as usize);
        let behind = |x: usize, y: usize| {
            let at = y / BODY_STEP as usize * drawn.width as usize + x / BODY_STEP as usize;
            let trunk = body
                .faces
                .get(drawn.face[at] as usize)
                .is_some_and(|f| !body.limbs.is_arm(f[0]));
            let trunk = if trunk {
                drawn.depth[at]
            } else {
                f32::INFINITY
            };
            Behind {
                garment: pixels[y * width + x].depth,
                trunk,
            }
        };
        let body = hand::Body {
            limbs: body.limbs,
            vertices,
        };
        work.hands.mark(
            state,
            &seen,
            &body,
            &work.surface.vertices,
            area,
            &mut work.matte.says,
            behind,
        )
    }

    pub(crate) fn end(mut self, work: &Workspace) -> (ColorImage, RenderReport) {
        let tiles = (self.stage.camera.width.div_ceil(TILE)
            * self.stage.camera.height.div_ceil(TILE)) as usize;
        match &self.area {
            Some(area) => count(work, area, self.samples, tiles, &mut self.report),
            None => self.report.tiles_skipped = tiles,
        }
        (self.image, self.report)
    }
}

/// Sums up the samples of each pixel, and marks the faces they see.
fn resolve(par: Par, surface: &Surface, area: &Area, n: u32, out: &mut Vec<Pixel>) {
    let width = area.width as usize;
    let stride = width * n as usize;
    let samples = &surface.samples;
    out.resize(area.len(), Pixel::default());
    par::for_chunks(par, out, width * ROWS, |start, chunk| {
        // Neighbours mostly see the same face.
        let mut last = VisibilityBuffer::NONE;
        for (k, row) in chunk.chunks_mut(width).enumerate() {
            let y = start / width + k;
            for (x, pixel) in row.iter_mut().enumerate() {
                let mut p = Pixel {
                    depth: f32::INFINITY,
                    face: u32::MAX,
                    covered: 0,
                    simple: true,
                };
                let first = y * n as usize * stride + x * n as usize;
                let id = samples.face[first];
                if (0..n as usize).all(|sy| {
                    samples.face[first + sy * stride..][..n as usize]
                        .iter()
                        .all(|f| *f == id)
                }) {
                    if id != VisibilityBuffer::NONE {
                        if id != last {
                            surface.seen.set(id);
                            last = id;
                        }
                        (p.face, p.covered) = (id, (n * n) as u8);
                        for sy in 0..n as usize {
                            for d in &samples.depth[first + sy * stride..][..n as usize] {
                                p.depth = p.depth.min(*d);
                            }
                        }
                    }
                    *pixel = p;
                    continue;
                }
                let mut far = 0f32;
                for sy in 0..n as usize {
                    let at = (y * n as usize + sy) * stride + x * n as usize;
                    for (d, f) in samples.depth[at..at + n as usize]
                        .iter()
                        .zip(&samples.face[at..])
                    {
                        if *f != VisibilityBuffer::NONE {
                            surface.seen.set(*f);
                            p.covered += 1;
                            far = far.max(*d);
                            if *d < p.depth {
                                if p.face != u32::MAX {
                                    p.simple &= surface.garment[p.face as usize]
                                        == surface.garment[*f as usize];
                                }
                                (p.depth, p.face) = (*d, *f);
                            } else {
                                p.simple &= surface.garment[p.face as usize]
                                    == surface.garment[*f as usize];
                            }
                        }
                    }
                }
                p.simple &= far - p.depth < FOLD_GAP;
                *pixel = p;
            }
        }
    });
}

/// Output pixels a side of one pixel of the body's depth: it only tells limbs from trunk.
const BODY_STEP: u32 = 2;

fn draw_body(
    par: Par,
    input: &Input<'_>,
    stage: &Stage,
    area: &Area,
    out: &mut VisibilityBuffer,
    moved: &mut Vec<crate::math::P3>,
) -> bool {
    let Some(body) = input.body else { return false };
    let vertices = match input.calibration.color {
        Some(_) => {
            input
                .calibration
                .color_from_depth
                .points_f32(body.vertices, moved);
            &moved[..]
        }
        None => body.vertices,
    };
    let crate::raster::View::Perspective { camera, near } = part_of(stage, area, 1) else {
        return false;
    };
    let camera = camera.resized(
        area.width.div_ceil(BODY_STEP),
        area.height.div_ceil(BODY_STEP),
    );
    let view = crate::raster::View::Perspective { camera, near };
    rasterise_with(
        Options {
            par,
            cull: Cull::Back,
            ..Options::default()
        },
        &view,
        vertices,
        body.faces,
        out,
    );
    true
}

/// Captured depth by pixel of the drawn area, metres, 0 = none.
pub(crate) struct DepthLookUp {
    pub(crate) metres: Vec<f32>,
    width: usize,
}

impl DepthLookUp {
    fn new(stage: &Stage, area: &Area, depth: &[u16]) -> Self {
        let width = stage.depth[0] as usize;
        let columns: Vec<Option<u32>> = (0..area.width)
            .map(|x| stage.depth_at(0, area.left + x))
            .collect();
        let mut metres = Vec::with_capacity(area.len());
        for y in 0..area.height {
            match stage.depth_at(1, area.top + y) {
                Some(v) => {
                    let row = &depth[v as usize * width..(v as usize + 1) * width];
                    metres.extend(
                        columns
                            .iter()
                            .map(|c| c.map_or(0.0, |c| f32::from(row[c as usize]) * 1e-3)),
                    );
                }
                None => metres.resize(metres.len() + area.width as usize, 0.0),
            }
        }
        Self {
            metres,
            width: area.width as usize,
        }
    }
    #[inline]
    fn at(&self, x: usize, y: usize) -> f32 {
        self.metres[y * self.width + x]
    }
}

fn collect_evidence(
    model: &Model,
    work: &mut Workspace,
    area: &Area,
    depth: &DepthLookUp,
    tracked: bool,
) {
    let width = area.width as usize;
    let (pixels, surface, body) = (&work.pixels, &work.surface, &work.body);
    par::map_into(
        model.config.par,
        pixels.len(),
        width * ROWS,
        &mut work.matte.says,
        |i| {
            let p = &pixels[i];
            if p.covered == 0 {
                return says::OUTSIDE;
            }
            let (x, y) = (i % width, i / width);
            let step = BODY_STEP as usize;
            let body = if tracked {
                body.depth[y / step * body.width as usize + x / step]
            } else {
                f32::INFINITY
            };
            let inner = surface.inner[p.face as usize];
            evidence(
                &model.config.margins,
                &Seen {
                    garment: p.depth,
                    inner,
                    captured: depth.at(x, y),
                    body,
                    tracked,
                },
            )
        },
    );
}

/// Pass two: garments over the captured picture, by coverage and visibility.
#[allow(clippy::too_many_arguments)] // one call, all of it read-only but the last
fn blend(
    par: Par,
    shader: &Shader<'_>,
    work: &Workspace,
    area: &Area,
    n: u32,
    contact: f32,
    depth: &DepthLookUp,
    image: &mut ColorImage,
) {
    let width = area.width as usize;
    let row_bytes = 3 * image.width() as usize;
    let full = 1.0 / (n * n) as f32;
    let first = area.top as usize * row_bytes;
    let last = first + area.height as usize * row_bytes;
    par::for_chunks(
        par,
        &mut image.data_mut()[first..last],
        row_bytes * ROWS,
        |start, chunk| {
            let mut cache = Cache::default();
            for (k, row) in chunk.chunks_mut(row_bytes).enumerate() {
                let y = start / row_bytes + k;
                let row = &mut row[3 * area.left as usize..3 * (area.left as usize + width)];
                for (x, out) in row.chunks_exact_mut(3).enumerate() {
                    let i = y * width + x;
                    let p = &work.pixels[i];
                    if p.covered == 0 && work.shade.is_far(x, y) {
                        continue;
                    }
                    let around = work.shade.at(x, y);
                    let cover = f32::from(p.covered) * full * (1.0 - work.matte.alpha[i]);
                    let mut behind = [f32::from(out[0]), f32::from(out[1]), f32::from(out[2])];
                    if cover < 1.0 {
                        let dark = around.on_captured(contact, depth.at(x, y), work.matte.alpha[i]);
                        behind = behind.map(|c| c * dark);
                    }
                    let mut color = [0.0; 3];
                    if cover > 0.0 {
                        let shadow = contact * around.front;
                        let (u, v) = (
                            (area.left as usize + x) as f32,
                            (area.top as usize + y) as f32,
                        );
                        color =
                            garment_color(shader, &mut cache, p, [x, y], [u, v], n, width, shadow);
                    }
                    for c in 0..3 {
                        out[c] = (behind[c] + (color[c] - behind[c]) * cover + 0.5) as u8;
                    }
                }
            }
        },
    );
}

/// Mean sRGB of the garment samples of a pixel.
#[allow(clippy::too_many_arguments)]
#[inline]
fn garment_color(
    shader: &Shader<'_>,
    cache: &mut Cache,
    p: &Pixel,
    [x, y]: [usize; 2],
    [u, v]: [f32; 2],
    n: u32,
    width: usize,
    shadow: f32,
) -> [f32; 3] {
    if p.simple {
        return shader.color(cache, p.face, u, v, shadow);
    }
    let n = n as usize;
    let offset = |s: usize| (s as f32 + 0.5) / n as f32 - 0.5;
    let mut sum = [0.0; 3];
    for sy in 0..n {
        for sx in 0..n {
            let face = shader.surface.samples.face[(y * n + sy) * width * n + x * n + sx];
            if face != VisibilityBuffer::NONE {
                let c = shader.color(cache, face, u + offset(sx), v + offset(sy), shadow);
                (0..3).for_each(|k| sum[k] += c[k]);
            }
        }
    }
    sum.map(|s| s / f32::from(p.covered))
}

fn count(work: &Workspace, area: &Area, samples: u32, tiles: usize, report: &mut RenderReport) {
    let width = area.width as usize;
    let across = area.width.div_ceil(TILE) as usize + 1;
    let down = area.height.div_ceil(TILE) as usize + 1;
    let mut touched = vec![false; across * down];
    let (x0, y0) = ((area.left % TILE) as usize, (area.top % TILE) as usize);
    let full = (samples * samples) as u8;
    for (i, (p, a)) in work.pixels.iter().zip(&work.matte.alpha).enumerate() {
        if p.covered == 0 {
            continue;
        }
        let (x, y) = (i % width, i / width);
        touched[(y + y0) / TILE as usize * across + (x + x0) / TILE as usize] = true;
        if *a >= 0.5 {
            report.pixels_occluded += usize::from(p.covered == full);
        } else {
            report.pixels_drawn += 1;
        }
    }
    report.tiles_drawn = touched.iter().filter(|t| **t).count();
    report.tiles_skipped = tiles - report.tiles_drawn;
}

#[cfg(test)]
mod tests {
    use super::super::fixture::Scenery;
    use super::*;
    use crate::composite::{Config, GarmentView, Margins};
    use crate::mesh::{Face, face_normal};

    #[test]
    fn the_arm_hides_the_shirt_and_noise_does_not() {
        for seed in [1, 2] {
            let s = Scenery::new(640, 480, seed);
            let garments = [s.garment()];
            for body in [true, false] {
                let mut input = s.input(&garments, None);
                if !body {
                    input.body = None;
                }
                let (image, report) = render(
                    &Model::default(),
                    &mut State::default(),
                    &input,
                    &mut Workspace::default(),
                )
                .expect("drawn");
                let [arm, shirt] = s.mistakes(&image, 3);
                assert!(
                    arm < 0.01 && shirt < 0.001,
                    "body {body}: arm {arm}, shirt {shirt}, {report:?}"
                );
                // What the plain test makes of it: the oracle must see holes, or this test proves nothing.
                let plain = Margins {
                    plain: 0.0,
                    limb: 0.0,
                    covered: 0.0,
                    inner: 0.0,
                    clear: 0.0,
                    step: 0.0,
                    patch: 0.0,
                };
                let naive = Model::new(Config {
                    margins: plain,
                    ..Config::default()
                });
                let (image, _) = render(
                    &naive,
                    &mut State::default(),
                    &input,
                    &mut Workspace::default(),
                )
                .expect("drawn");
                assert!(s.mistakes(&image, 3)[1] > 0.01);
            }
        }
    }

    #[test]
    fn nothing_changes_outside_the_garments() {
        let s = Scenery::new(320, 240, 3);
        let captured = s.frame.color.as_ref().expect("colour");
        let none = s.input(&[], None);
        let (image, report) = render(
            &Model::default(),
            &mut State::default(),
            &none,
            &mut Workspace::default(),
        )
        .expect("drawn");
        assert_eq!(
            (&image, report.tiles_drawn, report.tiles_skipped),
            (captured, 0, 80)
        );
        let garments = [s.garment()];
        let (image, report) = render(
            &Model::default(),
            &mut State::default(),
            &s.input(&garments, None),
            &mut Workspace::default(),
        )
        .expect("drawn");
        // The shirt spans about 87 columns; far from it every byte is the captured one.
        for y in 0..240 {
            for x in (0..60).chain(260..320) {
                assert_eq!(image.at(x, y), captured.at(x, y));
            }
        }
        assert!(
            report.tiles_drawn < 50 && report.tiles_drawn + report.tiles_skipped == 80,
            "{report:?}"
        );
        assert!(
            report.pixels_drawn > 3000 && report.pixels_occluded > 300,
            "{report:?}"
        );
    }

    #[test]
    fn same_picture_at_any_thread_count_and_from_a_used_workspace() {
        let s = Scenery::new(320, 240, 4);
        let garments = [s.garment(), s.garment()];
        let input = s.input(&garments, Some([400, 300]));
        let with = |par, work: &mut Workspace| {
            render(
                &Model::new(Config {
                    par,
                    ..Config::default()
                }),
                &mut State::default(),
                &input,
                work,
            )
            .expect("drawn")
            .0
        };
        let alone = with(Par::Seq, &mut Workspace::default());
        let mut used = Workspace::default();
        render(
            &Model::default(),
            &mut State::default(),
            &s.input(&garments[..1], None),
            &mut used,
        )
        .expect("drawn");
        for threads in [1, 3] {
            let got = par::with_threads(threads, || with(Par::Rayon, &mut used)).expect("pool");
            assert!(got == alone, "{threads} threads");
        }
    }

    #[test]
    fn what_is_not_seen_costs_nothing_and_changes_no_byte() {
        let s = Scenery::new(320, 240, 6);
        // The shirt twice, and one inside the body's outline that no sample sees.
        let mut under = s.garment();
        let small: Vec<_> = under
            .vertices
            .iter()
            .map(|p| crate::math::P3::new(0.5 * p.x, 0.5 * p.y, p.z))
            .collect();
        under.vertices = &small;
        let garments = [under, s.garment(), s.garment()];
        let vertices: usize = garments.iter().map(|g| g.vertices.len()).sum();
        let faces: usize = garments.iter().map(|g| g.faces.len()).sum();
        for par in [Par::Seq, Par::Rayon] {
            for samples in [1, 2, 3] {
                let with = |skip_hidden, skip_unseen| {
                    let config = Config {
                        skip_hidden,
                        skip_unseen,
                        par,
                        samples,
                        ..Config::default()
                    };
                    let work = &mut Workspace::default();
                    render(
                        &Model::new(config),
                        &mut State::default(),
                        &s.input(&garments, None),
                        work,
                    )
                    .expect("drawn")
                };
                let (all, plain) = with(false, false);
                assert_eq!(
                    [
                        plain.faces_hidden,
                        plain.normals_skipped,
                        plain.garments_hidden
                    ],
                    [0; 3]
                );
                for switches in [[true, false], [false, true], [true, true]] {
                    let (image, report) = with(switches[0], switches[1]);
                    assert!(image == all, "{switches:?}");
                    // Five of six walls lie behind the nearest; faces between samples and at outlines do not count.
                    assert_eq!(
                        report.faces_hidden > faces * 2 / 5,
                        switches[0],
                        "{report:?} of {faces}"
                    );
                    assert_eq!(
                        report.normals_skipped > vertices * 3 / 5,
                        switches[1],
                        "{report:?} of {vertices}"
                    );
                    assert_eq!(report.garments_hidden, 2 * usize::from(switches[1]));
                    assert_eq!(report.pixels_drawn, plain.pixels_drawn);
                }
            }
        }
    }

    #[test]
    fn a_fold_that_comes_through_from_inside_is_not_seen() {
        let s = Scenery::new(320, 240, 4);
        let shirt = s.garment();
        // Its front once more, 5 mm nearer and inside out.
        let n = shirt.vertices.len() as u32;
        let nearer = shirt.vertices.iter().map(|p| p * (1.0 - 5e-3 / p.z));
        let vertices: Vec<_> = shirt.vertices.iter().copied().chain(nearer).collect();
        let front = |f: &&Face| {
            face_normal(shirt.vertices, f).dot(&shirt.vertices[f[0] as usize].coords) < 0.0
        };
        let through = shirt
            .faces
            .iter()
            .filter(front)
            .map(|f| [f[0] + n, f[2] + n, f[1] + n]);
        let faces: Vec<_> = shirt.faces.iter().copied().chain(through).collect();
        let uv = shirt.uv.repeat(2);
        let folded = GarmentView {
            vertices: &vertices,
            faces: &faces,
            uv: &uv,
            normals: &[],
            ..shirt
        };
        for skip_hidden in [true, false] {
            let changed = |inside_offset: f32| {
                let model = Model::new(Config {
                    inside_offset,
                    skip_hidden,
                    ..Config::default()
                });
                let [a, b] = [s.garment(), folded].map(|g| {
                    render(
                        &model,
                        &mut State::default(),
                        &s.input(&[g], None),
                        &mut Workspace::default(),
                    )
                    .expect("drawn")
                    .0
                });
                (0..240)
                    .flat_map(|y| (0..320).map(move |x| (x, y)))
                    .filter(|(x, y)| a.at(*x, *y) != b.at(*x, *y))
                    .count()
            };
            let [shown, hidden] = [changed(0.0), changed(Config::default().inside_offset)];
            assert!(shown > 3000 && hidden < shown / 100, "{shown} {hidden}");
        }
    }

    #[test]
    fn faults_are_named() {
        let s = Scenery::new(160, 120, 5);
        let draw = |g: GarmentView<'_>| {
            render(
                &Model::default(),
                &mut State::default(),
                &s.input(&[g], None),
                &mut Workspace::default(),
            )
            .err()
        };
        let mut g = s.garment();
        let uv = [[0.0; 2]; 3];
        g.uv = &uv;
        let what = "texture coordinates";
        assert_eq!(
            draw(g),
            Some(RenderError::Length {
                garment: 0,
                what,
                got: 3,
                vertices: s.shirt.0.len()
            })
        );
        let mut g = s.garment();
        let faces = [[0, 1, 2], [0, 1, 99_999]];
        g.faces = &faces;
        assert_eq!(
            draw(g),
            Some(RenderError::Face {
                garment: 0,
                face: 1
            })
        );
        // Degenerate, behind the camera, beside the picture: nothing is drawn, nothing breaks.
        for points in [
            [[0.0, 0.0, 2.0]; 3],
            [[0.1, 0.0, -1.0], [0.0, 0.1, -1.0], [0.0; 3]],
            [[9.0, 0.0, 1.0]; 3],
        ] {
            let points = points.map(crate::math::P3::from);
            let mut g = s.garment();
            (g.vertices, g.uv, g.faces) = (&points, &[], &[[0, 1, 2]]);
            let garments = [g];
            let (_, r) = render(
                &Model::default(),
                &mut State::default(),
                &s.input(&garments, None),
                &mut Workspace::default(),
            )
            .expect("fine");
            assert_eq!(r.pixels_drawn, 0);
        }
    }
}
