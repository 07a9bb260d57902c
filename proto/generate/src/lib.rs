//! The one way generated code is made; the test that compares checked-in code uses it too.

use std::error::Error;
use std::path::Path;

/// The files of the package, in the order in which they are compiled.
const FILES: [&str; 6] = [
    "tryon/v1/common.proto",
    "tryon/v1/frame.proto",
    "tryon/v1/capture.proto",
    "tryon/v1/tracking.proto",
    "tryon/v1/cloth.proto",
    "tryon/v1/compositor.proto",
];

/// Compiles the protos under `root` and writes `tryon.v1.rs` and `descriptor.bin` (for reflection) into `out`.
///
/// # Errors
/// A proto that does not compile, or a file that cannot be written.
pub fn generate(root: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    use prost_types::FileDescriptorSet;
    let mut compiler = protox::Compiler::new([root])?;
    compiler.include_source_info(true).include_imports(true);
    compiler.open_files(FILES)?;
    let mut set: FileDescriptorSet = compiler.file_descriptor_set();
    tonic_prost_build::configure()
        .emit_rerun_if_changed(false)
        .bytes(".tryon.v1")
        // Its secret must not reach a log.
        .skip_debug([".tryon.v1.FrameKey"])
        .out_dir(out)
        .compile_fds(set.clone())?;
    // Reflection needs no comments: without them the binary is a third of the size.
    set.file.iter_mut().for_each(|f| f.source_code_info = None);
    std::fs::write(
        out.join("descriptor.bin"),
        prost::Message::encode_to_vec(&set),
    )?;
    Ok(())
}
