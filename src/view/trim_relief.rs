//! Relief and tone of trims in their own frames, from signed distances to their outlines.

use super::relief_curve::{bump, step};
use tryon_garment::TrimKind;

/// Rows of stitches inside an edge: distance of the first, and of two from each other (metres).
const ROW: f32 = 2e-3;
const SECOND_ROW: f32 = 6e-3;
/// Half width of a row of stitches, and radius of a folded edge (metres).
const STITCH: f32 = 7e-4;
const FOLD: f32 = 1.2e-3;
/// Depth of stitches in units of the bulk, and light that their thread takes.
const PULL: f32 = 0.6;
const THREAD: f32 = 0.22;
/// Half width of an opening, and light lost in it.
const OPENING: f32 = 1.3e-3;
const OPENING_SHADE: f32 = 0.5;
/// Width of a patch pocket's hem, metres, and of its point over its height.
const POCKET_HEM: f32 = 0.02;
const POCKET_POINT: f32 = 0.16;
/// Slant of a pouch's openings: their width and height over those of the pouch.
const POUCH_SLANT: [f32; 2] = [0.22, 0.65];
/// Height of a button over its diameter, of its rim over that, radius of its holes and their distance from its middle, both
/// over the diameter; tone of a button and of its holes.
const BUTTON: f32 = 0.18;
const RIM: f32 = 0.4;
const HOLES: [f32; 2] = [0.07, 0.13];
const BUTTON_TONE: f32 = -0.3;
const HOLE_TONE: f32 = -0.55;
/// Height, distance and tone of a zip's teeth, and the share of its width that they take.
const TEETH: f32 = 1.2e-3;
const TEETH_STEP: f32 = 3e-3;
const TEETH_TONE: f32 = -0.35;
const TEETH_SHARE: f32 = 0.3;
/// Height of a zip's puller over that of the zip.
const PULLER: f32 = 0.16;
/// Tone of a cord, and the distance of its twists, metres.
const CORD_TONE: f32 = 0.18;
const CORD_TWIST: f32 = 4e-3;
/// Layers of a placket and of a loop, in units of the bulk.
const STRIP_LAYERS: f32 = 1.6;

/// Height (metres) and share of light gained at a place.
pub(super) type ReliefPoint = [f32; 2];

/// Signed distance from a rectangle, positive inside.
fn in_rectangle([x, y]: [f32; 2], [w, h]: [f32; 2]) -> f32 {
    let (dx, dy) = (0.5 * w - x.abs(), 0.5 * h - y.abs());
    if dx < 0.0 && dy < 0.0 {
        -dx.hypot(dy)
    } else {
        dx.min(dy)
    }
}

/// Piece of cloth of height `bulk` with rows of stitches inside its edge, `inside` metres from it.
fn piece(inside: f32, bulk: f32, rows: u8) -> ReliefPoint {
    let stitches: f32 = (0..rows)
        .map(|k| bump(inside - ROW - SECOND_ROW * f32::from(k), STITCH))
        .sum();
    let layer = step(inside - 0.5 * FOLD, 2.0 * FOLD);
    [bulk * (layer - PULL * stitches), -THREAD * stitches]
}

/// Dark line of an opening at distance `d`.
fn opening(d: f32) -> f32 {
    -OPENING_SHADE * bump(d, OPENING)
}

/// Relief of a trim of a size (metres) on cloth of that bulk (metres) at a place of its frame.
pub(super) fn relief(kind: TrimKind, size: [f32; 2], bulk: f32, at: [f32; 2]) -> ReliefPoint {
    let ([w, h], [x, y]) = (size, at);
    match kind {
        TrimKind::Button => button(w, at),
        TrimKind::PatchPocket => patch_pocket(size, bulk, at),
        TrimKind::Pouch => pouch(size, bulk, at),
        TrimKind::Slit => {
            let reach = bump((x.abs() - 0.5 * w).max(0.0), OPENING);
            let lip = (step(0.5 * h - y.abs(), FOLD) - step(-y.abs(), FOLD)).max(0.0);
            let rows = bump(y.abs() - 0.5 * h, STITCH);
            let height = bulk * (lip - PULL * rows) * reach;
            [height, (opening(y) - THREAD * rows) * reach]
        }
        TrimKind::Zip => zip(size, bulk, at),
        TrimKind::Placket => {
            let [height, tone] = piece(in_rectangle(at, size), STRIP_LAYERS * bulk, 1);
            let is_open = step(in_rectangle(at, size), FOLD);
            // The upper strip ends beside the middle.
            [height, tone + 0.3 * opening(x - 0.5 * w) * is_open]
        }
        TrimKind::Fly => {
            let radius = w;
            let corner = [0.5 * w - radius, -0.5 * h + radius];
            let d = if y > corner[1] {
                x - 0.5 * w
            } else {
                (x - corner[0]).hypot(y - corner[1]) - radius
            };
            let is_along = step(0.5 * h - y, FOLD) * step(x + 0.5 * w, FOLD);
            let rows = (bump(d, STITCH) + bump(d + SECOND_ROW, STITCH)) * is_along;
            [-PULL * bulk * rows, -THREAD * rows]
        }
        TrimKind::Loop => {
            let [height, tone] = piece(in_rectangle(at, size), STRIP_LAYERS * bulk, 0);
            let ends = bump(y.abs() - 0.5 * h + 3.0 * ROW, STITCH) * step(0.5 * w - x.abs(), FOLD);
            [height - PULL * bulk * ends, tone - THREAD * ends]
        }
        TrimKind::Cord => {
            let across = (1.0 - (2.0 * x / w).powi(2)).max(0.0).sqrt();
            let along = step(0.5 * h - y.abs(), w);
            let twist = (std::f32::consts::TAU * (y + x) / CORD_TWIST).sin();
            let height = 0.5 * w * across * along * (1.0 + 0.1 * twist);
            let beside = bump(x.abs() - 0.5 * w, OPENING) * along;
            [height, CORD_TONE * across.min(1.0) * along - 0.25 * beside]
        }
    }
}

fn button(diameter: f32, [x, y]: [f32; 2]) -> ReliefPoint {
    let radius = 0.5 * diameter;
    let r = x.hypot(y);
    let inside = step(radius - r, 1e-3);
    let rim = bump(r - 0.8 * radius, 0.12 * radius);
    let [hole, away] = HOLES.map(|s| s * diameter);
    let from_hole = (x.abs() - away).hypot(y.abs() - away);
    let holes = step(hole - from_hole, 0.6 * hole);
    let height = BUTTON * diameter * inside * (1.0 + RIM * rim - holes);
    let below = bump((r - radius).max(0.0), 1.5 * OPENING) * (1.0 - inside);
    [
        height,
        BUTTON_TONE * inside + HOLE_TONE * holes - 0.35 * below,
    ]
}

fn patch_pocket([w, h]: [f32; 2], bulk: f32, [x, y]: [f32; 2]) -> ReliefPoint {
    let point = POCKET_POINT * h;
    // Lower sides run to a point in the middle.
    let slope = point / (0.5 * w);
    let below = (y + 0.5 * h - slope * x.abs()) / (1.0 + slope * slope).sqrt();
    let sides = 0.5 * w - x.abs();
    let inside = in_rectangle([x, y], [w, h]).min(below);
    let from_top = 0.5 * h - y;
    let sewn = sides.min(below);
    let is_inside = step(inside, FOLD);
    let [_, tone] = piece(sewn, bulk, 2);
    let rows = -tone / THREAD * is_inside;
    let hem = bump(from_top - POCKET_HEM, STITCH) * is_inside;
    let layers =
        step(inside - 0.5 * FOLD, 2.0 * FOLD) + 0.6 * step(POCKET_HEM - from_top, FOLD) * is_inside;
    let mouth = opening(from_top + OPENING) * step(sides, FOLD);
    [
        bulk * (layers - PULL * (rows + hem)),
        mouth - THREAD * (rows + hem),
    ]
}

fn pouch([w, h]: [f32; 2], bulk: f32, [x, y]: [f32; 2]) -> ReliefPoint {
    let [cut, tall] = [POUCH_SLANT[0] * w, POUCH_SLANT[1] * h];
    // Slanted openings from the upper edge to the sides.
    let normal = [tall, cut].map(|n| n / tall.hypot(cut));
    let start = [0.5 * w - cut, 0.5 * h];
    let slant = -((x.abs() - start[0]) * normal[0] + (y - start[1]) * normal[1]);
    let inside = in_rectangle([x, y], [w, h]).min(slant);
    let [height, tone] = piece(inside, 1.3 * bulk, 2);
    let is_slant = step(x.abs() - start[0], FOLD) * step(in_rectangle([x, y], [w, h]), FOLD);
    [height, tone + opening(slant + OPENING) * is_slant]
}

fn zip([w, h]: [f32; 2], bulk: f32, [x, y]: [f32; 2]) -> ReliefPoint {
    let inside = in_rectangle([x, y], [w, h]);
    let along = step(0.5 * h - y.abs(), FOLD);
    let sewn = bump(x.abs() - 0.5 * w, STITCH) * along;
    let half = 0.5 * TEETH_SHARE * w;
    let across = step(half - x.abs(), FOLD) * along;
    let side = if x < 0.0 { 0.5 } else { 0.0 };
    let turn = std::f32::consts::TAU * (y / TEETH_STEP + side);
    let teeth = across * (0.6 + 0.4 * turn.cos());
    let long = PULLER * h;
    let puller = step(
        in_rectangle([x, y - 0.5 * h + 0.6 * long], [0.7 * half.max(2e-3), long]),
        FOLD,
    );
    let layer = step(inside - 0.5 * FOLD, 2.0 * FOLD);
    let height = bulk * (0.4 * layer - PULL * sewn) + TEETH * teeth.max(2.0 * puller);
    [height, TEETH_TONE * across - 0.15 * puller - THREAD * sewn]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_beside_every_trim_cloth_is_flat_and_plain() {
        for kind in TrimKind::ALL {
            for at in [[0.2, 0.0], [0.0, 0.2], [-0.2, -0.2]] {
                let [height, tone] = relief(kind, [0.1, 0.1], 1e-3, at);
                assert!(
                    height.abs() < 1e-4 && tone.abs() < 1e-3,
                    "{kind:?} {at:?}: {height} {tone}"
                );
            }
        }
    }

    #[test]
    fn pieces_lie_on_the_cloth_and_openings_are_dark() {
        let size = [0.12, 0.14];
        let pocket = |at| relief(TrimKind::PatchPocket, size, 1e-3, at);
        assert!((pocket([0.0, 0.0])[0] - 1e-3).abs() < 1e-5, "one layer");
        assert!(pocket([0.0, 0.07 + OPENING])[1] < -0.4, "its mouth");
        assert!(
            pocket([0.058, -0.069])[0].abs() < 1e-6,
            "a corner is cut off"
        );
        let slit = |at| relief(TrimKind::Slit, [0.1, 0.02], 1e-3, at);
        assert!(slit([0.0, 0.0])[1] < -0.4 && slit([0.08, 0.0])[1] > -0.01);
        let button = |at| relief(TrimKind::Button, [0.012, 0.012], 1e-3, at);
        assert!(button([0.0, 0.0])[0] > 1e-3 && button([0.0, 0.0])[1] < -0.2);
    }
}
