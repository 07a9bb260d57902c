//! Client of the simulations of a cloth service: starts, follows and cancels them over lost connections; for the command line
//! and the compositor.

mod order;

use crate::auth::Connection;
use crate::client::{pauses, request};
use std::error::Error;
use tonic::{Code, Request, Status};
use tryon_proto::convert::WireError;
use tryon_proto::v1::cloth_service_client::ClothServiceClient;
use tryon_proto::v1::{
    CancelSimulationRequest, FollowSimulationRequest, FollowSimulationResponse,
    StartSimulationRequest, StartSimulationResponse,
};

pub use order::{FineFrame, FrameOrder};

/// Losses that a client of simulations gets over.
#[derive(Debug, Clone, Copy)]
pub struct LossPolicy {
    /// Tries to connect again without a message in between.
    pub tries: usize,
    /// True for the status of a lost connection; any other is the answer.
    pub is_lost: fn(&Status) -> bool,
    /// Message of the loss when a stream ends before the last frame; `None` where that is a cancelled simulation.
    pub cut: Option<&'static str>,
}

/// Fault that ends following.
#[derive(Debug)]
pub enum FollowError<E> {
    /// Error of the simulation, or a connection that stays lost.
    Service(Status),
    /// Fault of a message, or of its receiver.
    Receiver(E),
}

/// Simulations of one cloth service.
#[derive(Debug, Clone)]
pub struct SimulationClient {
    client: ClothServiceClient<Connection>,
    policy: LossPolicy,
}

impl SimulationClient {
    /// Client on a connection that takes messages up to `max_message` bytes.
    pub fn new(connection: Connection, max_message: usize, policy: LossPolicy) -> Self {
        let client = ClothServiceClient::new(connection).max_decoding_message_size(max_message);
        Self { client, policy }
    }

    /// Starts or continues a simulation; one try, since a repeated call would start another.
    ///
    /// # Errors
    /// Refusal of the service, with the field of the request at fault.
    pub async fn start(
        &self,
        wanted: Request<StartSimulationRequest>,
    ) -> Result<StartSimulationResponse, Status> {
        let started = self.client.clone().start_simulation(wanted).await?;
        Ok(started.into_inner())
    }

    /// Follows a simulation from the first missing frame on until it ends or `order` is whole. `receive` gets each message,
    /// checked, and its frame unless it is a step of a drape.
    ///
    /// # Errors
    /// The service's, a message's or the receiver's fault.
    pub async fn follow<E: From<WireError>>(
        &self,
        id: &str,
        order: &mut FrameOrder,
        mut receive: impl FnMut(&FollowSimulationResponse, Option<FineFrame>) -> Result<(), E>,
    ) -> Result<(), FollowError<E>> {
        let LossPolicy {
            tries,
            is_lost,
            cut,
        } = self.policy;
        let (mut waits, mut has_ended) = (pauses().take(tries), false);
        while !order.is_whole() {
            let mut has_message = false;
            let received = |message: &_, frame| {
                has_message = true;
                receive(message, frame)
            };
            let why = match (self.read(id, order, received).await, cut) {
                (Err(FollowError::Service(why)), _) => why,
                (Err(fault), _) => return Err(fault),
                (Ok(()), _) if order.is_whole() => return Ok(()),
                (Ok(()), Some(cut)) => Status::unavailable(cut),
                (Ok(()), None) => {
                    // The number of frames may have become known after the last one.
                    let may_be_whole = order.count() == 0 && order.next() > 0 && !has_ended;
                    if !may_be_whole {
                        return Ok(());
                    }
                    has_ended = true;
                    continue;
                }
            };
            let next = order.next();
            if why.code() == Code::InvalidArgument && order.count() == 0 && next > 0 {
                // No such frame: the last one has arrived.
                order.expect(next);
                return Ok(());
            }
            if has_message {
                waits = pauses().take(tries);
            }
            match waits.next().filter(|_| is_lost(&why)) {
                Some(pause) => tokio::time::sleep(pause).await,
                None => return Err(FollowError::Service(why)),
            }
        }
        Ok(())
    }

    /// Receives messages until the last frame, or the end of the stream.
    async fn read<E: From<WireError>>(
        &self,
        id: &str,
        order: &mut FrameOrder,
        mut receive: impl FnMut(&FollowSimulationResponse, Option<FineFrame>) -> Result<(), E>,
    ) -> Result<(), FollowError<E>> {
        let wanted = FollowSimulationRequest {
            simulation_id: id.to_owned(),
            first_frame: order.next(),
        };
        let stream = self.client.clone().follow_simulation(wanted).await;
        let mut stream = stream.map_err(FollowError::Service)?.into_inner();
        while !order.is_whole() {
            let Some(message) = stream.message().await.map_err(FollowError::Service)? else {
                break;
            };
            let frame = order.take(&message);
            let frame = frame.map_err(|why| FollowError::Receiver(why.into()))?;
            receive(&message, frame).map_err(FollowError::Receiver)?;
        }
        Ok(())
    }

    /// Ends a simulation after the frame in work, however long that takes.
    ///
    /// # Errors
    /// Refusal of the service, or a connection that stays lost.
    pub async fn cancel(&self, id: &str) -> Result<(), Status> {
        let LossPolicy { tries, is_lost, .. } = self.policy;
        let mut waits = pauses().take(tries);
        loop {
            let cancelled = self.client.clone().cancel_simulation(cancel(id)).await;
            let Err(why) = cancelled else {
                return Ok(());
            };
            let is_busy = why.code() == Code::DeadlineExceeded;
            if is_busy {
                waits = pauses().take(tries);
            }
            match waits.next().filter(|_| is_busy || is_lost(&why)) {
                Some(pause) => tokio::time::sleep(pause).await,
                None => return Err(why),
            }
        }
    }

    /// Asks for the end of a simulation that nobody follows any more; without an answer it runs on to its end.
    pub async fn abandon(&self, id: &str) {
        let mut client = self.client.clone();
        if let Err(why) = client.cancel_simulation(request(cancel(id))).await {
            tracing::debug!(why = why.message(), "a simulation may run on");
        }
    }
}

fn cancel(id: &str) -> CancelSimulationRequest {
    CancelSimulationRequest {
        simulation_id: id.to_owned(),
    }
}

/// True for UNAVAILABLE and for other ends of a connection, which are no answer of the service and have a cause on this side.
pub fn is_lost(why: &Status) -> bool {
    why.code() == Code::Unavailable || why.source().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_of_the_service_is_no_lost_connection() {
        let broken = std::io::Error::from(std::io::ErrorKind::ConnectionReset);
        assert!(is_lost(&Status::from_error(Box::new(broken))));
        assert!(is_lost(&Status::unavailable("away")));
        assert!(!is_lost(&Status::not_found("gone")) && !is_lost(&Status::unknown("why")));
    }
}
