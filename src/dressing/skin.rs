//! Collision body of a drape.

use crate::cloth::Model;
use crate::cloth::repair::sleeve_rings::CentreLine;
use crate::contact::{
    ClosestPoint, CollisionBody, CollisionError, CollisionWorkspace, Part, SkinGrid, SurfaceFrame,
    SurfaceModel,
};
use crate::math::P3;

/// The body of an outfit's model as garments meet it while they are put on.
#[derive(Debug)]
pub(super) struct Skin<'a> {
    pub(super) model: &'a SurfaceModel,
    outfit: &'a Model,
    body: CollisionBody,
    work: CollisionWorkspace,
    grid: SkinGrid,
}

impl<'a> Skin<'a> {
    /// Without a pose yet.
    pub(super) fn of(outfit: &'a Model) -> Self {
        Self {
            model: outfit.collision().surface(),
            outfit,
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
        let collision = self.outfit.collision();
        self.body.place(collision, posed, &mut self.work)?;
        self.grid.fill(self.body.frame());
        Ok(())
    }
    pub(super) fn frame(&self) -> &SurfaceFrame {
        self.body.frame()
    }
    /// Centre lines of the arms.
    pub(super) fn arm_lines(&self) -> [CentreLine; 2] {
        self.outfit.arms().lines(self.body.vertices())
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
