//! Header of a capture, checked against the body template: a file from outside names the field at fault before anything
//! indexes by it.

use super::align::{AlignedBody, ClothedTemplate};
use super::captured_outfit::CapturedOutfit;
use super::multi::ClothPart;
use super::scan::ScanFrame;
use super::topology::ClothTemplate;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::math::P3;

/// Outfit of a capture and the state that later scans start from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CaptureHeader {
    /// Version of the layout.
    pub version: u32,
    /// Name of the body template.
    pub template: String,
    /// Unit and axes of the scans.
    pub frame: ScanFrame,
    /// Outfit.
    pub outfit: CapturedOutfit,
    /// Clothed template of the single-mesh alignment.
    pub clothed: ClothedTemplate,
    /// Names of all scans, in order.
    pub scans: Vec<String>,
}

/// Field and fault.
pub(super) type Fault = (String, String);

fn check(holds: bool, field: &str, why: impl FnOnce() -> String) -> Result<(), Fault> {
    if holds {
        Ok(())
    } else {
        Err((field.to_owned(), why()))
    }
}

fn check_count(got: usize, expected: usize, field: &str) -> Result<(), Fault> {
    check(got == expected, field, || {
        format!("{got} entries, expected {expected}")
    })
}

fn check_finite(points: &[P3], field: &str) -> Result<(), Fault> {
    let bad = points.iter().position(|p| !p.iter().all(|c| c.is_finite()));
    check(bad.is_none(), field, || {
        format!("entry {bad:?} is not finite")
    })
}

/// Checks pose and shape of a body.
pub(super) fn check_body(
    body: &AlignedBody,
    template: &Template,
    field: &str,
) -> Result<(), Fault> {
    let angles = format!("{field}.pose.angles");
    check_count(body.pose.angles.len(), template.skeleton().dofs(), &angles)?;
    let shape = &body.shape;
    let mut sizes = shape.coefficients.iter().chain(&shape.bone_scales);
    let is_finite = body.pose.is_finite() && sizes.all(|v| v.is_finite());
    check(is_finite, field, || "not finite".into())
}

/// Checks a header.
pub(super) fn check_header(header: &CaptureHeader, template: &Arc<Template>) -> Result<(), Fault> {
    let bodies = template.mesh().vertices().len();
    check(header.template == template.name(), "template", || {
        format!("{}, expected {}", header.template, template.name())
    })?;
    let frame = &header.frame;
    let is_frame = frame.metres_per_unit > 0.0
        && frame.metres_per_unit.is_finite()
        && frame.up.iter().all(|v| v.is_finite())
        && frame.up.iter().any(|v| *v != 0.0)
        && frame.floor.is_none_or(f64::is_finite);
    check(is_frame, "frame", || "no unit and up axis".into())?;
    let legs = header.clothed.legs;
    check(
        header.outfit.cloth.legs == legs,
        "outfit.cloth.legs",
        || format!("{:?}, clothed.legs is {legs:?}", header.outfit.cloth.legs),
    )?;
    let surface = ClothTemplate::new(template, legs);
    let surface = surface.map_err(|e| ("clothed.legs".to_owned(), e.to_string()))?;
    let count = surface.template().mesh().vertices().len();
    check_body(&header.clothed.body, template, "clothed.body")?;
    check_count(header.clothed.rest.len(), count, "clothed.rest")?;
    check_finite(&header.clothed.rest, "clothed.rest")?;

    let outfit = &header.outfit;
    check_body(&outfit.body, template, "outfit.body")?;
    let labelling = &outfit.labelling;
    let slots = labelling.slots.len();
    check_count(
        labelling.appearances.len(),
        slots,
        "outfit.labelling.appearances",
    )?;
    check_count(labelling.labels.len(), count, "outfit.labelling.labels")?;
    let beyond = labelling
        .labels
        .iter()
        .position(|l| usize::from(*l) >= slots);
    check(beyond.is_none(), "outfit.labelling.labels", || {
        format!("node {beyond:?}: its label has no slot")
    })?;
    let parts = outfit.cloth.parts.len();
    check_count(outfit.rest.len(), parts, "outfit.rest")?;
    check_count(outfit.colors.len(), parts, "outfit.colors")?;
    if !outfit.atlases.is_empty() {
        check_count(outfit.atlases.len(), parts, "outfit.atlases")?;
    }
    for (k, part) in outfit.cloth.parts.iter().enumerate() {
        check_part(
            part,
            (count, bodies),
            slots,
            &format!("outfit.cloth.parts[{k}]"),
        )?;
        check_count(
            outfit.rest[k].len(),
            part.nodes.len(),
            &format!("outfit.rest[{k}]"),
        )?;
        check_count(
            outfit.colors[k].len(),
            part.nodes.len(),
            &format!("outfit.colors[{k}]"),
        )?;
        check_finite(&outfit.rest[k], &format!("outfit.rest[{k}]"))?;
        if let Some(atlas) = outfit.atlases.get(k) {
            let at = |(field, why)| (format!("outfit.atlases[{k}].{field}"), why);
            let checked = atlas.check(part.nodes.len(), part.faces.len());
            checked.map_err(at)?;
        }
    }
    Ok(())
}

fn check_part(
    part: &ClothPart,
    (count, bodies): (usize, usize),
    slots: usize,
    field: &str,
) -> Result<(), Fault> {
    let own = part.nodes.len();
    let at = |name: &str| format!("{field}.{name}");
    check(usize::from(part.label) < slots, &at("label"), || {
        format!("{} of {slots} slots", part.label)
    })?;
    let ascends = part.nodes.windows(2).all(|w| w[0] < w[1]);
    check(ascends, &at("nodes"), || "not ascending".into())?;
    let last = part.nodes.last().map_or(0, |v| *v as usize);
    check(last < count, &at("nodes"), || {
        format!("vertex {last} of {count}")
    })?;
    check_count(part.below.len(), own, &at("below"))?;
    let beyond = part.below.iter().position(|v| *v as usize >= bodies);
    check(beyond.is_none(), &at("below"), || {
        format!("entry {beyond:?}: the body has {bodies} vertices")
    })?;
    check_count(part.hidden.len(), own, &at("hidden"))?;
    let is_face = |f: &[u32; 3]| {
        let distinct = f[0] != f[1] && f[1] != f[2] && f[0] != f[2];
        distinct && f.iter().all(|v| (*v as usize) < own)
    };
    let bad = part.faces.iter().position(|f| !is_face(f));
    check(bad.is_none(), &at("faces"), || {
        format!("face {bad:?} of {own} vertices")
    })?;
    let bad = part
        .rings
        .iter()
        .position(|r| r.vertices.iter().any(|v| *v as usize >= own));
    check(bad.is_none(), &at("rings"), || {
        format!("ring {bad:?} of {own} vertices")
    })
}
