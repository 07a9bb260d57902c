//! Colours of a garment's vertices: means of the scan points there, spread over vertices without any.

use super::multi::ClothPart;
use super::scan::BodyScan;
use super::segmenter::SegmentedScan;
use tryon_geometry::mesh::{Csr, edges};

/// Colours of a part's vertices, sRGB, shape `[vertices]`; `grey` without a coloured point.
pub(super) fn part_colors(
    part: &ClothPart,
    segmented: &SegmentedScan,
    scan: &BodyScan,
    grey: f32,
) -> Vec<[u8; 3]> {
    let around = Csr::of_edges(part.nodes.len(), &edges(&part.faces));
    let own = |(v, hidden): (&u32, &bool)| {
        let row = segmented.nodes.points.row(*v as usize);
        // Hair and arms lie over garments.
        let row = row.iter().map(|p| *p as usize);
        let row = row.filter(|p| segmented.labels[*p] == part.label);
        let colors = row.filter_map(|p| scan.colors.get(p));
        let all: Vec<[f32; 3]> = colors.map(|c| c.map(f32::from)).collect();
        // Points over a hidden vertex belong to the garment above.
        (!hidden).then(|| mean(&all)).flatten()
    };
    let mut known: Vec<Option<[f32; 3]>> = part.nodes.iter().zip(&part.hidden).map(own).collect();
    loop {
        let before = known.clone();
        let spread = |v: usize| {
            let near = around.row(v).iter().filter_map(|w| before[*w as usize]);
            mean(&near.collect::<Vec<_>>())
        };
        let mut is_changed = false;
        for v in 0..known.len() {
            if known[v].is_none() {
                known[v] = spread(v);
                is_changed |= known[v].is_some();
            }
        }
        if !is_changed {
            break;
        }
    }
    let rounded = |c: &Option<[f32; 3]>| c.unwrap_or([grey; 3]).map(|v| v.round() as u8);
    known.iter().map(rounded).collect()
}

fn mean(all: &[[f32; 3]]) -> Option<[f32; 3]> {
    let n = all.len() as f32;
    let sum = |k: usize| all.iter().map(|c| c[k]).sum::<f32>();
    (!all.is_empty()).then(|| std::array::from_fn(|k| sum(k) / n))
}
