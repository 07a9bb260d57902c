//! Settings and headers: configuration files, Host and Origin.

use super::{Target, lossy, text};
use crate::bundle::Bundle;
use http::{Request, header};
use tryon_kit::config::Config;
use tryon_kit::hosts::Hosts;

/// Configuration files, and flags in a file of their own.
pub(super) const CONFIG: Target = Target::new(
    "config",
    "services/kit/src/config.rs",
    |b, scratch| {
        let path = scratch.file("tryon.toml", b.get("tryon.toml"))?;
        let flags: Vec<String> = lossy(b.get("flags.txt")).lines().map(Into::into).collect();
        let config = Config::load(Some(&path), &flags).map_err(text)?;
        Ok(config.capture.cameras.len())
    },
    || {
        let file = include_str!("../../../../deploy/tryon.toml");
        let flags = "tracking.address=127.0.0.1:0\nlog.level=debug";
        vec![Bundle::of("tryon.toml", file).and("flags.txt", flags)]
    },
)
.words("[capture] [[capture.cameras]] address \"127.0.0.1:0\" true [] {} ''' = 1979-05-27")
.allow(1 << 20, 400);

/// Host and Origin of a request.
pub(super) const HOSTS: Target = Target::new(
    "hosts",
    "services/kit/src/hosts.rs",
    |b, _| {
        let own = Hosts::new(
            &["mirror.example".into()],
            &["https://kiosk.example".into()],
        );
        let request = Request::builder()
            .uri(b.get("uri.txt"))
            .header(header::HOST, b.get("host.txt"))
            .header(header::ORIGIN, b.get("origin.txt"))
            .body(())
            .map_err(text)?;
        match own.refusal(&request) {
            Some(status) => Err(status.to_string()),
            None => Ok(1),
        }
    },
    || {
        let bundle = Bundle::of("uri.txt", "/").and("host.txt", "mirror.example:8080");
        vec![bundle.and("origin.txt", "https://kiosk.example")]
    },
)
.words("localhost [::1] 127.0.0.1 @ : %00 https:// xn-- .");
