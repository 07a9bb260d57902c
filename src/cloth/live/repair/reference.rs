//! An outfit as it was put on: later states are compared with it, and return to it.
//!
//! Contact and untangling mend small faults. A body that jumps, or an arm that is tracked wrongly
//! for a while, leaves cloth that no step can mend; skin, however, always tells where the cloth was put on.

use super::teleport::{Teleport, blend};
use crate::live::error::ClothError;
use crate::live::outfit_model::Model;
use crate::live::state::State;
use nalgebra::Matrix3x4;
use tryon_garment::Region;
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::math::{P3, V3};

/// Cloth around one of these parts follows it; that of the trunk hangs from it, and a skirt swings.
const LIMBS: [Region; 4] = [
    Region::LEFT_ARM,
    Region::RIGHT_ARM,
    Region::LEFT_LEG,
    Region::RIGHT_LEG,
];
/// Every so many vertices are compared: a median needs no more.
const STRIDE: usize = 4;

/// An outfit at rest on its body, as it was put on.
#[derive(Clone, Debug)]
pub struct WornReference {
    state: State,
    /// Skin weights of the vertices of each garment, shape `[garments][vertices × joints]`.
    weights: Vec<Vec<f64>>,
}

impl WornReference {
    /// The reference of an outfit that has just been put on.
    pub fn new(model: &Model, state: &State) -> Self {
        let body = state.body.vertices();
        let skin = teleport(model, body, body);
        let garments = state.garments.iter().zip(&model.garments);
        let weights = garments.map(|(g, m)| skin.cloth_weights(&m.sheet.edges, &g.nearest));
        Self {
            weights: weights.collect(),
            state: state.clone(),
        }
    }

    /// Largest median distance, among the limbs, of a limb's cloth from where skin would have carried it, metres.
    pub fn limb_offset(&self, model: &Model, state: &State) -> f32 {
        let motions = self.motions(model, state);
        let garments = state.garments.iter().zip(&model.garments).enumerate();
        let mut largest = 0.0f32;
        for (k, (g, m)) in garments {
            for limb in LIMBS {
                let on = (0..g.positions.len()).step_by(STRIDE);
                let on = on.filter(|v| m.own[*v] & !Region::TRUNK.0 == limb.0);
                let offset = |v| (self.place(model, &motions, k, v) - g.positions[v]).norm();
                let mut offsets: Vec<f32> = on.map(offset).collect();
                largest = largest.max(median(&mut offsets).unwrap_or(0.0));
            }
        }
        largest
    }

    /// Puts the garments of `state` where skin carries them from the reference to its body, at rest.
    pub fn put_on(&self, model: &Model, state: &mut State) {
        let motions = self.motions(model, state);
        for (k, g) in state.garments.iter_mut().enumerate() {
            g.clone_from(&self.state.garments[k]);
            for (v, p) in g.positions.iter_mut().enumerate() {
                *p = self.place(model, &motions, k, v);
            }
            g.velocities.fill(V3::zeros());
        }
        state.stale = 0;
        state.sleep.wake_all();
    }

    /// Positions of each garment where skin carries it from the reference to `body` (world, metres): cloth that is not
    /// simulated.
    ///
    /// # Errors
    /// A body of another size or with a vertex that is not finite.
    pub fn skinned(&self, model: &Model, body: &[P3]) -> Result<Vec<Vec<P3>>, ClothError> {
        model.collision.check(body)?;
        let motions = teleport(model, self.state.body.vertices(), body).motions();
        let garments = self.state.garments.iter().enumerate().map(|(k, g)| {
            let all = 0..g.positions.len();
            all.map(|v| self.place(model, &motions, k, v)).collect()
        });
        Ok(garments.collect())
    }

    /// Motion of each joint from the reference to the body of `state`.
    fn motions(&self, model: &Model, state: &State) -> Vec<Matrix3x4<f64>> {
        teleport(model, self.state.body.vertices(), state.body.vertices()).motions()
    }

    /// Position of vertex `v` of garment `k` as skin would carry it, metres.
    fn place(&self, model: &Model, motions: &[Matrix3x4<f64>], k: usize, v: usize) -> P3 {
        let weights = &self.weights[k][v * model.joints..][..model.joints];
        blend(motions, weights, &self.state.garments[k].positions[v])
    }
}

fn teleport<'a>(model: &'a Model, from: &'a [P3], to: &'a [P3]) -> Teleport<'a> {
    Teleport {
        joint_vertices: model.config.repair.joint_vertices,
        weights: &model.weights,
        joints: model.joints,
        from,
        to,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::test_outfit::square_in_front;
    use nalgebra::Isometry3;

    #[test]
    fn an_outfit_is_put_on_where_the_body_went_and_rests_there() {
        let (model, start, body) = square_in_front(4, 0.02);
        let reference = WornReference::new(&model, &start);
        let motion = Isometry3::new(V3::new(0.5, -1.0, 2.0), V3::new(0.3, 1.2, -0.7));
        let moved: Vec<P3> = body.iter().map(|p| motion * p).collect();
        let far = start.garments[0].positions.iter();
        let far = far.map(|p| p + V3::new(3.0, 0.0, 0.0)).collect();
        let mut state = State::new(&model, vec![far], &moved).expect("a state");
        state.garments[0].velocities.fill(V3::x());

        reference.put_on(&model, &mut state);
        let put_on = &state.garments[0];
        for (p, q) in put_on.positions.iter().zip(&start.garments[0].positions) {
            assert!((p - motion * q).norm() < 1e-4, "{p} {}", motion * q);
        }
        assert!(put_on.velocities.iter().all(|v| *v == V3::zeros()));
        let skinned = reference.skinned(&model, &moved).expect("a body");
        assert_eq!(skinned, std::slice::from_ref(&put_on.positions));
        let fault = reference.skinned(&model, &moved[1..]);
        assert!(fault.is_err(), "another body");
        assert_eq!(
            reference.limb_offset(&model, &state),
            0.0,
            "it has no limbs"
        );
    }
}
