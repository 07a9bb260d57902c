//! List of revoked tokens: a file with a `jti` a line.

use std::collections::HashSet;
use std::path::Path;
use tokio::sync::watch;

/// Revoked tokens as of the last reading of the list. Clones share it.
#[derive(Clone, Debug)]
pub(super) struct Revocations(watch::Receiver<HashSet<String>>);

impl Revocations {
    /// Follows a list, on a task of the runtime.
    ///
    /// # Errors
    /// When it cannot be read now: what is revoked must be known.
    pub(super) fn follow(file: &Path) -> Result<Self, String> {
        crate::followed::follow(file, |text| Ok(read(text))).map(Self)
    }

    /// Without a list nothing is ever revoked.
    pub(super) fn none() -> Self {
        Self(watch::channel(HashSet::new()).1)
    }

    pub(super) fn contains(&self, jti: &str) -> bool {
        self.0.borrow().contains(jti)
    }

    /// Waits until a token is revoked; for ever when nobody writes the list any more.
    pub(super) async fn of(&mut self, jti: &str) {
        if self.0.wait_for(|list| list.contains(jti)).await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}

/// Empty lines and `#` comments are left out.
fn read(text: &str) -> HashSet<String> {
    let line = |l: &str| l.split('#').next().unwrap_or_default().trim().to_owned();
    text.lines().map(line).filter(|l| !l.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn lines_are_identities() {
        let list = read("# lost kiosk\nab\n\n  cd # guest\r\n");
        assert_eq!(list, HashSet::from(["ab".into(), "cd".into()]));
    }

    #[tokio::test]
    async fn a_new_line_revokes() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("revoked");
        assert!(Revocations::follow(&file).is_err());
        std::fs::write(&file, "ab\n").expect("written");
        let mut list = Revocations::follow(&file).expect("there");
        assert!(list.contains("ab") && !list.contains("cd"));
        let waiting = tokio::time::timeout(Duration::from_secs(5), list.of("cd"));
        std::fs::write(&file, "ab\ncd\n").expect("written");
        waiting.await.expect("in time");
        let never = tokio::time::timeout(Duration::from_millis(50), async {
            Revocations::none().of("cd").await;
        });
        assert!(never.await.is_err());
    }
}
