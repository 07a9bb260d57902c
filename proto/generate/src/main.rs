//! `cargo run -p tryon-proto-generate`: proto/tryon/v1/*.proto → proto/src/gen, without protoc.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    tryon_proto_generate::generate(&root, &root.join("src/gen"))?;
    Ok(())
}
