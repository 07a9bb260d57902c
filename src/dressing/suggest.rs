//! Which size fits, and why.

use crate::body::measure::Measurements;
use crate::garment::{GarmentError, GarmentKind, Pattern, Placement, Size, library};

/// How a place feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// Less room than the garment needs.
    Tight,
    /// As drawn.
    Fitted,
    /// Much more room than drawn.
    Loose,
}

/// Room at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// `chest`, `waist` or `hip`.
    pub place: &'static str,
    /// Girth of the body, metres.
    pub body: f64,
    /// Girth of the finished garment, metres.
    pub garment: f64,
    /// How that feels.
    pub fit: Fit,
}

impl Room {
    /// Finished girth minus body girth, metres.
    pub fn ease(&self) -> f64 {
        self.garment - self.body
    }
}

/// A size and its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// The size.
    pub size: Size,
    /// Room at chest, waist and hip (finished girth minus body girth), metres; NaN where the garment has no girth.
    pub ease: [f64; 3],
    /// The same, place by place, where the garment has a girth.
    pub rooms: Vec<Room>,
    /// Where the hem will be, metres above the floor.
    pub hem: f64,
    /// One sentence for the shopper.
    pub reason: String,
}

/// Least room a garment must leave at chest, waist and hip, metres: a T-shirt 4 cm at the chest, a waistband none (it
/// sits lower on a fuller body) and 2 cm at the hip.
const LEAST: [f64; 3] = [0.04, -0.03, 0.02];
/// Room beyond [`LEAST`] from which a place counts as loose, metres: two sizes of the table.
const LOOSE: f64 = 0.14;
/// Height of the high point of the shoulder over stature: cervicale height 1.521 m at 1.756 m (ANSUR II, men; women's
/// 0.864), a finger below.
const SHOULDER_POINT: f64 = 0.862;
/// Height of the natural waist over stature (ANSUR II: waist height, natural indentation, 1.08 m at 1.756 m).
const WAIST_HEIGHT: f64 = 0.62;
/// Height of the middle of the knee over stature (ANSUR II: 0.49 m at 1.756 m).
const KNEE_HEIGHT: f64 = 0.279;
/// Cloth's crotch below the body's, metres.
const CROTCH_ROOM: f64 = 0.012;

/// Room at chest, waist and hip that a pattern leaves on a body.
pub fn rooms(pattern: &Pattern, body: &Measurements) -> Vec<Room> {
    let girths = [body.chest, body.natural_waist, body.hip];
    (0..3)
        .filter(|&k| pattern.finished[k] > 0.0)
        .map(|k| {
            let more = pattern.finished[k] - girths[k] - LEAST[k];
            Room {
                place: ["chest", "waist", "hip"][k],
                body: girths[k],
                garment: pattern.finished[k],
                fit: if more < 0.0 {
                    Fit::Tight
                } else if more > LOOSE {
                    Fit::Loose
                } else {
                    Fit::Fitted
                },
            }
        })
        .collect()
}

/// Where the lowest hem of a pattern will be on a body, metres above the floor.
pub fn hem_height(pattern: &Pattern, body: &Measurements) -> f64 {
    let lowest = |wanted: &dyn Fn(Placement) -> bool| {
        let panels = pattern.panels.iter().filter(|p| wanted(p.placement));
        panels.flat_map(|p| p.edges.iter().map(|e| e.from[1])).reduce(f64::min)
    };
    let trunk = lowest(&|p| matches!(p, Placement::TrunkFront | Placement::TrunkBack));
    let skirt = lowest(&|p| matches!(p, Placement::SkirtFront | Placement::SkirtBack));
    let leg = lowest(&|p| matches!(p, Placement::LegFront(_) | Placement::LegBack(_)));
    let from_shoulder = SHOULDER_POINT * body.stature;
    match (trunk, skirt, leg) {
        (Some(t), Some(s), _) => from_shoulder + t + s,
        (Some(t), None, _) => from_shoulder + t,
        (None, Some(s), _) => WAIST_HEIGHT * body.stature + s,
        (None, None, Some(l)) => {
            // The inner corner of the crotch is the highest point of the inseam.
            let crotch = pattern
                .panels
                .iter()
                .filter_map(|p| p.edge("inseam").map(|i| p.edges[i].from[1].max(p.end(i)[1])))
                .fold(f64::MIN, f64::max);
            body.inseam - CROTCH_ROOM + l - if crotch > f64::MIN { crotch } else { -0.29 }
        }
        (None, None, None) => 0.0,
    }
    .max(0.0)
}

/// The smallest size with enough room everywhere; the largest when none has.
///
/// # Errors
/// Unknown garment.
pub fn suggest(garment: &str, body: &Measurements) -> Result<Suggestion, GarmentError> {
    let mut last = None;
    for size in Size::ALL {
        let p = library::pattern(garment, size)?;
        let s = judge(&p, body);
        let fits = s.rooms.iter().all(|r| r.fit != Fit::Tight);
        if fits {
            return Ok(s);
        }
        last = Some(s);
    }
    let mut s = last.ok_or_else(|| GarmentError::UnknownSize(garment.to_owned()))?;
    s.reason.push_str(" (our largest; it will be tight)");
    Ok(s)
}

/// How one pattern fits a body, in numbers and in a sentence.
pub fn judge(pattern: &Pattern, body: &Measurements) -> Suggestion {
    let rooms = rooms(pattern, body);
    let girths = [body.chest, body.natural_waist, body.hip];
    let ease: [f64; 3] =
        std::array::from_fn(|k| if pattern.finished[k] > 0.0 { pattern.finished[k] - girths[k] } else { f64::NAN });
    let least = |r: &Room| LEAST[["chest", "waist", "hip"].iter().position(|p| *p == r.place).unwrap_or(0)];
    let tightest = rooms.iter().min_by(|a, b| (a.ease() - least(a)).total_cmp(&(b.ease() - least(b))));
    let (what, leaves) = match pattern.kind {
        GarmentKind::Top => ("top", "leaves"),
        GarmentKind::Skirt => ("skirt", "leaves"),
        GarmentKind::Trousers => ("trousers", "leave"),
        GarmentKind::Dress => ("dress", "leaves"),
    };
    let hem = hem_height(pattern, body);
    let length = match pattern.kind {
        GarmentKind::Top => relative(hem - body.inseam, "the crotch"),
        GarmentKind::Skirt | GarmentKind::Dress => relative(hem - KNEE_HEIGHT * body.stature, "the knee"),
        GarmentKind::Trousers if hem > 0.25 => relative(hem - KNEE_HEIGHT * body.stature, "the knee"),
        GarmentKind::Trousers => relative(hem, "the floor"),
    };
    let room = tightest.map_or_else(String::new, |r| {
        format!("the {what} {leaves} {:+.0} cm at the {} of {:.0} cm; ", r.ease() * 100.0, r.place, r.body * 100.0)
    });
    Suggestion {
        size: pattern.size,
        ease,
        rooms,
        hem,
        reason: format!("{}: {room}the hem ends {length}", pattern.size),
    }
}

fn relative(above: f64, mark: &str) -> String {
    let cm = (above.abs() * 100.0).round();
    if cm < 1.0 {
        format!("at {mark}")
    } else {
        format!("{cm:.0} cm {} {mark}", if above > 0.0 { "above" } else { "below" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(g: f64) -> Measurements {
        Measurements {
            chest: 0.88 * g,
            natural_waist: 0.72 * g,
            hip: 0.93 * g,
            stature: 1.7,
            inseam: 0.80,
            ..Measurements::default()
        }
    }

    #[test]
    fn a_fuller_body_gets_a_larger_size_with_the_reason_named() {
        for garment in library::names() {
            let sizes: Vec<Size> =
                [0.85, 1.0, 1.2, 2.0].iter().map(|g| suggest(garment, &body(*g)).expect("size").size).collect();
            assert!(sizes.windows(2).all(|w| w[0] <= w[1]), "{garment} {sizes:?}");
            assert_eq!(sizes[3], Size::Xxl);
        }
        let s = suggest("tshirt", &body(1.0)).expect("size");
        let tightest = s.rooms.iter().map(|r| r.place).collect::<Vec<_>>();
        assert_eq!(tightest, ["chest", "hip"]);
        assert!(s.reason.contains("cm at the") && s.reason.contains("the crotch"), "{}", s.reason);
        assert!(suggest("tshirt", &body(2.0)).expect("size").reason.contains("our largest"));
    }

    #[test]
    fn ease_is_the_difference_of_girths_and_classes_follow_it() {
        let p = library::pattern("tshirt", Size::M).expect("pattern");
        let s = judge(&p, &body(1.0));
        assert!((s.ease[0] - (p.finished[0] - 0.88)).abs() < 1e-12 && s.ease[1].is_nan());
        let fit = |g: f64| judge(&p, &body(g)).rooms[0].fit;
        assert_eq!([fit(1.3), fit(1.1), fit(0.8)], [Fit::Tight, Fit::Fitted, Fit::Loose]);
    }

    #[test]
    fn hems_follow_legs_and_stature() {
        let trousers = library::pattern("trousers", Size::M).expect("pattern");
        let mut b = body(1.0);
        let low = hem_height(&trousers, &b);
        b.inseam += 0.05;
        assert!((hem_height(&trousers, &b) - low - 0.05).abs() < 1e-12);
        assert!(judge(&trousers, &b).reason.contains("the floor"));
    }
}
