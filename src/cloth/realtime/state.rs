//! What changes from step to step, what goes in and what comes out.

use super::Model;
use super::piece::Piece;
use super::piled::Piled;
use super::regions::Rest;
use super::untangle::Untangle;
use crate::cloth::ClothError;
use crate::cloth::folds::FoldFrame;
use crate::cloth::solver::explicit::{ContactPlane, FoldLimit, PatchState, Pin};
use crate::contact::{Apart, Buried, DepthMaps, NearSkin, SurfaceFrame};
use crate::math::{P3, V3};
use serde::{Deserialize, Serialize};

/// Where one garment is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GarmentState {
    /// Positions of the simulation vertices, world, metres.
    pub positions: Vec<P3>,
    /// Velocities, m/s.
    pub velocities: Vec<V3>,
    /// Nearest body vertex of each vertex, among the parts it belongs to and among the others.
    pub(super) nearest: Vec<[u32; 2]>,
    /// Nearest vertex of every garment further out, shape `[garments][vertices]`; empty for the others.
    pub(super) layers: Vec<Vec<u32>>,
    /// Vertices that passed through other cloth when that was last looked for, in order.
    #[serde(default)]
    pub(super) passing: Vec<u32>,
    /// In how many of the last looks at it each vertex passed through other cloth, less those in which it did not; empty
    /// before the first look.
    #[serde(default)]
    pub(super) stuck: Vec<u8>,
}

/// Where an outfit is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Garments, in the order of [`super::Outfit::garments`].
    pub garments: Vec<GarmentState>,
    /// Body of the last step, world, metres.
    pub(super) body: Vec<P3>,
    /// Skin that lies inside another part of the body.
    pub(super) buried: Buried,
    /// How near parts of the body are to each other.
    #[serde(default)]
    pub(super) apart: Apart,
    /// Body when it last moved by more than it may while cloth sleeps.
    pub(super) awake_body: Vec<P3>,
    /// The measured body, held steady; empty before the first step.
    #[serde(default)]
    pub(super) followed: Vec<P3>,
    /// What of the cloth sleeps by itself.
    #[serde(default)]
    pub(super) rest: Rest,
    /// How long the body has been still, s.
    #[serde(default)]
    pub(super) quiet_for: f64,
    /// Steps so far.
    pub frames: u64,
    /// Steps in a row with body and cloth still.
    pub(super) still: u32,
    /// Steps since positions were last computed without a fault; positions are the last good ones.
    pub stale: u32,
}

impl State {
    /// Garments at rest at these positions (world, metres) on this body.
    ///
    /// # Errors
    /// Wrong counts or values that are not finite.
    pub fn new(model: &Model, positions: Vec<Vec<P3>>, body: &[P3]) -> Result<Self, ClothError> {
        if positions.len() != model.outfit.garments.len() {
            return Err(ClothError::Count {
                what: "garments",
                got: positions.len(),
                expected: model.outfit.garments.len(),
            });
        }
        check_body(model, body)?;
        let frame = SurfaceFrame {
            vertices: body.to_vec(),
            normals: Vec::new(),
        };
        let mut garments = Vec::new();
        for ((p, g), m) in positions
            .into_iter()
            .zip(&model.outfit.garments)
            .zip(&model.garments)
        {
            if p.len() != g.vertices {
                return Err(ClothError::Count {
                    what: "garment vertices",
                    got: p.len(),
                    expected: g.vertices,
                });
            }
            if let Some(index) = p.iter().position(|q| !q.iter().all(|c| c.is_finite())) {
                return Err(ClothError::NotFinite {
                    what: "garment vertex",
                    index,
                });
            }
            let of = |masks: &[u8]| {
                model
                    .surface
                    .nearest_vertices(model.config.par, &frame, &p, masks.iter())
            };
            let nearest = of(&m.own)
                .into_iter()
                .zip(of(&m.other))
                .map(|(own, other)| [own, other])
                .collect();
            garments.push(GarmentState {
                velocities: vec![V3::zeros(); p.len()],
                positions: p,
                nearest,
                layers: Vec::new(),
                passing: Vec::new(),
                stuck: Vec::new(),
            });
        }
        let all: Vec<SurfaceFrame> = garments
            .iter()
            .map(|g| SurfaceFrame {
                vertices: g.positions.clone(),
                normals: Vec::new(),
            })
            .collect();
        for (k, g) in garments.iter_mut().enumerate() {
            for (j, frame) in all.iter().enumerate() {
                let (surface, own) = (&model.garments[j].folds.surface, &model.garments[k].own);
                let near = if j > k {
                    surface.nearest_vertices(model.config.par, frame, &g.positions, own.iter())
                } else {
                    Vec::new()
                };
                g.layers.push(near);
            }
        }
        Ok(Self {
            garments,
            body: body.to_vec(),
            awake_body: body.to_vec(),
            ..Self::default()
        })
    }
    /// With what is known already about the skin of the body that the garments were put on.
    pub(crate) fn on_skin(self, buried: Buried, apart: Apart) -> Self {
        Self {
            buried,
            apart,
            ..self
        }
    }
}

pub(super) fn check_body(model: &Model, body: &[P3]) -> Result<(), ClothError> {
    if body.len() != model.body_vertices() {
        return Err(ClothError::Count {
            what: "body vertices",
            got: body.len(),
            expected: model.body_vertices(),
        });
    }
    match body.iter().position(|q| !q.iter().all(|c| c.is_finite())) {
        Some(index) => Err(ClothError::NotFinite {
            what: "body vertex",
            index,
        }),
        None => Ok(()),
    }
}

/// What a step needs to know.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Posed body, world (y up), metres; shape `[body vertices]`. Its speed follows from the previous call.
    pub body: &'a [P3],
    /// Time since the previous call, s.
    pub dt: f64,
}

/// How a step went.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Small steps of the garment that needed the most.
    pub steps: usize,
    /// Smallest share of its membrane stiffness that a garment keeps at its step.
    pub softened: f64,
    /// Largest stretch of an edge (length over rest length, minus one).
    pub max_strain: f64,
    /// 99th percentile of the stretch.
    pub p99_strain: f64,
    /// Deepest vertex under the skin before the last push-out, metres.
    pub penetration: f64,
    /// Deepest vertex under the skin in the result, metres.
    pub penetration_left: f64,
    /// Vertices in contact.
    pub contacts: usize,
    /// Speed that 95 % of the fastest garment do not exceed, mean over the call, m/s.
    pub speed: f64,
    /// Vertices that were not simulated because cloth and body were still.
    pub sleeping: usize,
    /// Searches for the nearest skin that were left out because the vertex was too far away to reach it.
    pub searches_skipped: usize,
    /// Searches for other folds of the same garment that were left out for the same reason.
    #[serde(default)]
    pub fold_searches_skipped: usize,
    /// Vertices held off another layer or another fold of the same garment.
    pub cloth_contacts: usize,
    /// Contact planes of other body parts ignored because there was no room between them and the vertex's own part.
    pub pinched: usize,
    /// Body vertices that lie inside another part of it, where nothing holds cloth.
    pub buried: usize,
    /// Edges that passed through triangles of the same garment, of the garments that were looked at in this call.
    #[serde(default)]
    pub crossings: usize,
    /// Rings of sleeves that had lost their arm and were put around it again.
    #[serde(default)]
    pub sleeves_put_back: usize,
    /// The body jumped and the cloth was carried along.
    pub teleported: bool,
    /// A fault was caught and the last good state kept: which.
    pub kept_last_good: Option<String>,
    /// Milliseconds by stage.
    pub stages_ms: StagesMs,
}

/// Milliseconds of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StagesMs {
    /// Depth maps of the body.
    pub maps: f64,
    /// Finding contacts.
    pub contact: f64,
    /// Stepping.
    pub solve: f64,
    /// Everything.
    pub total: f64,
}

/// Scratch. Dropping it changes no result, only the time of the next step.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) patches: Vec<PatchScratch>,
    pub(super) pieces: Vec<Piece>,
    pub(super) before: SurfaceFrame,
    pub(super) after: SurfaceFrame,
    pub(super) now: SurfaceFrame,
    /// Vertices of the body at the end of the call.
    pub(super) near_skin: NearSkin,
    /// The measured body, held steady, and the same with room between its parts.
    pub(super) followed: Vec<P3>,
    pub(super) roomy: SurfaceFrame,
    /// Garments at the beginning of a round, for contact of cloth with cloth.
    pub(super) sheets: Vec<FoldFrame>,
    /// What lies on the skin, for garments over it.
    pub(super) piled: Piled,
    pub(super) maps: DepthMaps,
    pub(super) untangle: Untangle,
}

/// One patch of one garment during a call.
#[derive(Debug, Default)]
pub(super) struct PatchScratch {
    pub(super) motion: PatchState,
    /// Vertices that sleep.
    pub(super) asleep: Vec<bool>,
    /// Planes within reach for some steps, and how many of them are the body's, the first ones.
    pub(super) near: Vec<ContactPlane>,
    pub(super) body_near: usize,
    /// Vertices of cloth that is drawn long: it has no room for wide folds.
    pub(super) drawn: Vec<bool>,
    /// Vertices that are about to tear.
    pub(super) torn: Vec<bool>,
    pub(super) ties: Vec<Pin>,
    /// What keeps folds from becoming too sharp during a round.
    pub(super) struts: Vec<FoldLimit>,
    /// Vertices whose place is given: nothing else may push them.
    pub(super) tied: Vec<bool>,
    /// Vertices in contact with the body.
    pub(super) contacts: usize,
}

impl AsMut<PatchState> for PatchScratch {
    fn as_mut(&mut self) -> &mut PatchState {
        &mut self.motion
    }
}

impl PatchScratch {
    /// Where vertex `i` of it is, metres.
    pub(super) fn place(&self, i: usize) -> P3 {
        self.motion.position(i).point()
    }
}
