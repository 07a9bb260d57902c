//! Course of the cloth around the legs, read off a scan: cloth in front of and behind the gap between them joins them.

use super::model_fit::{AlignedBody, ModelFit};
use crate::CaptureError;
use crate::scan::BodyScan;
use crate::topology::{ClothTemplate, LegTopology};
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::math::{P3, V3};

/// Ways below the top of the tube that are looked at, metres: seats of trousers reach down to the first, the shortest
/// skirts to the second.
const DEPTHS: std::ops::Range<f32> = 0.10..0.25;
/// Distance in front of the body up to which cloth is looked for, and how deep it may lie inside, metres.
const REACH: [f32; 2] = [-0.02, 0.25];
/// Distance of a scan point from the line of sight of a vertex, metres.
const ASIDE: f32 = 0.015;
/// Smallest cosine between the normals of cloth and of the tube.
const FACING: f32 = 0.85;
/// Share of the tube's middle in front of which cloth is seen, from which legs are joined: skirts have 0.95, trousers 0.25,
/// those of `scans/liam` with closed legs 0.5.
const LEAST_SEEN: f64 = 0.75;

/// Course of the cloth around the legs of an aligned body.
///
/// # Errors
/// [`CaptureError::Solve`]; a body whose legs cannot be joined keeps them apart.
pub(super) fn leg_topology(
    template: &Arc<Template>,
    scan: &BodyScan,
    body: &AlignedBody,
) -> Result<LegTopology, CaptureError> {
    let Ok(cloth) = ClothTemplate::new(template, LegTopology::Joined) else {
        return Ok(LegTopology::Apart);
    };
    let (surface, _) = ModelFit::new(cloth.template(), scan, 1).posed(body);
    Ok(if seen_share(&cloth, scan, &surface) > LEAST_SEEN {
        LegTopology::Joined
    } else {
        LegTopology::Apart
    })
}

/// Share of the tube's middle, just below the crotch, in front of which the scan has cloth.
fn seen_share(cloth: &ClothTemplate, scan: &BodyScan, surface: &[P3]) -> f64 {
    let normals = cloth.template().normals(surface);
    let rest = cloth.template().mesh().vertices();
    let top = cloth.middle().map(|v| rest[v].y).fold(f32::MIN, f32::max);
    let (mut seen, mut all) = (0, 0);
    for v in cloth
        .middle()
        .filter(|v| DEPTHS.contains(&(top - rest[*v].y)))
    {
        all += 1;
        seen += usize::from(is_covered(scan, &surface[v], &normals[v]));
    }
    seen as f64 / f64::from(all.max(1))
}

/// Has cloth before it: a scan point on its line of sight that looks the same way.
fn is_covered(scan: &BodyScan, p: &P3, normal: &V3) -> bool {
    scan.points.iter().zip(&scan.normals).any(|(q, n)| {
        let d = q - p;
        let along = d.dot(normal);
        let facing = n.dot(normal);
        let facing = if scan.oriented { facing } else { facing.abs() };
        (REACH[0]..REACH[1]).contains(&along)
            && (d - normal * along).norm_squared() < ASIDE * ASIDE
            && facing > FACING
    })
}
