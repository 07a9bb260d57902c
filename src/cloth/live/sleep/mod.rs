//! Sleep of still cloth: the whole outfit, or islands of it while others move.

pub(crate) mod criteria;
mod follow_skin;
pub(super) mod island_model;
pub(crate) mod islands;
mod outfit;
mod state;
pub(crate) mod wake_source;

pub(super) use criteria::is_body_still;
pub(super) use islands::{BodyStep, follow_sleeping, put_islands_to_sleep, wake_islands};
pub(super) use outfit::{follow_asleep, update_stillness};
pub(super) use state::SleepState;
