//! Directions that may separate the origin from a convex polygon: towards its closest feature, and of every feature.
//!
//! No rounding bound is needed here: a direction is only a guess, which `PlaneTest` then certifies. Accuracy matters
//! for false alarms alone. So a direction off a side is made perpendicular to it twice: one projection leaves an
//! error relative to the corner's distance, which exceeds a small distance of the side.

use super::arithmetic::{Arithmetic, Vector, cross, difference, dot, map2, scaled};
use super::pair_motion::side;

/// Component of `v` perpendicular to `along`.
fn reject<S: Arithmetic>(v: &Vector<S>, along: &Vector<S>) -> Vector<S> {
    let square = dot(along, along);
    if square > S::of(0.0) {
        difference(v, &scaled(along, dot(v, along) / square))
    } else {
        *v
    }
}

/// Closest point of the segment from `a` along `side` to the origin, and true if it lies between the ends.
fn closest_on_side<S: Arithmetic>(a: &Vector<S>, side: &Vector<S>) -> (Vector<S>, bool) {
    let (along, square) = (-dot(a, side), dot(side, side));
    let fraction = if !(along > S::of(0.0)) {
        return (*a, false);
    } else if along >= square {
        S::of(1.0)
    } else {
        along / square
    };
    let point = map2(a, side, |p, s| p + s * fraction);
    (point, along < square)
}

/// Direction from the origin towards the closest point of the polygon with corners `q` and normal `normal`, not
/// normalised.
pub(super) fn closest_direction<S: Arithmetic>(
    q: &[Vector<S>; 4],
    normal: &Vector<S>,
) -> Vector<S> {
    let mut best: Option<(S, Vector<S>)> = None;
    for i in 0..4 {
        let side = side(q, i);
        // Beyond this side within the plane of the polygon.
        if !(dot(normal, &cross(&q[i], &side)) < S::of(0.0)) {
            continue;
        }
        let (point, is_inner) = closest_on_side(&q[i], &side);
        let square = dot(&point, &point);
        if best.is_none_or(|(least, _)| square < least) {
            let direction = if is_inner {
                reject(&point, &side)
            } else {
                point
            };
            best = Some((square, direction));
        }
    }
    best.map_or_else(|| towards(normal, &q[0]), |(_, direction)| direction)
}

/// `normal` with the sign that points towards `corner`.
fn towards<S: Arithmetic>(normal: &Vector<S>, corner: &Vector<S>) -> Vector<S> {
    if dot(normal, corner) < S::of(0.0) {
        normal.map(|c| -c)
    } else {
        *normal
    }
}

/// Directions of all features: plane, sides and corners. One of them points to the closest point, whatever rounding did
/// to its selection.
pub(super) fn feature_directions<'a, S: Arithmetic>(
    q: &'a [Vector<S>; 4],
    normal: &Vector<S>,
) -> impl Iterator<Item = Vector<S>> + use<'a, S> {
    let off_side = |i: usize| {
        let side = side(q, i);
        reject(&reject(&q[i], &side), &side)
    };
    std::iter::once(towards(normal, &q[0]))
        .chain((0..4).map(off_side))
        .chain(q.iter().copied())
}

/// True if the origin's projection along `normal` lies inside the polygon, by more than `margin` of the polygon's
/// double area from every side.
pub(super) fn projects_inside<S: Arithmetic>(
    q: &[Vector<S>; 4],
    normal: &Vector<S>,
    margin: f64,
) -> bool {
    let least = dot(normal, normal) * S::of(margin);
    (0..4).all(|i| {
        let side = side(q, i);
        let is_point = side.iter().all(|c| *c == S::of(0.0));
        is_point || dot(normal, &cross(&q[i], &side)) > least
    })
}
