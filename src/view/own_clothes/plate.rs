//! The scene without the person, as far as it was seen: before, or beside and behind the person as it moves.
//!
//! Of what is seen at a pixel the farthest is the scene. Nothing is learned where the tracked person is, and what was learned
//! there before it was tracked is forgotten.

use crate::captured_pixels::CapturedPixels;
use crate::settings::PlateSettings;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;

/// Rows that one picture updates: one in so many.
const TURNS: usize = 8;
/// One in so many vertices tells where the body is: they lie closer than the margin around them.
const VERTEX_STEP: usize = 16;
/// Side of a cell of the person's zone, pixels of the colour image.
const CELL: usize = 8;
/// Depth of a pixel without a reading: as far as can be.
const FAR: u16 = u16::MAX;

/// Colours of the empty scene, shape of the colour image.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plate {
    size: [u32; 2],
    color: Vec<[u8; 3]>,
    /// Millimetres; 0 = never seen.
    depth: Vec<u16>,
    /// Exposure last learned from.
    sequence: Option<u64>,
    turn: usize,
}

/// Cells of the colour image where the person is or may be, with the farthest depth of the person there, metres.
struct PersonZone {
    columns: usize,
    farthest: Vec<f32>,
}

impl PersonZone {
    fn new(captured: &CapturedPixels<'_>, vertices: &[P3], settings: &PlateSettings) -> Self {
        let viewport = captured.viewport;
        let [columns, rows] = viewport.color.map(|s| (s as usize).div_ceil(CELL));
        let mut farthest = vec![0.0f32; columns * rows];
        for p in vertices.iter().step_by(VERTEX_STEP).filter(|p| p.z > 0.0) {
            let q = viewport.camera.project(p);
            let reach = f64::from(settings.margin) * viewport.camera.fx / f64::from(p.z);
            let cells = |out: f32, axis: usize, most: usize| {
                let cell = |out: f64| {
                    let at = (out + 0.5 - viewport.shift[axis]) / viewport.scale;
                    (at / CELL as f64).clamp(0.0, (most - 1) as f64) as usize
                };
                let out = f64::from(out);
                cell(out - reach)..=cell(out + reach)
            };
            for y in cells(q.y, 1, rows) {
                for x in cells(q.x, 0, columns) {
                    let far = &mut farthest[y * columns + x];
                    *far = far.max(p.z);
                }
            }
        }
        Self { columns, farthest }
    }

    /// Depth up to which something at a pixel may be the person, metres; 0 away from it.
    fn person_to(&self, u: usize, v: usize, behind: f32) -> f32 {
        let far = self.farthest[v / CELL * self.columns + u / CELL];
        if far > 0.0 { far + behind } else { 0.0 }
    }
}

/// Nearest reading at and around a pixel of a depth image, 0 where one lacks: colours beside an outline are partly the
/// person's, and both images are aligned within a few pixels.
fn nearest_around(depth: &[u16], [columns, rows]: [usize; 2], [x, y]: [usize; 2]) -> u16 {
    const REACH: usize = 3;
    let at = |x: usize, y: usize| depth[y.min(rows - 1) * columns + x.min(columns - 1)];
    let beside = (1..=REACH).flat_map(|d| {
        [
            at(x.saturating_sub(d), y),
            at(x + d, y),
            at(x, y.saturating_sub(d)),
            at(x, y + d),
        ]
    });
    beside.fold(at(x, y), u16::min)
}

impl Plate {
    /// Learns one in eight rows of an exposure; `vertices` are the tracked body's in the picture's camera.
    pub(crate) fn learn(
        &mut self,
        color: &ColorImage,
        sequence: u64,
        captured: &CapturedPixels<'_>,
        vertices: &[P3],
        settings: &PlateSettings,
    ) {
        let size = [color.width(), color.height()];
        if self.size != size {
            let pixels = size[0] as usize * size[1] as usize;
            *self = Self {
                size,
                color: vec![[0; 3]; pixels],
                depth: vec![0; pixels],
                ..Self::default()
            };
        }
        if self.sequence.replace(sequence) == Some(sequence) {
            return;
        }
        self.turn = (self.turn + 1) % TURNS;
        let zone = PersonZone::new(captured, vertices, settings);
        let [width, height] = size.map(|s| s as usize);
        let [columns, rows] = captured.viewport.depth.map(|s| s as usize);
        for v in (self.turn..height).step_by(TURNS) {
            for u in 0..width {
                let at = [u * columns / width, v * rows / height];
                let person_to = (zone.person_to(u, v, settings.behind) * 1e3) as u16;
                let reading = if person_to > 0 {
                    nearest_around(captured.depth, [columns, rows], at)
                } else {
                    captured.depth[at[1] * columns + at[0]]
                };
                let color = color.at(u as u32, v as u32);
                self.see(v * width + u, color, reading, person_to);
            }
        }
    }

    /// One pixel of an exposure; `person_to` (mm) is where the person ends there, 0 away from it.
    fn see(&mut self, i: usize, color: [u8; 3], reading: u16, person_to: u16) {
        const SAME: u16 = 100;
        let (known, old) = (self.depth[i], self.color[i]);
        if person_to > 0 && reading <= person_to {
            // Was the person taken for the scene before it was tracked?
            if known < person_to {
                self.depth[i] = 0;
            }
            return;
        }
        let seen = if reading == 0 { FAR } else { reading };
        if known == 0 || (seen != FAR && (seen > known.saturating_add(SAME) && known != FAR)) {
            self.depth[i] = seen;
            self.color[i] = color;
        } else if seen == FAR || known == FAR || seen >= known.saturating_sub(SAME) {
            self.depth[i] = if seen == FAR { known } else { seen };
            self.color[i] = [0, 1, 2].map(|c| {
                let (old, new) = (u16::from(old[c]), u16::from(color[c]));
                ((3 * old + new + 2) / 4) as u8
            });
        }
    }

    /// Colour of the scene at an output pixel, where it was seen.
    pub(crate) fn at(&self, captured: &CapturedPixels<'_>, [u, v]: [u32; 2]) -> Option<[u8; 3]> {
        let viewport = captured.viewport;
        let [x, y] = [viewport.color_at(0, u), viewport.color_at(1, v)].map(f64::round);
        let [width, height] = self.size;
        if x < 0.0 || y < 0.0 || x >= f64::from(width) || y >= f64::from(height) {
            return None;
        }
        let i = y as usize * width as usize + x as usize;
        (self.depth[i] > 0).then(|| self.color[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: [u8; 3] = [200, 100, 50];
    const PERSON: [u8; 3] = [10, 20, 30];

    fn plate() -> Plate {
        Plate {
            size: [1, 1],
            color: vec![[0; 3]],
            depth: vec![0],
            ..Plate::default()
        }
    }

    #[test]
    fn the_farthest_is_the_scene() {
        let mut plate = plate();
        plate.see(0, PERSON, 2000, 0);
        assert_eq!(plate.color[0], PERSON, "somebody who is not tracked");
        plate.see(0, WALL, 3000, 0);
        assert_eq!((plate.color[0], plate.depth[0]), (WALL, 3000));
        plate.see(0, PERSON, 2000, 0);
        assert_eq!(plate.color[0], WALL, "somebody who passes");
        plate.see(0, [208, 108, 58], 3010, 0);
        assert_eq!(plate.color[0], [202, 102, 52], "light that changes");
    }

    #[test]
    fn the_tracked_person_is_never_the_scene_and_a_wall_behind_is() {
        let mut plate = plate();
        plate.see(0, PERSON, 2000, 2300);
        assert_eq!(plate.depth[0], 0);
        plate.see(0, PERSON, 2000, 0);
        plate.see(0, PERSON, 2010, 2300);
        assert_eq!(plate.depth[0], 0, "was taken for the scene");
        plate.see(0, WALL, 3000, 2300);
        plate.see(0, PERSON, 0, 2300);
        assert_eq!(
            (plate.color[0], plate.depth[0]),
            (WALL, 3000),
            "a hole at the person"
        );
    }

    #[test]
    fn a_wall_without_readings_is_a_scene_until_one_comes() {
        let mut plate = plate();
        plate.see(0, WALL, 0, 0);
        assert_eq!((plate.color[0], plate.depth[0]), (WALL, FAR));
        plate.see(0, WALL, 3000, 0);
        assert_eq!(plate.depth[0], 3000);
    }

    #[test]
    fn around_the_person_the_nearest_reading_counts() {
        // Somebody 2 m away in the middle column, a wall at 3 m, a gap in the last column.
        let depth: Vec<u16> = (0..11 * 9)
            .map(|i| match i % 11 {
                5 => 2000,
                10 => 0,
                _ => 3000,
            })
            .collect();
        let at = |x: usize| nearest_around(&depth, [11, 9], [x, 4]);
        assert_eq!([0, 1, 2, 5, 6].map(at), [3000, 3000, 2000, 2000, 2000]);
        assert_eq!(at(8), 0, "no reading beside");
    }
}
