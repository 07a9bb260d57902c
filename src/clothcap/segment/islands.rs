//! Islands of a garment in another one: stripes and prints in its colour.

use super::labelling::Labelling;
use super::prior::Slot;
use crate::settings::IslandSettings;
use tryon_geometry::mesh::Csr;

impl Labelling {
    /// Gives islands of tops, bottoms and one-piece garments to the garment beside them; `around` gives the neighbours of
    /// each node.
    pub fn join_islands(&mut self, around: &Csr, settings: &IslandSettings) {
        let is_one =
            |l: &usize| matches!(self.slots[*l], Slot::Top | Slot::Bottom | Slot::OnePiece);
        let whole: Vec<usize> = (0..self.slots.len()).filter(is_one).collect();
        for l in whole {
            let pieces = self.pieces(l as u8, around);
            let largest = pieces.iter().map(Vec::len).max().unwrap_or(0);
            let is_small = |p: &&Vec<u32>| p.len() as f64 <= settings.most_share * largest as f64;
            for piece in pieces.iter().filter(is_small) {
                if let Some(label) = self.label_around(piece, around, settings.beside) {
                    piece.iter().for_each(|v| self.labels[*v as usize] = label);
                }
            }
        }
    }

    fn pieces(&self, label: u8, around: &Csr) -> Vec<Vec<u32>> {
        let mut all = around.components(|v, w| self.labels[v] == self.labels[w]);
        all.retain(|piece| self.labels[piece[0] as usize] == label);
        all
    }

    /// Garment that most neighbours of a piece have.
    fn label_around(&self, piece: &[u32], around: &Csr, beside: f64) -> Option<u8> {
        let own = self.labels[*piece.first()? as usize];
        let mut counts = vec![0usize; self.slots.len()];
        for w in piece.iter().flat_map(|v| around.row(*v as usize)) {
            let label = self.labels[*w as usize];
            counts[usize::from(label)] += usize::from(label != own);
        }
        let all: usize = counts.iter().sum();
        let most = (0..counts.len()).max_by_key(|l| counts[*l])?;
        let is_beside = counts[most] as f64 >= beside * all as f64;
        (all > 0 && is_beside && self.slots[most].is_garment()).then_some(most as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_in_the_colour_of_trousers_stay_with_the_top() {
        // A line of nodes: trousers, a top with two stripes, skin.
        let slots = vec![Slot::Skin, Slot::Hair, Slot::Top, Slot::Bottom];
        let mut labels = [vec![3; 40], vec![2; 40], vec![0; 20]].concat();
        for v in [50, 51, 60, 61, 99] {
            labels[v] = 3;
        }
        let mut labelling = Labelling {
            appearances: vec![None; slots.len()],
            slots,
            labels,
            energy: 0.0,
            is_top_long: false,
        };
        let pairs = (1..100u32).flat_map(|v| [(v - 1, v), (v, v - 1)]);
        let around = Csr::from_pairs(100, &pairs.collect::<Vec<_>>());
        labelling.join_islands(&around, &IslandSettings::default());
        let expected = [vec![3; 40], vec![2; 40], vec![0; 19], vec![3]].concat();
        assert_eq!(labelling.labels, expected, "what lies in skin stays");
    }
}
