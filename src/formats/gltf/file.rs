//! glTF file: container, JSON document and buffers. Extensions that its geometry needs are read or refused by name.

use super::accessors::Accessors;
use crate::FormatError;
use ::gltf::Document;
use ::gltf::json::validation::{Error, Validate};
use ::gltf::json::{Path as JsonPath, Root};
use serde_json::Value;
use std::path::Path;

/// Required extensions that are read: quantised accessors, compressed buffers, instances.
const GEOMETRY: [&str; 5] = [
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    super::meshopt::EXTENSIONS[0],
    super::meshopt::EXTENSIONS[1],
    super::draco::EXTENSION,
];
/// Beginnings of the names of extensions that change colours and light only.
const APPEARANCE: [&str; 4] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
];
/// Kind of the binary chunk.
const BINARY: &[u8] = b"BIN\0";

/// Use of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Triangles only.
    Geometry,
    /// Triangles and colours.
    Scan,
}

/// Document whose indices are in range, and the contents of its buffers.
pub(super) struct GltfFile {
    pub(super) document: Document,
    /// The document as JSON, for extensions.
    pub(super) json: Value,
    pub(super) accessors: Accessors,
}

impl GltfFile {
    /// Reads the bytes of a `.glb` or `.gltf` file; external buffers lie beside `origin`.
    ///
    /// # Errors
    /// Names the chunk, object or extension at fault.
    pub(super) fn open(bytes: &[u8], origin: &Path, purpose: Purpose) -> Result<Self, FormatError> {
        let (text, blob) = chunks(bytes, origin)?;
        let fault = |field: &str, why: String| FormatError::field(origin, field, why);
        let mut json: Value =
            serde_json::from_slice(text).map_err(|e| fault("json", e.to_string()))?;
        check_extensions(&json, origin, purpose)?;
        check_positions(&json, origin)?;
        add_sources(&mut json);

        // Into text and back: numbers of 0.0 for integers are refused either way.
        let root: Root =
            serde_json::from_value(json.clone()).map_err(|e| fault("gltf", e.to_string()))?;
        check_root(&root).map_err(|why| fault("gltf", why))?;
        let document = Document::from_json_without_validation(root);
        let accessors = Accessors::read(&document, &json, blob, origin)?;
        Ok(Self {
            document,
            json,
            accessors,
        })
    }

    /// Extension of an object of a list.
    pub(super) fn extension(&self, list: &str, index: usize, name: &str) -> Option<&Value> {
        self.json
            .get(list)?
            .get(index)?
            .get("extensions")?
            .get(name)
    }
}

/// JSON text and binary chunk of a file.
///
/// # Errors
/// Names the header or chunk that is longer than the file.
fn chunks<'b>(bytes: &'b [u8], origin: &Path) -> Result<(&'b [u8], Option<Vec<u8>>), FormatError> {
    if !bytes.starts_with(b"glTF") {
        let text = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
        return Ok((text, None));
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let cut = |field: &str| {
        let why = "longer than the file: it is cut short or damaged";
        FormatError::field(origin, field, why)
    };
    if word(4) != Some(2) {
        let why = "version 2 is read; export glTF 2.0";
        return Err(FormatError::field(origin, "header version", why));
    }
    let total = word(8).ok_or_else(|| cut("header"))?;
    if total > bytes.len() || total < 20 {
        return Err(cut("header length"));
    }
    let (mut at, mut text, mut blob) = (12, None, None);
    while at < total {
        let length = word(at).ok_or_else(|| cut("chunk"))?;
        let kind = bytes.get(at + 4..at + 8).ok_or_else(|| cut("chunk"))?;
        let end = at.saturating_add(8).saturating_add(length);
        if end > total {
            return Err(cut("chunk length"));
        }
        let data = &bytes[at + 8..end];
        match kind {
            b"JSON" if text.is_none() => text = Some(data),
            BINARY if blob.is_none() => blob = Some(data.to_vec()),
            _ => {}
        }
        at = end;
    }
    Ok((text.unwrap_or_default(), blob))
}

/// Items of a list; none if it is absent.
fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    let list = value.get(key).and_then(Value::as_array);
    list.map(Vec::as_slice).unwrap_or_default()
}

/// Refuses required extensions that are not read.
fn check_extensions(json: &Value, origin: &Path, purpose: Purpose) -> Result<(), FormatError> {
    for name in list(json, "extensionsRequired")
        .iter()
        .filter_map(Value::as_str)
    {
        let is_appearance = APPEARANCE.iter().any(|start| name.starts_with(start));
        let is_read = GEOMETRY.contains(&name) || (purpose == Purpose::Geometry && is_appearance);
        if !is_read {
            let why = format!("`{name}` is not read; export without this extension");
            return Err(FormatError::field(origin, "extensionsRequired", why));
        }
    }
    Ok(())
}

/// Checks that the accessor of every POSITION exists: the gltf crate indexes it unchecked.
fn check_positions(json: &Value, origin: &Path) -> Result<(), FormatError> {
    let accessors = list(json, "accessors").len() as u64;
    for (m, mesh) in list(json, "meshes").iter().enumerate() {
        for (k, p) in list(mesh, "primitives").iter().enumerate() {
            let position = p
                .get("attributes")
                .and_then(|a| a.get("POSITION")?.as_u64());
            if let Some(i) = position.filter(|i| *i >= accessors) {
                let why = format!("accessor {i} of {accessors} does not exist");
                return Err(FormatError::field(
                    origin,
                    format!("mesh {m}, primitive {k}: POSITION"),
                    why,
                ));
            }
        }
    }
    Ok(())
}

/// Gives textures whose image only an extension names (WebP, Basis Universal) that image, which the crate demands.
fn add_sources(json: &mut Value) {
    let textures = json.get_mut("textures").and_then(Value::as_array_mut);
    for texture in textures.into_iter().flatten() {
        let Some(texture) = texture.as_object_mut() else {
            continue;
        };
        let extensions = texture.get("extensions").and_then(Value::as_object);
        let mut sources = extensions.into_iter().flatten();
        let source = sources.find_map(|(_, e)| e.get("source").cloned());
        if let (false, Some(source)) = (texture.contains_key("source"), source) {
            texture.insert("source".into(), source);
        }
    }
}

/// Checks that indices are in range and values known. Bounds of accessors are not used, those without a buffer view are zero or
/// decompressed, required extensions are checked apart.
fn check_root(root: &Root) -> Result<(), String> {
    let mut faults = Vec::new();
    root.validate(root, JsonPath::new, &mut |path, error| {
        let path = path().as_str().to_owned();
        let is_unused = path.ends_with(".min") || path.ends_with(".max");
        let is_given = error == Error::Missing && path.ends_with("].bufferView");
        if !is_unused && !is_given && error != Error::Unsupported {
            faults.push(format!("{path}: {error}"));
        }
    });
    match faults.as_slice() {
        [] => Ok(()),
        [first] => Err(first.clone()),
        [first, rest @ ..] => Err(format!("{first}; {} more faults", rest.len())),
    }
}
