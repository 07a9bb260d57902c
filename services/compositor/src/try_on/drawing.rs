//! Renderer of one try-on: one job at a time on the compute pool, the newest one waits.

use super::handle::Answer;
use crate::card::Card;
use crate::engine::{Drawn, Engine, Job};
use std::sync::Arc;
use tokio::sync::mpsc;
use tryon_kit::compute::Pool;

/// Job that came back from the pool.
pub(super) struct Done {
    /// `None` after a panic.
    pub(super) engine: Option<Engine>,
    pub(super) job: Job,
    pub(super) outcome: Result<Drawn, String>,
    /// Receiver of a snapshot; `None` for a picture of the stream.
    pub(super) answer: Option<Answer>,
}

struct Pending {
    job: Job,
    answer: Option<Answer>,
}

/// Engine and queue of one job.
pub(super) struct Drawing {
    card: Card,
    pool: Arc<Pool>,
    done: mpsc::Sender<Done>,
    /// `None` while the pool draws.
    engine: Option<Engine>,
    pending: Option<Pending>,
}

impl Drawing {
    /// An idle renderer that sends finished jobs to `done`.
    pub(super) fn new(card: Card, pool: Arc<Pool>, done: mpsc::Sender<Done>) -> Self {
        Self {
            engine: Some(Engine::new(card.clone())),
            card,
            pool,
            done,
            pending: None,
        }
    }

    /// Queues a picture of the stream. It replaces one that waits, but not a snapshot.
    pub(super) fn queue(&mut self, job: Job) {
        if self.pending.as_ref().is_none_or(|p| p.answer.is_none()) {
            self.pending = Some(Pending { job, answer: None });
            self.start();
        }
    }

    /// Queues a snapshot, which replaces whatever waits.
    pub(super) fn queue_snapshot(&mut self, job: Job, answer: Answer) {
        self.pending = Some(Pending {
            job,
            answer: Some(answer),
        });
        self.start();
    }

    /// Takes the engine back from a finished job and starts the next one.
    pub(super) fn resume(&mut self, engine: Option<Engine>) {
        self.engine = engine.or_else(|| Some(Engine::new(self.card.clone())));
        self.start();
    }

    fn start(&mut self) {
        if self.engine.is_none() {
            return;
        }
        let Some(p) = self.pending.take() else {
            return;
        };
        let Some(mut engine) = self.engine.take() else {
            return;
        };
        let (pool, done) = (self.pool.clone(), self.done.clone());
        tokio::spawn(async move {
            let job = p.job.clone();
            let work = move || {
                let outcome = engine.draw(&job);
                (engine, outcome)
            };
            let (engine, outcome) = match pool.run(work).await {
                Ok((e, o)) => (Some(e), o),
                Err(why) => (None, Err(why.to_string())),
            };
            // The send fails only after the try-on has ended.
            let _ = done
                .send(Done {
                    engine,
                    job: p.job,
                    outcome,
                    answer: p.answer,
                })
                .await;
        });
    }
}
