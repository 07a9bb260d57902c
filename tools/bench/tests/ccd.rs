//! The program from outside.
#![allow(clippy::unwrap_used, missing_docs)]

use std::process::{Command, Output};

fn bench(args: &[&str]) -> Output {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon-bench"));
    c.args(args).output().expect("starts")
}

/// The error of a command that must fail without a panic, one line.
#[track_caller]
fn refused(args: &[&str]) -> String {
    let out = bench(args);
    let err = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(1), "{args:?}: {err}");
    assert!(!err.contains("panicked"), "{args:?}: {err}");
    err.trim().to_owned()
}

#[test]
fn ccd_counts_against_the_truth() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().display().to_string();
    assert!(refused(&["ccd", "--queries", &root]).contains("vertex-face"));
    let kind = dir.path().join("drop").join("vertex-face");
    std::fs::create_dir_all(&kind).unwrap();
    let face = "0,1,0,1,0,1,1\n1,1,0,1,0,1,1\n0,1,0,1,1,1,1\n";
    let query = format!("1,4,1,1,1,4,1\n{face}1,4,-1,1,1,4,1\n{face}");
    std::fs::write(kind.join("a.csv"), &query).unwrap();
    let out = bench(&["ccd", "--queries", &root, "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(report["total"]["impacts"], 1);
    assert_eq!(report["total"]["missed"], 0);
    assert_eq!(report["sets"][0]["group"], "drop");
    std::fs::write(kind.join("b.csv"), query.replace("-1,1", "-1,0")).unwrap();
    let fault = refused(&["ccd", "--queries", &root]);
    assert!(
        fault.contains("b.csv") && fault.contains("line 5, y numerator"),
        "{fault}"
    );
}
