//! The graphics card, if a real one is there: shared by all try-ons, the processor takes over when it fails.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tryon::camera::ColorImage;
use tryon::composite::{Input, Model, RenderError, RenderReport, State, Workspace, render};
use tryon::gpu::{GpuError, Prefer, Renderer, choose};
use tryon_kit::config::RendererChoice;

/// Where pictures are drawn. Clones share the card.
#[derive(Clone, Default)]
pub(crate) struct Card(Arc<Mutex<Option<Renderer>>>);

impl Card {
    /// Opens what the configuration asks for. With `auto` the search runs beside the start, and pictures come from the
    /// processor until it is done.
    ///
    /// # Errors
    /// With `gpu`, when there is no adapter or its driver refuses.
    pub(crate) fn open(choice: RendererChoice) -> Result<Self, GpuError> {
        let card = Self::default();
        match choice {
            RendererChoice::Cpu => {}
            RendererChoice::Gpu => card.put(choose(Prefer::Gpu)?),
            RendererChoice::Auto => {
                let late = card.clone();
                let search = move || match choose(Prefer::Auto) {
                    Ok(found) => late.put(found),
                    Err(e) => tracing::warn!(error = %e, "no graphics card"),
                };
                if let Err(e) = std::thread::Builder::new().name("graphics".into()).spawn(search) {
                    tracing::warn!(error = %e, "no thread to look for a graphics card");
                }
            }
        }
        Ok(card)
    }

    fn slot(&self) -> MutexGuard<'_, Option<Renderer>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, found: Option<Renderer>) {
        match &found {
            Some(r) => tracing::info!(adapter = r.adapter().name, backend = r.adapter().backend, "drawing on the card"),
            None => tracing::info!("no graphics card: drawing on the processor"),
        }
        *self.slot() = found;
    }

    /// One picture. A card that fails is given up, and the processor draws this and all later pictures.
    pub(crate) fn draw(
        &self,
        model: &Model,
        state: &mut State,
        input: &Input<'_>,
        work: &mut Workspace,
    ) -> Result<(ColorImage, RenderReport), RenderError> {
        let mut slot = self.slot();
        if let Some(renderer) = slot.as_mut() {
            match renderer.render(model, state, input, work) {
                Err(RenderError::Graphics(why)) => {
                    tracing::warn!(why, "the graphics card failed: drawing on the processor from now on");
                    metrics::counter!("tryon_compositor_card_failures_total").increment(1);
                    *slot = None;
                }
                done => return done,
            }
        }
        // Processors draw side by side; only the card is one at a time.
        drop(slot);
        render(model, state, input, work)
    }
}
