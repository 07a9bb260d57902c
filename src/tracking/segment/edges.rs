//! Outline of the person: cells at which the body ends, and cells at which an occluder hides it.

use crate::settings::SegmentSettings;
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Outline of the person.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contour {
    /// Row-major cells, ascending, at which the surface ends: beside it lies known free space or a farther surface.
    pub true_edges: Vec<u32>,
    /// Cells that must not be matched: the surface continues behind an occluder, beyond the image or into missing
    /// readings. Shape `[cells]`.
    pub false_edges: Vec<bool>,
}

/// Finds both kinds of edges of the person's cells (paper, section 3.2: of edges by self-occlusion only the nearer
/// side is kept).
pub fn contour(
    cloud: &OrganisedCloud,
    cells: &[u32],
    settings: &SegmentSettings,
    out: &mut Contour,
) {
    let columns = cloud.size().0;
    out.true_edges.clear();
    out.false_edges.clear();
    out.false_edges.resize(cloud.depth.len(), false);
    for &cell in cells {
        let i = cell as usize;
        let z = cloud.depth[i];
        let (u, v) = ((i % columns) as i32, (i / columns) as i32);
        let (mut real, mut hidden) = (false, cloud.on_rim(i) || z <= 0.0);
        for (du, dv) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let Some(k) = cloud.cell(u + du, v + dv) else {
                continue;
            };
            match cloud.labels[k] {
                Label::Person if cloud.depth[k] > 0.0 => {
                    real |= cloud.depth[k] > z + settings.occluder;
                    hidden |= cloud.depth[k] < z - settings.occluder;
                }
                Label::Background => real = true,
                Label::Floor => {}
                Label::Other => {
                    real |= cloud.depth[k] > z + settings.occluder;
                    hidden |= cloud.depth[k] < z - settings.occluder;
                }
                // Missing readings at an outline are the shadow of the sensor: no evidence for either.
                Label::Person | Label::Unknown => {}
            }
        }
        if hidden {
            out.false_edges[i] = true;
        } else if real {
            out.true_edges.push(cell);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::fixture::room;
    use crate::segment::{PersonChoice, SegmentScratch, find_person, find_planes};

    #[test]
    fn edges_between_arm_and_chest_belong_to_the_arm() {
        let mut cloud = room(0.0, true);
        let settings = SegmentSettings::default();
        let scene = find_planes(&cloud, &settings.planes);
        let found = find_person(
            &mut cloud,
            &scene,
            PersonChoice::First,
            &settings,
            &mut SegmentScratch::default(),
        );
        let columns = cloud.size().0;
        // An "arm": four rows across the middle, 20 cm nearer.
        let middle = found.cells[found.cells.len() / 2] as usize / columns;
        for &c in &found.cells {
            if (middle..middle + 4).contains(&(c as usize / columns)) {
                cloud.depth[c as usize] -= 0.2;
            }
        }
        let mut edges = Contour::default();
        contour(&cloud, &found.cells, &settings, &mut edges);
        let row = |c: &u32| *c as usize / columns;
        let inner = |c: &&u32| found.cells.contains(&(**c + 1)) && found.cells.contains(&(**c - 1));
        let inside: Vec<&u32> = edges.true_edges.iter().filter(inner).collect();
        let on = |r: usize| inside.iter().filter(|c| row(c) == r).count();
        assert!(
            on(middle) > 10 && on(middle + 3) > 10,
            "the arm's own edges are true"
        );
        assert_eq!(
            on(middle - 1) + on(middle + 4),
            0,
            "the chest continues behind the arm"
        );
        assert!(
            found
                .cells
                .iter()
                .filter(|c| row(c) == middle - 1)
                .all(|c| edges.false_edges[*c as usize])
        );
    }
}
