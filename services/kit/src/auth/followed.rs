//! Contents of a file, read again when it changes.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use tokio::sync::watch;

/// Interval of the looks: a change counts after at most this and one reading. Each costs a `stat`.
const EVERY: Duration = Duration::from_millis(150);

/// Changes with every new content: a rewrite changes time or length, a file moved into place the number as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mark {
    modified: Option<SystemTime>,
    length: u64,
    number: u64,
}

fn mark(file: &Path) -> std::io::Result<Mark> {
    let m = std::fs::metadata(file)?;
    #[cfg(unix)]
    let number = std::os::unix::fs::MetadataExt::ino(&m);
    #[cfg(not(unix))]
    let number = 0;
    Ok(Mark {
        modified: m.modified().ok(),
        length: m.len(),
        number,
    })
}

/// Reads a file now, and again on a task of the runtime until no receiver is left. While it is away or unreadable, the
/// last content holds and the fault is logged once.
///
/// # Errors
/// When it cannot be read now.
pub(super) fn follow<T, F>(file: &Path, read: F) -> Result<watch::Receiver<T>, String>
where
    T: Send + Sync + 'static,
    F: Fn(&str) -> Result<T, String> + Send + 'static,
{
    let load = move |file: &Path| {
        let text = std::fs::read_to_string(file).map_err(|e| e.to_string())?;
        read(&text)
    };
    let at_start = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
    // The mark is taken first: a change between the two is read again.
    let mut seen = Some(mark(file).map_err(|e| at_start(&e))?);
    let (content, following) = watch::channel(load(file).map_err(|e| at_start(&e))?);
    let file: PathBuf = file.into();
    tokio::spawn(async move {
        let mut is_faulty = false;
        while !content.is_closed() {
            tokio::time::sleep(EVERY).await;
            let now = mark(&file).ok();
            if now == seen && !is_faulty {
                continue;
            }
            match load(&file) {
                Ok(new) => {
                    content.send_replace(new);
                    (seen, is_faulty) = (now, false);
                }
                Err(why) => {
                    if !is_faulty {
                        tracing::error!(file = %file.display(), why, "unreadable: the last content holds");
                    }
                    is_faulty = true;
                }
            }
        }
    });
    Ok(following)
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn becomes(file: &mut watch::Receiver<String>, text: &str) {
        let wait = file.wait_for(|t| t == text);
        tokio::time::timeout(Duration::from_secs(5), wait)
            .await
            .expect("in time")
            .expect("followed");
    }

    #[tokio::test]
    async fn a_file_is_read_again_when_written_replaced_and_back() {
        let dir = tempfile::tempdir().expect("a folder");
        let (file, other) = (dir.path().join("a"), dir.path().join("b"));
        let read = |t: &str| Ok::<_, String>(t.to_owned());
        assert!(follow(&file, read).is_err(), "not there yet");
        std::fs::write(&file, "one").expect("written");
        let mut content = follow(&file, read).expect("there");
        assert_eq!(*content.borrow(), "one");
        std::fs::write(&file, "three").expect("written");
        becomes(&mut content, "three").await;
        std::fs::write(&other, "seven").expect("written");
        std::fs::rename(&other, &file).expect("moved");
        becomes(&mut content, "seven").await;
        std::fs::remove_file(&file).expect("removed");
        tokio::time::sleep(EVERY * 3).await;
        assert_eq!(*content.borrow(), "seven", "the last content holds");
        std::fs::write(&file, "eight").expect("written");
        becomes(&mut content, "eight").await;
    }
}
