//! rosbag2 folders: the files that `metadata.yaml` lists, one after the other.

use super::reader::SqliteMessages;
use crate::FormatError;
use crate::image::read_limited;
use crate::mcap_file::McapMessages;
use crate::messages::{ContainerStep, MessageContainer, TopicChannel};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Description of the recording.
const METADATA: &str = "metadata.yaml";
/// Largest description, bytes: some hundred a topic.
const MAX_METADATA: u64 = 4 << 20;

/// True for folders with a `metadata.yaml` and no `camera.json`.
pub(crate) fn is_folder(path: &Path) -> bool {
    path.join(METADATA).is_file() && !path.join("camera.json").exists()
}

/// Opens a folder at its first message.
///
/// # Errors
/// No files listed, files of another kind, or the first one unreadable.
pub(crate) fn open_folder(path: &Path) -> Result<Box<dyn MessageContainer>, FormatError> {
    let metadata = path.join(METADATA);
    let text = read_limited(&metadata, MAX_METADATA)?;
    let text = String::from_utf8_lossy(&text);
    let names = listed_files(&text);
    if names.is_empty() {
        let why = "lists no file";
        return Err(FormatError::field(&metadata, "relative_file_paths", why));
    }
    let mut files: Vec<PathBuf> = names.iter().map(|n| path.join(n)).collect();
    files.reverse();
    let mut messages = SplitMessages {
        files,
        current: None,
        passed: Vec::new(),
        messages_passed: 0,
        messages: 0,
        is_cut_short: false,
    };
    messages.open_next()?;
    Ok(Box::new(messages))
}

/// Names under `relative_file_paths`, without folders.
fn listed_files(metadata: &str) -> Vec<&str> {
    let lines = metadata.lines().map(str::trim);
    let listed = lines
        .skip_while(|l| !l.starts_with("relative_file_paths:"))
        .skip(1);
    let items = listed.map_while(|l| l.strip_prefix("- "));
    let names = items.map(|n| n.trim().trim_matches(['"', '\'']));
    names
        .filter_map(|n| Path::new(n).file_name()?.to_str())
        .collect()
}

/// Messages of files that follow each other.
struct SplitMessages {
    /// Files to come, the next one last.
    files: Vec<PathBuf>,
    current: Option<Box<dyn MessageContainer>>,
    /// Channels of earlier files.
    passed: Vec<Arc<TopicChannel>>,
    /// Messages of earlier files.
    messages_passed: u64,
    /// Number of the last message.
    messages: u64,
    is_cut_short: bool,
}

impl SplitMessages {
    /// Opens the next file, if there is one.
    fn open_next(&mut self) -> Result<(), FormatError> {
        if let Some(current) = self.current.take() {
            self.is_cut_short |= current.is_cut_short();
            for channel in current.channels() {
                if !self.passed.contains(&channel) {
                    self.passed.push(channel);
                }
            }
        }
        self.messages_passed = self.messages;
        let Some(file) = self.files.pop() else {
            return Ok(());
        };
        let extension = file.extension().unwrap_or_default();
        self.current = Some(match extension.to_str() {
            Some("db3") => SqliteMessages::open(&file)?,
            Some("mcap") => McapMessages::open(&file)?,
            _ => {
                let why = "expected .db3 or .mcap; decompress .zstd files with `zstd -d`, and list \
                           them in metadata.yaml";
                return Err(FormatError::field(&file, "recording", why));
            }
        });
        Ok(())
    }
}

impl MessageContainer for SplitMessages {
    fn step(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, FormatError> {
        let Some(current) = &mut self.current else {
            return Ok(ContainerStep::End);
        };
        match current.step(is_wanted, data) {
            Ok(ContainerStep::Message(mut head)) => {
                head.number += self.messages_passed;
                self.messages = head.number;
                Ok(ContainerStep::Message(head))
            }
            Ok(ContainerStep::Other) => Ok(ContainerStep::Other),
            Ok(ContainerStep::End) => self.open_next().map(|()| ContainerStep::Other),
            Err(e) => {
                self.files.clear();
                self.current = None;
                Err(e)
            }
        }
    }
    fn channels(&self) -> Vec<Arc<TopicChannel>> {
        let current = self.current.iter().flat_map(|c| c.channels());
        self.passed.iter().cloned().chain(current).collect()
    }
    fn is_cut_short(&self) -> bool {
        self.is_cut_short || self.current.as_ref().is_some_and(|c| c.is_cut_short())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_listed_without_their_folders() {
        let text = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - a_0.db3\n    - \"old/a_1.db3\"\n    - ..\n  duration:\n    - x\n";
        assert_eq!(listed_files(text), ["a_0.db3", "a_1.db3"]);
        assert!(listed_files("- a.db3").is_empty());
    }
}
