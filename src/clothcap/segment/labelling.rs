//! Labels of the template's nodes: appearance, garment prior and smoothness in one energy (eq. 11), number of garments included.

use super::color_mixture::ColorMixture;
use super::node_colors::NodeColors;
use super::prior::{BodyRegion, Slot};
use crate::CaptureError;
use crate::scalp::scalp;
use crate::settings::LabelSettings;
use crate::topology::ClothTemplate;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tryon_body::Template;
use tryon_geometry::mrf::{ExpansionConfig, MrfModel};

/// Configuration of a segmentation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelConfig {
    /// Garments; `None` finds them.
    pub slots: Option<Vec<Slot>>,
    /// Leave out the garment prior (ablation).
    pub without_prior: bool,
    /// Leave out the smoothness (ablation).
    pub without_smoothness: bool,
    /// Settings.
    pub settings: LabelSettings,
}

/// Labels of a template's nodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Labelling {
    /// Slot of each label; label 0 is [`Slot::Skin`], label 1 [`Slot::Hair`].
    pub slots: Vec<Slot>,
    /// Label of each node, shape `[nodes]`.
    pub labels: Vec<u8>,
    /// Appearance of each label; `None` without a coloured point.
    pub appearances: Vec<Option<ColorMixture>>,
    /// Energy per node, nats.
    pub energy: f64,
    /// The top reaches down to the thighs.
    #[serde(default)]
    pub is_top_long: bool,
}

impl Labelling {
    /// Takes over the labels of scan points: each node with points gets that of most of them.
    pub fn adopt(&mut self, nodes: &NodeColors, scan_labels: &[u8]) {
        for (v, label) in self.labels.iter_mut().enumerate() {
            let mut counts = vec![0usize; self.slots.len()];
            let row = nodes.points.row(v).iter();
            row.for_each(|p| counts[usize::from(scan_labels[*p as usize])] += 1);
            let most = counts.iter().copied().max().unwrap_or(0);
            if most > counts[usize::from(*label)] {
                *label = counts.iter().position(|n| *n == most).unwrap_or(0) as u8;
            }
        }
    }

    /// Part of each label in the output: 0 for skin and hair, then one a garment.
    pub fn parts(&self) -> Vec<u8> {
        let mut next = 0;
        let part = |s: &Slot| {
            next += u8::from(s.is_garment());
            if s.is_garment() { next } else { 0 }
        };
        self.slots.iter().map(part).collect()
    }
}

/// Labels the nodes of a later frame with the appearances of the first one; `before` are the labels there.
///
/// # Errors
/// As [`label_nodes`](super::label_nodes).
pub fn relabel_nodes(
    cloth: &ClothTemplate,
    nodes: &NodeColors,
    before: &Labelling,
    config: &LabelConfig,
) -> Result<Labelling, CaptureError> {
    let mut labeller = Labeller::new(cloth, nodes, config);
    labeller.is_top_long = before.is_top_long;
    let mut unary = labeller.unary(&before.slots, &before.appearances);
    let count = before.slots.len();
    for (v, own) in before.labels.iter().enumerate() {
        for l in (0..count).filter(|l| *l != usize::from(*own)) {
            unary[v * count + l] += config.settings.change;
        }
    }
    let (labels, energy) = labeller.expand(&unary, &before.labels)?;
    Ok(Labelling {
        labels,
        energy,
        ..before.clone()
    })
}

/// Costs and smoothness of one frame's labels.
pub(super) struct Labeller<'a> {
    pub(super) nodes: &'a NodeColors,
    pub(super) config: &'a LabelConfig,
    pub(super) regions: Vec<BodyRegion>,
    /// Scalp: back and top of the head.
    hair: Vec<bool>,
    /// Nodes of the garment of the legs, which reaches up to the torso.
    pub(super) bottom: Vec<bool>,
    /// Nodes of torso and arms in one of two garments there; `true` for the one that the torso has less of.
    pub(super) second_top: Vec<Option<bool>>,
    pub(super) is_top_long: bool,
    /// Nodes between the legs without a scan point.
    empty: Vec<bool>,
    pub(super) edges: Vec<[u32; 2]>,
    weights: Vec<f32>,
}

impl<'a> Labeller<'a> {
    pub(super) fn new(
        cloth: &ClothTemplate,
        nodes: &'a NodeColors,
        config: &'a LabelConfig,
    ) -> Self {
        let template = cloth.template();
        let edges: Vec<[u32; 2]> = template.topology().edges().iter().map(|e| e.v).collect();
        let settings = &config.settings;
        let smoothness = match config.without_smoothness {
            true => 0.0,
            false => settings.smoothness,
        };
        let weight = |e: &[u32; 2]| {
            let [a, b] = e.map(|v| nodes.means[v as usize]);
            let (floor, half) = (settings.least_smoothness, settings.contrast);
            let contrast = match (a, b) {
                (Some(a), Some(b)) => ((a - b).norm() as f32 / half).powi(2),
                _ => 0.0,
            };
            let down = step_down(template, nodes, *e).max(0.0);
            let contrast = contrast + (down / settings.step).powi(2);
            smoothness * (floor + (1.0 - floor) / (1.0 + contrast))
        };
        let regions = BodyRegion::of_vertices(template);
        let is_empty = |v| cloth.is_between(v) && nodes.points.row(v).is_empty();
        Self {
            nodes,
            config,
            hair: scalp(template),
            bottom: vec![false; regions.len()],
            second_top: vec![None; regions.len()],
            is_top_long: false,
            empty: (0..regions.len()).map(is_empty).collect(),
            regions,
            weights: edges.iter().map(weight).collect(),
            edges,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.regions.len()
    }

    /// Turns of appearances and labels from a start by body regions.
    pub(super) fn run(&self, slots: Vec<Slot>) -> Result<Labelling, CaptureError> {
        let mut labels = self.first_labels(&slots);
        let mut out = None;
        for _ in 0..self.config.settings.turns {
            let appearances = self.appearances(&slots, &labels);
            let unary = self.unary(&slots, &appearances);
            let (next, energy) = self.expand(&unary, &labels)?;
            let settled = next == labels;
            labels = next;
            out = Some((appearances, energy));
            if settled {
                break;
            }
        }
        let (appearances, energy) = out.unwrap_or_default();
        Ok(Labelling {
            slots,
            labels,
            appearances,
            energy,
            is_top_long: self.is_top_long,
        })
    }

    /// Labels of least energy from a start, and the energy per node.
    fn expand(&self, unary: &[f32], start: &[u8]) -> Result<(Vec<u8>, f64), CaptureError> {
        let model = MrfModel {
            edges: &self.edges,
            weights: &self.weights,
        };
        let mut next: Vec<u32> = start.iter().map(|l| u32::from(*l)).collect();
        let report = model
            .expand(unary, &mut next, &ExpansionConfig::default())
            .map_err(|e| CaptureError::solve("segmentation", e))?;
        let labels = next.iter().map(|l| *l as u8).collect();
        Ok((labels, report.energy / self.count().max(1) as f64))
    }

    /// Start: the likely label of each region; arms and shins go to the nearer of skin and their garment.
    pub(super) fn first_labels(&self, slots: &[Slot]) -> Vec<u8> {
        let index = |slot: Slot| slots.iter().position(|s| *s == slot).map(|i| i as u8);
        let any = |all: &[Slot]| all.iter().find_map(|s| index(*s)).unwrap_or(0);
        let torso = any(&[Slot::Top, Slot::OnePiece]);
        let legs = any(&[Slot::Bottom, Slot::OnePiece]);
        let mean = |wanted: &dyn Fn(BodyRegion) -> bool| {
            let all = (0..self.count()).filter(|v| wanted(self.regions[*v]));
            let colors: Vec<_> = all.filter_map(|v| self.nodes.means[v]).collect();
            let n = colors.len().max(1) as f64;
            colors.iter().sum::<Vector3<f64>>() / n
        };
        let hands = mean(&|r| r == BodyRegion::Hand);
        let chest = mean(&BodyRegion::is_torso);
        let thighs = mean(&|r| r == BodyRegion::Thigh);
        let nearer = |v: usize, garment: Vector3<f64>, label: u8| match self.nodes.means[v] {
            Some(c) if (c - garment).norm() < (c - hands).norm() => label,
            Some(_) => 0,
            None => label,
        };
        let first = |v: usize| match self.regions[v] {
            BodyRegion::Head if self.hair[v] => any(&[Slot::Hair]),
            BodyRegion::Head | BodyRegion::Neck | BodyRegion::Hand => 0,
            BodyRegion::Chest | BodyRegion::Abdomen => torso,
            BodyRegion::Pelvis | BodyRegion::Thigh => legs,
            BodyRegion::UpperArm | BodyRegion::Forearm => nearer(v, chest, torso),
            BodyRegion::Shin => nearer(v, thighs, legs),
            BodyRegion::Foot => any(&[Slot::Shoes]),
        };
        let mut labels: Vec<u8> = (0..self.count()).map(first).collect();
        if let (Some(under), Some(top)) = (index(Slot::Under), index(Slot::Top)) {
            for (label, second) in labels.iter_mut().zip(&self.second_top) {
                *label = second.map_or(*label, |s| if s { under } else { top });
            }
        }
        labels
    }

    /// Face and hands.
    pub(super) fn bare_nodes(&self) -> Vec<usize> {
        let is_bare = |v: &usize| {
            let face = self.regions[*v] == BodyRegion::Head && !self.hair[*v];
            face || self.regions[*v] == BodyRegion::Hand
        };
        (0..self.count()).filter(is_bare).collect()
    }

    pub(super) fn skin_appearance(&self) -> Option<ColorMixture> {
        self.nodes.skin_appearance(self.bare_nodes().into_iter())
    }

    fn appearances(&self, slots: &[Slot], labels: &[u8]) -> Vec<Option<ColorMixture>> {
        let own = |l: usize| (0..self.count()).filter(move |v| usize::from(labels[*v]) == l);
        let look = |l: usize| match slots[l] {
            // Sleeves taken for skin would make skin look like sleeves.
            Slot::Skin => self.skin_appearance(),
            Slot::Hair => self.nodes.appearance(own(l)),
            _ => {
                let cloth = self.without_skin(own(l).collect());
                self.nodes.appearance(cloth.into_iter())
            }
        };
        let mut out: Vec<Option<ColorMixture>> = (0..slots.len()).map(look).collect();
        // Garments of one colour share an appearance: else each keeps the shades of the nodes that it began with.
        let garments = (0..slots.len()).filter(|l| slots[*l].is_garment());
        let garments: Vec<usize> = garments.collect();
        for (k, &a) in garments.iter().enumerate() {
            for &b in &garments[..k] {
                let (Some(one), Some(other)) = (&out[a], &out[b]) else {
                    continue;
                };
                let excess = self.excess(own(a), one, other) + self.excess(own(b), other, one);
                if excess < 2.0 * self.config.settings.distinct {
                    let both = self.nodes.appearance(own(a).chain(own(b)));
                    (out[a], out[b]) = (both.clone(), both);
                }
            }
        }
        out
    }

    /// Nodes of a garment's start without those that look like skin, if the rest clearly does not: regions start whole, and
    /// shorts would keep the colour of the thighs below them.
    pub(super) fn without_skin(&self, own: Vec<usize>) -> Vec<usize> {
        let settings = &self.config.settings;
        let all = self.nodes.appearance(own.iter().copied());
        let Some((all, skin)) = all.zip(self.skin_appearance()) else {
            return own;
        };
        let excess = |v: &usize| self.nodes.cost(*v, &skin) - self.nodes.cost(*v, &all);
        let is_cloth = |v: &usize| excess(v) > settings.distinct;
        let cloth: Vec<usize> = own.iter().copied().filter(is_cloth).collect();
        let is_enough = cloth.len() as f64 >= settings.least_cloth * own.len() as f64;
        let excess = self.excess(cloth.iter().copied(), &all, &skin);
        if is_enough && excess >= settings.unlike_skin {
            cloth
        } else {
            own
        }
    }

    /// Mean cost of another appearance above that of their own at some nodes, nats.
    pub(super) fn excess(
        &self,
        nodes: impl Iterator<Item = usize>,
        own: &ColorMixture,
        other: &ColorMixture,
    ) -> f64 {
        let seen = nodes.filter(|v| !self.nodes.points.row(*v).is_empty());
        let cost = |v, look| self.nodes.cost(v, look);
        let (sum, n) = seen.fold((0.0, 0usize), |(sum, n), v| {
            (sum + cost(v, other) - cost(v, own), n + 1)
        });
        sum / n.max(1) as f64
    }

    fn prior(&self, slot: Slot, region: BodyRegion) -> f32 {
        let is_long = self.is_top_long && region == BodyRegion::Thigh;
        match slot {
            _ if self.config.without_prior => 0.0,
            Slot::Top | Slot::Under if is_long => self.config.settings.long_top,
            _ => slot.cost(region),
        }
    }

    /// Costs of all labels at all nodes (eq. 12), shape `[nodes, labels]`.
    fn unary(&self, slots: &[Slot], appearances: &[Option<ColorMixture>]) -> Vec<f32> {
        let mut out = Vec::with_capacity(self.count() * slots.len());
        for v in 0..self.count() {
            for (slot, appearance) in slots.iter().zip(appearances) {
                let color = appearance.as_ref().map_or(0.0, |a| self.nodes.cost(v, a));
                let prior = self.prior(*slot, self.regions[v]);
                let is_empty = self.empty[v] && slot.is_garment();
                let empty = if is_empty {
                    self.config.settings.empty
                } else {
                    0.0
                };
                out.push(color as f32 + prior + empty);
            }
        }
        out
    }
}

/// Step from the upper to the lower end of an edge of the rest pose, metres.
pub(super) fn step_down(template: &Template, nodes: &NodeColors, edge: [u32; 2]) -> f32 {
    let [a, b] = edge.map(|v| template.mesh().vertices()[v as usize].y);
    let [p, q] = edge.map(|v| nodes.steps[v as usize]);
    if a > b { p - q } else { q - p }
}
