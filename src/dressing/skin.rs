//! The collision body of the drape.

use crate::cloth::realtime::Model;
use crate::cloth::sleeves::{Arms, Line};
use crate::contact::{Apart, Buried, Closest, Crease, NearSkin, Part, SurfaceFrame, SurfaceModel};
use crate::math::P3;
use crate::par::Par;

/// Posed skin with its parts separated, for one drape.
#[derive(Debug)]
pub(super) struct Skin<'a> {
    pub(super) model: &'a SurfaceModel,
    frame: SurfaceFrame,
    buried: Buried,
    apart: Apart,
    near: NearSkin,
    arms: &'a Arms,
    opposite: &'a [Part],
    creases: &'a [Crease],
    pressing: &'a [Part],
    /// Clearance of cloth between parts that press on each other, metres.
    room: f32,
}

impl<'a> Skin<'a> {
    /// For the body of a model, not posed yet.
    pub(super) fn of(model: &'a Model) -> Self {
        Self {
            model: model.surface(),
            frame: SurfaceFrame::default(),
            buried: Buried::default(),
            apart: Apart::default(),
            near: NearSkin::default(),
            arms: model.arms(),
            opposite: model.opposite(),
            creases: model.creases(),
            pressing: model.pressing(),
            room: model.room(),
        }
    }
    /// Moves the body to posed vertices (world, metres).
    pub(super) fn show(&mut self, body: &[P3]) {
        self.frame.vertices.clear();
        self.frame.vertices.extend_from_slice(body);
        self.apart.make_room(
            Par::Rayon,
            self.model,
            self.pressing,
            &mut self.frame,
            self.room,
        );
        self.creases
            .iter()
            .for_each(|c| c.make_room(&mut self.frame.vertices, self.room));
        self.model.update_normals(Par::Rayon, &mut self.frame);
        self.buried
            .update(Par::Rayon, self.model, self.opposite, &self.frame);
        self.near.fill(&self.frame);
    }
    pub(super) fn frame(&self) -> &SurfaceFrame {
        &self.frame
    }
    /// Centre lines of the arms.
    pub(super) fn arm_lines(&self) -> [Line; 2] {
        self.arms.lines(&self.frame.vertices)
    }
    /// Skin inside other skin that it faces: cloth cannot lie there.
    pub(super) fn holds_nothing(&self, c: &Closest) -> bool {
        self.buried
            .holds_nothing(self.model.faces()[c.face as usize])
    }
    /// Nearest point of some parts to `p`: by a walk from vertex `start`, or from the grid where that is nearer.
    pub(super) fn closest(&self, p: &P3, start: u32, mask: Part) -> Closest {
        let walked = self.model.closest(&self.frame, p, start, mask);
        let [near, _] = self.near.around(self.model, &self.frame, p, [mask, 0]);
        near.or_nearer(self.model, &self.frame, p, Some(walked), mask)
            .unwrap_or(walked)
    }
    /// The nearer of walked and grid points, for each of two sets of parts.
    pub(super) fn nearer(&self, p: &P3, walked: [Closest; 2], masks: [Part; 2]) -> [Closest; 2] {
        let near = self.near.around(self.model, &self.frame, p, masks);
        std::array::from_fn(|k| {
            let found = near[k].or_nearer(self.model, &self.frame, p, Some(walked[k]), masks[k]);
            found.unwrap_or(walked[k])
        })
    }
    /// Separated vertices and the caches of the collision body.
    pub(super) fn known(self) -> (Vec<P3>, Buried, Apart) {
        (self.frame.vertices, self.buried, self.apart)
    }
}
