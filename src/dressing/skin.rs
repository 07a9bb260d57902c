//! Collision body of a drape.

use tryon_body::Template;
use tryon_body::parts::vertex_masks;
use tryon_cloth::contact::{
    ClosestPoint, CollisionBody, CollisionError, CollisionModel, CollisionWorkspace, Part,
    SkinGrid, SurfaceFrame, SurfaceModel,
};
use tryon_cloth::sleeve_rings::{Arms, CentreLine, SleeveSettings};
use tryon_cloth::{ClothError, Config, collision_model};
use tryon_geometry::math::P3;

/// Immutable part of [`Skin`].
#[derive(Debug)]
pub(super) struct SkinModel {
    collision: CollisionModel,
    arms: Arms,
}

impl SkinModel {
    /// Of bodies made from `template`.
    ///
    /// # Errors
    /// Faults of the template's mesh.
    pub(super) fn new(template: &Template, config: &Config) -> Result<Self, ClothError> {
        Ok(Self {
            collision: collision_model(template, config)?,
            arms: Arms::new(template, &vertex_masks(template), SleeveSettings::default()),
        })
    }
}

/// A body as garments meet it while they are put on.
#[derive(Debug)]
pub(super) struct Skin<'a> {
    pub(super) model: &'a SurfaceModel,
    whole: &'a SkinModel,
    body: CollisionBody,
    work: CollisionWorkspace,
    grid: SkinGrid,
}

impl<'a> Skin<'a> {
    /// Without a pose yet.
    pub(super) fn of(whole: &'a SkinModel) -> Self {
        Self {
            model: whole.collision.surface(),
            whole,
            body: CollisionBody::default(),
            work: CollisionWorkspace::default(),
            grid: SkinGrid::default(),
        }
    }
    /// Places the body at a pose, world, metres.
    ///
    /// # Errors
    /// A body that does not fit the model.
    pub(super) fn place(&mut self, posed: &[P3]) -> Result<(), CollisionError> {
        self.body
            .place(&self.whole.collision, posed, &mut self.work)?;
        self.grid.fill(self.model, self.body.frame());
        Ok(())
    }
    pub(super) fn frame(&self) -> &SurfaceFrame {
        self.body.frame()
    }
    /// Centre lines of the arms.
    pub(super) fn arm_lines(&self) -> [CentreLine; 2] {
        self.whole.arms.lines(self.body.vertices())
    }
    /// The skin at a point lies inside another body part.
    pub(super) fn is_interior(&self, c: &ClosestPoint) -> bool {
        let corners = self.model.faces()[c.face as usize];
        self.body.interior().covers(corners)
    }
    /// The closest point of some parts to `p`: from a walk, or a nearer candidate of the grid.
    pub(super) fn closest(&self, p: &P3, start: u32, mask: Part) -> ClosestPoint {
        let walked = self.model.closest(self.frame(), p, start, mask);
        let [closest, _] = self.nearer(p, [walked; 2], [mask, 0]);
        closest
    }
    /// Of two masks of parts the points where walks ended, or nearer candidates of the grid.
    pub(super) fn nearer(
        &self,
        p: &P3,
        walked: [ClosestPoint; 2],
        masks: [Part; 2],
    ) -> [ClosestPoint; 2] {
        let near = self.grid.candidates(self.model, self.frame(), p, masks);
        std::array::from_fn(|k| {
            let found = near[k].or_nearer(self.model, self.frame(), p, Some(walked[k]), masks[k]);
            found.unwrap_or(walked[k])
        })
    }
    /// The collision body, for the state of the simulation.
    pub(super) fn into_body(self) -> CollisionBody {
        self.body
    }
}
