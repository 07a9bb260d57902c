//! Origin of faces in their file: part and line.

use std::fmt;

/// Names of a part of a mesh file; empty where the file has none.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct PartName {
    /// OBJ object (`o`), glTF node.
    pub object: String,
    /// OBJ group (`g`), glTF mesh.
    pub group: String,
    /// Material.
    pub material: String,
}

impl fmt::Display for PartName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = [&self.object, &self.group, &self.material];
        let mut said: Vec<&str> = Vec::new();
        for name in names.into_iter().filter(|n| !n.is_empty()) {
            if !said.contains(&name.as_str()) {
                said.push(name);
            }
        }
        f.write_str(&said.join(" / "))
    }
}

/// Origin of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceOrigin {
    /// Index in [`FaceOrigins::parts`].
    pub part: u32,
    /// Line of an OBJ file, from 1; 0 for other formats.
    pub line: u32,
}

/// Origins of the faces of a mesh. Empty for a mesh that comes from no file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaceOrigins {
    /// Parts of the file, in its order.
    pub parts: Vec<PartName>,
    /// Origin of each face, shape `[faces]`.
    pub faces: Vec<FaceOrigin>,
}

impl FaceOrigins {
    /// Names of the part that a face belongs to.
    pub fn part_of(&self, face: usize) -> Option<&PartName> {
        self.parts.get(self.faces.get(face)?.part as usize)
    }
    /// Parts with faces and the count of these, in the order of the file.
    pub fn counts(&self) -> Vec<(&PartName, usize)> {
        let mut counts = vec![0; self.parts.len()];
        for face in &self.faces {
            if let Some(count) = counts.get_mut(face.part as usize) {
                *count += 1;
            }
        }
        self.parts
            .iter()
            .zip(counts)
            .filter(|(_, n)| *n > 0)
            .collect()
    }
    /// Origins of these faces, in their order.
    #[must_use]
    pub fn of_faces(&self, faces: impl IntoIterator<Item = usize>) -> Self {
        let own = faces.into_iter().filter_map(|f| self.faces.get(f).copied());
        Self {
            parts: self.parts.clone(),
            faces: own.collect(),
        }
    }
    /// Name of a face in messages: its line, or its number and part.
    pub fn place(&self, face: usize) -> String {
        let line = self.faces.get(face).map_or(0, |f| f.line);
        let part = self
            .part_of(face)
            .map(PartName::to_string)
            .filter(|p| !p.is_empty());
        match (line, part) {
            (0, None) => format!("face {face}"),
            (0, Some(part)) => format!("face {face} of `{part}`"),
            (line, None) => format!("line {line}"),
            (line, Some(part)) => format!("line {line} of `{part}`"),
        }
    }
}
