//! Transforms and cameras on the wire.

use super::{WireError, required};
use crate::v1;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tryon_geometry::camera::{Calibration, Distortion, Intrinsics, Lens};
use tryon_geometry::math::Rigid;

/// Largest error of a quaternion's norm: f32 senders are off by 1e-7, wrong scales by far more.
const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

fn vector(v: &v1::Vector3, field: &str) -> Result<Vector3<f64>, WireError> {
    for (axis, value) in [("x", v.x), ("y", v.y), ("z", v.z)] {
        if !value.is_finite() {
            return Err(WireError::new(format!("{field}.{axis}"), "is not finite"));
        }
    }
    Ok(Vector3::new(v.x, v.y, v.z))
}

/// Finite vector.
///
/// # Errors
/// Names the component at fault.
pub fn vector_from_wire(v: Option<&v1::Vector3>, field: &str) -> Result<Vector3<f64>, WireError> {
    vector(required(v, field)?, field)
}

/// Wire message of a vector.
pub fn vector_to_wire(v: &Vector3<f64>) -> v1::Vector3 {
    v1::Vector3 {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}

/// Rigid transform; the caller names its frames.
///
/// # Errors
/// Names the part that is absent, not finite or no rotation.
pub fn rigid_from_wire<A, B>(
    t: &v1::RigidTransform,
    field: &str,
) -> Result<Rigid<A, B>, WireError> {
    let translation = vector_from_wire(t.translation.as_ref(), &format!("{field}.translation"))?;
    let q = required(t.rotation, &format!("{field}.rotation"))?;
    let q = Quaternion::new(q.w, q.x, q.y, q.z);
    let norm = q.norm();
    // The negated form also refuses NaN.
    if !((norm - 1.0).abs() <= QUATERNION_NORM_TOLERANCE) {
        return Err(WireError::new(
            format!("{field}.rotation"),
            format!("its norm is {norm}, not 1"),
        ));
    }
    Ok(Rigid::from_parts(
        translation,
        UnitQuaternion::from_quaternion(q),
    ))
}

/// Wire message of a rigid transform.
pub fn rigid_to_wire<A, B>(t: &Rigid<A, B>) -> v1::RigidTransform {
    let q = t.iso().rotation.coords;
    v1::RigidTransform {
        translation: Some(vector_to_wire(&t.iso().translation.vector)),
        rotation: Some(v1::Quaternion {
            x: q.x,
            y: q.y,
            z: q.z,
            w: q.w,
        }),
    }
}

fn intrinsics(k: &v1::Intrinsics, field: &str) -> Result<Intrinsics, WireError> {
    Intrinsics {
        width: k.width,
        height: k.height,
        fx: k.fx,
        fy: k.fy,
        cx: k.cx,
        cy: k.cy,
    }
    .validated()
    .map_err(|e| {
        WireError::new(
            format!("{field}.{}", e.field),
            format!("{} is not usable ({})", e.value, e.why),
        )
    })
}

fn intrinsics_to_wire(k: &Intrinsics) -> v1::Intrinsics {
    v1::Intrinsics {
        width: k.width,
        height: k.height,
        fx: k.fx,
        fy: k.fy,
        cx: k.cx,
        cy: k.cy,
    }
}

/// Lens with valid intrinsics and distortion.
///
/// # Errors
/// Names the field out of range.
pub fn lens_from_wire(l: &v1::Lens, field: &str) -> Result<Lens, WireError> {
    let of = |part: &str| format!("{field}.{part}");
    let distortion = Distortion::from_opencv(&l.distortion);
    Ok(Lens {
        intrinsics: intrinsics(
            &required(l.intrinsics, &of("intrinsics"))?,
            &of("intrinsics"),
        )?,
        distortion: distortion.map_err(|e| WireError::new(of("distortion"), e.to_string()))?,
    })
}

/// Calibration with valid intrinsics.
///
/// # Errors
/// Names the field out of range.
pub fn calibration_from_wire(c: &v1::Calibration) -> Result<Calibration, WireError> {
    Ok(Calibration {
        depth: intrinsics(
            &required(c.depth, "calibration.depth")?,
            "calibration.depth",
        )?,
        color: c
            .color
            .as_ref()
            .map(|k| intrinsics(k, "calibration.color"))
            .transpose()?,
        color_from_depth: match &c.color_from_depth {
            Some(t) => rigid_from_wire(t, "calibration.color_from_depth")?,
            None => Rigid::identity(),
        },
    })
}

/// Wire message of a calibration.
pub fn calibration_to_wire(c: &Calibration) -> v1::Calibration {
    v1::Calibration {
        depth: Some(intrinsics_to_wire(&c.depth)),
        color: c.color.as_ref().map(intrinsics_to_wire),
        color_from_depth: Some(rigid_to_wire(&c.color_from_depth)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::{Camera, World};

    #[test]
    fn calibrations_round_trip_and_nan_is_named() {
        let c = Calibration::registered(Intrinsics::KINECT_V1);
        let mut w = calibration_to_wire(&c);
        assert_eq!(calibration_from_wire(&w).expect("same"), c);
        w.depth.as_mut().expect("there").fy = f64::NAN;
        assert_eq!(
            calibration_from_wire(&w).expect_err("NaN").field,
            "calibration.depth.fy"
        );
        assert_eq!(
            calibration_from_wire(&v1::Calibration::default())
                .expect_err("empty")
                .field,
            "calibration.depth"
        );
    }

    #[test]
    fn what_is_no_rotation_is_refused() {
        let t = Rigid::<World, Camera>::level(1.3);
        let mut w = rigid_to_wire(&t);
        let back: Rigid<World, Camera> = rigid_from_wire(&w, "t").expect("same");
        assert!((back.iso().translation.vector - t.iso().translation.vector).norm() < 1e-15);
        for bad in [0.0, 2.0, f64::NAN] {
            w.rotation = Some(v1::Quaternion {
                x: bad,
                y: 0.0,
                z: 0.0,
                w: 0.0,
            });
            let e = rigid_from_wire::<World, Camera>(&w, "t").expect_err("no rotation");
            assert_eq!(e.field, "t.rotation");
        }
    }
}
