//! The pipeline: captured picture, garments, visibility, light, blending.

use super::background::{brightness, captured, depth_from_picture};
use super::framing::Stage;
use super::input::{Input, Model, RenderError, RenderReport};
use super::occlusion::{Matte, Seen, evidence, says};
use super::shade::{Cache, Shader};
use super::surface::{Area, Surface, TILE, part_of};
use crate::camera::ColorImage;
use crate::par::{self, Par};
use crate::raster::{Cull, Options, VisibilityBuffer, rasterise_with};
use std::time::Instant;

/// Scratch of [`render`]; dropping it changes no picture.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    surface: Surface,
    matte: Matte,
    body: VisibilityBuffer,
    body_vertices: Vec<crate::math::P3>,
    depth: Vec<u16>,
    pixels: Vec<Pixel>,
    shade: Shadows,
}

/// What the samples of one picture pixel agree on.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    /// Nearest garment depth; infinity where none.
    depth: f32,
    /// Its face.
    face: u32,
    /// Samples on a garment.
    covered: u8,
    /// One surface, so that one shading will do.
    simple: bool,
}

/// Samples of one pixel farther apart than this (metres) lie on different folds and are shaded apart.
const FOLD_GAP: f32 = 0.012;
/// Rows of the picture shaded by one task.
const ROWS: usize = 8;
/// How far a contact shadow reaches, metres.
const SHADOW_REACH: f32 = 0.025;
/// What lies this far behind a garment's edge still gets its shadow, metres.
const SHADOW_DEPTH: f32 = 0.10;

/// One picture: what the camera saw with the garments on.
///
/// # Errors
/// [`RenderError`] when the input cannot be drawn; it names what is wrong.
pub fn render(
    model: &Model,
    input: &Input<'_>,
    work: &mut Workspace,
) -> Result<(ColorImage, RenderReport), RenderError> {
    input.check()?;
    let config = &model.config;
    let mut clock = Stopwatch::new();
    let mut report = RenderReport::default();

    let stage = Stage::new(input, config.framing);
    let mut image = captured(config.par, input, &stage);
    report.brightness = brightness(input);
    let mut scratch = std::mem::take(&mut work.depth);
    let depth = depth_from_picture(input, &stage, &mut scratch);
    clock.lap("captured", &mut report);

    work.surface.build(input, config);
    let reach = SHADOW_REACH * stage.camera.fx as f32 / work.surface.distance;
    let tiles = (stage.camera.width.div_ceil(TILE) * stage.camera.height.div_ceil(TILE)) as usize;
    let Some(area) = work.surface.area(&stage, 2.0 * reach + 2.0) else {
        report.tiles_skipped = tiles;
        return Ok((image, report));
    };
    let samples = config.samples.clamp(1, 4);
    work.surface.rasterise(config, &stage, &area, samples);
    resolve(config.par, &work.surface, &area, samples, &mut work.pixels);
    clock.lap("garments", &mut report);

    let tracked = draw_body(config.par, input, &stage, &area, &mut work.body, &mut work.body_vertices);
    let look_up = DepthLookUp::new(&stage, &area, depth);
    collect_evidence(model, work, &area, &look_up, tracked);
    report.specks_dropped =
        work.matte.decide(config.par, &config.margins, &stage, &area, work.surface.distance, &image);
    clock.lap("visibility", &mut report);

    work.shade.cast(&work.pixels, &work.matte.alpha, &area, samples, reach);
    clock.lap("shadows", &mut report);

    let shader = Shader::new(&work.surface, stage.camera, &model.to_srgb, &config.lights, report.brightness);
    blend(config.par, &shader, work, &area, samples, config.lights.contact, &look_up, &mut image);
    count(work, &area, samples, tiles, &mut report);
    work.depth = scratch;
    clock.lap("shading", &mut report);
    Ok((image, report))
}

struct Stopwatch(Instant);

impl Stopwatch {
    fn new() -> Self {
        Self(Instant::now())
    }
    fn lap(&mut self, stage: &'static str, report: &mut RenderReport) {
        report.stages_ms.push((stage, self.0.elapsed().as_secs_f32() * 1e3));
        self.0 = Instant::now();
    }
}

/// Sums up the samples of each pixel.
fn resolve(par: Par, surface: &Surface, area: &Area, n: u32, out: &mut Vec<Pixel>) {
    let width = area.width as usize;
    let stride = width * n as usize;
    let samples = &surface.samples;
    out.resize(area.len(), Pixel::default());
    par::for_chunks(par, out, width * ROWS, |start, chunk| {
        for (k, row) in chunk.chunks_mut(width).enumerate() {
            let y = start / width + k;
            for (x, pixel) in row.iter_mut().enumerate() {
                let mut p = Pixel { depth: f32::INFINITY, face: u32::MAX, covered: 0, simple: true };
                let mut far = 0f32;
                for sy in 0..n as usize {
                    let at = (y * n as usize + sy) * stride + x * n as usize;
                    for (d, f) in samples.depth[at..at + n as usize].iter().zip(&samples.face[at..]) {
                        if *f != VisibilityBuffer::NONE {
                            p.covered += 1;
                            far = far.max(*d);
                            if *d < p.depth {
                                if p.face != u32::MAX {
                                    p.simple &= surface.garment[p.face as usize] == surface.garment[*f as usize];
                                }
                                (p.depth, p.face) = (*d, *f);
                            } else {
                                p.simple &= surface.garment[p.face as usize] == surface.garment[*f as usize];
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
            input.calibration.color_from_depth.points_f32(body.vertices, moved);
            &moved[..]
        }
        None => body.vertices,
    };
    let crate::raster::View::Perspective { camera, near } = part_of(stage, area, 1) else { return false };
    let camera = camera.resized(area.width.div_ceil(BODY_STEP), area.height.div_ceil(BODY_STEP));
    let view = crate::raster::View::Perspective { camera, near };
    rasterise_with(Options { par, cull: Cull::Back }, &view, vertices, body.faces, out);
    true
}

/// Captured depth by pixel of the drawn area.
struct DepthLookUp<'a> {
    depth: &'a [u16],
    /// Depth column of each area column; `u32::MAX` = outside.
    columns: Vec<u32>,
    /// First index of each area row's depth row; `usize::MAX` = outside.
    rows: Vec<usize>,
}

impl<'a> DepthLookUp<'a> {
    fn new(stage: &Stage, area: &Area, depth: &'a [u16]) -> Self {
        let width = stage.depth[0] as usize;
        Self {
            depth,
            columns: (0..area.width).map(|x| stage.depth_at(0, area.left + x).unwrap_or(u32::MAX)).collect(),
            rows: (0..area.height)
                .map(|y| stage.depth_at(1, area.top + y).map_or(usize::MAX, |v| v as usize * width))
                .collect(),
        }
    }
    /// Metres, 0 = none.
    #[inline]
    fn at(&self, x: usize, y: usize) -> f32 {
        let (c, r) = (self.columns[x], self.rows[y]);
        if c == u32::MAX || r == usize::MAX { 0.0 } else { f32::from(self.depth[r + c as usize]) * 1e-3 }
    }
}

fn collect_evidence(model: &Model, work: &mut Workspace, area: &Area, depth: &DepthLookUp<'_>, tracked: bool) {
    let width = area.width as usize;
    let (pixels, surface, body) = (&work.pixels, &work.surface, &work.body);
    par::map_into(model.config.par, pixels.len(), width * ROWS, &mut work.matte.says, |i| {
        let p = &pixels[i];
        if p.covered == 0 {
            return says::OUTSIDE;
        }
        let (x, y) = (i % width, i / width);
        let step = BODY_STEP as usize;
        let body = if tracked { body.depth[y / step * body.width as usize + x / step] } else { f32::INFINITY };
        let inner = surface.inner[p.face as usize];
        evidence(&model.config.margins, &Seen { garment: p.depth, inner, captured: depth.at(x, y), body, tracked })
    });
}

/// Soft shadows between garments and what they touch, by blurred coverage.
#[derive(Clone, Debug, Default)]
struct Shadows {
    /// How much garment is around, 0 to 1.
    garment: Vec<f32>,
    /// Its depth times that.
    depth: Vec<f32>,
    /// How much occluder is around, 0 to 1.
    front: Vec<f32>,
    scratch: Vec<f32>,
}

impl Shadows {
    fn cast(&mut self, pixels: &[Pixel], alpha: &[f32], area: &Area, samples: u32, reach: f32) {
        let full = 1.0 / (samples * samples) as f32;
        let radius = (0.5 * reach).round().clamp(1.0, 24.0) as usize;
        let fill = |out: &mut Vec<f32>, f: &dyn Fn(&Pixel, f32) -> f32| {
            out.clear();
            out.extend(pixels.iter().zip(alpha).map(|(p, a)| f(p, *a)));
        };
        fill(&mut self.garment, &|p, a| f32::from(p.covered) * full * (1.0 - a));
        fill(&mut self.depth, &|p, a| {
            if p.covered > 0 { f32::from(p.covered) * full * (1.0 - a) * p.depth } else { 0.0 }
        });
        fill(&mut self.front, &|p, a| if p.covered > 0 { a } else { 0.0 });
        let any_front = alpha.iter().any(|a| *a > 0.0);
        for _ in 0..2 {
            blur(&mut self.garment, &mut self.scratch, area.width as usize, radius);
            blur(&mut self.depth, &mut self.scratch, area.width as usize, radius);
            if any_front {
                blur(&mut self.front, &mut self.scratch, area.width as usize, radius);
            }
        }
    }
}

/// Box blur of side 2·radius + 1, both ways; zero outside.
fn blur(image: &mut [f32], scratch: &mut Vec<f32>, width: usize, radius: usize) {
    let scale = 1.0 / (2 * radius + 1) as f32;
    scratch.clear();
    scratch.resize(image.len(), 0.0);
    for (row, out) in image.chunks(width).zip(scratch.chunks_mut(width)) {
        let mut sum: f32 = row.iter().take(radius).sum();
        for x in 0..width {
            sum += row.get(x + radius).copied().unwrap_or(0.0);
            out[x] = sum * scale;
            if x >= radius {
                sum -= row[x - radius];
            }
        }
    }
    let height = image.len() / width;
    let mut sums = vec![0f32; width];
    let row = |y: usize| &scratch[y * width..(y + 1) * width];
    for y in 0..radius.min(height) {
        sums.iter_mut().zip(row(y)).for_each(|(s, v)| *s += v);
    }
    for y in 0..height {
        if y + radius < height {
            sums.iter_mut().zip(row(y + radius)).for_each(|(s, v)| *s += v);
        }
        image[y * width..(y + 1) * width].iter_mut().zip(&sums).for_each(|(o, s)| *o = s * scale);
        if y >= radius {
            sums.iter_mut().zip(row(y - radius)).for_each(|(s, v)| *s -= v);
        }
    }
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
    depth: &DepthLookUp<'_>,
    image: &mut ColorImage,
) {
    let width = area.width as usize;
    let row_bytes = 3 * image.width() as usize;
    let full = 1.0 / (n * n) as f32;
    let first = area.top as usize * row_bytes;
    let last = first + area.height as usize * row_bytes;
    par::for_chunks(par, &mut image.data_mut()[first..last], row_bytes * ROWS, |start, chunk| {
        let mut cache = Cache::default();
        for (k, row) in chunk.chunks_mut(row_bytes).enumerate() {
            let y = start / row_bytes + k;
            let row = &mut row[3 * area.left as usize..3 * (area.left as usize + width)];
            for (x, out) in row.chunks_exact_mut(3).enumerate() {
                let i = y * width + x;
                let p = &work.pixels[i];
                let near = work.shade.garment[i];
                if p.covered == 0 && near < 1e-3 {
                    continue;
                }
                let cover = f32::from(p.covered) * full * (1.0 - work.matte.alpha[i]);
                let mut behind = [f32::from(out[0]), f32::from(out[1]), f32::from(out[2])];
                if cover < 1.0 && near > 1e-3 {
                    let z = depth.at(x, y);
                    let gap = z - work.shade.depth[i] / near;
                    if z > 0.0 && gap > -SHADOW_DEPTH * 0.2 && gap < SHADOW_DEPTH {
                        let fade = 1.0 - (gap / SHADOW_DEPTH).max(0.0);
                        let dark = 1.0 - contact * near * fade * (1.0 - work.matte.alpha[i]);
                        behind = behind.map(|c| c * dark);
                    }
                }
                let mut color = [0.0; 3];
                if cover > 0.0 {
                    let shadow = contact * work.shade.front[i];
                    let (u, v) = ((area.left as usize + x) as f32, (area.top as usize + y) as f32);
                    color = garment_color(shader, &mut cache, p, [x, y], [u, v], n, width, shadow);
                }
                for c in 0..3 {
                    out[c] = (behind[c] + (color[c] - behind[c]) * cover + 0.5) as u8;
                }
            }
        }
    });
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
