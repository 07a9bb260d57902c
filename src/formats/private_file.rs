//! Files and folders that only their owner may read, under any umask: recordings show people.

use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// Options of a file of mode 0600 to write; one that exists keeps its mode.
fn options() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options
}

/// Creates a file where there is none.
pub(super) fn create_new(path: &Path) -> io::Result<File> {
    options().create_new(true).open(path)
}

/// Creates a file, or empties one.
pub(super) fn create(path: &Path) -> io::Result<File> {
    options().create(true).truncate(true).open(path)
}

/// Opens a file of its owner at its end.
pub(super) fn append(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).open(path)
}

/// Writes a whole file.
pub(super) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    create(path)?.write_all(bytes)
}

/// Creates a folder with those above it that are missing, all of mode 0700.
pub(super) fn create_folders(path: &Path) -> io::Result<()> {
    let mut builder = DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.recursive(true).create(path)
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use crate::{McapWriter, RgbdFolderWriter};
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;
    use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};

    /// Modes of a file, or of a folder and everything in it.
    fn modes(path: &Path) -> Vec<u32> {
        let m = path.metadata().expect("there");
        let mut all = vec![m.permissions().mode() & 0o7777];
        if m.is_dir() {
            let inner = std::fs::read_dir(path).expect("listed");
            all.extend(inner.flat_map(|e| modes(&e.expect("an entry").path())));
        }
        all
    }

    #[test]
    fn nobody_else_reads_a_recording() {
        let dir = tempfile::tempdir().expect("a folder");
        let intrinsics = Intrinsics {
            width: 2,
            height: 1,
            fx: 1.0,
            fy: 1.0,
            cx: 0.0,
            cy: 0.0,
        };
        let calibration = Calibration::registered(intrinsics);
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(2, 1, vec![1, 2]).expect("sizes"),
            color: Some(ColorImage::filled(2, 1, [3; 3])),
        };
        let (file, folder) = (dir.path().join("r.mcap"), dir.path().join("new/r"));
        let mut mcap = McapWriter::create(&file, &calibration).expect("created");
        mcap.write(&frame).expect("written");
        mcap.finish().expect("finished");
        let mut writer = RgbdFolderWriter::create(&folder, &calibration).expect("created");
        writer.write(&frame).expect("written");

        assert_eq!(modes(&file), [0o600]);
        let mut all = modes(&dir.path().join("new"));
        all.sort_unstable();
        // camera.json, two lists, two images; new, r, depth, rgb.
        assert_eq!(all, [[0o600; 5].as_slice(), &[0o700; 4]].concat());
    }
}
