//! Messages of a rosbag2 SQLite file, in the order of recording.

use super::sqlite_pages::SqlitePages;
use super::sqlite_row::{RowFault, column};
use super::sqlite_table::{RowPlace, TableRows, read_overflow};
use crate::FormatError;
use crate::messages::{ContainerStep, MAX_RECORD, MessageContainer, MessageHead, TopicChannel};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most rows of the tables of tables and topics.
const MOST_TOPICS: usize = 100_000;

/// rosbag2 database, read row by row.
pub(crate) struct SqliteMessages {
    path: PathBuf,
    pages: SqlitePages,
    rows: TableRows,
    columns: MessageColumns,
    /// Channels by topic.
    channels: BTreeMap<i64, Arc<TopicChannel>>,
    messages: u64,
    is_ended: bool,
    is_cut_short: bool,
}

/// Columns of the table `messages`.
#[derive(Clone, Copy, Debug)]
struct MessageColumns {
    topic_id: usize,
    timestamp: usize,
    data: usize,
}

/// Table by its definition.
struct TableDefinition {
    root: u32,
    sql: String,
}

impl TableDefinition {
    /// Position of a column.
    fn column(&self, name: &'static str) -> Result<usize, RowFault> {
        let (_, columns) = self.sql.split_once('(').unwrap_or_default();
        let names = columns.split(',').map(|c| {
            let first = c.split_whitespace().next().unwrap_or("");
            first.trim_matches(['"', '`', '[', ']'])
        });
        let found = names.into_iter().position(|n| n.eq_ignore_ascii_case(name));
        found.ok_or_else(|| RowFault::Field(name, format!("no such column in `{}`", self.sql)))
    }
}

/// Table of the database by its name.
fn table(pages: &mut SqlitePages, name: &'static str) -> Result<TableDefinition, RowFault> {
    let mut found = None;
    all_rows(pages, 1, |_, record| {
        let text = |i| column(record, i).and_then(|c| c.text());
        if text(0) == Some("table") && text(1) == Some(name) {
            let root = column(record, 3).and_then(|c| c.integer());
            let root = root.and_then(|r| u32::try_from(r).ok());
            found = root.zip(text(4).map(str::to_owned));
        }
    })?;
    let missing = || RowFault::Field("table", format!("no `{name}`: not a rosbag2 recording"));
    let (root, sql) = found.ok_or_else(missing)?;
    Ok(TableDefinition { root, sql })
}

/// Visits the rows of a small table.
fn all_rows(
    pages: &mut SqlitePages,
    root: u32,
    mut visit: impl FnMut(i64, &[u8]),
) -> Result<(), RowFault> {
    let (mut rows, mut record) = (TableRows::new(root), Vec::new());
    for _ in 0..MOST_TOPICS {
        let Some(place) = rows.next_row(pages, &mut record)? else {
            return Ok(());
        };
        read_overflow(pages, &place, &mut record)?;
        visit(place.id, &record);
    }
    Err(RowFault::Field(
        "topics",
        format!("more than {MOST_TOPICS}"),
    ))
}

/// Channels of the table `topics`.
fn topics(pages: &mut SqlitePages) -> Result<BTreeMap<i64, Arc<TopicChannel>>, RowFault> {
    let table = table(pages, "topics")?;
    let [name, kind, format] = ["name", "type", "serialization_format"].map(|c| table.column(c));
    let (name, kind, format) = (name?, kind?, format?);
    let mut channels = BTreeMap::new();
    all_rows(pages, table.root, |id, record| {
        let text = |i| column(record, i).and_then(|c| c.text()).unwrap_or("");
        let channel = TopicChannel::new(text(name), text(kind), text(format));
        channels.insert(id, Arc::new(channel));
    })?;
    Ok(channels)
}

/// Adds the file to a fault.
fn named(path: &Path, field: &str, fault: RowFault) -> FormatError {
    match fault {
        RowFault::Field(part, why) => FormatError::field(path, format!("{field}{part}"), why),
        RowFault::Io(e) if e.kind() == ErrorKind::UnexpectedEof => {
            FormatError::field(path, format!("{field}page"), "the file is cut short")
        }
        RowFault::Io(e) => FormatError::io(path, e),
    }
}

/// Refuses a database whose last messages are still in its write-ahead log.
fn check_log(path: &Path) -> Result<(), FormatError> {
    let mut log = path.as_os_str().to_owned();
    log.push("-wal");
    let log = PathBuf::from(log);
    if std::fs::metadata(&log).is_ok_and(|m| m.len() > 0) {
        let why = "holds messages that the database lacks; close its recorder, or run \
                   `sqlite3 FILE 'PRAGMA wal_checkpoint(TRUNCATE)'`";
        return Err(FormatError::field(&log, "write-ahead log", why));
    }
    Ok(())
}

impl SqliteMessages {
    /// Opens a database at its first message.
    ///
    /// # Errors
    /// Not an SQLite file, no tables of rosbag2, or an open write-ahead log.
    pub(crate) fn open(path: &Path) -> Result<Box<dyn MessageContainer>, FormatError> {
        check_log(path)?;
        let file = File::open(path).map_err(|e| FormatError::io(path, e))?;
        Self::tables(path, file)
            .map(|messages| Box::new(messages) as Box<dyn MessageContainer>)
            .map_err(|fault| named(path, "", fault))
    }

    fn tables(path: &Path, file: File) -> Result<Self, RowFault> {
        let mut pages = SqlitePages::new(file)?;
        let channels = topics(&mut pages)?;
        let table = table(&mut pages, "messages")?;
        Ok(Self {
            path: path.to_owned(),
            columns: MessageColumns {
                topic_id: table.column("topic_id")?,
                timestamp: table.column("timestamp")?,
                data: table.column("data")?,
            },
            rows: TableRows::new(table.root),
            pages,
            channels,
            messages: 0,
            is_ended: false,
            is_cut_short: false,
        })
    }

    /// Content of a row of a wanted channel, in `record`.
    fn message(
        &mut self,
        place: &RowPlace,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        record: &mut Vec<u8>,
    ) -> Result<Option<MessageHead>, RowFault> {
        let integer = |record: &[u8], i| column(record, i).and_then(|c| c.integer());
        let missing = |name| RowFault::Field(name, "no integer".into());
        let topic = integer(record, self.columns.topic_id).ok_or(missing("topic_id"))?;
        let time = integer(record, self.columns.timestamp).ok_or(missing("timestamp"))?;
        let Some(channel) = self.channels.get(&topic).filter(|c| is_wanted(c)) else {
            return Ok(None);
        };
        if place.length() > MAX_RECORD {
            let why = format!("{} bytes, expected at most {MAX_RECORD}", place.length());
            return Err(RowFault::Field("data", why));
        }
        read_overflow(&mut self.pages, place, record)?;
        let data = column(record, self.columns.data).and_then(|c| c.bytes());
        let length = data.ok_or(RowFault::Field("data", "no blob".into()))?.len();
        // It is the last column of every version; its bytes end the record.
        record.drain(..record.len() - length);
        Ok(Some(MessageHead {
            channel: channel.clone(),
            sequence: 0,
            log_time_ns: u64::try_from(time).unwrap_or(0),
            number: self.messages,
        }))
    }
}

impl MessageContainer for SqliteMessages {
    fn step(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, FormatError> {
        if self.is_ended {
            return Ok(ContainerStep::End);
        }
        let row = self.rows.next_row(&mut self.pages, data);
        let read = row.and_then(|row| {
            let Some(place) = row else {
                self.is_ended = true;
                return Ok(ContainerStep::End);
            };
            self.messages += 1;
            let head = self.message(&place, is_wanted, data)?;
            Ok(head.map_or(ContainerStep::Other, ContainerStep::Message))
        });
        read.or_else(|fault| {
            self.is_ended = true;
            match fault {
                RowFault::Io(e) if e.kind() == ErrorKind::UnexpectedEof && self.messages > 0 => {
                    self.is_cut_short = true;
                    Ok(ContainerStep::End)
                }
                fault => {
                    let after = format!("after message {}, ", self.messages);
                    Err(named(&self.path, &after, fault))
                }
            }
        })
    }
    fn channels(&self) -> Vec<Arc<TopicChannel>> {
        self.channels.values().cloned().collect()
    }
    fn is_cut_short(&self) -> bool {
        self.is_cut_short
    }
}
