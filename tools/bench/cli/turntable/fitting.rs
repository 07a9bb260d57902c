//! One outfit on one body: dressing, simulation, statistics, meshes to draw.

use super::Case;
use super::drawing::DrawnMesh;
use super::person::Person;
use super::wardrobe::Garment;
use crate::args::TurntableArgs;
use anyhow::Result;
use std::time::Instant;
use tryon::body::measure::measure;
use tryon::cloth::{Config, Input, Workspace, step};
use tryon::dressing::{
    DressError, DressOptions, Dressed, FitMap, FitMapSettings, FitProbe, GarmentSource, dress_all,
};
use tryon::garment::{GarmentMesh, library};
use tryon::geometry::math::P3;
use tryon::geometry::spatial::intersections;

/// Steps a second.
const RATE: u32 = 30;
/// Colours of vertices away from and at crossings, sRGB.
const CROSSING_COLORS: [[u8; 3]; 2] = [[225, 220, 200], [220, 0, 0]];

/// A dressed body.
pub(super) struct Fitting {
    dressed: Dressed,
    /// The body of the last step, world, metres.
    body: Vec<P3>,
    probe: Option<FitProbe>,
}

fn options(args: &TurntableArgs, is_tracked: bool) -> DressOptions {
    let config = if is_tracked {
        Config::tracked()
    } else {
        Config::default()
    };
    let mut options = DressOptions {
        any_size: args.any_size,
        config: Config {
            self_collision: !args.no_folds,
            ..config
        },
        ..DressOptions::default()
    };
    if let Some(e) = args.edge {
        options.triangulation.edge_length = e;
    }
    options
}

impl Fitting {
    /// Puts an outfit on; `None` when it does not fit.
    pub(super) fn dress(case: &Case<'_>, person: &Person) -> Result<Option<Self>> {
        let Case {
            args,
            garment,
            body,
            size,
            ..
        } = *case;
        let (template, rest, start) = (&person.template, &person.rest, person.start(args));
        let measures = measure(template, rest)?;
        let worn = garment
            .split('+')
            .map(|g| Garment::load(case, g, &measures));
        let worn = worn.collect::<Result<Vec<_>>>()?;
        let wear: Vec<GarmentSource<'_>> = worn.iter().map(Garment::wear).collect();
        let options = options(args, person.film.is_some());
        let dressed = match dress_all(template, rest, &start, &wear, &options) {
            Ok(dressed) => dressed,
            Err(DressError::Misfit(m)) => {
                println!("{body} {garment} {size}: {m}");
                return Ok(None);
            }
            Err(e) => return Err(e.into()),
        };
        let probe = args.fit.then(|| FitProbe::new(template, &dressed.model));
        let out = Self {
            body: person.posed(&start),
            probe: probe.transpose()?,
            dressed,
        };
        let (r, state) = (&out.dressed.report, &out.dressed.state);
        let vertices: Vec<usize> = state.garments.iter().map(|g| g.positions.len()).collect();
        println!(
            "{body} {garment} {size}: {vertices:?} vertices, dressed in {:.0} ms, {} steps, penetration {:.1} mm, p99 stretch {:.3}, {} crossings; {:.0?}",
            r.ms,
            r.steps,
            r.penetration * 1e3,
            r.p99_strain,
            r.crossings,
            r.stages_ms
        );
        println!("  edges through its own triangles: {:?}", out.crossed());
        Ok(Some(out))
    }

    fn meshes(&self) -> impl Iterator<Item = (&GarmentMesh, &[P3])> {
        let garments = self.dressed.model.outfit.garments.iter();
        garments.zip(self.dressed.state.garments.iter().map(|g| &g.positions[..]))
    }

    /// Edges through triangles of the same garment, by garment.
    fn crossed(&self) -> Vec<usize> {
        let count = |(g, x): (&GarmentMesh, &[P3])| intersections(&g.faces, x).len();
        self.meshes().map(count).collect()
    }

    /// Steps through the person's film, or through the pose's motion, and prints statistics.
    pub(super) fn play(&mut self, args: &TurntableArgs, person: &Person) -> Result<()> {
        let rate = f64::from(RATE);
        let steps = match &person.film {
            Some(film) => film.bodies.len(),
            None => (args.seconds * rate) as usize,
        };
        let (mut ms, mut last) = (0.0, None);
        let mut crossings = vec![0; self.meshes().count()];
        let mut work = Workspace::default();
        for i in 0..steps {
            self.body = match &person.film {
                Some(film) => film.bodies[i].clone(),
                None => person.posed(&person.pose(args.pose, (i + 1) as f64 / rate)),
            };
            let input = Input {
                body: &self.body,
                dt: 1.0 / rate,
            };
            let (model, state) = (&self.dressed.model, &mut self.dressed.state);
            let report = step(model, state, &input, &mut work)?;
            ms += report.stages_ms.total;
            (crossings.iter_mut().zip(self.crossed())).for_each(|(all, now)| *all += now);
            last = Some(report);
        }
        let Some(r) = last else { return Ok(()) };
        println!(
            "  {:.2} ms a step, penetration left {:.2} mm, p99 {:.3} max {:.3}, {} vertices asleep",
            ms / steps as f64,
            r.penetration_left * 1e3,
            r.p99_strain,
            r.max_strain,
            r.sleeping
        );
        let mean: Vec<usize> = crossings.iter().map(|n| n / steps).collect();
        let crossed = self.crossed();
        println!("  edges through its own triangles: {crossed:?}, over all pictures {mean:?}");
        Ok(())
    }

    /// The body of the last step, world, metres.
    pub(super) fn into_body(self) -> Vec<P3> {
        self.body
    }

    /// The body as cloth met it.
    pub(super) fn collision_body(&self) -> Vec<P3> {
        self.dressed.state.collision_body().vertices().to_vec()
    }

    /// The garments, painted with crossings or fit as asked for.
    pub(super) fn garments(&mut self, args: &TurntableArgs) -> Result<Vec<DrawnMesh>> {
        let fits = self.fit_maps()?;
        let names = library::names();
        let mut out = Vec::new();
        for (k, (g, positions)) in self.meshes().enumerate() {
            let is_known = names.contains(&g.name.as_str());
            let dye = if is_known { &g.name } else { names[k % 9] };
            let mut mesh = DrawnMesh::garment(g, positions, dye);
            let paint: Option<Vec<[u8; 3]>> = match (args.crossings, &fits) {
                (true, _) => Some(crossing_colors(g, positions)),
                (_, Some(maps)) => {
                    let limits = FitMapSettings::default();
                    Some(maps[k].vertices.iter().map(|v| v.color(&limits)).collect())
                }
                _ => None,
            };
            if let Some(colors) = paint {
                let drawn = g.render.vertex.iter().map(|v| colors[*v as usize]);
                mesh.painted = drawn.collect();
            }
            out.push(mesh);
        }
        Ok(out)
    }

    /// Measures and prints the fit, if asked for.
    fn fit_maps(&mut self) -> Result<Option<Vec<FitMap>>> {
        let Some(probe) = &mut self.probe else {
            return Ok(None);
        };
        let Dressed { model, state, .. } = &self.dressed;
        let begun = Instant::now();
        probe.measure(model, state, &self.body)?;
        let first = begun.elapsed().as_secs_f64() * 1e3;
        let begun = Instant::now();
        let maps = probe.measure(model, state, &self.body)?;
        let then = begun.elapsed().as_secs_f64() * 1e3;
        println!("  fit map: first {first:.1} ms, then {then:.1} ms");
        for r in maps.iter().flat_map(|m| &m.regions) {
            println!(
                "  {:16} {:?}: stretch {:+.1} % (p95 {:+.1}), {:.0} Pa over {:.0} %, {:.0} mm off the skin",
                r.name,
                r.fit,
                r.stretch[0] * 100.0,
                r.stretch[1] * 100.0,
                r.pressure[0],
                r.touching * 100.0,
                r.gap * 1e3
            );
        }
        Ok(Some(maps))
    }
}

/// Colours of a garment's vertices by crossings.
fn crossing_colors(g: &GarmentMesh, positions: &[P3]) -> Vec<[u8; 3]> {
    let mut colors = vec![CROSSING_COLORS[0]; g.vertices];
    for c in intersections(&g.faces, positions) {
        let touched = c.edge.iter().chain(&g.faces[c.face as usize]);
        touched.for_each(|v| colors[*v as usize] = CROSSING_COLORS[1]);
    }
    colors
}
