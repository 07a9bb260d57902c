//! Subscription to the images of a camera, which lasts while somebody reads them.

use super::inbox::{Inbox, Message, Stream};
use super::keys::TopicKeys;
use super::presence::Presence;
use super::topics::Topics;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Instant;
use tryon_kit::sessions::unix_ns;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

/// Subscribers to both streams under all keys. None while nobody reads: the network then sends no images here.
pub(super) struct Subscription {
    keys: TopicKeys,
    topics: Topics,
    inbox: Arc<Inbox>,
    begun: Mutex<Option<Begun>>,
}

/// Declarations that end together.
struct Begun {
    _presence: Presence,
    _subscribers: Vec<Subscriber<()>>,
}

impl Subscription {
    pub(super) fn new(keys: TopicKeys, topics: Topics, inbox: Arc<Inbox>) -> Arc<Self> {
        Arc::new(Self {
            keys,
            topics,
            inbox,
            begun: Mutex::default(),
        })
    }

    /// Subscribes, unless it has.
    ///
    /// # Errors
    /// A session that has been closed.
    pub(super) fn begin(self: &Arc<Self>, session: &Session) -> Result<(), zenoh::Error> {
        let mut begun = self.begun();
        if begun.is_some() {
            return Ok(());
        }
        let mut subscribers = Vec::new();
        let color = self.topics.color.as_ref().map(|t| (Stream::Color, t));
        let streams = [Some((Stream::Depth, &self.topics.depth)), color];
        for (stream, topic) in streams.into_iter().flatten() {
            for key in self.keys.of(topic) {
                let (this, topic) = (Arc::downgrade(self), topic.clone());
                let receive = move |sample: Sample| Self::receive(&this, stream, &topic, &sample);
                let subscriber = session.declare_subscriber(key).callback(receive);
                subscribers.push(subscriber.wait()?);
            }
        }
        let topics = streams.iter().flatten().map(|(_, topic)| topic.as_str());
        *begun = Some(Begun {
            _presence: Presence::declare(session, &self.keys, topics)?,
            _subscribers: subscribers,
        });
        Ok(())
    }

    fn begun(&self) -> MutexGuard<'_, Option<Begun>> {
        self.begun.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands a message on, or ends the subscription if nobody reads it.
    fn receive(this: &Weak<Self>, stream: Stream, topic: &str, sample: &Sample) {
        let Some(this) = this.upgrade() else { return };
        // Keys of other topics may have the same form.
        let Ok(schema) = this.keys.schema(topic, sample.key_expr().as_str()) else {
            return;
        };
        let message = |number| Message {
            schema: schema.map(str::to_owned),
            payload: sample.payload().clone(),
            arrived: Instant::now(),
            arrived_ns: unix_ns(),
            number,
        };
        if sample.kind() == SampleKind::Put && !this.inbox.put(stream, message) {
            this.end();
        }
    }

    /// Ends on a thread of its own: a subscriber does not undeclare itself.
    fn end(&self) {
        let mut begun = self.begun();
        if self.inbox.is_read() {
            // The reader has come back meanwhile, and found itself subscribed.
            return;
        }
        if let Some(ended) = begun.take() {
            let thread = std::thread::Builder::new().name("ros2-end".into());
            if let Err(e) = thread.spawn(move || drop(ended)) {
                tracing::warn!(error = %e, "no thread to end a subscription");
            }
        }
    }
}
