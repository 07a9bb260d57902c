//! Stages shared by the renderers on the processor and on the graphics card: all but rasterisation and shading.

use super::area::Area;
use super::camera_blur;
use super::captured::{brightness, captured};
use super::captured_depth::AreaDepth;
use super::captured_pixels::CapturedPixels;
use super::config::{Config, Model};
use super::coverage::remove_biases;
use super::evidence::{Evidence, PixelDepths};
use super::focus::Focus;
use super::grain;
use super::hand::{ArmScene, LayerDepths, PosedLimbs};
use super::input::{Input, RenderError};
use super::matte::MatteInput;
use super::off_person::{OffPerson, OffPersonInput};
use super::outline_blur::Outlines;
use super::own_clothes::{DressedPicture, see_face};
use super::report::{HandReport, RenderReport};
use super::room_light::RoomLight;
use super::settings::{BareArmSettings, OffPersonSettings};
use super::silhouette_grid::DressedArea;
use super::state::{CameraTraits, State};
use super::viewport::Viewport;
use super::workspace::Workspace;
use std::borrow::Cow;
use std::time::Instant;
use tryon_geometry::camera::{ColorImage, DepthImage};
use tryon_geometry::par::{self, Par};

/// Side of the tiles that are counted as drawn or skipped, pixels.
const TILE: u32 = 32;
/// Rows of the drawn area tested by one task.
const ROWS: usize = 8;

/// One picture in the making.
pub(crate) struct Composition<'a> {
    pub(crate) viewport: Viewport,
    /// The captured picture, then the result.
    pub(crate) image: ColorImage,
    pub(crate) report: RenderReport,
    /// The part of the picture that garments can touch.
    pub(crate) area: Option<Area>,
    /// Reach of contact shadows, pixels.
    shadow_reach: f32,
    /// Samples along each side of a pixel.
    pub(crate) samples: u32,
    /// There is a tracked body, in `work.body`.
    is_tracked: bool,
    /// Captured depth from the picture's camera.
    depth: Cow<'a, DepthImage>,
    clock: Instant,
}

impl<'a> Composition<'a> {
    /// Checks the input, takes the captured picture and joins the garments in `work.surface`.
    ///
    /// # Errors
    /// [`RenderError`] when the input cannot be drawn.
    pub(crate) fn begin(
        model: &Model,
        state: &mut State,
        input: &Input<'a>,
        work: &mut Workspace,
    ) -> Result<Self, RenderError> {
        input.check()?;
        let clock = Instant::now();
        let config = &model.config;
        state.focus = Focus::next(state.focus, input, &config.focus);
        let viewport = Viewport::new(input, state.focus.as_ref(), &config.focus);
        let mut composition = Self {
            image: captured(config.par, input, &viewport),
            depth: work.picture_depth.take(input, &viewport)?,
            report: RenderReport {
                brightness: brightness(input, &config.exposure),
                ..RenderReport::default()
            },
            area: None,
            shadow_reach: 0.0,
            samples: config.samples_per_side(),
            is_tracked: false,
            viewport,
            clock,
        };
        work.body.place(input);
        if config.own_clothes.are_removed {
            composition.learn_scene(config, state, input, work);
        }
        composition.lap("captured");
        work.surface.build(input, config);
        let reach = config.lights.contact_reach * viewport.camera.fx as f32 / work.surface.distance;
        composition.shadow_reach = reach;
        composition.area = work.surface.area(&viewport, 2.0 * reach + 2.0);
        Ok(composition)
    }

    /// Records the time of a stage.
    pub(crate) fn lap(&mut self, stage: &'static str) {
        let ms = self.clock.elapsed().as_secs_f32() * 1e3;
        self.report.stages_ms.push((stage, ms));
        self.clock = Instant::now();
    }

    /// Colours and depth as they were captured.
    fn captured(&self) -> CapturedPixels<'_> {
        CapturedPixels {
            viewport: &self.viewport,
            image: &self.image,
            depth: self.depth.data(),
        }
    }

    /// Learns the scene beside and behind the person.
    fn learn_scene(&self, config: &Config, state: &mut State, input: &Input<'_>, work: &Workspace) {
        let Some(color) = &input.frame.color else {
            return;
        };
        let body = input.body.as_ref();
        let vertices = body.map_or(&[][..], |body| work.body.vertices(input, body));
        let (captured, sequence) = (self.captured(), input.frame.sequence);
        (state.plate).learn(color, sequence, &captured, vertices, &config.plate);
    }

    /// Takes the own clothes beside the garments out of the captured picture.
    fn remove_own_clothes(
        &mut self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
        area: &Area,
    ) {
        let (Some(body), Some(_)) = (input.body, &input.frame.color) else {
            return;
        };
        let (captured, vertices) = (self.captured(), work.body.vertices(input, &body));
        if let Some(face) = see_face(&captured, &body, vertices, &model.config.own_clothes) {
            state.face = face;
        }
        let full = 1.0 / (self.samples * self.samples) as f32;
        let (pixels, alpha) = (&work.pixels, &work.matte.alpha);
        let cover = |[u, v]: [u32; 2]| {
            let (x, y) = (u.wrapping_sub(area.left), v.wrapping_sub(area.top));
            if x >= area.width || y >= area.height {
                return 0.0;
            }
            let i = (y * area.width + x) as usize;
            f32::from(pixels[i].covered) * full * (1.0 - alpha[i])
        };
        let picture = DressedPicture {
            config: &model.config,
            captured,
            vertices,
            body,
            plate: &state.plate,
            face: &state.face,
            light: state.room_light.as_ref(),
            to_srgb: &model.to_srgb,
        };
        if let Some((changed, report)) = work.own_clothes.replace(&picture, cover) {
            let data = self.image.data_mut();
            for (i, color) in changed {
                data[3 * i..3 * i + 3].copy_from_slice(&color);
            }
            self.report.own_clothes = Some(report);
        }
    }

    /// Draws the tracked body into `work.body`, and measures light of the room, grain and blur if that is due. Before
    /// all that depends on one of them.
    pub(crate) fn see_body(
        &mut self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
        area: &Area,
    ) {
        let config = &model.config;
        self.is_tracked = (work.body).rasterise(config.par, input, &self.viewport, area);
        if self.is_tracked {
            self.measure_room(config, state, input, work);
            self.report.light = state.room_light;
        }
        self.lap("body");
    }

    /// Decides what hides the garments of `work.pixels`, and the contact shadows: fills `work.matte` and `work.shadows`.
    /// Then measures the garments off the person, if that is due. Returns the captured depth of the area.
    pub(crate) fn resolve_visibility(
        &mut self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
        area: &Area,
    ) -> AreaDepth {
        let config = &model.config;
        remove_biases(config, &work.surface, &mut work.pixels);
        let is_tracked = self.is_tracked;
        let depth = AreaDepth::new(&self.viewport, area, self.depth.data());
        collect_evidence(model, work, area, &depth, is_tracked);
        self.lap("evidence");
        if is_tracked {
            self.report.hands = self.find_hands(&config.bare_arms, state, input, work, area);
            self.lap("hands");
        }
        self.report.specks_dropped = work.matte.decide(&MatteInput {
            par: config.par,
            margins: &config.margins,
            settings: &config.matte,
            viewport: &self.viewport,
            area,
            distance: work.surface.distance,
            guide: &self.image,
            depth: &depth.metres,
            pixels: &work.pixels,
            inner: &work.surface.inner,
        });
        self.lap("visibility");
        if is_tracked && config.own_clothes.are_removed {
            self.remove_own_clothes(model, state, input, work, area);
            self.lap("own clothes");
        }
        let full = 1.0 / (self.samples * self.samples) as f32;
        let pixels = work.pixels.iter();
        let covered = pixels.map(|p| [f32::from(p.covered) * full, p.depth]);
        (work.shadows).cast(covered, &work.matte.alpha, area, self.shadow_reach);
        self.lap("shadows");

        if state.begin_off_person(config.off_person_interval, input.frame.time_ns) {
            self.report.off_person =
                self.measure_off_person(&config.off_person, input, work, area, &depth);
            self.lap("off person");
        }
        depth
    }

    /// Measures the light of the room, and grain and blur of the camera, if that is due.
    fn measure_room(
        &self,
        config: &Config,
        state: &mut State,
        input: &Input<'_>,
        work: &Workspace,
    ) {
        let (Some(body), Some(_)) = (input.body, &input.frame.color) else {
            return;
        };
        let (settings, time_ns) = (&config.room_light, input.frame.time_ns);
        if !state.is_room_due(settings.interval, time_ns) {
            return;
        }
        let captured = self.captured();
        let vertices = work.body.vertices(input, &body);
        let light = RoomLight::measure(&captured, &body, vertices, config);
        let has_reading = |u, v| captured.metres(u, v) > 0.0;
        let camera = CameraTraits {
            grain: grain::measure(&self.image, has_reading, &config.grain),
            blur: camera_blur::measure(&self.image, has_reading, &config.blur),
        };
        state.take_room(light, camera, time_ns, settings);
    }

    /// Measures the garments off the person in the picture.
    fn measure_off_person(
        &self,
        settings: &OffPersonSettings,
        input: &Input<'_>,
        work: &Workspace,
        area: &Area,
        depth: &AreaDepth,
    ) -> Option<OffPerson> {
        let body = input.body.as_ref().map(|body| PosedLimbs {
            limbs: body.limbs,
            vertices: work.body.vertices(input, body),
        });
        let dressed = DressedArea {
            area,
            pixels: &work.pixels,
            alpha: &work.matte.alpha,
            depth: &depth.metres,
        };
        OffPerson::measure(&OffPersonInput {
            camera: &self.viewport.camera,
            settings,
            dressed,
            body,
        })
    }

    /// Marks bare hands and forearms in front of loose cloth, by their colour.
    fn find_hands(
        &self,
        settings: &BareArmSettings,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
        area: &Area,
    ) -> HandReport {
        let (Some(body), Some(_)) = (input.body, &input.frame.color) else {
            return HandReport::default();
        };
        let (pixels, depths, width) = (&work.pixels, &work.body, area.width as usize);
        let scene = ArmScene {
            view: self.captured(),
            body: PosedLimbs {
                limbs: body.limbs,
                vertices: depths.vertices(input, &body),
            },
            garments: &work.surface.vertices,
            settings,
            area,
            layers: |x: usize, y: usize| LayerDepths {
                garment: pixels[y * width + x].depth,
                trunk: depths.trunk_at(&body, x, y),
            },
        };
        work.hands.mark(state, &scene, &mut work.matte.evidence)
    }

    /// Makes the outlines of the drawn garments as soft as the camera's edges.
    pub(crate) fn soften_outlines(&mut self, par: Par, blur: f32, work: &Workspace, area: &Area) {
        let outlines = Outlines {
            area,
            pixels: &work.pixels,
            alpha: &work.matte.alpha,
            full: (self.samples * self.samples) as u8,
        };
        outlines.soften(par, blur, &mut self.image);
        self.lap("outlines");
    }

    /// The picture and its report.
    pub(crate) fn end(mut self, work: &Workspace) -> (ColorImage, RenderReport) {
        let camera = &self.viewport.camera;
        let tiles = (camera.width.div_ceil(TILE) * camera.height.div_ceil(TILE)) as usize;
        match &self.area {
            Some(area) => count_pixels(work, area, self.samples, tiles, &mut self.report),
            None => self.report.tiles_skipped = tiles,
        }
        (self.image, self.report)
    }
}

/// Evidence of each pixel of the area by itself.
fn collect_evidence(
    model: &Model,
    work: &mut Workspace,
    area: &Area,
    depth: &AreaDepth,
    is_tracked: bool,
) {
    let width = area.width as usize;
    let (pixels, surface, body) = (&work.pixels, &work.surface, &work.body);
    let evidence = |i: usize| {
        let p = &pixels[i];
        if p.covered == 0 {
            return Evidence::Outside;
        }
        let (x, y) = (i % width, i / width);
        let depths = PixelDepths {
            garment: p.depth,
            is_inner: surface.inner[p.face as usize],
            captured: depth.at(x, y),
            body: if is_tracked {
                body.at(x, y)
            } else {
                f32::INFINITY
            },
            is_tracked,
        };
        Evidence::of(&model.config.margins, &depths)
    };
    let (par, grain) = (model.config.par, width * ROWS);
    par::map_into(par, pixels.len(), grain, &mut work.matte.evidence, evidence);
}

/// Counts pixels and tiles; `tiles` is the number of all.
fn count_pixels(
    work: &Workspace,
    area: &Area,
    samples: u32,
    tiles: usize,
    report: &mut RenderReport,
) {
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
