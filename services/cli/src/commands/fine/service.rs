//! The cloth service of the configuration, with faults in the words of the command line.

use super::files::FineFiles;
use super::progress::FineProgress;
use anyhow::{Result, anyhow};
use std::error::Error;
use tonic::{Code, Request, Status};
use tryon_kit::auth::Auth;
use tryon_kit::client::channel;
use tryon_kit::config::Config;
use tryon_kit::identity::{Identity, check_url};
use tryon_kit::simulations::{
    FineFrame, FollowError, FrameOrder, LossPolicy, SimulationClient, is_lost,
};
use tryon_kit::tls::Tls;
use tryon_proto::v1::{StartSimulationRequest, StartSimulationResponse};

/// Tries to connect again without a message in between: ten seconds or more. A service that was started anew in this time has
/// forgotten its simulations, and says so.
const TRIES: usize = 20;
/// Largest message, bytes: eight garments with images of 4 MiB, and their finest topology.
const MAX_MESSAGE_BYTES: usize = 64 << 20;

/// Connection to the cloth service.
pub(super) struct FineService {
    simulations: SimulationClient,
    url: String,
}

impl FineService {
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
        let policy = LossPolicy {
            tries: TRIES,
            is_lost,
            cut: None,
        };
        let simulations = SimulationClient::new(connection, MAX_MESSAGE_BYTES, policy);
        Ok(Self { simulations, url })
    }

    /// Starts or continues a simulation; one try, since a repeated call would start another.
    ///
    /// # Errors
    /// Refusal of the service, with the field of the request at fault.
    pub(super) async fn start(
        &self,
        wanted: StartSimulationRequest,
    ) -> Result<StartSimulationResponse> {
        let started = self.simulations.start(Request::new(wanted)).await;
        started.map_err(|why| self.fault("StartSimulation", &why))
    }

    /// Follows a simulation from the first missing frame on until it ends: frames into the files, all messages onto the bar.
    ///
    /// # Errors
    /// Error of the simulation, a message that is at fault, a file that cannot be written, or a connection that stays lost.
    pub(super) async fn follow(
        &self,
        id: &str,
        order: &mut FrameOrder,
        files: &mut FineFiles,
        progress: &mut FineProgress,
    ) -> Result<()> {
        let receive = |message: &_, frame: Option<FineFrame>| -> Result<()> {
            if let Some(frame) = frame {
                files.push(&frame)?;
            }
            progress.show(message);
            Ok(())
        };
        let followed = self.simulations.follow(id, order, receive).await;
        followed.map_err(|fault| match fault {
            FollowError::Service(why) => self.fault("FollowSimulation", &why),
            FollowError::Receiver(why) => why,
        })
    }

    /// Ends a simulation after the frame in work, however long that takes.
    ///
    /// # Errors
    /// Refusal of the service, or a connection that stays lost.
    pub(super) async fn cancel(&self, id: &str) -> Result<()> {
        let cancelled = self.simulations.cancel(id).await;
        cancelled.map_err(|why| self.fault("CancelSimulation", &why))
    }

    /// Asks for the end of a simulation that nobody follows any more; without an answer it runs on.
    pub(super) async fn abandon(&self, id: &str) {
        self.simulations.abandon(id).await;
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
}
