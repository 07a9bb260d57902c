//! Mounting of a camera: quarter turns and mirroring of its pictures, and their effect on calibrations.

use super::{Distortion, Intrinsics, Lens, LensCalibration};
use crate::math::Rigid;
use nalgebra::{Matrix2, Matrix3, Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};

/// Clockwise turn of a picture by quarters; in configurations its degrees: 0, 90, 180 or 270.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u16", into = "u16")]
pub enum PictureTurn {
    /// 0°.
    #[default]
    None,
    /// 90°: the left edge becomes the top.
    Quarter,
    /// 180°.
    Half,
    /// 270°: the right edge becomes the top.
    ThreeQuarters,
}

/// Degrees that are no quarter turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0} degrees, expected 0, 90, 180 or 270 (clockwise)")]
pub struct PictureTurnError(pub u16);

impl PictureTurn {
    /// Every turn.
    pub const ALL: [Self; 4] = [Self::None, Self::Quarter, Self::Half, Self::ThreeQuarters];

    /// Number of quarters, 0 to 3.
    pub(super) fn quarters(self) -> u16 {
        self as u16
    }
    /// Degrees clockwise.
    pub fn degrees(self) -> u16 {
        90 * self.quarters()
    }
}

impl TryFrom<u16> for PictureTurn {
    type Error = PictureTurnError;
    fn try_from(degrees: u16) -> Result<Self, Self::Error> {
        let turn = Self::ALL.into_iter().find(|t| t.degrees() == degrees);
        turn.ok_or(PictureTurnError(degrees))
    }
}

impl From<PictureTurn> for u16 {
    fn from(turn: PictureTurn) -> Self {
        turn.degrees()
    }
}

/// Difference between the pictures that a device delivers and upright ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mounting {
    /// Clockwise turn that sets a picture upright, after it was unmirrored.
    pub turned: PictureTurn,
    /// Left and right are exchanged in the pictures as delivered.
    pub mirrored: bool,
}

impl Mounting {
    /// True if pictures stay as they are.
    pub fn is_upright(self) -> bool {
        self == Self::default()
    }

    /// Axes of the upright camera from those of the delivered pictures: x and y; z is common to both.
    pub fn upright_from_delivered(self) -> Matrix2<f64> {
        let mut axes = Matrix2::identity();
        if self.mirrored {
            axes[(0, 0)] = -1.0;
        }
        for _ in 0..self.turned.quarters() {
            axes = Matrix2::new(0.0, -1.0, 1.0, 0.0) * axes;
        }
        axes
    }

    /// Calibration of upright pictures.
    ///
    /// `delivered` is that of the pictures as delivered; of mirrored ones, that of a mirrored world. Both cameras are
    /// turned and mirrored alike.
    pub fn upright(self, delivered: &LensCalibration) -> LensCalibration {
        let axes = self.upright_from_delivered();
        let iso = delivered.color_from_depth.iso();
        let mut space = Matrix3::identity();
        space.fixed_view_mut::<2, 2>(0, 0).copy_from(&axes);
        // The axis of a rotation is a pseudovector: mirroring turns its sense round.
        let axis = space * iso.rotation.imag() * axes.determinant().signum();
        let rotation = Quaternion::from_parts(iso.rotation.w, axis);
        LensCalibration {
            depth: self.upright_lens(delivered.depth),
            color: delivered.color.map(|lens| self.upright_lens(lens)),
            color_from_depth: Rigid::from_parts(
                space * iso.translation.vector,
                UnitQuaternion::new_unchecked(rotation),
            ),
        }
    }

    fn upright_lens(self, lens: Lens) -> Lens {
        // Tangential distortion is 2 (q·x) x + q r² with q = (p₂, p₁): q turns as x does.
        let [p1, p2] = lens.distortion.tangential;
        let q = self.upright_from_delivered() * nalgebra::Vector2::new(p2, p1);
        Lens {
            intrinsics: self.upright_intrinsics(lens.intrinsics),
            distortion: Distortion {
                tangential: [q.y, q.x],
                ..lens.distortion
            },
        }
    }

    fn upright_intrinsics(self, mut k: Intrinsics) -> Intrinsics {
        if self.mirrored {
            k.cx = f64::from(k.width) - 1.0 - k.cx;
        }
        for _ in 0..self.turned.quarters() {
            k = Intrinsics {
                width: k.height,
                height: k.width,
                fx: k.fy,
                fy: k.fx,
                cx: f64::from(k.height) - 1.0 - k.cy,
                cy: k.cx,
            };
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    fn lenses() -> LensCalibration {
        let lens = |shift: f64| Lens {
            intrinsics: Intrinsics {
                width: 640,
                height: 480,
                fx: 500.0,
                fy: 510.0,
                cx: 300.0 + shift,
                cy: 250.0,
            },
            distortion: Distortion::from_opencv(&[0.1, -0.05, 0.003, -0.002, 0.01])
                .expect("finite"),
        };
        let rotation = UnitQuaternion::from_euler_angles(0.02, -0.03, 0.1);
        LensCalibration {
            depth: lens(0.0),
            color: Some(lens(11.0)),
            color_from_depth: Rigid::from_parts(Vector3::new(0.05, -0.01, 0.004), rotation),
        }
    }

    /// Pixel at which a lens draws a point, by the formulas.
    fn drawn(lens: &Lens, p: &Point3<f64>) -> [f64; 2] {
        let [x, y] = lens.distortion.distort([p.x / p.z, p.y / p.z]);
        let k = &lens.intrinsics;
        [x * k.fx + k.cx, y * k.fy + k.cy]
    }

    /// Pixel of the upright picture from one of the delivered picture: a sheet of paper turned by hand.
    fn on_paper(mounting: Mounting, [mut u, mut v]: [f64; 2]) -> [f64; 2] {
        let (mut w, mut h) = (640.0, 480.0);
        if mounting.mirrored {
            u = w - 1.0 - u;
        }
        for _ in 0..mounting.turned.degrees() / 90 {
            (u, v) = (h - 1.0 - v, u);
            (w, h) = (h, w);
        }
        [u, v]
    }

    #[test]
    fn both_cameras_draw_points_at_the_turned_pixels() {
        for turned in PictureTurn::ALL {
            for mirrored in [false, true] {
                let mounting = Mounting { turned, mirrored };
                let (delivered, upright) = (lenses(), mounting.upright(&lenses()));
                let axes = mounting.upright_from_delivered();
                let p = Point3::new(0.31, -0.22, 1.7);
                let xy = axes * p.xy().coords;
                let q = Point3::new(xy.x, xy.y, p.z);
                let pairs = [
                    (drawn(&delivered.depth, &p), drawn(&upright.depth, &q)),
                    (
                        drawn(
                            &delivered.color.expect("two cameras"),
                            &delivered.color_from_depth.point(&p),
                        ),
                        drawn(
                            &upright.color.expect("two cameras"),
                            &upright.color_from_depth.point(&q),
                        ),
                    ),
                ];
                for (before, after) in pairs {
                    let want = on_paper(mounting, before);
                    let error = (after[0] - want[0]).hypot(after[1] - want[1]);
                    assert!(error < 1e-9, "{mounting:?}: {after:?} against {want:?}");
                }
            }
        }
    }

    #[test]
    fn upright_cameras_stay_as_they_are() {
        assert!(Mounting::default().is_upright());
        assert_eq!(Mounting::default().upright(&lenses()), lenses());
    }

    #[test]
    fn turns_are_degrees() {
        assert_eq!(PictureTurn::try_from(270), Ok(PictureTurn::ThreeQuarters));
        let e = PictureTurn::try_from(45).expect_err("no quarter");
        assert!(e.to_string().contains("45 degrees, expected 0, 90"));
    }
}
