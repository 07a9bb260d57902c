//! Client of the cloth service: starts, follows and cancels simulations over lost connections.

use super::intake::Intake;
use anyhow::{Result, anyhow};
use std::error::Error;
use std::time::Duration;
use tonic::{Code, Status};
use tryon_kit::auth::{Auth, Connection};
use tryon_kit::client::{channel, pauses, request};
use tryon_kit::config::Config;
use tryon_kit::identity::{Identity, check_url};
use tryon_kit::tls::Tls;
use tryon_proto::v1::cloth_service_client::ClothServiceClient;
use tryon_proto::v1::{
    CancelSimulationRequest, FollowSimulationRequest, StartSimulationRequest,
    StartSimulationResponse,
};

/// Tries to connect again without a message in between: ten seconds or more. A service that was started anew in this time has
/// forgotten its simulations, and says so.
const TRIES: usize = 20;
/// Largest message, bytes: eight garments with images of 4 MiB, and their finest topology.
const MAX_MESSAGE_BYTES: usize = 64 << 20;

/// Connection to the cloth service.
pub(super) struct SimulationClient {
    client: ClothServiceClient<Connection>,
    url: String,
}

impl SimulationClient {
    /// Connects on first use, with the credentials of the configuration. Runs on a runtime.
    ///
    /// # Errors
    /// Names the key of the configuration at fault.
    pub(super) fn connect(config: &Config) -> Result<Self> {
        let url = config.compositor.cloth.clone();
        check_url(config, "compositor.cloth", &url)?;
        let tls = Tls::inside(config, Identity::of(config, "fine", false)?.as_ref())?;
        let channel = channel(&url, &tls).map_err(anyhow::Error::msg)?;
        let connection = Auth::open(config, None)?.credentials().present(channel);
        let client = ClothServiceClient::new(connection);
        Ok(Self {
            client: client.max_decoding_message_size(MAX_MESSAGE_BYTES),
            url,
        })
    }

    /// Starts or continues a simulation; one try, since a repeated call would start another.
    ///
    /// # Errors
    /// Refusal of the service, with the field of the request at fault.
    pub(super) async fn start(
        &self,
        wanted: StartSimulationRequest,
    ) -> Result<StartSimulationResponse> {
        let started = self.client.clone().start_simulation(wanted).await;
        let started = started.map_err(|why| self.fault("StartSimulation", &why))?;
        Ok(started.into_inner())
    }

    /// Receives a simulation from the first missing frame on until it ends.
    ///
    /// # Errors
    /// Error of the simulation, a message that is at fault, or a connection that stays lost.
    pub(super) async fn follow(&self, id: &str, intake: &mut Intake<'_>) -> Result<()> {
        let (mut waits, mut has_ended) = (pauses().take(TRIES), false);
        while !intake.order().is_whole() {
            let known = intake.messages();
            let Err(why) = self.read(id, intake).await? else {
                let (next, count) = (intake.order().next(), intake.order().count());
                // The number of frames may have become known after the last one.
                let may_be_whole = count == 0 && next > 0 && !has_ended;
                if !may_be_whole {
                    return Ok(());
                }
                has_ended = true;
                continue;
            };
            let next = intake.order().next();
            if why.code() == Code::InvalidArgument && intake.order().count() == 0 && next > 0 {
                // No such frame: the last one has arrived.
                intake.order().expect(next);
                return Ok(());
            }
            if intake.messages() > known {
                waits = pauses().take(TRIES);
            }
            let wait = waits.next().filter(|_| is_lost(&why));
            pause(wait.ok_or_else(|| self.fault("FollowSimulation", &why))?).await;
        }
        Ok(())
    }

    /// Receives messages until the stream ends, by an error or without one.
    async fn read(&self, id: &str, intake: &mut Intake<'_>) -> Result<Result<(), Status>> {
        let wanted = FollowSimulationRequest {
            simulation_id: id.to_owned(),
            first_frame: intake.order().next(),
        };
        let mut stream = match self.client.clone().follow_simulation(wanted).await {
            Ok(stream) => stream.into_inner(),
            Err(why) => return Ok(Err(why)),
        };
        loop {
            match stream.message().await {
                Ok(Some(message)) => intake.take(&message)?,
                Ok(None) => return Ok(Ok(())),
                Err(why) => return Ok(Err(why)),
            }
        }
    }

    /// Ends a simulation after the frame in work, however long that takes.
    ///
    /// # Errors
    /// Refusal of the service, or a connection that stays lost.
    pub(super) async fn cancel(&self, id: &str) -> Result<()> {
        let mut waits = pauses().take(TRIES);
        loop {
            let cancelled = self.client.clone().cancel_simulation(cancel(id)).await;
            let Err(why) = cancelled else {
                return Ok(());
            };
            let is_busy = why.code() == Code::DeadlineExceeded;
            if is_busy {
                waits = pauses().take(TRIES);
            }
            let wait = waits.next().filter(|_| is_busy || is_lost(&why));
            pause(wait.ok_or_else(|| self.fault("CancelSimulation", &why))?).await;
        }
    }

    /// Asks for the end of a simulation that nobody follows any more; without an answer it runs on.
    pub(super) async fn abandon(&self, id: &str) {
        let mut client = self.client.clone();
        if let Err(why) = client.cancel_simulation(request(cancel(id))).await {
            tracing::debug!(why = why.message(), "a simulation may run on");
        }
    }

    fn fault(&self, call: &str, why: &Status) -> anyhow::Error {
        let code = code_name(why.code());
        let is_broken = why.source().is_some();
        let hint = if is_broken && self.url.starts_with("http://") {
            "; services with an identity speak TLS only: --config needs their identity.authority and an https URL"
        } else {
            ""
        };
        let causes = causes(why);
        anyhow!(
            "the cloth service at {}: {call}: {code}: {causes}{hint}",
            self.url
        )
    }
}

/// Message of a status, and its causes on this side.
fn causes(why: &Status) -> String {
    let mut text = why.message().to_owned();
    let mut cause = why.source();
    while let Some(inner) = cause {
        let inner_text = inner.to_string();
        if !text.ends_with(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        cause = inner.source();
    }
    text
}

fn cancel(id: &str) -> CancelSimulationRequest {
    CancelSimulationRequest {
        simulation_id: id.to_owned(),
    }
}

async fn pause(time: Duration) {
    tokio::time::sleep(time).await;
}

/// True for UNAVAILABLE and for other ends of a connection, which are no answer of the service and have a cause on this side.
fn is_lost(why: &Status) -> bool {
    why.code() == Code::Unavailable || why.source().is_some()
}

/// Name of a code as the protocol writes it.
fn code_name(code: Code) -> String {
    let mut name = String::new();
    for c in format!("{code:?}").chars() {
        if c.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.push(c.to_ascii_uppercase());
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_have_the_names_of_the_protocol() {
        assert_eq!(code_name(Code::InvalidArgument), "INVALID_ARGUMENT");
        assert_eq!(code_name(Code::NotFound), "NOT_FOUND");
    }

    #[test]
    fn an_answer_of_the_service_is_no_lost_connection() {
        let broken = std::io::Error::from(std::io::ErrorKind::ConnectionReset);
        assert!(is_lost(&Status::from_error(Box::new(broken))));
        assert!(is_lost(&Status::unavailable("away")));
        assert!(!is_lost(&Status::not_found("gone")) && !is_lost(&Status::unknown("why")));
    }
}
