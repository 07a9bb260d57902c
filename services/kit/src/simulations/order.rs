//! Order of the frames of a simulation: each arrives once, after the one before it.

use tryon_geometry::math::P3;
use tryon_proto::convert::simulation::positions_from_wire;
use tryon_proto::convert::{WireError, required};
use tryon_proto::v1::{FollowSimulationResponse, FrameId};

/// A finished frame of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct FineFrame {
    /// Vertices of all garments (m, world).
    pub positions: Vec<P3>,
    /// The exposure whose body the frame follows.
    pub exposure: FrameId,
    /// Computing time in the service (ms).
    pub ms: f32,
}

/// Frames that have arrived, and that are still to come.
#[derive(Debug, Clone)]
pub struct FrameOrder {
    vertices: usize,
    next: u32,
    count: u32,
}

impl FrameOrder {
    /// Frames from `next` on, of so many vertices; their number is not known.
    pub fn new(vertices: usize, next: u32) -> Self {
        let count = 0;
        Self {
            vertices,
            next,
            count,
        }
    }

    /// The frame of a message; `None` for a step of a drape.
    ///
    /// # Errors
    /// Names the field of the message at fault, `frame` for one that is not the next.
    pub fn take(
        &mut self,
        message: &FollowSimulationResponse,
    ) -> Result<Option<FineFrame>, WireError> {
        self.expect(message.frame_count);
        let Some(positions) = positions_from_wire(message, self.vertices)? else {
            return Ok(None);
        };
        let fault = |field: &str, why: String| {
            let field = format!("follow_simulation_response.{field}");
            Err(WireError::new(field, why))
        };
        if message.frame != self.next {
            let why = format!("{}, but frame {} is next", message.frame, self.next);
            return fault("frame", why);
        }
        if !message.ms.is_finite() {
            return fault("ms", "is not finite".into());
        }
        let field = "follow_simulation_response.exposure";
        let exposure = required(message.exposure, field)?;
        self.next = self.next.saturating_add(1);
        Ok(Some(FineFrame {
            positions,
            exposure,
            ms: message.ms,
        }))
    }

    /// Number of frames of the simulation; 0 changes nothing.
    pub fn expect(&mut self, count: u32) {
        if count > 0 {
            self.count = count;
        }
    }

    /// The first frame that is missing.
    pub fn next(&self) -> u32 {
        self.next
    }

    /// Number of frames of the simulation; 0 while the body is being recorded.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// True once the last frame has arrived.
    pub fn is_whole(&self) -> bool {
        self.count > 0 && self.next >= self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Message of a frame of one vertex at (`x`, 0, 0), exposed after `frame` tenths of a second.
    fn message(frame: u32, x: f32) -> FollowSimulationResponse {
        let positions: Vec<u8> = [x, 0.0, 0.0]
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect();
        FollowSimulationResponse {
            frame,
            positions: positions.into(),
            ms: 5.0,
            exposure: Some(FrameId {
                capture_time_ns: 100_000_000 * u64::from(frame),
                ..Default::default()
            }),
            ..Default::default()
        }
    }

    #[test]
    fn frames_are_taken_in_order_until_the_last() {
        let mut order = FrameOrder::new(1, 0);
        let step = FollowSimulationResponse::default();
        assert_eq!(order.take(&step).expect("a step"), None);
        let first = order.take(&message(0, 7.0)).expect("valid");
        let first = first.expect("a frame");
        assert_eq!((first.positions[0].x, order.next()), (7.0, 1));
        assert!(!order.is_whole(), "their number is not known");
        let last = FollowSimulationResponse {
            frame_count: 2,
            ..message(1, 8.0)
        };
        assert!(order.take(&last).expect("valid").is_some() && order.is_whole());
        order.expect(0);
        assert_eq!(order.count(), 2);
    }

    #[test]
    fn faults_of_messages_name_their_field_and_take_nothing() {
        let mut order = FrameOrder::new(1, 3);
        let mut named = |m: &FollowSimulationResponse| {
            let fault = order.take(m).expect_err("refused");
            assert_eq!(order.next(), 3);
            let field = fault.field.strip_prefix("follow_simulation_response.");
            field.map(str::to_owned)
        };
        for frame in [2, 4] {
            assert_eq!(named(&message(frame, 0.0)).as_deref(), Some("frame"));
        }
        let mut cut = message(3, 0.0);
        cut.positions.truncate(8);
        assert_eq!(named(&cut).as_deref(), Some("positions"));
        let nan = FollowSimulationResponse {
            ms: f32::NAN,
            ..message(3, 0.0)
        };
        assert_eq!(named(&nan).as_deref(), Some("ms"));
        let nowhere = FollowSimulationResponse {
            exposure: None,
            ..message(3, 0.0)
        };
        assert_eq!(named(&nowhere).as_deref(), Some("exposure"));
    }
}
