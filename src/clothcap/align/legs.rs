//! Course of the cloth around the legs, read off a scan: cloth in front of and behind the gap between them joins them.

use super::model_fit::AlignedBody;
use crate::CaptureError;
use crate::scan::BodyScan;
use crate::settings::LegSettings;
use crate::topology::{ClothTemplate, LegTopology};
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::math::{P3, V3};

/// Course of the cloth around the legs of an aligned body.
pub(super) fn leg_topology(
    template: &Arc<Template>,
    scan: &BodyScan,
    body: &AlignedBody,
    settings: &LegSettings,
) -> Result<LegTopology, CaptureError> {
    let Ok(cloth) = ClothTemplate::new(template, LegTopology::Joined) else {
        return Ok(LegTopology::Apart);
    };
    let surface = body.posed(cloth.template()).vertices;
    let seen = seen_share(&cloth, scan, &surface, settings);
    Ok(match seen > settings.least_seen {
        true => LegTopology::Joined,
        false => LegTopology::Apart,
    })
}

/// Share of the tube's middle, just below the crotch, in front of which the scan has cloth.
fn seen_share(
    cloth: &ClothTemplate,
    scan: &BodyScan,
    surface: &[P3],
    settings: &LegSettings,
) -> f64 {
    let normals = cloth.template().normals(surface);
    let rest = cloth.template().mesh().vertices();
    let middle = || cloth.middle(settings.middle);
    let top = middle().map(|v| rest[v].y).fold(f32::MIN, f32::max);
    let [least, most] = settings.depths;
    let (mut seen, mut all) = (0, 0);
    for v in middle().filter(|v| (least..most).contains(&(top - rest[*v].y))) {
        all += 1;
        seen += usize::from(is_covered(scan, &surface[v], &normals[v], settings));
    }
    seen as f64 / f64::from(all.max(1))
}

/// Has cloth before it: a scan point on its line of sight that looks the same way.
fn is_covered(scan: &BodyScan, p: &P3, normal: &V3, settings: &LegSettings) -> bool {
    let ([low, high], aside) = (settings.reach, settings.aside);
    scan.points.iter().zip(&scan.normals).any(|(q, n)| {
        let d = q - p;
        let along = d.dot(normal);
        let facing = n.dot(normal);
        let facing = if scan.oriented { facing } else { facing.abs() };
        (low..high).contains(&along)
            && (d - normal * along).norm_squared() < aside * aside
            && facing > settings.facing
    })
}
