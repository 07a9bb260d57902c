//! Small meshes and scenes with closed forms, for tests.

mod two_cameras;

pub use two_cameras::{RegistrationScore, TwoCameras};

use crate::math::P3;
use crate::mesh::Face;

/// Two boxes with outward faces that lie in each other, the second one shifted along x, metres.
pub fn two_boxes(shift: f32) -> (Vec<P3>, Vec<Face>) {
    let (mut x, mut faces) = (Vec::new(), Vec::new());
    for (low, high) in [
        ([0.0; 3], [1.0, 0.2, 0.3]),
        ([0.8, -0.1, 0.05], [1.5, 0.4, 0.25]),
    ] {
        let first = x.len() as u32;
        let by = if first > 0 { shift } else { 0.0 };
        for i in 0..8 {
            let corner: [f32; 3] =
                std::array::from_fn(|k| if i >> k & 1 == 1 { high[k] } else { low[k] });
            x.push(P3::new(corner[0] + by, corner[1], corner[2]));
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
    (x, faces)
}
