//! Directory of the open sessions of a service, by id. The state of a session belongs to its own task.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Directory with a limit. Clones share it.
pub struct Sessions<H> {
    open: Arc<Mutex<BTreeMap<String, Arc<H>>>>,
    limit: usize,
}

impl<H> Clone for Sessions<H> {
    fn clone(&self) -> Self {
        Self {
            open: self.open.clone(),
            limit: self.limit,
        }
    }
}

/// Result of [`Sessions::open`].
pub enum Opened<H> {
    /// It was there.
    Found(Arc<H>),
    /// It is new.
    Created(Arc<H>),
    /// All places are taken.
    Full,
}

impl<H> Sessions<H> {
    /// An empty directory for at most `limit` sessions.
    pub fn new(limit: usize) -> Self {
        Self {
            open: Arc::default(),
            limit,
        }
    }
    fn with<R>(&self, f: impl FnOnce(&mut BTreeMap<String, Arc<H>>) -> R) -> R {
        f(&mut self.open.lock().unwrap_or_else(PoisonError::into_inner))
    }
    /// The session of that id, made by `make` when there is none.
    pub fn open(&self, id: &str, make: impl FnOnce() -> H) -> Opened<H> {
        self.with(|m| {
            if let Some(h) = m.get(id) {
                return Opened::Found(h.clone());
            }
            if m.len() >= self.limit {
                return Opened::Full;
            }
            let h = Arc::new(make());
            m.insert(id.into(), h.clone());
            Opened::Created(h)
        })
    }
    /// The session of that id.
    pub fn get(&self, id: &str) -> Option<Arc<H>> {
        self.with(|m| m.get(id).cloned())
    }
    /// Takes a session out of the directory.
    pub fn remove(&self, id: &str) -> Option<Arc<H>> {
        self.with(|m| m.remove(id))
    }
    /// Takes a session out of the directory if `is_it` holds.
    pub fn remove_if(&self, id: &str, is_it: impl FnOnce(&H) -> bool) {
        self.with(|m| {
            if m.get(id).is_some_and(|h| is_it(h)) {
                m.remove(id);
            }
        });
    }
    /// Most sessions at a time.
    pub fn limit(&self) -> usize {
        self.limit
    }
    /// Number of open sessions.
    pub fn len(&self) -> usize {
        self.with(|m| m.len())
    }
    /// None is open.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A random id: 128 bits, hexadecimal. `RandomState` draws from the system's generator.
pub fn random_id() -> String {
    format!("{:016x}{:016x}", random_u64(), random_u64())
}

/// Beginning of an id for logs: whoever knows a whole id can watch and close its session.
pub fn brief(id: &str) -> String {
    let shown = (id.chars().count() / 2).min(8);
    id.chars().take(shown).chain(['…']).collect()
}

/// A random number, never 0: the epoch of a camera's run.
pub fn random_u64() -> u64 {
    use std::hash::{BuildHasher, Hasher, RandomState};
    let mut h = RandomState::new().build_hasher();
    h.write_u128(
        std::time::SystemTime::now()
            .duration_since(std::time::UNIX_EPOCH)
            .map_or(0, |d| d.as_nanos()),
    );
    h.write_u32(std::process::id());
    h.finish().max(1)
}

/// Unix time, nanoseconds.
pub fn unix_ns() -> u64 {
    let d = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap_or_default();
    u64::try_from(d.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opening_twice_finds_the_same_and_the_limit_holds() {
        let s = Sessions::new(2);
        assert!(matches!(s.open("a", || 1), Opened::Created(_)));
        assert!(matches!(s.open("a", || 2), Opened::Found(h) if *h == 1));
        assert!(matches!(s.open("b", || 2), Opened::Created(_)));
        assert!(matches!(s.open("c", || 3), Opened::Full));
        s.remove("a");
        assert!(matches!(s.open("c", || 3), Opened::Created(_)));
        assert_ne!(random_id(), random_id());
        s.remove_if("c", |_| false);
        assert!(matches!(s.open("c", || 4), Opened::Found(h) if *h == 3));
    }

    #[test]
    fn no_log_shows_more_than_half_an_id() {
        assert_eq!(brief("web-0123456789abcdef"), "web-0123…");
        assert_eq!(brief("me"), "m…");
        assert_eq!(brief(""), "…");
    }
}
