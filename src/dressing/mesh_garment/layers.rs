//! Order of the pieces of a mesh garment from the skin outwards.

use super::piece::GarmentPiece;
use std::collections::BTreeMap;

/// Sorts pieces innermost first, by the difference of their heights over the skin that both cover.
pub(super) fn by_layer(pieces: Vec<GarmentPiece>) -> Vec<GarmentPiece> {
    // Sum and count of the heights over each skin vertex.
    let heights: Vec<BTreeMap<u32, (f32, f32)>> = pieces
        .iter()
        .map(|p| {
            let mut of = BTreeMap::new();
            for (vertices, distance) in p.binding.vertices.iter().zip(&p.binding.distance) {
                if let Some((v, _)) = vertices.first() {
                    let e = of.entry(*v).or_insert((0.0, 0.0));
                    *e = (e.0 + distance, e.1 + 1.0);
                }
            }
            of
        })
        .collect();
    let above = |a: usize, b: usize| -> f32 {
        heights[a]
            .iter()
            .filter_map(|(v, p)| heights[b].get(v).map(|q| p.0 / p.1 - q.0 / q.1))
            .sum()
    };
    let mut order: Vec<usize> = Vec::new();
    for k in 0..pieces.len() {
        let at = order
            .iter()
            .position(|o| above(*o, k) > 0.0)
            .unwrap_or(order.len());
        order.insert(at, k);
    }
    order.into_iter().map(|k| pieces[k].clone()).collect()
}
