//! Containers from their parts, with right lengths and checksums, so that mutations reach what lies inside.

use crate::bundle::{Bundle, Member};
use gltf::binary::{Glb, Header};
use mcap::records::MessageHeader;
use mcap::{MessageStream, WriteOptions};
use std::collections::BTreeMap;
use std::io::{Cursor, Read, Write};
use zip::write::FileOptions;
use zip::{CompressionMethod, ZipWriter};

/// ZIP archive of stored members, as NumPy's `savez` writes it.
///
/// # Errors
/// Text of the writer's error, as for two members of one name.
pub(crate) fn zip(members: &[Member]) -> Result<Vec<u8>, String> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = FileOptions::default().compression_method(CompressionMethod::Stored);
    for m in members {
        archive
            .start_file(m.name.as_str(), stored)
            .map_err(|e| e.to_string())?;
        archive.write_all(&m.bytes).map_err(|e| e.to_string())?;
    }
    let done = archive.finish().map_err(|e| e.to_string())?;
    Ok(done.into_inner())
}

/// Members of a ZIP archive, but folders.
pub(crate) fn unpack_zip(archive: &[u8]) -> Option<Bundle> {
    let mut archive = zip::ZipArchive::new(Cursor::new(archive)).ok()?;
    let mut bundle = Bundle::default();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).ok()?;
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).ok()?;
        bundle = bundle.and(entry.name(), bytes);
    }
    Some(bundle)
}

/// Binary glTF of a JSON and a binary chunk.
///
/// # Errors
/// Text of the writer's error.
pub(crate) fn glb(json: &[u8], bin: &[u8]) -> Result<Vec<u8>, String> {
    let glb = Glb {
        // The writer sets its own.
        header: Header {
            magic: *b"glTF",
            version: 2,
            length: 0,
        },
        json: json.into(),
        bin: Some(bin.into()),
    };
    glb.to_vec().map_err(|e| e.to_string())
}

/// Chunks of a binary glTF as `model.json` and `model.bin`.
pub(crate) fn unpack_glb(glb: &[u8]) -> Option<Bundle> {
    let glb = Glb::from_slice(glb).ok()?;
    Some(Bundle::of("model.json", glb.json).and("model.bin", glb.bin?))
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
