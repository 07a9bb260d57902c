//! Integer costs of a labelling problem: exact sums, so an expansion's gain has an exact sign.

/// Bits of the range that costs, balances and their sums share.
const RANGE_BITS: i32 = 30;

/// Unary costs and Potts weights as integers, in units of `1 / scale`.
///
/// The scale is a power of two, so costs that are integers stay exact. It follows the node with the largest
/// sum of weights: the unit is 2^-26 of that sum for four labels. Large unaries do not coarsen it. A cost
/// that exceeds the node's least by more than three times its weights is clamped: no expansion takes it.
#[derive(Clone, Debug, Default)]
pub(super) struct FixedPoint {
    /// Unary costs above the node's least, nodes × labels.
    pub(super) unary: Vec<i32>,
    /// Potts weight per edge.
    pub(super) weights: Vec<i32>,
    /// Clamp of the unary costs per node.
    pub(super) limits: Vec<i32>,
}

impl FixedPoint {
    /// Conversion of checked costs: finite unaries, finite weights of at least 0.
    pub(super) fn convert(
        &mut self,
        edges: &[[u32; 2]],
        weights: &[f32],
        unary: &[f32],
        nodes: usize,
    ) {
        let labels = unary.len().checked_div(nodes).unwrap_or(0);
        let scale = scale(edges, weights, nodes, labels);

        self.weights.clear();
        self.weights
            .extend(weights.iter().map(|&w| (f64::from(w) * scale + 0.5) as i32));

        self.limits.clear();
        self.limits.resize(nodes, 1);
        for (&[a, b], &weight) in edges.iter().zip(&self.weights) {
            self.limits[a as usize] += 3 * weight;
            self.limits[b as usize] += 3 * weight;
        }

        self.unary.clear();
        for (costs, &limit) in unary.chunks_exact(labels.max(1)).zip(&self.limits) {
            let least = costs.iter().copied().fold(f32::INFINITY, f32::min);
            self.unary.extend(costs.iter().map(|&cost| {
                let above = f64::from(cost) - f64::from(least);
                if limit == 1 {
                    i32::from(above > 0.0) // A node without weights takes its least cost, however close.
                } else {
                    ((above * scale + 0.5) as i32).min(limit)
                }
            }));
        }
    }

    /// Labelling without clamped costs: nodes that have one take their cheapest label. Returns the number
    /// of changes. Each lowers the energy whatever the neighbours' labels are.
    pub(super) fn drop_clamped(&self, labels: &mut [u32]) -> usize {
        let count = self.unary.len().checked_div(labels.len()).unwrap_or(0);
        let mut changes = 0;
        for (node, label) in labels.iter_mut().enumerate() {
            let costs = &self.unary[node * count..(node + 1) * count];
            if costs[*label as usize] >= self.limits[node] {
                *label = costs.iter().position(|&cost| cost == 0).unwrap_or(0) as u32;
                changes += 1;
            }
        }
        changes
    }

    /// Energy of a labelling [1 / scale].
    pub(super) fn energy(&self, edges: &[[u32; 2]], labels: &[u32]) -> i64 {
        let count = self.unary.len().checked_div(labels.len()).unwrap_or(0);
        let unary = labels
            .iter()
            .enumerate()
            .map(|(n, &l)| self.unary[n * count + l as usize]);
        let cut = edges.iter().zip(&self.weights);
        let cut = cut.filter(|(e, _)| labels[e[0] as usize] != labels[e[1] as usize]);
        unary.map(i64::from).sum::<i64>() + cut.map(|(_, &w)| i64::from(w)).sum::<i64>()
    }
}

/// Largest power of two that keeps every sum in range.
///
/// A height difference is at most 3 weights of a node from unaries, and 1 from each of the expansions since
/// the label's last: labels + 8 weights cover both.
fn scale(edges: &[[u32; 2]], weights: &[f32], nodes: usize, labels: usize) -> f64 {
    let mut sums = vec![0.0; nodes];
    for (&[a, b], &weight) in edges.iter().zip(weights) {
        sums[a as usize] += f64::from(weight);
        sums[b as usize] += f64::from(weight);
    }
    let largest = sums.into_iter().fold(0.0, f64::max);
    if largest == 0.0 {
        return 1.0;
    }
    let range = f64::from(1 << RANGE_BITS) / (labels + 8) as f64;
    (range / largest).log2().floor().exp2()
}
