//! Synthetic depth images for the tests of this module.

use nalgebra::Vector3;
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::spatial::OrganisedCloud;

/// Organised cloud of a 320 × 240 image; `depth` maps normalised image coordinates to millimetres.
pub(super) fn cloud_of(depth: impl Fn(f64, f64) -> u16) -> OrganisedCloud {
    let k = Intrinsics {
        width: 320,
        height: 240,
        fx: 262.5,
        fy: 262.5,
        cx: 159.5,
        cy: 119.5,
    };
    let data = (0..k.pixels()).map(|i| {
        let (u, v) = ((i % 320) as f64, (i / 320) as f64);
        depth((u - k.cx) / k.fx, (v - k.cy) / k.fy)
    });
    let image = DepthImage::new(320, 240, data.collect()).expect("sizes agree");
    let mut cloud = OrganisedCloud::new(&k, Some(2));
    cloud.sample(&image, 8.0);
    cloud
}

/// A room seen from 1.1 m, pitched down by `pitch`: floor and a wall at 4 m, with a box of 0.4 × 1.7 m
/// standing at 2.5 m when `person`.
pub(super) fn room(pitch: f64, person: bool) -> OrganisedCloud {
    let (sin, cos) = pitch.sin_cos();
    cloud_of(|x, y| {
        // Ray in a level frame (y down).
        let d = Vector3::new(x, y * cos + sin, cos - y * sin);
        let mut z = f64::INFINITY;
        if d.y > 0.0 {
            z = z.min(1.1 / d.y);
        }
        z = z.min(4.0 / d.z);
        if person {
            let t = 2.5 / d.z;
            let (px, py) = (t * d.x, 1.1 - t * d.y);
            if px.abs() < 0.2 && (0.0..1.7).contains(&py) {
                z = z.min(t);
            }
        }
        (z * 1000.0).clamp(0.0, 60_000.0) as u16
    })
}
