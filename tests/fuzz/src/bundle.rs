//! Input of a target: named members, so that formats of several files (OBJ with MTL, a recording's folder) and containers
//! (npz, glb, MCAP) are mutated inside and packed anew.

use prost::Message;
use std::fs;
use std::io;
use std::path::{Component, Path};

/// One file, or one part of a container. The extension of its name selects the mutations.
#[derive(Clone, PartialEq, Eq, Message)]
pub struct Member {
    /// Relative path.
    #[prost(string, tag = 1)]
    pub name: String,
    /// Content.
    #[prost(bytes = "vec", tag = 2)]
    pub bytes: Vec<u8>,
}

/// All members of an input, at least one in inputs of a campaign; a message, for the file from which a supervisor recovers
/// the input of a crash.
#[derive(Clone, PartialEq, Eq, Message)]
pub struct Bundle(#[prost(message, repeated, tag = 1)] pub Vec<Member>);

impl Bundle {
    /// Bundle of one member.
    pub fn of(name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self::default().and(name, bytes)
    }
    /// Adds a member.
    #[must_use]
    pub fn and(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.0.push(Member {
            name: name.into(),
            bytes: bytes.into(),
        });
        self
    }
    /// Bytes of a member; empty if it is missing.
    pub fn get(&self, name: &str) -> &[u8] {
        let member = self.0.iter().find(|m| m.name == name);
        member.map_or(&[], |m| &m.bytes)
    }
    /// Bytes of the first member.
    pub fn first(&self) -> &[u8] {
        self.0.first().map_or(&[], |m| &m.bytes)
    }
    /// Number of bytes of all members.
    pub fn size(&self) -> usize {
        self.0.iter().map(|m| m.bytes.len()).sum()
    }

    /// Writes the members into a folder.
    ///
    /// # Errors
    /// A name that leads out of the folder, or an error of the system.
    pub fn write_into(&self, folder: &Path) -> io::Result<()> {
        for m in &self.0 {
            let inside = |c: Component<'_>| matches!(c, Component::Normal(_));
            if !Path::new(&m.name).components().all(inside) {
                return Err(io::Error::other(format!("{} leads out", m.name)));
            }
            let path = folder.join(&m.name);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            fs::write(path, &m.bytes)?;
        }
        Ok(())
    }

    /// Reads a file as a bundle of one member, or a folder with its files, sorted by name.
    ///
    /// # Errors
    /// An error of the system.
    pub fn read(path: &Path) -> io::Result<Self> {
        let mut members = Vec::new();
        if path.is_dir() {
            collect(path, "", &mut members)?;
        } else {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            // `NAME@member.ext`: the part before the first `@` names the entry.
            let member = name.split_once('@').map_or(&*name, |(_, m)| m);
            members.push(Member {
                name: member.into(),
                bytes: fs::read(path)?,
            });
        }
        members.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self(members))
    }
}

fn collect(folder: &Path, prefix: &str, members: &mut Vec<Member>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let name = format!("{prefix}{file}");
        if path.is_dir() {
            collect(&path, &format!("{name}/"), members)?;
        } else {
            members.push(Member {
                name,
                bytes: fs::read(&path)?,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bundles_survive_files() {
        let bundle = Bundle::of("a.json", *b"{}").and("sub/b.bin", [0, 10, 255]);
        let folder = tempfile::tempdir().expect("a folder");
        bundle.write_into(folder.path()).expect("written");
        assert_eq!(Bundle::read(folder.path()).expect("read"), bundle);
        assert!(Bundle::of("../a", []).write_into(folder.path()).is_err());
    }
}
