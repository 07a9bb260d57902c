//! Depth of points inside a closed surface, from its winding number and closest face.

use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;
use tryon_geometry::spatial::Bvh;

/// A closed surface that may pass through itself; outward faces are counter-clockwise.
pub struct Solid<'a> {
    vertices: &'a [P3],
    bvh: Bvh,
}

impl<'a> Solid<'a> {
    /// Prepares the queries. Vertices in metres.
    pub fn new(vertices: &'a [P3], faces: &[Face]) -> Self {
        Self {
            vertices,
            bvh: Bvh::new(faces, vertices),
        }
    }
    /// Winding number around a point: 1 inside, 0 outside, 2 where two limbs lie in each other.
    pub fn winding(&self, p: &P3) -> i32 {
        self.bvh.winding_number(self.vertices, p)
    }
    /// Distance from a point inside to the nearest face, metres; zero outside.
    pub fn depth(&self, p: &P3) -> f32 {
        if self.winding(p) <= 0 {
            return 0.0;
        }
        self.bvh
            .closest(self.vertices, p)
            .map_or(0.0, |near| near.distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::fixtures::two_boxes;

    #[test]
    fn depths_in_two_boxes_that_lie_in_each_other_have_their_closed_form() {
        let (v, f) = two_boxes(0.0);
        let solid = Solid::new(&v, &f);
        assert!((solid.depth(&P3::new(0.5, 0.151, 0.12)) - 0.049).abs() < 1e-6);
        assert_eq!(solid.winding(&P3::new(0.901, 0.103, 0.15)), 2);
        assert_eq!(solid.winding(&P3::new(1.21, 0.33, 0.15)), 1);
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
