//! What stays the same while an outfit is worn.

use crate::body::{SkinWeights, Template};
use crate::cloth::quasi_newton::hold_unit;
use crate::cloth::{ClothError, Sheet};
use crate::contact::{MapView, SurfaceModel};
use crate::garment::{GarmentMesh, Region};
use crate::linear::SymbolicFactor;
use crate::mesh::Topology;
use serde::{Deserialize, Serialize};

/// A garment vertex tied to a triangle of the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnchorBinding {
    /// Simulation vertex.
    pub vertex: u32,
    /// Body triangle.
    pub body: [u32; 3],
    /// Barycentric weights.
    pub weights: [f32; 3],
    /// Height above the triangle along its normal, metres.
    pub height: f32,
    /// How firmly, 0 to 1.
    pub strength: f64,
}

/// Garments that have been put on one body: meshes and what ties them to it. Innermost first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outfit {
    /// Garments, innermost layer first.
    pub garments: Vec<GarmentMesh>,
    /// Anchors of each garment.
    pub anchors: Vec<Vec<AnchorBinding>>,
}

/// How to simulate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Steps of the integrator in one call.
    pub substeps: usize,
    /// Iterations of each step.
    pub iterations: usize,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Distance of the innermost layer from the skin, metres.
    pub offset: f64,
    /// Further distance of each layer, metres.
    pub layer_offset: f64,
    /// Horizontal direction the real camera looks along, world x and z: its depth map is the fine one.
    pub camera_toward: [f32; 2],
    /// Let cloth sleep when it and the body are still.
    pub sleep: bool,
    /// A body vertex that moves further than this between two calls has jumped, metres.
    pub teleport: f64,
    /// Threads.
    #[serde(skip)]
    pub par: crate::par::Par,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            substeps: 2,
            iterations: 5,
            gravity: [0.0, -9.81, 0.0],
            offset: 0.005,
            layer_offset: 0.004,
            camera_toward: [0.0, -1.0],
            sleep: true,
            teleport: 0.2,
            par: crate::par::Par::Rayon,
        }
    }
}

/// One garment's constant data.
#[derive(Debug)]
pub(super) struct GarmentModel {
    pub(super) sheet: Sheet,
    pub(super) symbolic: SymbolicFactor,
    /// Typical diagonal at the configured substep of 1/60 s, N/m.
    pub(super) unit: Vec<f64>,
    /// Body parts that decide: cloth ends outside these.
    pub(super) own: Vec<u8>,
    /// Body parts that push first and yield.
    pub(super) other: Vec<u8>,
    /// Distance from the skin, metres.
    pub(super) offset: f64,
}

/// Everything immutable about an outfit on a body. Share it by `Arc`.
#[derive(Debug)]
pub struct Model {
    /// What is worn.
    pub outfit: Outfit,
    /// How it is simulated.
    pub config: Config,
    pub(super) garments: Vec<GarmentModel>,
    pub(super) surface: SurfaceModel,
    pub(super) weights: SkinWeights,
    pub(super) joints: usize,
    pub(super) views: [MapView; 4],
}

/// Rings by which neighbouring parts of the body overlap, so that cloth across a joint line always has a surface.
const PART_OVERLAP: usize = 4;
/// The substep hold stiffness is scaled for, s.
pub(super) const USUAL_SUBSTEP: f64 = 1.0 / 60.0;

/// Which [`Region`] each body vertex belongs to, by the name of its dominant joint.
pub fn body_parts(template: &Template) -> Vec<u8> {
    let of = |name: &str| {
        let left = name.starts_with("left");
        let has = |words: &[&str]| words.iter().any(|w| name.contains(w));
        if has(&["shoulder", "elbow", "wrist", "hand", "finger", "thumb", "arm"]) {
            if left { Region::LEFT_ARM } else { Region::RIGHT_ARM }
        } else if has(&["hip", "knee", "ankle", "foot", "toe", "leg"]) {
            if left { Region::LEFT_LEG } else { Region::RIGHT_LEG }
        } else {
            Region::TRUNK
        }
    };
    let by_joint: Vec<u8> = template.skeleton().joints().iter().map(|j| of(&j.name).0).collect();
    (0..template.mesh().vertices().len()).map(|i| by_joint[template.weights().dominant(i)]).collect()
}

impl Model {
    /// Prepares an outfit for simulation on a body made from `template`.
    ///
    /// # Errors
    /// Faults of the garments (triangle or edge named) or of the settings (field named).
    pub fn new(template: &Template, outfit: Outfit, config: Config) -> Result<Self, ClothError> {
        let field = |field: &str, why: &str| ClothError::Field { field: field.to_owned(), why: why.to_owned() };
        if config.substeps == 0 || config.iterations == 0 {
            return Err(field("substeps, iterations", "both must be at least 1"));
        }
        if !(config.offset.is_finite() && config.layer_offset.is_finite() && config.teleport > 0.0) {
            return Err(field("offset, layer_offset, teleport", "they must be finite, teleport positive"));
        }
        if outfit.anchors.len() != outfit.garments.len() {
            return Err(ClothError::Count {
                what: "anchor lists",
                got: outfit.anchors.len(),
                expected: outfit.garments.len(),
            });
        }
        let body = template.mesh().vertices().len();
        let mut garments = Vec::new();
        for (order, (g, anchors)) in outfit.garments.iter().zip(&outfit.anchors).enumerate() {
            if let Some(a) =
                anchors.iter().find(|a| a.vertex as usize >= g.vertices || a.body.iter().any(|v| *v as usize >= body))
            {
                return Err(field(&format!("anchor of vertex {}", a.vertex), "it names a vertex that does not exist"));
            }
            let sheet = Sheet::of_garment(g)?;
            let symbolic = SymbolicFactor::new(sheet.pattern.clone())?;
            let unit = hold_unit(&sheet, USUAL_SUBSTEP);
            let own: Vec<u8> = g.regions.iter().map(|r| r.0).collect();
            let other = own.iter().map(|o| Region::ALL.0 & !o).collect();
            let offset = config.offset + config.layer_offset * order as f64;
            garments.push(GarmentModel { sheet, symbolic, unit, own, other, offset });
        }
        Ok(Self {
            surface: SurfaceModel::new(
                template.mesh().faces().to_vec(),
                Topology::new(template.mesh())?,
                body_parts(template),
                PART_OVERLAP,
            ),
            weights: template.weights().clone(),
            joints: template.skeleton().len(),
            views: MapView::around(config.camera_toward),
            garments,
            outfit,
            config,
        })
    }
    /// Vertices of the body it was made for.
    pub fn body_vertices(&self) -> usize {
        self.surface.vertices()
    }
    /// The same body and settings with other anchors.
    pub(crate) fn set_anchors(&mut self, anchors: Vec<Vec<AnchorBinding>>) {
        self.outfit.anchors = anchors;
    }
    /// The body surface that garments touch.
    pub(crate) fn surface(&self) -> &SurfaceModel {
        &self.surface
    }
    /// Changes settings that need no new factorisation structure.
    pub(crate) fn config_mut(&mut self) -> &mut Config {
        &mut self.config
    }
    /// Distance from the skin of one garment's layer, metres.
    pub(crate) fn offset(&self, garment: usize) -> f64 {
        self.garments[garment].offset
    }
}
