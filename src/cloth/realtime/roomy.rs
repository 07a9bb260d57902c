//! The body as cloth meets it, for who draws a dressed body.

use super::Config;
use super::model::creases;
use crate::body::Template;
use crate::body::parts::{opposing_masks, pressing_masks, vertex_masks};
use crate::cloth::ClothError;
use crate::contact::{Apart, Crease, Part, SurfaceFrame, SurfaceModel};
use crate::math::P3;
use crate::mesh::Topology;
use crate::par::Par;

/// A body with room for two layers of cloth between parts that press on each other, as a [`super::Model`] makes it.
///
/// Cloth between an upper arm and the chest lies on skin that was moved back, inside the skin as it is measured. Drawn with
/// the measured body, that skin shows through the cloth.
#[derive(Debug)]
pub struct RoomyBody {
    surface: SurfaceModel,
    pressing: Vec<Part>,
    creases: Vec<Crease>,
    /// What cloth is given, metres.
    room: f32,
    apart: Apart,
    measured: Vec<P3>,
    frame: SurfaceFrame,
}

impl RoomyBody {
    /// For bodies made from `template`, with cloth simulated as `config` says.
    ///
    /// # Errors
    /// Faults of the template's mesh.
    pub fn new(template: &Template, config: &Config) -> Result<Self, ClothError> {
        let parts = vertex_masks(template);
        let pressing = pressing_masks(template, opposing_masks(template, &parts));
        let surface = SurfaceModel::new(
            template.mesh().faces().to_vec(),
            Topology::new(template.mesh())?,
            parts,
        );
        Ok(Self {
            pressing,
            creases: creases(template, &surface),
            surface,
            room: config.room(),
            apart: Apart::default(),
            measured: Vec::new(),
            frame: SurfaceFrame::default(),
        })
    }
    /// This posed body (any frame, metres) with room in it. Looks only where parts may have come nearer since the last call,
    /// and nowhere if nothing moved. A body of another size or with a vertex that is not finite is handed back as it is.
    pub fn make_room(&mut self, par: Par, body: &[P3]) -> &[P3] {
        if self.measured != body {
            self.measured.clear();
            self.measured.extend_from_slice(body);
            self.frame.vertices.clone_from(&self.measured);
            let fits = body.len() == self.surface.vertices();
            if fits && body.iter().all(|p| p.iter().all(|c| c.is_finite())) {
                self.apart.make_room(
                    par,
                    &self.surface,
                    &self.pressing,
                    &mut self.frame,
                    self.room,
                );
                self.creases
                    .iter()
                    .for_each(|c| c.make_room(&mut self.frame.vertices, self.room));
            } else {
                self.apart = Apart::default();
            }
        }
        &self.frame.vertices
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{BodyShape, embedded};

    #[test]
    fn arms_that_hang_in_the_trunk_are_moved_out_of_it_in_any_frame_and_nothing_else_is() {
        let template = embedded::template();
        let heavy = BodyShape {
            coefficients: vec![0.3, 2.0, 1.2],
            ..BodyShape::default()
        };
        let rest = template.personalise(&heavy).vertices;
        // The upper half made narrower: arms come to lie in the trunk.
        let body: Vec<P3> = rest
            .iter()
            .map(|p| P3::new(p.x * if p.x.abs() > 0.14 { 0.8 } else { 1.0 }, p.y, p.z))
            .collect();
        let mut roomy = RoomyBody::new(&template, &Config::default()).expect("a body");
        let moved = |a: &[P3], b: &[P3]| {
            a.iter()
                .zip(b)
                .filter(|(a, b)| (*a - *b).norm() > 1e-6)
                .count()
        };
        let once = roomy.make_room(Par::Seq, &body).to_vec();
        let count = moved(&once, &body);
        assert!(
            count > 20 && count < body.len() / 4,
            "{count} of {}",
            body.len()
        );
        assert!(once.iter().zip(&body).all(|(a, b)| (a - b).norm() < 0.041));
        assert_eq!(roomy.make_room(Par::Seq, &body), once);
        // Half a turn about the vertical: the same, turned.
        let turned: Vec<P3> = body.iter().map(|p| P3::new(-p.x, p.y, -p.z)).collect();
        let mut anew = RoomyBody::new(&template, &Config::default()).expect("a body");
        let back: Vec<P3> = anew
            .make_room(Par::Rayon, &turned)
            .iter()
            .map(|p| P3::new(-p.x, p.y, -p.z))
            .collect();
        assert!(once.iter().zip(&back).all(|(a, b)| (a - b).norm() < 1e-5));
        // Bodies that are none.
        let mut broken = body.clone();
        broken[7].y = f32::NAN;
        assert!(roomy.make_room(Par::Seq, &broken)[7].y.is_nan());
        assert_eq!(roomy.make_room(Par::Seq, &body[..9]), &body[..9]);
        assert_eq!(moved(roomy.make_room(Par::Seq, &body), &once), 0);
    }
}
