//! The page: files inside the program, so that a mirror needs no web server and no folder beside it.

use axum::Router;
use axum::body::Body;
use axum::routing::get;
use http::{HeaderMap, Response, StatusCode, header};

/// Everything the page may do: its own scripts, styles, drawings and calls; pictures it made itself; nothing from
/// another host, nothing inline, in no foreign frame.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
     img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

/// Browsers ask for the camera of the visitor only where a page may have it: this one never does.
const PERMISSIONS_POLICY: &str = "camera=(), microphone=(), geolocation=(), payment=(), usb=()";

/// One file of `web/`.
#[derive(Clone, Copy, Debug)]
struct File {
    path: &'static str,
    content_type: &'static str,
    bytes: &'static [u8],
}

macro_rules! files {
    ($($path:literal: $content_type:expr),* $(,)?) => {
        &[$(File {
            path: $path,
            content_type: $content_type,
            bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/web/", $path)),
        }),*]
    };
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const JS: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

const FILES: &[File] = files! {
    "index.html": HTML,
    "favicon.svg": SVG,
    "css/base.css": CSS,
    "css/fitting.css": CSS,
    "css/welcome.css": CSS,
    "js/backoff.js": JS,
    "js/client.js": JS,
    "js/credentials.js": JS,
    "js/details.js": JS,
    "js/elements.js": JS,
    "js/fine_picture.js": JS,
    "js/fit.js": JS,
    "js/grpc_web.js": JS,
    "js/main.js": JS,
    "js/messages.js": JS,
    "js/mirror.js": JS,
    "js/outfit.js": JS,
    "js/presentation.js": JS,
    "js/shape.js": JS,
    "js/stats.js": JS,
    "js/try_on.js": JS,
    "js/wardrobe.js": JS,
    "js/wire.js": JS,
};

/// The page at `/` and its files beside it. Merge it with the gRPC routes, so that both have one origin.
pub(crate) fn router<S: Clone + Send + Sync + 'static>() -> Router<S> {
    let mut router = Router::new();
    for file in FILES {
        let tag = entity_tag(file.bytes);
        let handler = move |headers: HeaderMap| {
            let answer = answer(*file, &tag, &headers);
            async move { answer }
        };
        if file.path == "index.html" {
            router = router.route("/", get(handler.clone()));
        }
        router = router.route(&format!("/{}", file.path), get(handler));
    }
    router
}

fn answer(file: File, tag: &str, asked: &HeaderMap) -> Response<Body> {
    let known = asked
        .get(header::IF_NONE_MATCH)
        .is_some_and(|have| have.as_bytes() == tag.as_bytes());
    let response = Response::builder()
        .header(header::ETAG, tag)
        // Ask each time, answer with 304: a new program must not meet the scripts of an old one.
        .header(header::CACHE_CONTROL, "no-cache")
        .header(header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY)
        .header(header::X_CONTENT_TYPE_OPTIONS, "nosniff")
        .header(header::REFERRER_POLICY, "no-referrer")
        .header("permissions-policy", PERMISSIONS_POLICY)
        .header("cross-origin-opener-policy", "same-origin");
    let response = if known {
        response
            .status(StatusCode::NOT_MODIFIED)
            .body(Body::empty())
    } else {
        response
            .header(header::CONTENT_TYPE, file.content_type)
            .body(Body::from(file.bytes))
    };
    response.expect("names and values are literals or hexadecimal")
}

/// FNV-1a, 64 bits: tells two builds of a file apart, which is all that an entity tag is for.
fn entity_tag(bytes: &[u8]) -> String {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let hash = bytes.iter().fold(OFFSET, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(PRIME)
    });
    format!("\"{hash:016x}\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    fn on_disk(dir: &Path, below: &str, out: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(dir).expect("readable").flatten() {
            let name = format!("{below}{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() {
                on_disk(&entry.path(), &format!("{name}/"), out);
            } else {
                out.insert(name);
            }
        }
    }

    #[test]
    fn every_file_of_the_folder_is_served() {
        let mut found = BTreeSet::new();
        on_disk(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("web"),
            "",
            &mut found,
        );
        let served = FILES
            .iter()
            .map(|f| f.path.to_owned())
            .collect::<BTreeSet<_>>();
        assert_eq!(found, served);
    }

    #[test]
    fn nothing_comes_from_another_host_and_nothing_is_inline() {
        for file in FILES {
            let text = std::str::from_utf8(file.bytes)
                .expect("UTF-8")
                .replace("http://www.w3.org/2000/svg", "");
            for foreign in [
                "http://",
                "https://",
                "url(//",
                "src=\"//",
                "@import",
                "style=\"",
                "onclick=\"",
                "eval(",
            ] {
                assert!(!text.contains(foreign), "{}: {foreign}", file.path);
            }
        }
    }

    #[test]
    fn a_known_tag_is_not_sent_again() {
        let file = FILES[0];
        let tag = entity_tag(file.bytes);
        let mut asked = HeaderMap::new();
        assert_eq!(answer(file, &tag, &asked).status(), StatusCode::OK);
        asked.insert(header::IF_NONE_MATCH, tag.parse().expect("ASCII"));
        let known = answer(file, &tag, &asked);
        assert_eq!(known.status(), StatusCode::NOT_MODIFIED);
        assert!(
            known
                .headers()
                .contains_key(header::CONTENT_SECURITY_POLICY)
        );
        assert_ne!(tag, entity_tag(FILES[1].bytes));
    }
}
