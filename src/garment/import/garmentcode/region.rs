//! Part of the body that each drawn panel covers: by its place around the figure and its seams.

use super::super::settings::ImportSettings;
use super::figure::DrawnPanel;
use crate::{GarmentError, Side};

/// Part of the body under a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CoveredPart {
    Trunk,
    Arm(Side),
    Leg(Side),
    /// Around hips and legs together, or the waist: skirts, waistbands, godets.
    Hips,
    /// Around the neck.
    Neck,
    Head(Side),
}

/// Region of each panel.
///
/// # Errors
/// A panel whose region cannot be told, with its place and what would be right.
pub(super) fn regions(
    panels: &[DrawnPanel<'_>],
    settings: &ImportSettings,
) -> Result<Vec<CoveredPart>, GarmentError> {
    let loose = |p: &&DrawnPanel<'_>| p.neighbours.is_empty();
    if let Some(p) = panels.iter().find(loose) {
        return Err(fault(
            p,
            "it is sewn to no panel: stitch it, or leave it out",
        ));
    }
    let figure = FigureHeights::of(panels, settings);
    let upper = |p| upper(p, &figure, settings);
    let mut found: Vec<Option<CoveredPart>> = panels.iter().map(upper).collect();
    spread_arms(panels, &mut found);
    let lower = |(k, r): (usize, Option<CoveredPart>)| {
        r.unwrap_or_else(|| {
            if is_leg(panels, k, settings) {
                CoveredPart::Leg(panels[k].side())
            } else {
                CoveredPart::Hips
            }
        })
    };
    let out: Vec<CoveredPart> = found.into_iter().enumerate().map(lower).collect();
    for (p, r) in panels.iter().zip(&out) {
        check(p, *r, settings)?;
    }
    Ok(out)
}

/// Heights of the figure that a pattern is drawn around, metres.
struct FigureHeights {
    /// Height over which a panel's top is above the waist.
    above_waist: f64,
    /// High point of the shoulder.
    shoulder: f64,
    /// True if the pattern's trunk gives them.
    is_measured: bool,
}

impl FigureHeights {
    /// From the highest large panel before or behind the body, if it is above any waist.
    fn of(panels: &[DrawnPanel<'_>], settings: &ImportSettings) -> Self {
        let trunk = panels.iter().filter(|p| {
            let [width, height] = [p.x[1] - p.x[0], p.high - p.low];
            let is_large = width > settings.trunk_width && height > settings.hood_height;
            let faces = p.normal.z.abs() > settings.sideways;
            is_large && faces && p.off_middle() < settings.arm_gap
        });
        let top = trunk.map(|p| p.high).fold(f64::MIN, f64::max);
        let is_measured = top > settings.highest_waist;
        let shoulder = if is_measured {
            top
        } else {
            settings.figure_shoulder
        };
        let waist = shoulder * settings.figure_waist / settings.figure_shoulder;
        Self {
            above_waist: waist + settings.above_waist,
            shoulder,
            is_measured,
        }
    }
    /// True for a panel that ends above the waist. Between the waist of a tall figure and the chest of a short one its name
    /// tells.
    fn is_above_waist(&self, p: &DrawnPanel<'_>, settings: &ImportSettings) -> bool {
        let above = p.high > self.above_waist;
        let name = p.raw.name.to_lowercase();
        let named = |words: &[&str]| words.iter().any(|w| name.contains(w));
        if self.is_measured || p.high < settings.lowest_chest {
            above
        } else if named(&["skirt", "pant", "wb", "waist", "leg"]) {
            false
        } else {
            above || named(&["torso", "bodice", "top", "shirt"])
        }
    }
}

/// Region of a panel above the waist; `None` below it.
fn upper(
    p: &DrawnPanel<'_>,
    figure: &FigureHeights,
    settings: &ImportSettings,
) -> Option<CoveredPart> {
    let above_waist = figure.is_above_waist(p, settings);
    if above_waist && p.off_middle() > settings.arm_gap && p.centre.x.abs() > settings.arm_middle {
        return Some(CoveredPart::Arm(p.side()));
    }
    let (shoulder, near) = (figure.shoulder, settings.above_shoulder);
    if p.high > shoulder + near || p.low > shoulder - near {
        let sideways = p.normal.x.abs() > settings.sideways;
        let is_hood = sideways && p.high - p.low > settings.hood_height;
        return Some(if is_hood {
            CoveredPart::Head(p.side())
        } else {
            CoveredPart::Neck
        });
    }
    above_waist.then_some(CoveredPart::Trunk)
}

/// Panels below the waist that hang on sleeves: cuffs.
fn spread_arms(panels: &[DrawnPanel<'_>], found: &mut [Option<CoveredPart>]) {
    let mut changed = true;
    while changed {
        changed = false;
        for k in 0..panels.len() {
            let arm = panels[k]
                .neighbours
                .iter()
                .find_map(|n| match found[n.panel] {
                    Some(r @ CoveredPart::Arm(_)) => Some(r),
                    _ => None,
                });
            if found[k].is_none() && arm.is_some() {
                found[k] = arm;
                changed = true;
            }
        }
    }
}

/// True for a panel beside the sagittal plane that is sewn to one behind or before it on its outer and its inner side.
fn is_leg(panels: &[DrawnPanel<'_>], k: usize, settings: &ImportSettings) -> bool {
    let p = &panels[k];
    let beside = |q: &DrawnPanel<'_>| {
        let inner = if q.side() == Side::Left {
            q.x[0]
        } else {
            -q.x[1]
        };
        inner > -settings.leg_over_middle
    };
    let opposite = |q: &DrawnPanel<'_>| q.side() == p.side() && q.is_in_front() != p.is_in_front();
    if !beside(p) {
        return false;
    }
    let sides = p.neighbours.iter().filter(|n| {
        let q = &panels[n.panel];
        beside(q) && opposite(q)
    });
    let outside: Vec<bool> = sides
        .map(|n| p.middle(n.edge).x.abs() > p.centre.x.abs())
        .collect();
    outside.contains(&true) && outside.contains(&false)
}

/// Refuses a panel that lies neither before nor behind the body.
fn check(
    p: &DrawnPanel<'_>,
    r: CoveredPart,
    settings: &ImportSettings,
) -> Result<(), GarmentError> {
    let faces = matches!(
        r,
        CoveredPart::Trunk | CoveredPart::Arm(_) | CoveredPart::Leg(_)
    );
    if faces && p.centre.z.abs() < settings.least_depth {
        let why =
            "it lies in the plane of the body: move it to the front (z > 0) or the back (z < 0)";
        return Err(fault(p, why));
    }
    if r == CoveredPart::Hips && p.centre.x.hypot(p.centre.z) < settings.least_depth {
        let why = "it lies in the axis of the body: move it to the side that it covers";
        return Err(fault(p, why));
    }
    Ok(())
}

/// True for a panel that is sewn to one of another region: it starts its limb, in contrast to cuffs.
pub(super) fn is_sewn_to_other(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    k: usize,
) -> bool {
    let mut neighbours = panels[k].neighbours.iter();
    neighbours.any(|n| regions[n.panel] != regions[k])
}

/// A panel's fault, with its place.
pub(super) fn fault(p: &DrawnPanel<'_>, why: &str) -> GarmentError {
    GarmentError::Panel {
        panel: p.raw.name.clone(),
        why: format!(
            "its place cannot be told: {:.2} to {:.2} m over the figure's floor, middle at x {:.2} m, z {:.2} m; {why}",
            p.low, p.high, p.centre.x, p.centre.z
        ),
    }
}
