//! Height field of inner garments over the skin, which outer garments keep off.
//!
//! Outer layers press inner ones inwards and are not pushed back (`cloth_contact.rs`). Folds of an inner layer, pressed from
//! both sides, would be squeezed out upwards; so outer layers keep off the skin by the height of those below.

use crate::contact::SurfaceFrame;
use crate::live::outfit_model::Model;
use crate::live::state::{GarmentState, State};
use crate::settings::ClothContactSettings;

/// For each garment the height of those below it over each body vertex, metres.
#[derive(Debug, Default)]
pub(in crate::live) struct LayerHeights {
    heights: Vec<Vec<f32>>,
    settings: ClothContactSettings,
}

impl LayerHeights {
    /// Measures the garments over the skin.
    pub(in crate::live) fn measure(&mut self, model: &Model, state: &State, skin: &SurfaceFrame) {
        self.settings = model.config.contact;
        self.heights.resize_with(state.garments.len(), Vec::new);
        self.heights.iter_mut().for_each(Vec::clear);
        if !model.config.layers {
            return;
        }
        for g in 1..state.garments.len() {
            let (inner, outer) = self.heights.split_at_mut(g);
            outer[0].extend_from_slice(&inner[g - 1]);
            outer[0].resize(skin.vertices.len(), 0.0);
            let worn = &state.garments[g - 1];
            raise(skin, worn, self.settings.hanging, &mut outer[0]);
        }
    }
    /// Largest distance that a garment with this offset keeps from the skin anywhere, metres.
    pub(super) fn max_offset(&self, garment: usize, offset: f32) -> f32 {
        let is_outer = self.heights.get(garment).is_some_and(|h| !h.is_empty());
        if is_outer {
            offset.max(self.settings.max_height)
        } else {
            offset
        }
    }
    /// Distance that a garment with this offset keeps from a triangle of the skin, metres.
    pub(super) fn offset_over(&self, garment: usize, corners: [u32; 3], offset: f32) -> f32 {
        let Some(heights) = self.heights.get(garment) else {
            return offset;
        };
        let height = |v: &u32| heights.get(*v as usize).copied().unwrap_or(0.0);
        let highest = corners.iter().map(height).fold(0.0, f32::max);
        if highest > 0.0 {
            offset.max((highest + self.settings.layer_margin).min(self.settings.max_height))
        } else {
            offset
        }
    }
}

/// Raises the heights over body vertices to the cloth below `hanging` metres whose first nearest vertex they are.
fn raise(skin: &SurfaceFrame, cloth: &GarmentState, hanging: f32, heights: &mut [f32]) {
    for (x, near) in cloth.positions.iter().zip(&cloth.nearest) {
        let v = near[0] as usize;
        let (Some(p), Some(n), Some(height)) = (
            skin.vertices.get(v),
            skin.normals.get(v),
            heights.get_mut(v),
        ) else {
            continue;
        };
        let h = n.dot(&(x - p));
        if h < hanging {
            *height = height.max(h);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::{P3, V3};

    #[test]
    fn outer_layer_clears_folds_below_it_and_not_a_hanging_bell() {
        let skin = SurfaceFrame {
            vertices: [0.0, 1.0, 2.0, 3.0].map(|x| P3::new(x, 0.0, 0.0)).into(),
            normals: vec![V3::z(); 4],
        };
        let at = |x: f32, h: f32| P3::new(x, 0.001, h);
        // Flat cloth, a fold of three layers, a bell, and cloth below the skin.
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
        let worn = |positions: &[P3], nearest: &[[u32; 2]]| GarmentState {
            positions: positions.to_vec(),
            nearest: nearest.to_vec(),
            ..GarmentState::default()
        };
        let settings = ClothContactSettings::default();
        raise(
            &skin,
            &worn(&cloth, &nearest),
            settings.hanging,
            &mut heights,
        );
        assert_eq!(heights, [0.0025, 0.007, 0.0, 0.0]);
        let (nan, unknown) = (at(0.0, f32::NAN), [u32::MAX; 2]);
        let broken = worn(&[nan, at(0.0, 0.001)], &[[0, 0], unknown]);
        raise(&skin, &broken, settings.hanging, &mut heights);
        assert_eq!(heights, [0.0025, 0.007, 0.0, 0.0]);

        let layers = LayerHeights {
            heights: vec![Vec::new(), heights, vec![0.015; 4]],
            settings,
        };
        assert_eq!(
            layers.offset_over(0, [0, 1, 2], 0.0025),
            0.0025,
            "innermost"
        );
        assert_eq!(
            layers.offset_over(1, [0, 2, 3], 0.005),
            0.005,
            "over flat cloth"
        );
        assert_eq!(
            layers.offset_over(1, [2, 3, 3], 0.002),
            0.002,
            "over nothing"
        );
        assert_eq!(
            layers.offset_over(1, [0, 1, 2], 0.005),
            0.007 + settings.layer_margin
        );
        assert_eq!(
            layers.offset_over(2, [0, 1, 2], 0.0075),
            settings.max_height
        );
        assert_eq!(layers.offset_over(9, [7, 8, 9], 0.005), 0.005);
    }
}
