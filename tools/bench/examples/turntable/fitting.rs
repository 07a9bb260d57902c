//! One outfit on one body: dressing, simulation, statistics, meshes to draw.

use crate::args::Args;
use crate::drawing::DrawnMesh;
use crate::person::{Person, pose, posed};
use crate::wardrobe::Garment;
use std::time::Instant;
use tryon::body::Pose;
use tryon::body::measure::measure;
use tryon::cloth::{Config, Input, State, StepReport, Workspace, step};
use tryon::dressing::{
    DressError, DressOptions, Dressed, FitMap, FitMapSettings, FitProbe, GarmentSource, dress_all,
};
use tryon::garment::{GarmentMesh, library};
use tryon::geometry::math::{P3, World};
use tryon::geometry::spatial::intersections;

/// Steps a second.
const RATE: f64 = 30.0;
/// Colours of vertices away from and at crossings, sRGB.
const CROSSING_COLORS: [[u8; 3]; 2] = [[225, 220, 200], [220, 0, 0]];

/// A dressed body.
pub(crate) struct Fitting {
    dressed: Dressed,
    /// The body of the last step, world, metres.
    body: Vec<P3>,
    probe: Option<FitProbe>,
}

/// Lowest and highest y.
pub(crate) fn height_range(vertices: &[P3]) -> [f32; 2] {
    vertices
        .iter()
        .fold([f32::MAX, f32::MIN], |y, p| [y[0].min(p.y), y[1].max(p.y)])
}

/// The pose in which garments are put on.
pub(crate) fn start_pose(a: &Args, person: &Person) -> Pose<World> {
    match &person.film {
        Some((start, _)) => start.clone(),
        None => pose(&a.pose, &person.template, &person.rest, 0.0),
    }
}

fn options(a: &Args, is_tracked: bool) -> DressOptions {
    let config = if is_tracked {
        Config::tracked()
    } else {
        Config::default()
    };
    let mut options = DressOptions {
        any_size: a.any_size,
        untangle: a.untangle,
        config: Config {
            self_collision: a.folds,
            min_fold_ratio: a.sharpest,
            ..config
        },
        ..DressOptions::default()
    };
    if let Some(e) = a.edge {
        options.triangulation.edge_length = e;
    }
    options
}

impl Fitting {
    /// Puts an outfit on; `None` when it does not fit.
    pub(crate) fn dress(
        a: &Args,
        person: &Person,
        outfit: &str,
        body: &str,
        size: &str,
    ) -> Option<Self> {
        let start = &start_pose(a, person);
        let measures = measure(&person.template, &person.rest).expect("measurable");
        let worn: Vec<Garment> = (outfit.split('+'))
            .map(|g| Garment::load(a, g, body, size, &measures))
            .collect();
        let wear: Vec<GarmentSource<'_>> = worn.iter().map(Garment::wear).collect();
        let options = options(a, person.film.is_some());
        let dressed = match dress_all(&person.template, &person.rest, start, &wear, &options) {
            Ok(dressed) => dressed,
            Err(DressError::Misfit(m)) => {
                println!("{body} {outfit} {size}: {m}");
                return None;
            }
            Err(e) => panic!("{e}"),
        };
        let probe = (a.fit).then(|| FitProbe::new(&person.template, &dressed.model));
        let out = Self {
            body: posed(&person.template, &person.rest, start),
            probe: probe.map(|p| p.expect("a probe")),
            dressed,
        };
        let (r, state) = (&out.dressed.report, &out.dressed.state);
        let vertices: Vec<usize> = state.garments.iter().map(|g| g.positions.len()).collect();
        println!(
            "{body} {outfit} {size}: {vertices:?} vertices, dressed in {:.0} ms, {} steps, penetration {:.1} mm, p99 stretch {:.3}; {:.0?}",
            r.ms,
            r.steps,
            r.penetration * 1e3,
            r.p99_strain,
            r.stages_ms
        );
        println!("  edges through its own triangles: {:?}", out.crossed());
        Some(out)
    }

    fn meshes(&self) -> impl Iterator<Item = (&GarmentMesh, &[P3])> {
        let state: &State = &self.dressed.state;
        let garments = self.dressed.model.outfit.garments.iter();
        garments.zip(state.garments.iter().map(|g| &g.positions[..]))
    }

    /// Edges through triangles of the same garment, by garment.
    fn crossed(&self) -> Vec<usize> {
        self.meshes()
            .map(|(g, x)| intersections(&g.faces, x).len())
            .collect()
    }

    /// Steps through the person's film, or through the pose's motion, and prints statistics.
    pub(crate) fn play(&mut self, a: &Args, person: Person) {
        let Person {
            template,
            rest,
            film,
        } = person;
        let film = film.map_or_else(
            || {
                let at = |i: i32| pose(&a.pose, &template, &rest, f64::from(i + 1) / RATE);
                (0..(a.seconds * RATE) as i32)
                    .map(|i| posed(&template, &rest, &at(i)))
                    .collect()
            },
            |(_, film)| film,
        );
        let vertices = (self.dressed.state.garments.iter()).map(|g| g.positions.len());
        let vertices: usize = vertices.sum();
        let mut statistics = Statistics::default();
        let mut work = Workspace::default();
        for body in film {
            let input = Input {
                body: &body,
                dt: 1.0 / RATE,
            };
            let (model, state) = (&self.dressed.model, &mut self.dressed.state);
            let report = step(model, state, &input, &mut work).expect("step");
            let crossed = self.crossed();
            statistics.add(report, vertices, &crossed);
            self.body = body;
        }
        statistics.print(&self.crossed());
    }

    /// The body of the last step, world, metres.
    pub(crate) fn body(&self) -> &[P3] {
        &self.body
    }

    /// The body as cloth met it, or as measured.
    pub(crate) fn drawn_body(&self, a: &Args) -> Vec<P3> {
        if a.measured {
            return self.body.clone();
        }
        self.dressed.state.collision_body().vertices().to_vec()
    }

    /// The garments, painted with crossings or fit as asked for.
    pub(crate) fn garments(&mut self, a: &Args) -> Vec<DrawnMesh> {
        let fits = self.fit_maps();
        let names = library::names();
        let mut out = Vec::new();
        for (k, (g, positions)) in self.meshes().enumerate() {
            let is_known = names.contains(&g.name.as_str());
            let dye = if is_known { &g.name } else { names[k % 9] };
            let mut mesh = DrawnMesh::garment(g, positions, dye);
            let paint = if a.crossings {
                Some(crossing_colors(g, positions))
            } else {
                fits.as_ref().map(|maps| {
                    let limits = FitMapSettings::default();
                    let colors = maps[k].vertices.iter().map(|v| v.color(&limits));
                    colors.collect()
                })
            };
            if let Some(colors) = paint {
                let drawn = g.render.vertex.iter().map(|v| colors[*v as usize]);
                mesh.painted = drawn.collect();
            }
            out.push(mesh);
        }
        out
    }

    /// Measures and prints the fit, if asked for.
    fn fit_maps(&mut self) -> Option<Vec<FitMap>> {
        let probe = self.probe.as_mut()?;
        let Dressed { model, state, .. } = &self.dressed;
        let begun = Instant::now();
        probe.measure(model, state, &self.body).expect("fit");
        let first = begun.elapsed().as_secs_f64() * 1e3;
        let begun = Instant::now();
        let maps = probe.measure(model, state, &self.body).expect("fit");
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
        Some(maps.to_vec())
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

/// Sums over the steps of one outfit.
#[derive(Default)]
struct Statistics {
    frames: usize,
    step_ms: f64,
    /// First step after which all vertices slept to the end.
    at_rest: Option<usize>,
    crossed: Vec<usize>,
    last: Option<StepReport>,
}

impl Statistics {
    fn add(&mut self, report: StepReport, vertices: usize, crossed: &[usize]) {
        self.frames += 1;
        self.step_ms += report.stages_ms.total;
        self.at_rest = match report.sleeping < vertices {
            true => None,
            false => self.at_rest.or(Some(self.frames)),
        };
        self.crossed.resize(crossed.len(), 0);
        (self.crossed.iter_mut().zip(crossed)).for_each(|(all, now)| *all += now);
        self.last = Some(report);
    }

    fn print(&self, crossed: &[usize]) {
        let Some(r) = &self.last else { return };
        println!(
            "  {:.2} ms a step, penetration left {:.2} mm, p99 {:.3} max {:.3}",
            self.step_ms / self.frames as f64,
            r.penetration_left * 1e3,
            r.p99_strain,
            r.max_strain
        );
        match self.at_rest {
            Some(step) => println!("  at rest after {step} of {} steps", self.frames),
            None => println!("  {} vertices asleep at the end", r.sleeping),
        }
        let mean: Vec<usize> = self.crossed.iter().map(|n| n / self.frames).collect();
        println!("  edges through its own triangles: {crossed:?}, over all pictures {mean:?}");
    }
}
