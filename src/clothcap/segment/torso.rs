//! Garments of the torso: the two colours of torso and arms that are least like shades or prints of each other.

use super::color_mixture::k_means;
use super::labelling::Labeller;
use nalgebra::Vector3;

/// Two sets of nodes, and the ways in which they look like two garments.
#[derive(Debug)]
struct TorsoPair {
    nodes: [Vec<usize>; 2],
    /// Step of colour where they meet, in standard deviations of their colours.
    step: f64,
}

impl Labeller<'_> {
    /// Looks for two garments on torso and arms, and keeps which node is whose.
    pub(super) fn find_second_top(&mut self) -> bool {
        let settings = &self.config.settings;
        let (some, inner) = self.torso_nodes();
        let colors = self.colors(&inner);
        let owner = k_means(&colors, settings.torso.clusters, &settings.colors);
        let count = owner.iter().max().map_or(0, |k| k + 1);
        // The last cluster stays on one side: the other half of the ways says the same.
        let ways = 1..1usize << count.saturating_sub(1);
        let pairs = ways.filter_map(|way| {
            let side = |wanted: usize| {
                let own = inner.iter().zip(&owner);
                let own = own.filter(|(_, k)| way >> **k & 1 == wanted);
                own.map(|(v, _)| *v).collect()
            };
            self.torso_pair([side(0), side(1)])
        });
        let best = pairs.max_by(|a, b| a.step.total_cmp(&b.step));
        let Some(TorsoPair { nodes: [a, b], .. }) = best else {
            return false;
        };
        let on_torso = |all: &[usize]| all.iter().filter(|v| self.regions[**v].is_torso()).count();
        let is_first = on_torso(&a) >= on_torso(&b);
        let (first, second) = if is_first { (a, b) } else { (b, a) };
        let [first, second] = [first, second].map(|all| mean(&self.colors(&all)));
        for v in some {
            let is_second = |c: Vector3<f64>| (c - second).norm() < (c - first).norm();
            self.second_top[v] = self.without_light(v).map(is_second);
        }
        true
    }

    /// Two sets of nodes as garments; `None` if they are shades, prints or skin.
    fn torso_pair(&self, nodes: [Vec<usize>; 2]) -> Option<TorsoPair> {
        let settings = &self.config.settings.torso;
        let [a, b] = nodes.each_ref().map(Vec::len);
        if (a.min(b) as f64) < settings.least_share * (a + b) as f64 {
            return None;
        }
        let mut side = vec![None; self.count()];
        for (k, all) in nodes.iter().enumerate() {
            all.iter().for_each(|v| side[*v] = Some(k));
        }
        let colors = nodes.each_ref().map(|all| self.colors(all));
        let (axis, spread) = separation(&colors)?;
        let meets = self.meetings(&side, &axis);
        let mixed = meets.between as f64 / meets.within.into_iter().min()?.max(1) as f64;
        let step = meets.step / meets.between.max(1) as f64 / spread;
        let free = |k: usize| {
            let all = meets.free[k] + meets.between;
            meets.free[k] as f64 >= settings.least_free * all as f64
        };
        let is_alone = mixed < settings.most_mixed && step >= settings.least_step;
        let is_pair = is_alone && free(0) && free(1);
        let is_worn = || nodes.iter().all(|all| self.is_unlike_skin(all));
        (is_pair && is_worn()).then_some(TorsoPair { nodes, step })
    }

    /// Edges within and between two sides, and from each to anything else.
    fn meetings(&self, side: &[Option<usize>], axis: &Vector3<f64>) -> Meetings {
        let mut out = Meetings::default();
        for [p, q] in self.edges.iter().map(|e| e.map(|v| v as usize)) {
            match (side[p], side[q]) {
                (Some(a), Some(b)) if a == b => out.within[a] += 1,
                (Some(_), Some(_)) => {
                    let colors = self.without_light(p).zip(self.without_light(q));
                    out.step += colors.map_or(0.0, |(a, b)| (a - b).dot(axis).abs());
                    out.between += 1;
                }
                (Some(k), None) if self.nodes.means[q].is_some() => out.free[k] += 1,
                (None, Some(k)) if self.nodes.means[p].is_some() => out.free[k] += 1,
                _ => (),
            }
        }
        out
    }

    fn is_unlike_skin(&self, nodes: &[usize]) -> bool {
        let own = self.nodes.appearance(nodes.iter().copied());
        let (Some(own), Some(skin)) = (own, self.skin_appearance()) else {
            return true;
        };
        self.excess(nodes.iter().copied(), &own, &skin) > self.config.settings.unlike_skin
    }

    /// Seen nodes of torso and arms that are neither skin nor the garment of the legs, and those of them that do not border on
    /// these: their colours are mixed.
    fn torso_nodes(&self) -> (Vec<usize>, Vec<usize>) {
        let skin = self.skin_appearance();
        let is_skin = |v: usize| {
            let is_like = |s| self.nodes.cost(v, s) < 0.0;
            self.regions[v].is_arm() && skin.as_ref().is_some_and(is_like)
        };
        let other = (0..self.count()).map(|v| self.bottom[v] || is_skin(v));
        let other: Vec<bool> = other.collect();
        let mut near = other.clone();
        for [p, q] in self.edges.iter().map(|e| e.map(|v| v as usize)) {
            near[p] |= other[q];
            near[q] |= other[p];
        }
        let region = |v: &usize| self.regions[*v];
        let all = (0..self.count()).filter(|v| region(v).is_torso() || region(v).is_arm());
        let all = all.filter(|v| self.nodes.means[*v].is_some() && !other[*v]);
        let all: Vec<usize> = all.collect();
        let inner = all.iter().filter(|v| !near[**v]).copied().collect();
        (all, inner)
    }

    pub(super) fn colors(&self, nodes: &[usize]) -> Vec<Vector3<f64>> {
        let colors = nodes.iter().filter_map(|v| self.without_light(*v));
        colors.collect()
    }

    /// Mean colour of a node with little of its light left: hue and saturation, and the logarithm of brightness.
    pub(super) fn without_light(&self, node: usize) -> Option<Vector3<f64>> {
        let settings = &self.config.settings.torso;
        self.nodes.means[node].map(|c| {
            let bright = c.z + settings.dark;
            let hue = [c.x / bright, c.y / bright];
            Vector3::new(hue[0], hue[1], settings.brightness * bright.ln())
        })
    }
}

/// Edges of the template within and between two sets of nodes.
#[derive(Clone, Copy, Debug, Default)]
struct Meetings {
    within: [usize; 2],
    between: usize,
    free: [usize; 2],
    /// Sum of the differences of colour between them.
    step: f64,
}

fn mean(all: &[Vector3<f64>]) -> Vector3<f64> {
    all.iter().sum::<Vector3<f64>>() / all.len().max(1) as f64
}

/// Direction between the means of two sets of colours, and the sum of their standard deviations along it.
fn separation([a, b]: &[Vec<Vector3<f64>>; 2]) -> Option<(Vector3<f64>, f64)> {
    let axis = (mean(a) - mean(b)).try_normalize(f64::MIN_POSITIVE)?;
    let deviation = |all: &[Vector3<f64>]| {
        let middle = mean(all);
        let squares = all.iter().map(|c| (c - middle).dot(&axis).powi(2));
        (squares.sum::<f64>() / all.len().max(1) as f64).sqrt()
    };
    Some((axis, (deviation(a) + deviation(b)).max(f64::MIN_POSITIVE)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::{BodyRegion, LabelConfig, NodeColors};
    use crate::topology::{ClothTemplate, LegTopology};
    use tryon_body::embedded;
    use tryon_geometry::math::P3;

    const SKIN: [f32; 3] = [205.0, 150.0, 120.0];
    const NAVY: [f32; 3] = [44.0, 52.0, 86.0];
    const WHITE: [f32; 3] = [228.0, 228.0, 224.0];

    /// Looks for a second garment where torso and arms have a colour of their place, the rest that of skin.
    fn finds_two(color: impl Fn(&P3, BodyRegion) -> [f32; 3]) -> bool {
        let cloth = ClothTemplate::new(&embedded::template(), LegTopology::Apart).expect("small");
        let dressed = |p: &P3, r: BodyRegion| match r.is_torso() || r.is_arm() {
            true => color(p, r),
            false => SKIN,
        };
        let nodes = NodeColors::painted(cloth.template(), dressed, |_| 0.0);
        Labeller::new(&cloth, &nodes, &LabelConfig::default()).find_second_top()
    }

    #[test]
    fn a_shirt_in_an_open_jacket_and_its_sleeves_are_garments() {
        let is_open = |p: &P3| p.x.abs() < 0.06 && p.z > 0.0;
        assert!(finds_two(|p, _| if is_open(p) { WHITE } else { NAVY }));
        assert!(finds_two(|_, r| if r.is_arm() { WHITE } else { NAVY }));
    }

    #[test]
    fn shades_stripes_prints_and_bare_arms_are_none() {
        assert!(!finds_two(|_, _| NAVY));
        let stripe = |p: &P3| (p.y / 0.04).rem_euclid(2.0) < 1.0;
        assert!(!finds_two(|p, _| if stripe(p) { WHITE } else { NAVY }));
        let print = |p: &P3, r: BodyRegion| r == BodyRegion::Chest && p.z > 0.0 && p.x.abs() < 0.09;
        let is_low = |p: &P3| p.y < 1.30;
        assert!(!finds_two(|p, r| if print(p, r) && is_low(p) {
            WHITE
        } else {
            NAVY
        }));
        assert!(!finds_two(|_, r| if r.is_arm() { SKIN } else { NAVY }));
    }
}
