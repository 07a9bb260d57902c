//! What several tests share: finding the data that lies beside the project.

use std::path::PathBuf;
use tryon::body::{Pose, RestBody, Template};
use tryon::math::{Body, Rigid, World, log_so3};

/// A path below `../shared/data` (or `$TRYON_SHARED/data`). When it is missing the test says so loudly and skips;
/// with `TRYON_REQUIRE_ALL=1` it fails.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let root = std::env::var_os("TRYON_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let full = root.join("data").join(path);
    if full.exists() {
        return Some(full);
    }
    assert!(std::env::var_os("TRYON_REQUIRE_ALL").is_none(), "{} is missing", full.display());
    eprintln!("SKIPPED: {} is missing", full.display());
    None
}

/// Standing with the arms hanging down.
pub(crate) fn arms_down(template: &Template, rest: &RestBody) -> Pose<World> {
    let sk = template.skeleton();
    let mut p = Pose::rest(sk, Rigid::<World, Body>::identity());
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let joint = |n: &str| sk.index(&format!("{side}_{n}")).expect("joint");
        let (j, c) = (joint("shoulder"), joint("elbow"));
        let wanted = nalgebra::Vector3::new(s * 1.3f64.cos(), -1.3f64.sin(), 0.0);
        let q = nalgebra::UnitQuaternion::rotation_between(&(rest.joints[c] - rest.joints[j]), &wanted).expect("turn");
        let at = sk.dof_offset(j);
        p.angles[at..at + 3].copy_from_slice(log_so3(&q).as_slice());
    }
    p
}
