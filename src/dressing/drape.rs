//! The drape of an outfit: it hangs in the canonical pose, follows the body into the tracked pose, and comes to rest there.
//!
//! The simulator of worn cloth does all of it: contact by near pairs keeps placed cloth, which is free of itself, free.

use super::canonical::{canonical_pose, upright_root};
use super::crossing_finder::CrossingFinder;
use super::settings::{CanonicalSettings, OutfitDrapeSettings};
use super::waistband::GarmentOnSkin;
use tryon_body::{BoneTransforms, Pose, RestBody, Template};
use tryon_cloth::contact::{CollisionBody, CollisionWorkspace};
use tryon_cloth::{
    AnchorBinding, ClothError, Config, Input, Model, State, StepReport, Workspace, step,
};
use tryon_geometry::math::{P3, V3, World};

/// Body on which garments are draped.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wearer<'a> {
    pub(super) template: &'a Template,
    pub(super) rest: &'a RestBody,
    /// Tracked pose, world.
    pub(super) pose: &'a Pose<World>,
}

impl Wearer<'_> {
    /// The canonical pose where the wearer is.
    pub(super) fn canonical(&self, settings: &CanonicalSettings) -> Pose<World> {
        Pose {
            root: upright_root(self.rest, &self.pose.root),
            angles: canonical_pose(self.template, self.rest, settings).angles,
        }
    }
    /// Posed vertices of `count + 1` bodies from a pose to the tracked one, slow at both ends.
    pub(super) fn bodies_from(&self, start: &Pose<World>, count: usize) -> Vec<Vec<P3>> {
        let (template, rest) = (self.template, self.rest);
        let body = |i: usize| {
            let t = i as f64 / count as f64;
            let share = t * t * (3.0 - 2.0 * t);
            let pose = start.towards(self.pose, template.skeleton(), rest, share);
            let (mut bones, mut out) = (BoneTransforms::default(), Vec::new());
            template.skin_pose(rest, &pose, &mut bones, &mut out);
            out
        };
        (0..=count).map(body).collect()
    }
}

/// An outfit being draped.
pub(super) struct OutfitDrape {
    pub(super) model: Model,
    pub(super) state: State,
    /// Steps so far.
    pub(super) steps: usize,
    /// Report of the last step.
    pub(super) last: StepReport,
    settings: OutfitDrapeSettings,
    /// Settings with which the outfit is worn afterwards.
    worn: Config,
    work: Workspace,
    /// Kinetic energy after the last step of relaxation.
    energy: f32,
}

impl OutfitDrape {
    /// Garments at their start `positions` (world, metres) around a body, firm anchors tied to it.
    pub(super) fn new(
        mut model: Model,
        positions: Vec<Vec<P3>>,
        body: &[P3],
        settings: OutfitDrapeSettings,
    ) -> Result<Self, ClothError> {
        let body = collision_body(&model, body)?;
        let fasten = |(k, x): (usize, &Vec<P3>)| {
            let mut anchors = on_skin(&model, &body, k).fasten(x)?;
            anchors.retain(|a| a.strength >= 1.0);
            Ok(anchors)
        };
        let anchors = positions.iter().enumerate().map(fasten);
        let anchors = anchors.collect::<Result<Vec<_>, ClothError>>()?;
        model.set_anchors(anchors);
        Ok(Self {
            state: State::on_body(&model, positions, body)?,
            steps: 0,
            last: StepReport::default(),
            settings,
            worn: *model.config(),
            work: Workspace::default(),
            energy: 0.0,
            model,
        })
    }

    /// Drapes on the first body, and follows the others.
    pub(super) fn hang_and_follow(&mut self, bodies: &[Vec<P3>]) -> Result<(), ClothError> {
        let settings = self.settings;
        let Some((first, next)) = bodies.split_first() else {
            return Ok(());
        };
        self.limit(settings.hanging_speed, settings.hanging_friction);
        for _ in 0..settings.hanging {
            self.step(first)?;
            self.stop();
        }

        let friction = self.worn.contact.skin_friction;
        self.limit(settings.following_speed, friction);
        next.iter().try_for_each(|body| self.step(body))
    }

    /// Ties all anchors where they are on a body, and rests there.
    pub(super) fn tie(&mut self, body: &[P3]) -> Result<(), ClothError> {
        let body = collision_body(&self.model, body)?;
        let garments = std::mem::take(&mut self.state.garments);
        let positions: Vec<Vec<P3>> = garments.into_iter().map(|g| g.positions).collect();
        let tie = |(k, x): (usize, &Vec<P3>)| on_skin(&self.model, &body, k).bind_in_place(x);
        let anchors: Vec<Vec<AnchorBinding>> = positions.iter().enumerate().map(tie).collect();
        self.model.set_anchors(anchors);
        self.state = State::on_body(&self.model, positions, body)?;
        Ok(())
    }

    /// Lets cloth come to rest on the body, until none passes through cloth. Leaves the state with the fewest crossings;
    /// returns their number.
    pub(super) fn settle(&mut self) -> Result<usize, ClothError> {
        let friction = self.worn.contact.skin_friction;
        self.limit(self.settings.settling_speed, friction);
        let body = self.state.collision_body().vertices().to_vec();
        let [least, most] = self.settings.settling;
        let mut finder = CrossingFinder::new(&self.model, &self.state);
        let mut best = (finder.count(&self.state), self.state.clone());
        for k in 0..most {
            self.relax(&body)?;
            if k < least {
                continue;
            }
            let crossings = finder.count(&self.state);
            if k == least || crossings < best.0 {
                best = (crossings, self.state.clone());
            }
            if crossings == 0 {
                break;
            }
        }
        self.state = best.1;
        self.model.replace_config(self.worn);
        Ok(best.0)
    }

    /// Limits the speed of cloth, m/s, and sets its friction on skin over the fabric's.
    fn limit(&mut self, max_speed: f32, skin_friction: f32) {
        let mut config = Config {
            max_speed,
            untangle: self.settings.step,
            sleep: false,
            ..self.worn
        };
        config.contact.skin_friction = skin_friction;
        self.model.replace_config(config);
    }

    /// A step of dynamic relaxation with kinetic damping (Barnes 1999): cloth stops where its kinetic energy falls, as it
    /// then passes the place where it would rest.
    fn relax(&mut self, body: &[P3]) -> Result<(), ClothError> {
        self.step(body)?;
        let energy = self.kinetic_energy();
        if energy < self.energy {
            self.stop();
        }
        self.energy = self.kinetic_energy();
        Ok(())
    }

    /// Sum of squared speeds, m²/s².
    fn kinetic_energy(&self) -> f32 {
        let garments = self.state.garments.iter();
        garments
            .flat_map(|g| &g.velocities)
            .map(V3::norm_squared)
            .sum()
    }

    fn stop(&mut self) {
        let garments = self.state.garments.iter_mut();
        garments.for_each(|g| g.velocities.fill(V3::zeros()));
    }

    fn step(&mut self, body: &[P3]) -> Result<(), ClothError> {
        let dt = self.settings.step;
        let input = Input { body, dt };
        self.last = step(&self.model, &mut self.state, &input, &mut self.work)?;
        self.steps += 1;
        Ok(())
    }
}

/// A posed body as cloth of a model meets it.
fn collision_body(model: &Model, posed: &[P3]) -> Result<CollisionBody, ClothError> {
    let mut body = CollisionBody::default();
    body.place(model.collision(), posed, &mut CollisionWorkspace::default())?;
    Ok(body)
}

fn on_skin<'a>(model: &'a Model, body: &'a CollisionBody, garment: usize) -> GarmentOnSkin<'a> {
    GarmentOnSkin {
        mesh: &model.outfit.garments[garment],
        surface: model.collision().surface(),
        frame: body.frame(),
        offset: model.offset(garment),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::{BodyShape, embedded};
    use tryon_geometry::math::Rigid;

    #[test]
    fn bodies_between_two_poses_start_and_end_at_them() {
        let t = embedded::template();
        let rest = t.personalise(&BodyShape::default());
        let pose = |angles| Pose {
            root: Rigid::identity(),
            angles,
        };
        let a = pose(canonical_pose(&t, &rest, &CanonicalSettings::default()).angles);
        let b = pose(vec![0.0; a.angles.len()]);
        let to = |pose| Wearer {
            template: &t,
            rest: &rest,
            pose,
        };
        let bodies = to(&b).bodies_from(&a, 3);
        assert_eq!(bodies.len(), 4);
        let far = |x: &[P3], y: &[P3]| {
            let pairs = x.iter().zip(y);
            pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f32::max)
        };
        for (body, at) in [(&bodies[0], &a), (&bodies[3], &b)] {
            let alone = to(at).bodies_from(at, 1);
            assert!(far(body, &alone[0]) < 1e-5);
        }
        assert!(far(&bodies[1], &bodies[2]) < far(&bodies[0], &bodies[3]));
    }
}
