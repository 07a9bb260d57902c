//! `cargo run -p tryon-proto --example generate`: proto/tryon/v1/*.proto → proto/src/gen, without protoc.

mod codegen;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    codegen::generate(root, &root.join("src/gen"))?;
    Ok(())
}
