//! Names: bus keys, stores, cameras and session ids.

/// Most characters of a name.
pub const MAX_NAME: usize = 64;

/// A store, camera or garment name: 1 to 64 characters of `[a-z0-9_-]`.
pub fn is_name(s: &str) -> bool {
    !s.is_empty()
        && s.len() <= MAX_NAME
        && s.bytes()
            .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_' || b == b'-')
}

/// A session id: 1 to 64 characters of `[A-Za-z0-9_-]`.
pub fn is_session_id(s: &str) -> bool {
    !s.is_empty()
        && s.len() <= MAX_NAME
        && s.bytes()
            .all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
}

/// Identity of a camera: the two variable parts of its bus keys, checked.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CameraKey {
    store: String,
    camera: String,
}

impl CameraKey {
    /// `None` when either is no valid name.
    pub fn new(store: &str, camera: &str) -> Option<Self> {
        (is_name(store) && is_name(camera)).then(|| Self {
            store: store.into(),
            camera: camera.into(),
        })
    }
    /// Store name.
    pub fn store(&self) -> &str {
        &self.store
    }
    /// Camera name.
    pub fn camera(&self) -> &str {
        &self.camera
    }
    /// Key of the frames.
    pub fn rgbd(&self) -> String {
        format!("tryon/{}/{}/rgbd", self.store, self.camera)
    }
    /// Key of the calibration queryable.
    pub fn calibration(&self) -> String {
        format!("tryon/{}/{}/calibration", self.store, self.camera)
    }
    /// Key of the liveliness token.
    pub fn alive(&self) -> String {
        format!("tryon/{}/{}/alive", self.store, self.camera)
    }
}

impl std::fmt::Display for CameraKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.store, self.camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_names_are_refused() {
        assert_eq!(
            CameraKey::new("store", "front").expect("fine").rgbd(),
            "tryon/store/front/rgbd"
        );
        for bad in ["", "a/b", "*", "$*", "a b", "A", &"x".repeat(65)] {
            assert!(CameraKey::new(bad, "front").is_none(), "{bad}");
            assert!(CameraKey::new("store", bad).is_none(), "{bad}");
        }
    }
}
