//! Positions of a moving mesh on the wire: quantised to 0.2 mm, predicted at both ends, then zstd.
//!
//! Prediction: constant velocity (order 2), the last position (order 1), or none (order 0, a keyframe). Residuals of
//! neighbours are similar, so the code is the difference of a vertex's residual to that of a neighbour. All arithmetic
//! is on integers: errors do not accumulate.
//!
//! Layout: one byte with the order; one zstd frame of LEB128 numbers, zigzag-coded, all x, then all y, then all z.

use super::FormatError;
use std::path::Path;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

/// Quantisation step of the coded positions, metres; decoded vertices are within half of it along each axis.
pub const STEP: f64 = 2e-4;
/// Largest coordinate, metres: beyond it f32 does not resolve a step.
const FARTHEST: f32 = 1e3;
/// Zstd's fastest regular level.
const LEVEL: i32 = 1;
/// Most bytes of one LEB128 number of 32 bits.
const LONGEST: usize = 5;
/// Origin in errors.
const BYTES: &str = "position bytes";

/// Position in steps.
type Steps = [i32; 3];

/// One end of a stream of positions of one mesh. Both ends start anew with each keyframe.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PositionCoder {
    /// Neighbour with a smaller index, whose residual is the prediction; the vertex itself if there is none.
    neighbour: Vec<u32>,
    /// Up to two last positions, newest first.
    past: Vec<Vec<Steps>>,
}

impl PositionCoder {
    /// Coder of a mesh of `vertices` vertices; faces with an index out of range are ignored.
    pub fn new(vertices: usize, faces: &[Face]) -> Self {
        let mut neighbour: Vec<u32> = (0..vertices as u32).collect();
        for f in faces
            .iter()
            .filter(|f| f.iter().all(|&i| (i as usize) < vertices))
        {
            for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
                let (low, high) = (a.min(b), a.max(b));
                let n = &mut neighbour[high as usize];
                *n = (*n).min(low);
            }
        }
        Self {
            neighbour,
            past: Vec::new(),
        }
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.neighbour.len()
    }

    /// Codes the next positions, metres, shape `[vertices]`.
    ///
    /// # Errors
    /// Names the vertex that is not finite or too far away, or the wrong count; the stream can continue.
    pub fn encode(&mut self, positions: &[P3]) -> Result<Vec<u8>, FormatError> {
        let fault = |field: String, why: String| FormatError::field(Path::new(BYTES), field, why);
        if positions.len() != self.vertices() {
            return Err(fault(
                "vertices".into(),
                format!("{} for a mesh of {}", positions.len(), self.vertices()),
            ));
        }
        let mut steps = Vec::with_capacity(positions.len());
        for (i, p) in positions.iter().enumerate() {
            if !p.iter().all(|c| c.abs() <= FARTHEST) {
                return Err(fault(
                    format!("vertex {i}"),
                    format!("{p}: not within {FARTHEST} m"),
                ));
            }
            steps.push(std::array::from_fn(|k| {
                (f64::from(p[k]) / STEP).round() as i32
            }));
        }
        let (order, differences) = (0..=self.past.len())
            .map(|order| (order, self.differences(&steps, order)))
            .min_by_key(|(_, d)| d.iter().map(|d| u64::from(d.unsigned_abs())).sum::<u64>())
            .unwrap_or_default();
        let mut numbers = Vec::with_capacity(differences.len() * 2);
        for d in differences {
            let mut z = ((d << 1) ^ (d >> 31)) as u32;
            while z > 0x7f {
                numbers.push(z as u8 | 0x80);
                z >>= 7;
            }
            numbers.push(z as u8);
        }
        let mut out = vec![0; 1 + zstd::zstd_safe::compress_bound(numbers.len())];
        out[0] = order as u8;
        // The buffer has zstd's own bound, so only out of memory can fail; decoding then reports it.
        let written = zstd::bulk::compress_to_buffer(&numbers, &mut out[1..], LEVEL).unwrap_or(0);
        out.truncate(1 + written);
        self.remember(steps);
        Ok(out)
    }

    /// Decodes positions, within half a [`STEP`] along each axis.
    ///
    /// # Errors
    /// Damaged or missing data, or data predicted from positions that were never received; the stream cannot continue.
    pub fn decode(&mut self, bytes: &[u8]) -> Result<Vec<P3>, FormatError> {
        let fault = |field: &str, why: String| FormatError::field(Path::new(BYTES), field, why);
        let Some((&order, data)) = bytes.split_first() else {
            return Err(fault("order", "is missing".into()));
        };
        let order = usize::from(order);
        if order > self.past.len() {
            let why = format!(
                "{order} earlier positions are needed, {} are known",
                self.past.len()
            );
            return Err(fault("order", why));
        }
        let n = self.vertices();
        let numbers = zstd::bulk::decompress(data, 3 * n * LONGEST)
            .map_err(|e| fault("data", format!("damaged, cut short or too long ({e})")))?;
        let mut numbers = numbers.into_iter();
        let mut steps = vec![[0; 3]; n];
        let mut residual = vec![[0i32; 3]; n];
        for k in 0..3 {
            for i in 0..n {
                let z = leb128(&mut numbers)
                    .ok_or_else(|| fault("data", format!("vertex {i}: no number")))?;
                let d = (z >> 1) as i32 ^ -((z & 1) as i32);
                let nb = self.neighbour[i] as usize;
                residual[i][k] = if nb == i {
                    d
                } else {
                    d.wrapping_add(residual[nb][k])
                };
                steps[i][k] = residual[i][k].wrapping_add(self.predicted(i, k, order));
            }
        }
        if numbers.next().is_some() {
            return Err(fault("data", format!("more than {n} vertices")));
        }
        let positions = steps
            .iter()
            .map(|s| P3::from(s.map(|c| (f64::from(c) * STEP) as f32)))
            .collect();
        self.remember(steps);
        Ok(positions)
    }

    /// Predicted coordinate `k` of vertex `i`, steps.
    fn predicted(&self, i: usize, k: usize, order: usize) -> i32 {
        match (order, self.past.first(), self.past.get(1)) {
            (1, Some(last), _) => last[i][k],
            (2, Some(last), Some(before)) => last[i][k].wrapping_mul(2).wrapping_sub(before[i][k]),
            _ => 0,
        }
    }

    /// Residuals less those of the neighbours, all x, then y, then z.
    fn differences(&self, steps: &[Steps], order: usize) -> Vec<i32> {
        let residual = |i: usize, k: usize| steps[i][k].wrapping_sub(self.predicted(i, k, order));
        let mut out = Vec::with_capacity(3 * steps.len());
        for k in 0..3 {
            for (i, &nb) in self.neighbour.iter().enumerate() {
                let nb = nb as usize;
                out.push(if nb == i {
                    residual(i, k)
                } else {
                    residual(i, k).wrapping_sub(residual(nb, k))
                });
            }
        }
        out
    }

    fn remember(&mut self, steps: Vec<Steps>) {
        self.past.truncate(1);
        self.past.insert(0, steps);
    }
}

/// Next LEB128 number; `None` if it is missing or too long.
fn leb128(bytes: &mut impl Iterator<Item = u8>) -> Option<u32> {
    let mut value = 0;
    for shift in (0..LONGEST).map(|i| 7 * i) {
        let b = bytes.next()?;
        value |= u32::from(b & 0x7f).checked_shl(shift as u32)?;
        if b < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A strip of two rows.
    fn strip(n: u32) -> Vec<Face> {
        (0..n - 1)
            .flat_map(|i| {
                [
                    [2 * i, 2 * i + 1, 2 * i + 2],
                    [2 * i + 1, 2 * i + 3, 2 * i + 2],
                ]
            })
            .collect()
    }

    fn waving(n: u32, t: f64) -> Vec<P3> {
        let point = |i: u32| {
            let (u, v) = (f64::from(i / 2) * 0.02, f64::from(i % 2) * 0.02);
            P3::new(
                u as f32,
                (v + 1.0) as f32,
                (0.1 * (7.0 * u - 4.0 * t).sin()) as f32,
            )
        };
        (0..2 * n).map(point).collect()
    }

    #[test]
    fn decoded_positions_are_within_half_a_step_and_code_is_small() {
        let (n, faces) = (500, strip(500));
        let (mut tx, mut rx) = (
            PositionCoder::new(1000, &faces),
            PositionCoder::new(1000, &faces),
        );
        let mut sizes = Vec::new();
        for frame in 0..60 {
            let p = waving(n, f64::from(frame) / 30.0);
            let bytes = tx.encode(&p).expect("coded");
            let q = rx.decode(&bytes).expect("decoded");
            let worst = p
                .iter()
                .zip(&q)
                .map(|(p, q)| (p - q).amax())
                .fold(0.0, f32::max);
            assert!(
                f64::from(worst) <= 0.5 * STEP + 1e-6,
                "frame {frame}: {worst} m"
            );
            sizes.push(bytes.len());
        }
        assert_eq!(tx, rx, "both ends have the same state");
        let later = sizes[2..].iter().sum::<usize>() as f64 / (58.0 * 1000.0);
        assert!(
            later < 2.0 && sizes[0] < 4000,
            "{later} bytes a vertex, the first {}",
            sizes[0]
        );
        // A still mesh costs next to nothing.
        let p = waving(n, 2.0);
        tx.encode(&p).expect("coded");
        assert!(tx.encode(&p).expect("coded").len() < 40);
    }

    #[test]
    fn faults_are_named() {
        let mut c = PositionCoder::new(2, &[]);
        let far = [P3::origin(), P3::new(0.0, f32::NAN, 0.0)];
        assert!(
            c.encode(&far)
                .expect_err("refused")
                .to_string()
                .contains("vertex 1")
        );
        assert!(
            c.encode(&far[..1])
                .expect_err("refused")
                .to_string()
                .contains("vertices")
        );
        let (mut tx, mut late) = (PositionCoder::new(2, &[]), PositionCoder::new(2, &[]));
        let p = [P3::origin(), P3::new(0.5, 0.5, 0.5)];
        let first = tx.encode(&p).expect("coded");
        let second = tx.encode(&p).expect("coded");
        assert!(
            late.decode(&second)
                .expect_err("no keyframe")
                .to_string()
                .contains("order")
        );
        assert!(late.decode(&first[..first.len() - 2]).is_err());
        assert!(late.decode(&[]).is_err());
        assert!(
            PositionCoder::new(1, &[]).decode(&first).is_err(),
            "too many numbers"
        );
        assert!(
            PositionCoder::new(3, &[]).decode(&first).is_err(),
            "too few numbers"
        );
    }

    proptest! {
        #[test]
        fn finite_positions_survive_the_round_trip(jumps in prop::collection::vec(prop::collection::vec(-900f32..900.0, 12), 1..6)) {
            let faces = [[0, 1, 2], [1, 3, 2]];
            let (mut tx, mut rx) = (PositionCoder::new(4, &faces), PositionCoder::new(4, &faces));
            for j in jumps {
                let p: Vec<P3> = j.chunks(3).map(|c| P3::new(c[0], c[1], c[2])).collect();
                let q = rx.decode(&tx.encode(&p).expect("coded")).expect("decoded");
                for (p, q) in p.iter().zip(&q) {
                    prop_assert!((p - q).amax() <= 2e-4);
                }
            }
        }

        #[test]
        fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = PositionCoder::new(7, &[[0, 1, 2], [4, 5, 6]]).decode(&bytes);
        }
    }
}
