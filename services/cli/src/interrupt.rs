//! Ctrl-C in a long computation: the first ends it after the frame in work, the second at once.

use anyhow::{Context, Result};
use std::process::exit;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use tryon_kit::drain;

/// Exit code after Ctrl-C, as shells report it.
pub(crate) const INTERRUPTED: u8 = 130;

/// Time after a signal in which another is the same request: `timeout` sends two.
const REPEAT: Duration = Duration::from_millis(500);

/// Request to end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interrupt(CancellationToken);

impl Interrupt {
    /// Waits for signals in a thread of its own, for the rest of the process.
    ///
    /// # Errors
    /// When the system refuses the thread or the handlers.
    pub(crate) fn watch() -> Result<Self> {
        let interrupt = Self::default();
        let asked = interrupt.clone();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("signals")?;
        let wait = move || runtime.block_on(asked.wait());
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(wait)
            .context("signals")?;
        Ok(interrupt)
    }

    /// Marks the first signal, ends the process at the second.
    #[expect(
        clippy::disallowed_methods,
        reason = "who asks twice does not wait for the frame in work"
    )]
    async fn wait(self) {
        if drain::signal().await.is_err() {
            return;
        }
        eprintln!("tryon: ending after this frame; once more to end now");
        self.0.cancel();
        tokio::time::sleep(REPEAT).await;
        if drain::signal().await.is_ok() {
            exit(i32::from(INTERRUPTED));
        }
    }

    /// True once asked for.
    pub(crate) fn is_asked(&self) -> bool {
        self.0.is_cancelled()
    }

    /// Waits until asked for.
    pub(crate) async fn asked(&self) {
        self.0.cancelled().await;
    }
}
