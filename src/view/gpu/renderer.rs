//! [`crate::render`] on a graphics card.

use super::adapter::{AdapterReport, GpuError, found, report};
use super::buffers::{FabricReliefs, SceneData, fabric_reliefs, geometry, images, shadow_texels};
use super::passes::Passes;
use super::pipelines::{Pipelines, RELIEFS, STORAGE_BUFFERS, TEXELS};
use super::readback::{COVERAGE_BYTES, fetch, unpack};
use super::targets::{Targets, padded_row, write};
use crate::area::Area;
use crate::captured_depth::AreaDepth;
use crate::composition::Composition;
use crate::grain::Grain;
use crate::room_light::RoomLight;
use crate::shading::Shader;
use crate::surface::Surface;
use crate::{
    Appearance, GarmentView, ImagePyramid, Input, Model, RenderError, RenderReport, State,
    Workspace,
};
use std::sync::{Arc, Mutex};
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::P3;

/// First error the driver reported outside of a call.
type Failure = Arc<Mutex<Option<String>>>;

/// A card with all shaders compiled.
#[derive(Debug)]
pub struct Renderer {
    adapter: AdapterReport,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipelines: Pipelines,
    scene: wgpu::Buffer,
    storage: Vec<wgpu::Buffer>,
    targets: Option<Targets>,
    /// Images in the buffer of texels.
    images: Vec<Arc<ImagePyramid>>,
    /// Cloths and trims in the buffer of reliefs.
    cloths: Vec<FabricReliefs>,
    failure: Failure,
}

/// Light of the room and grain of the camera in one picture.
#[derive(Clone, Copy)]
struct LitCamera<'a> {
    room: Option<&'a RoomLight>,
    grain: Grain,
}

/// Smallest storage buffer, bytes: an empty binding is not allowed.
const MIN_STORAGE: u64 = 4096;

impl Renderer {
    /// Opens the best adapter, compiles all shaders and draws a first picture into nothing, so that the first real one
    /// is not late.
    ///
    /// # Errors
    /// When there is no adapter (with `software` false: none but software), or the driver refuses a device.
    pub fn new(software: bool) -> Result<Self, GpuError> {
        let adapter = found()
            .into_iter()
            .find(|a| software || !report(a).software)
            .ok_or(GpuError::NoAdapter)?;
        let about = report(&adapter);
        let refused = |why: String| GpuError::Device {
            adapter: about.name.clone(),
            why,
        };
        let desc = wgpu::DeviceDescriptor {
            label: Some("tryon"),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&desc))
            .map_err(|e| refused(e.to_string()))?;
        let failure = Failure::default();
        let slot = failure.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            if let Ok(mut slot) = slot.lock() {
                slot.get_or_insert_with(|| e.to_string());
            }
        }));
        let mut renderer = Self {
            adapter: about.clone(),
            pipelines: Pipelines::compile(&device),
            scene: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("scene"),
                size: size_of::<SceneData>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            storage: (0..STORAGE_BUFFERS)
                .map(|_| storage_buffer(&device, MIN_STORAGE))
                .collect(),
            device,
            queue,
            targets: None,
            images: Vec::new(),
            cloths: Vec::new(),
            failure,
        };
        renderer.warm_up().map_err(|e| refused(e.to_string()))?;
        Ok(renderer)
    }

    /// The adapter in use.
    pub fn adapter(&self) -> &AdapterReport {
        &self.adapter
    }

    fn warm_up(&mut self) -> Result<(), RenderError> {
        let camera = Intrinsics::KINECT_V1.resized(64, 48);
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::empty(camera.width, camera.height),
            color: Some(ColorImage::filled(camera.width, camera.height, [0; 3])),
        };
        let vertices = [[-0.2, 0.2, 2.0], [0.2, 0.2, 2.0], [0.0, -0.2, 2.0]].map(P3::from);
        let garment = GarmentView {
            vertices: &vertices,
            faces: &[[0, 1, 2]],
            uv: &[],
            normals: &[],
            places: &[],
            appearance: &Appearance::default(),
        };
        let input = Input {
            frame: &frame,
            calibration: &Calibration::registered(camera),
            garments: &[garment],
            body: None,
            output: None,
        };
        let (mut state, mut work) = (State::default(), Workspace::default());
        self.render(&Model::default(), &mut state, &input, &mut work)
            .map(|_| ())
    }

    /// Renders the picture of [`crate::render`] up to rounding and ties at edges.
    ///
    /// # Errors
    /// [`RenderError`] as there, and [`RenderError::Graphics`] when the card fails; the processor can then take over
    /// with the same input.
    pub fn render(
        &mut self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
    ) -> Result<(ColorImage, RenderReport), RenderError> {
        state.keep_if(input.body.is_some());
        let mut picture = Composition::begin(model, state, input, work)?;
        let Some(area) = picture.area else {
            return Ok(picture.end(work));
        };
        picture.see_body(model, state, input, work, &area);
        work.surface.visible.reset(work.surface.faces.len(), true);
        work.surface.shade_vertices(&model.config.lights);
        let lit = LitCamera {
            room: state.room_light.as_ref(),
            grain: state.grain_of(input.frame.sequence),
        };
        self.upload(model, &picture, &area, lit, work);
        let targets = self.take_targets(&area, picture.samples);
        let passes = self.passes(&targets, area, picture.samples);
        self.rasterise(&passes, work)?;
        picture.lap("garments");

        let depth = picture.resolve_visibility(model, state, input, work, &area);
        self.upload_visibility(&passes, work, &depth);
        self.shade(&passes, &mut picture.image)?;
        picture.lap("shading");
        picture.soften_outlines(model.config.par, state.blur, work, &area);
        self.targets = Some(targets);
        match self.failure.lock().ok().and_then(|mut f| f.take()) {
            Some(why) => Err(RenderError::Graphics(why)),
            None => Ok(picture.end(work)),
        }
    }

    /// Uploads camera, lights and geometry.
    fn upload(
        &mut self,
        model: &Model,
        picture: &Composition<'_>,
        area: &Area,
        lit: LitCamera<'_>,
        work: &Workspace,
    ) {
        let config = &model.config;
        let shader = Shader::new(
            &work.surface,
            picture.viewport.camera,
            &model.to_srgb,
            &config.lights,
            lit.room,
            picture.report.brightness,
        );
        let (viewport, samples) = (&picture.viewport, picture.samples);
        let data = SceneData::new(
            viewport,
            area,
            samples,
            config.inner_bias,
            &shader,
            lit.grain,
        );
        self.queue
            .write_buffer(&self.scene, 0, bytemuck::bytes_of(&data));
        for (slot, bytes) in geometry(&work.surface).iter().enumerate() {
            self.store(slot, bytes);
        }
        self.upload_images(&work.surface);
        self.upload_cloths(&work.surface);
    }

    /// Uploads yarns, surfaces and edges of the fabrics unless they are those of the last picture.
    fn upload_cloths(&mut self, surface: &Surface) {
        let fabrics: Vec<FabricReliefs> = fabric_reliefs(surface).collect();
        let mut pairs = fabrics.iter().zip(&self.cloths);
        if fabrics.len() == self.cloths.len() && pairs.all(|(a, b)| a.is(b)) {
            return;
        }
        self.cloths = fabrics;
        let reliefs: Vec<[f32; 4]> = surface.fabrics.iter().flat_map(|f| f.reliefs()).collect();
        self.store(RELIEFS, bytemuck::cast_slice(&reliefs));
    }

    /// Uploads the images of the fabrics unless they are those of the last picture.
    fn upload_images(&mut self, surface: &Surface) {
        let is_same = |(a, b): (&Arc<ImagePyramid>, &Arc<ImagePyramid>)| Arc::ptr_eq(a, b);
        let count = images(surface).count();
        if count == self.images.len() && images(surface).zip(&self.images).all(is_same) {
            return;
        }
        self.images = images(surface).cloned().collect();
        let texels: Vec<u32> = self
            .images
            .iter()
            .flat_map(|i| i.texels())
            .copied()
            .collect();
        self.store(TEXELS, bytemuck::cast_slice(&texels));
    }

    /// Writes a storage buffer, a larger one where it has to be.
    fn store(&mut self, slot: usize, bytes: &[u8]) {
        let buffer = &mut self.storage[slot];
        if buffer.size() < bytes.len() as u64 {
            *buffer = storage_buffer(&self.device, bytes.len().next_power_of_two() as u64);
        }
        self.queue.write_buffer(buffer, 0, bytes);
    }

    /// The targets of the last picture if they fit, else new ones.
    fn take_targets(&mut self, area: &Area, samples: u32) -> Targets {
        match self.targets.take() {
            Some(targets) if targets.fits(area.width, area.height, samples) => targets,
            _ => Targets::new(&self.device, area.width, area.height, samples),
        }
    }

    fn passes<'a>(&'a self, targets: &'a Targets, area: Area, samples: u32) -> Passes<'a> {
        let groups = (self.pipelines).bind(&self.device, &self.scene, &self.storage, targets);
        Passes {
            pipelines: &self.pipelines,
            targets,
            groups,
            area,
            samples,
        }
    }

    /// Rasterises the garments and reads the coverage of the area's pixels back into `work.pixels`.
    fn rasterise(&self, passes: &Passes<'_>, work: &mut Workspace) -> Result<(), RenderError> {
        let area = &passes.area;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        passes.draw(&mut encoder, work.surface.faces.len() as u32);
        passes.resolve(&mut encoder);
        self.queue.submit([encoder.finish()]);
        let row = padded_row(area.width, COVERAGE_BYTES);
        let out = &passes.targets.pixels_out;
        fetch(&self.device, out, row, area.height, |rows| {
            unpack(rows, area, &mut work.pixels);
        })
    }

    /// Uploads the matte with the captured depth, and the contact shadows.
    fn upload_visibility(&self, passes: &Passes<'_>, work: &Workspace, depth: &AreaDepth) {
        let (area, targets) = (&passes.area, passes.targets);
        let marks: Vec<[f32; 2]> = (work.matte.alpha.iter().zip(&depth.metres))
            .map(|(a, z)| [*a, *z])
            .collect();
        let marks = bytemuck::cast_slice(&marks);
        write(
            &self.queue,
            &targets.marks,
            [area.width, area.height],
            8,
            marks,
        );
        let size = [work.shadows.width as u32, work.shadows.height as u32];
        let texels = shadow_texels(&work.shadows);
        write(&self.queue, &targets.around, size, 16, texels);
    }

    /// Shades the garments over the captured picture in `image`.
    fn shade(&self, passes: &Passes<'_>, image: &mut ColorImage) -> Result<(), RenderError> {
        let (area, targets) = (&passes.area, passes.targets);
        let (stride, left) = (3 * image.width() as usize, 3 * area.left as usize);
        let (top, width) = (area.top as usize, area.width as usize);
        let rows = |y: usize| (top + y) * stride + left..(top + y) * stride + left + 3 * width;
        let mut rgba = Vec::with_capacity(4 * area.len());
        for y in 0..area.height as usize {
            for c in image.data()[rows(y)].chunks_exact(3) {
                rgba.extend_from_slice(&[c[0], c[1], c[2], 255]);
            }
        }
        write(
            &self.queue,
            &targets.picture,
            [area.width, area.height],
            4,
            &rgba,
        );
        let mut encoder = self.device.create_command_encoder(&Default::default());
        passes.compose(&mut encoder);
        self.queue.submit([encoder.finish()]);
        let padded = padded_row(area.width, 4);
        fetch(
            &self.device,
            &targets.picture_out,
            padded,
            area.height,
            |bytes| {
                for (y, row) in bytes.chunks_exact(padded as usize).enumerate() {
                    let out = &mut image.data_mut()[rows(y)];
                    for (o, c) in out.chunks_exact_mut(3).zip(row.chunks_exact(4)) {
                        o.copy_from_slice(&c[..3]);
                    }
                }
            },
        )
    }
}

fn storage_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("geometry"),
        size: size.max(MIN_STORAGE),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge_places;
    use crate::tests::fixture::{RED, SKIN, Scenery, draw};
    use crate::{Config, DrawnTrims, Print, ShadedCloth};
    use tryon_garment::{FabricImage, FabricLook, PlacedTrim, TrimKind};

    /// An adapter, or a loud skip; an error when everything is required.
    fn renderer() -> Option<Renderer> {
        match Renderer::new(true) {
            Ok(r) => Some(r),
            Err(e) => {
                let required = std::env::var("TRYON_REQUIRE_ALL").is_ok_and(|v| v == "1");
                assert!(!required, "no graphics adapter: {e}");
                eprintln!(
                    "SKIPPED: no graphics adapter ({e}); the card's picture was not compared"
                );
                None
            }
        }
    }

    /// Image of 256 × 128 pixels that changes smoothly.
    fn gradient() -> ColorImage {
        let pixel = |i: u32| [(i % 256) as u8, (i / 128) as u8, 128];
        ColorImage::new(256, 128, (0..256 * 128).flat_map(pixel).collect()).expect("sizes")
    }

    fn draw_on(
        card: &mut Renderer,
        model: &Model,
        input: &Input<'_>,
    ) -> Result<(ColorImage, RenderReport), RenderError> {
        card.render(
            model,
            &mut State::default(),
            input,
            &mut Workspace::default(),
        )
    }

    #[test]
    fn pictures_on_the_card_equal_those_on_the_processor() {
        let Some(mut card) = renderer() else { return };
        let mut scenery = Scenery::new(320, 240, 7);
        let prints = [
            Print::Solid,
            Print::Stripes {
                color: [240, 235, 220],
                period: 0.05,
            },
            Print::Check {
                color: [20, 20, 30],
                period: 0.06,
            },
            Print::Knit { period: 0.03 },
            Print::Scale {
                low: [58, 104, 190],
                high: [206, 58, 48],
            },
            Print::Image(Arc::new(ImagePyramid::new(&FabricImage {
                pixels: gradient(),
                metres_per_pixel: 0.02,
            }))),
        ];
        for (k, print) in prints.into_iter().enumerate() {
            scenery.appearance.pattern = print.clone();
            scenery.appearance.roughness = 0.3 * k as f32;
            for output in [None, Some([500, 300])] {
                let model = Model::new(Config {
                    samples: 1 + k as u32 % 3,
                    ..Config::default()
                });
                let garments = [scenery.garment()];
                let input = scenery.input(&garments, output);
                let (cpu, a) = draw(&model, &input).expect("processor");
                let (gpu, b) = draw_on(&mut card, &model, &input).expect("card");
                let far = cpu
                    .data()
                    .chunks(3)
                    .zip(gpu.data().chunks(3))
                    .filter(|(p, q)| p.iter().zip(*q).any(|(p, q)| p.abs_diff(*q) > 3));
                let far = far.count();
                // The rest are edges of stripes and samples exactly on an outline, which the two fill differently: at
                // most one in 200 of the picture and one in 50 of the garment (23 of 3760 measured with stripes).
                let few = far * 200 <= cpu.data().len() / 3 && far * 50 <= a.pixels_drawn;
                assert!(few, "{far} of {} differ, {print:?}", a.pixels_drawn);
                assert!(
                    a.pixels_drawn > 3000
                        && a.pixels_drawn.abs_diff(b.pixels_drawn) * 200 < a.pixels_drawn
                );
            }
        }
    }

    /// A turned slit and a button in the middle of a texture.
    fn trims_over(uv: &[[f32; 2]]) -> Option<Arc<DrawnTrims>> {
        let sum = uv.iter().fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
        let at = sum.map(|s| s / uv.len() as f32);
        let trim = |kind, size, turn| PlacedTrim {
            kind,
            at,
            size,
            turn,
        };
        let trims = [
            trim(TrimKind::Slit, [0.2, 0.05], 0.6),
            trim(TrimKind::Button, [0.04; 2], 0.0),
        ];
        DrawnTrims::new(&trims, &FabricLook::default())
    }

    #[test]
    fn cloth_on_the_card_equals_that_on_the_processor() {
        let Some(mut card) = renderer() else { return };
        let mut scenery = Scenery::resting(3, RED, SKIN, 1.0);
        let vertex: Vec<u32> = (0..scenery.uv.len() as u32).collect();
        let places = edge_places(&scenery.shirt.faces, &scenery.uv, &vertex);
        for name in ["jersey", "fleece", "denim", "silk"] {
            scenery.appearance.cloth = Some(ShadedCloth::named(name));
            scenery.appearance.trims = trims_over(&scenery.uv);
            for output in [None, Some([500, 300]), Some([1200, 900])] {
                let garments = [GarmentView {
                    places: &places,
                    ..scenery.garment()
                }];
                let input = Input {
                    body: Some(scenery.body_view()),
                    ..scenery.input(&garments, output)
                };
                let model = Model::default();
                let (cpu, a) = draw(&model, &input).expect("processor");
                let (gpu, _) = draw_on(&mut card, &model, &input).expect("card");
                let pairs = cpu.data().chunks(3).zip(gpu.data().chunks(3));
                let far = pairs.filter(|(p, q)| p.iter().zip(*q).any(|(p, q)| p.abs_diff(*q) > 3));
                let far = far.count();
                assert!(a.pixels_drawn > 3000, "{name} {output:?}");
                // Samples exactly on an outline are filled differently.
                assert!(
                    far * 50 <= a.pixels_drawn,
                    "{name}: {far} of {} differ",
                    a.pixels_drawn
                );
            }
        }
    }

    #[test]
    fn hands_on_the_card_equal_those_on_the_processor() {
        let Some(mut card) = renderer() else { return };
        let s = Scenery::resting(3, RED, SKIN, 1.0);
        let garments = [s.garment()];
        let (model, input) = (Model::default(), s.input(&garments, None));
        let (_, a) = draw(&model, &input).expect("processor");
        let (_, b) = draw_on(&mut card, &model, &input).expect("card");
        assert!(
            a.hands.known && b.hands.known && a.hands.pixels > 800,
            "{a:?} {b:?}"
        );
        // Coverage of outlines differs a little.
        assert!(
            a.hands.pixels.abs_diff(b.hands.pixels) * 50 < a.hands.pixels,
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn empty_and_invalid_input_give_the_results_of_the_processor() {
        let Some(mut card) = renderer() else { return };
        let mut scenery = Scenery::new(160, 120, 1);
        let empty = scenery.input(&[], None);
        let (image, report) = draw_on(&mut card, &Model::default(), &empty).expect("empty");
        assert_eq!(Some(&image), empty.frame.color.as_ref());
        assert_eq!(report.tiles_drawn, 0);
        scenery.shirt.vertices[3].x = f32::NAN;
        let garments = [scenery.garment()];
        let e = draw_on(
            &mut card,
            &Model::default(),
            &scenery.input(&garments, None),
        );
        assert_eq!(
            e.err(),
            Some(RenderError::NotFinite {
                garment: 0,
                vertex: 3
            })
        );
    }
}
