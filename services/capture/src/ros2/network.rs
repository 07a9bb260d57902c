//! Session on the network of ROS 2 cameras, and the topics announced there.

use super::keys::{Announced, TOKENS, TopicKeys};
use std::collections::BTreeSet;
use std::time::Duration;
use tryon_formats::live::is_ros_image_type;
use tryon_kit::bus::client_elsewhere;
use zenoh::{Session, Wait};

/// Time that an endpoint has to answer.
const CONNECT: Duration = Duration::from_secs(2);
/// Time that routers have to name the tokens that they know.
const TOKEN_QUERY: Duration = Duration::from_secs(1);

/// Connects to the first endpoint that answers. Zenoh connects to it again when it has gone.
///
/// # Errors
/// Names the endpoints, and why the last one was of no use.
pub(super) fn connect(endpoints: &[String]) -> Result<Session, String> {
    let mut why = "capture.ros2.connect names none".to_owned();
    for endpoint in endpoints {
        let config = client_elsewhere(endpoint, CONNECT).map_err(|e| e.to_string())?;
        match zenoh::open(config).wait() {
            Ok(session) => return Ok(session),
            Err(e) => why = e.to_string(),
        }
    }
    let all = endpoints.join(", ");
    Err(format!("no zenoh network answers at {all}: {why}"))
}

/// Image topics that publishers announce, in the order of their names.
pub(super) fn announced_images(session: &Session, keys: &TopicKeys) -> BTreeSet<Announced> {
    let mut found = BTreeSet::new();
    for tokens in TOKENS {
        let query = session.liveliness().get(tokens).timeout(TOKEN_QUERY);
        let Ok(replies) = query.wait() else { continue };
        while let Ok(reply) = replies.recv() {
            let token = reply.result().ok().map(|s| s.key_expr().as_str());
            found.extend(token.and_then(|t| keys.announced(t)));
        }
    }
    found.retain(|a| is_ros_image_type(&a.schema));
    found
}
