//! Residuals of outline points in colour, and their derivatives.
//!
//! A rim point P of a depth frame at time T is projected to u(P); s is the distance along the outward normal n to the
//! border of the person in colour, interpolated between the colour images around T − τ. With the border a width w
//! outside of the rim, r = s − w. A left increment ξ = (v, ω) of the extrinsics moves Q = color_from_depth · P by
//! v + ω × Q, hence ∂r/∂ξ = −nᵀ ∂u/∂Q (I, −Q×); ∂r/∂τ = −ṡ; ∂r/∂w = −1.

use super::border::BorderSearch;
use super::evidence::{ChangeBracket, WalkEvidence};
use super::outline::RimPoint;
use nalgebra::{Isometry3, Point2, SVector, Vector2};
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{P3d, Twist, V3d, exp_se3};

/// Unknowns: linear and angular part of ξ (m, rad), τ (s), w (pixels of reduced colour).
pub(crate) const UNKNOWNS: usize = 8;
/// Number of τ.
pub(crate) const TIME: usize = 6;
/// Number of w.
pub(crate) const WIDTH: usize = 7;
/// Least distance of a point before the camera (m).
const NEAREST: f64 = 0.1;

/// A value for each unknown.
pub(crate) type UnknownVector = SVector<f64, UNKNOWNS>;

/// State of the estimation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unknowns {
    pub(crate) color_from_depth: Isometry3<f64>,
    /// Time to add to colour's stamps (s).
    pub(crate) time_offset: f64,
    /// Distance of the border in colour outside of the rim in depth (pixels of reduced colour).
    pub(crate) width: f64,
}

impl Unknowns {
    /// The state after an increment.
    pub(crate) fn moved(&self, step: &UnknownVector) -> Self {
        let xi = Twist {
            linear: step.fixed_rows::<3>(0).into_owned(),
            angular: step.fixed_rows::<3>(3).into_owned(),
        };
        Self {
            color_from_depth: exp_se3(&xi) * self.color_from_depth,
            time_offset: self.time_offset + step[TIME],
            width: self.width + step[WIDTH],
        }
    }
}

/// Residual of one point (pixels of its level) and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ResidualRow {
    pub(crate) residual: f64,
    pub(crate) gradient: UnknownVector,
}

/// Comparison at one size of the images.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Comparison {
    /// Number of halvings.
    pub(crate) level: usize,
    pub(crate) search: BorderSearch,
}

/// Residuals of the points of one outline that are met in colour.
pub(crate) fn outline_rows(
    evidence: &WalkEvidence,
    outline: usize,
    unknowns: &Unknowns,
    comparison: &Comparison,
) -> Vec<ResidualRow> {
    let (time, outline) = &evidence.outlines[outline];
    let Some(bracket) = evidence.around(time - unknowns.time_offset) else {
        return Vec::new();
    };
    let view = LevelView {
        camera: evidence.cameras[comparison.level],
        unknowns,
        scale: 0.5f64.powi(comparison.level as i32),
    };
    let row = |p| view.row(p, &bracket, comparison);
    outline.points.iter().filter_map(row).collect()
}

/// Colour camera of one level.
struct LevelView<'a> {
    camera: Intrinsics,
    unknowns: &'a Unknowns,
    /// Pixels of this level in one of the reduced colour.
    scale: f64,
}

impl LevelView<'_> {
    fn row(
        &self,
        rim: &RimPoint,
        bracket: &ChangeBracket<'_>,
        comparison: &Comparison,
    ) -> Option<ResidualRow> {
        let q = self.unknowns.color_from_depth * rim.point;
        let along = self.project(&(q + self.unknowns.color_from_depth * rim.tangent))?;
        let at = self.project(&q)?;
        let along = along - at;
        let outward = Vector2::new(along.y, -along.x).try_normalize(f64::EPSILON)?;

        let image = |k: usize| &bracket.images[k].levels[comparison.level];
        let find = |k| comparison.search.find(image(k), at, outward);
        let (before, after) = (find(0)?, find(1)?);
        if (after - before).abs() > comparison.search.reach as f64 {
            return None;
        }
        let distance = before + (after - before) * bracket.part;

        let pull = self.derivative(&q, &outward);
        let turn = q.coords.cross(&pull);
        let mut gradient = UnknownVector::zeros();
        gradient.fixed_rows_mut::<3>(0).copy_from(&-pull);
        gradient.fixed_rows_mut::<3>(3).copy_from(&-turn);
        gradient[TIME] = (before - after) / bracket.gap;
        gradient[WIDTH] = -self.scale;
        Some(ResidualRow {
            residual: distance - self.unknowns.width * self.scale,
            gradient,
        })
    }

    fn project(&self, q: &P3d) -> Option<Point2<f64>> {
        let k = &self.camera;
        (q.z > NEAREST).then(|| Point2::new(k.fx * q.x / q.z + k.cx, k.fy * q.y / q.z + k.cy))
    }

    /// Derivative of the projection's component along `normal` by the point.
    fn derivative(&self, q: &P3d, normal: &Vector2<f64>) -> V3d {
        let (x, y) = (
            normal.x * self.camera.fx / q.z,
            normal.y * self.camera.fy / q.z,
        );
        V3d::new(x, y, -(x * q.x + y * q.y) / q.z)
    }
}
