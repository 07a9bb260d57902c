//! The checked-in code is what the protos say.

#[test]
fn checked_in_code_is_up_to_date() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let fresh = tempfile::tempdir().expect("a temporary folder");
    tryon_proto_generate::generate(root, fresh.path()).expect("the protos compile");
    for name in ["tryon.v1.rs", "descriptor.bin"] {
        let new = std::fs::read(fresh.path().join(name)).expect("generated");
        let old = std::fs::read(root.join("src/gen").join(name)).expect("checked in");
        assert!(
            new == old,
            "src/gen/{name} differs: run `cargo run -p tryon-proto-generate`"
        );
    }
}
