//! State of an outfit between steps.

use super::error::ClothError;
use super::outfit_model::Model;
use super::sleep::SleepState;
use crate::contact::CollisionBody;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3, V3};

/// State of one garment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GarmentState {
    /// Positions of the simulation vertices, world, metres.
    pub positions: Vec<P3>,
    /// Velocities, m/s.
    pub velocities: Vec<V3>,
    /// Nearest body vertex of each vertex, among its own parts and among the others.
    pub(super) nearest: Vec<[u32; 2]>,
    /// Vertices that intersected cloth at the last query, in ascending order.
    #[serde(default, rename = "passing")]
    pub(super) intersecting: Vec<u32>,
}

/// State of an outfit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Garments, in the order of [`super::Outfit::garments`].
    pub garments: Vec<GarmentState>,
    /// Body of the last step, world.
    pub(super) body: CollisionBody,
    pub(super) sleep: SleepState,
    /// Steps so far.
    pub frames: u64,
    /// Steps since positions were last computed without a fault; positions are the last good ones.
    pub stale: u32,
}

impl State {
    /// Garments at rest at these positions (world, metres) on this body, which is taken as it is.
    ///
    /// # Errors
    /// Wrong counts or values that are not finite.
    pub fn new(model: &Model, positions: Vec<Vec<P3>>, body: &[P3]) -> Result<Self, ClothError> {
        Self::on_body(model, positions, CollisionBody::unfiltered(body))
    }

    /// Garments at rest on a collision body of the model.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn on_body(
        model: &Model,
        positions: Vec<Vec<P3>>,
        body: CollisionBody,
    ) -> Result<Self, ClothError> {
        check_count("garments", positions.len(), model.outfit.garments.len())?;
        model.collision.check(body.vertices())?;
        let mut garments = Vec::new();
        for (k, p) in positions.into_iter().enumerate() {
            let expected = model.outfit.garments[k].vertices;
            check_count("garment vertices", p.len(), expected)?;
            let faulty = p.iter().position(|q| !q.iter().all(|c| c.is_finite()));
            if let Some(index) = faulty {
                let what = "garment vertex";
                return Err(ClothError::NotFinite { what, index });
            }
            garments.push(GarmentState::at_rest(model, k, p, &body));
        }
        Ok(Self {
            garments,
            sleep: SleepState::new(body.vertices()),
            body,
            ..Self::default()
        })
    }

    /// The body of the last step as cloth met it (world): filtered, parts and joints separated. Draw this one.
    pub fn collision_body(&self) -> &CollisionBody {
        &self.body
    }
}

impl GarmentState {
    /// Garment `k` of the outfit at rest on a body.
    fn at_rest(model: &Model, k: usize, positions: Vec<P3>, body: &CollisionBody) -> Self {
        let m = &model.garments[k];
        let (surface, par) = (model.collision.surface(), model.config.par);
        let nearest =
            |masks: &[u8]| surface.nearest_vertices(par, body.frame(), &positions, masks.iter());
        Self {
            nearest: nearest(&m.own)
                .into_iter()
                .zip(nearest(&m.other))
                .map(|(own, other)| [own, other])
                .collect(),
            velocities: vec![V3::zeros(); positions.len()],
            positions,
            ..Self::default()
        }
    }
}

fn check_count(what: &'static str, got: usize, expected: usize) -> Result<(), ClothError> {
    if got == expected {
        Ok(())
    } else {
        Err(ClothError::Count {
            what,
            got,
            expected,
        })
    }
}
