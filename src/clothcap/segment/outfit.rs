//! Number and kinds of the garments of an outfit, found by the labels that each choice leads to.

use super::color_mixture::ColorMixture;
use super::labelling::{DISTINCT, LabelConfig, Labeller, Labelling, SKIN_MODES, STEP};
use super::node_colors::NodeColors;
use super::prior::{BodyRegion, Slot};
use crate::clothcap::CaptureError;
use crate::clothcap::topology::{ClothTemplate, LegTopology};
use nalgebra::Vector3;

/// The same for feet beside shins: they lie in another light. Bare ones have up to 3.1, shoes of `scans/liam` 7.6.
const DISTINCT_SHOES: f64 = 5.0;
/// Least share of torso and arms that is a garment of its own.
const LEAST_SHARE: f64 = 0.06;
/// Difference of mean colours, in standard deviations, from which two clusters are two garments.
const SEPARATION: f64 = 2.0;
/// Mean step at a hem from which one garment lies over the other, metres. A dress has 0.00004, tops over bottoms have 0.0004
/// to 0.0015.
const LEAST_OVERLAP: f64 = 0.0003;

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
    if slots.contains(&Slot::Top) && labeller.has_second_top() {
        slots.push(Slot::Under);
    }
    let out = if slots == all.slots {
        all
    } else {
        labeller.run(slots)?
    };
    // Overalls are rarer than trousers and a top of one colour, skirts and tops of one colour rarer than dresses.
    if cloth.legs() == LegTopology::Joined && labeller.is_one_piece(&out) {
        let slots = out.slots.iter().filter(|s| **s != Slot::Bottom);
        let whole = |s: &Slot| if *s == Slot::Top { Slot::OnePiece } else { *s };
        return labeller.run(slots.map(whole).collect());
    }
    Ok(out)
}

impl Labeller<'_> {
    /// Keeps what was found to be trousers or a skirt from being taken for a second garment of the torso.
    fn leave_out_bottom(&mut self, found: &Labelling) {
        let is_bottom = |l: &u8| found.slots[usize::from(*l)] == Slot::Bottom;
        self.bottom = found.labels.iter().map(is_bottom).collect();
    }

    /// Slots of a labelling that are worn: those whose nodes do not look like skin.
    fn worn(&self, all: &Labelling) -> Vec<Slot> {
        let skin = self.skin_appearance();
        // Feet lie in another light than faces; bare shins tell how skin looks there.
        let is_shin = |v: &usize| all.labels[*v] == 0 && self.regions[*v] == BodyRegion::Shin;
        let shins = self.nodes.of((0..self.count()).filter(is_shin));
        let shins = ColorMixture::fit_modes(&shins, SKIN_MODES);
        let is_worn = |l: usize| {
            let skin = match all.slots[l] {
                Slot::Shoes => shins.as_ref().or(skin.as_ref()),
                _ => skin.as_ref(),
            };
            let own: Vec<usize> = (0..self.count())
                .filter(|v| usize::from(all.labels[*v]) == l)
                .filter(|v| !self.nodes.points.row(*v).is_empty())
                .collect();
            let (Some(skin), Some(look)) = (skin, &all.appearances[l]) else {
                return !own.is_empty();
            };
            let excess = own
                .iter()
                .map(|v| self.nodes.cost(*v, skin) - self.nodes.cost(*v, look));
            let least = if all.slots[l] == Slot::Shoes {
                DISTINCT_SHOES
            } else {
                DISTINCT
            };
            excess.sum::<f64>() > least * own.len().max(1) as f64
        };
        (0..all.slots.len())
            .filter(|l| !all.slots[*l].is_garment() || is_worn(*l))
            .map(|l| all.slots[l])
            .collect()
    }

    /// Torso and arms have two colours, far apart, each in one place and not enclosed by the other like a print.
    fn has_second_top(&self) -> bool {
        let (some, owner) = self.torso_clusters();
        let colors = |k: usize| -> Vec<Vector3<f64>> {
            let own = some.iter().zip(&owner).filter(|(_, o)| **o == k);
            own.filter_map(|(v, _)| self.nodes.means[*v]).collect()
        };
        let (a, b) = (colors(0), colors(1));
        let least = LEAST_SHARE * some.len() as f64;
        if (a.len() as f64) < least || (b.len() as f64) < least {
            return false;
        }
        separation(&a, &b) > SEPARATION && self.is_coherent(&some, &owner)
    }

    /// Torso and legs look alike, and where top and bottom meet nothing lies over the other all around.
    fn is_one_piece(&self, found: &Labelling) -> bool {
        let at = |slot: Slot| found.slots.iter().position(|s| *s == slot);
        let (Some(top), Some(bottom)) = (at(Slot::Top), at(Slot::Bottom)) else {
            return false;
        };
        let start = self.first_labels(&found.slots);
        let own = |l: usize| {
            (0..self.count())
                .filter(|v| usize::from(start[*v]) == l)
                .collect()
        };
        let [upper, lower]: [Vec<usize>; 2] = [top, bottom].map(own);
        let look = |nodes: &[usize]| ColorMixture::fit(&self.nodes.of(nodes.iter().copied()));
        let (Some(a), Some(b)) = (look(&upper), look(&lower)) else {
            return true;
        };
        let excess =
            self.excess(upper.into_iter(), (&a, &b)) + self.excess(lower.into_iter(), (&b, &a));
        excess < 2.0 * DISTINCT && self.overlap(&found.labels, [top, bottom]).abs() < LEAST_OVERLAP
    }

    /// Mean step from one label down to another where they meet, metres.
    fn overlap(&self, labels: &[u8], [upper, lower]: [usize; 2]) -> f64 {
        let steps = self.edges.iter().filter_map(|e| {
            let [a, b] = e.map(|v| usize::from(labels[v as usize]));
            let [p, q] = e.map(|v| self.nodes.steps[v as usize]);
            let step = if [a, b] == [upper, lower] {
                p - q
            } else if [a, b] == [lower, upper] {
                q - p
            } else {
                return None;
            };
            Some(f64::from(step.clamp(-STEP, STEP)))
        });
        let (sum, n) = steps.fold((0.0, 0), |(s, n), x| (s + x, n + 1));
        sum / f64::from(n.max(1))
    }

    /// Neighbours mostly share their cluster; stripes and checks do not.
    fn is_coherent(&self, some: &[usize], owner: &[usize]) -> bool {
        /// Largest share of edges between clusters.
        const MOST_MIXED: f64 = 0.12;
        let mut of = vec![usize::MAX; self.count()];
        some.iter().zip(owner).for_each(|(v, o)| of[*v] = *o);
        let inner = self.edges.iter().map(|e| e.map(|v| of[v as usize]));
        let inner: Vec<_> = inner.filter(|[a, b]| *a < 2 && *b < 2).collect();
        let mixed = inner.iter().filter(|[a, b]| a != b).count();
        (mixed as f64) < MOST_MIXED * inner.len() as f64
    }
}

/// Distance of the means of two sets of colours, in standard deviations along it. Halves of one Gaussian have 1.3, of an
/// even distribution 1.7.
fn separation(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let mean = |all: &[Vector3<f64>]| all.iter().sum::<Vector3<f64>>() / all.len().max(1) as f64;
    let (ma, mb) = (mean(a), mean(b));
    let Some(axis) = (ma - mb).try_normalize(f64::MIN_POSITIVE) else {
        return 0.0;
    };
    let deviation = |all: &[Vector3<f64>], m: &Vector3<f64>| {
        let squares = all.iter().map(|c| (c - m).dot(&axis).powi(2));
        (squares.sum::<f64>() / all.len().max(1) as f64).sqrt()
    };
    (ma - mb).norm() / (deviation(a, &ma) + deviation(b, &mb)).max(f64::MIN_POSITIVE)
}
