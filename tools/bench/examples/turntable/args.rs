//! Command line of the turntable.

use std::path::PathBuf;
use tryon::cloth::Config;
use tryon::dressing::SourceBody;
use tryon::garment::library;

/// Options of the command line.
pub(crate) struct Args {
    pub(crate) garments: Vec<String>,
    pub(crate) garment_body: Option<SourceBody>,
    pub(crate) bodies: Vec<String>,
    pub(crate) sizes: Vec<String>,
    pub(crate) pose: String,
    pub(crate) seconds: f64,
    pub(crate) views: Vec<f32>,
    pub(crate) cell: (u32, u32),
    pub(crate) crop: bool,
    pub(crate) edge: Option<f64>,
    pub(crate) fit: bool,
    pub(crate) any_size: bool,
    pub(crate) crossings: bool,
    pub(crate) folds: bool,
    pub(crate) untangle: bool,
    pub(crate) sharpest: f64,
    pub(crate) measured: bool,
    pub(crate) out: PathBuf,
}

/// Parses the command line.
pub(crate) fn args() -> Args {
    let mut a = Args {
        garments: vec![],
        garment_body: None,
        bodies: ["slim_woman", "average", "heavy_man"]
            .map(String::from)
            .to_vec(),
        sizes: vec!["auto".into()],
        pose: "down".into(),
        seconds: 1.0,
        views: vec![0.0, 45.0, 90.0, 180.0],
        cell: (220, 340),
        crop: false,
        edge: None,
        fit: false,
        any_size: false,
        crossings: false,
        folds: true,
        untangle: true,
        sharpest: Config::default().min_fold_ratio,
        measured: false,
        out: "/tmp/turntable".into(),
    };
    let list = |s: String| -> Vec<String> { s.split(',').map(str::to_owned).collect() };
    let mut it = std::env::args().skip(1);
    while let Some(flag) = it.next() {
        let mut value = || it.next().expect("a value");
        match flag.as_str() {
            "--garment" => a.garments.push(value()),
            "--garment-body" => {
                let body = SourceBody::read(std::path::Path::new(&value())).expect("a body");
                println!("{}", body.description);
                a.garment_body = Some(body);
            }
            "--body" => a.bodies = list(value()),
            "--size" => a.sizes = list(value()),
            "--pose" => a.pose = value(),
            "--seconds" => a.seconds = value().parse().expect("seconds"),
            "--views" => {
                a.views = list(value())
                    .iter()
                    .map(|v| v.parse().expect("degrees"))
                    .collect()
            }
            "--cell" => {
                let v = value();
                let (w, h) = v.split_once('x').expect("WxH");
                a.cell = (w.parse().expect("width"), h.parse().expect("height"));
            }
            "--crop" => a.crop = true,
            "--crossings" => a.crossings = true,
            "--no-folds" => a.folds = false,
            "--measured" => a.measured = true,
            "--sharpest" => a.sharpest = value().parse().expect("a share"),
            "--tangled" => a.untangle = false,
            "--any-size" => a.any_size = true,
            "--fit" => a.fit = true,
            "--edge" => a.edge = Some(value().parse().expect("metres")),
            "--out" => a.out = value().into(),
            other => panic!("{other} is not known"),
        }
    }
    if a.garments.is_empty() {
        a.garments = library::names().iter().map(|n| (*n).to_owned()).collect();
    }
    a
}
