//! Rendering and encoding: everything of a try-on that computes.

use crate::card::Card;
use crate::scene::Body;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tryon::body::{BodyShape, BoneTransforms, RestBody, Template, skin};
use tryon::camera::ColorImage;
use tryon::cloth::realtime::{self, RoomyBody};
use tryon::composite::{
    BodyView, Config, Framing, GarmentView, Input, Limbs, Look, Model, Print, State, Workspace,
};
use tryon::dressing::FIT_COLORS;
use tryon::formats::image::{encode_jpeg, encode_png_rgb};
use tryon::math::{Camera, P3, Rigid, World};
use tryon::par::Par;
use tryon_kit::frames::{Exposure, stage};
use tryon_kit::telemetry::record_skipped;
use tryon_proto::convert::body::pose_from_wire;
use tryon_proto::convert::fit::tightness;
use tryon_proto::convert::garment::{PlacedGarments, WornGarment};
use tryon_proto::convert::request::PictureFormat;
use tryon_proto::v1::{GarmentLook, StageTime};

/// Garments that belong to one exposure.
pub(crate) struct Placed {
    pub(crate) garments: PlacedGarments,
    pub(crate) world_from_camera: Rigid<World, Camera>,
    pub(crate) stages: Vec<StageTime>,
    /// Revision as this service counts.
    pub(crate) revision: u64,
}

/// How a picture leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Encoding {
    Jpeg(u8),
    Png,
}

/// What to draw, and for whom.
#[derive(Clone)]
pub(crate) struct Job {
    pub(crate) exposure: Arc<Exposure>,
    /// Absent for the plain camera picture.
    pub(crate) placed: Option<Arc<Placed>>,
    pub(crate) body: Option<Body>,
    pub(crate) formats: Vec<(Option<(u32, u32)>, Encoding)>,
    /// Draw garments in the colours of their fit, as far as it is known: a byte for each simulated vertex.
    pub(crate) fit: Option<Arc<[bytes::Bytes]>>,
}

/// One encoded picture.
pub(crate) struct Encoded {
    pub(crate) size: Option<(u32, u32)>,
    pub(crate) encoding: Encoding,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) bytes: bytes::Bytes,
}

/// What came of a job.
pub(crate) struct Drawn {
    pub(crate) pictures: Vec<Encoded>,
    pub(crate) stages: Vec<StageTime>,
}

impl Job {
    /// The format of a viewer, as jobs count them.
    pub(crate) fn wants(f: &PictureFormat) -> (Option<(u32, u32)>, Encoding) {
        (f.size, Encoding::Jpeg(f.quality))
    }
}

/// The renderer of one try-on.
#[derive(Default)]
pub(crate) struct Engine {
    card: Card,
    model: Model,
    state: State,
    work: Workspace,
    limbs: Limbs,
    rest: RestBody,
    rest_of: Option<Arc<BodyShape>>,
    bones: BoneTransforms,
    posed: Vec<P3>,
    /// Where cloth lies between parts of the body, and for which template; `None` inside where it has faults.
    roomy: Option<(Arc<Template>, Option<RoomyBody>)>,
    garments: Vec<Vec<P3>>,
}

impl Engine {
    pub(crate) fn new(card: Card) -> Self {
        // The contract says letterboxed.
        let config = Config {
            framing: Framing::Contain,
            ..Config::default()
        };
        Self {
            card,
            model: Model::new(config),
            ..Self::default()
        }
    }

    /// Draws each size once and encodes each format once.
    pub(crate) fn draw(&mut self, job: &Job) -> Result<Drawn, String> {
        let start = Instant::now();
        let has_body = job.placed.is_some() && job.body.as_ref().is_some_and(|b| self.pose(b));
        let mut stages = job
            .placed
            .as_ref()
            .map_or_else(|| job.exposure.stages.clone(), |p| p.stages.clone());
        let placed: &[(Arc<WornGarment>, Vec<P3>)] =
            job.placed.as_ref().map_or(&[], |p| &p.garments);
        let scales: Vec<Option<Vec<[f32; 2]>>> = placed
            .iter()
            .enumerate()
            .map(|(k, (w, _))| fit_scale(w, job.fit.as_ref()?.get(k)?))
            .collect();
        let of = |(scale, (w, _)): (&Option<_>, &(Arc<WornGarment>, _))| {
            scale.as_ref().map_or(look(&w.look), |_| fit_look())
        };
        let looks: Vec<Look> = scales.iter().zip(placed).map(of).collect();
        self.garments.resize_with(placed.len(), Vec::new);
        if let Some(p) = &job.placed {
            let camera_from_world = p.world_from_camera.inverse();
            for ((_, world), out) in placed.iter().zip(&mut self.garments) {
                camera_from_world.points_f32(world, out);
            }
        }
        let views: Vec<GarmentView<'_>> =
            (placed.iter().zip(&scales).zip(&self.garments).zip(&looks))
                .map(|((((w, _), scale), vertices), look)| {
                    let uv = scale.as_ref().unwrap_or(&w.uvs);
                    GarmentView {
                        vertices,
                        faces: &w.faces,
                        uv,
                        normals: &[],
                        look,
                    }
                })
                .collect();
        let faces = job
            .body
            .as_ref()
            .map_or(&[][..], |b| b.template.mesh().faces());
        // Who wears nothing here needs no room for it.
        let roomy = self
            .roomy
            .as_mut()
            .and_then(|r| r.1.as_mut())
            .filter(|_| has_body && !views.is_empty());
        let vertices = roomy.map_or(&self.posed[..], |r| r.make_room(Par::Rayon, &self.posed));
        let body = has_body.then_some(BodyView {
            vertices,
            faces,
            limbs: &self.limbs,
        });
        let (mut pictures, mut drawn) =
            (Vec::new(), Vec::<(Option<(u32, u32)>, ColorImage)>::new());
        for &(size, _) in &job.formats {
            if drawn.iter().any(|(s, _)| *s == size) {
                continue;
            }
            let input = Input {
                frame: &job.exposure.rgbd,
                calibration: &job.exposure.calibration,
                garments: &views,
                body,
                output: size.map(|(w, h)| [w, h]),
            };
            let (image, report) = self
                .card
                .draw(&self.model, &mut self.state, &input, &mut self.work)
                .map_err(|e| e.to_string())?;
            record_skipped(
                "compositor",
                [
                    ("tiles", report.tiles_skipped),
                    ("hidden faces", report.faces_hidden),
                    ("hidden garments", report.garments_hidden),
                    ("normals", report.normals_skipped),
                    ("hands away from garments", report.hands.skipped),
                ],
            );
            drawn.push((size, image));
        }
        stages.push(stage("compositor.render", start));
        let begun = Instant::now();
        for &(size, encoding) in &job.formats {
            let Some((_, image)) = drawn.iter().find(|(s, _)| *s == size) else {
                continue;
            };
            let bytes = match encoding {
                Encoding::Jpeg(quality) => encode_jpeg(image, quality),
                Encoding::Png => encode_png_rgb(image, Path::new("snapshot.png")),
            };
            let bytes = bytes.map_err(|e| e.to_string())?.into();
            pictures.push(Encoded {
                size,
                encoding,
                width: image.width(),
                height: image.height(),
                bytes,
            });
        }
        stages.push(stage("compositor.encode", begun));
        Ok(Drawn { pictures, stages })
    }

    /// Poses the body; `false` when its numbers do not fit, which costs only the finer occlusion.
    fn pose(&mut self, b: &Body) -> bool {
        let Some(Ok(pose)) = b
            .state
            .pose
            .as_ref()
            .map(|p| pose_from_wire(p, b.template.skeleton().dofs()))
        else {
            return false;
        };
        if !self
            .rest_of
            .as_ref()
            .is_some_and(|s| Arc::ptr_eq(s, &b.shape))
        {
            self.rest = b.template.personalise(&b.shape);
            self.rest_of = Some(b.shape.clone());
            self.limbs = Limbs::of(&b.template);
        }
        if !self
            .roomy
            .as_ref()
            .is_some_and(|(t, _)| Arc::ptr_eq(t, &b.template))
        {
            let made = RoomyBody::new(&b.template, &realtime::Config::tracked()).ok();
            self.roomy = Some((b.template.clone(), made));
        }
        pose.bones(b.template.skeleton(), &self.rest, &mut self.bones);
        skin(
            Par::Rayon,
            &self.rest.vertices,
            b.template.weights(),
            &self.bones,
            &mut self.posed,
        );
        true
    }
}

/// Tightness of each drawn vertex as a texture coordinate; `None` when the bytes are those of another garment.
fn fit_scale(w: &WornGarment, bytes: &[u8]) -> Option<Vec<[f32; 2]>> {
    (bytes.len() == w.vertices).then(|| {
        w.drawn
            .iter()
            .map(|v| [tightness(bytes[*v as usize]), 0.0])
            .collect()
    })
}

fn fit_look() -> Look {
    let [low, base, high] = FIT_COLORS;
    Look {
        base,
        pattern: Print::Scale { low, high },
        ..Look::default()
    }
}

fn rgb(c: u32) -> [u8; 3] {
    let [_, r, g, b] = c.to_be_bytes();
    [r, g, b]
}

fn look(l: &GarmentLook) -> Look {
    let stripes = l.stripe_width > 0.0 && l.accent_rgb != l.color_rgb;
    let pattern = if stripes {
        Print::Stripes {
            color: rgb(l.accent_rgb),
            period: 2.0 * l.stripe_width,
        }
    } else {
        Print::Solid
    };
    Look {
        base: rgb(l.color_rgb),
        pattern,
        ..Look::default()
    }
}
