//! Records from which the network of body parts is trained: its picture of a person, and the truth in the picture's
//! coordinates.

use super::{LabelledFrame, LabelledFrames, NO_CLASS};
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::io::{self, Write};
use tryon_geometry::math::V3;
use tryon_geometry::par::{self, Par};
use tryon_tracking::part_classes::PART_CLASSES;
use tryon_tracking::segment::part_network::{CROP_SIDE, PersonCells, PersonCrop};

/// Steps of a picture's depth in one side of its window.
pub const DEPTH_STEPS: f32 = 8192.0;
/// Depth of a pixel without a reading of the person.
pub const NO_DEPTH: i16 = i16::MIN;
/// People rendered at a time; their records are in memory together.
const BATCH: usize = 64;

impl LabelledFrames {
    /// Writes the records of so many people. Each record, little-endian: depth `i16` `[side × side]` in [`DEPTH_STEPS`] of the
    /// window's side ([`NO_DEPTH`] without a reading), class `u8` `[side × side]` ([`NO_CLASS`] where unknown, the number of
    /// classes where it isn't the person), then `f32`: window coordinates and 1 (0 behind the camera) of each class's anchor
    /// `[classes × 4]`, yaw in radians (NaN for one who lies), the window's side in metres. The same bytes for any number of
    /// threads. `progress` gets the share done.
    ///
    /// # Errors
    /// Of the writer.
    pub fn write_crops(
        &self,
        people: u64,
        out: &mut impl Write,
        progress: &mut dyn FnMut(f64),
    ) -> io::Result<()> {
        let mut batch: Vec<Vec<u8>> = Vec::new();
        for start in (0..people).step_by(BATCH) {
            let count = (people - start).min(BATCH as u64);
            par::map_into(Par::Rayon, count as usize, 1, &mut batch, |i| {
                self.records(start + i as u64)
            });
            for records in &batch {
                out.write_all(records)?;
            }
            progress((start + count) as f64 / people as f64);
        }
        out.flush()
    }

    /// Records of one person.
    fn records(&self, person: u64) -> Vec<u8> {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed ^ person.rotate_left(20));
        let mut out = Vec::new();
        for frame in self.person(person) {
            let spread = self.settings.gravity_error.to_radians();
            let normal: [f32; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            let error = V3::from(normal) * if rng.random_bool(0.5) { spread } else { 0.0 };
            let up = (frame.up + error).normalize();
            self.append_record(&frame, up, &mut out);
        }
        out
    }

    /// Appends the record of a frame seen with its gravity taken for `up`.
    fn append_record(&self, frame: &LabelledFrame, up: V3, out: &mut Vec<u8>) {
        let person = PersonCells {
            up,
            ..frame.person()
        };
        let Some(crop) = PersonCrop::new(&person) else {
            return;
        };
        let mut picture = Vec::new();
        crop.picture(&person, &mut picture);
        let pixels = CROP_SIDE * CROP_SIDE;
        let (depth, is_read) = picture.split_at(pixels);
        for (d, read) in depth.iter().zip(is_read) {
            let steps = if *read > 0.0 {
                // The cast saturates.
                ((d * DEPTH_STEPS).round() as i16).max(NO_DEPTH + 1)
            } else {
                NO_DEPTH
            };
            out.extend(steps.to_le_bytes());
        }
        let class = |pixel: usize| {
            let cell = crop.cell(&frame.cloud, pixel)? as u32;
            let k = frame.cells.binary_search(&cell).ok()?;
            Some(frame.labels[k])
        };
        out.extend((0..pixels).map(|i| class(i).unwrap_or(NO_CLASS)));
        for c in 0..PART_CLASSES as u8 {
            let anchor = self.classes.anchor_of(c, &frame.joints);
            let at = anchor.and_then(|a| crop.of_point(&frame.cloud, &a.cast::<f32>()));
            let row = at.map_or([0.0; 4], |[x, y, away]| [x, y, away, 1.0]);
            row.iter().for_each(|v: &f32| out.extend(v.to_le_bytes()));
        }
        let yaw = frame.yaw.map_or(f32::NAN, |y| y as f32);
        for v in [yaw, crop.metres] {
            out.extend(v.to_le_bytes());
        }
    }
}

/// Bytes of one record.
pub const RECORD_BYTES: usize = 3 * CROP_SIDE * CROP_SIDE + 4 * (4 * PART_CLASSES + 2);

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_geometry::math::P3;

    #[test]
    fn records_are_whole_and_joints_come_back_from_window_coordinates() {
        let frames = LabelledFrames::new(embedded::template(), 3);
        let mut bytes = Vec::new();
        frames
            .write_crops(3, &mut bytes, &mut |_| ())
            .expect("a vector");
        assert!(!bytes.is_empty() && bytes.len().is_multiple_of(RECORD_BYTES));
        for frame in frames.person(1) {
            let crop = PersonCrop::new(&frame.person()).expect("cells");
            for joint in &frame.joints {
                let joint: P3 = joint.cast();
                let Some(at) = crop.of_point(&frame.cloud, &joint) else {
                    continue;
                };
                let back = crop.point(&frame.cloud, at).expect("in front");
                assert!((back - joint).norm() < 1e-4, "{at:?}: {back} for {joint}");
            }
        }
    }
}
