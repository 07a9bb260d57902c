//! Pages of an SQLite database file.

use super::sqlite_row::RowFault;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// Size of the file's header, bytes.
pub(super) const FILE_HEADER: usize = 100;
const MAGIC: &[u8; 16] = b"SQLite format 3\0";
/// Smallest part of a page in use, bytes.
const LEAST_USABLE: usize = 480;

/// Pages by number, from one.
#[derive(Debug)]
pub(super) struct SqlitePages {
    file: File,
    page_size: usize,
    /// Bytes of a page before its reserved end.
    usable: usize,
    /// Whole pages of the file.
    count: u32,
    /// Bytes of the file.
    length: u64,
}

impl SqlitePages {
    /// Reads the header.
    ///
    /// # Errors
    /// Not an SQLite file, or sizes that cannot be.
    pub(super) fn new(mut file: File) -> Result<Self, RowFault> {
        let length = file.metadata()?.len();
        let mut header = [0; FILE_HEADER];
        file.read_exact(&mut header)?;
        if header[..16] != *MAGIC {
            let why = "expected `SQLite format 3`";
            return Err(RowFault::Field("magic", why.into()));
        }
        let page_size = match u16::from_be_bytes([header[16], header[17]]) {
            1 => 1 << 16,
            n => usize::from(n),
        };
        let usable = page_size.saturating_sub(header[20].into());
        if !page_size.is_power_of_two() || usable < LEAST_USABLE {
            let why = format!("{page_size}, expected a power of two, 512 to 65536");
            return Err(RowFault::Field("page size", why));
        }
        if header[56..60] != [0, 0, 0, 1] {
            let why = "expected UTF-8";
            return Err(RowFault::Field("text encoding", why.into()));
        }
        let count = u32::try_from(length / page_size as u64).unwrap_or(u32::MAX);
        Ok(Self {
            file,
            page_size,
            usable,
            count,
            length,
        })
    }

    /// Bytes of a page before its reserved end.
    pub(super) fn usable(&self) -> usize {
        self.usable
    }
    /// Whole pages of the file.
    pub(super) fn count(&self) -> u32 {
        self.count
    }
    /// Bytes of the file.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Reads the usable bytes of a page into `page`.
    ///
    /// # Errors
    /// A page that the file lacks.
    pub(super) fn read(&mut self, number: u32, page: &mut Vec<u8>) -> Result<(), RowFault> {
        if number == 0 {
            return Err(RowFault::Field("page", "number 0".into()));
        }
        if number > self.count {
            return Err(RowFault::Io(io::ErrorKind::UnexpectedEof.into()));
        }
        let at = u64::from(number - 1) * self.page_size as u64;
        self.file.seek(SeekFrom::Start(at))?;
        page.resize(self.usable, 0);
        self.file.read_exact(page)?;
        Ok(())
    }
}
