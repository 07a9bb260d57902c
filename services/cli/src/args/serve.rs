//! Arguments of the commands that serve: `demo` and `up`.

use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// Stop after this many seconds; without it, run until Ctrl-C.
    #[arg(long, value_name = "S")]
    pub(crate) seconds: Option<f64>,
    /// No browser needed: an internal client receives the pictures and keeps some of them.
    #[arg(long)]
    pub(crate) headless: bool,
    /// Folder for pictures and report.json (with --headless).
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub(crate) out: PathBuf,
    /// Garments to wear: names of the library, or those under which --wardrobe is offered.
    #[arg(long = "garment", value_name = "NAME", default_values_t = ["tshirt".to_owned(), "skirt".to_owned()])]
    pub(crate) garments: Vec<String>,
    /// Folder of garments to offer beside the library: meshes and captures, as `cloth.garments` of the configuration. The
    /// garments of a capture are CAPTURE_top, CAPTURE_under, CAPTURE_bottom …, by the name of its folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) wardrobe: Option<PathBuf>,
    /// Address of the mirror page.
    #[arg(long, default_value = "127.0.0.1:8080", value_name = "ADDR")]
    pub(crate) listen: std::net::SocketAddr,
    /// Frames a second the synthetic camera delivers.
    #[arg(long, default_value_t = 30.0, value_name = "HZ")]
    pub(crate) fps: f64,
    /// A recording instead of the synthetic person (looped).
    #[arg(long, value_name = "REC")]
    pub(crate) input: Option<PathBuf>,
    /// Lets addresses beyond loopback be bound without TLS and tokens: anybody who reaches them sees the person.
    #[arg(long)]
    pub(crate) insecure: bool,
}

#[derive(Debug, Args)]
pub(crate) struct UpArgs {
    /// TOML file; deploy/tryon.toml is the commented default. TRYON_* variables override it.
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Sets one key, such as `--set compositor.address=127.0.0.1:0`; wins over file and environment.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Check the configuration and the files that it names, print the result of all its layers, and stop.
    #[arg(long)]
    pub(crate) check: bool,
    /// Lets addresses beyond loopback be bound without TLS and tokens: anybody who reaches them sees the person.
    #[arg(long)]
    pub(crate) insecure: bool,
}
