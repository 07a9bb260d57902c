//! `tryon-bench turntable`: dresses bodies and draws each outfit from several sides into one PNG.
//!
//! Bodies are drawn as cloth meets them, their parts separated. A row is a body, a block of columns a size.

mod drawing;
mod fitting;
mod person;
mod wardrobe;

use crate::args::TurntableArgs;
use anyhow::Result;
use drawing::{DrawnMesh, Turn, draw};
use fitting::Fitting;
use std::path::Path;
use std::process::ExitCode;
use tryon::dressing::SourceBody;
use tryon::garment::library;
use tryon_bench::Sheet;

/// Yaws drawn, degrees.
const VIEWS: [u8; 4] = [0, 45, 90, 180];
/// Width and height of a cell, pixels.
const CELL: [u32; 2] = [220, 340];

/// Runs the command.
pub(crate) fn run(args: &TurntableArgs) -> Result<ExitCode> {
    let source = args.garment_body.as_deref().map(SourceBody::read);
    let source = source.transpose()?;
    let all = library::names().iter().map(|n| (*n).to_owned()).collect();
    let garments = if args.garment.is_empty() {
        &all
    } else {
        &args.garment
    };
    for garment in garments {
        let mut sheet = Sheet::new(CELL, VIEWS.len() * args.size.len());
        for body in &args.body {
            for size in &args.size {
                let case = Case {
                    args,
                    source: source.as_ref(),
                    garment,
                    body,
                    size,
                };
                case.draw(&mut sheet)?;
            }
        }
        let stem = Path::new(garment).file_stem().and_then(|s| s.to_str());
        let path = args.out.join(format!("{}.png", stem.unwrap_or("outfit")));
        sheet.write(&path)?;
        println!("{}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// One outfit in one size on one body.
#[derive(Clone, Copy)]
struct Case<'a> {
    args: &'a TurntableArgs,
    /// Body that the mesh garments were made on.
    source: Option<&'a SourceBody>,
    garment: &'a str,
    body: &'a str,
    size: &'a str,
}

impl Case<'_> {
    /// Adds the dressed body, or the bare one that nothing fits, from all sides.
    fn draw(&self, sheet: &mut Sheet) -> Result<()> {
        let person = person::load(self.body)?;
        let template = &person.template;
        let (body, meshes) = match Fitting::dress(self, &person)? {
            Some(mut fitting) => {
                fitting.play(self.args, &person)?;
                let mut meshes = vec![DrawnMesh::body(template, &fitting.collision_body())];
                meshes.extend(fitting.garments(self.args)?);
                (fitting.into_body(), meshes)
            }
            None => {
                let body = person.posed(&person.start(self.args));
                let mesh = DrawnMesh::body(template, &body);
                (body, vec![mesh])
            }
        };
        let turn = Turn::around(&body, CELL);
        for yaw in VIEWS {
            let yaw = f32::from(yaw).to_radians();
            sheet.push(draw(&meshes, &Turn { yaw, ..turn }));
        }
        Ok(())
    }
}
