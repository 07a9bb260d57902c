//! Change detection of the plain picture while nobody is in view: a scene that stands still is looked at and drawn less
//! often than it is exposed.

use tokio::time::{Duration, Instant};
use tryon::geometry::camera::ColorImage;

/// Pixels between two samples, in both directions: a hand at two metres covers some twenty.
const STRIDE: usize = 8;
/// Change of a sample's green beyond the noise of cameras, and the share of samples that makes a change of the scene.
const LEVELS: u8 = 16;
const SHARE: f64 = 0.002;
/// Time without a change until the scene counts as still.
const SETTLED: Duration = Duration::from_secs(1);
/// Interval of looks at a still scene: a change is shown within it.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Interval of pictures of a still scene, which show changes too slow to be detected.
const DRAW_EVERY: Duration = Duration::from_millis(500);

/// Treatment of one exposure of an empty scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Look {
    /// It shows something new, or the last picture is old.
    pub(crate) is_due: bool,
    /// Time of the next exposure to take.
    pub(crate) next: Instant,
}

/// The scene as it was last drawn.
#[derive(Debug, Default)]
pub(crate) struct EmptyScene {
    samples: Vec<u8>,
    still_since: Option<Instant>,
    drawn: Option<Instant>,
}

impl EmptyScene {
    /// Compares an exposure with the last picture. A picture without colour is always due.
    pub(crate) fn look(&mut self, picture: Option<&ColorImage>, now: Instant) -> Look {
        let samples = picture.map_or_else(Vec::new, samples);
        if samples.is_empty() || is_changed(&self.samples, &samples) {
            self.still_since = None;
        } else {
            self.still_since.get_or_insert(now);
        }
        let is_still = self.still_since.is_some_and(|t| now - t >= SETTLED);
        let is_due = !is_still || self.drawn.is_none_or(|t| now - t >= DRAW_EVERY);
        if is_due {
            self.samples = samples;
            self.drawn = Some(now);
        }
        Look {
            is_due,
            next: if is_still { now + LOOK_EVERY } else { now },
        }
    }
}

/// Green of every pixel of a grid.
fn samples(picture: &ColorImage) -> Vec<u8> {
    let row = 3 * picture.width() as usize;
    let rows = picture.data().chunks_exact(row).step_by(STRIDE);
    rows.flat_map(|row| row.iter().skip(1).step_by(3 * STRIDE).copied())
        .collect()
}

fn is_changed(old: &[u8], new: &[u8]) -> bool {
    let changed = old
        .iter()
        .zip(new)
        .filter(|(a, b)| a.abs_diff(**b) > LEVELS);
    old.len() != new.len() || changed.count() as f64 > SHARE * new.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Duration = Duration::from_millis(33);

    /// A grey room with noise of ±6 levels and, if given, a dark square of 40 pixels at that column.
    fn room(seed: u32, square: Option<usize>) -> ColorImage {
        let (w, h) = (640usize, 480usize);
        let mut data = Vec::with_capacity(3 * w * h);
        let mut state = seed.wrapping_mul(2_654_435_761).max(1);
        for i in 0..w * h {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            let (x, y) = (i % w, i / w);
            let is_dark =
                square.is_some_and(|c| (c..c + 40).contains(&x) && (200..240).contains(&y));
            let level = if is_dark {
                40
            } else {
                120 + (state % 13) as u8 - 6
            };
            data.extend([level; 3]);
        }
        ColorImage::new(w as u32, h as u32, data).expect("whole")
    }

    #[test]
    fn a_still_room_is_drawn_twice_a_second_and_a_hand_at_once() {
        let (mut scene, mut now) = (EmptyScene::default(), Instant::now());
        let mut taken = Vec::new();
        let end = now + Duration::from_secs(10);
        while now < end {
            let look = scene.look(Some(&room(taken.len() as u32, None)), now);
            taken.push((now, look.is_due));
            now = look.next.max(now + FRAME);
        }
        let late = taken
            .iter()
            .filter(|(t, _)| end - *t < Duration::from_secs(8));
        let drawn = late.clone().filter(|(_, is_due)| *is_due).count();
        assert!((15..=17).contains(&drawn), "{drawn} pictures in 8 s");
        assert!(late.count() <= 81, "looks in 8 s");

        let look = scene.look(Some(&room(1, Some(300))), now);
        assert_eq!(
            look,
            Look {
                is_due: true,
                next: now
            }
        );
        now += FRAME;
        let look = scene.look(Some(&room(2, Some(310))), now);
        assert_eq!(
            look,
            Look {
                is_due: true,
                next: now
            },
            "at the full rate from now on"
        );
    }

    #[test]
    fn pictures_of_another_size_and_without_colour_are_due() {
        let (mut scene, mut now) = (EmptyScene::default(), Instant::now());
        for _ in 0..100 {
            assert!(scene.look(None, now).is_due);
            now += FRAME;
        }
        for i in 0..100 {
            scene.look(Some(&room(i, None)), now);
            now += FRAME;
        }
        let small = ColorImage::filled(16, 16, [120; 3]);
        assert!(scene.look(Some(&small), now).is_due);
    }
}
