//! Records of a bag: a header of named fields, then data.

use crate::chunk_records::read_bytes;
use std::io::{self, Read};

/// Largest header, bytes: fields hold a topic's name at most.
const MAX_HEADER: usize = 1 << 16;

/// Codes of records.
pub(super) mod op {
    pub(in super::super) const MESSAGE: u8 = 2;
    pub(in super::super) const CHUNK: u8 = 5;
    pub(in super::super) const CONNECTION: u8 = 7;
}

/// Fault of a record.
#[derive(Debug)]
pub(super) enum RecordFault {
    /// The bytes end within the record.
    CutShort,
    /// Unusable field, and why.
    Field(&'static str, String),
    /// Error of the system or the decompressor.
    Io(io::Error),
}

impl From<io::Error> for RecordFault {
    fn from(e: io::Error) -> Self {
        match e.kind() {
            io::ErrorKind::UnexpectedEof => Self::CutShort,
            _ => Self::Io(e),
        }
    }
}

/// Header of a record, and the length of the data that follow.
#[derive(Debug, Default)]
pub(super) struct RecordHeader {
    fields: Vec<u8>,
    /// Bytes.
    pub(super) data_length: u64,
}

impl RecordHeader {
    /// Reads a header; `None` at the end.
    ///
    /// # Errors
    /// An end within it, or a length above [`MAX_HEADER`].
    pub(super) fn read(from: &mut dyn Read) -> Result<Option<Self>, RecordFault> {
        let mut length = [0; 4];
        if from.read(&mut length[..1])? == 0 {
            return Ok(None);
        }
        from.read_exact(&mut length[1..])?;
        let length = u32::from_le_bytes(length) as usize;
        if length > MAX_HEADER {
            let why = format!("{length} bytes, expected at most {MAX_HEADER}");
            return Err(RecordFault::Field("header length", why));
        }
        let mut fields = vec![0; length];
        from.read_exact(&mut fields)?;
        let mut data_length = [0; 4];
        from.read_exact(&mut data_length)?;
        Ok(Some(Self {
            fields,
            data_length: u32::from_le_bytes(data_length).into(),
        }))
    }

    /// Bytes of a field.
    ///
    /// # Errors
    /// None of this name.
    pub(super) fn field(&self, name: &'static str) -> Result<&[u8], RecordFault> {
        field(&self.fields, name)
    }

    /// A field of fixed size.
    ///
    /// # Errors
    /// None of this name and size.
    pub(super) fn number<const N: usize>(
        &self,
        name: &'static str,
    ) -> Result<[u8; N], RecordFault> {
        let bytes = self.field(name)?;
        bytes.try_into().map_err(|_| {
            let why = format!("{} bytes, expected {N}", bytes.len());
            RecordFault::Field(name, why)
        })
    }
}

/// Finds a field `NAME=VALUE` among fields with their lengths.
///
/// # Errors
/// None of this name.
pub(super) fn field<'a>(mut fields: &'a [u8], name: &'static str) -> Result<&'a [u8], RecordFault> {
    while let Some((length, rest)) = fields.split_first_chunk() {
        let Some((one, rest)) = rest.split_at_checked(u32::from_le_bytes(*length) as usize) else {
            break;
        };
        let value = one.strip_prefix(name.as_bytes());
        if let Some(value) = value.and_then(|v| v.strip_prefix(b"=")) {
            return Ok(value);
        }
        fields = rest;
    }
    Err(RecordFault::Field(name, "missing".into()))
}

/// Reads data of `length` bytes, at most `limit`.
///
/// # Errors
/// Fewer bytes, or a greater length.
pub(super) fn read_data(
    from: &mut dyn Read,
    length: u64,
    limit: usize,
    data: &mut Vec<u8>,
) -> Result<(), RecordFault> {
    if length > limit as u64 {
        let why = format!("{length} bytes, expected at most {limit}");
        return Err(RecordFault::Field("data length", why));
    }
    Ok(read_bytes(from, length, data)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(fields: &[&[u8]]) -> Vec<u8> {
        let mut content = Vec::new();
        for f in fields {
            content.extend((f.len() as u32).to_le_bytes());
            content.extend(*f);
        }
        let mut out = (content.len() as u32).to_le_bytes().to_vec();
        out.extend(content);
        out.extend(9u32.to_le_bytes());
        out
    }

    #[test]
    fn fields_are_found_by_name_and_their_size_checked() {
        let bytes = header(&[b"op=\x02", b"topic=/a=b"]);
        let h = RecordHeader::read(&mut &bytes[..])
            .expect("reads")
            .expect("a header");
        assert_eq!(h.data_length, 9);
        assert_eq!(h.number::<1>("op").expect("op"), [2]);
        assert_eq!(h.field("topic").expect("topic"), b"/a=b");
        assert!(matches!(
            h.number::<4>("op"),
            Err(RecordFault::Field("op", _))
        ));
        assert!(matches!(
            h.field("conn"),
            Err(RecordFault::Field("conn", _))
        ));
        for cut in 1..bytes.len() {
            let read = RecordHeader::read(&mut &bytes[..cut]);
            assert!(matches!(read, Err(RecordFault::CutShort)), "cut at {cut}");
        }
        assert!(RecordHeader::read(&mut &bytes[..0]).is_ok_and(|h| h.is_none()));
        let long = [255, 255, 255, 127, 0];
        assert!(matches!(
            RecordHeader::read(&mut &long[..]),
            Err(RecordFault::Field("header length", _))
        ));
    }
}
