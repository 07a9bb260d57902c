//! Recordings of ROS 2: a folder with `metadata.yaml`, and its SQLite (`.db3`) or MCAP files.
//!
//! SQLite is read here rather than by its library: two tables are walked in order, which takes no queries, no C build,
//! and memory for one row (<https://sqlite.org/fileformat.html>).

mod folder;
mod reader;
mod sqlite_pages;
mod sqlite_row;
mod sqlite_table;

pub(crate) use folder::{is_folder, open_folder};
pub(crate) use reader::SqliteMessages;
