//! Tokens and sealed frames: bytes that strangers send to be believed.

use super::{Target, text};
use crate::bundle::Bundle;
use std::sync::{Arc, LazyLock};
use tryon_kit::auth::{Claims, Issuer};
use tryon_kit::frames::CameraKey;
use tryon_kit::seal::{KeyRing, Sealer, Unsealing};
use tryon_proto::v1;

/// Keys of this process: inputs kept from another one have bad signatures and unknown keys.
struct Keys {
    issuer: Issuer,
    camera: CameraKey,
    ring: Arc<KeyRing>,
    sealed: Vec<u8>,
}

static KEYS: LazyLock<Result<Keys, String>> = LazyLock::new(|| {
    let camera = CameraKey::new("store", "front").ok_or("no name")?;
    let (sealer, ring) = (Sealer::draw().map_err(text)?, Arc::new(KeyRing::default()));
    ring.learn(&camera, sealer.key());
    let message = v1::FrameId {
        sequence: 7,
        ..v1::FrameId::default()
    };
    let sealed = sealer.seal(&camera, &message).map_err(text)?;
    Ok(Keys {
        issuer: Issuer::generate().map_err(text)?,
        camera,
        ring,
        sealed,
    })
});

fn keys() -> Result<&'static Keys, String> {
    KEYS.as_ref().map_err(Clone::clone)
}

/// Tokens: whole ones, and claims that are signed here and must come back.
pub(super) const TOKEN: Target = Target::new(
    "token",
    "services/kit/src/auth/jws.rs, claims.rs",
    |b, _| {
        let issuer = &keys()?.issuer;
        let claims = b.get("claims.json");
        if claims.is_empty() {
            let token = String::from_utf8_lossy(b.first());
            let claims = issuer.claims(&token).map_err(text)?;
            return Ok(claims.methods.len());
        }
        let claims: Claims = serde_json::from_slice(claims).map_err(text)?;
        let token = issuer.issue(&claims).map_err(text)?;
        let read = issuer.claims(&token).map_err(text)?;
        assert_eq!(read, claims, "claims change on their way");
        Ok(claims.methods.len())
    },
    || {
        let claims = br#"{"aud":["compositor"],"exp":4102444800,"nbf":1,"jti":"0a","store":"store","camera":"front","session":"s","methods":["StreamFrames","*"]}"#;
        let issued = keys()
            .and_then(|k| k.issuer.issue_for_process("store", &["cloth"]).map_err(text))
            .unwrap_or_default();
        vec![
            Bundle::of("claims.json", claims.to_vec()),
            Bundle::of("token.txt", issued.into_bytes()),
        ]
    },
)
.words("eyJ . alg none HS256 EdDSA aud exp nbf methods");

/// Sealed frames: only the genuine one opens.
pub(super) const SEALED: Target = Target::new(
    "sealed-frame",
    "services/kit/src/seal.rs",
    |b, _| {
        let keys = keys()?;
        let mut payload = b.first().to_vec();
        let opened = Unsealing::new(keys.ring.clone(), keys.camera.clone()).open(&mut payload);
        let head = opened.map_err(text)?;
        assert_eq!(b.first(), keys.sealed, "a forged frame opens");
        Ok(payload.len() - head)
    },
    || {
        let sealed = keys().map(|k| k.sealed.clone()).unwrap_or_default();
        vec![Bundle::of("frame.bin", sealed)]
    },
);
