//! An outfit on a body: put on in an easy pose, carried to the pose of the body, then stepped with every posed body.

use super::choice::SizedGarment;
use super::clock::NOMINAL_INTERVAL;
use super::settings::OutfitSettings;
use super::wear_watch::{SETTLING, WearWatch};
use std::sync::Arc;
use tryon_body::parts::vertex_masks;
use tryon_body::{ArmClearance, BoneTransforms, Pose, RestBody, Template};
use tryon_cloth::ClothError;
use tryon_cloth::{Config, Input, Model, State, StepReport, Workspace, step};
use tryon_dressing::{DressError, DressOptions, GarmentSource, dress_all};
use tryon_geometry::math::{Camera, P3, Rigid, World};

/// Tracked body that is dressed.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// Body model.
    pub template: &'a Template,
    /// Template with the shape of the subject.
    pub rest: &'a RestBody,
    /// Pose in the world.
    pub pose: &'a Pose<World>,
    /// Camera that tracks the subject.
    pub world_from_camera: Rigid<World, Camera>,
}

/// Most steps of a carry, half a second of cloth: a hand moves by 0.8 m.
const MOST_CARRY_STEPS: usize = 16;

/// Settings of putting on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PutOn {
    /// Puts on garments that do not fit too.
    pub any_size: bool,
    /// Sews garments from coarser cloth, which costs less to simulate. Imported meshes keep theirs.
    pub is_coarse: bool,
}

/// Garments on a body.
#[derive(Debug)]
pub struct DressedOutfit {
    /// Immutable part of the simulation.
    pub model: Arc<Model>,
    /// State after the last step.
    pub state: State,
    work: Workspace,
    wear: WearWatch,
    worn: Vec<SizedGarment>,
    /// Pose in which the garments were draped; `None` once they have been carried to that of the body.
    draped: Option<Pose<World>>,
}

/// The same outfit from here on; its first step takes longer, as scratch is left behind.
impl Clone for DressedOutfit {
    fn clone(&self) -> Self {
        Self {
            model: Arc::clone(&self.model),
            state: self.state.clone(),
            work: Workspace::default(),
            wear: self.wear.clone(),
            worn: self.worn.clone(),
            draped: self.draped.clone(),
        }
    }
}

impl DressedOutfit {
    /// Puts garments on in an easy pose: that of the subject, arms that overlap the trunk turned out, so that sleeves start
    /// with room around them. [`Self::carry_to`] is to follow. Takes about half a second.
    ///
    /// # Errors
    /// Faults of the garments or the pose; without `any_size` a garment that does not fit.
    pub fn put_on(
        subject: &Subject<'_>,
        worn: Vec<SizedGarment>,
        how: PutOn,
    ) -> Result<Self, DressError> {
        let wear: Vec<GarmentSource<'_>> = worn.iter().map(SizedGarment::wear).collect();
        let settings = OutfitSettings::default();
        let mut options = DressOptions {
            config: Config::tracked().seen_from(&subject.world_from_camera),
            any_size: how.any_size,
            ..DressOptions::default()
        };
        if how.is_coarse {
            options.triangulation.edge_length *= settings.coarser;
            options.triangulation.hood_length *= settings.coarser;
        }
        let Subject { template, rest, .. } = subject;
        let arms = ArmClearance::new(template, rest);
        let mut bones = BoneTransforms::default();
        let easy = arms.map_or_else(
            || subject.pose.clone(),
            |arms| arms.separate(template, rest, subject.pose, &mut bones),
        );
        let dressed = dress_all(template, rest, &easy, &wear, &options)?;
        let masks = vertex_masks(subject.template);
        Ok(Self {
            wear: WearWatch::new(&dressed.model, &dressed.state, masks, settings),
            model: Arc::new(dressed.model),
            state: dressed.state,
            work: Workspace::default(),
            worn,
            draped: Some(easy),
        })
    }

    /// Carries an outfit that has just been put on from its easy pose to that of the subject, who may have moved or changed
    /// shape meanwhile, in steps that cloth survives. Returns their number, 0 for an outfit that was carried before.
    ///
    /// # Errors
    /// A body of another size or with a vertex that is not finite.
    pub fn carry_to(&mut self, subject: &Subject<'_>) -> Result<usize, ClothError> {
        let Some(from) = self.draped.take() else {
            return Ok(0);
        };
        let Subject { template, rest, .. } = subject;
        let mut bones = BoneTransforms::default();
        let mut body = Vec::new();
        let mut place = |share: f64, body: &mut Vec<P3>| {
            let pose = from.towards(subject.pose, template.skeleton(), rest, share);
            template.skin_pose(rest, &pose, &mut bones, body);
        };

        place(1.0, &mut body);
        let start = self.state.collision_body().vertices().iter();
        let farthest = (start.zip(&body)).map(|(a, b)| (b - a).norm());
        let farthest = farthest.fold(0.0, f32::max);
        let steps = ((farthest / self.wear.settings.carry_stride).ceil() as usize)
            .clamp(1, MOST_CARRY_STEPS);
        for k in 1..=steps {
            place(k as f64 / steps as f64, &mut body);
            let (body, dt) = (&body[..], NOMINAL_INTERVAL);
            step(
                &self.model,
                &mut self.state,
                &Input { body, dt },
                &mut self.work,
            )?;
        }
        Ok(steps)
    }

    /// Advances the cloth by `dt` (s) to a posed body (world, metres). On a body that has jumped the outfit is put on again
    /// and settles within this step, which then takes five times as long.
    ///
    /// # Errors
    /// A body of another size or with a vertex that is not finite; a time step that is not positive.
    pub fn step(&mut self, body: &[P3], dt: f64) -> Result<StepReport, ClothError> {
        let input = Input { body, dt };
        let before = self.state.collision_body().vertices();
        let jumped = self.wear.has_jumped(before, body, dt);
        let mut report = self.advance(&input, jumped)?;
        let settling = if jumped { SETTLING } else { 0 };
        for _ in 0..settling {
            report = self.advance(&input, false)?;
        }
        Ok(report)
    }

    /// One step of the cloth on a body that may have `jumped`, and its judgement.
    fn advance(&mut self, input: &Input<'_>, jumped: bool) -> Result<StepReport, ClothError> {
        let report = step(&self.model, &mut self.state, input, &mut self.work)?;
        self.wear
            .judge(&self.model, &mut self.state, &report, jumped);
        Ok(report)
    }

    /// Positions of each garment as skin carries it to a posed body (world, metres), without a step: for outfits that there
    /// is no time to simulate. The state stays behind, and the next step puts the outfit on again if it must.
    ///
    /// # Errors
    /// A body of another size or with a vertex that is not finite.
    pub fn skinned(&self, body: &[P3]) -> Result<Vec<Vec<P3>>, ClothError> {
        self.wear.skinned(&self.model, body)
    }

    /// True once that has failed several times: it must be dressed anew, in the pose that the body has now.
    pub fn is_past_mending(&self) -> bool {
        self.wear.is_past_mending()
    }

    /// Index of the chosen garment that garment `k` of the outfit is made from. The outfit is ordered by layer, and a
    /// mesh may have become several garments.
    pub fn source(&self, k: usize) -> Option<usize> {
        let name = &self.model.outfit.garments[k].name;
        self.worn.iter().position(|w| w.name() == name)
    }

    /// Chosen garments, in the order in which they were chosen.
    pub fn worn(&self) -> &[SizedGarment] {
        &self.worn
    }

    /// True for the same garments in the same sizes.
    pub fn is_in(&self, sized: &[SizedGarment]) -> bool {
        let key = |g: &SizedGarment| (g.name().to_owned(), g.size());
        self.worn.iter().map(key).eq(sized.iter().map(key))
    }

    /// Vertices of the drawn mesh of each garment, world, metres.
    pub fn drawn_positions(&self) -> Vec<Vec<P3>> {
        (self.model.outfit.garments.iter())
            .zip(&self.state.garments)
            .map(|(mesh, state)| {
                let mut drawn = Vec::new();
                mesh.render_positions(&state.positions, &mut drawn);
                drawn
            })
            .collect()
    }
}
