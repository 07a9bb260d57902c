//! The graphics card shared by all try-ons; the processor takes over without one or when it fails.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use tryon::geometry::camera::ColorImage;
use tryon::view::gpu::{GpuError, Prefer, Renderer, choose};
use tryon::view::{Input, Model, RenderError, RenderReport, State, Workspace, render};
use tryon_kit::config::RendererChoice;

/// Renderer of all pictures. Clones share the card; the last one dropped waits for the end of the search.
#[derive(Clone, Default)]
pub(crate) struct Card {
    slot: Slot,
    search: Option<Arc<Search>>,
}

type Slot = Arc<Mutex<Option<Renderer>>>;

/// Thread that searches for a card, joined on drop. A process that exits while a driver loads runs the driver's
/// destructors beside its constructors, and aborts (LLVM: "Option registered more than once").
struct Search(Option<JoinHandle<()>>);

impl Drop for Search {
    fn drop(&mut self) {
        if self.0.take().is_some_and(|search| search.join().is_err()) {
            tracing::warn!("the search for a graphics card panicked");
        }
    }
}

impl Card {
    /// Opens what the configuration asks for. With `auto` the search runs beside the start, and pictures come from the
    /// processor until it is done.
    ///
    /// # Errors
    /// With `gpu`, when there is no adapter or its driver refuses.
    pub(crate) fn open(choice: RendererChoice) -> Result<Self, GpuError> {
        let mut card = Self::default();
        match choice {
            RendererChoice::Cpu => {}
            RendererChoice::Gpu => put(&card.slot, choose(Prefer::Gpu)?),
            RendererChoice::Auto => {
                let slot = card.slot.clone();
                let search = move || match choose(Prefer::Auto) {
                    Ok(found) => put(&slot, found),
                    Err(e) => tracing::warn!(error = %e, "no graphics card"),
                };
                match std::thread::Builder::new()
                    .name("graphics".into())
                    .spawn(search)
                {
                    Ok(thread) => card.search = Some(Arc::new(Search(Some(thread)))),
                    Err(e) => tracing::warn!(error = %e, "no thread to look for a graphics card"),
                }
            }
        }
        Ok(card)
    }

    /// Renders one picture. After a failure of the card the processor renders this and all later pictures.
    pub(crate) fn draw(
        &self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
    ) -> Result<(ColorImage, RenderReport), RenderError> {
        let mut slot = lock(&self.slot);
        if let Some(renderer) = slot.as_mut() {
            match renderer.render(model, state, input, work) {
                Err(RenderError::Graphics(why)) => {
                    tracing::warn!(
                        why,
                        "the graphics card failed: drawing on the processor from now on"
                    );
                    metrics::counter!("tryon_compositor_card_failures_total").increment(1);
                    *slot = None;
                }
                done => return done,
            }
        }
        // Only the card is exclusive: processors render side by side.
        drop(slot);
        render(model, state, input, work)
    }
}

fn lock(slot: &Slot) -> MutexGuard<'_, Option<Renderer>> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

fn put(slot: &Slot, found: Option<Renderer>) {
    match &found {
        Some(r) => tracing::info!(
            adapter = r.adapter().name,
            backend = r.adapter().backend,
            "drawing on the card"
        ),
        None => tracing::info!("no graphics card: drawing on the processor"),
    }
    *lock(slot) = found;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn the_last_clone_waits_for_the_search() {
        let ended = Arc::new(AtomicBool::new(false));
        let seen = ended.clone();
        let (never, wait) = std::sync::mpsc::channel::<()>();
        let slow = std::thread::spawn(move || {
            wait.recv_timeout(std::time::Duration::from_millis(50)).ok();
            seen.store(true, Ordering::SeqCst);
        });
        let card = Card {
            slot: Slot::default(),
            search: Some(Arc::new(Search(Some(slow)))),
        };
        let other = card.clone();
        drop(card);
        assert!(!ended.load(Ordering::SeqCst), "only the last one waits");
        drop(other);
        assert!(ended.load(Ordering::SeqCst));
        drop(never);
    }
}
