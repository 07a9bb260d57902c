//! Bodies of the turntable: named shapes, files, and people tracked in recordings.

use crate::args::{TurntableArgs, TurntablePose};
use anyhow::{Context, Result};
use std::path::Path;
use std::sync::Arc;
use tryon::body::import::template_from_smpl;
use tryon::body::{BodyShape, BoneTransforms, Pose, RestBody, Template, embedded, skin};
use tryon::formats::npz::read_smpl;
use tryon::geometry::math::{Body, P3, Rigid, World};
use tryon::geometry::par::Par;
use tryon_bench::BodyFilm;

/// Named shapes: stature, girth, sex, limb length, torso length, shoulders, chest, waist, hip in standard deviations.
#[rustfmt::skip]
const SHAPES: [(&str, &[f64]); 5] = [
    ("average", &[]),
    ("slim_woman", &[-0.4, -1.0, -1.2, 0.2, 0.0, -0.2, 0.0, -0.3, 0.1]),
    ("curvy_woman", &[-0.6, 1.0, -1.3, -0.2, 0.0, 0.0, 0.8, 0.2, 1.0]),
    ("heavy_man", &[0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0]),
    ("tall_man", &[1.8, -0.4, 1.0, 0.5, 0.0, 0.3, 0.0, 0.0, 0.0]),
];

/// A body and its motion.
pub(super) struct Person {
    pub(super) template: Arc<Template>,
    pub(super) rest: RestBody,
    /// Of a recording.
    pub(super) film: Option<BodyFilm>,
}

/// Loads a named shape, a body file or a recording.
pub(super) fn load(name: &str) -> Result<Person> {
    let path = Path::new(name);
    if path.is_dir() || name.ends_with(".mcap") {
        let film = BodyFilm::tracked(path)?;
        return Ok(Person {
            template: film.template.clone(),
            rest: film.rest.clone(),
            film: Some(film),
        });
    }
    let mut shape = BodyShape::default();
    let template = match SHAPES.iter().find(|s| s.0 == name) {
        Some((_, coefficients)) => {
            shape.coefficients = coefficients.to_vec();
            embedded::template()
        }
        None => {
            let body = read_smpl(path)?;
            Arc::new(template_from_smpl("file", &body).with_context(|| name.to_owned())?)
        }
    };
    Ok(Person {
        rest: template.personalise(&shape),
        template,
        film: None,
    })
}

impl Person {
    /// The pose in which garments are put on.
    pub(super) fn start(&self, args: &TurntableArgs) -> Pose<World> {
        match &self.film {
            Some(film) => film.start.clone(),
            None => self.pose(args.pose, 0.0),
        }
    }

    /// A pose `t` seconds after the start of its motion.
    pub(super) fn pose(&self, name: TurntablePose, t: f64) -> Pose<World> {
        let skeleton = self.template.skeleton();
        let mut pose = Pose::rest(skeleton, Rigid::<World, Body>::identity());
        if name != TurntablePose::Rest {
            pose.lower_arms(skeleton, &self.rest, 1.3);
        }
        if name == TurntablePose::Walk {
            let swing = 0.5 * (t * 6.0).sin();
            for (side, a) in [("left", swing), ("right", -swing)] {
                let knee = 0.3 - 0.3 * a.signum() * a.abs();
                pose.set(skeleton, &format!("{side}_hip"), &[-a - 0.1, 0.0, 0.0]);
                pose.set(skeleton, &format!("{side}_knee"), &[knee, 0.0, 0.0]);
            }
        }
        pose
    }

    /// Skins the body in a pose; world, metres.
    pub(super) fn posed(&self, pose: &Pose<World>) -> Vec<P3> {
        let mut bones = BoneTransforms::default();
        pose.bones(self.template.skeleton(), &self.rest, &mut bones);
        let (mut out, weights) = (Vec::new(), self.template.weights());
        skin(Par::Seq, &self.rest.vertices, weights, &bones, &mut out);
        out
    }
}
