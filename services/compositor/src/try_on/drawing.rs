//! Renderer of one try-on: one job at a time on the compute pool. Of pictures the newest waits, snapshots wait in
//! order, and the two take turns: neither starves the other.

use super::handle::Answer;
use crate::card::Card;
use crate::engine::{Encoded, Engine, Job};
use std::collections::VecDeque;
use std::sync::Arc;
use tokio::sync::mpsc;
use tryon_kit::compute::Pool;
use tryon_kit::status::exhausted;

/// Snapshots that wait. A judgement, not a measurement: more would outlive their callers (two seconds).
const SNAPSHOTS: usize = 4;

/// Message of the pool.
pub(super) enum Done {
    /// One format of a picture of the stream.
    Picture(Arc<Job>, Encoded),
    /// The job has ended.
    End(Box<End>),
}

/// End of a job.
pub(super) struct End {
    /// `None` after a panic.
    pub(super) engine: Option<Engine>,
    pub(super) job: Arc<Job>,
    /// The picture, if the job is a snapshot.
    pub(super) outcome: Result<Option<Encoded>, String>,
    /// Receiver of a snapshot; `None` for a picture of the stream.
    pub(super) answer: Option<Answer>,
}

/// Job with the receiver of its picture, if it is a snapshot.
type Pending = (Job, Option<Answer>);

/// Jobs that wait.
#[derive(Default)]
struct Queue {
    picture: Option<Job>,
    snapshots: VecDeque<(Job, Answer)>,
    /// The last job was a snapshot.
    is_pictures_turn: bool,
}

impl Queue {
    /// Queues a snapshot; gives it back when too many wait.
    fn push_snapshot(&mut self, job: Job, answer: Answer) -> Result<(), Answer> {
        // Callers that left leave their place.
        self.snapshots.retain(|(_, a)| !a.is_closed());
        if self.snapshots.len() >= SNAPSHOTS {
            return Err(answer);
        }
        self.snapshots.push_back((job, answer));
        Ok(())
    }

    /// The next job: pictures and snapshots in turn.
    fn pop(&mut self) -> Option<Pending> {
        self.snapshots.retain(|(_, a)| !a.is_closed());
        let is_picture = self.snapshots.is_empty() || self.is_pictures_turn;
        let picture = if is_picture {
            self.picture.take()
        } else {
            None
        };
        let next = match picture {
            Some(job) => Some((job, None)),
            None => (self.snapshots.pop_front()).map(|(job, answer)| (job, Some(answer))),
        };
        self.is_pictures_turn = next.as_ref().is_some_and(|(_, answer)| answer.is_some());
        next
    }
}

/// Engine and queue of a try-on.
pub(super) struct Drawing {
    card: Card,
    pool: Arc<Pool>,
    done: mpsc::Sender<Done>,
    /// `None` while the pool draws.
    engine: Option<Engine>,
    /// The engine that the pool has is dropped when it comes back.
    is_stale: bool,
    /// Nothing was drawn since the engine is new.
    is_fresh: bool,
    queue: Queue,
}

impl Drawing {
    /// An idle renderer that sends finished jobs to `done`.
    pub(super) fn new(card: Card, pool: Arc<Pool>, done: mpsc::Sender<Done>) -> Self {
        Self {
            engine: Some(Engine::new(card.clone())),
            card,
            pool,
            done,
            is_stale: false,
            is_fresh: true,
            queue: Queue::default(),
        }
    }

    /// Drops all jobs and what the renderer knows of the last pictures.
    pub(super) fn forget(&mut self) {
        self.queue = Queue::default();
        if self.engine.is_none() {
            self.is_stale = true;
        } else if !self.is_fresh {
            self.engine = Some(Engine::new(self.card.clone()));
            self.is_fresh = true;
        }
    }

    /// Queues a picture of the stream in place of one that waits.
    pub(super) fn queue(&mut self, job: Job) {
        self.queue.picture = Some(job);
        self.start();
    }

    /// Queues a snapshot; RESOURCE_EXHAUSTED when too many wait.
    pub(super) fn queue_snapshot(&mut self, job: Job, answer: Answer) {
        if let Err(answer) = self.queue.push_snapshot(job, answer) {
            // The receiver may be gone.
            let _ = answer.send(Err(exhausted("waiting snapshots", SNAPSHOTS)));
        }
        self.start();
    }

    /// Takes the engine back from a finished job and starts the next one.
    pub(super) fn resume(&mut self, engine: Option<Engine>) {
        let engine = engine.filter(|_| !self.is_stale);
        self.is_fresh = engine.is_none();
        self.engine = engine.or_else(|| Some(Engine::new(self.card.clone())));
        self.is_stale = false;
        self.start();
    }

    fn start(&mut self) {
        if self.engine.is_none() {
            return;
        }
        let Some((job, answer)) = self.queue.pop() else {
            return;
        };
        let Some(mut engine) = self.engine.take() else {
            return;
        };
        let (pool, done, job) = (self.pool.clone(), self.done.clone(), Arc::new(job));
        let is_snapshot = answer.is_some();
        tokio::spawn(async move {
            let (drawn, stream) = (job.clone(), done.clone());
            let work = move || {
                let mut snapshot = None;
                let outcome = engine.draw(&drawn, |picture| {
                    if is_snapshot {
                        snapshot = Some(picture);
                    } else {
                        // The send fails only after the try-on has ended.
                        let _ = stream.blocking_send(Done::Picture(drawn.clone(), picture));
                    }
                });
                (engine, outcome.map(|()| snapshot))
            };
            let drawn = tokio::select! {
                drawn = pool.run(work) => drawn,
                // The try-on has ended: nobody waits for it.
                () = done.closed() => return,
            };
            let (engine, outcome) = match drawn {
                Ok((e, o)) => (Some(e), o),
                Err(why) => (None, Err(why.to_string())),
            };
            let end = End {
                engine,
                job,
                outcome,
                answer,
            };
            let _ = done.send(Done::End(Box::new(end))).await;
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::sync::oneshot;
    use tryon::geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};
    use tryon_kit::frames::Exposure;
    use tryon_proto::v1::{FrameId, Picture};

    fn job(sequence: u64) -> Job {
        let k = Intrinsics::KINECT_V1.resized(16, 16);
        let exposure = Exposure {
            id: FrameId {
                sequence,
                ..FrameId::default()
            },
            calibration: Arc::new(Calibration::registered(k)),
            rgbd: RgbdFrame {
                sequence,
                time_ns: sequence,
                depth: DepthImage::empty(16, 16),
                color: None,
            },
            stages: vec![],
        };
        Job {
            exposure: Arc::new(exposure),
            placed: None,
            body: None,
            formats: vec![],
            fit: None,
        }
    }

    /// Sequence of the next job, and whether it is a snapshot.
    fn pop(q: &mut Queue) -> Option<(u64, bool)> {
        let (job, answer) = q.pop()?;
        Some((job.exposure.id.sequence, answer.is_some()))
    }

    #[test]
    fn snapshots_and_pictures_take_turns() {
        let mut q = Queue::default();
        let mut callers = Vec::<oneshot::Receiver<Result<Picture, tonic::Status>>>::new();
        for i in 0..3 {
            let (answer, caller) = oneshot::channel();
            callers.push(caller);
            assert!(q.push_snapshot(job(100 + i), answer).is_ok());
        }
        let mut order = Vec::new();
        for i in 0..6 {
            // A newer picture comes before each job is done; the older one is dropped.
            q.picture = Some(job(i));
            order.extend(pop(&mut q));
        }
        let wanted = [
            (100, true),
            (1, false),
            (101, true),
            (3, false),
            (102, true),
            (5, false),
        ];
        assert_eq!(order, wanted);
    }

    #[test]
    fn a_full_queue_refuses_and_callers_that_left_free_it() {
        let mut q = Queue::default();
        let mut callers = Vec::new();
        for _ in 0..SNAPSHOTS {
            let (answer, caller) = oneshot::channel();
            callers.push(caller);
            assert!(q.push_snapshot(job(1), answer).is_ok());
        }
        let (answer, _late) = oneshot::channel();
        assert!(q.push_snapshot(job(2), answer).is_err());
        callers.clear();
        let (answer, _caller) = oneshot::channel();
        assert!(q.push_snapshot(job(3), answer).is_ok());
        assert_eq!(q.snapshots.len(), 1);
    }
}
