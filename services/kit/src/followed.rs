//! Contents of files, read again when they change.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};
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

/// Reads a file now, and again whenever it changes; see [`follow_all`].
///
/// # Errors
/// When it cannot be read now.
pub(crate) fn follow<T, F>(file: &Path, read: F) -> Result<watch::Receiver<T>, String>
where
    T: Send + Sync + 'static,
    F: Fn(&str) -> Result<T, String> + Send + 'static,
{
    let file = file.to_owned();
    follow_all(vec![file.clone()], move || {
        let text = std::fs::read_to_string(&file).map_err(|e| e.to_string());
        (text.and_then(|t| read(&t))).map_err(|why| format!("{}: {why}", file.display()))
    })
}

/// Loads from files now, and again on a task of the runtime whenever one of them changes, until no receiver is left. While
/// they cannot be used, the last content holds and the fault is logged once.
///
/// # Errors
/// When they cannot be used now.
pub(crate) fn follow_all<T, E, F>(files: Vec<PathBuf>, load: F) -> Result<watch::Receiver<T>, E>
where
    T: Send + Sync + 'static,
    E: std::fmt::Display + Send,
    F: Fn() -> Result<T, E> + Send + 'static,
{
    follow_and_renew(files, Duration::MAX, load)
}

/// As [`follow_all`], and loads what is older than `life` again too.
///
/// # Errors
/// When the files cannot be used now.
pub(crate) fn follow_and_renew<T, E, F>(
    files: Vec<PathBuf>,
    life: Duration,
    load: F,
) -> Result<watch::Receiver<T>, E>
where
    T: Send + Sync + 'static,
    E: std::fmt::Display + Send,
    F: Fn() -> Result<T, E> + Send + 'static,
{
    let marks = move || -> Vec<Option<Mark>> { files.iter().map(|f| mark(f).ok()).collect() };
    // The marks are taken first: a change between the two is read again.
    let mut seen = marks();
    let (content, following) = watch::channel(load()?);
    tokio::spawn(async move {
        let (mut is_faulty, mut loaded) = (false, Instant::now());
        while !content.is_closed() {
            tokio::time::sleep(EVERY).await;
            let now = marks();
            if now == seen && !is_faulty && loaded.elapsed() < life {
                continue;
            }
            match load() {
                Ok(new) => {
                    content.send_replace(new);
                    (seen, is_faulty, loaded) = (now, false, Instant::now());
                }
                Err(why) => {
                    if !is_faulty {
                        tracing::error!(%why, "unusable: the last content holds");
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
    use std::sync::atomic::{AtomicUsize, Ordering};

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

    #[tokio::test]
    async fn what_is_old_is_loaded_again_without_a_change() {
        let loads = AtomicUsize::new(0);
        let load = move || Ok::<_, String>(loads.fetch_add(1, Ordering::Relaxed).to_string());
        let mut content = follow_and_renew(Vec::new(), EVERY * 2, load).expect("loaded");
        assert_eq!(*content.borrow(), "0");
        becomes(&mut content, "1").await;
    }
}
