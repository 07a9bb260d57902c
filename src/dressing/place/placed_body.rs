//! A pattern's shoulder seams on a body: they fix the height of every panel above the waist.

use crate::body_sections::BodySections;
use crate::settings::PlaceSettings;
use tryon_body::Template;
use tryon_body::parts::BodySegment;
use tryon_garment::{Panel, Pattern, Placement, Side};

/// Neck and tip end of a shoulder seam where a pattern has none, panel coordinates, metres (library T-shirt, M).
const DEFAULT_SEAM: [[f64; 2]; 2] = [[0.08, 0.0], [0.2, -0.04]];
/// Stations along the seam at which the shoulder's height is taken.
const STATIONS: usize = 12;

/// The body in the canonical pose and the pattern that is placed around it.
#[derive(Clone, Copy)]
pub(crate) struct PlacedBody<'a> {
    pub(crate) template: &'a Template,
    pub(crate) sections: &'a BodySections,
    pub(crate) pattern: &'a Pattern,
    pub(crate) settings: &'a PlaceSettings,
}

/// 1 on the left (+x), −1 on the right.
pub(super) fn sign(side: Side) -> f32 {
    if side == Side::Left { 1.0 } else { -1.0 }
}

/// Start and end corner of a named edge, panel coordinates, metres.
pub(super) fn ends(panel: &Panel, name: &str) -> Option<[[f64; 2]; 2]> {
    panel
        .edge(name)
        .map(|i| [panel.edges[i].from, panel.end(i)])
}

impl PlacedBody<'_> {
    /// Neck and tip end of the left shoulder seam, panel coordinates, metres, from the first panel that has one.
    pub(super) fn shoulder_seam(&self) -> [[f64; 2]; 2] {
        let seam = |p: &Panel| {
            let mut names = p.edges.iter();
            let i = names.position(|e| e.name.starts_with("shoulder"))?;
            let [a, b] = [p.end(i), p.edges[i].from].map(|q| [q[0].abs(), q[1]]);
            Some(if a[0] < b[0] { [a, b] } else { [b, a] })
        };
        self.pattern
            .panels
            .iter()
            .find_map(seam)
            .unwrap_or(DEFAULT_SEAM)
    }
    /// Height of y = 0 of the trunk's panels such that the shoulder seam clears the body, and the seam's z, metres.
    pub(super) fn shoulder_line(&self) -> (f32, f32) {
        let [neck, tip] = self.shoulder_seam();
        let (x0, x1) = (neck[0] as f32, tip[0] as f32);
        let mut highest = [(f32::MIN, 0.0f32); STATIONS];
        for (i, p) in self.sections.vertices.iter().enumerate() {
            let t = (p.x.abs() - x0) / (x1 - x0);
            if !(0.0..1.0).contains(&t) || self.is_head(i) {
                continue;
            }
            let station = &mut highest[(t * STATIONS as f32) as usize];
            if p.y > station.0 {
                *station = (p.y, p.z);
            }
        }
        let (mut top, mut z) = (f32::MIN, (0.0, 0.0));
        for (k, (y, pz)) in highest.iter().enumerate() {
            if *y == f32::MIN {
                continue;
            }
            let t = (k as f32 + 0.5) / STATIONS as f32;
            let panel_y = (neck[1] as f32) * (1.0 - t) + tip[1] as f32 * t;
            top = top.max(y + self.settings.seam_clearance - panel_y);
            z = (z.0 + pz, z.1 + 1.0);
        }
        if z.1 > 0.0 {
            (top, z.0 / z.1)
        } else {
            (self.settings.default_seam_height, 0.0)
        }
    }
    fn is_head(&self, vertex: usize) -> bool {
        let joint = self.template.weights().dominant(vertex);
        self.template.parts().segment(joint) == BodySegment::Head
    }
    /// Height of the waist of a bodice that a skirt is sewn to, metres.
    pub(super) fn sewn_waist(&self) -> Option<f32> {
        let mut panels = self.pattern.panels.iter();
        let bodice = panels.find(|p| p.placement == Placement::TrunkFront)?;
        let waist = bodice.edges.iter().map(|e| e.from[1]).reduce(f64::min)?;
        Some(self.shoulder_line().0 + waist as f32)
    }
}
