//! Poses of a scanned subject over time.

use nalgebra::UnitQuaternion;
use tryon_body::Pose;
use tryon_formats::MotionClip;
use tryon_geometry::math::{P3d, Rigid, V3d, World};
use tryon_synth::{Actor, ClipError, Routine, Sequence, Setting};

/// Motion of a scanned subject.
#[derive(Clone, Debug, PartialEq)]
pub enum ScanMotion {
    /// Synthetic routine from a time on; [`Routine::Hold`] for a posture held.
    Play {
        /// Routine.
        routine: Routine,
        /// Time in the routine at the first scan (s).
        start: f64,
    },
    /// Turn about the vertical while a routine plays: limbs and trunk move too.
    Turn {
        /// Routine.
        routine: Routine,
        /// Time in the routine at the first scan (s).
        start: f64,
        /// Time from the first scan to the begin of the turn (s).
        delay: f64,
        /// Angular velocity, counter-clockwise seen from above (rad/s).
        speed: f64,
    },
    /// Recorded motion.
    Clip {
        /// Joints over time.
        clip: Box<MotionClip>,
        /// Time in the clip at the first scan (s).
        start: f64,
    },
}

impl Default for ScanMotion {
    /// The try-on routine from its lowered arms on.
    fn default() -> Self {
        Self::Play {
            routine: Routine::TryOn,
            start: 2.6,
        }
    }
}

/// Poses at a fixed rate.
pub(super) struct PoseTrack {
    sequence: Sequence,
    /// Frame of the sequence at the first pose.
    first: u64,
    /// Turn between two poses (rad).
    turn: f64,
    /// Poses before the turn begins.
    delay: f64,
}

impl PoseTrack {
    /// Poses of an actor at `rate` (1/s).
    pub(super) fn new(actor: &Actor, motion: &ScanMotion, rate: f64) -> Result<Self, ClipError> {
        let routine = match motion {
            ScanMotion::Play { routine, .. } | ScanMotion::Turn { routine, .. } => *routine,
            ScanMotion::Clip { .. } => Routine::Still,
        };
        let setting = Setting {
            world_from_camera: Rigid::identity(),
            home: P3d::origin(),
            room: None,
            routine,
            rate,
            color: false,
            ..Setting::default()
        };
        let mut sequence = Sequence::new(actor.clone(), setting);
        let (start, delay, speed) = match motion {
            ScanMotion::Play { start, .. } => (*start, 0.0, 0.0),
            ScanMotion::Turn {
                start,
                delay,
                speed,
                ..
            } => (*start, *delay, *speed),
            ScanMotion::Clip { clip, start } => {
                sequence = sequence.with_clip((**clip).clone())?;
                (sequence.clip_lead() + start, 0.0, 0.0)
            }
        };
        Ok(Self {
            sequence,
            first: (start * rate).round().max(0.0) as u64,
            turn: speed / rate,
            delay: delay * rate,
        })
    }

    /// Pose number `index` in the world: y up, floor at y = 0.
    pub(super) fn pose(&self, index: u64) -> Pose<World> {
        let truth = self.sequence.truth(self.first + index);
        let turn = UnitQuaternion::from_axis_angle(
            &V3d::y_axis(),
            self.turn * (index as f64 - self.delay).max(0.0),
        );
        // The camera of the sequence is the world itself.
        let turned: Rigid<World, tryon_geometry::math::Camera> =
            Rigid::from_parts(V3d::zeros(), turn);
        Pose {
            root: turned * truth.pose.root,
            angles: truth.pose.angles,
        }
    }
}
