//! Claims of a request as its handler sees them: what the message names must be covered.

use super::Fault;
use super::claims::Claims;
use crate::frames::CameraKey;
use std::sync::Arc;
use tonic::{Request, Status};

/// Reach of a request's token. The gate puts one into every request that it passes on.
#[derive(Clone, Debug)]
pub struct Grant(Reach);

#[derive(Clone, Debug)]
enum Reach {
    /// No tokens are asked for.
    Everything,
    /// As far as the claims of a token.
    Claims(Arc<Claims>),
    /// The caller has no token, in a call that needs none.
    Nothing,
}

impl Grant {
    /// Everything: where no tokens are asked for.
    pub(super) fn everything() -> Self {
        Self(Reach::Everything)
    }

    pub(super) fn nothing() -> Self {
        Self(Reach::Nothing)
    }

    pub(super) fn of_token(claims: Arc<Claims>) -> Self {
        Self(Reach::Claims(claims))
    }

    fn claims(&self) -> Option<&Claims> {
        match &self.0 {
            Reach::Claims(claims) => Some(claims),
            _ => None,
        }
    }

    /// The caller has no token, where tokens are asked for.
    pub fn is_nothing(&self) -> bool {
        matches!(self.0, Reach::Nothing)
    }

    fn refuse_nothing(&self) -> Result<(), Status> {
        if self.is_nothing() {
            return Err(Status::unauthenticated(Fault::Missing.to_string()));
        }
        Ok(())
    }

    /// Grant of a request.
    ///
    /// # Errors
    /// PERMISSION_DENIED for one that came past the gate, which no server lets happen.
    pub fn of<T>(request: &Request<T>) -> Result<Self, Status> {
        let missing = || Status::permission_denied("the request passed no gate");
        request.extensions().get().cloned().ok_or_else(missing)
    }

    /// The one session of the token.
    pub fn session(&self) -> Option<&str> {
        self.claims()?.session.as_deref()
    }

    /// The one camera of the token.
    pub fn camera(&self) -> Option<&str> {
        self.claims()?.camera.as_deref()
    }

    /// Checks the session that a message names.
    ///
    /// # Errors
    /// PERMISSION_DENIED when the token is for another.
    pub fn check_session(&self, id: &str) -> Result<(), Status> {
        self.refuse_nothing()?;
        match self.session() {
            Some(own) if own != id => Err(denied("session")),
            _ => Ok(()),
        }
    }

    /// Checks the camera that a message or its session is about.
    ///
    /// # Errors
    /// PERMISSION_DENIED when the token is for another store or camera.
    pub fn check_camera(&self, key: &CameraKey) -> Result<(), Status> {
        self.refuse_nothing()?;
        let Some(claims) = self.claims() else {
            return Ok(());
        };
        if claims.store != key.store() {
            return Err(denied("store"));
        }
        match self.camera() {
            Some(own) if own != key.camera() => Err(denied("camera")),
            _ => Ok(()),
        }
    }

    /// Checks a call on something of the service whose camera it does not know: a token for one camera must name the
    /// session as well.
    ///
    /// # Errors
    /// PERMISSION_DENIED when the token might be for another.
    pub fn check_session_of_any_camera(&self, id: &str) -> Result<(), Status> {
        self.check_session(id)?;
        match (self.camera(), self.session()) {
            (Some(_), None) => Err(denied("camera")),
            _ => Ok(()),
        }
    }

    /// Checks a call that belongs to no session and no camera, and is not for everybody.
    ///
    /// # Errors
    /// PERMISSION_DENIED when the token is for one camera or one session.
    pub fn check_whole_store(&self) -> Result<(), Status> {
        self.refuse_nothing()?;
        match (self.camera(), self.session()) {
            (Some(_), _) => Err(denied("camera")),
            (_, Some(_)) => Err(denied("session")),
            _ => Ok(()),
        }
    }
}

/// Status of a call that a claim does not cover.
pub(super) fn denied(claim: &str) -> Status {
    Status::permission_denied(format!("the token's `{claim}` does not cover this call"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic::Code;

    fn grant(camera: Option<&str>, session: Option<&str>) -> Grant {
        Grant::of_token(Arc::new(Claims {
            aud: vec!["cloth".into()],
            exp: 1,
            nbf: None,
            jti: "j".into(),
            store: "store".into(),
            camera: camera.map(Into::into),
            session: session.map(Into::into),
            methods: vec!["*".into()],
        }))
    }

    fn key(store: &str, camera: &str) -> CameraKey {
        CameraKey::new(store, camera).expect("names")
    }

    #[test]
    fn claims_bind_to_one_store_camera_and_session() {
        let store = grant(None, None);
        assert!(store.check_camera(&key("store", "side")).is_ok());
        assert!(store.check_camera(&key("other", "side")).is_err());
        assert!(store.check_session("b").is_ok() && store.check_whole_store().is_ok());
        assert!(store.check_session_of_any_camera("b").is_ok());

        let camera = grant(Some("front"), None);
        assert!(camera.check_camera(&key("store", "front")).is_ok());
        assert!(camera.check_camera(&key("store", "side")).is_err());
        assert!(camera.check_session_of_any_camera("a").is_err());
        assert!(camera.check_whole_store().is_err());

        let session = grant(None, Some("a"));
        assert!(session.check_session("a").is_ok());
        let fault = session.check_session("b").expect_err("another");
        assert_eq!(fault.code(), Code::PermissionDenied);
        assert!(session.check_whole_store().is_err());
        assert!(session.check_session("").is_err());
    }

    #[test]
    fn a_request_that_came_past_the_gate_is_denied() {
        assert!(Grant::of(&Request::new(())).is_err());
        let mut request = Request::new(());
        request.extensions_mut().insert(Grant::everything());
        let grant = Grant::of(&request).expect("passed the gate");
        assert!(grant.check_session("a").is_ok());
        assert!(grant.check_camera(&key("other", "side")).is_ok());
        let nothing = Grant::nothing();
        assert!(nothing.check_session("a").is_err() && nothing.check_whole_store().is_err());
        assert!(nothing.check_camera(&key("store", "front")).is_err());
    }
}
