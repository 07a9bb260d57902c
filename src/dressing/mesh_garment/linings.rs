//! Linings: cloth close below another sheet of the same file.

use super::piece::GarmentPiece;
use crate::settings::LiningSettings;
use tryon_geometry::math::V3;
use tryon_geometry::mesh::face_normal;
use tryon_geometry::spatial::PointTree;

/// Words of a part's name that say it lies inside another one.
const WORDS: [&str; 3] = ["lining", "inner", "inside"];

/// The sheet that each piece lines, if it does; pieces from the skin outwards.
pub(super) fn linings(pieces: &[GarmentPiece], settings: &LiningSettings) -> Vec<Option<usize>> {
    let shells: Vec<Shell<'_>> = pieces.iter().map(Shell::new).collect();
    let lined_by = |inner: usize| {
        let outer = (inner + 1..pieces.len())
            .map(|outer| (outer, shells[outer].share_below(&pieces[inner], settings)));
        let (outer, share) = outer.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_named = pieces[inner].part.is_named(&WORDS);
        let least = if is_named {
            settings.share_named
        } else {
            settings.share
        };
        (share >= least).then_some(outer)
    };
    (0..pieces.len()).map(lined_by).collect()
}

/// A sheet with normals away from the skin.
struct Shell<'a> {
    piece: &'a GarmentPiece,
    normals: Vec<V3>,
    tree: PointTree,
}

impl<'a> Shell<'a> {
    fn new(piece: &'a GarmentPiece) -> Self {
        let x = &piece.positions;
        let mut normals = vec![V3::zeros(); x.len()];
        for f in &piece.garment.faces {
            let normal = face_normal(x, f);
            f.iter().for_each(|v| normals[*v as usize] += normal);
        }
        Self {
            piece,
            normals,
            tree: PointTree::new(x),
        }
    }
    /// Share of the vertices of `inner` that lie close below this sheet.
    fn share_below(&self, inner: &GarmentPiece, settings: &LiningSettings) -> f64 {
        let is_below = |p: &&_| {
            let Some((v, _)) = self.tree.nearest(p, settings.reach) else {
                return false;
            };
            let normal = self.normals[v].try_normalize(0.0).unwrap_or_default();
            let depth = (self.piece.positions[v] - **p).dot(&normal);
            (settings.depth[0]..settings.depth[1]).contains(&depth)
        };
        let below = inner.positions.iter().filter(is_below).count();
        below as f64 / inner.positions.len().max(1) as f64
    }
}
