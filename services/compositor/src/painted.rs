//! Two sessions side by side whose frames and garments are painted with who they belong to: no picture shows another's.

use crate::card::Card;
use crate::encoding::Encoding;
use crate::engine::{Encoded, Engine, Job, Placed};
use crate::formats::Format;
use crate::join_buffer::JoinBuffer;
use std::sync::Arc;
use tryon::formats::image::decode_jpeg;
use tryon::geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon::geometry::math::{P3, Rigid};
use tryon_kit::compute::Pool;
use tryon_kit::frames::Exposure;
use tryon_proto::convert::garment::WornGarment;
use tryon_proto::v1::{ClothDetail, FrameId, GarmentLook};

/// Exposures of both sessions together; a debug build takes ten times as long for each.
const FRAMES: u64 = if cfg!(debug_assertions) {
    10_000
} else {
    100_000
};
const SIZE: (u32, u32) = (24, 18);
/// Exposures for which garments are late, as in a chain: they come after their frame by as many.
const LAG: u64 = 3;
/// Distance of the wall (mm) and of the garment before it (m).
const WALL_MM: u16 = 3000;
const GARMENT_M: f32 = 2.0;
/// Share of the brightest channel above which a channel counts: JPEG bleeds, shading darkens.
const STRONG: f64 = 0.6;

/// Paint of a session, and the channel that only others have.
#[derive(Clone, Copy)]
struct Paint {
    wall: [u8; 3],
    garment: u32,
    foreign: usize,
}

const PAINTS: [Paint; 2] = [
    Paint {
        wall: [200, 30, 30],
        garment: 0x1e_c8_1e,
        foreign: 2,
    },
    Paint {
        wall: [30, 30, 200],
        garment: 0xc8_1e_c8,
        foreign: 1,
    },
];

/// A session as a try-on's task holds it.
struct Session {
    paint: Paint,
    calibration: Arc<Calibration>,
    worn: Arc<WornGarment>,
    join: JoinBuffer,
    engine: Engine,
}

/// All that its pictures showed.
#[derive(Default)]
struct Seen {
    pictures: u64,
    foreign: u64,
    without_garment: u64,
}

/// A square before the wall, with both sides.
fn square(look: u32) -> WornGarment {
    WornGarment {
        garment: "square".into(),
        size: String::new(),
        vertices: 4,
        drawn: vec![0, 1, 2, 3],
        faces: vec![[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]],
        uvs: vec![[0.0; 2]; 4],
        look: GarmentLook {
            color_rgb: look,
            ..GarmentLook::default()
        },
        image: None,
        trims: vec![],
    }
}

impl Session {
    fn new(paint: Paint) -> Self {
        let k = Intrinsics::KINECT_V1.resized(SIZE.0, SIZE.1);
        Self {
            paint,
            calibration: Arc::new(Calibration::registered(k)),
            worn: Arc::new(square(paint.garment)),
            join: JoinBuffer::default(),
            engine: Engine::new(Card::default()),
        }
    }

    fn id(sequence: u64) -> FrameId {
        // The same in both sessions: ids are no help in telling them apart.
        FrameId {
            epoch: 1,
            sequence,
            capture_time_ns: sequence.wrapping_mul(33_000_000),
            received_unix_ns: 1,
            trace: 0,
        }
    }

    fn exposure(&self, sequence: u64) -> Exposure {
        let mut depth = DepthImage::empty(SIZE.0, SIZE.1);
        depth.data_mut().fill(WALL_MM);
        Exposure {
            id: Self::id(sequence),
            calibration: self.calibration.clone(),
            rgbd: RgbdFrame {
                sequence,
                time_ns: sequence * 33_000_000,
                depth,
                color: Some(ColorImage::filled(SIZE.0, SIZE.1, self.paint.wall)),
            },
            stages: vec![],
        }
    }

    fn placed(&self) -> Placed {
        let at = |x, y| P3::new(x, y, GARMENT_M);
        let corners = vec![at(-0.4, -0.4), at(0.4, -0.4), at(0.4, 0.4), at(-0.4, 0.4)];
        Placed {
            garments: vec![(self.worn.clone(), corners)],
            world_from_camera: Rigid::identity(),
            stages: vec![],
            revision: 1,
            detail: ClothDetail::Full,
        }
    }

    /// One exposure comes, and the garments of an earlier one, which is drawn.
    fn step(&mut self, sequence: u64, seen: &mut Seen) {
        self.join.push_frame(Arc::new(self.exposure(sequence)));
        let Some((_, exposure)) = self.join.find(&Self::id(sequence.wrapping_sub(LAG))) else {
            return;
        };
        let job = Job {
            exposure,
            placed: Some(Arc::new(self.placed())),
            body: None,
            formats: vec![Format {
                shape: None,
                encoding: Encoding::Jpeg(90),
            }],
            fit: None,
        };
        let mut drawn = Vec::new();
        self.engine
            .draw(&job, |p| drawn.push(p))
            .expect("a picture");
        drawn.iter().for_each(|p| seen.add(p, self.paint));
    }
}

impl Seen {
    fn add(&mut self, p: &Encoded, paint: Paint) {
        let image = decode_jpeg(&p.bytes).expect("a JPEG");
        let garment = paint.garment.to_be_bytes();
        let [mut is_foreign, mut has_garment] = [false; 2];
        for p in image.data().chunks_exact(3) {
            let most = f64::from(p.iter().copied().max().unwrap_or(0));
            let is_strong = |c: usize| f64::from(p[c]) > STRONG * most;
            is_foreign |= is_strong(paint.foreign);
            has_garment |= (0..3).all(|c| is_strong(c) == (garment[c + 1] > 128));
        }
        self.pictures += 1;
        self.foreign += u64::from(is_foreign);
        self.without_garment += u64::from(!has_garment);
    }
}

#[tokio::test]
async fn no_picture_shows_the_pixels_or_the_garment_of_another_session() {
    // One pool for both, as in a service: what it has at hand moves between them.
    let pool = Pool::new(2).expect("threads");
    let run = async |paint: Paint| {
        let (mut session, mut seen) = (Session::new(paint), Seen::default());
        for sequence in 0..FRAMES / 2 {
            let work = move || {
                session.step(sequence, &mut seen);
                (session, seen)
            };
            (session, seen) = pool.run(work).await.expect("no panic");
        }
        seen
    };
    let (a, b) = tokio::join!(run(PAINTS[0]), run(PAINTS[1]));
    for seen in [a, b] {
        assert_eq!(seen.pictures, FRAMES / 2 - LAG);
        assert_eq!((seen.foreign, seen.without_garment), (0, 0));
    }
}
