//! Panels to space: one chart a panel, averaged along seams.

use super::collar::stand_collars;
use super::hip_tube::HipTube;
use super::hood::HoodChart;
use super::leg::LegChart;
use super::placed_body::PlacedBody;
use super::skirt::SkirtChart;
use super::sleeve::SleeveChart;
use super::trunk::TrunkChart;
use tryon_garment::{GarmentMesh, Panel, Placement};
use tryon_geometry::math::{P3, V3};

/// Start positions of the simulation vertices, frame of the canonical body (root identity), metres.
pub(crate) fn place(body: &PlacedBody<'_>, mesh: &GarmentMesh) -> Vec<P3> {
    let charts: Vec<PanelChart<'_>> = body
        .pattern
        .panels
        .iter()
        .map(|p| PanelChart::new(body, p))
        .collect();
    let hips = HipTube::new(body, mesh);
    let at = |vertex: usize, panel: u16, q: [f64; 2]| {
        let on_tube = hips.as_ref().and_then(|h| h.point(panel, vertex));
        on_tube.or_else(|| charts[usize::from(panel)].point(q.map(|c| c as f32)))
    };
    let (mut positions, mut placed) = (
        vec![P3::origin(); mesh.vertices],
        vec![false; mesh.vertices],
    );
    for (v, corners) in mesh.corners.iter().enumerate() {
        let points = corners.iter().filter_map(|(panel, q)| at(v, *panel, *q));
        let (sum, n) = points.fold((V3::zeros(), 0.0), |(s, n), p| (s + p.coords, n + 1.0));
        if n > 0.0 {
            positions[v] = P3::from(sum / n);
            placed[v] = true;
        }
    }
    stand_collars(mesh, &placed, &mut positions);
    positions
}

/// Map from one flat panel to space.
enum PanelChart<'a> {
    Trunk(TrunkChart<'a>),
    Skirt(SkirtChart<'a>),
    Hood(HoodChart),
    Leg(LegChart<'a>),
    Sleeve(SleeveChart),
    /// Stands on its neighbours.
    Collar,
}

impl<'a> PanelChart<'a> {
    fn new(body: &PlacedBody<'a>, panel: &Panel) -> Self {
        match panel.placement {
            Placement::TrunkFront => Self::Trunk(TrunkChart::new(body, panel, true)),
            Placement::TrunkBack => Self::Trunk(TrunkChart::new(body, panel, false)),
            Placement::SkirtFront => Self::Skirt(SkirtChart::new(body, panel, true)),
            Placement::SkirtBack => Self::Skirt(SkirtChart::new(body, panel, false)),
            Placement::Hood(side) => Self::Hood(HoodChart::new(body, panel, side)),
            Placement::LegFront(side) => Self::Leg(LegChart::new(body, panel, side, true)),
            Placement::LegBack(side) => Self::Leg(LegChart::new(body, panel, side, false)),
            Placement::Sleeve(side) => Self::Sleeve(SleeveChart::new(body, panel, side)),
            Placement::Collar => Self::Collar,
        }
    }
    /// Panel coordinates (x, y) (m) to the frame of the canonical body (m); `None` for a panel that stands on others.
    fn point(&self, p: [f32; 2]) -> Option<P3> {
        Some(match self {
            Self::Trunk(c) => c.point(p),
            Self::Skirt(c) => c.point(p),
            Self::Hood(c) => c.point(p),
            Self::Leg(c) => c.point(p),
            Self::Sleeve(c) => c.point(p),
            Self::Collar => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body_sections::BodySections;
    use crate::settings::StageSettings;
    use tryon_body::{BodyShape, embedded};
    use tryon_garment::{Size, Triangulation, library};

    #[test]
    fn charts_of_panels_meet_at_their_seams() {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let settings = StageSettings::default();
        let sections = BodySections::new(&template, &rest, None, &settings.sections);
        for (name, most) in [
            ("skirt", 0.005),
            ("straight_skirt", 0.035),
            ("trousers", 0.05),
        ] {
            let pattern = library::pattern(name, Size::M).expect("pattern");
            let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
            let body = PlacedBody {
                template: &template,
                sections: &sections,
                pattern: &pattern,
                settings: &settings.place,
            };
            let panels = pattern.panels.iter();
            let charts: Vec<_> = panels.map(|p| PanelChart::new(&body, p)).collect();
            let gap = |c: &Vec<(u16, [f64; 2])>| {
                let at = |k: usize| {
                    let chart = &charts[usize::from(c[k].0)];
                    chart.point(c[k].1.map(|q| q as f32)).expect("a place")
                };
                (1..c.len())
                    .map(|k| (at(k) - at(0)).norm())
                    .fold(0.0, f32::max)
            };
            let widest = mesh.corners.iter().map(gap).fold(0.0, f32::max);
            assert!(widest < most, "{name}: {widest} m");
        }
    }
}
