//! Unit, axes and place of a garment's file, from how its cloth lies over a body.

use super::body_guess::{GarmentSamples, Guess, TriedBody, prior};
use super::error::MeshGarmentError;
use super::file_frame::{FileAxes, FileFrame, bounds};
use super::settings::GuessSettings;
use std::sync::Arc;
use tryon_body::Template;
use tryon_formats::mesh_frame::MeshFrame;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::{Par, map_into};
use tryon_geometry::spatial::PointTree;

/// A garment in one of the frames that its file may have.
#[derive(Clone)]
struct Placed {
    axes: FileAxes,
    samples: GarmentSamples,
    guess: Guess,
    /// Mean distance of the cloth from its height over the skin, metres.
    distance: f32,
    /// With the prior, and dearer for unusual axes, metres.
    cost: f32,
}

/// A body scaled, with its arms turned, and the garment's frame over its skin.
pub(super) struct GuessedBody {
    pub(super) template: Arc<Template>,
    pub(super) frame: FileFrame,
    /// Unit and axes in words, for people.
    pub(super) axes: String,
}

/// `template` scaled, with its arms turned, and the frame in which the garment's vertices lie over its skin.
///
/// # Errors
/// When no body lies near the garment, or two frames fit it alike.
pub(super) fn guess(
    template: &Template,
    garment: &[P3],
    stated: &MeshFrame,
    settings: &GuessSettings,
) -> Result<GuessedBody, MeshGarmentError> {
    let wearer = TriedBody::new(template, true, settings);
    let found = search(&wearer, garment, stated)?;
    let (vertices, bones) = wearer.stand(&found.guess);
    let made = template.at_rest("guessed", vertices, &bones.joints)?;
    Ok(GuessedBody {
        template: Arc::new(made),
        frame: found.samples.frame(&found.guess),
        axes: found.axes.to_string(),
    })
}

/// Frame in which the garment's vertices lie over the skin of `template`, and its unit and axes in words.
///
/// # Errors
/// As [`guess`].
pub(super) fn locate(
    template: &Template,
    garment: &[P3],
    stated: &MeshFrame,
    settings: &GuessSettings,
) -> Result<(FileFrame, String), MeshGarmentError> {
    let found = search(&TriedBody::new(template, false, settings), garment, stated)?;
    let frame = found.samples.frame(&found.guess);
    Ok((frame, found.axes.to_string()))
}

/// True if a garment lies over the skin of `template` in a frame, no dearer than in any other of the same axis upwards and
/// unit.
pub(super) fn fits(
    template: &Template,
    garment: &[P3],
    frame: FileFrame,
    settings: &GuessSettings,
) -> bool {
    let wearer = TriedBody::new(template, false, settings);
    let q = wearer.start(0.0);
    let cost = |frame| {
        let samples = GarmentSamples::new(garment, frame, settings.samples, settings);
        samples.cost(&wearer, &q)
    };
    let half_turn = nalgebra::Matrix3::from_diagonal(&V3::new(-1.0, 1.0, -1.0));
    let turned = FileFrame {
        rotation: half_turn * frame.rotation,
        ..frame
    };
    let own = cost(frame);
    own < settings.worn && own < cost(turned) + settings.margin
}

/// The least dear frame.
fn search(
    wearer: &TriedBody<'_>,
    garment: &[P3],
    stated: &MeshFrame,
) -> Result<Placed, MeshGarmentError> {
    if garment.is_empty() {
        return Err(MeshGarmentError::Nothing("it has no vertices".into()));
    }
    let rough = rough_places(wearer, garment, stated);
    let refined = |k: usize| Some(rough[k].refined(wearer, garment));
    let mut placed = Vec::new();
    map_into(Par::Rayon, rough.len(), 1, &mut placed, refined);
    let mut placed: Vec<Placed> = placed.into_iter().flatten().collect();
    placed.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    decide(wearer, garment, placed, stated)
}

/// Axes and place at which a refinement begins.
struct RoughPlace {
    axes: FileAxes,
    guess: Guess,
    /// Of a rough body, metres.
    cost: f32,
}

/// The least dear starts, and those of usual frames: the rough body may be too large for the garment to lie over.
fn rough_places(wearer: &TriedBody<'_>, garment: &[P3], stated: &MeshFrame) -> Vec<RoughPlace> {
    let settings = wearer.settings;
    let extent = extent(garment);
    let (vertices, _) = wearer.stand(&wearer.start(0.0));
    let skin = wearer.skin(&vertices);
    let mut out = Vec::new();
    for axes in FileAxes::candidates(extent, settings.extent, stated) {
        let samples = GarmentSamples::new(garment, axes.frame(), settings.rough_samples, settings);
        let small = small(extent * axes.unit as f32, settings);
        for heights in [usual_heights(wearer, &samples), heights(wearer, &samples)] {
            let starts = heights.into_iter().map(|up| {
                let guess = wearer.start(up);
                let unusual = prior(wearer, &guess).min(settings.most_prior);
                let cost = samples.distance(wearer, &skin, &guess) + unusual + small;
                RoughPlace { axes, guess, cost }
            });
            out.extend(starts.min_by(|a, b| a.cost.total_cmp(&b.cost)));
        }
    }
    out.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let is_usual = |s: &RoughPlace| s.axes.is_conventional() || s.axes.turned().is_conventional();
    let rest = out.split_off(settings.refined.min(out.len()));
    out.extend(rest.into_iter().filter(is_usual));
    out
}

impl RoughPlace {
    fn refined(&self, wearer: &TriedBody<'_>, garment: &[P3]) -> Placed {
        let (axes, settings) = (self.axes, wearer.settings);
        let samples = GarmentSamples::new(garment, axes.frame(), settings.samples, settings);
        let (cost, guess) = samples.minimise(wearer, self.guess);
        let prior = prior(wearer, &guess);
        let distance = cost - prior;
        let axes_price = match axes.is_conventional() {
            true => 0.0,
            false => settings.unusual,
        };
        let small = small(extent(garment) * axes.unit as f32, settings);
        Placed {
            axes,
            distance,
            samples,
            guess,
            cost: distance + prior.min(settings.most_prior) + axes_price + small,
        }
    }
}

/// Heights of the file's zero over the floor at which most files have it, metres.
fn usual_heights(wearer: &TriedBody<'_>, samples: &GarmentSamples) -> Vec<f64> {
    let [lo, _] = samples.heights().map(f64::from);
    let is_above_ground = |up: &f64| lo + up > wearer.settings.underground;
    let usual = [0.0, f64::from(wearer.stature) / 2.0].into_iter();
    usual.filter(is_above_ground).collect()
}

/// Heights of the file's zero over the floor at which the garment touches the body, metres.
fn heights(wearer: &TriedBody<'_>, samples: &GarmentSamples) -> Vec<f64> {
    let step = wearer.settings.height_step;
    let [lo, hi] = samples.heights().map(f64::from);
    let (first, last) = (-lo, f64::from(wearer.stature) - hi);
    let count = ((last - first) / step).ceil().max(0.0) as usize;
    (0..=count).map(|k| first + k as f64 * step).collect()
}

/// Largest extent, units of the file.
fn extent(garment: &[P3]) -> f32 {
    let (lo, hi) = bounds(garment.iter());
    (hi - lo).amax()
}

/// Price of a garment smaller than clothes are, metres: a doll's lies as well on a chest.
fn small(extent: f32, settings: &GuessSettings) -> f32 {
    let ratio = settings.smallest / extent.max(f32::MIN_POSITIVE);
    settings.small * ratio.ln().max(0.0)
}

/// The first of the frames, if it is worn in it and no other one fits as well.
fn decide(
    wearer: &TriedBody<'_>,
    garment: &[P3],
    placed: Vec<Placed>,
    stated: &MeshFrame,
) -> Result<Placed, MeshGarmentError> {
    let settings = wearer.settings;
    let mut placed = placed.into_iter();
    let is_worn = |p: &Placed| p.distance < settings.not_worn * settings.far;
    let Some(best) = placed.next().filter(is_worn) else {
        let why = "no body fits into it: is it worn, and upright? --unit, --up and --facing say how it was made";
        return Err(MeshGarmentError::NotFound(why.into()));
    };
    let rival = placed.find(|p| p.axes != best.axes);
    let rival = rival.filter(|p| p.cost < best.cost + settings.margin);
    let Some(rival) = rival else {
        return Ok(best);
    };
    let is_turn = rival.axes == best.axes.turned();
    if is_turn && asymmetry(garment, &best) < settings.symmetric {
        return Ok(best);
    }
    let option = match () {
        () if rival.axes.unit != best.axes.unit => stated.options.unit,
        () if rival.axes.up != best.axes.up => stated.options.up,
        () => stated.options.facing,
    };
    Err(MeshGarmentError::Ambiguous {
        first: best.axes.to_string(),
        second: rival.axes.to_string(),
        option,
    })
}

/// Mean distance of the garment from itself turned by half a turn about the body's axis, metres.
fn asymmetry(garment: &[P3], placed: &Placed) -> f32 {
    let frame = placed.samples.frame(&placed.guess);
    let points: Vec<P3> = garment.iter().map(|p| frame.to_metres(p)).collect();
    let (lo, hi) = bounds(points.iter());
    let middle = nalgebra::center(&lo, &hi);
    let tree = PointTree::new(&points);
    let step = points.len().div_ceil(500).max(1);
    let turned = points.iter().step_by(step).map(|p| {
        let d = p - middle;
        middle + V3::new(-d.x, d.y, -d.z)
    });
    let distances: Vec<f32> = turned
        .map(|p| tree.nearest(&p, 1.0).map_or(1.0, |(_, d2)| d2.sqrt()))
        .collect();
    distances.iter().sum::<f32>() / distances.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_formats::mesh_frame::MeshAxis;

    /// A vest: skin of the trunk without shoulders, 8 mm above it, at a place of its own.
    fn vest(settings: &GuessSettings) -> Vec<P3> {
        let t = embedded::template();
        let x = t.mesh().vertices();
        let normals = t.normals(x);
        (0..x.len())
            .filter(|i| (0.9..1.3).contains(&x[*i].y) && x[*i].x.abs() < 0.2)
            .map(|i| x[i] + normals[i] * settings.above + V3::new(0.0, 0.0, 0.04))
            .collect()
    }

    #[test]
    fn unit_axes_and_shift_of_an_offset_skin_are_found() {
        let (t, settings) = (embedded::template(), GuessSettings::default());
        let vest = vest(&settings);
        for (unit, up, facing) in [
            (1.0, "y", "z"),
            (0.01, "z", "-y"),
            (0.0254, "-x", "y"),
            (0.001, "-y", "-z"),
        ] {
            let axis = |name: &str| name.parse::<MeshAxis>().expect("an axis");
            let axes = FileAxes {
                unit,
                up: axis(up),
                facing: axis(facing),
            };
            let back = axes.frame().rotation.transpose();
            let file: Vec<P3> = vest.iter().map(|p| back * p / axes.unit as f32).collect();
            let (frame, words) = locate(&t, &file, &MeshFrame::default(), &settings).expect("worn");
            assert_eq!(words, axes.to_string());
            let miss = frame.shift - V3::new(0.0, 0.0, -0.04);
            assert!(miss.norm() < 0.01, "{miss}");
        }
    }

    #[test]
    fn stated_axes_are_kept() {
        let (t, settings) = (embedded::template(), GuessSettings::default());
        let stated = MeshFrame {
            facing: Some("-z".parse::<MeshAxis>().expect("an axis")),
            ..MeshFrame::default()
        };
        let (_, words) = locate(&t, &vest(&settings), &stated, &settings).expect("worn");
        assert_eq!(words, "in m, y up, facing -z");
    }

    #[test]
    fn no_vertices_are_no_garment() {
        let (t, settings) = (embedded::template(), GuessSettings::default());
        let found = locate(&t, &[], &MeshFrame::default(), &settings);
        assert!(matches!(found, Err(MeshGarmentError::Nothing(_))));
    }

    #[test]
    fn a_tent_has_no_body() {
        let corner = |i: usize| P3::from([0, 1, 2].map(|k| (i >> k & 1) as f32 * 2.0));
        let garment: Vec<P3> = (0..8).map(corner).collect();
        let (t, settings) = (embedded::template(), GuessSettings::default());
        let e = guess(&t, &garment, &MeshFrame::default(), &settings)
            .err()
            .expect("nobody is that wide");
        assert!(e.to_string().contains("no body fits"), "{e}");
    }
}
