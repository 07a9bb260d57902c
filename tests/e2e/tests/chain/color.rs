//! A recording with colour before the services, whose tracking has the model for it; skipped without either.

use crate::client;
use crate::consent::get;
use crate::kiosk::{Kiosk, PATIENCE, Part, Watcher};
use std::time::Instant;
use tryon::formats::shared_data;
use tryon::landmarks::shared_model;

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
