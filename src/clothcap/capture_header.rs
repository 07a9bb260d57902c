//! Header of a capture, checked against the body template: a file from outside names the field at fault before anything
//! indexes by it.

use super::align::{AlignedBody, ClothedTemplate};
use super::captured_outfit::CapturedOutfit;
use super::multi::{ClothPart, Ring};
use super::scan::ScanFrame;
use super::topology::ClothTemplate;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

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
    check_all(points, field, "is not finite", |p| {
        p.iter().all(|c| c.is_finite())
    })
}

/// Checks each entry; `fault` is that of one that isn't sound.
fn check_all<T>(
    all: &[T],
    field: &str,
    fault: &str,
    is_sound: impl Fn(&T) -> bool,
) -> Result<(), Fault> {
    match all.iter().position(|v| !is_sound(v)) {
        Some(entry) => Err((field.to_owned(), format!("entry {entry} {fault}"))),
        None => Ok(()),
    }
}

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

pub(super) fn check_header(header: &CaptureHeader, template: &Arc<Template>) -> Result<(), Fault> {
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
    let own = header.outfit.cloth.legs;
    check(own == legs, "outfit.cloth.legs", || {
        format!("{own:?}, clothed.legs is {legs:?}")
    })?;
    let surface = ClothTemplate::new(template, legs);
    let surface = surface.map_err(|e| ("clothed.legs".to_owned(), e.to_string()))?;
    let count = surface.template().mesh().vertices().len();
    check_body(&header.clothed.body, template, "clothed.body")?;
    check_count(header.clothed.rest.len(), count, "clothed.rest")?;
    check_finite(&header.clothed.rest, "clothed.rest")?;

    let outfit = &header.outfit;
    check_body(&outfit.body, template, "outfit.body")?;
    let labelling = &outfit.labelling;
    let (slots, appearances) = (labelling.slots.len(), labelling.appearances.len());
    check_count(appearances, slots, "outfit.labelling.appearances")?;
    let labels = "outfit.labelling.labels";
    check_count(labelling.labels.len(), count, labels)?;
    let is_slot = |l: &u8| usize::from(*l) < slots;
    check_all(&labelling.labels, labels, "has no slot", is_slot)?;
    let parts = outfit.cloth.parts.len();
    check_count(outfit.rest.len(), parts, "outfit.rest")?;
    check_count(outfit.colors.len(), parts, "outfit.colors")?;
    if !outfit.atlases.is_empty() {
        check_count(outfit.atlases.len(), parts, "outfit.atlases")?;
    }
    let sizes = HeaderSizes {
        nodes: count,
        bodies: template.mesh().vertices().len(),
        slots,
    };
    for (k, part) in outfit.cloth.parts.iter().enumerate() {
        sizes.check(part, &format!("outfit.cloth.parts[{k}]"))?;
        let (rest, colors) = (format!("outfit.rest[{k}]"), format!("outfit.colors[{k}]"));
        check_count(outfit.rest[k].len(), part.nodes.len(), &rest)?;
        check_count(outfit.colors[k].len(), part.nodes.len(), &colors)?;
        check_finite(&outfit.rest[k], &rest)?;
        if let Some(atlas) = outfit.atlases.get(k) {
            let at = |(field, why)| (format!("outfit.atlases[{k}].{field}"), why);
            let checked = atlas.check(part.nodes.len(), part.faces.len());
            checked.map_err(at)?;
        }
    }
    Ok(())
}

const BEYOND: &str = "is beyond the last vertex";

/// Counts that the indices of a part stay below.
struct HeaderSizes {
    nodes: usize,
    bodies: usize,
    slots: usize,
}

impl HeaderSizes {
    fn check(&self, part: &ClothPart, field: &str) -> Result<(), Fault> {
        let own = part.nodes.len();
        let at = |name: &str| format!("{field}.{name}");
        let is_slot = usize::from(part.label) < self.slots;
        check(is_slot, &at("label"), || {
            format!("{} of {} slots", part.label, self.slots)
        })?;
        let ascends = part.nodes.windows(2).all(|w| w[0] < w[1]);
        check(ascends, &at("nodes"), || "not ascending".into())?;
        let last = part.nodes.last().map_or(0, |v| *v as usize);
        check(last < self.nodes, &at("nodes"), || {
            format!("vertex {last} of {}", self.nodes)
        })?;
        check_count(part.below.len(), own, &at("below"))?;
        check_all(&part.below, &at("below"), BEYOND, |v| {
            (*v as usize) < self.bodies
        })?;
        check_count(part.hidden.len(), own, &at("hidden"))?;
        let is_face = |f: &Face| {
            let distinct = f[0] != f[1] && f[1] != f[2] && f[0] != f[2];
            distinct && f.iter().all(|v| (*v as usize) < own)
        };
        check_all(
            &part.faces,
            &at("faces"),
            "is no triangle of its vertices",
            is_face,
        )?;
        let is_ring = |r: &Ring| r.vertices.iter().all(|v| (*v as usize) < own);
        check_all(&part.rings, &at("rings"), BEYOND, is_ring)
    }
}
