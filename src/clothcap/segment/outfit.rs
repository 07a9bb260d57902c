//! Number and kinds of the garments of an outfit, found by the labels that each choice leads to.

use super::labelling::{LabelConfig, Labeller, Labelling};
use super::node_colors::NodeColors;
use super::prior::{BodyRegion, Slot};
use crate::CaptureError;
use crate::topology::{ClothTemplate, LegTopology};
use nalgebra::Vector3;
use tryon_geometry::math::order_statistics::medians;

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
    use Slot::{Bottom, Hair, Shoes, Skin, Top};
    let all = labeller.run(vec![Skin, Hair, Top, Bottom, Shoes])?;
    let mut slots = labeller.worn(&all);
    labeller.leave_out_bottom(&all);
    if slots.contains(&Slot::Top) && labeller.find_second_top() {
        slots.push(Slot::Under);
    }
    let is_same = slots == all.slots;
    let out = if is_same { all } else { labeller.run(slots)? };
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
        let least = self.config.settings.outfit.overlap;
        let is_low = down > up && down >= least;
        let best = if is_low { low } else { high };
        self.is_top_long = best.is_top_long;
        // Overalls are rarer than trousers and a top of one colour, skirts and tops of one colour rarer than dresses.
        if legs == LegTopology::Joined && up.max(down) < least {
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
            let own = (0..self.count()).filter(|v| usize::from(all.labels[*v]) == l);
            let own = own.filter(|v| !self.nodes.points.row(*v).is_empty());
            let own: Vec<usize> = own.collect();
            let (Some(skin), Some(look)) = (&skin, &all.appearances[l]) else {
                return !own.is_empty();
            };
            if all.slots[l] == Slot::Shoes && !self.are_shoes(&own) {
                return false;
            }
            self.excess(own.into_iter(), look, skin) > self.config.settings.distinct
        };
        let worn = (0..all.slots.len()).filter(|l| !all.slots[*l].is_garment() || is_worn(*l));
        worn.map(|l| all.slots[l]).collect()
    }

    /// Nodes cover the feet, and are dyed. Costs of colours do not tell: feet lie in another light than faces and hands.
    fn are_shoes(&self, own: &[usize]) -> bool {
        let settings = &self.config.settings.outfit;
        let seen = |v: &usize| self.nodes.means[*v].is_some();
        let feet = (0..self.count()).filter(|v| self.regions[*v] == BodyRegion::Foot);
        let feet = feet.filter(seen).count();
        let covered = own.iter().filter(|v| self.regions[**v] == BodyRegion::Foot);
        let dyes = self.dye(own).zip(self.dye(&self.bare_nodes()));
        covered.count() as f64 >= settings.feet * feet as f64
            && dyes.is_none_or(|(shoes, skin)| (shoes - skin).norm() > settings.dye)
    }

    fn dye(&self, nodes: &[usize]) -> Option<Vector3<f64>> {
        medians(&self.colors(nodes)).map(Vector3::from)
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
        let look = |nodes: &[usize]| self.nodes.appearance(nodes.iter().copied());
        let (Some(a), Some(b)) = (look(&upper), look(&lower)) else {
            return true;
        };
        let upper = self.excess(upper.into_iter(), &a, &b);
        let lower = self.excess(lower.into_iter(), &b, &a);
        upper + lower < 2.0 * self.config.settings.distinct
    }

    /// Mean step down from top to bottom where they meet, metres.
    fn overlap(&self, found: &Labelling) -> f64 {
        let Some(ends) = ends(found) else {
            return 0.0;
        };
        let most = self.config.settings.outfit.most_overlap;
        let steps = self.edges.iter().filter_map(|e| {
            let labels = e.map(|v| usize::from(found.labels[v as usize]));
            let [p, q] = e.map(|v| self.nodes.steps[v as usize]);
            let step = match labels {
                l if l == ends => p - q,
                [b, a] if [a, b] == ends => q - p,
                _ => return None,
            };
            Some(f64::from(step).clamp(-most, most))
        });
        let (sum, n) = steps.fold((0.0, 0), |(s, n), x| (s + x, n + 1));
        sum / f64::from(n.max(1))
    }
}

fn ends(found: &Labelling) -> Option<[usize; 2]> {
    let at = |slot: Slot| found.slots.iter().position(|s| *s == slot);
    Some([at(Slot::Top)?, at(Slot::Bottom)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_geometry::math::P3;

    /// Labels of a template of a topology with one point a node, painted by place and region, at heights over the body (m).
    fn found(
        legs: LegTopology,
        color: impl Fn(&P3, BodyRegion) -> [f32; 3],
        height: impl Fn(&P3) -> f32,
    ) -> Labelling {
        let cloth = ClothTemplate::new(&embedded::template(), legs).expect("small");
        let nodes = NodeColors::painted(cloth.template(), color, height);
        label_nodes(&cloth, &nodes, &LabelConfig::default()).expect("finite")
    }

    /// Labels of a top and bottom of one colour, the top `thick` metres over the bottom, and nodes of the top below the pelvis.
    fn label(thick: f32) -> (Labelling, usize) {
        let template = embedded::template();
        let regions = BodyRegion::of_vertices(&template);
        let vertices = template.mesh().vertices();
        let thighs = vertices.iter().zip(&regions);
        let thighs = thighs.filter(|(_, r)| **r == BodyRegion::Thigh);
        let hem = thighs.map(|(p, _)| p.y).fold(f32::MIN, f32::max) - 0.08;
        let color = |_: &P3, r: BodyRegion| match r {
            BodyRegion::Head | BodyRegion::Neck | BodyRegion::Hand => [205.0, 150.0, 120.0],
            _ => [44.0, 52.0, 86.0],
        };
        let height = |p: &P3| if p.y > hem { thick } else { 0.0 };
        let found = found(LegTopology::Apart, color, height);
        let [top, _] = ends(&found).expect("top and bottom");
        let low = regions.iter().zip(&found.labels);
        let low = low.filter(|(r, l)| **r == BodyRegion::Thigh && usize::from(**l) == top);
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
        let template = embedded::template();
        let regions = BodyRegion::of_vertices(&template);
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
        let found = found(LegTopology::Apart, color, |_| 0.0);
        let is_garment = |l: &u8| found.slots[usize::from(*l)].is_garment();
        let is_wrong = |((p, r), l): &((&P3, &BodyRegion), &u8)| is_bare(p, **r) == is_garment(l);
        let all = template.mesh().vertices().iter().zip(&regions);
        let wrong = all.zip(&found.labels).filter(is_wrong).count();
        assert!(wrong * 100 < regions.len(), "{wrong} nodes");
    }

    #[test]
    fn a_dress_over_bare_thighs_is_one_piece() {
        let is_dress = |p: &P3, r: BodyRegion| {
            use BodyRegion::*;
            matches!(r, Chest | Abdomen | Pelvis) || r == Thigh && p.y > 0.65
        };
        let color = |p: &P3, r: BodyRegion| match is_dress(p, r) {
            true => [120.0, 66.0, 92.0],
            false => [96.0, 62.0, 44.0],
        };
        let found = found(LegTopology::Joined, color, |_| 0.0);
        assert_eq!(found.slots, [Slot::Skin, Slot::Hair, Slot::OnePiece]);
    }

    #[test]
    fn feet_in_another_light_are_bare_and_leather_is_worn() {
        let finds_shoes = |feet: [f32; 3]| {
            let color = |_: &P3, r: BodyRegion| match r {
                BodyRegion::Foot => feet,
                BodyRegion::Thigh | BodyRegion::Shin | BodyRegion::Pelvis => [44.0, 52.0, 86.0],
                BodyRegion::Chest | BodyRegion::Abdomen => [40.0, 110.0, 60.0],
                _ => [205.0, 150.0, 120.0],
            };
            let found = found(LegTopology::Apart, color, |_| 0.0);
            found.slots.contains(&Slot::Shoes)
        };
        assert!(!finds_shoes([205.0, 150.0, 120.0]));
        assert!(!finds_shoes([160.0, 117.0, 94.0]), "shaded");
        assert!(finds_shoes([92.0, 52.0, 30.0]), "brown leather");
    }
}
