//! Dressing: sew and place, drape, follow the body into the tracked pose, refine, tie to the body.

use super::body_sections::BodySections;
use super::canonical::{canonical_pose, upright_root};
use super::drape::{Drape, Layers};
use super::error::DressError;
use super::options::{DressOptions, DressReport};
use super::refine::prolong;
use super::sew::{GarmentSource, PlacedSheet, Sewing};
use super::skin::Skin;
use super::waistband::GarmentOnSkin;
use crate::body::measure::measure;
use crate::body::{BoneTransforms, Pose, RestBody, Template};
use crate::cloth::{AnchorBinding, ClothError, Model, Outfit, Sheet, State};
use crate::garment::{GarmentMesh, Pattern};
use crate::math::{P3, World};
use crate::spatial::intersections;
use std::time::Instant;

/// Substep on the coarse mesh, s.
const COARSE_STEP: f64 = 2e-3;
/// Substeps that close seams and gaps, and the share of gravity during them.
const CLOSING: usize = 60;
const CLOSING_GRAVITY: f64 = 0.1;
/// Substeps of the first drape, 0.5 s: cloth that started 2 cm off the body hangs.
const DRAPING: usize = 260;
/// Bodies from the canonical to the tracked pose and substeps on each; 16 are at most 8° apart for a half-turn of the arm.
const FOLLOWING: [usize; 2] = [16, 12];
/// The same with untangling: from farther bodies cloth is moved into other cloth.
const UNTANGLED_FOLLOWING: [usize; 2] = [24, 8];
/// Rounds of untangling on each of these bodies.
const CLEARING: usize = 6;
/// Most rounds of untangling in the tracked pose; most garments need none.
const CLEARED: usize = 120;
/// Substeps in the tracked pose.
const SETTLING: usize = 80;
/// Substep on the fine mesh, s.
const FINE_STEP: f64 = 1e-3;
/// Substeps on the fine mesh: they add the wrinkles that the coarse one lacks.
const FINISHING: usize = 90;
/// Attempts to settle until the fine garment is free of itself off the arms: hoods may fold in a way that nothing untangles.
const ATTEMPTS: usize = 4;

/// A dressed body, ready for [`crate::cloth::step`].
#[derive(Debug)]
pub struct Dressed {
    /// Immutable part; wrap it in an `Arc` to share it.
    pub model: Model,
    /// Garments draped on the body in the given pose.
    pub state: State,
    /// Outcome of dressing.
    pub report: DressReport,
}

/// Puts garments on a body in a pose (world frame, y up). Patterns are worn in the order of their `layer`; the outfit
/// of the result has them in that order.
///
/// # Errors
/// Faults of the patterns (panel, edge, seam named) or of the pose.
pub fn dress(
    template: &Template,
    rest: &RestBody,
    pose: &Pose<World>,
    patterns: &[Pattern],
    options: &DressOptions,
) -> Result<Dressed, DressError> {
    let garments: Vec<GarmentSource<'_>> = patterns.iter().map(GarmentSource::Pattern).collect();
    dress_all(template, rest, pose, &garments, options)
}

/// As [`dress`], for patterns and meshes together. A mesh becomes as many garments of the outfit as it has pieces of
/// cloth.
///
/// # Errors
/// As [`dress`].
pub fn dress_all(
    template: &Template,
    rest: &RestBody,
    pose: &Pose<World>,
    garments: &[GarmentSource<'_>],
    options: &DressOptions,
) -> Result<Dressed, DressError> {
    let started = Instant::now();
    if garments.is_empty() {
        return Err(DressError::NoGarments);
    }
    check_pose(template, pose)?;
    let mut report = DressReport::default();

    let timer = Instant::now();
    let measures = measure(template, rest).ok();
    let sections = BodySections::new(template, rest, measures.as_ref());
    report.stages_ms.place = ms(timer);

    let timer = Instant::now();
    let sewing = Sewing {
        template,
        sections: &sections,
        measures: measures.as_ref(),
        options,
    };
    let mut sheets = sewing.sew(garments)?;
    report.stages_ms.sew = ms(timer);

    let timer = Instant::now();
    let meshes: Vec<GarmentMesh> = sheets.iter().map(|s| s.garment.clone()).collect();
    let outfit = Outfit {
        anchors: vec![Vec::new(); meshes.len()],
        garments: meshes,
    };
    let mut model = Model::new(template, outfit, options.config.clone())?;
    report.stages_ms.model = ms(timer);

    let timer = Instant::now();
    let start = Pose {
        root: upright_root(rest, &pose.root),
        angles: canonical_pose(template, rest).angles,
    };
    for s in &mut sheets {
        let local = std::mem::take(&mut s.positions);
        start.root.points_f32(&local, &mut s.positions);
    }
    let [count, substeps] = if options.untangle {
        UNTANGLED_FOLLOWING
    } else {
        FOLLOWING
    };
    let bodies = bodies_between(template, rest, &start, pose, count);
    let mut draping = Draping::new(&model, sheets, &bodies[0], options.untangle)?;
    draping.hang();
    draping.follow(&bodies, substeps)?;
    report.stages_ms.coarse = ms(timer);
    let fine = draping.finish(&mut report)?;

    let timer = Instant::now();
    let (positions, anchors) = draping.tie(&fine, &mut report);
    let body = draping.skin.into_body();
    report.stages_ms.fine += ms(timer);

    let timer = Instant::now();
    model.set_anchors(anchors);
    let state = State::on_body(&model, positions, body)?;
    report.stages_ms.model += ms(timer);
    report.ms = ms(started);
    Ok(Dressed {
        model,
        state,
        report,
    })
}

fn check_pose(template: &Template, pose: &Pose<World>) -> Result<(), DressError> {
    let dofs = template.skeleton().dofs();
    if pose.is_finite() && pose.angles.len() == dofs {
        return Ok(());
    }
    Err(DressError::Pose(format!(
        "{} angles for {dofs} degrees of freedom, all must be finite",
        pose.angles.len()
    )))
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Posed vertices of `count + 1` bodies from one pose to another, slow at both ends.
fn bodies_between(
    template: &Template,
    rest: &RestBody,
    from: &Pose<World>,
    to: &Pose<World>,
    count: usize,
) -> Vec<Vec<P3>> {
    let body = |i: usize| {
        let t = i as f64 / count as f64;
        let share = t * t * (3.0 - 2.0 * t);
        let pose = from.towards(to, template.skeleton(), rest, share);
        let (mut bones, mut out) = (BoneTransforms::default(), Vec::new());
        template.skin_pose(rest, &pose, &mut bones, &mut out);
        out
    };
    (0..=count).map(body).collect()
}

/// Garments being draped on the body of a model.
struct Draping<'a> {
    model: &'a Model,
    skin: Skin<'a>,
    /// Distance of each garment from the skin, metres.
    offsets: Vec<f64>,
    /// Mesh of each garment that is draped first; `None` where it is the garment's own.
    coarse: Vec<Option<GarmentMesh>>,
    anchors: Vec<Vec<AnchorBinding>>,
    layers: Layers,
    untangle: bool,
}

impl<'a> Draping<'a> {
    /// Sheets around the first body, their anchors tied to it.
    fn new(
        model: &'a Model,
        sheets: Vec<PlacedSheet>,
        body: &[P3],
        untangle: bool,
    ) -> Result<Self, DressError> {
        let mut skin = Skin::of(model);
        skin.place(body).map_err(ClothError::from)?;
        let offsets: Vec<f64> = (0..sheets.len()).map(|k| model.offset(k)).collect();
        let (mut coarse, mut firsts) = (Vec::new(), Vec::new());
        let (mut anchors, mut drapes) = (Vec::new(), Vec::new());
        for (s, offset) in sheets.into_iter().zip(&offsets) {
            let first = s.coarse.clone().unwrap_or(s.garment);
            let sheet = Sheet::of_garment(&first)?;
            let mut d = Drape::new(&first, &sheet, s.positions);
            d.find_nearest(&skin);
            let on = on_skin(&skin, &first, *offset);
            anchors.push(on.fasten(&d.positions())?);
            drapes.push(if untangle {
                d.with_untangling(&first, &sheet)?
            } else {
                d
            });
            coarse.push(s.coarse);
            firsts.push(first);
        }
        Ok(Self {
            layers: Layers::new(&firsts, drapes)?,
            model,
            skin,
            offsets,
            coarse,
            anchors,
            untangle,
        })
    }
    fn garment(&self, k: usize) -> GarmentOnSkin<'_> {
        let mesh = &self.model.outfit.garments[k];
        on_skin(&self.skin, mesh, self.offsets[k])
    }
    /// Drapes in the canonical pose.
    fn hang(&mut self) {
        let (skin, anchors) = (&self.skin, &self.anchors);
        self.layers.each(skin, &self.offsets, |k, d, on| {
            d.pin(&anchors[k], skin.frame());
            d.run(on, CLOSING, COARSE_STEP, CLOSING_GRAVITY);
            d.stop();
            d.run(on, DRAPING, COARSE_STEP, 1.0);
        });
    }
    /// Follows the body through its poses.
    fn follow(&mut self, bodies: &[Vec<P3>], substeps: usize) -> Result<(), ClothError> {
        for w in bodies.windows(2) {
            self.skin.place(&w[1])?;
            let (skin, anchors) = (&self.skin, &self.anchors);
            self.layers.each(skin, &self.offsets, |k, d, on| {
                d.follow_skin(&w[0], &w[1]);
                d.recover_sleeves(skin);
                d.pin(&anchors[k], skin.frame());
                d.run(on, substeps, COARSE_STEP, 1.0);
                d.untangle_at_rest(on, CLEARING);
            });
        }
        Ok(())
    }
    /// Settles in the tracked pose and refines, again while the fine garments intersect themselves off the arms.
    fn finish(&mut self, report: &mut DressReport) -> Result<Layers, DressError> {
        let mut fine = Layers::default();
        for _ in 0..ATTEMPTS {
            let timer = Instant::now();
            let skin = &self.skin;
            self.layers.each(skin, &self.offsets, |_, d, on| {
                d.recover_sleeves(skin);
                d.run(on, SETTLING, COARSE_STEP, 1.0);
                d.untangle_at_rest(on, CLEARED);
            });
            report.stages_ms.coarse += ms(timer);
            let timer = Instant::now();
            fine = self.refine()?;
            report.stages_ms.fine += ms(timer);
            report.steps += fine.drapes.iter().map(|d| d.steps).sum::<usize>();
            if !fine.drapes.iter().any(Drape::crosses_off_arms) {
                break;
            }
        }
        report.steps += self.layers.drapes.iter().map(|d| d.steps).sum::<usize>();
        Ok(fine)
    }
    /// Positions of the draped garments and the bindings of their anchors; adds the quality of the drape to the report.
    fn tie(
        &self,
        fine: &Layers,
        report: &mut DressReport,
    ) -> (Vec<Vec<P3>>, Vec<Vec<AnchorBinding>>) {
        let tie = |(k, d): (usize, &Drape)| {
            let (x, on) = (d.positions(), self.garment(k));
            let (deepest, p99) = d.measure(&self.skin);
            report.penetration = report.penetration.max(deepest);
            report.p99_strain = report.p99_strain.max(p99);
            report.crossings += intersections(&on.mesh.faces, &x).len();
            let anchors = on.bind_in_place(&x);
            (x, anchors)
        };
        fine.drapes.iter().enumerate().map(tie).unzip()
    }
    /// Drapes the garments' own meshes from the coarse ones.
    fn refine(&self) -> Result<Layers, DressError> {
        let mut drapes = Vec::new();
        for (k, rough) in self.layers.drapes.iter().enumerate() {
            let on = self.garment(k);
            let x = self.coarse[k].as_ref().map_or_else(
                || rough.x.clone(),
                |coarse| prolong(coarse, on.mesh, &rough.x),
            );
            let sheet = Sheet::of_garment(on.mesh)?;
            let x = x.iter().map(|p| P3::from(p.cast::<f32>())).collect();
            let mut d = Drape::new(on.mesh, &sheet, x);
            d.find_nearest_from(&self.skin, rough);
            d.pin(&on.fasten(&d.positions())?, self.skin.frame());
            drapes.push(if self.untangle {
                d.with_untangling(on.mesh, &sheet)?
            } else {
                d
            });
        }
        let mut fine = Layers::new(&self.model.outfit.garments, drapes)?;
        fine.each(&self.skin, &self.offsets, |_, d, on| {
            d.recover_sleeves(&self.skin);
            d.untangle_at_rest(on, CLEARED);
            d.run(on, FINISHING, FINE_STEP, 1.0);
            if d.untangle_at_rest(on, CLEARED) > 0 {
                // Smoothed cloth is compressed, and spreads.
                d.run(on, FINISHING / 2, FINE_STEP, 1.0);
                d.untangle_at_rest(on, CLEARED);
            }
            d.lift_deep(&self.skin);
        });
        Ok(fine)
    }
}

fn on_skin<'a>(skin: &'a Skin<'_>, mesh: &'a GarmentMesh, offset: f64) -> GarmentOnSkin<'a> {
    GarmentOnSkin {
        mesh,
        surface: skin.model,
        frame: skin.frame(),
        offset,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{BodyShape, embedded};
    use crate::garment::{Size, library};
    use crate::math::Rigid;

    #[test]
    fn bodies_between_two_poses_start_and_end_at_them() {
        let t = embedded::template();
        let rest = t.personalise(&BodyShape::default());
        let pose = |angles| Pose {
            root: Rigid::identity(),
            angles,
        };
        let a = pose(canonical_pose(&t, &rest).angles);
        let b = pose(vec![0.0; a.angles.len()]);
        let bodies = bodies_between(&t, &rest, &a, &b, 3);
        assert_eq!(bodies.len(), 4);
        let far = |x: &[P3], y: &[P3]| {
            let pairs = x.iter().zip(y);
            pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f32::max)
        };
        for (body, at) in [(&bodies[0], &a), (&bodies[3], &b)] {
            let alone = bodies_between(&t, &rest, at, at, 1);
            assert!(far(body, &alone[0]) < 1e-5);
        }
        assert!(far(&bodies[1], &bodies[2]) < far(&bodies[0], &bodies[3]));
    }

    #[test]
    fn empty_lists_and_faulty_poses_are_refused() {
        let t = embedded::template();
        let rest = t.personalise(&BodyShape::default());
        let options = DressOptions::default();
        let mut pose = Pose::rest(t.skeleton(), Rigid::identity());
        let none = dress(&t, &rest, &pose, &[], &options);
        assert_eq!(none.err(), Some(DressError::NoGarments));
        let tank = [library::pattern("tank", Size::M).expect("pattern")];
        pose.angles[0] = f64::NAN;
        let e = dress(&t, &rest, &pose, &tank, &options);
        assert!(matches!(e, Err(DressError::Pose(_))));
        pose.angles = vec![0.0; 3];
        let e = dress(&t, &rest, &pose, &tank, &options);
        assert!(matches!(e, Err(DressError::Pose(_))));
    }
}
