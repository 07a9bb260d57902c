//! Parts that every process shares: configuration, logs and metrics, the bus, queues with a policy, the compute pool,
//! servers, reconnecting clients, and a shutdown with a deadline.
//!
//! # Ideas
//!
//! - Never dropped: [`mod@queue::ordered`].
//! - Newest frame wins: [`mod@queue::latest`].
//! - Bus: [`mod@bus`].
//! - Order: [`mod@frame_order`].
//! - Stalls: [`mod@flow`].
//! - Traces of frames: [`mod@frame_trace`].
//! - Systemd's notifications: [`mod@supervisor`].
//! - Reconnection: [`mod@client`].
//! - Server limits: [`mod@server`].
//! - HTTP: [`mod@transport`], [`mod@connections`].
//! - TLS: [`mod@tls`].
//! - Identity of services: [`mod@identity`].
//! - Pace of readers: [`mod@queue::pace`].
//! - Who may call: [`mod@auth`], its gate `gate.rs`.
//! - Shutdown with a deadline: [`mod@drain`].
//! - Configuration: [`mod@config`].
//! - Metrics, logs: [`mod@telemetry`], [`mod@admin`], [`mod@log_fields`].
//! - No core dumps: [`mod@core_dump`].
//! - Computation off async workers: [`mod@compute`].
//! - A body that outlives restarts: [`mod@remembered_body`].
//! - Simulations of a cloth service, followed: [`mod@simulations`].
//! - Sealed frames: [`mod@seal`].
//! - Zeroed memory: [`mod@forget`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub mod admin;
pub mod auth;
pub mod behind;
pub mod bodies;
pub mod bus;
mod call_rate;
pub mod client;
pub mod compute;
pub mod config;
mod connections;
pub mod consent;
pub mod core_dump;
mod deadline;
pub mod drain;
pub mod flow;
mod followed;
pub mod forget;
mod frame_order;
pub mod frame_trace;
pub mod frames;
pub mod hosts;
pub mod identity;
pub mod load;
mod log_fields;
mod neighbours;
mod peer_budget;
pub mod process;
pub mod queue;
pub mod remembered_body;
pub mod seal;
pub mod server;
pub mod session_task;
pub mod sessions;
pub mod simulations;
pub mod status;
pub mod supervisor;
pub mod telemetry;
pub mod tls;
mod transport;
mod undecodable;

pub use compute::Pool;
pub use config::Config;
pub use frames::{Exposure, FrameBus, LocalBus};
pub use server::{Context, Outcome, Running, StartError};
