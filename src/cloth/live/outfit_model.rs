//! Immutable data of an outfit on a body.

use super::collision::collision_model;
use super::error::ClothError;
use super::garment_model::GarmentModel;
use super::model::Sheet;
use super::model::partition::Partition;
use super::outfit::{AnchorBinding, Outfit};
use super::sleep::island_model::skin_clusters;
use crate::contact::{CollisionModel, MapView};
use crate::settings::Config;
use tryon_body::{SkinWeights, Template};
use tryon_garment::GarmentMesh;
use tryon_geometry::par;

/// Body of an outfit: its collision model, and the skinning that cloth follows where it jumps.
#[derive(Debug)]
pub(crate) struct WornBody {
    pub(crate) collision: CollisionModel,
    /// Skin weights of its vertices, and the number of joints.
    pub(crate) weights: SkinWeights,
    pub(crate) joints: usize,
}

/// Everything immutable about an outfit on a body. Share it by `Arc`.
#[derive(Debug)]
pub struct Model {
    /// Garments and anchors.
    pub outfit: Outfit,
    pub(super) config: Config,
    pub(super) garments: Vec<GarmentModel>,
    pub(super) collision: CollisionModel,
    /// Body vertices in compact clusters.
    pub(super) skin_clusters: Partition,
    pub(super) weights: SkinWeights,
    pub(super) joints: usize,
    pub(super) views: [MapView; 4],
}

impl Model {
    /// Prepares an outfit for simulation on a body made from `template`.
    ///
    /// # Errors
    /// Faults of the garments (triangle or edge named) or of the settings (field named).
    pub fn new(template: &Template, outfit: Outfit, config: Config) -> Result<Self, ClothError> {
        let body = WornBody {
            collision: collision_model(template, &config)?,
            weights: template.weights().clone(),
            joints: template.skeleton().len(),
        };
        Self::on_body(body, outfit, config, Sheet::of_garment)
    }
    /// Prepares an outfit whose garments are these sheets on any body.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn on_body(
        body: WornBody,
        outfit: Outfit,
        config: Config,
        sheet: impl Fn(&GarmentMesh) -> Result<Sheet, ClothError> + Sync,
    ) -> Result<Self, ClothError> {
        config.check()?;
        check_anchors(body.collision.surface().vertices(), &outfit)?;
        let mut garments: Vec<_> = outfit.garments.iter().map(|_| None).collect();
        par::for_chunks(config.par, &mut garments, 1, |order, garment| {
            let offset = config.layer_offset(order, outfit.garments.len());
            let g = &outfit.garments[order];
            garment[0] =
                Some(sheet(g).and_then(|sheet| GarmentModel::new(g, sheet, &config, offset)));
        });
        let garments = garments.into_iter().flatten().collect::<Result<_, _>>()?;
        let mut model = Self {
            skin_clusters: skin_clusters(body.collision.surface()),
            weights: body.weights,
            joints: body.joints,
            views: MapView::around(config.camera_toward, config.map_detail, &config.maps),
            collision: body.collision,
            garments,
            outfit,
            config,
        };
        model.assign_anchors();
        Ok(model)
    }
    /// Vertices of the body it was made for.
    pub fn body_vertices(&self) -> usize {
        self.collision.surface().vertices()
    }
    /// Settings of its steps.
    pub fn config(&self) -> &Config {
        &self.config
    }
    /// Replaces the settings of later steps, those of the collision body too, and returns the last ones. Substeps, patches and offsets stay.
    pub fn replace_config(&mut self, config: Config) -> Config {
        self.collision.set_config(config.collision());
        std::mem::replace(&mut self.config, config)
    }
    /// Replaces the anchors.
    pub fn set_anchors(&mut self, anchors: Vec<Vec<AnchorBinding>>) {
        self.outfit.anchors = anchors;
        self.assign_anchors();
    }
    fn assign_anchors(&mut self) {
        for (g, bindings) in self.garments.iter_mut().zip(&self.outfit.anchors) {
            g.assign_anchors(bindings);
        }
    }
    /// Patch vertex and binding of a patch's anchors.
    pub(super) fn anchors_of(
        &self,
        garment: usize,
        patch: usize,
    ) -> impl Iterator<Item = (u32, &AnchorBinding)> {
        let bindings = &self.outfit.anchors[garment];
        self.garments[garment].anchors[patch]
            .iter()
            .map(move |(i, k)| (*i, &bindings[*k]))
    }
    /// The body that garments meet.
    pub fn collision(&self) -> &CollisionModel {
        &self.collision
    }
    /// Distance of a garment from the skin, metres.
    pub fn offset(&self, garment: usize) -> f64 {
        self.garments[garment].offset
    }
}

impl Config {
    /// # Errors
    /// Names the first setting out of range.
    pub fn check(&self) -> Result<(), ClothError> {
        let lengths = [self.noise_deadband, self.untangle];
        let faults = [
            (
                self.most_steps == 0 || self.patch == 0,
                "most_steps, patch",
                "both must be at least 1",
            ),
            (
                !(0.0..=1.0).contains(&self.force_lookahead),
                "ahead",
                "must be between 0 and 1 step",
            ),
            (
                !(self.offset.is_finite()
                    && self.teleport > 0.0
                    && lengths.iter().all(|l| *l >= 0.0)),
                "offset, teleport, steady, untangle",
                "they must be finite, teleport positive, steady and untangle not negative",
            ),
        ];
        let fault = faults.into_iter().find(|f| f.0);
        fault.map_or(Ok(()), |(_, field, why)| Err(ClothError::field(field, why)))
    }
}

/// Checks that there are anchors for every garment, of vertices that exist; `body`: number of body vertices.
fn check_anchors(body: usize, outfit: &Outfit) -> Result<(), ClothError> {
    if outfit.anchors.len() != outfit.garments.len() {
        return Err(ClothError::Count {
            what: "anchor lists",
            got: outfit.anchors.len(),
            expected: outfit.garments.len(),
        });
    }
    for (g, anchors) in outfit.garments.iter().zip(&outfit.anchors) {
        let is_faulty = |a: &&AnchorBinding| {
            a.vertex as usize >= g.vertices || a.body.iter().any(|v| *v as usize >= body)
        };
        if let Some(a) = anchors.iter().find(is_faulty) {
            return Err(ClothError::field(
                &format!("anchor of vertex {}", a.vertex),
                "it names a vertex that does not exist",
            ));
        }
    }
    Ok(())
}
