//! Looks of the garments that are worn, prepared once and kept from picture to picture.

use crate::engine::Job;
use std::sync::Arc;
use tryon::dressing::FIT_COLORS;
use tryon::garment::RenderMesh;
use tryon::mirror::DrawnLook;
use tryon::view::{Appearance, ImagePyramid, Print};
use tryon_proto::convert::garment::WornGarment;

/// Looks by garment.
#[derive(Default)]
pub(crate) struct Looks(Vec<(Arc<WornGarment>, Arc<DrawnLook>)>);

impl Looks {
    /// Drops the looks of garments that `job` lacks.
    pub(crate) fn keep(&mut self, job: &Job) {
        let worn = job.placed.iter().flat_map(|p| &p.garments);
        let worn: Vec<_> = worn.map(|(garment, _)| garment).collect();
        self.0
            .retain(|(own, _)| worn.iter().any(|w| is_same(own, w)));
    }

    pub(crate) fn of(&mut self, garment: &Arc<WornGarment>) -> Arc<DrawnLook> {
        let known = self.0.iter().find(|(own, _)| is_same(own, garment));
        if let Some((_, look)) = known {
            return Arc::clone(look);
        }
        let look = Arc::new(drawn_look(garment));
        self.0.push((Arc::clone(garment), Arc::clone(&look)));
        look
    }
}

/// The same garment: by address, or where a stream has begun anew, by content.
fn is_same(a: &Arc<WornGarment>, b: &Arc<WornGarment>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}

/// Appearance of a garment whose texture coordinates are its tightness.
pub(crate) fn fit_appearance() -> Appearance {
    let [low, base, high] = FIT_COLORS;
    Appearance {
        base,
        pattern: Print::Scale { low, high },
        ..Appearance::default()
    }
}

fn rgb(c: u32) -> [u8; 3] {
    let [_, r, g, b] = c.to_be_bytes();
    [r, g, b]
}

fn drawn_look(garment: &WornGarment) -> DrawnLook {
    let look = &garment.look;
    let is_striped = look.stripe_width > 0.0 && look.accent_rgb != look.color_rgb;
    let pattern = match &garment.image {
        Some(image) => Print::Image(Arc::new(ImagePyramid::new(image.image()))),
        None if is_striped => Print::Stripes {
            color: rgb(look.accent_rgb),
            period: 2.0 * look.stripe_width,
        },
        None => Print::Solid,
    };
    let appearance = Appearance {
        base: rgb(look.color_rgb),
        pattern,
        ..Appearance::default()
    };
    let mesh = RenderMesh {
        vertex: garment.drawn.clone(),
        uv: garment.uvs.clone(),
        faces: garment.faces.clone(),
    };
    DrawnLook::of(&mesh, &look.fabric, appearance)
}
