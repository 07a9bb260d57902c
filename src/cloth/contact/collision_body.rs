//! The posed body as cloth meets it and as it is drawn: filtered, parts and joints separated, with normals and interior.

use super::body_filter::filter_body;
use super::interior::Interior;
use super::joint_clearance::JointClearance;
use super::part_clearance::PartClearance;
use super::{Part, SurfaceFrame, SurfaceModel};
use crate::settings::CollisionConfig;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{MeshError, Topology, TriMesh};
use tryon_geometry::par;
use tryon_geometry::spatial::Bvh;

/// A posed body that does not fit the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CollisionError {
    /// Wrong number of vertices.
    #[error("body vertices: {got} given, {expected} expected")]
    Count {
        /// Given.
        got: usize,
        /// Expected.
        expected: usize,
    },
    /// A vertex that is not finite.
    #[error("body vertex {vertex} is not finite")]
    NotFinite {
        /// The first of them.
        vertex: usize,
    },
}

/// Parts of a body's vertices, shape `[vertices]` each (see `body::parts`).
#[derive(Clone, Debug)]
pub struct CollisionParts {
    /// Parts of each vertex.
    pub own: Vec<Part>,
    /// Part that each vertex may penetrate, 0 for none.
    pub opposite: Vec<Part>,
    /// The same where both parts are thick and press on each other.
    pub pressing: Vec<Part>,
    /// Vertices of the upper and of the lower segment of each hinge joint.
    pub hinges: Vec<[Vec<u32>; 2]>,
}

/// Immutable part of a collision body: one per template, shared by `Arc`.
#[derive(Debug)]
pub struct CollisionModel {
    surface: SurfaceModel,
    opposite: Vec<Part>,
    pressing: Vec<Part>,
    joints: Vec<JointClearance>,
    /// Fitted to the template; copied into a workspace before it is refit.
    bvh: Bvh,
    config: CollisionConfig,
}

impl CollisionModel {
    /// Prepares bodies with the topology of `mesh`.
    ///
    /// # Errors
    /// Faults of the mesh.
    pub fn new(
        mesh: &TriMesh,
        parts: CollisionParts,
        config: CollisionConfig,
    ) -> Result<Self, MeshError> {
        let mut surface = SurfaceModel::new(mesh.faces().to_vec(), Topology::new(mesh)?, parts.own);
        surface.settings = config.surface;
        let joint = |segments| JointClearance::new(&surface, segments);
        Ok(Self {
            joints: parts.hinges.into_iter().filter_map(joint).collect(),
            bvh: Bvh::new(mesh.faces(), mesh.vertices()),
            opposite: parts.opposite,
            pressing: parts.pressing,
            surface,
            config,
        })
    }
    /// Replaces the settings.
    pub fn set_config(&mut self, config: CollisionConfig) {
        self.surface.settings = config.surface;
        self.config = config;
    }
    /// Connectivity and parts.
    pub fn surface(&self) -> &SurfaceModel {
        &self.surface
    }
    /// Checks the size and the values of a posed body.
    ///
    /// # Errors
    /// A wrong count, or a vertex that is not finite.
    pub fn check(&self, posed: &[P3]) -> Result<(), CollisionError> {
        if posed.len() != self.surface.vertices() {
            return Err(CollisionError::Count {
                got: posed.len(),
                expected: self.surface.vertices(),
            });
        }
        let faulty = posed.iter().position(|p| !p.iter().all(|c| c.is_finite()));
        faulty.map_or(Ok(()), |vertex| Err(CollisionError::NotFinite { vertex }))
    }
}

/// Scratch of [`CollisionBody::update`]. Dropping it changes no result.
#[derive(Debug, Default)]
pub struct CollisionWorkspace {
    filtered: Vec<P3>,
    bvh: Option<Bvh>,
}

/// State of a collision body: the result of its last update, and what the next one starts from.
///
/// Built once a pose and shared by whoever meets or draws the body. Any fixed frame of reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CollisionBody {
    frame: SurfaceFrame,
    interior: Interior,
    parts: PartClearance,
    /// The posed body after the noise dead band; empty before the first update.
    filtered: Vec<P3>,
}

impl CollisionBody {
    /// A body taken as it is: neither filtered nor separated, without normals.
    pub fn unfiltered(vertices: &[P3]) -> Self {
        Self {
            frame: SurfaceFrame::without_normals(vertices.to_vec()),
            ..Self::default()
        }
    }
    /// Vertices, metres, shape `[vertices]`.
    pub fn vertices(&self) -> &[P3] {
        &self.frame.vertices
    }
    /// Vertices and normals; the latter are empty after an update that only moved the body.
    pub fn frame(&self) -> &SurfaceFrame {
        &self.frame
    }
    /// Skin inside another part.
    pub fn interior(&self) -> &Interior {
        &self.interior
    }

    /// Follows the posed body (metres, shape `[vertices]`) through `dt` seconds: filters and separates, without normals. The
    /// first update takes the posed body unfiltered. Returns the vertices separated from another part.
    ///
    /// # Errors
    /// A body that does not fit the model; the state is untouched then.
    pub fn update(
        &mut self,
        model: &CollisionModel,
        posed: &[P3],
        dt: f64,
        work: &mut CollisionWorkspace,
    ) -> Result<usize, CollisionError> {
        model.check(posed)?;
        self.filter(model, posed, dt, work);
        Ok(self.separate(model, work))
    }

    /// Places the body at a pose without the filter, as for draping: separates and updates normals and interior.
    ///
    /// # Errors
    /// As [`Self::update`].
    pub fn place(
        &mut self,
        model: &CollisionModel,
        posed: &[P3],
        work: &mut CollisionWorkspace,
    ) -> Result<(), CollisionError> {
        model.check(posed)?;
        self.frame.vertices.clear();
        self.frame.vertices.extend_from_slice(posed);
        self.filtered.clear();
        self.apply_clearances(model);
        self.refresh(model, work);
        Ok(())
    }

    /// It has not followed a posed body yet.
    pub(crate) fn is_new(&self) -> bool {
        self.filtered.is_empty()
    }

    /// Filter stage: the next filtered body, in the workspace.
    pub(crate) fn filter(
        &self,
        model: &CollisionModel,
        posed: &[P3],
        dt: f64,
        work: &mut CollisionWorkspace,
    ) {
        let mut known = [&self.filtered, &self.frame.vertices].into_iter();
        let last = known.find(|v| v.len() == posed.len());
        work.filtered.clear();
        work.filtered
            .extend_from_slice(last.map_or(posed, |v| &v[..]));
        filter_body(&model.config, &mut work.filtered, posed, dt);
    }

    /// Separation stage: takes the filtered body over with the clearances between parts and in joints.
    pub(crate) fn separate(
        &mut self,
        model: &CollisionModel,
        work: &mut CollisionWorkspace,
    ) -> usize {
        if work.filtered == self.filtered {
            return 0;
        }
        self.frame.vertices.clone_from(&work.filtered);
        std::mem::swap(&mut self.filtered, &mut work.filtered);
        self.apply_clearances(model)
    }

    fn apply_clearances(&mut self, model: &CollisionModel) -> usize {
        let (config, surface, pressing) = (&model.config, &model.surface, &model.pressing);
        let separated = self.parts.apply(config, surface, pressing, &mut self.frame);
        for joint in &model.joints {
            joint.apply(config, &mut self.frame.vertices);
        }
        separated
    }

    /// Last stage: normals and interior. Returns the vertices inside another part.
    pub(crate) fn refresh(
        &mut self,
        model: &CollisionModel,
        work: &mut CollisionWorkspace,
    ) -> usize {
        let (config, surface) = (&model.config, &model.surface);
        surface.update_normals(config.par, &mut self.frame);
        let bvh = work.bvh.get_or_insert_with(|| model.bvh.clone());
        self.interior
            .update(config, surface, &model.opposite, &self.frame, bvh);
        self.interior.count()
    }

    /// The filtered body with the clearances of the last separation, `None` when it has not moved.
    pub(crate) fn shifted(
        &self,
        model: &CollisionModel,
        work: &CollisionWorkspace,
    ) -> Option<Vec<P3>> {
        let (from, to) = (&self.filtered, &work.filtered);
        (from != to).then(|| {
            let mut shifted = Vec::new();
            par::map_into(model.config.par, to.len(), 4096, &mut shifted, |v| {
                self.frame.vertices[v] + (to[v] - from[v])
            });
            shifted
        })
    }

    /// Takes [`Self::shifted`] vertices over, without normals.
    pub(crate) fn shift(&mut self, shifted: Vec<P3>, work: &mut CollisionWorkspace) {
        self.frame = SurfaceFrame::without_normals(shifted);
        std::mem::swap(&mut self.filtered, &mut work.filtered);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::two_spheres;
    use super::*;
    use tryon_geometry::par::Par;

    /// Two spheres of 10 cm whose parts press on each other, and their vertices at a distance of 30 cm.
    fn model(noise_deadband: f64) -> (CollisionModel, Vec<P3>, usize) {
        let (surface, frame, n) = two_spheres(4, 0.1, [0.0, 0.3], [1, 2]);
        let opposite: Vec<Part> = (0..2 * n).map(|i| if i < n { 2 } else { 1 }).collect();
        let parts = CollisionParts {
            own: (0..2 * n as u32).map(|v| surface.part(v)).collect(),
            pressing: opposite.clone(),
            opposite,
            hinges: Vec::new(),
        };
        let mesh = TriMesh::new(frame.vertices.clone(), surface.faces().to_vec()).expect("a mesh");
        let config = CollisionConfig {
            noise_deadband,
            par: Par::Seq,
            ..CollisionConfig::default()
        };
        let model = CollisionModel::new(&mesh, parts, config).expect("a model");
        (model, frame.vertices, n)
    }

    fn at(start: &[P3], n: usize, distance: f32) -> Vec<P3> {
        let mut body = start.to_vec();
        body[n..].iter_mut().for_each(|p| p.x += distance - 0.3);
        body
    }

    #[test]
    fn spheres_that_press_are_separated_and_distant_ones_keep_every_bit() {
        let (model, start, n) = model(0.0);
        let (mut body, mut work) = (CollisionBody::default(), CollisionWorkspace::default());
        let r = body
            .update(&model, &start, 0.03, &mut work)
            .expect("it fits");
        let interior = body.refresh(&model, &mut work);
        assert_eq!((r, interior, body.vertices()), (0, 0, &start[..]));
        let r = body
            .update(&model, &at(&start, n, 0.19), 0.03, &mut work)
            .expect("it fits");
        assert!(r > 0 && body.refresh(&model, &mut work) == 0, "{r}");
        let gap = body.vertices()[n + 1].x - body.vertices()[0].x;
        assert!((gap - 0.013).abs() < 1e-3, "{gap} m between the poles");
        assert_eq!(body.frame().normals.len(), start.len());
    }

    #[test]
    fn noise_below_the_dead_band_is_not_followed_and_steps_are() {
        let (model, start, _) = model(8e-3);
        let (mut body, mut work) = (CollisionBody::default(), CollisionWorkspace::default());
        let moved = |by: f32| -> Vec<P3> {
            let by = tryon_geometry::math::V3::new(0.0, by, 0.0);
            start.iter().map(|p| p + by).collect()
        };
        body.update(&model, &start, 0.0, &mut work)
            .expect("it fits");
        let mut follow = |by: f32| {
            body.update(&model, &moved(by), 1.0 / 30.0, &mut work)
                .expect("it fits");
            body.vertices()[0].y - start[0].y
        };
        assert!(follow(1e-3) < 1e-4);
        assert!((follow(0.1) - 0.1).abs() < 1e-6);
    }

    #[test]
    fn faulty_bodies_are_refused_and_leave_the_state() {
        let (model, mut start, _) = model(0.0);
        let (mut body, mut work) = (CollisionBody::default(), CollisionWorkspace::default());
        body.update(&model, &start, 0.03, &mut work)
            .expect("it fits");
        let before = body.clone();
        let short = body.update(&model, &start[1..], 0.03, &mut work);
        assert!(matches!(short, Err(CollisionError::Count { .. })));
        start[7].y = f32::NAN;
        let broken = body.update(&model, &start, 0.03, &mut work);
        assert_eq!(broken, Err(CollisionError::NotFinite { vertex: 7 }));
        assert_eq!(body, before);
    }
}
