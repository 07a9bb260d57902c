//! Cloth that sleeps by region: what it saves, how far off it is, and that nothing stays behind.

use std::sync::{Mutex, MutexGuard, OnceLock};
use tryon::cloth::Config;
use tryon::geometry::par::with_threads;
use tryon_bench::OutfitSpec;
use tryon_bench::rest::{Motion, RestReport, RestingSubject};

/// A skirt and a shirt over it, edges of 2 cm.
fn subject() -> MutexGuard<'static, RestingSubject> {
    static SUBJECT: OnceLock<Mutex<RestingSubject>> = OnceLock::new();
    let dressed =
        || Mutex::new(RestingSubject::new(&outfit(&["skirt", "tshirt"], 0.02), None).unwrap());
    SUBJECT
        .get_or_init(dressed)
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn run(config: &Config, motion: Motion, steps: usize, noise: f32) -> RestReport {
    subject().run(config, motion, steps, noise).unwrap()
}

fn outfit(garments: &[&str], edge: f64) -> OutfitSpec {
    OutfitSpec {
        garments: garments.iter().map(|g| (*g).to_owned()).collect(),
        edge,
        config: Config::default(),
    }
}

fn never(base: Config) -> Config {
    Config {
        sleep: false,
        ..base
    }
}

/// Between arm and trunk cloth has two skins to lie on, and could alternate between them for ever.
#[test]
fn clothes_of_a_subject_with_hanging_arms_come_to_rest() {
    for garments in [vec!["skirt", "tshirt"], vec!["longsleeve"], vec!["hoodie"]] {
        let mut subject = RestingSubject::new(&outfit(&garments, 0.02), Some(1.3)).unwrap();
        let r = subject
            .run(&Config::default(), Motion::Standing, 30, 0.0)
            .unwrap();
        println!(
            "{garments:?}: {:?} asleep, deepest {:.2} mm",
            r.asleep,
            r.penetration * 1e3
        );
        assert!(
            r.asleep.iter().all(|a| *a == 1.0),
            "{garments:?}: {:?}",
            r.asleep
        );
        assert!(r.penetration < 2e-3, "{}", r.penetration);
    }
}

#[test]
fn a_waving_arm_leaves_the_hem_asleep_and_cloth_near_where_it_would_be() {
    for (base, noise) in [(Config::default(), 0.0), (Config::tracked(), 1.5e-3)] {
        let whole = Config {
            sleep_regions: false,
            ..base
        };
        let truth = run(&never(base), Motion::Waving, 90, noise);
        let whole_outfit = run(&whole, Motion::Waving, 30, noise);
        let r = run(&base, Motion::Waving, 90, noise);
        let apart = r.apart(&truth).map(|d| d * 1e3);
        println!(
            "asleep {:.0} % (whole outfit {:.0} %), {apart:.1?} mm apart (rms, p99, most)",
            r.mean_asleep() * 100.0,
            whole_outfit.mean_asleep() * 100.0
        );
        assert!(
            truth.mean_asleep() == 0.0 && whole_outfit.mean_asleep() < 0.2,
            "{}",
            whole_outfit.mean_asleep()
        );
        assert!(
            r.mean_asleep() > 0.2 && r.asleep[10..].iter().all(|a| *a < 0.99),
            "{}",
            r.mean_asleep()
        );
        // A hem that creeps by a centimetre a second counts as still, and stays where it fell asleep.
        assert!(apart[0] < 14.0 && apart[1] < 75.0, "{apart:?}");
        assert!(r.penetration < 2e-3, "{}", r.penetration);
    }
}

#[test]
fn nothing_stays_behind_when_the_subject_walks_off() {
    let base = Config::default();
    // A skirt swings this way or that: the mean of some edge lengths.
    let edges = [0.018, 0.019, 0.02, 0.021, 0.022];
    let mut mean = [0.0; 3];
    for edge in edges {
        let mut subject = RestingSubject::new(&outfit(&["skirt", "tshirt"], edge), None).unwrap();
        let truth = subject
            .run(&never(base), Motion::WalkingOff, 30, 0.0)
            .unwrap();
        let r = subject.run(&base, Motion::WalkingOff, 30, 0.0).unwrap();
        let apart = r.apart(&truth).map(|d| d * 1e3);
        println!(
            "asleep at the start {:.2}, then {:?}; {apart:.1?} mm apart",
            r.asleep[0],
            &r.asleep[1..4]
        );
        assert!(r.asleep[2..].iter().all(|a| *a == 0.0), "{:?}", r.asleep);
        mean.iter_mut()
            .zip(apart)
            .for_each(|(m, a)| *m += a / edges.len() as f64);
    }
    println!("mean {mean:.1?}");
    assert!(mean[0] < 15.0 && mean[2] < 100.0, "{mean:?}");
}

#[test]
fn what_sleeps_does_not_depend_on_threads() {
    let run = |threads| {
        with_threads(threads, || {
            run(&Config::tracked(), Motion::Waving, 30, 1.5e-3)
        })
        .unwrap()
    };
    let (one, two) = (run(1), run(2));
    assert!(one.positions == two.positions && one.asleep == two.asleep);
    assert!(one.mean_asleep() > 0.0);
}

/// Vertices that cannot have come near skin or another fold are not queried again; queried, they keep their place.
#[test]
fn searches_left_out_change_next_to_nothing() {
    let skip = never(Config::default());
    let ask = Config {
        cull_distant: false,
        ..skip
    };
    let (r, truth) = (
        run(&skip, Motion::Lifting, 30, 0.0),
        run(&ask, Motion::Lifting, 30, 0.0),
    );
    let apart = r.apart(&truth).map(|d| d * 1e3);
    println!(
        "left out {} in the last call, {apart:.3?} mm apart",
        r.last.searches_skipped
    );
    assert!(r.last.searches_skipped > 100, "{:?}", r.last);
    assert_eq!(truth.last.searches_skipped, 0);
    assert!(apart[0] < 2.0, "{apart:?}");
}
