//! Size choice: ease of each size on a measured body, with its reason in words.

use super::finished::FinishedGarment;
use tryon_body::measure::Measurements;
use tryon_garment::{GarmentError, GarmentKind, Size, library};

/// Class of the fit at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FitClass {
    /// Less ease than the garment needs.
    Tight,
    /// As designed.
    Fitted,
    /// Much more ease than designed.
    Loose,
}

/// Ease of one girth: the garment's against the body's.
#[derive(Clone, Debug, PartialEq)]
pub struct GirthEase {
    /// `chest`, `waist` or `hip`.
    pub place: &'static str,
    /// Girth of the body, metres.
    pub body: f64,
    /// Girth of the finished garment, metres.
    pub garment: f64,
    /// Least ease by design, metres.
    pub least_ease: f64,
    /// Class of the fit there.
    pub fit: FitClass,
}

impl GirthEase {
    /// Finished girth minus body girth, metres.
    pub fn ease(&self) -> f64 {
        self.garment - self.body
    }
}

/// A size on a body, with the reason for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// The size.
    pub size: Size,
    /// Ease at chest, waist and hip (finished girth minus body girth), metres; NaN where the garment has no girth.
    pub ease: [f64; 3],
    /// Ease of the girths that the garment has.
    pub girths: Vec<GirthEase>,
    /// Height of the hem above the floor, metres.
    pub hem: f64,
    /// Height of the hem above a landmark of the body, metres (negative below it), and the landmark.
    pub length: (f64, &'static str),
    /// One sentence for the user.
    pub reason: String,
}

/// Height of the middle of the knee over stature (ANSUR II: 0.49 m at 1.756 m).
const KNEE_HEIGHT: f64 = 0.279;

/// Girths of a body at chest, waist and hip, metres.
pub(super) fn body_girths(body: &Measurements) -> [f64; 3] {
    [body.chest, body.natural_waist, body.hip]
}

/// Ease at chest, waist and hip of a garment on a body, where the garment has a girth.
fn girth_eases(garment: &FinishedGarment, body: &Measurements) -> Vec<GirthEase> {
    let girths = body_girths(body);
    (0..3)
        .filter(|&k| garment.girths[k] > 0.0)
        .map(|k| {
            let spare = garment.girths[k] - girths[k] - garment.settings.least_ease[k];
            GirthEase {
                place: ["chest", "waist", "hip"][k],
                body: girths[k],
                garment: garment.girths[k],
                least_ease: garment.settings.least_ease[k],
                fit: if spare < 0.0 {
                    FitClass::Tight
                } else if spare > garment.settings.loose {
                    FitClass::Loose
                } else {
                    FitClass::Fitted
                },
            }
        })
        .collect()
}

/// The smallest size of a garment of the library with enough ease everywhere; the largest when none has.
///
/// # Errors
/// Unknown garment.
pub fn suggest(garment: &str, body: &Measurements) -> Result<Suggestion, GarmentError> {
    let of_size = |s| library::pattern(garment, s).map(|p| FinishedGarment::from(&p));
    let sizes = Size::ALL.into_iter().map(of_size);
    let sizes = sizes.collect::<Result<Vec<_>, _>>()?;
    first_with_ease(&sizes, body).ok_or_else(|| GarmentError::UnknownSize(garment.to_owned()))
}

/// The first of some sizes, smallest first, with enough ease everywhere that can be worn; when none has, the last that can
/// be worn, or the last. `None` without sizes.
pub(super) fn first_with_ease(
    sizes: &[FinishedGarment],
    body: &Measurements,
) -> Option<Suggestion> {
    let mut wearable = sizes.iter().filter(|g| misfit(g, body).is_none());
    let has_ease = |s: &Suggestion| s.girths.iter().all(|r| r.fit != FitClass::Tight);
    let eased = wearable.clone().map(|g| assess(g, body)).find(has_ease);
    eased.or_else(|| {
        let largest = wearable.next_back().or(sizes.last())?;
        let mut last = assess(largest, body);
        last.reason.push_str(" (our largest; it will be tight)");
        Some(last)
    })
}

/// A size that cannot be worn, with the nearest one that can.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Misfit {
    /// Too small even when stretched.
    #[error("{garment} {size} cannot be closed: at the {place} it lacks {:.0} cm (body {:.0} cm, garment {:.0} cm, {fabric} gives {:.0} cm){}",
        (lacks * 100.0).ceil(), body * 100.0, girth * 100.0, gives * 100.0, advice(*better))]
    TooSmall {
        /// Garment.
        garment: String,
        /// Its size.
        size: Size,
        /// `chest`, `waist` or `hip`.
        place: &'static str,
        /// Girth of the body, metres.
        body: f64,
        /// Girth of the finished garment, metres.
        girth: f64,
        /// Stretch of the fabric there, metres.
        gives: f64,
        /// Girth that is missing beyond that, metres.
        lacks: f64,
        /// The fabric.
        fabric: String,
        /// A size that can be worn.
        better: Option<Size>,
    },
    /// Too wide to be held up.
    #[error("{garment} {size} would slide off: its waist is {:.0} cm wider than the hips (hips {:.0} cm, waist {:.0} cm){}",
        ((girth - body) * 100.0).ceil(), body * 100.0, girth * 100.0, advice(*better))]
    TooLarge {
        /// Garment.
        garment: String,
        /// Its size.
        size: Size,
        /// Girth of the hips, metres.
        body: f64,
        /// Girth of the waistband, metres.
        girth: f64,
        /// A size that can be worn.
        better: Option<Size>,
    },
}

fn advice(better: Option<Size>) -> String {
    better.map_or_else(
        || "; no size of it can be worn".to_owned(),
        |s| format!("; {s} can be worn"),
    )
}

/// Checks that a body can wear a garment: it closes with the stretch of its fabric, and is held up. `of_size` gives its
/// other sizes.
///
/// # Errors
/// The missing girth, and the nearest size that can be worn.
pub fn check_wearable(
    garment: &FinishedGarment,
    of_size: impl Fn(Size) -> Option<FinishedGarment>,
    body: &Measurements,
) -> Result<(), Misfit> {
    let fault = misfit(garment, body);
    fault.map_or(Ok(()), |mut m| {
        let wears = |s: &Size| of_size(*s).is_some_and(|g| misfit(&g, body).is_none());
        // The nearest in the direction that is least_ease.
        let found = match m {
            Misfit::TooSmall { .. } => Size::ALL
                .into_iter()
                .filter(|s| *s > garment.size)
                .find(wears),
            Misfit::TooLarge { .. } => Size::ALL
                .into_iter()
                .rev()
                .filter(|s| *s < garment.size)
                .find(wears),
        };
        let (Misfit::TooSmall { better, .. } | Misfit::TooLarge { better, .. }) = &mut m;
        *better = found;
        Err(m)
    })
}

fn misfit(finished: &FinishedGarment, body: &Measurements) -> Option<Misfit> {
    let (garment, size) = (finished.name.clone(), finished.size);
    let held = matches!(finished.kind, GarmentKind::Skirt | GarmentKind::Trousers);
    let tightest = girth_eases(finished, body)
        .into_iter()
        .map(|r| {
            let gives = r.garment * finished.material.comfortable_strain();
            let lower = if held && r.place == "waist" {
                finished.settings.sits_lower
            } else {
                0.0
            };
            (r.body - r.garment - gives - lower, gives, r)
        })
        .filter(|(lacks, ..)| *lacks > 0.0)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((lacks, gives, r)) = tightest {
        let fabric = finished.material.name.clone();
        let (body, girth) = (r.body, r.garment);
        return Some(Misfit::TooSmall {
            garment,
            size,
            place: r.place,
            body,
            girth,
            gives,
            lacks,
            fabric,
            better: None,
        });
    }
    let (body, girth) = (body.hip, finished.girths[1]);
    (held && girth > body + finished.settings.held_by_button).then_some(Misfit::TooLarge {
        garment,
        size,
        body,
        girth,
        better: None,
    })
}

/// Fit of a garment on a body, in numbers and in a sentence.
pub fn assess(garment: &FinishedGarment, body: &Measurements) -> Suggestion {
    let girths = girth_eases(garment, body);
    let girths_below = body_girths(body);
    let ease: [f64; 3] = std::array::from_fn(|k| {
        if garment.girths[k] > 0.0 {
            garment.girths[k] - girths_below[k]
        } else {
            f64::NAN
        }
    });
    let tightest = girths
        .iter()
        .min_by(|a, b| (a.ease() - a.least_ease).total_cmp(&(b.ease() - b.least_ease)));
    let (what, leaves) = match garment.kind {
        GarmentKind::Top => ("top", "leaves"),
        GarmentKind::Skirt => ("skirt", "leaves"),
        GarmentKind::Trousers => ("trousers", "leave"),
        GarmentKind::Dress => ("dress", "leaves"),
    };
    let hem = garment.hem.map_or(0.0, |hem| hem.height(body));
    let length = match garment.kind {
        GarmentKind::Top => (hem - body.inseam, "the crotch"),
        GarmentKind::Skirt | GarmentKind::Dress => (hem - KNEE_HEIGHT * body.stature, "the knee"),
        GarmentKind::Trousers if hem > garment.settings.shorts => {
            (hem - KNEE_HEIGHT * body.stature, "the knee")
        }
        GarmentKind::Trousers => (hem, "the floor"),
    };
    let ease_text = tightest.map_or_else(String::new, |r| {
        format!(
            "the {what} {leaves} {:+.0} cm at the {} of {:.0} cm; ",
            r.ease() * 100.0,
            r.place,
            r.body * 100.0
        )
    });
    Suggestion {
        size: garment.size,
        ease,
        girths,
        hem,
        length,
        reason: format!(
            "{}: {ease_text}the hem ends {}",
            garment.size,
            relative(length.0, length.1)
        ),
    }
}

fn relative(above: f64, mark: &str) -> String {
    let cm = (above.abs() * 100.0).round();
    if cm < 1.0 {
        format!("at {mark}")
    } else {
        format!(
            "{cm:.0} cm {} {mark}",
            if above > 0.0 { "above" } else { "below" }
        )
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

    fn cut(garment: &str, size: Size) -> Option<FinishedGarment> {
        let pattern = library::pattern(garment, size).ok()?;
        Some(FinishedGarment::from(&pattern))
    }

    #[test]
    fn a_fuller_body_gets_a_larger_size_with_the_reason_named() {
        for garment in library::names() {
            let sizes: Vec<Size> = [0.85, 1.0, 1.2, 2.0]
                .iter()
                .map(|g| suggest(garment, &body(*g)).expect("size").size)
                .collect();
            assert!(
                sizes.windows(2).all(|w| w[0] <= w[1]),
                "{garment} {sizes:?}"
            );
            assert_eq!(sizes[3], Size::Xxl);
        }
        let s = suggest("tshirt", &body(1.0)).expect("size");
        let tightest = s.girths.iter().map(|r| r.place).collect::<Vec<_>>();
        assert_eq!(tightest, ["chest", "hip"]);
        assert!(
            s.reason.contains("cm at the") && s.reason.contains("the crotch"),
            "{}",
            s.reason
        );
        assert!(
            suggest("tshirt", &body(2.0))
                .expect("size")
                .reason
                .contains("our largest")
        );
    }

    #[test]
    fn ease_is_the_difference_of_girths_and_classes_follow_it() {
        let p = cut("tshirt", Size::M).expect("a size");
        let s = assess(&p, &body(1.0));
        assert!((s.ease[0] - (p.girths[0] - 0.88)).abs() < 1e-12 && s.ease[1].is_nan());
        let fit = |g: f64| assess(&p, &body(g)).girths[0].fit;
        assert_eq!(
            [fit(1.3), fit(1.1), fit(0.8)],
            [FitClass::Tight, FitClass::Fitted, FitClass::Loose]
        );
    }

    #[test]
    fn sizes_that_cannot_be_closed_or_held_up_are_refused_with_the_missing_girth() {
        let wearable =
            |g: &FinishedGarment, b: &Measurements| check_wearable(g, |s| cut(&g.name, s), b);
        let p = cut("tshirt", Size::S).expect("a size");
        let give = p.material.comfortable_strain();
        let mut b = body(1.0);
        b.hip = 0.5;
        b.chest = p.girths[0] * (1.0 + give) - 0.001;
        assert_eq!(wearable(&p, &b), Ok(()), "worn tight");
        b.chest += 0.0505;
        let e = wearable(&p, &b).expect_err("too small");
        let text = e.to_string();
        assert!(
            text.contains("tshirt S cannot be closed: at the chest it lacks 5 cm")
                && text.contains("M can"),
            "{text}"
        );
        // A waistband closes with less than its hips, and slides off if it is wider than these.
        let skirt = cut("skirt", Size::Xl).expect("a size");
        let slim = body(0.9);
        let e = wearable(&skirt, &slim).expect_err("too large").to_string();
        assert!(e.contains("slide off") && e.contains("can be worn"), "{e}");
        let skirt = cut("skirt", Size::Xxl).expect("a size");
        let none = wearable(&skirt, &body(2.0)).expect_err("too small");
        assert!(none.to_string().contains("no size"), "{none}");
        // A knit gives more than denim.
        let give = |n: &str| {
            tryon_garment::Material::preset(n)
                .expect("preset")
                .comfortable_strain()
        };
        assert!(give("jersey") > 0.1 && give("denim") < 0.05);
    }

    #[test]
    fn hems_follow_legs_and_stature() {
        let trousers = cut("trousers", Size::M).expect("a size");
        let height = |b: &Measurements| trousers.hem.expect("a hem").height(b);
        let mut b = body(1.0);
        let low = height(&b);
        b.inseam += 0.05;
        assert!((height(&b) - low - 0.05).abs() < 1e-12);
        assert!(assess(&trousers, &b).reason.contains("the floor"));
    }
}
