//! How deep points lie inside a surface, by counting crossings: shares no code with the contact of the simulator.

use crate::math::{P3, V3};
use crate::mesh::Face;

/// Side of the columns that faces are sorted into, metres.
const COLUMN: f32 = 0.02;

/// A closed surface (it may pass through itself), sorted into columns along z.
pub struct Solid<'a> {
    vertices: &'a [P3],
    faces: &'a [Face],
    low: [f32; 2],
    size: [usize; 2],
    columns: Vec<Vec<u32>>,
    /// Middle of each face, and how far its corners are from there, metres.
    balls: Vec<(P3, f32)>,
}

impl<'a> Solid<'a> {
    /// Sorts the faces; outward means counter-clockwise.
    pub fn new(vertices: &'a [P3], faces: &'a [Face]) -> Self {
        let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
        for p in vertices {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let size: [usize; 2] =
            std::array::from_fn(|k| ((high[k] - low[k]).max(0.0) / COLUMN) as usize + 1);
        let mut columns = vec![Vec::new(); size[0] * size[1]];
        let mut balls = Vec::with_capacity(faces.len());
        for (i, f) in faces.iter().enumerate() {
            let c = f.map(|v| vertices[v as usize]);
            let cell = |k: usize, pick: fn(f32, f32) -> f32| {
                let bound = c.iter().map(|p| p[k]).reduce(pick).unwrap_or(0.0);
                ((bound - low[k]) / COLUMN) as usize
            };
            for y in cell(1, f32::min)..=cell(1, f32::max).min(size[1] - 1) {
                for x in cell(0, f32::min)..=cell(0, f32::max).min(size[0] - 1) {
                    columns[y * size[0] + x].push(i as u32);
                }
            }
            let middle = P3::from((c[0].coords + c[1].coords + c[2].coords) / 3.0);
            balls.push((
                middle,
                c.iter().map(|p| (p - middle).norm()).fold(0.0, f32::max),
            ));
        }
        Self {
            vertices,
            faces,
            low,
            size,
            columns,
            balls,
        }
    }
    /// How often the surface goes around a point: 1 inside, 0 outside, 2 where two limbs lie in each other.
    pub fn winding(&self, p: &P3) -> i32 {
        let cell: [f32; 2] = std::array::from_fn(|k| (p[k] - self.low[k]) / COLUMN);
        if (0..2).any(|k| !(cell[k] >= 0.0 && (cell[k] as usize) < self.size[k])) {
            return 0;
        }
        let faces = &self.columns[cell[1] as usize * self.size[0] + cell[0] as usize];
        faces.iter().map(|f| self.crossing(*f, p)).sum()
    }
    /// Distance from a point inside to the nearest face, metres; zero outside.
    pub fn depth(&self, p: &P3) -> f32 {
        if self.winding(p) <= 0 {
            return 0.0;
        }
        let mut best = f32::MAX;
        for (f, (middle, radius)) in self.faces.iter().zip(&self.balls) {
            if (p - middle).norm() - radius < best {
                best = best.min(distance(p, f.map(|v| self.vertices[v as usize])));
            }
        }
        best
    }
    /// +1 where the ray from `p` along +z leaves through the face, −1 where it enters.
    fn crossing(&self, face: u32, p: &P3) -> i32 {
        let [a, b, c] = self.faces[face as usize].map(|v| self.vertices[v as usize].cast::<f64>());
        let (x, y) = (f64::from(p.x), f64::from(p.y));
        let twice = |a: &nalgebra::Point3<f64>, b: &nalgebra::Point3<f64>| {
            (a.x - x) * (b.y - y) - (b.x - x) * (a.y - y)
        };
        let w = [twice(&b, &c), twice(&c, &a), twice(&a, &b)];
        let area: f64 = w.iter().sum();
        let inside = if area > 0.0 {
            w.iter().all(|w| *w >= 0.0)
        } else {
            w.iter().all(|w| *w <= 0.0)
        };
        if area == 0.0 || !inside || (w[0] * a.z + w[1] * b.z + w[2] * c.z) / area <= f64::from(p.z)
        {
            return 0;
        }
        if area > 0.0 { 1 } else { -1 }
    }
}

/// Distance from a point to a triangle: over its plane if the foot lies within, else to the nearest edge.
fn distance(p: &P3, t: [P3; 3]) -> f32 {
    let n = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let within = (0..3).all(|k| (t[(k + 1) % 3] - t[k]).cross(&(p - t[k])).dot(&n) >= 0.0);
    if within && n.norm() > 0.0 {
        return (p - t[0]).dot(&n).abs() / n.norm();
    }
    let to_edge = |a: &P3, d: V3| {
        let s = ((p - a).dot(&d) / d.norm_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p - (a + d * s)).norm()
    };
    (0..3)
        .map(|k| to_edge(&t[k], t[(k + 1) % 3] - t[k]))
        .fold(f32::MAX, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box from its low to its high corner, outward faces.
    fn cuboid(low: [f32; 3], high: [f32; 3], vertices: &mut Vec<P3>, faces: &mut Vec<Face>) {
        let first = vertices.len() as u32;
        for i in 0..8 {
            vertices.push(P3::from(std::array::from_fn(|k| {
                if i >> k & 1 == 1 { high[k] } else { low[k] }
            })));
        }
        for [a, b, c, d] in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ]
        .map(|q| q.map(|v| v + first))
        {
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }

    #[test]
    fn depths_in_two_boxes_that_lie_in_each_other_have_their_closed_form() {
        let (mut v, mut f) = (Vec::new(), Vec::new());
        cuboid([0.0, 0.0, 0.0], [1.0, 0.2, 0.3], &mut v, &mut f);
        cuboid([0.8, -0.1, 0.05], [1.5, 0.4, 0.25], &mut v, &mut f);
        let solid = Solid::new(&v, &f);
        assert!((solid.depth(&P3::new(0.5, 0.151, 0.12)) - 0.049).abs() < 1e-6);
        assert_eq!(solid.winding(&P3::new(0.901, 0.103, 0.15)), 2);
        assert_eq!(
            (
                solid.winding(&P3::new(1.21, 0.33, 0.15)),
                solid.winding(&P3::new(0.5, 0.1, 0.31))
            ),
            (1, 0)
        );
        for outside in [
            [0.5, 0.1, 0.31],
            [0.5, 0.1, -0.01],
            [-3.0, 0.1, 0.1],
            [0.5, 0.3, 0.1],
            [1.51, 0.1, 0.1],
        ] {
            assert_eq!(solid.depth(&P3::from(outside)), 0.0, "{outside:?}");
        }
    }

    #[test]
    fn nothing_is_inside_an_empty_mesh() {
        assert_eq!(Solid::new(&[], &[]).depth(&P3::origin()), 0.0);
    }
}
