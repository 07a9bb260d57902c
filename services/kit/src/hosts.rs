//! Allow-list of `Host` and `Origin`: a page of another site whose name resolves to this box (DNS rebinding), or that
//! calls it across origins, is refused before anything is looked up.

use http::uri::Authority;
use http::{HeaderMap, HeaderValue, Request, StatusCode, header};
use std::net::IpAddr;
use std::sync::Arc;

/// Names under which a port is served, and origins of foreign pages that may call it.
#[derive(Clone, Debug, Default)]
pub struct Hosts(Arc<Lists>);

#[derive(Debug, Default)]
struct Lists {
    hosts: Vec<String>,
    origins: Vec<String>,
}

impl Hosts {
    /// IP addresses and `localhost` need no entry: no other site's name is one.
    pub fn new(hosts: &[String], origins: &[String]) -> Self {
        Self(Arc::new(Lists {
            hosts: hosts.to_vec(),
            origins: origins.to_vec(),
        }))
    }

    /// Status with which a request is refused: 400 without a host, 421 for a foreign one, 403 for a foreign origin.
    pub fn refusal<B>(&self, request: &Request<B>) -> Option<StatusCode> {
        let Some(host) = host_of(request) else {
            return Some(StatusCode::BAD_REQUEST);
        };
        if !self.is_host(&host) {
            return Some(StatusCode::MISDIRECTED_REQUEST);
        }
        (!self.is_origin(request.headers(), &host)).then_some(StatusCode::FORBIDDEN)
    }

    fn is_host(&self, authority: &Authority) -> bool {
        let host = authority.host();
        let literal = host.trim_start_matches('[').trim_end_matches(']');
        literal.parse::<IpAddr>().is_ok()
            || host.eq_ignore_ascii_case("localhost")
            || self
                .0
                .hosts
                .iter()
                .any(|own| host.eq_ignore_ascii_case(own))
    }

    /// Without an origin it is no page of a browser; a page of this port has the port's own.
    fn is_origin(&self, headers: &HeaderMap, host: &Authority) -> bool {
        let Some(origin) = headers.get(header::ORIGIN).map(HeaderValue::to_str) else {
            return true;
        };
        let Ok(origin) = origin else { return false };
        let own = ["http", "https"].map(|scheme| format!("{scheme}://{host}"));
        (own.iter().chain(&self.0.origins)).any(|o| origin.eq_ignore_ascii_case(o))
    }
}

/// Authority of HTTP/2, `Host` of HTTP/1.1.
fn host_of<B>(request: &Request<B>) -> Option<Authority> {
    if let Some(authority) = request.uri().authority() {
        return Some(authority.clone());
    }
    let host = request.headers().get(header::HOST)?;
    host.to_str().ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Status of a request; 200 when it is passed on.
    fn status(host: &str, origin: Option<&str>) -> u16 {
        let hosts = Hosts::new(&["mirror.shop".into()], &["https://kiosk.shop".into()]);
        let mut request = Request::get("/").header("host", host);
        if let Some(origin) = origin {
            request = request.header("origin", origin);
        }
        let request = request.body(()).expect("a request");
        hosts.refusal(&request).map_or(200, |s| s.as_u16())
    }

    #[test]
    fn foreign_names_are_refused_and_addresses_are_not() {
        for own in [
            "127.0.0.1:8080",
            "[::1]:8080",
            "localhost:8080",
            "10.0.0.7",
            "Mirror.Shop:443",
        ] {
            assert_eq!(status(own, None), 200, "{own}");
        }
        for foreign in [
            "evil.example",
            "evil.example:8080",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
        ] {
            assert_eq!(status(foreign, None), 421, "{foreign}");
        }
        assert_eq!(status("a b", None), 400);
    }

    #[test]
    fn pages_of_other_origins_are_refused() {
        let host = "127.0.0.1:8080";
        for own in [
            "http://127.0.0.1:8080",
            "https://127.0.0.1:8080",
            "https://kiosk.shop",
        ] {
            assert_eq!(status(host, Some(own)), 200, "{own}");
        }
        for foreign in [
            "null",
            "http://127.0.0.1:8081",
            "http://evil.example",
            "https://kiosk.shop.evil.example",
        ] {
            assert_eq!(status(host, Some(foreign)), 403, "{foreign}");
        }
    }
}
