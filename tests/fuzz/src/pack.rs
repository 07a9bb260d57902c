//! Containers from their parts, with right lengths and checksums, so that mutations reach what lies inside.

use crate::bundle::{Bundle, Member};
use flate2::Crc;
use mcap::records::MessageHeader;
use mcap::{MessageStream, WriteOptions};
use std::collections::BTreeMap;
use std::io::Cursor;

/// ZIP archive of stored members, as NumPy's `savez` writes it.
pub(crate) fn zip(members: &[Member]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for m in members {
        let mut crc = Crc::new();
        crc.update(&m.bytes);
        let size = (m.bytes.len() as u32).to_le_bytes();
        // Versions, flags, method (stored), time and date; checksum and sizes; lengths of name and extra field.
        let mut common = vec![20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0];
        common.extend_from_slice(&crc.sum().to_le_bytes());
        common.extend_from_slice(&size);
        common.extend_from_slice(&size);
        common.extend_from_slice(&(m.name.len() as u16).to_le_bytes());
        common.extend_from_slice(&[0, 0]);

        let offset = (out.len() as u32).to_le_bytes();
        directory.extend_from_slice(b"PK\x01\x02\x14\0");
        directory.extend_from_slice(&common);
        // Comment, disk, attributes.
        directory.extend_from_slice(&[0; 10]);
        directory.extend_from_slice(&offset);
        directory.extend_from_slice(m.name.as_bytes());

        out.extend_from_slice(b"PK\x03\x04");
        out.extend_from_slice(&common);
        out.extend_from_slice(m.name.as_bytes());
        out.extend_from_slice(&m.bytes);
    }
    let (count, start) = (members.len() as u16, out.len() as u32);
    out.extend_from_slice(&directory);
    out.extend_from_slice(b"PK\x05\x06\0\0\0\0");
    out.extend_from_slice(&count.to_le_bytes());
    out.extend_from_slice(&count.to_le_bytes());
    out.extend_from_slice(&(directory.len() as u32).to_le_bytes());
    out.extend_from_slice(&start.to_le_bytes());
    out.extend_from_slice(&[0, 0]);
    out
}

/// Binary glTF of a JSON and a binary chunk.
pub(crate) fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, data, fill) in [(b"JSON", json, b' '), (b"BIN\0", bin, 0)] {
        let padded = data.len().next_multiple_of(4);
        out.extend_from_slice(&(padded as u32).to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(data);
        out.resize(out.len() + padded - data.len(), fill);
    }
    let length = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&length);
    out
}

/// Chunks of a binary glTF as `model.json` and `model.bin`.
pub(crate) fn unpack_glb(glb: &[u8]) -> Option<Bundle> {
    let length = |at: usize| Some(u32::from_le_bytes(*glb.get(at..)?.first_chunk()?) as usize);
    let json = length(12)?;
    let bin = length(20 + json)?;
    let bundle = Bundle::of("model.json", glb.get(20..20 + json)?);
    Some(bundle.and("model.bin", glb.get(28 + json..28 + json + bin)?))
}

/// MCAP file of messages named `NUMBER.SCHEMA.pb`, one channel for each schema, times a thirtieth of a second apart.
///
/// # Errors
/// Text of the writer's error.
pub(crate) fn mcap(members: &[Member]) -> Result<Vec<u8>, String> {
    let fault = |e: mcap::McapError| e.to_string();
    let mut out = Cursor::new(Vec::new());
    let options = WriteOptions::new().compression(None);
    let mut writer = options.create(&mut out).map_err(fault)?;
    let mut channels = BTreeMap::new();
    for (i, m) in members.iter().enumerate() {
        let schema = m.name.split('.').nth(1).unwrap_or_default();
        let known = channels.get(schema).copied();
        let channel_id = match known {
            Some(id) => id,
            None => {
                let name = format!("foxglove.{schema}");
                let s = writer.add_schema(&name, "protobuf", b"-").map_err(fault)?;
                let none = BTreeMap::new();
                let c = writer.add_channel(s, schema, "protobuf", &none);
                *channels.entry(schema).or_insert(c.map_err(fault)?)
            }
        };
        let log_time = i as u64 * 1_000_000;
        let header = MessageHeader {
            channel_id,
            sequence: i as u32,
            log_time,
            publish_time: log_time,
        };
        writer
            .write_to_known_channel(&header, &m.bytes)
            .map_err(fault)?;
    }
    writer.finish().map_err(fault)?;
    drop(writer);
    Ok(out.into_inner())
}

/// Messages of an MCAP file under the names of [`mcap`].
pub(crate) fn unpack_mcap(file: &[u8]) -> Option<Bundle> {
    let mut bundle = Bundle::default();
    for (i, message) in MessageStream::new(file).ok()?.enumerate() {
        let message = message.ok()?;
        let schema = message.channel.schema.as_ref()?.name.clone();
        let short = schema.strip_prefix("foxglove.").unwrap_or(&schema);
        bundle = bundle.and(&format!("{i:03}.{short}.pb"), message.data.into_owned());
    }
    Some(bundle)
}
