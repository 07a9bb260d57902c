//! A database that librealsense 2.59 itself recorded of its software device: `realsense.record` of
//! `tests/clients/camera_sources`, three frames of that folder's scene.

use crate::recording::open_as_recorded;
use nalgebra::Vector3;
use std::path::Path;

#[test]
fn databases_of_the_sdk_state_their_unit() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/recordings");
    let mut source = open_as_recorded(&folder.join("librealsense.db3")).expect("opens");
    let lenses = source.lenses();
    let k = lenses.depth.intrinsics;
    assert_eq!([k.fx, k.fy, k.cx, k.cy], [30.0, 30.5, 15.5, 12.25]);
    assert!(lenses.depth.distortion.is_none());
    let color = lenses.color.expect("a camera of its own");
    let k = color.intrinsics;
    assert_eq!([k.fx, k.fy, k.cx, k.cy], [45.0, 45.5, 23.5, 13.75]);
    // k1, k2, k3, p1, p2 as 32-bit floats.
    let [k1, k2, k3, ..] = color.distortion.radial;
    let [p1, p2] = color.distortion.tangential;
    for (got, want) in [k1, k2, k3, p1, p2]
        .into_iter()
        .zip([-0.05, 0.06, -0.02, 2e-4, -6e-4])
    {
        assert!((got - want).abs() < 1e-8, "{got}, expected {want}");
    }
    let pose = *lenses.color_from_depth.iso();
    let off = pose.translation.vector - Vector3::new(0.015, -0.002, 0.001);
    let turn = pose.rotation.scaled_axis() - Vector3::new(1.0, 2.0, 3.0).normalize() * 0.02;
    assert!(off.norm() < 1e-8 && turn.norm() < 1e-6, "{pose}");

    let frames: Vec<_> = std::iter::from_fn(|| source.next_frame().expect("reads")).collect();
    assert_eq!(frames.len(), 3);
    for (frame, number) in frames.iter().zip(0i32..) {
        let base = 500 + 40 * number;
        for (u, v) in [(1, 0), (31, 0), (0, 1), (31, 23)] {
            let reading = i32::from(frame.depth.at(u, v));
            assert_eq!(reading, base + u + 32 * v, "millimetres of quarters");
        }
        assert_eq!(frame.depth.at(0, 0), 0);
        let grey = 30 + 20 * number as u8;
        assert_eq!(
            frame.color.as_ref().expect("colour").at(5, 5),
            [grey, 90, 150]
        );
    }
    let notes = source.untaken().join("\n");
    assert!(!notes.contains("Depth_Units/value"), "{notes}");
}
