use super::{folder, read_bytes};
use crate::scan::files::natural_order;
use crate::scan::{read_scan, scan_files};
use crate::shared_data;
use tryon_geometry::math::P3;

#[test]
fn folders_are_sequences_in_natural_order() {
    let dir = folder();
    for name in [
        "s10.ply", "s2.OBJ", "s1.glb", "s2.mtl", "t.png", "._s0.ply", "a100.ply",
    ] {
        std::fs::write(dir.path().join(name), b"").expect("written");
    }
    std::fs::create_dir(dir.path().join("b.ply")).expect("a folder");
    let files = scan_files(dir.path()).expect("a sequence");
    let names: Vec<_> = files
        .iter()
        .filter_map(|f| f.file_name()?.to_str())
        .collect();
    assert_eq!(names, ["a100.ply", "s1.glb", "s2.OBJ", "s10.ply"]);
    let one = dir.path().join("s10.ply");
    assert_eq!(scan_files(&one).expect("a file"), [one]);
}

#[test]
fn digits_compare_as_numbers() {
    for pair in [
        "2 10",
        "a2 a10",
        "a a1",
        "a1b2 a1b10",
        "a1b a01c",
        "a01 a1",
        "09 10",
        "a9z a10",
    ] {
        let (a, b) = pair.split_once(' ').expect("two names");
        assert!(
            natural_order(a, b).is_lt() && natural_order(b, a).is_gt(),
            "{pair}"
        );
        assert!(natural_order(a, a).is_eq());
    }
    let large = ["18446744073709551616", "18446744073709551617"];
    assert!(natural_order(large[0], large[1]).is_lt());
}

#[test]
fn folders_without_scans_and_other_files_are_named() {
    let dir = folder();
    let e = scan_files(dir.path()).expect_err("empty").to_string();
    let name = dir.path().display().to_string();
    assert!(e.contains(&name) && e.contains("no scan"), "{e}");
    let stl = dir.path().join("a.stl");
    std::fs::write(&stl, b"solid").expect("written");
    for e in [scan_files(&stl).err(), read_scan(&stl).err()] {
        let e = e.expect("an error").to_string();
        assert!(e.contains("a.stl") && e.contains(".ply, .obj"), "{e}");
    }
    assert!(scan_files(&dir.path().join("none")).is_err());
    assert!(read_bytes(dir.path(), "none", b"").is_err());
}

/// Captured scans of a standing man, about 1.7 m tall.
#[test]
fn captured_scans_are_read() {
    let Some(folder) = shared_data("scans/liam") else {
        return;
    };
    let files = scan_files(&folder).expect("a sequence");
    assert_eq!(files.len(), 13);
    for file in files {
        let scan = read_scan(&file).expect("a scan");
        let (n, m, name) = (scan.points.len(), scan.faces.len(), file.display());
        assert!((25_000..28_000).contains(&n), "{name}: {n} points");
        assert!((50_000..56_000).contains(&m), "{name}: {m} faces");
        assert_eq!((scan.colors.len(), scan.normals.len()), (n, 0));
        let dark = scan.colors.iter().filter(|c| c.iter().all(|x| *x < 128));
        assert!((n / 10..n).contains(&dark.count()), "{name}: colours");
        let start = (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3]));
        let join = |(lo, hi): (P3, P3), p: &P3| (lo.inf(p), hi.sup(p));
        let (lo, hi) = scan.points.iter().fold(start, join);
        let size = hi - lo;
        assert!((1.6..1.9).contains(&size.y), "{name}: {size:?}");
        assert!(size.x < 1.2 && size.z < 1.2, "{name}: {size:?}");
    }
}
