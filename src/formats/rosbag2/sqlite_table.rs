//! Walk over the rows of an SQLite table, in the order of their numbers.

use super::sqlite_pages::{FILE_HEADER, SqlitePages};
use super::sqlite_row::{RowFault, varint};

/// Deepest tree, levels: SQLite's own limit.
const MAX_DEPTH: usize = 20;
/// Kinds of pages of a table's tree.
const INTERIOR: u8 = 5;
const LEAF: u8 = 13;

/// A page under way.
#[derive(Debug)]
struct TreeLevel {
    page: Vec<u8>,
    /// Start of its header: after the file's on page one.
    header: usize,
    is_leaf: bool,
    cells: usize,
    /// Next cell, or child.
    next: usize,
}

impl TreeLevel {
    fn u16_at(&self, at: usize) -> Option<usize> {
        let bytes = self.page.get(at..at + 2)?;
        Some(usize::from(u16::from_be_bytes([bytes[0], bytes[1]])))
    }
    fn u32_at(&self, at: usize) -> Option<u32> {
        let bytes = self.page.get(at..at + 4)?;
        Some(u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }
    /// Bytes from a cell to the page's end.
    fn cell(&self, index: usize) -> Option<&[u8]> {
        let header = self.header + if self.is_leaf { 8 } else { 12 };
        self.page.get(self.u16_at(header + 2 * index)?..)
    }
    /// Child of an interior page; the last one has a field of its own.
    fn child(&self, index: usize) -> Option<u32> {
        if index == self.cells {
            return self.u32_at(self.header + 8);
        }
        let cell = self.cell(index)?;
        Some(u32::from_be_bytes([
            *cell.first()?,
            *cell.get(1)?,
            *cell.get(2)?,
            *cell.get(3)?,
        ]))
    }
}

/// Row of a table: its first bytes lie on its page, the others on overflow pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RowPlace {
    /// Number of the row.
    pub(super) id: i64,
    /// Bytes of the record.
    length: usize,
    /// First overflow page.
    overflow: Option<u32>,
}

impl RowPlace {
    /// Bytes of the record.
    pub(super) fn length(&self) -> usize {
        self.length
    }
}

/// Position in a table's tree.
#[derive(Debug)]
pub(super) struct TableRows {
    root: Option<u32>,
    levels: Vec<TreeLevel>,
    /// Pages of the tree read so far; more than the file has are a loop.
    pages_read: u32,
}

fn damaged(part: &'static str) -> RowFault {
    RowFault::Field(part, "damaged".into())
}

impl TableRows {
    /// Walk from the first row of the table at page `root`.
    pub(super) fn new(root: u32) -> Self {
        Self {
            root: Some(root),
            levels: Vec::new(),
            pages_read: 0,
        }
    }

    fn enter(&mut self, pages: &mut SqlitePages, number: u32) -> Result<(), RowFault> {
        self.pages_read += 1;
        if self.levels.len() >= MAX_DEPTH || self.pages_read > pages.count() {
            return Err(damaged("table tree"));
        }
        let mut page = Vec::new();
        pages.read(number, &mut page)?;
        let header = if number == 1 { FILE_HEADER } else { 0 };
        let is_leaf = match page.get(header) {
            Some(&LEAF) => true,
            Some(&INTERIOR) => false,
            _ => return Err(damaged("table page")),
        };
        let mut level = TreeLevel {
            page,
            header,
            is_leaf,
            cells: 0,
            next: 0,
        };
        level.cells = level.u16_at(header + 3).ok_or(damaged("table page"))?;
        self.levels.push(level);
        Ok(())
    }

    /// The next row; the part of its record on its own page replaces `record`.
    ///
    /// # Errors
    /// A damaged page, or one that the file lacks.
    pub(super) fn next_row(
        &mut self,
        pages: &mut SqlitePages,
        record: &mut Vec<u8>,
    ) -> Result<Option<RowPlace>, RowFault> {
        if let Some(root) = self.root.take() {
            self.enter(pages, root)?;
        }
        while let Some(level) = self.levels.last_mut() {
            let index = level.next;
            level.next += 1;
            if level.is_leaf && index < level.cells {
                let cell = level.cell(index).ok_or(damaged("table cell"))?;
                return row(pages, cell, record).map(Some);
            }
            if level.is_leaf || index > level.cells {
                self.levels.pop();
                continue;
            }
            let child = level.child(index).ok_or(damaged("table cell"))?;
            self.enter(pages, child)?;
        }
        Ok(None)
    }
}

/// Place of the row of a leaf cell, and its record's local bytes.
fn row(pages: &SqlitePages, mut cell: &[u8], record: &mut Vec<u8>) -> Result<RowPlace, RowFault> {
    let fault = || damaged("table cell");
    let length = varint(&mut cell).ok_or_else(fault)?;
    let id = varint(&mut cell).ok_or_else(fault)? as i64;
    if length > pages.length() {
        let why = format!("{length} bytes, the file has {}", pages.length());
        return Err(RowFault::Field("row length", why));
    }
    let length = length as usize;
    let local = local_bytes(pages.usable(), length);
    let (bytes, rest) = cell.split_at_checked(local).ok_or_else(fault)?;
    record.clear();
    record.extend_from_slice(bytes);
    let overflow = match local < length {
        true => Some(u32::from_be_bytes(*rest.first_chunk().ok_or_else(fault)?)),
        false => None,
    };
    Ok(RowPlace {
        id,
        length,
        overflow,
    })
}

/// Bytes of a record of `length` bytes on its leaf page (file format, 1.6).
fn local_bytes(usable: usize, length: usize) -> usize {
    let most = usable - 35;
    if length <= most {
        return length;
    }
    let least = (usable - 12) * 32 / 255 - 23;
    let fitting = least + (length - least) % (usable - 4);
    if fitting <= most { fitting } else { least }
}

/// Appends the rest of a row's record from its overflow pages.
///
/// # Errors
/// A page that the file lacks.
pub(super) fn read_overflow(
    pages: &mut SqlitePages,
    place: &RowPlace,
    record: &mut Vec<u8>,
) -> Result<(), RowFault> {
    let (mut next, mut page) = (place.overflow, Vec::new());
    while record.len() < place.length {
        let number = next.ok_or(damaged("overflow page"))?;
        pages.read(number, &mut page)?;
        let (link, bytes) = page.split_first_chunk().ok_or(damaged("overflow page"))?;
        next = Some(u32::from_be_bytes(*link));
        let take = bytes.len().min(place.length - record.len());
        record.extend_from_slice(&bytes[..take]);
    }
    Ok(())
}
