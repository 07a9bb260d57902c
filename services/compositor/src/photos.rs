//! Photos on offer: in memory, behind a random link, for one GET within minutes, never on a disk.

use axum::Router;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::routing::get;
use bytes::Bytes;
use http::{Response, StatusCode, header};
use qrcode::render::svg;
use qrcode::{EcLevel, QrCode};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::time::Instant;
use tonic::Status;
use tonic::metadata::MetadataMap;

/// Life of a link: to find the phone and open its camera.
pub(crate) const LIFE: Duration = Duration::from_secs(300);
/// Photos of one try-on at a time.
const MAX_PHOTOS: usize = 4;
/// Side of the smallest QR code (px); as vectors it scales.
const QR_SIDE: u32 = 240;
/// Path of the links.
const PATH: &str = "/photo/";

/// One photo.
struct Photo {
    id: String,
    try_on: String,
    ends: Instant,
    jpeg: Bytes,
}

/// Photos of all try-ons. Clones share them.
#[derive(Clone, Default)]
pub(crate) struct Photos(Arc<Mutex<Vec<Photo>>>);

impl Photos {
    fn with<R>(&self, f: impl FnOnce(&mut Vec<Photo>) -> R) -> R {
        let mut photos = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        photos.retain(|p| p.ends > now);
        f(&mut photos)
    }

    /// Offers a photo of `try_on`, in place of its oldest when there are too many; the path of its link.
    ///
    /// # Errors
    /// UNAVAILABLE when the system has no random numbers.
    pub(crate) fn offer(&self, try_on: &str, jpeg: Bytes) -> Result<String, Status> {
        let mut drawn = [0; 16];
        getrandom::fill(&mut drawn).map_err(|e| Status::unavailable(e.to_string()))?;
        let id = format!("{:032x}", u128::from_le_bytes(drawn));
        let path = format!("{PATH}{id}");
        self.with(|photos| {
            let is_mine = |p: &Photo| p.try_on == try_on;
            if photos.iter().filter(|p| is_mine(p)).count() >= MAX_PHOTOS
                && let Some(oldest) = photos.iter().position(is_mine)
            {
                photos.remove(oldest);
            }
            photos.push(Photo {
                id,
                try_on: try_on.into(),
                ends: Instant::now() + LIFE,
                jpeg,
            });
        });
        let photos = self.clone();
        tokio::spawn(async move {
            tokio::time::sleep(LIFE).await;
            photos.with(|_| ());
        });
        Ok(path)
    }

    /// Takes a photo: its link is dead then.
    fn take(&self, id: &str) -> Option<Bytes> {
        self.with(|photos| {
            let at = photos.iter().position(|p| p.id == id)?;
            Some(photos.remove(at).jpeg)
        })
    }

    /// Drops all photos of a try-on.
    pub(crate) fn forget(&self, try_on: &str) {
        self.with(|photos| photos.retain(|p| p.try_on != try_on));
    }
}

/// Origin that a phone reaches: the configured one, else the host that the caller asked for.
///
/// # Errors
/// FAILED_PRECONDITION when neither is known, as with clients that are no browsers.
pub(crate) fn origin(configured: &str, asked: &MetadataMap) -> Result<String, Status> {
    if !configured.is_empty() {
        return Ok(configured.trim_end_matches('/').into());
    }
    let text = |name: &str| asked.get(name).and_then(|v| v.to_str().ok());
    // Over HTTP/2 there is no Host, and the origin may be that of a foreign page.
    let origin = text("origin").map(str::to_owned);
    let own = text("host").map(|host| match format!("https://{host}") {
        secure if origin.as_ref() == Some(&secure) => secure,
        _ => format!("http://{host}"),
    });
    own.or(origin)
        .ok_or_else(|| Status::failed_precondition("compositor.public: no origin for photo links"))
}

/// QR code of a link as an SVG document.
///
/// # Errors
/// INTERNAL for a link beyond 2 kB.
pub(crate) fn qr_svg(link: &str) -> Result<String, Status> {
    let code = QrCode::with_error_correction_level(link, EcLevel::M)
        .map_err(|e| Status::internal(format!("QR code: {e}")))?;
    let svg = code
        .render::<svg::Color<'_>>()
        .min_dimensions(QR_SIDE, QR_SIDE)
        .build();
    Ok(svg)
}

/// The links.
pub(crate) fn router<S: Clone + Send + Sync + 'static>(photos: Photos) -> Router<S> {
    // A HEAD, as link previews send it, must not use a link up.
    let refuse = async || StatusCode::METHOD_NOT_ALLOWED;
    Router::new()
        .route(&format!("{PATH}{{id}}"), get(show).head(refuse))
        .with_state(photos)
}

async fn show(State(photos): State<Photos>, Path(id): Path<String>) -> Response<Body> {
    let response = Response::builder()
        .header(header::CACHE_CONTROL, "no-store")
        .header(header::CONTENT_SECURITY_POLICY, "default-src 'none'")
        .header(header::X_CONTENT_TYPE_OPTIONS, "nosniff")
        .header(header::REFERRER_POLICY, "no-referrer")
        .header("x-robots-tag", "none");
    let response = match photos.take(&id) {
        Some(jpeg) => response
            .header(header::CONTENT_TYPE, "image/jpeg")
            .header(header::CONTENT_DISPOSITION, "inline; filename=\"fitting.jpg\"")
            .body(Body::from(jpeg)),
        None => response
            .status(StatusCode::NOT_FOUND)
            .header(header::CONTENT_TYPE, "text/plain; charset=utf-8")
            .body(Body::from(
                "This photo has been fetched already, or its time is over. Take another one at the mirror.\n",
            )),
    };
    response.expect("names and values are literals")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(path: &str) -> &str {
        path.strip_prefix(PATH).expect("a link")
    }

    fn jpeg() -> Bytes {
        Bytes::from_static(b"\xff\xd8")
    }

    #[tokio::test]
    async fn a_link_answers_once_and_not_after_its_time() {
        let photos = Photos::default();
        let path = photos.offer("a", jpeg()).expect("offered");
        assert_eq!(id(&path).len(), 32);
        assert_eq!(photos.take(id(&path)), Some(jpeg()));
        assert_eq!(photos.take(id(&path)), None);

        let late = photos.offer("a", jpeg()).expect("offered");
        photos.with(|all| all[0].ends = Instant::now());
        assert_eq!(photos.take(id(&late)), None);
    }

    #[tokio::test]
    async fn photos_end_with_their_try_on_and_are_few() {
        let photos = Photos::default();
        let other = photos.offer("b", jpeg()).expect("offered");
        let offer = |_| photos.offer("a", jpeg()).expect("offered");
        let paths: Vec<_> = (0..=MAX_PHOTOS).map(offer).collect();
        assert_eq!(photos.take(id(&paths[0])), None, "the oldest made place");
        photos.forget("a");
        assert!(paths.iter().all(|p| photos.take(id(p)).is_none()));
        assert!(photos.take(id(&other)).is_some());
    }

    #[tokio::test]
    async fn a_head_uses_no_link_up() {
        use tower::ServiceExt;
        let photos = Photos::default();
        let path = photos.offer("a", jpeg()).expect("offered");
        let ask = async |method: &str| {
            let request = http::Request::builder().method(method).uri(&path);
            let request = request.body(Body::empty()).expect("a request");
            let answer = router::<()>(photos.clone()).oneshot(request).await;
            answer.expect("infallible").status()
        };
        assert_eq!(ask("HEAD").await, StatusCode::METHOD_NOT_ALLOWED);
        assert_eq!(ask("GET").await, StatusCode::OK);
        assert_eq!(ask("GET").await, StatusCode::NOT_FOUND);
    }

    #[test]
    fn links_begin_with_what_a_phone_reaches() {
        let mut asked = MetadataMap::new();
        assert!(origin("", &asked).is_err());
        asked.insert("host", "10.0.0.7:8080".parse().expect("ASCII"));
        assert_eq!(origin("", &asked).expect("a host"), "http://10.0.0.7:8080");
        asked.insert("origin", "https://10.0.0.7:8080".parse().expect("ASCII"));
        let secure = origin("", &asked).expect("an origin");
        assert_eq!(secure, "https://10.0.0.7:8080");
        let public = origin("https://mirror.example/", &asked);
        assert_eq!(public.expect("configured"), "https://mirror.example");
        let svg = qr_svg("https://mirror.example/photo/0").expect("short");
        assert!(svg.contains("<svg") && !svg.contains("<script"));
    }
}
