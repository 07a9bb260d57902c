//! Opening of a ROS 2 camera: its calibration, and the transform from depth to colour.

use super::inbox::Inbox;
use super::keys::TopicKeys;
use super::network::{announced_images, connect};
use super::presence::Presence;
use super::source::{Ros2Source, Said};
use super::subscription::Subscription;
use super::topics::Topics;
use crate::source::OpenSource;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};
use tryon_formats::live::LiveCamera;
use tryon_formats::{FormatError, Rectified};
use tryon_kit::config::Ros2Config;
use zenoh::pubsub::Subscriber;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Time that cameras have to state their calibration: they repeat it with every image.
const CAMERA_WAIT: Duration = Duration::from_secs(5);
/// Time for transforms after it: caches answer at once.
const TRANSFORM_WAIT: Duration = Duration::from_secs(1);
/// Messages that wait for the reader.
const WAITING: usize = 64;
/// Topic of transforms that do not change.
const TF_STATIC: &str = "/tf_static";

/// Connects and waits for the calibration. Takes some seconds where the camera is missing: call it on a thread of its own.
///
/// # Errors
/// No network, no calibration (names the topics that were waited for and those of images that are announced), or one that
/// cannot be used.
pub(crate) fn open(name: &str, topics: &Topics, config: &Ros2Config) -> Result<OpenSource, String> {
    let session = connect(&config.connect)?;
    let keys = TopicKeys::new(config);
    let path = Path::new(name);
    let mut camera = LiveCamera::new(path, &topics.depth, topics.color.as_deref());
    let survey = Survey::begin(&session, &keys, &camera).map_err(|e| e.to_string())?;
    let fault = survey.read(&mut camera);
    drop(survey);
    let missing = camera.missing();
    if !missing.is_empty() {
        let why = fault.map(|e| format!(" ({e})")).unwrap_or_default();
        return Err(format!(
            "no camera_info within {} s on {}{why}; {}",
            CAMERA_WAIT.as_secs(),
            missing.join(", "),
            on_the_bus(&session, &keys, config)
        ));
    }
    let frames = camera.frames().map_err(|e| e.to_string())?;
    for note in frames.notes() {
        tracing::warn!(source = name, "{note}");
    }
    let inbox = Arc::<Inbox>::default();
    let source = Ros2Source {
        name: path.to_owned(),
        topics: topics.clone(),
        session,
        subscription: Subscription::new(keys, topics.clone(), inbox.clone()),
        inbox,
        frames,
        said: Said::default(),
    };
    Ok(Rectified::wrap(path, Box::new(source)))
}

/// Image topics that the network announces, for who has to configure some.
fn on_the_bus(session: &Session, keys: &TopicKeys, config: &Ros2Config) -> String {
    let found = announced_images(session, keys);
    let at = format!("{}, domain {}", config.connect.join(", "), config.domain);
    match found.is_empty() {
        true => format!("no image topic is announced at {at}"),
        false => {
            let names: Vec<String> = found.iter().map(ToString::to_string).collect();
            format!("image topics announced at {at}: {}", names.join(", "))
        }
    }
}

/// A message and the number of its topic.
struct Heard {
    topic: usize,
    sample: Sample,
}

/// Subscription to cameras and transforms.
struct Survey {
    keys: TopicKeys,
    topics: Vec<String>,
    heard: Receiver<Heard>,
    _presence: Presence,
    _subscribers: Vec<Subscriber<()>>,
}

impl Survey {
    /// Subscribes, and asks for past messages: of transforms that do not change there are no others.
    fn begin(
        session: &Session,
        keys: &TopicKeys,
        camera: &LiveCamera,
    ) -> Result<Self, zenoh::Error> {
        let mut topics = camera.info_topics();
        topics.push(TF_STATIC.to_owned());
        let (sender, heard) = sync_channel(WAITING);
        let mut subscribers = Vec::new();
        for (number, topic) in topics.iter().enumerate() {
            for key in keys.of(topic) {
                let hear = hear(number, sender.clone());
                subscribers.push(session.declare_subscriber(key).callback(hear).wait()?);
            }
            for selector in keys.past(topic) {
                ask(session, &selector, hear(number, sender.clone()))?;
            }
        }
        let shown = topics.iter().map(String::as_str);
        Ok(Self {
            _presence: Presence::declare(session, keys, shown)?,
            keys: keys.clone(),
            topics,
            heard,
            _subscribers: subscribers,
        })
    }

    /// Reads until the camera knows what it needs, or its time is over. The last message at fault.
    fn read(&self, camera: &mut LiveCamera) -> Option<FormatError> {
        let (mut fault, mut end) = (None, Instant::now() + CAMERA_WAIT);
        let mut is_known = false;
        loop {
            if !is_known && camera.missing().is_empty() {
                is_known = true;
                end = Instant::now() + TRANSFORM_WAIT;
            }
            if is_known && !camera.lacks_transform() {
                break;
            }
            let left = end.saturating_duration_since(Instant::now());
            let Ok(Heard { topic, sample }) = self.heard.recv_timeout(left) else {
                break;
            };
            if left.is_zero() {
                break;
            }
            let topic = &self.topics[topic];
            let Ok(schema) = self.keys.schema(topic, sample.key_expr().as_str()) else {
                continue;
            };
            let data = sample.payload().to_bytes();
            fault = camera.insert(topic, schema, &data).err().or(fault);
        }
        fault
    }
}

/// Passes messages of a topic on, as far as there is room.
fn hear(topic: usize, to: SyncSender<Heard>) -> impl Fn(Sample) + Send + Sync + 'static {
    move |sample| {
        // Full: cameras state themselves again, and caches of transforms have few.
        let _ = to.try_send(Heard { topic, sample });
    }
}

/// Asks publishers for past messages, of which those of one key are not one another's newer versions.
fn ask(
    session: &Session,
    selector: &str,
    hear: impl Fn(Sample) + Send + Sync + 'static,
) -> Result<(), zenoh::Error> {
    let answer = move |reply: Reply| {
        if let Ok(sample) = reply.into_result() {
            hear(sample);
        }
    };
    session
        .get(selector)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(CAMERA_WAIT)
        .callback(answer)
        .wait()
}
