//! Triangles of a polygon: fan if that is convex, else ears (Meisters 1975).

use nalgebra::Vector2;
use tryon_geometry::math::{P3, V3d};

/// Corners up to which the best ear is cut, and not the first.
const BEST_EAR: usize = 64;
/// Corners up to which a polygon that is not convex is cut into ears; cutting takes quadratic time.
const MOST_CORNERS: usize = 4096;

/// Corners of a polygon's triangles, by their places in `points`; n − 2 triangles, in the orientation of the polygon.
///
/// A polygon that is not planar is cut as seen along its mean normal (Newell). Of one without area, with sides that cross,
/// or of thousands of corners, a fan is made.
pub(super) fn triangulated(points: &[P3]) -> Vec<[usize; 3]> {
    let n = points.len();
    let fan = || (1..n.saturating_sub(1)).map(|k| [0, k, k + 1]).collect();
    if n < 4 {
        return fan();
    }
    let Some(flat) = flattened(points) else {
        return fan();
    };
    let is_convex = (0..n).all(|k| turn(&flat, [(k + n - 1) % n, k, (k + 1) % n]) >= 0.0);
    if is_convex || n > MOST_CORNERS {
        return fan();
    }
    ears(&flat).unwrap_or_else(fan)
}

/// Polygon in the plane of its mean normal, counter-clockwise; `None` without area.
fn flattened(points: &[P3]) -> Option<Vec<Vector2<f64>>> {
    let n = points.len();
    let at = |k: usize| points[k % n].cast::<f64>() - points[0].cast::<f64>();
    let normal: V3d = (0..n).map(|k| at(k).cross(&at(k + 1))).sum();
    let normal = normal.try_normalize(0.0)?;
    let helper = if normal.x.abs() < 0.6 {
        V3d::x()
    } else {
        V3d::y()
    };
    let right = normal.cross(&helper).try_normalize(0.0)?;
    let up = normal.cross(&right);
    let flat = (0..n).map(|k| Vector2::new(at(k).dot(&right), at(k).dot(&up)));
    Some(flat.collect())
}

/// Twice the area of a triangle, positive counter-clockwise.
fn turn(flat: &[Vector2<f64>], [a, b, c]: [usize; 3]) -> f64 {
    (flat[b] - flat[a]).perp(&(flat[c] - flat[a]))
}

/// Ears cut one by one, the best shaped first; `None` if no ear is left, where sides cross.
fn ears(flat: &[Vector2<f64>]) -> Option<Vec<[usize; 3]>> {
    let mut ring: Vec<usize> = (0..flat.len()).collect();
    let mut out = Vec::with_capacity(flat.len() - 2);
    while ring.len() > 3 {
        let n = ring.len();
        let triangle = |k: usize| [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]];
        let is_ear = |k: &usize| {
            let t = triangle(*k);
            let mut others = ring.iter().filter(|v| !t.contains(v));
            turn(flat, t) > 0.0 && !others.any(|v| contains(flat, t, *v))
        };
        let quality = |k: usize| {
            let [a, b, c] = triangle(k).map(|v| flat[v]);
            let sides = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
            turn(flat, triangle(k)) / sides
        };
        let best = match n {
            ..=BEST_EAR => {
                let found = (0..n).filter(is_ear);
                found.max_by(|a, b| quality(*a).total_cmp(&quality(*b)))?
            }
            _ => (0..n).find(is_ear)?,
        };
        out.push(triangle(best));
        ring.remove(best);
    }
    out.push([ring[0], ring[1], ring[2]]);
    Some(out)
}

/// True if a point lies in a triangle or on its border, other than at a corner.
fn contains(flat: &[Vector2<f64>], [a, b, c]: [usize; 3], v: usize) -> bool {
    [a, b, c].iter().all(|k| flat[*k] != flat[v])
        && [[a, b], [b, c], [c, a]]
            .iter()
            .all(|[p, q]| turn(flat, [*p, *q, v]) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[P3]) -> f64 {
        let half = |[a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|k| points[k].cast::<f64>());
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        triangulated(points).into_iter().map(half).sum()
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        // An L of area 3, an arrow of area 1, and a comb, each in a plane of its own and from each first corner.
        let l = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]];
        let arrow = [[0., 0.], [2., -1.], [1., 0.], [2., 1.]];
        let comb = [
            [0., 0.],
            [5., 0.],
            [5., 3.],
            [4., 3.],
            [4., 1.],
            [3., 1.],
            [3., 3.],
            [2., 3.],
            [2., 1.],
            [1., 1.],
            [1., 3.],
            [0., 3.],
        ];
        for (shape, wanted) in [(&l[..], 3.0), (&arrow[..], 1.0), (&comb[..], 11.0)] {
            for first in 0..shape.len() {
                let turned = shape.iter().cycle().skip(first).take(shape.len());
                let points: Vec<P3> = turned
                    .map(|[x, y]: &[f32; 2]| P3::new(*y, 0.5 * x, 0.75f32.sqrt() * x))
                    .collect();
                assert_eq!(triangulated(&points).len(), shape.len() - 2);
                assert!(
                    (area(&points) - wanted).abs() < 1e-5,
                    "{first}: {}",
                    area(&points)
                );
            }
        }
    }

    #[test]
    fn polygons_without_area_or_with_crossing_sides_are_fanned() {
        let line = [0.0, 1.0, 2.0, 3.0].map(|x| P3::new(x, 0.0, 0.0));
        assert_eq!(triangulated(&line), [[0, 1, 2], [0, 2, 3]]);
        let bow = [[0., 0.], [1., 1.], [1., 0.], [0., 1.]].map(|[x, y]| P3::new(x, y, 0.0));
        assert_eq!(triangulated(&bow).len(), 2);
        let lost = [[0., 0.], [1., f32::NAN], [1., 0.], [0., 1.]].map(|[x, y]| P3::new(x, y, 0.0));
        assert_eq!(triangulated(&lost).len(), 2);
    }
}
