//! Checkpoints: the state between two frames as bytes, exact to the bit.

use super::error::OfflineError;
use super::integrator::{MotionState, OfflineState};
use super::sleep::Sleep;
use super::step::OfflineSolver;
use tryon_geometry::math::V3d;

/// First bytes of a checkpoint; the digit is the version.
const MAGIC: &[u8; 8] = b"tryonoc2";

impl OfflineSolver<'_> {
    /// Bytes of the state after `frame`, little-endian.
    pub fn checkpoint(&self, frame: u64) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        let state = &self.state;
        let lengths = [state.now.x.len() as u64, state.obstacle[0].len() as u64];
        let has_earlier = u64::from(state.earlier.is_some());
        let steps = [u64::from(self.level), u64::from(self.calm_steps)];
        for n in [
            frame,
            lengths[0],
            lengths[1],
            has_earlier,
            steps[0],
            steps[1],
        ] {
            out.extend(n.to_le_bytes());
        }
        let before = state.earlier.as_ref().map_or(0.0, |(_, h)| *h);
        for x in [state.time, before, self.sleep.since] {
            out.extend(x.to_le_bytes());
        }
        out.extend(self.sleep.still.iter().flat_map(|t| t.to_le_bytes()));
        let earlier = state.earlier.iter().flat_map(|(s, _)| [&s.x, &s.v]);
        let arrays = [&state.now.x, &state.now.v].into_iter().chain(earlier);
        for array in arrays.chain(&state.obstacle).chain([&self.sleep.places]) {
            out.extend(
                array
                    .iter()
                    .flat_map(|p| p.iter().flat_map(|c| c.to_le_bytes())),
            );
        }
        out.extend(checksum(&out).to_le_bytes());
        out
    }

    /// Takes over the state of a checkpoint of the same cloth and obstacle; returns its frame.
    ///
    /// # Errors
    /// Bytes that are no checkpoint, are damaged, or belong to other meshes; the state is then as it was.
    pub fn resume(&mut self, bytes: &[u8]) -> Result<u64, OfflineError> {
        let saved = Checkpoint::read(bytes)?;
        let lengths = |s: &OfflineState| [s.now.x.len(), s.obstacle[0].len()];
        if lengths(&saved.state) != lengths(&self.state) {
            return Err(fault("another cloth or obstacle"));
        }
        (self.state, self.sleep) = (saved.state, saved.sleep);
        self.level = saved.level;
        self.calm_steps = saved.calm_steps;
        Ok(saved.frame)
    }
}

/// Contents of a checkpoint.
struct Checkpoint {
    frame: u64,
    level: u32,
    calm_steps: u32,
    state: OfflineState,
    sleep: Sleep,
}

impl Checkpoint {
    fn read(bytes: &[u8]) -> Result<Self, OfflineError> {
        let mut reader = Reader(contents(bytes)?);
        let mut head = [0; 6];
        for n in &mut head {
            *n = u64::from_le_bytes(reader.next().ok_or_else(|| fault("too short"))?);
        }
        let [frame, n, m, has_earlier, level, calm] = head;
        let state = reader
            .state([n as usize, m as usize], has_earlier == 1)
            .filter(|_| reader.0.is_empty());
        let (state, sleep) =
            state.ok_or_else(|| fault("wrong length, or a number that is not finite"))?;
        Ok(Self {
            frame,
            level: level as u32,
            calm_steps: calm as u32,
            state,
            sleep,
        })
    }
}

/// State of a checkpoint.
///
/// # Errors
/// Bytes that are no checkpoint or are damaged.
pub fn checkpoint_state(bytes: &[u8]) -> Result<OfflineState, OfflineError> {
    Checkpoint::read(bytes).map(|c| c.state)
}

/// Frame after which a checkpoint was taken.
///
/// # Errors
/// Bytes that are no checkpoint or are damaged.
pub fn checkpoint_frame(bytes: &[u8]) -> Result<u64, OfflineError> {
    let frame = Reader(contents(bytes)?).next();
    frame
        .map(u64::from_le_bytes)
        .ok_or_else(|| fault("too short"))
}

fn fault(why: &str) -> OfflineError {
    OfflineError::Checkpoint(why.to_owned())
}

/// Bytes between the format's name and the checksum, which holds.
fn contents(bytes: &[u8]) -> Result<&[u8], OfflineError> {
    let (body, sum) = bytes
        .split_last_chunk::<8>()
        .ok_or_else(|| fault("too short"))?;
    if u64::from_le_bytes(*sum) != checksum(body) {
        return Err(fault("damaged"));
    }
    body.strip_prefix(MAGIC)
        .ok_or_else(|| fault("another format"))
}

/// FNV-1a.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// Bytes that are left.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn next(&mut self) -> Option<[u8; 8]> {
        let (first, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(*first)
    }
    /// A finite number.
    fn number(&mut self) -> Option<f64> {
        let value = self.next().map(f64::from_le_bytes);
        value.filter(|x| x.is_finite())
    }
    fn numbers(&mut self, count: usize) -> Option<Vec<f64>> {
        if self.0.len() < count.checked_mul(8)? {
            return None;
        }
        (0..count).map(|_| self.number()).collect()
    }
    fn vectors(&mut self, count: usize) -> Option<Vec<V3d>> {
        if self.0.len() < count.checked_mul(24)? {
            return None;
        }
        (0..count)
            .map(|_| Some(V3d::new(self.number()?, self.number()?, self.number()?)))
            .collect()
    }
    fn motion(&mut self, count: usize) -> Option<MotionState> {
        Some(MotionState {
            x: self.vectors(count)?,
            v: self.vectors(count)?,
        })
    }
    /// State of `n` vertices of cloth and `m` of the obstacle.
    fn state(&mut self, [n, m]: [usize; 2], has_earlier: bool) -> Option<(OfflineState, Sleep)> {
        let (time, before) = (self.number()?, self.number()?);
        let since = self.number()?;
        let all = n.checked_add(m)?;
        let still = self.numbers(all)?;
        let now = self.motion(n)?;
        let earlier = if has_earlier {
            Some((self.motion(n)?, before))
        } else {
            None
        };
        let state = OfflineState {
            time,
            now,
            earlier,
            obstacle: [self.vectors(m)?, self.vectors(m)?],
        };
        let sleep = Sleep {
            places: self.vectors(all)?,
            still,
            since,
            ..Sleep::default()
        };
        Some((state, sleep))
    }
}
