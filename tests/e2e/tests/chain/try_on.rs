//! One try-on from its opening to its end: pictures, fit, other outfits, a mesh garment, a snapshot.

use crate::client;
use crate::consent::get;
use crate::kiosk::{Kiosk, PARTS, Part, Watcher, wear};
use crate::tokens::services;
use std::time::Instant;
use tonic::Code;
use tonic::transport::Channel;
use tryon_kit::auth::Credentials;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::*;

/// Id of the try-on.
const ID: &str = "first";
/// Share of strongly coloured pixels that the colours of the fit add at least.
const FIT_COLORED: f64 = 0.02;

/// Share of a JPEG's pixels that are clearly green, blue or red.
fn colored(jpeg: &[u8]) -> f64 {
    /// Difference between channels of a strong colour, 0 to 255.
    const STRONG: u8 = 40;
    let image = tryon::formats::image::decode_jpeg(jpeg).expect("a picture");
    let strong = |p: &&[u8]| {
        p.iter()
            .max()
            .zip(p.iter().min())
            .is_some_and(|(a, b)| a - b > STRONG)
    };
    image.data().chunks_exact(3).filter(strong).count() as f64 / (image.data().len() / 3) as f64
}

/// Hoop skirt as an OBJ mesh.
fn hoop_skirt() -> String {
    let (rings, around) = (12u32, 36u32);
    let mut text = String::new();
    for k in 0..=rings {
        let t = f64::from(k) / f64::from(rings);
        let (y, r) = (0.55 + 0.45 * t, 0.24 - 0.04 * t);
        for j in 0..around {
            let t = std::f64::consts::TAU * f64::from(j) / f64::from(around);
            text.push_str(&format!("v {} {y} {}\n", r * t.cos(), -r * t.sin()));
        }
    }
    for k in 0..rings {
        for j in 0..around {
            let (a, b) = (k * around + j + 1, k * around + (j + 1) % around + 1);
            text.push_str(&format!(
                "f {a} {b} {}\nf {b} {} {}\n",
                a + around,
                b + around,
                a + around
            ));
        }
    }
    text
}

#[test]
fn a_try_on_from_its_opening_to_its_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let torn = hoop_skirt() + "f 1 2 99999\n";
    std::fs::write(folder.path().join("hoop.obj"), hoop_skirt()).expect("written");
    std::fs::write(folder.path().join("torn.obj"), torn).expect("written");
    let kiosk = Kiosk::with("synth:still", 10.0, |c| {
        c.cloth.garments = folder.path().to_owned()
    });
    client(async {
        every_part_is_healthy(&kiosk).await;
        let mut w = Watcher::open(&kiosk, ID, "front", &["tshirt"]).await;
        let first = w.next().await;
        assert!(
            matches!(first, Ok(Event::Status(_))),
            "a status comes first"
        );
        let live = w.picture(TryOnState::Live).await;
        is_whole(&live);

        let mut c = kiosk.compositor();
        let fit = hundred_pictures(&mut w, live.frame.expect("an id")).await;
        is_fit_of_a_tshirt(&fit);
        fit_in_colours(&mut c, &mut w, &live).await;
        another_outfit(&mut c, &mut w).await;
        mesh_garment(&mut c, &mut w).await;
        snapshot(&mut c).await;
        regular_end(&mut c, &mut w).await;
    });
}

async fn every_part_is_healthy(kiosk: &Kiosk) {
    use tonic_health::pb::health_check_response::ServingStatus;
    use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};
    for part in PARTS {
        let mut health = HealthClient::new(kiosk.channel(part));
        let service = format!("tryon.v1.{part:?}Service");
        let r = health.check(HealthCheckRequest { service }).await;
        let status = r.expect("health").into_inner().status();
        assert_eq!(status, ServingStatus::Serving);
        for page in ["/readyz", "/metrics"] {
            let answer = get(kiosk.admin(part), page);
            assert!(answer.starts_with(b"HTTP/1.1 200"), "{part:?} {page}");
        }
    }
    let connection = Credentials::none().present(kiosk.channel(Part::Compositor));
    let services = services(connection).await;
    assert!(services.contains(&"tryon.v1.CompositorService".to_owned()));
    let page = get(kiosk.config.compositor.address, "/");
    assert!(String::from_utf8_lossy(&page).contains("<html"), "the page");
}

/// Size, revision, codec, stages and garments off the person of the first live picture.
fn is_whole(p: &Picture) {
    assert_eq!((p.width, p.height, p.outfit_revision), (320, 240, 1));
    assert_eq!(&p.image[..2], &[0xff, 0xd8], "a JPEG");
    for stage in [
        "capture.encode",
        "tracking.total",
        "cloth.step",
        "compositor.render",
        "compositor.encode",
    ] {
        let has = p.stages.iter().any(|s| s.stage == stage);
        assert!(has, "{stage} is missing in {:?}", p.stages);
    }
    let off = p.off_person.as_ref().expect("garments are measured");
    println!("{:.1} % of the shirt are off the person", off.share * 1e2);
    assert!((0.0..0.1).contains(&off.share), "{off:?}");
}

/// Reads 99 pictures more, in order and none twice; the last fit.
async fn hundred_pictures(w: &mut Watcher, mut last: FrameId) -> Vec<GarmentFit> {
    let begun = Instant::now();
    let mut fit = Vec::new();
    for _ in 0..99 {
        let p = w.picture_where("a picture", |_| true).await;
        let id = p.frame.expect("an id");
        let is_next = id.epoch == last.epoch && id.sequence > last.sequence;
        assert!(is_next, "in order, none twice");
        (last, fit) = (id, p.fit);
    }
    let rate = 99.0 / begun.elapsed().as_secs_f64();
    println!("100 pictures, {rate:.1} a second");
    fit
}

/// A T-shirt in M is neither tight nor long on the synthetic subject: within 30 cm at the chest, 40 cm at the hem.
fn is_fit_of_a_tshirt(fit: &[GarmentFit]) {
    assert!(fit.len() == 1 && fit[0].garment == "tshirt", "{fit:?}");
    let mut regions = fit[0].regions.iter();
    let chest = regions.find(|r| r.region == "chest").expect("a chest");
    assert!(chest.fit() != FitClass::Unspecified, "{fit:?}");
    let spare = chest.ease.expect("ease") - chest.ease_needed.expect("least ease");
    let hem = fit[0].hem_above.expect("a hem");
    assert!(spare.abs() < 0.3 && hem.abs() < 0.4, "{spare} {hem}");
    assert_eq!(fit[0].hem_mark, "the crotch");
    println!(
        "the shirt has {:.1} cm to spare at the chest and ends {:.1} cm above the crotch",
        spare * 1e2,
        hem * 1e2
    );
}

async fn fit_in_colours(
    c: &mut CompositorServiceClient<Channel>,
    w: &mut Watcher,
    plain: &Picture,
) {
    let show = |id: &str, show| ShowFitRequest {
        try_on_id: id.into(),
        show,
    };
    let before = colored(&plain.image);
    c.show_fit(show(ID, true)).await.expect("shown");
    let is = |p: &Picture| colored(&p.image) > before + FIT_COLORED;
    w.picture_where("the fit in colours", is).await;
    let unknown = c.show_fit(show("nobody", true)).await;
    assert_eq!(unknown.expect_err("unknown").code(), Code::NotFound);
    c.show_fit(show(ID, false)).await.expect("hidden");
}

async fn choose(c: &mut CompositorServiceClient<Channel>, garments: Vec<GarmentChoice>) -> u64 {
    let request = ChooseGarmentsRequest {
        try_on_id: ID.into(),
        garments,
    };
    let chosen = c.choose_garments(request).await.expect("chosen");
    chosen.into_inner().outfit_revision
}

async fn another_outfit(c: &mut CompositorServiceClient<Channel>, w: &mut Watcher) {
    assert_eq!(choose(c, wear(&["skirt", "longsleeve"])).await, 2);
    let begun = Instant::now();
    let is = |p: &Picture| p.outfit_revision == 2 && p.state() == TryOnState::Live;
    let p = w.picture_where("the other outfit", is).await;
    let is_old = p.fit.iter().any(|f| f.garment == "tshirt");
    assert!(!is_old, "the fit of the old outfit: {:?}", p.fit);
    let seconds = begun.elapsed().as_secs_f64();
    println!("another outfit after {seconds:.2} s");
}

/// The mesh of the folder is offered and worn; the torn one beside it is not offered.
async fn mesh_garment(c: &mut CompositorServiceClient<Channel>, w: &mut Watcher) {
    let list = c.list_garment_choices(ListGarmentChoicesRequest {}).await;
    let offered = list.expect("listed").into_inner().garments;
    let hoop = offered.iter().find(|g| g.name == "hoop").expect("offered");
    assert!(hoop.sizes.is_empty(), "{hoop:?}");
    assert!(offered.iter().all(|g| g.name != "torn"), "{offered:?}");

    let mesh = GarmentChoice {
        garment: "hoop".into(),
        ..Default::default()
    };
    choose(c, vec![mesh]).await;
    let is = |p: &Picture| p.outfit_revision == 3 && !p.fit.is_empty();
    let p = w.picture_where("the mesh is worn", is).await;
    let is_hoop = |f: &GarmentFit| f.garment == "hoop" && f.hem_above.is_none();
    assert!(p.fit.iter().all(is_hoop), "{:?}", p.fit);
}

async fn snapshot(c: &mut CompositorServiceClient<Channel>) {
    let request = TakeSnapshotRequest {
        try_on_id: ID.into(),
        codec: 0,
    };
    let snapshot = c.take_snapshot(request).await.expect("a snapshot");
    let picture = snapshot.into_inner().picture.expect("a picture");
    assert_eq!((&picture.image[1..4], picture.width), (&b"PNG"[..], 640));
}

/// The last message is a status with CLOSED, and the stream ends with OK.
async fn regular_end(c: &mut CompositorServiceClient<Channel>, w: &mut Watcher) {
    let request = CloseTryOnRequest {
        try_on_id: ID.into(),
    };
    c.close_try_on(request).await.expect("closed");
    let mut is_closed = false;
    let end = loop {
        match w.next().await {
            Ok(Event::Status(s)) => is_closed = s.state() == TryOnState::Closed,
            Ok(Event::Picture(_)) => {}
            Err(s) => break s,
        }
    };
    assert!(is_closed && end.code() == Code::Ok, "{end}");
}
