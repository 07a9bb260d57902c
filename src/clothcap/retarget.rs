//! Retargeting (eq. 23 to 25): captured cloth as displacements from the body, on new bodies in any pose, free of penetration.

use super::CaptureError;
use super::align::{Pull, PullPlace, SurfaceFit, SurfaceTerms};
use super::multi::ClothPart;
use super::settings::PenetrationSettings;
use serde::{Deserialize, Serialize};
use tryon_body::Template;
use tryon_cloth::contact::{ClosestPoint, CollisionBody, CollisionModel, CollisionWorkspace, Part};
use tryon_cloth::{Config, collision_model};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::Bvh;

/// Tolerance of the least distance for a garment that was free before it was unposed and posed again, metres.
const ROUNDING: f32 = 1e-5;

/// Report of one retargeting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RetargetReport {
    /// Vertices inside the body before they were pushed.
    pub inside_before: usize,
    /// Vertices inside the body afterwards.
    pub inside: usize,
    /// Solves.
    pub solves: usize,
    /// Largest displacement by pushing, metres.
    pub largest_push: f32,
}

/// Vertices of a garment over a rest body (eq. 25), metres; `body` has the clothed template's vertices.
pub fn on_body(part: &ClothPart, displacements: &[V3], body: &[P3]) -> Vec<P3> {
    let below = part.nodes.iter().map(|v| body[*v as usize]);
    below.zip(displacements).map(|(p, d)| p + d).collect()
}

/// Body that garments stay outside of: its pressing parts and bent joints apart, as it is drawn.
#[derive(Debug)]
pub struct SolidBody {
    model: CollisionModel,
    body: CollisionBody,
    work: CollisionWorkspace,
    bvh: Bvh,
    settings: PenetrationSettings,
}

impl SolidBody {
    /// Body of a template at rest.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template whose mesh cannot collide.
    pub fn new(template: &Template, settings: PenetrationSettings) -> Result<Self, CaptureError> {
        let mesh = template.mesh();
        let model = collision_model(template, &Config::default()).map_err(fault)?;
        let mut out = Self {
            model,
            body: CollisionBody::default(),
            work: CollisionWorkspace::default(),
            bvh: Bvh::new(mesh.faces(), mesh.vertices()),
            settings,
        };
        out.place(mesh.vertices())?;
        Ok(out)
    }

    /// Places the body at a pose: posed vertices, metres, shape `[vertices]`.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for another template's vertices or values that are not finite.
    pub fn place(&mut self, posed: &[P3]) -> Result<(), CaptureError> {
        let placed = self.body.place(&self.model, posed, &mut self.work);
        placed.map_err(fault)?;
        self.bvh.refit(self.body.vertices());
        Ok(())
    }

    /// The same without separating its parts, so that surface and body agree vertex by vertex.
    ///
    /// # Errors
    /// As [`SolidBody::place`].
    pub fn place_unseparated(&mut self, posed: &[P3]) -> Result<(), CaptureError> {
        self.model.check(posed).map_err(fault)?;
        self.body = CollisionBody::unfiltered(posed);
        self.bvh.refit(posed);
        Ok(())
    }

    /// Closest point of the skin near body vertex `node`.
    pub fn below(&self, p: &P3, node: u32) -> ClosestPoint {
        let surface = self.model.surface();
        surface.closest(self.body.frame(), p, node, Part::MAX)
    }

    /// Vertices as garments meet them and as they are drawn, metres.
    pub fn vertices(&self) -> &[P3] {
        self.body.vertices()
    }

    /// Membership in the body's interior of each point, by ray parity.
    pub fn contains(&self, points: &[P3]) -> Vec<bool> {
        let mut inside = Vec::new();
        par::map_into(Par::Rayon, points.len(), 128, &mut inside, |i| {
            self.encloses(&points[i])
        });
        inside
    }

    /// Place outside of the skin near body vertex `node` for a point closer than `least`; `None` for others, and for points
    /// outside of the body in a fold of the skin too narrow for a better place.
    fn outside(&self, p: &P3, node: u32, least: f32) -> Option<P3> {
        let hit = self.below(p, node);
        if hit.signed_distance >= least {
            return None;
        }
        let place = hit.point + hit.normal * self.settings.margin;
        let is_above = self.below(&place, node).signed_distance >= self.settings.least;
        let is_free = is_above && !self.encloses(&place);
        (is_free || self.encloses(p)).then_some(place)
    }

    /// Membership of one point in the body's interior.
    fn encloses(&self, p: &P3) -> bool {
        self.bvh.winding_number(self.body.vertices(), p) > 0
    }

    /// The same by the closest point of the whole skin, for a point in its interior.
    fn outside_of_all(&self, p: &P3) -> Option<P3> {
        let hit = self.bvh.closest(self.body.vertices(), p)?;
        let out = (hit.point - p).try_normalize(f32::MIN_POSITIVE)?;
        Some(hit.point + out * self.settings.margin)
    }
}

fn fault(e: impl std::fmt::Display) -> CaptureError {
    CaptureError::solve("collision body", e)
}

/// Vertices of a garment next to bodies.
#[derive(Debug)]
struct InnerSide {
    /// Body vertex next to each vertex.
    below: Vec<u32>,
    /// Vertices under another garment, which are placed below it afterwards.
    hidden: Vec<bool>,
}

impl InnerSide {
    /// Moves what smoothing left inside or too near, each vertex by itself.
    fn project(&self, body: &SolidBody, vertices: &mut [P3]) {
        for _ in 0..body.settings.projections {
            let is_near = self.push_out(body, vertices);
            let inside = self.inside(body, vertices);
            if !is_near && count(&inside) == 0 {
                break;
            }
            for (p, _) in vertices.iter_mut().zip(&inside).filter(|(_, i)| **i) {
                *p = body.outside_of_all(p).unwrap_or(*p);
            }
        }
    }

    /// Moves vertices that are too near to their places outside; true if there is any.
    fn push_out(&self, body: &SolidBody, vertices: &mut [P3]) -> bool {
        let mut places = vec![None; vertices.len()];
        let any = self.push(body, body.settings.least, vertices, &mut places);
        for (p, place) in vertices.iter_mut().zip(places) {
            *p = place.unwrap_or(*p);
        }
        any
    }

    /// Membership in the body's interior of each vertex that is not hidden.
    fn inside(&self, body: &SolidBody, vertices: &[P3]) -> Vec<bool> {
        let mut inside = body.contains(vertices);
        for (i, hidden) in inside.iter_mut().zip(&self.hidden) {
            *i &= !hidden;
        }
        inside
    }

    /// Targets of vertices nearer than a distance; true if there is any.
    fn push(
        &self,
        body: &SolidBody,
        least: f32,
        vertices: &[P3],
        targets: &mut [Option<P3>],
    ) -> bool {
        let mut out = Vec::new();
        par::map_into(Par::Rayon, vertices.len(), 128, &mut out, |v| {
            let place = || body.outside(&vertices[v], self.below[v], least);
            (!self.hidden[v]).then(place).flatten()
        });
        let mut any = false;
        for (slot, p) in targets.iter_mut().zip(out) {
            any |= p.is_some();
            *slot = p.or(*slot);
        }
        any
    }
}

/// System that moves one garment out of bodies.
#[derive(Debug)]
pub struct PenetrationSolver {
    side: InnerSide,
    fit: SurfaceFit,
}

impl PenetrationSolver {
    /// Prepares the system of a garment.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a garment too large.
    pub fn new(part: &ClothPart) -> Result<Self, CaptureError> {
        let n = part.nodes.len();
        Ok(Self {
            fit: SurfaceFit::new("retargeting", n, &part.faces, |_| 1.0, Vec::new())?,
            side: InnerSide {
                below: part.below.clone(),
                hidden: part.hidden.clone(),
            },
        })
    }

    /// Moves vertices out of the body with the least change of edges; afterwards none is inside unless the report says so.
    /// The result is a fixed point: run again, nothing moves.
    ///
    /// # Errors
    /// [`CaptureError::Solve`].
    pub fn run(
        &mut self,
        body: &SolidBody,
        vertices: &mut Vec<P3>,
    ) -> Result<RetargetReport, CaptureError> {
        let (side, settings) = (&self.side, &body.settings);
        let inside_before = count(&side.inside(body, vertices));
        let mut report = RetargetReport {
            inside_before,
            ..RetargetReport::default()
        };
        let mut pushed: Vec<Option<P3>> = vec![None; vertices.len()];
        let is_near = side.push(body, settings.least - ROUNDING, vertices, &mut pushed);
        if !is_near && inside_before == 0 {
            return Ok(report);
        }
        let wanted = vertices.clone();
        let terms = SurfaceTerms {
            model: &wanted,
            coupling: 1.0,
            smoothness: &[],
            anchor: settings.anchor,
            iterations: settings.rounds,
            settings: &settings.fit,
        };
        let fitted = self.fit.run(&terms, vertices, |x| {
            let pull = |(v, target): (u32, &Option<P3>)| {
                Some(Pull {
                    at: PullPlace::Vertex(v),
                    weight: settings.push,
                    target: (*target)?,
                })
            };
            let any = side.push(body, settings.least, x, &mut pushed);
            Ok(any.then(|| (0..).zip(&pushed).filter_map(pull).collect()))
        })?;
        report.solves = fitted.iterations;
        side.project(body, vertices);
        let inside = side.inside(body, vertices);
        self.gather(body, vertices, inside);
        self.side.push_out(body, vertices);
        report.inside = count(&self.side.inside(body, vertices));
        let moved = vertices.iter().zip(&wanted).map(|(a, b)| (a - b).norm());
        report.largest_push = moved.fold(0.0, f32::max);
        Ok(report)
    }

    /// Moves vertices that are still inside towards neighbours outside: in a fold of the skin, where pushing out of one side
    /// is pushing into the other, cloth bunches up.
    pub(super) fn gather(&self, body: &SolidBody, vertices: &mut [P3], mut inside: Vec<bool>) {
        loop {
            let before = count(&inside);
            for &[a, b] in self.fit.edges() {
                for [v, w] in [[a, b], [b, a]].map(|e| e.map(|v| v as usize)) {
                    if !inside[v] || inside[w] {
                        continue;
                    }
                    let way = vertices[w] - vertices[v];
                    let mut tried = body.settings.ways.iter().map(|t| vertices[v] + way * *t);
                    if let Some(free) = tried.find(|p| !body.encloses(p)) {
                        (vertices[v], inside[v]) = (free, false);
                    }
                }
            }
            if count(&inside) == before {
                break;
            }
        }
    }
}

fn count(inside: &[bool]) -> usize {
    inside.iter().filter(|b| **b).count()
}
