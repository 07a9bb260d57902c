//! Unit and axes of a standing body without joints, from its surface: a person is the same left and right, has two legs
//! below and one head above, and feet that point ahead.

use super::stature::{check_volume, unit_note, unit_of_stature};
use tryon_formats::mesh_frame::{MeshAxis, MeshFrame};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::TriMesh;
use tryon_geometry::spatial::PointTree;

/// Points that are mirrored: the mean distance is then known to a tenth.
const SAMPLES: usize = 1500;
/// Mean distance from the mirrored surface over that of the next axis, at most, for the axis from right to left.
const SYMMETRY: f32 = 0.7;
/// Stature over the depth from chest to back, at least.
const SLENDER: f32 = 1.4;
/// Half width of the sagittal strip, over the stature.
const STRIP: f32 = 0.012;
/// Share of the stature that the legs' and the head's slabs have, and the part of it at the very end that is left out.
const SLAB: [f32; 2] = [0.03, 0.2];
/// Share of the feet's end in the sagittal strip over that of the head's end, at most: legs leave it empty.
const LEGS: f32 = 0.5;
/// Middle of the feet ahead of the ankles over the stature, at least; people have 0.03.
const TOES: f32 = 0.01;
/// Heights of feet and ankles, over the stature.
const FOOT: f32 = 0.035;
const ANKLE: [f32; 2] = [0.055, 0.09];

/// Unit and axes of a body's file.
#[derive(Clone, Debug, PartialEq)]
pub struct StandingFrame {
    /// Metres in a unit of the file.
    pub metres_per_unit: f64,
    /// From the feet to the head.
    pub up: MeshAxis,
    /// Ahead.
    pub facing: MeshAxis,
    /// Faces look inwards.
    pub is_inside_out: bool,
    /// Statements about what is not metres, y up, facing +z.
    pub notes: Vec<String>,
}

/// Component of a point along a signed axis.
fn along(p: &P3, axis: MeshAxis) -> f32 {
    let value = p[axis.index];
    if axis.is_negative { -value } else { value }
}

/// Lowest and highest component.
fn range<'a>(points: impl Iterator<Item = &'a P3>, axis: MeshAxis) -> [f32; 2] {
    let values = points.map(|p| along(p, axis));
    values.fold([f32::INFINITY, f32::NEG_INFINITY], |[l, h], v| {
        [l.min(v), h.max(v)]
    })
}

/// Positive direction of an axis.
fn axis(index: usize) -> MeshAxis {
    MeshAxis {
        index,
        is_negative: false,
    }
}

impl StandingFrame {
    /// Recognises unit and axes of a bare standing body; what is stated is taken and checked.
    ///
    /// # Errors
    /// One sentence with the option that says what the surface does not.
    pub fn find(mesh: &TriMesh, stated: &MeshFrame) -> Result<Self, String> {
        let points = mesh.vertices();
        if points.len() < 100 {
            return Err(format!("{} vertices are no body", points.len()));
        }
        let lateral = lateral_axis(points, stated)?;
        let [up, ahead] = upright(points, lateral, stated)?;
        let up = head_up(points, lateral, up, stated)?;
        let facing = toes_ahead(points, up, ahead, stated)?;
        let [low, high] = range(points.iter(), up);
        let stature = f64::from(high - low);
        let unit = unit_of_stature(stature, stated)?;
        let volume = mesh.volume() * unit.powi(3);
        check_volume(volume.abs(), stature * unit)?;
        let mut notes = Vec::from_iter(unit_note(stature, unit));
        if (up, facing) != (MeshAxis::Y, MeshAxis::Z) {
            notes.push(format!("{up} up, facing {facing}"));
        }
        if volume < 0.0 {
            notes.push("its faces look inwards: turned over".into());
        }
        Ok(Self {
            metres_per_unit: unit,
            up,
            facing,
            is_inside_out: volume < 0.0,
            notes,
        })
    }
}

/// The axis across which the body is its own mirror image.
fn lateral_axis(points: &[P3], stated: &MeshFrame) -> Result<usize, String> {
    let is_free = |k: &usize| {
        stated.up.is_none_or(|a| a.index != *k) && stated.facing.is_none_or(|a| a.index != *k)
    };
    let free: Vec<usize> = (0..3).filter(is_free).collect();
    if let [only] = free[..] {
        return Ok(only);
    }
    let tree = PointTree::new(points);
    let mut found: Vec<(f32, usize)> = free
        .iter()
        .map(|k| (asymmetry(points, &tree, *k), *k))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    match found[..] {
        [(best, k), (next, _), ..] if best < SYMMETRY * next => Ok(k),
        _ => {
            let all: Vec<String> = found
                .iter()
                .map(|(d, k)| format!("{} {:.1} %", axis(*k), 100.0 * d))
                .collect();
            Err(format!(
                "its left and right are unlike: no axis mirrors it clearly ({} of its size apart); say `{}` and `{}`",
                all.join(", "),
                stated.options.up,
                stated.options.facing
            ))
        }
    }
}

/// Mean distance from the surface mirrored across the middle of an axis, over the largest extent.
fn asymmetry(points: &[P3], tree: &PointTree, index: usize) -> f32 {
    let [low, high] = range(points.iter(), axis(index));
    let extent = (0..3)
        .map(|k| range(points.iter(), axis(k)))
        .map(|[l, h]| h - l)
        .fold(0.0, f32::max);
    let mirrored = points
        .iter()
        .step_by(points.len().div_ceil(SAMPLES))
        .map(|p| {
            let mut q = *p;
            q[index] = low + high - q[index];
            q
        });
    let distances: Vec<f32> = mirrored
        .map(|q| tree.nearest(&q, extent).map_or(extent, |n| n.1.sqrt()))
        .collect();
    distances.iter().sum::<f32>() / distances.len().max(1) as f32 / extent.max(f32::MIN_POSITIVE)
}

/// The axes of stature and of depth.
fn upright(points: &[P3], lateral: usize, stated: &MeshFrame) -> Result<[usize; 2], String> {
    let others: Vec<usize> = (0..3).filter(|k| *k != lateral).collect();
    if let Some(up) = stated.up {
        let ahead = others.into_iter().find(|k| *k != up.index);
        return Ok([up.index, ahead.unwrap_or(0)]);
    }
    if let Some(facing) = stated.facing {
        let up = others.into_iter().find(|k| *k != facing.index);
        return Ok([up.unwrap_or(1), facing.index]);
    }
    let extent = |k: usize| {
        let [l, h] = range(points.iter(), axis(k));
        h - l
    };
    let (a, b) = (others[0], others[1]);
    let (p, q) = (extent(a), extent(b));
    if p > SLENDER * q {
        Ok([a, b])
    } else if q > SLENDER * p {
        Ok([b, a])
    } else {
        Err(format!(
            "it is as deep as tall ({p:.2} along {}, {q:.2} along {}): no standing body; say `{}`",
            axis(a),
            axis(b),
            stated.options.up
        ))
    }
}

/// The end without two legs.
fn head_up(
    points: &[P3],
    lateral: usize,
    up: usize,
    stated: &MeshFrame,
) -> Result<MeshAxis, String> {
    let [low, high] = range(points.iter(), axis(up));
    let [left, right] = range(points.iter(), axis(lateral));
    let (stature, middle) = (high - low, 0.5 * (left + right));
    let share = |is_top: bool| {
        let place = |p: &P3| if is_top { high - p[up] } else { p[up] - low };
        let slab = points
            .iter()
            .filter(|p| (SLAB[0]..SLAB[1]).contains(&(place(p) / stature)));
        let (mut inside, mut all) = (0usize, 0usize);
        for p in slab {
            all += 1;
            inside += usize::from((p[lateral] - middle).abs() < STRIP * stature);
        }
        inside as f32 / all.max(1) as f32
    };
    let (bottom, top) = (share(false), share(true));
    let found = if bottom < LEGS * top {
        Some(MeshAxis {
            index: up,
            is_negative: false,
        })
    } else if top < LEGS * bottom {
        Some(MeshAxis {
            index: up,
            is_negative: true,
        })
    } else {
        None
    };
    let option = stated.options.up;
    match (found, stated.up) {
        (Some(found), Some(said)) if found != said => Err(format!(
            "`{option} {said}` puts its head below its feet; say `{option} {found}`, or nothing"
        )),
        (_, Some(said)) => Ok(said),
        (Some(found), None) => Ok(found),
        (None, None) => Err(format!(
            "which end of {} is its head is unclear (of the surface {:.1} % at the low and {:.1} % at the high end lie between left and right; legs leave that empty); say `{option} {}` or `{option} -{}`",
            axis(up),
            100.0 * bottom,
            100.0 * top,
            axis(up),
            axis(up)
        )),
    }
}

/// The way that feet reach from the ankles.
fn toes_ahead(
    points: &[P3],
    up: MeshAxis,
    ahead: usize,
    stated: &MeshFrame,
) -> Result<MeshAxis, String> {
    let [low, high] = range(points.iter(), up);
    let stature = high - low;
    let between = |l: f32, h: f32| {
        points
            .iter()
            .filter(move |p| (l..h).contains(&((along(p, up) - low) / stature)))
    };
    let middle = |[l, h]: [f32; 2]| 0.5 * (l + h);
    let foot = middle(range(between(-1.0, FOOT), axis(ahead)));
    let ankle = middle(range(between(ANKLE[0], ANKLE[1]), axis(ahead)));
    let reach = (foot - ankle) / stature;
    let found = (reach.abs() > TOES).then_some(MeshAxis {
        index: ahead,
        is_negative: reach < 0.0,
    });
    let option = stated.options.facing;
    match (found, stated.facing) {
        (Some(found), Some(said)) if found != said => Err(format!(
            "`{option} {said}`, but its feet point to {found}; say `{option} {found}`, or nothing"
        )),
        (_, Some(said)) => Ok(said),
        (Some(found), None) => Ok(found),
        (None, None) => Err(format!(
            "its feet do not show the way ahead ({:.1} % of the stature, expected {:.1} %); say `{option} {}` or `{option} -{}`",
            100.0 * reach,
            100.0 * TOES,
            axis(ahead),
            axis(ahead)
        )),
    }
}
