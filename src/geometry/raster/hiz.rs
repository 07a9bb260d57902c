//! Hierarchical depth (one level): the farthest depth of each tile of a band, and the occlusion query against it.

/// Side of a tile in pixels, as a power of two: a face of a garment touches about nine tiles of 8×8.
const TILE_BITS: u32 = 3;
const TILE: usize = 1 << TILE_BITS;

/// Farthest depth per tile of a band of rows. Scratch.
#[derive(Clone, Debug, Default)]
pub(super) struct DepthTiles {
    /// Metres, row-major; infinity where a pixel is empty.
    farthest: Vec<f32>,
    /// Tiles in a row.
    columns: usize,
}

impl DepthTiles {
    /// Rebuilds the tiles from depths in rows of `width` pixels.
    #[inline(always)]
    pub(super) fn update(&mut self, depth: &[f32], width: usize) {
        self.columns = width.div_ceil(TILE);
        self.farthest.clear();
        self.farthest.resize(
            self.columns * (depth.len() / width.max(1)).div_ceil(TILE),
            0.0,
        );
        for (rows, tiles) in depth
            .chunks(TILE * width)
            .zip(self.farthest.chunks_mut(self.columns))
        {
            for row in rows.chunks_exact(width) {
                for (pixels, tile) in row.chunks(TILE).zip(tiles.iter_mut()) {
                    let farthest = |m: f32, d: &f32| if *d > m { *d } else { m };
                    *tile = pixels.iter().fold(*tile, farthest);
                }
            }
        }
    }

    /// True if every tile of these pixels (first and last, inclusive) is nearer than `nearest`.
    #[inline(always)]
    pub(super) fn occlude(&self, columns: [i32; 2], rows: [i32; 2], nearest: f32) -> bool {
        let [left, right] = columns.map(|x| x as usize >> TILE_BITS);
        let [top, bottom] = rows.map(|y| y as usize >> TILE_BITS);
        (top..=bottom).all(|y| {
            self.farthest[y * self.columns..][left..=right]
                .iter()
                .all(|depth| nearest > *depth)
        })
    }
}
