//! Primitives compressed by Draco: extension KHR_draco_mesh_compression. The crate draco-core decodes the bitstream.

use super::accessor_index::accessor_at;
use super::buffers::Buffers;
use ::gltf::accessor::DataType;
use ::gltf::{Accessor, Document};
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use serde_json::Value;
use std::collections::HashMap;

/// Name of the extension.
pub(super) const EXTENSION: &str = "KHR_draco_mesh_compression";
/// Most points and faces of a primitive.
const MOST_ELEMENTS: u64 = 20_000_000;
/// Most decompressed bytes of a primitive.
const MOST_BYTES: u64 = 1 << 30;

/// Place of a fault, and the fault.
type PlaceFault = (String, String);

/// Decompressed rows of the accessors of primitives that have the extension, by the index of the accessor.
///
/// # Errors
/// The primitive at fault, and the fault.
pub(super) fn decoded_rows(
    document: &Document,
    json: &Value,
    buffers: &Buffers,
) -> Result<HashMap<usize, Vec<u8>>, PlaceFault> {
    let mut out = HashMap::new();
    let meshes = json.get("meshes").and_then(Value::as_array);
    for (m, mesh) in meshes.into_iter().flatten().enumerate() {
        let primitives = mesh.get("primitives").and_then(Value::as_array);
        for (k, primitive) in primitives.into_iter().flatten().enumerate() {
            let Some(extension) = primitive.get("extensions").and_then(|e| e.get(EXTENSION)) else {
                continue;
            };
            let reader = DracoReader {
                document,
                buffers,
                primitive,
                extension,
            };
            let place = || format!("mesh {m}, primitive {k}: {EXTENSION}");
            reader.read(&mut out).map_err(|why| (place(), why))?;
        }
    }
    Ok(out)
}

/// Compressed primitive.
struct DracoReader<'a> {
    document: &'a Document,
    buffers: &'a Buffers,
    primitive: &'a Value,
    extension: &'a Value,
}

impl DracoReader<'_> {
    /// Adds the rows of the accessors.
    fn read(&self, out: &mut HashMap<usize, Vec<u8>>) -> Result<(), String> {
        let view = index(self.extension.get("bufferView")).ok_or("no buffer view")?;
        let view = self
            .document
            .views()
            .nth(view)
            .ok_or("no such buffer view")?;
        let mesh = decoded(self.buffers.view(&view)?)?;
        if let Some(a) = accessor_at(self.document, self.primitive.get("indices"))? {
            let corners = mesh.faces().iter().flatten();
            let corners: Vec<f64> = corners.map(|p| f64::from(p.0)).collect();
            out.insert(a.index(), rows(&a, &corners)?);
        }
        let attributes = self.extension.get("attributes").and_then(Value::as_object);
        for (name, id) in attributes.into_iter().flatten() {
            let own = self.primitive.get("attributes").and_then(|a| a.get(name));
            let Some(a) = accessor_at(self.document, own)? else {
                continue;
            };
            let id = index(Some(id)).and_then(|id| u32::try_from(id).ok());
            let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
            let attribute = attribute.ok_or_else(|| format!("{name} is not in the stream"))?;
            let columns = a.dimensions().multiplicity();
            if usize::from(attribute.num_components()) != columns {
                let n = attribute.num_components();
                return Err(format!("{name} has {n} numbers, {columns} are announced"));
            }
            let values = attribute.read_f32s(mesh.num_points(), columns);
            let values: Vec<f64> = values.into_iter().map(f64::from).collect();
            out.insert(a.index(), rows(&a, &values)?);
        }
        Ok(())
    }
}

fn index(value: Option<&Value>) -> Option<usize> {
    usize::try_from(value?.as_u64()?).ok()
}

/// Mesh of a Draco stream.
fn decoded(data: &[u8]) -> Result<Mesh, String> {
    let limits = DecodeLimits::default()
        .with_max_points(MOST_ELEMENTS)
        .with_max_faces(MOST_ELEMENTS)
        .with_max_decoded_bytes(MOST_BYTES);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(data).with_limits(limits);
    let decoded = MeshDecoder::new().decode(&mut buffer, &mut mesh);
    decoded.map_err(|e| format!("the stream cannot be decoded: {e}"))?;
    Ok(mesh)
}

/// Rows of an accessor that has these numbers, in its component type.
///
/// # Errors
/// Another count of numbers than the accessor announces.
fn rows(a: &Accessor<'_>, values: &[f64]) -> Result<Vec<u8>, String> {
    let announced = a.count().saturating_mul(a.dimensions().multiplicity());
    if values.len() != announced {
        let n = values.len();
        return Err(format!(
            "{n} numbers, {announced} are announced by accessor {}",
            a.index()
        ));
    }
    let mut out = Vec::with_capacity(values.len() * a.data_type().size());
    for value in values {
        match a.data_type() {
            DataType::F32 => out.extend((*value as f32).to_le_bytes()),
            DataType::I8 => out.extend((*value as i8).to_le_bytes()),
            DataType::U8 => out.extend((*value as u8).to_le_bytes()),
            DataType::I16 => out.extend((*value as i16).to_le_bytes()),
            DataType::U16 => out.extend((*value as u16).to_le_bytes()),
            DataType::U32 => out.extend((*value as u32).to_le_bytes()),
        }
    }
    Ok(out)
}
