//! How high inner garments lie on the skin, for those worn over them.
//!
//! Outer layers press inner ones inwards and are not pushed back (`cloth_touch.rs`). Where an inner one lies in folds
//! there is no room for it between skin and shirt; pressed from both sides it was squeezed out upwards
//! (docs/decisions/011-layers.md). So the outer ones keep off the skin by what lies on it.

use super::model::Model;
use super::state::State;
use crate::contact::SurfaceFrame;
use crate::math::P3;

/// Cloth further from the skin hangs there by itself, metres: the bell of a skirt carries no shirt.
const HANGING: f32 = 0.02;
/// Distance to what lies on the skin, metres: more than the 2 mm between layers, so that it may rise by that until the next
/// call.
const ABOVE: f32 = 0.0025;
/// An outer garment goes no further from the skin for it, metres: with 20 mm skirts rode up no less (docs/benchmarks.md).
const MOST: f32 = 0.012;

/// For each garment the height of those inside of it over each vertex of the body, metres.
#[derive(Debug, Default)]
pub(super) struct Piled(Vec<Vec<f32>>);

impl Piled {
    /// Measures the garments where they are on the skin.
    pub(super) fn measure(&mut self, model: &Model, state: &State, skin: &SurfaceFrame) {
        self.0.resize_with(state.garments.len(), Vec::new);
        self.0.iter_mut().for_each(Vec::clear);
        if !model.config.layers {
            return;
        }
        for g in 1..state.garments.len() {
            let (inner, outer) = self.0.split_at_mut(g);
            outer[0].extend_from_slice(&inner[g - 1]);
            outer[0].resize(skin.vertices.len(), 0.0);
            let worn = &state.garments[g - 1];
            add(skin, &worn.positions, &worn.nearest, &mut outer[0]);
        }
    }
    /// The furthest that a garment keeps off the skin anywhere, metres.
    pub(super) fn most(&self, garment: usize, offset: f32) -> f32 {
        if self
            .0
            .get(garment)
            .is_some_and(|heights| !heights.is_empty())
        {
            offset.max(MOST)
        } else {
            offset
        }
    }
    /// How far a garment keeps off a triangle of the skin on which it alone would lie at `offset`, metres.
    pub(super) fn over(&self, garment: usize, corners: [u32; 3], offset: f32) -> f32 {
        let Some(heights) = self.0.get(garment) else {
            return offset;
        };
        let height = |v: &u32| heights.get(*v as usize).copied().unwrap_or(0.0);
        let highest = corners.iter().map(height).fold(0.0, f32::max);
        if highest > 0.0 {
            offset.max((highest + ABOVE).min(MOST))
        } else {
            offset
        }
    }
}

/// Raises the heights over body vertices to those of cloth that they are `nearest` to, first ones.
fn add(skin: &SurfaceFrame, cloth: &[P3], nearest: &[[u32; 2]], heights: &mut [f32]) {
    for (x, near) in cloth.iter().zip(nearest) {
        let v = near[0] as usize;
        let (Some(p), Some(n), Some(height)) = (
            skin.vertices.get(v),
            skin.normals.get(v),
            heights.get_mut(v),
        ) else {
            continue;
        };
        let h = n.dot(&(x - p));
        if h < HANGING {
            *height = height.max(h);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::V3;

    #[test]
    fn a_shirt_goes_over_the_folds_of_a_skirt_and_not_over_its_bell() {
        let skin = SurfaceFrame {
            vertices: [0.0, 1.0, 2.0, 3.0].map(|x| P3::new(x, 0.0, 0.0)).into(),
            normals: vec![V3::z(); 4],
        };
        let at = |x: f32, h: f32| P3::new(x, 0.001, h);
        // A flat place, a fold in three layers, a bell, and what is under the skin or nowhere.
        let cloth = [
            at(0.0, 0.0025),
            at(1.0, 0.003),
            at(1.0, 0.007),
            at(1.0, 0.005),
            at(2.0, 0.05),
            at(3.0, -0.001),
        ];
        let nearest = [0, 1, 1, 1, 2, 3].map(|v| [v, 0]);
        let mut heights = vec![0.0; 4];
        add(&skin, &cloth, &nearest, &mut heights);
        assert_eq!(heights, [0.0025, 0.007, 0.0, 0.0]);
        add(
            &skin,
            &[at(0.0, f32::NAN), at(0.0, 0.001)],
            &[[0, 0], [u32::MAX; 2]],
            &mut heights,
        );
        assert_eq!(heights, [0.0025, 0.007, 0.0, 0.0]);

        let piled = Piled(vec![Vec::new(), heights, vec![0.015; 4]]);
        assert_eq!(
            piled.over(0, [0, 1, 2], 0.0025),
            0.0025,
            "nothing is inside of the innermost"
        );
        assert_eq!(
            piled.over(1, [0, 2, 3], 0.005),
            0.005,
            "it has room over flat cloth"
        );
        assert_eq!(piled.over(1, [2, 3, 3], 0.002), 0.002, "nothing lies there");
        assert_eq!(piled.over(1, [0, 1, 2], 0.005), 0.007 + ABOVE);
        assert_eq!(piled.over(2, [0, 1, 2], 0.0075), MOST);
        assert_eq!(piled.over(9, [7, 8, 9], 0.005), 0.005);
    }
}
