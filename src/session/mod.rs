//! The life of one try-on as a pure transition table: Opening → Calibrating → Live ⇄ Degraded(why) → Draining → Closed.
//!
//! ```text
//!               Opened                     GarmentsOn
//!   Opening ───────────────► Calibrating ────────────► Live
//!      │                      ▲   │   ▲                │  │
//!      │ Failed(service,      │   │   └─── OutfitOff ──┘  │
//!      │        camera)       │   │ Failed(fault)         │ Failed(fault)
//!      ▼                      │   ▼                       ▼
//!   Degraded(fault) ──────────┴─ Degraded(fault) ◄────────┘
//!                  Opened, CameraBack, PersonFound: the event that answers the fault
//!                  GarmentsOn: straight to Live, for a fresh picture proves the whole chain
//!
//!   any of these ── Drain ──► Draining ── Drained ──► Closed          any ── Close ──► Closed
//! ```
//!
//! Services report events and act on the change of state; the table holds no clock and no handle. Faults are levels,
//! not edges: the observer repeats a fault while it lasts, so that one hidden by a worse fault surfaces afterwards.
//! Of two faults the one further upstream is reported, since it explains the other.

pub(crate) mod ages;
mod state;
pub(crate) mod table;

pub use ages::{Ages, SilenceLimits};
pub use state::{ChainStage, Event, Fault, State};
pub use table::transition;
