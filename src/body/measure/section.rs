//! Plane sections of a surface: closed outlines, their girth as a tape measures it, and rays through it.

use nalgebra::Point2;
use std::collections::BTreeMap;
use tryon_geometry::math::{P3, P3d, V3d};
use tryon_geometry::mesh::Face;

/// Closed outlines of the surface in a plane, in coordinates (u, v) of the plane around its `origin`.
#[derive(Clone, Debug)]
pub(super) struct Section {
    /// Points of each closed outline, in order.
    pub(super) outlines: Vec<Vec<Point2<f64>>>,
}

/// Cuts a surface with the plane through `origin` with unit `normal`; `u` (in the plane) gives the first coordinate,
/// `normal × u` the second. Outlines that do not close are left out.
pub(super) fn section(
    vertices: &[P3],
    faces: &[Face],
    origin: &P3d,
    normal: &V3d,
    u: &V3d,
) -> Section {
    let v = normal.cross(u);
    let side = |p: &P3| (p.cast::<f64>() - origin).dot(normal);
    // Each cut face leads from the edge where the outline enters to the one where it leaves.
    let mut next: BTreeMap<(u32, u32), (u32, u32)> = BTreeMap::new();
    for f in faces {
        let above = f.map(|i| side(&vertices[i as usize]) >= 0.0);
        if above[0] == above[1] && above[1] == above[2] {
            continue;
        }
        let key = |k: usize| {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            (a.min(b), a.max(b))
        };
        let down = (0..3).find(|&k| above[k] && !above[(k + 1) % 3]);
        let up = (0..3).find(|&k| !above[k] && above[(k + 1) % 3]);
        if let (Some(d), Some(u)) = (down, up) {
            next.insert(key(d), key(u));
        }
    }
    let point = |(a, b): (u32, u32)| {
        let (p, q) = (
            vertices[a as usize].cast::<f64>(),
            vertices[b as usize].cast::<f64>(),
        );
        let (da, db) = ((p - origin).dot(normal), (q - origin).dot(normal));
        let x = p + (q - p) * (da / (da - db)) - origin;
        Point2::new(x.dot(u), x.dot(&v))
    };
    let mut outlines = Vec::new();
    while let Some((&first, _)) = next.iter().next() {
        let (mut at, mut outline) = (first, Vec::new());
        while let Some(to) = next.remove(&at) {
            outline.push(point(at));
            at = to;
        }
        if at == first && outline.len() > 2 {
            outlines.push(outline);
        }
    }
    Section { outlines }
}

impl Section {
    /// The outline around (u, v) = 0, or else the one whose middle is nearest to it.
    pub(super) fn central(&self) -> Option<&Vec<Point2<f64>>> {
        let off = |o: &Vec<Point2<f64>>| {
            let sum = o
                .iter()
                .fold(nalgebra::Vector2::zeros(), |s, p| s + p.coords);
            sum.norm() / o.len() as f64
        };
        self.outlines
            .iter()
            .min_by(|a, b| off(a).total_cmp(&off(b)))
    }
    /// Length of a tape around the central outline: that of its convex hull.
    pub(super) fn girth(&self) -> Option<f64> {
        self.central().map(|o| hull_length(o))
    }
}

/// Length of the convex hull of points in the plane (monotone chain).
fn hull_length(points: &[Point2<f64>]) -> f64 {
    let mut p = points.to_vec();
    p.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |it: &mut dyn Iterator<Item = &Point2<f64>>| {
        let mut h: Vec<Point2<f64>> = Vec::new();
        for q in it {
            while let [.., a, b] = h.as_slice() {
                if (b - a).perp(&(q - b)) > 0.0 {
                    break;
                }
                h.pop();
            }
            h.push(*q);
        }
        h.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>()
    };
    chain(&mut p.iter()) + chain(&mut p.iter().rev())
}

/// Distance of slices in searches for a maximum or an end, metres. Girths change by less than 1 mm in between.
pub(super) const SLICE: f64 = 0.006;

/// Faces by the height they span, so that a level cut visits a few hundred of them.
pub(super) struct LevelSlabs<'a> {
    vertices: &'a [P3],
    low: f64,
    /// Faces that reach into each slab of [`SLICE`] metres.
    slabs: Vec<Vec<Face>>,
}

impl<'a> LevelSlabs<'a> {
    pub(super) fn new(vertices: &'a [P3], faces: &[Face], low: f64, high: f64) -> Self {
        let slab = |y: f64| ((y - low) / SLICE).max(0.0) as usize;
        let mut slabs = vec![Vec::new(); slab(high) + 1];
        for f in faces {
            let y = f.map(|i| f64::from(vertices[i as usize].y));
            let (a, b) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
            slabs[slab(a)..=slab(b)].iter_mut().for_each(|s| s.push(*f));
        }
        Self {
            vertices,
            low,
            slabs,
        }
    }
    /// The level section through a point.
    pub(super) fn cut(&self, origin: P3d) -> Section {
        let k = ((origin.y - self.low) / SLICE).floor();
        let faces = if k < 0.0 {
            None
        } else {
            self.slabs.get(k as usize)
        };
        section(
            self.vertices,
            faces.map_or(&[], Vec::as_slice),
            &origin,
            &V3d::y(),
            &V3d::x(),
        )
    }
}

/// Distance to the first crossing of the surface along a ray from inside with a unit direction, metres.
pub(super) fn first_exit(
    vertices: &[P3],
    faces: &[Face],
    from: &P3d,
    direction: &V3d,
) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    for f in faces {
        let [a, b, c] = f.map(|i| vertices[i as usize].cast::<f64>());
        let (e1, e2) = (b - a, c - a);
        let h = direction.cross(&e2);
        let det = e1.dot(&h);
        if det.abs() < f64::MIN_POSITIVE {
            continue;
        }
        let s = from - a;
        let (u, q) = (s.dot(&h) / det, s.cross(&e1));
        let (w, t) = (direction.dot(&q) / det, e2.dot(&q) / det);
        if u >= 0.0 && w >= 0.0 && u + w <= 1.0 && t > 0.0 && nearest.is_none_or(|n| t < n) {
            nearest = Some(t);
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A closed cylinder of radius 0.2 m about the y axis, `n` sides, height 0 to 1 m.
    fn cylinder(n: u32) -> (Vec<P3>, Vec<Face>) {
        let mut v = Vec::new();
        for y in [0.0f32, 1.0] {
            for k in 0..n {
                let a = 2.0 * std::f32::consts::PI * k as f32 / n as f32;
                v.push(P3::new(0.2 * a.cos(), y, 0.2 * a.sin()));
            }
        }
        let f = (0..n).flat_map(|k| {
            let l = (k + 1) % n;
            [[k, n + k, l], [l, n + k, n + l]]
        });
        (v, f.collect())
    }

    #[test]
    fn girth_of_a_cylinder_level_and_oblique() {
        let (v, f) = cylinder(256);
        let level = section(&v, &f, &P3d::new(0.0, 0.4, 0.0), &V3d::y(), &V3d::x());
        assert_eq!(level.outlines.len(), 1);
        let girth = level.girth().expect("closed");
        assert!((girth - 0.4 * PI).abs() < 2e-4, "{girth}");
        // 45°: an ellipse with half axes r and r√2; Ramanujan's second formula.
        let n = V3d::new(0.0, 1.0, 1.0).normalize();
        let girth = section(&v, &f, &P3d::new(0.0, 0.5, 0.0), &n, &V3d::x())
            .girth()
            .expect("closed");
        let (a, b) = (0.2 * 2f64.sqrt(), 0.2);
        let h = ((a - b) / (a + b)).powi(2);
        let expected = PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        assert!(
            (girth - expected).abs() < 3e-4,
            "{girth} against {expected}"
        );
        assert!(
            section(&v, &f, &P3d::new(0.0, 2.0, 0.0), &V3d::y(), &V3d::x())
                .girth()
                .is_none()
        );
    }

    #[test]
    fn a_tape_bridges_hollows() {
        // An L: the hull cuts the corner.
        let l = [
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
        ]
        .map(Point2::from);
        assert!((hull_length(&l) - (6.0 + 2f64.sqrt())).abs() < 1e-12);
    }

    #[test]
    fn rays_leave_where_they_should() {
        let (v, f) = cylinder(256);
        let t = first_exit(&v, &f, &P3d::new(0.0, 0.5, 0.0), &V3d::x());
        assert!((t.expect("hit") - 0.2).abs() < 1e-4);
        assert_eq!(
            first_exit(&v, &f, &P3d::new(0.0, 0.5, 0.0), &V3d::y()),
            None
        );
    }
}
