//! Number and kinds of the garments of an outfit, found by the labels that each choice leads to.

use super::color_mixture::ColorMixture;
use super::labelling::{DISTINCT, LabelConfig, Labeller, Labelling};
use super::node_colors::NodeColors;
use super::prior::{BodyRegion, Slot};
use crate::CaptureError;
use crate::topology::{ClothTemplate, LegTopology};
use nalgebra::Vector3;
use tryon_geometry::math::order_statistics::medians;

/// Least difference between the dyes of shoes and skin, light left out: bare feet have up to 0.11, shoes from 0.37.
const LEAST_DYE: f64 = 0.2;
/// Least share of the feet that shoes cover: hems of trousers lie there, too.
const LEAST_FEET: f64 = 0.3;
/// Mean step at a hem from which one garment lies over the other, metres. A dress has 0.0009 along its deepest folds, tops over
/// bottoms have 0.0012 to 0.008.
const LEAST_OVERLAP: f64 = 0.0012;
/// Largest step that counts, metres.
const MOST_OVERLAP: f64 = 0.01;

/// Labels the nodes of a template.
///
/// # Errors
/// [`CaptureError::Solve`] for an energy that is not finite.
pub fn label_nodes(
    cloth: &ClothTemplate,
    nodes: &NodeColors,
    config: &LabelConfig,
) -> Result<Labelling, CaptureError> {
    let mut labeller = Labeller::new(cloth, nodes, config);
    if let Some(garments) = &config.slots {
        let mut slots = vec![Slot::Skin, Slot::Hair];
        slots.extend(garments.iter().filter(|s| s.is_garment()));
        return labeller.run(slots);
    }
    let all = labeller.run(vec![
        Slot::Skin,
        Slot::Hair,
        Slot::Top,
        Slot::Bottom,
        Slot::Shoes,
    ])?;
    let mut slots = labeller.worn(&all);
    labeller.leave_out_bottom(&all);
    if slots.contains(&Slot::Top) && labeller.find_second_top() {
        slots.push(Slot::Under);
    }
    let out = if slots == all.slots {
        all
    } else {
        labeller.run(slots)?
    };
    if labeller.is_alike(&out) {
        return labeller.draw_hem(out, cloth.legs());
    }
    Ok(out)
}

impl Labeller<'_> {
    /// End of a top over a bottom of its colour: high, low on the thighs, or none.
    fn draw_hem(&mut self, high: Labelling, legs: LegTopology) -> Result<Labelling, CaptureError> {
        self.is_top_long = true;
        let low = self.run(high.slots.clone())?;
        let [up, down] = [&high, &low].map(|found| self.overlap(found));
        // A long hem lies over what is below it.
        let is_low = down > up && down >= LEAST_OVERLAP;
        let best = if is_low { low } else { high };
        self.is_top_long = best.is_top_long;
        // Overalls are rarer than trousers and a top of one colour, skirts and tops of one colour rarer than dresses.
        if legs == LegTopology::Joined && up.max(down) < LEAST_OVERLAP {
            let slots = best.slots.iter().filter(|s| **s != Slot::Bottom);
            let whole = |s: &Slot| if *s == Slot::Top { Slot::OnePiece } else { *s };
            return self.run(slots.map(whole).collect());
        }
        Ok(best)
    }

    /// Keeps what was found to be trousers or a skirt from being taken for a second garment of the torso.
    fn leave_out_bottom(&mut self, found: &Labelling) {
        let is_bottom = |l: &u8| found.slots[usize::from(*l)] == Slot::Bottom;
        self.bottom = found.labels.iter().map(is_bottom).collect();
    }

    /// Slots of a labelling that are worn: those whose nodes do not look like skin.
    fn worn(&self, all: &Labelling) -> Vec<Slot> {
        let skin = self.skin_appearance();
        let is_worn = |l: usize| {
            let own: Vec<usize> = (0..self.count())
                .filter(|v| usize::from(all.labels[*v]) == l)
                .filter(|v| !self.nodes.points.row(*v).is_empty())
                .collect();
            let (Some(skin), Some(look)) = (&skin, &all.appearances[l]) else {
                return !own.is_empty();
            };
            if all.slots[l] == Slot::Shoes && !self.are_shoes(&own) {
                return false;
            }
            self.excess(own.into_iter(), (look, skin)) > DISTINCT
        };
        (0..all.slots.len())
            .filter(|l| !all.slots[*l].is_garment() || is_worn(*l))
            .map(|l| all.slots[l])
            .collect()
    }

    /// Nodes cover the feet, and are dyed. Costs of colours do not tell: feet lie in another light than faces and hands.
    fn are_shoes(&self, own: &[usize]) -> bool {
        let seen = |v: &usize| self.nodes.means[*v].is_some();
        let feet = (0..self.count()).filter(|v| self.regions[*v] == BodyRegion::Foot);
        let feet = feet.filter(seen).count();
        let covered = own.iter().filter(|v| self.regions[**v] == BodyRegion::Foot);
        let dyes = self.dye(own).zip(self.dye(&self.bare_nodes()));
        covered.count() as f64 >= LEAST_FEET * feet as f64
            && dyes.is_none_or(|(shoes, skin)| (shoes - skin).norm() > LEAST_DYE)
    }

    /// Median colour of nodes without light.
    fn dye(&self, nodes: &[usize]) -> Option<Vector3<f64>> {
        let colors: Vec<_> = nodes
            .iter()
            .filter_map(|v| self.without_light(*v))
            .collect();
        medians(&colors).map(Vector3::from)
    }

    /// Top and bottom of a labelling look alike.
    fn is_alike(&self, found: &Labelling) -> bool {
        let Some([top, bottom]) = ends(found) else {
            return false;
        };
        let start = self.first_labels(&found.slots);
        let own = |l: usize| {
            let all = (0..self.count()).filter(|v| usize::from(start[*v]) == l);
            self.without_skin(all.collect())
        };
        let [upper, lower]: [Vec<usize>; 2] = [top, bottom].map(own);
        let look = |nodes: &[usize]| ColorMixture::fit(&self.nodes.of(nodes.iter().copied()));
        let (Some(a), Some(b)) = (look(&upper), look(&lower)) else {
            return true;
        };
        let excess =
            self.excess(upper.into_iter(), (&a, &b)) + self.excess(lower.into_iter(), (&b, &a));
        excess < 2.0 * DISTINCT
    }

    /// Mean step down from top to bottom where they meet, metres.
    fn overlap(&self, found: &Labelling) -> f64 {
        let Some(ends) = ends(found) else {
            return 0.0;
        };
        let steps = self.edges.iter().filter_map(|e| {
            let labels = e.map(|v| usize::from(found.labels[v as usize]));
            let [p, q] = e.map(|v| self.nodes.steps[v as usize]);
            let step = match labels {
                l if l == ends => p - q,
                [b, a] if [a, b] == ends => q - p,
                _ => return None,
            };
            Some(f64::from(step).clamp(-MOST_OVERLAP, MOST_OVERLAP))
        });
        let (sum, n) = steps.fold((0.0, 0), |(s, n), x| (s + x, n + 1));
        sum / f64::from(n.max(1))
    }
}

/// Labels of top and bottom.
fn ends(found: &Labelling) -> Option<[usize; 2]> {
    let at = |slot: Slot| found.slots.iter().position(|s| *s == slot);
    Some([at(Slot::Top)?, at(Slot::Bottom)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_geometry::math::P3;

    /// Labels of a top and bottom of one colour, the top `thick` metres over the bottom, and nodes of the top below the pelvis.
    fn label(thick: f32) -> (Labelling, usize) {
        let cloth = ClothTemplate::new(&embedded::template(), LegTopology::Apart).expect("small");
        let regions = BodyRegion::of_vertices(cloth.template());
        let vertices = cloth.template().mesh().vertices();
        let thighs = vertices.iter().zip(&regions);
        let thighs = thighs.filter(|(_, r)| **r == BodyRegion::Thigh);
        let hem = thighs.map(|(p, _)| p.y).fold(f32::MIN, f32::max) - 0.08;
        let color = |_: &P3, r: BodyRegion| match r {
            BodyRegion::Head | BodyRegion::Neck | BodyRegion::Hand => [205.0, 150.0, 120.0],
            _ => [44.0, 52.0, 86.0],
        };
        let height = |p: &P3| if p.y > hem { thick } else { 0.0 };
        let nodes = NodeColors::painted(cloth.template(), color, height);
        let found = label_nodes(&cloth, &nodes, &LabelConfig::default()).expect("finite");
        let [top, _] = ends(&found).expect("top and bottom");
        let low = regions
            .iter()
            .zip(&found.labels)
            .filter(|(r, l)| **r == BodyRegion::Thigh && usize::from(**l) == top);
        let low = low.count();
        (found, low)
    }

    #[test]
    fn a_long_top_ends_at_its_step_and_one_without_a_step_high() {
        let (long, below) = label(0.012);
        assert!(long.is_top_long && below > 50, "{below} nodes");
        let (high, below) = label(0.0);
        assert!(!high.is_top_long && below < 10, "{below} nodes");
    }

    #[test]
    fn a_bare_belly_and_bare_thighs_are_skin() {
        let cloth = ClothTemplate::new(&embedded::template(), LegTopology::Apart).expect("small");
        let regions = BodyRegion::of_vertices(cloth.template());
        let is_bare = |p: &P3, r: BodyRegion| match r {
            BodyRegion::Chest => p.y < 1.25,
            BodyRegion::Abdomen => true,
            BodyRegion::Pelvis => p.y > 1.0,
            BodyRegion::Thigh => p.y < 0.75,
            _ => true,
        };
        let color = |p: &P3, r: BodyRegion| match is_bare(p, r) {
            true => [205.0, 150.0, 120.0],
            false if p.y > 1.1 => [40.0, 110.0, 60.0],
            false => [44.0, 52.0, 86.0],
        };
        let nodes = NodeColors::painted(cloth.template(), color, |_| 0.0);
        let found = label_nodes(&cloth, &nodes, &LabelConfig::default()).expect("finite");
        let vertices = cloth.template().mesh().vertices();
        let wrong = vertices.iter().zip(&regions).zip(&found.labels);
        let wrong = wrong
            .filter(|((p, r), l)| is_bare(p, **r) == found.slots[usize::from(**l)].is_garment());
        let wrong = wrong.count();
        assert!(wrong * 100 < regions.len(), "{wrong} nodes");
    }

    #[test]
    fn a_dress_over_bare_thighs_is_one_piece() {
        let cloth = ClothTemplate::new(&embedded::template(), LegTopology::Joined).expect("small");
        let is_dress = |p: &P3, r: BodyRegion| {
            use BodyRegion::*;
            matches!(r, Chest | Abdomen | Pelvis) || r == Thigh && p.y > 0.65
        };
        let color = |p: &P3, r: BodyRegion| match is_dress(p, r) {
            true => [120.0, 66.0, 92.0],
            false => [96.0, 62.0, 44.0],
        };
        let nodes = NodeColors::painted(cloth.template(), color, |_| 0.0);
        let found = label_nodes(&cloth, &nodes, &LabelConfig::default()).expect("finite");
        let expected = [Slot::Skin, Slot::Hair, Slot::OnePiece];
        assert_eq!(found.slots, expected);
    }

    #[test]
    fn feet_in_another_light_are_bare_and_leather_is_worn() {
        let finds_shoes = |feet: [f32; 3]| {
            let cloth =
                ClothTemplate::new(&embedded::template(), LegTopology::Apart).expect("small");
            let color = |_: &P3, r: BodyRegion| match r {
                BodyRegion::Foot => feet,
                BodyRegion::Thigh | BodyRegion::Shin | BodyRegion::Pelvis => [44.0, 52.0, 86.0],
                BodyRegion::Chest | BodyRegion::Abdomen => [40.0, 110.0, 60.0],
                _ => [205.0, 150.0, 120.0],
            };
            let nodes = NodeColors::painted(cloth.template(), color, |_| 0.0);
            let found = label_nodes(&cloth, &nodes, &LabelConfig::default()).expect("finite");
            found.slots.contains(&Slot::Shoes)
        };
        assert!(!finds_shoes([205.0, 150.0, 120.0]));
        assert!(!finds_shoes([160.0, 117.0, 94.0]), "shaded");
        assert!(finds_shoes([92.0, 52.0, 30.0]), "brown leather");
    }
}
