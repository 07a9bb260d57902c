//! Rendering and encoding of one try-on's pictures.

use crate::card::Card;
use crate::encoding::Encoding;
use crate::formats::Format;
use crate::join_buffer::ReportedBody;
use crate::looks::{Looks, fit_appearance};
use crate::off_person::NewestOffPerson;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tryon::formats::image::{encode_jpeg, encode_png_rgb};
use tryon::geometry::camera::ColorImage;
use tryon::geometry::math::{Camera, Rigid, World};
use tryon::mirror::{
    CameraGarments, DrawnBody, DrawnLook, DrawnSurface, FollowedBody, FrameClock, PosedBody,
    time_step,
};
use tryon::view::{
    Appearance, Framing, Input, Model, OffPerson, OutputFrame, RenderReport, State, Workspace,
};
use tryon_kit::frames::{Exposure, stage};
use tryon_kit::telemetry::record_skipped;
use tryon_proto::convert::body::pose_from_wire;
use tryon_proto::convert::fit::tightness;
use tryon_proto::convert::garment::{PlacedGarments, WornGarment};
use tryon_proto::convert::request::PictureFormat;
use tryon_proto::v1::{ClothDetail, StageTime};

/// Garments that belong to one exposure.
pub(crate) struct Placed {
    pub(crate) garments: PlacedGarments,
    pub(crate) world_from_camera: Rigid<World, Camera>,
    pub(crate) stages: Vec<StageTime>,
    /// Revision as this service counts.
    pub(crate) revision: u64,
    pub(crate) detail: ClothDetail,
}

/// Pictures to render of one exposure.
#[derive(Clone)]
pub(crate) struct Job {
    pub(crate) exposure: Arc<Exposure>,
    /// Absent for the plain camera picture.
    pub(crate) placed: Option<Arc<Placed>>,
    pub(crate) body: Option<ReportedBody>,
    /// Most wanted first.
    pub(crate) formats: Vec<Format>,
    /// Tightness byte of each simulated vertex by garment: draws garments in the colours of their fit.
    pub(crate) fit: Option<Arc<[bytes::Bytes]>>,
}

/// One encoded picture.
pub(crate) struct Encoded {
    pub(crate) format: Format,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) bytes: bytes::Bytes,
    /// Time to draw and encode it.
    pub(crate) cost: Duration,
    /// Stages up to it.
    pub(crate) stages: Vec<StageTime>,
    /// Garments off the person as last measured in this outfit; `None` until then, and without garments.
    pub(crate) off_person: Option<OffPerson>,
}

impl Job {
    /// The format of a viewer, as jobs count them.
    pub(crate) fn wants(f: &PictureFormat) -> Format {
        Format {
            shape: f.size.map(|(width, height)| OutputFrame {
                size: [width, height],
                framing: if f.is_cropped {
                    Framing::Cover
                } else {
                    Framing::Contain
                },
            }),
            encoding: Encoding::Jpeg(f.quality),
        }
    }
}

/// The renderer of one try-on.
#[derive(Default)]
pub(crate) struct Engine {
    card: Card,
    model: Model,
    state: State,
    work: Workspace,
    posed: PosedBody,
    body: Option<(DrawnBody, FollowedBody)>,
    /// Capture times of the posed bodies.
    clock: FrameClock,
    garments: CameraGarments,
    looks: Looks,
    off_person: NewestOffPerson,
}

impl Engine {
    pub(crate) fn new(card: Card) -> Self {
        Self {
            card,
            ..Self::default()
        }
    }

    /// Renders each shape once, in the order of the formats, and delivers each picture as soon as it is encoded.
    pub(crate) fn draw(
        &mut self,
        job: &Job,
        mut deliver: impl FnMut(Encoded),
    ) -> Result<(), String> {
        let mut begun = Instant::now();
        let reported = job.body.as_ref().filter(|_| job.placed.is_some());
        let has_body = reported.is_some_and(|b| self.pose(b));
        let worn = worn_garments(job, &mut self.looks);
        if let Some(p) = &job.placed {
            let world = p.garments.iter().map(|(_, world)| world.as_slice());
            self.garments.place(&p.world_from_camera.inverse(), world);
        }
        let views = self.garments.views(worn.iter().map(Worn::surface));
        let is_dressed = !views.is_empty();
        let gap = self.clock.gap(job.exposure.rgbd.time_ns);
        let posed = self.posed.vertices();
        let body = self.body.as_mut().filter(|_| has_body);
        let body = body.map(|(drawn, followed)| {
            drawn.view(if is_dressed {
                followed.follow(posed, time_step(gap))
            } else {
                posed
            })
        });
        for shape in distinct(job.formats.iter().map(|f| f.shape)) {
            let input = Input {
                frame: &job.exposure.rgbd,
                calibration: &job.exposure.calibration,
                garments: &views,
                body,
                output: shape,
            };
            let (image, report) = self
                .card
                .draw(&self.model, &mut self.state, &input, &mut self.work)
                .map_err(|e| e.to_string())?;
            record(&report);
            let revision = job.placed.as_ref().map(|p| p.revision);
            let rendered = Rendered {
                off_person: revision.and_then(|r| self.off_person.update(r, report.off_person)),
                image,
                cost: begun.elapsed(),
                stage: stage("compositor.render", begun),
            };
            for format in job.formats.iter().filter(|f| f.shape == shape) {
                deliver(rendered.encode(job, *format)?);
            }
            begun = Instant::now();
        }
        Ok(())
    }

    /// Poses the body; `false` when its numbers do not fit, which costs only the finer occlusion.
    fn pose(&mut self, b: &ReportedBody) -> bool {
        let Some(wire) = &b.state.pose else {
            return false;
        };
        let Ok(pose) = pose_from_wire(wire, b.template.skeleton().dofs()) else {
            return false;
        };
        let is_known = |(d, _): &(DrawnBody, _)| Arc::ptr_eq(d.template(), &b.template);
        if !self.body.as_ref().is_some_and(is_known) {
            let followed = FollowedBody::new(&b.template);
            self.body = Some((DrawnBody::new(b.template.clone()), followed));
            self.posed = PosedBody::default();
        }
        self.posed.pose(&b.template, &b.shape, &pose);
        true
    }
}

/// Look of one garment of a job.
struct Worn<'a> {
    garment: &'a WornGarment,
    /// Texture coordinates and appearance of the fit map, if it is drawn.
    fit: Option<(Vec<[f32; 2]>, Appearance)>,
    look: Arc<DrawnLook>,
}

impl Worn<'_> {
    fn surface(&self) -> DrawnSurface<'_> {
        let (uv, appearance) = match &self.fit {
            Some((uv, appearance)) => (uv, appearance),
            None => (&self.look.uv, &self.look.appearance),
        };
        DrawnSurface {
            faces: &self.garment.faces,
            uv,
            vertex: &self.garment.drawn,
            places: &self.look.places,
            appearance,
        }
    }
}

/// Garments of `job`, innermost first.
fn worn_garments<'a>(job: &'a Job, looks: &mut Looks) -> Vec<Worn<'a>> {
    looks.keep(job);
    let placed = job.placed.iter().flat_map(|p| &p.garments);
    let fits = |k: usize| job.fit.as_ref()?.get(k);
    placed
        .enumerate()
        .map(|(k, (garment, _))| {
            let fit = fits(k).and_then(|bytes| fit_scale(garment, bytes));
            Worn {
                garment,
                fit: fit.map(|uv| (uv, fit_appearance())),
                look: looks.of(garment),
            }
        })
        .collect()
}

fn record(report: &RenderReport) {
    record_skipped(
        "compositor",
        [
            ("tiles", report.tiles_skipped),
            ("hidden faces", report.faces_hidden),
            ("hidden garments", report.garments_hidden),
            ("normals", report.normals_skipped),
            ("hands away from garments", report.hands.skipped),
            (
                "own clothes before a scene never seen",
                report.own_clothes.map_or(0, |own| own.left),
            ),
        ],
    );
}

/// Elements without repetitions, in order.
fn distinct<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    all.fold(Vec::new(), |mut known, x| {
        if !known.contains(&x) {
            known.push(x);
        }
        known
    })
}

/// Picture of one size.
struct Rendered {
    image: ColorImage,
    off_person: Option<OffPerson>,
    cost: Duration,
    stage: StageTime,
}

impl Rendered {
    fn encode(&self, job: &Job, format: Format) -> Result<Encoded, String> {
        let begun = Instant::now();
        let bytes = match format.encoding {
            Encoding::Jpeg(quality) => encode_jpeg(&self.image, quality),
            Encoding::Png => encode_png_rgb(&self.image, Path::new("snapshot.png")),
        };
        let before = job.placed.as_ref().map(|p| &p.stages);
        let mut stages = before.unwrap_or(&job.exposure.stages).clone();
        stages.extend([self.stage.clone(), stage("compositor.encode", begun)]);
        Ok(Encoded {
            format,
            width: self.image.width(),
            height: self.image.height(),
            bytes: bytes.map_err(|e| e.to_string())?.into(),
            cost: self.cost + begun.elapsed(),
            stages,
            off_person: self.off_person,
        })
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
