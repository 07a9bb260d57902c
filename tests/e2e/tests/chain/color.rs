//! A recording with colour before the services, whose tracking has the model for it; skipped without either.

use crate::client;
use crate::consent::get;
use crate::kiosk::{Kiosk, PATIENCE, Part, Watcher, wear};
use std::time::Instant;
use tryon::formats::image::decode_jpeg;
use tryon::formats::shared_data;
use tryon::geometry::camera::ColorImage;
use tryon::landmarks::shared_model;
use tryon_proto::v1::*;

/// Value of a counter on an admin page; 0 where it isn't.
fn counter(page: &str, name: &str) -> f64 {
    let own = |line: &&str| line.starts_with(name);
    let values = page.lines().filter(own);
    let values = values.filter_map(|line| line.split_whitespace().last()?.parse::<f64>().ok());
    values.sum()
}

#[test]
fn tracking_sees_the_person_in_colour_too() {
    let (Some(model), Some(recording)) = (shared_model(), shared_data("rgbd/uva_turn")) else {
        return;
    };
    let source = recording.display().to_string();
    let kiosk = Kiosk::with(&source, 10.0, |config| config.tracking.color_model = model);
    client(async {
        let mut watcher = Watcher::open(&kiosk, "turning", "front", &["tshirt"]).await;
        let begun = Instant::now();
        loop {
            watcher.picture_where("a picture", |_| true).await;
            let page = get(kiosk.admin(Part::Tracking), "/metrics");
            let seen = counter(&String::from_utf8_lossy(&page), "tryon_tracking_sightings");
            if seen >= 2.0 {
                break;
            }
            assert!(begun.elapsed() < PATIENCE, "{seen} sightings");
        }
    });
}

/// Pixels much bluer than red.
fn blue_pixels(image: &ColorImage) -> usize {
    let is_blue = |c: &&[u8]| i32::from(c[2]) - i32::from(c[0]) > 40;
    image.data().chunks_exact(3).filter(is_blue).count()
}

#[test]
fn a_striped_shirt_is_worn_in_pictures_of_1920_by_1080() {
    let kiosk = Kiosk::start("studio-1080:still", 3.0);
    client(async {
        let mut compositor = kiosk.compositor();
        let mut garments = wear(&["tshirt"]);
        garments[0].print = Some(GarmentPrint {
            kind: GarmentPrintKind::Stripes.into(),
            color_rgb: 0x00_10_20_c0,
            period: 0.06,
        });
        let opened = compositor.open_try_on(OpenTryOnRequest {
            try_on_id: "wide".into(),
            store: String::new(),
            camera: "front".into(),
            garments,
            consent: Some(Consent { given: true }),
        });
        opened.await.expect("opens");
        let frames = compositor.stream_frames(StreamFramesRequest {
            try_on_id: "wide".into(),
            ..Default::default()
        });
        let mut watcher = Watcher {
            events: frames.await.expect("streams").into_inner(),
        };
        let picture = watcher.picture(TryOnState::Live).await;
        assert_eq!((picture.width, picture.height), (1920, 1080));
        let image = decode_jpeg(&picture.image).expect("a JPEG");
        let blue = blue_pixels(&image);
        // The shirt of somebody 2.5 m away is about 200,000 pixels, half of it stripes.
        assert!(blue > 30_000, "{blue} blue pixels");
    });
}
