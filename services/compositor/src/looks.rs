//! Looks of the garments that are worn, prepared once and kept from picture to picture.

use crate::engine::Job;
use std::sync::Arc;
use tryon::dressing::FIT_COLORS;
use tryon::garment::RenderMesh;
use tryon::mirror::DrawnLook;
use tryon::view::{Appearance, ImagePyramid, Print};
use tryon_proto::convert::garment::WornGarment;
use tryon_proto::v1::{GarmentPrint, GarmentPrintKind};

/// Looks by garment.
#[derive(Default)]
pub(crate) struct Looks(Vec<(Arc<WornGarment>, Arc<DrawnLook>)>);

impl Looks {
    /// Drops the looks of garments that `job` lacks.
    pub(crate) fn keep(&mut self, job: &Job) {
        let worn = job.placed.iter().flat_map(|p| &p.garments);
        let worn: Vec<_> = worn.map(|(garment, _)| garment).collect();
        self.keep_garments(&worn);
    }

    fn keep_garments(&mut self, worn: &[&Arc<WornGarment>]) {
        (self.0).retain(|(own, _)| worn.iter().any(|w| is_same(own, w)));
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

fn print_of(print: &GarmentPrint) -> Print {
    let (color, period) = (rgb(print.color_rgb), print.period);
    match print.kind() {
        GarmentPrintKind::Stripes => Print::Stripes { color, period },
        GarmentPrintKind::Check => Print::Check { color, period },
        GarmentPrintKind::Unspecified => Print::Solid,
    }
}

fn drawn_look(garment: &WornGarment) -> DrawnLook {
    let look = &garment.look;
    let pattern = match (&garment.image, look.print.as_ref()) {
        (Some(image), _) => Print::Image(Arc::new(ImagePyramid::new(image.image()))),
        (None, Some(print)) => print_of(print),
        (None, None) => Print::Solid,
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
        trims: garment.trims.clone(),
    };
    DrawnLook::of(&mesh, &look.fabric, appearance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_proto::v1::GarmentLook;

    /// Two triangles of one panel.
    fn garment(fabric: &str) -> Arc<WornGarment> {
        Arc::new(WornGarment {
            garment: "square".into(),
            size: String::new(),
            vertices: 4,
            drawn: vec![0, 1, 2, 3],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            uvs: vec![[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2]],
            look: GarmentLook {
                color_rgb: 0x0020_4060,
                fabric: fabric.into(),
                ..GarmentLook::default()
            },
            image: None,
            trims: vec![],
        })
    }

    #[test]
    fn a_garment_is_drawn_in_the_fabric_that_the_stream_names() {
        let mut looks = Looks::default();
        let [denim, silk, unknown] = ["denim", "silk", "mithril"].map(|f| looks.of(&garment(f)));
        assert_ne!(denim.appearance.cloth, silk.appearance.cloth);
        let jersey = tryon::view::ShadedCloth::named("jersey");
        assert_eq!(unknown.appearance.cloth, Some(jersey));
        assert_eq!(
            (denim.appearance.base, denim.places.len()),
            ([0x20, 0x40, 0x60], 4)
        );
        assert!(
            denim.places.iter().all(|p| p.free == 0.0),
            "no edge is sewn"
        );
    }

    #[test]
    fn a_print_of_the_stream_is_drawn() {
        let mut plain = (*garment("cotton")).clone();
        plain.look.print = Some(GarmentPrint {
            kind: GarmentPrintKind::Check.into(),
            color_rgb: 0x00ff_0000,
            period: 0.05,
        });
        let look = Looks::default().of(&Arc::new(plain));
        let expected = Print::Check {
            color: [0xff, 0, 0],
            period: 0.05,
        };
        assert_eq!(look.appearance.pattern, expected);
    }

    #[test]
    fn looks_are_prepared_once_and_dropped_with_their_garments() {
        let mut looks = Looks::default();
        let first = looks.of(&garment("denim"));
        // A stream that begins anew sends the same garment again.
        assert!(Arc::ptr_eq(&first, &looks.of(&garment("denim"))));
        looks.of(&garment("silk"));
        assert_eq!(looks.0.len(), 2);
        let worn = [garment("silk")];
        looks.keep_garments(&worn.iter().collect::<Vec<_>>());
        assert_eq!(looks.0.len(), 1);
    }
}
