//! The drape of an outfit: hang in the canonical pose, follow the body into the tracked pose, refine, tie to the body.

use super::canonical::{canonical_pose, upright_root};
use super::drape::{Drape, Layers};
use super::error::DressError;
use super::options::{DressOptions, DressReport, ms};
use super::refine::prolong;
use super::settings::{CanonicalSettings, OutfitDrapeSettings};
use super::sew::PlacedSheet;
use super::skin::{Skin, SkinModel};
use super::waistband::GarmentOnSkin;
use std::time::Instant;
use tryon_body::{BoneTransforms, Pose, RestBody, Template};
use tryon_cloth::contact::CollisionBody;
use tryon_cloth::{AnchorBinding, ClothError, Sheet};
use tryon_garment::GarmentMesh;
use tryon_geometry::math::{P3, World};

/// Body on which garments are draped.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wearer<'a> {
    pub(super) template: &'a Template,
    pub(super) rest: &'a RestBody,
    /// Tracked pose, world.
    pub(super) pose: &'a Pose<World>,
}

/// Garments draped on a body in its tracked pose.
#[derive(Debug)]
pub(super) struct DrapedOutfit {
    /// World, metres.
    pub(super) positions: Vec<Vec<P3>>,
    pub(super) anchors: Vec<Vec<AnchorBinding>>,
    pub(super) body: CollisionBody,
}

/// Drapes sheets, innermost first. Fills the report's times and the quality of the drape.
///
/// # Errors
/// Faults of the garments.
pub(super) fn drape_outfit(
    wearer: &Wearer<'_>,
    mut sheets: Vec<PlacedSheet>,
    options: &DressOptions,
    report: &mut DressReport,
) -> Result<DrapedOutfit, DressError> {
    let timer = Instant::now();
    let skin = SkinModel::new(wearer.template, &options.config)?;
    let (start, stages) = (
        wearer.canonical(&options.stages.sections.canonical),
        &options.stages,
    );
    for s in &mut sheets {
        let local = std::mem::take(&mut s.positions);
        start.root.points_f32(&local, &mut s.positions);
    }
    let [count, substeps] = if options.untangle {
        stages.drape.schedule.untangled_following
    } else {
        stages.drape.schedule.following
    };
    let bodies = wearer.bodies_between(&start, wearer.pose, count);
    let mut drape = OutfitDrape::new(&skin, sheets, &bodies[0], options)?;
    drape.hang();
    drape.follow(&bodies, substeps)?;
    report.stages_ms.coarse = ms(timer);
    let fine = drape.finish(report)?;

    let timer = Instant::now();
    let (positions, anchors) = drape.tie(&fine, report);
    report.stages_ms.fine += ms(timer);
    Ok(DrapedOutfit {
        positions,
        anchors,
        body: drape.skin.into_body(),
    })
}

impl Wearer<'_> {
    /// The canonical pose where the wearer is.
    fn canonical(&self, settings: &CanonicalSettings) -> Pose<World> {
        Pose {
            root: upright_root(self.rest, &self.pose.root),
            angles: canonical_pose(self.template, self.rest, settings).angles,
        }
    }
    /// Posed vertices of `count + 1` bodies from one pose to another, slow at both ends.
    fn bodies_between(&self, from: &Pose<World>, to: &Pose<World>, count: usize) -> Vec<Vec<P3>> {
        let (template, rest) = (self.template, self.rest);
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
}

/// Garments being draped on a body.
struct OutfitDrape<'a> {
    /// Meshes of the garments.
    garments: Vec<GarmentMesh>,
    skin: Skin<'a>,
    /// Distance of each garment from the skin, metres.
    offsets: Vec<f64>,
    /// Mesh of each garment that is draped first; `None` where it is the garment's own.
    coarse: Vec<Option<GarmentMesh>>,
    anchors: Vec<Vec<AnchorBinding>>,
    layers: Layers,
    untangle: bool,
    settings: OutfitDrapeSettings,
}

impl<'a> OutfitDrape<'a> {
    /// Sheets around the first body, their anchors tied to it.
    fn new(
        skin: &'a SkinModel,
        sheets: Vec<PlacedSheet>,
        body: &[P3],
        options: &DressOptions,
    ) -> Result<Self, DressError> {
        let mut skin = Skin::of(skin);
        skin.place(body).map_err(ClothError::from)?;
        let (count, untangle, settings) = (sheets.len(), options.untangle, options.stages.drape);
        let offset = |k| options.config.layer_offset(k, count);
        let offsets: Vec<f64> = (0..count).map(offset).collect();
        let garments = sheets.iter().map(|s| s.garment.clone()).collect();
        let (mut coarse, mut firsts) = (Vec::new(), Vec::new());
        let (mut anchors, mut drapes) = (Vec::new(), Vec::new());
        for (s, offset) in sheets.into_iter().zip(&offsets) {
            let first = s.coarse.clone().unwrap_or(s.garment);
            let sheet = Sheet::of_garment(&first)?;
            let mut d = Drape::new(&first, &sheet, s.positions, &settings);
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
            garments,
            skin,
            offsets,
            coarse,
            anchors,
            untangle,
            settings,
        })
    }
    fn garment(&self, k: usize) -> GarmentOnSkin<'_> {
        on_skin(&self.skin, &self.garments[k], self.offsets[k])
    }
    /// Drapes in the canonical pose.
    fn hang(&mut self) {
        let (skin, anchors, schedule) = (&self.skin, &self.anchors, self.settings.schedule);
        let step = schedule.coarse_step;
        self.layers.each(skin, &self.offsets, |k, d, on| {
            d.pin(&anchors[k], skin.frame());
            d.run(on, schedule.closing, step, schedule.closing_gravity);
            d.stop();
            d.run(on, schedule.draping, step, 1.0);
        });
    }
    /// Follows the body through its poses.
    fn follow(&mut self, bodies: &[Vec<P3>], substeps: usize) -> Result<(), ClothError> {
        let schedule = self.settings.schedule;
        for w in bodies.windows(2) {
            self.skin.place(&w[1])?;
            let (skin, anchors) = (&self.skin, &self.anchors);
            self.layers.each(skin, &self.offsets, |k, d, on| {
                d.follow_skin(&w[0], &w[1]);
                d.recover_sleeves(skin);
                d.pin(&anchors[k], skin.frame());
                d.run(on, substeps, schedule.coarse_step, 1.0);
                d.untangle_at_rest(on, schedule.clearing);
            });
        }
        Ok(())
    }
    /// Settles in the tracked pose and refines, again while the fine garments intersect themselves off the arms.
    fn finish(&mut self, report: &mut DressReport) -> Result<Layers, DressError> {
        let schedule = self.settings.schedule;
        let mut fine = Layers::default();
        for _ in 0..schedule.attempts {
            let timer = Instant::now();
            let skin = &self.skin;
            self.layers.each(skin, &self.offsets, |_, d, on| {
                d.recover_sleeves(skin);
                d.run(on, schedule.settling, schedule.coarse_step, 1.0);
                d.untangle_at_rest(on, schedule.cleared);
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
            let mut d = Drape::new(on.mesh, &sheet, x, &self.settings);
            d.find_nearest_from(&self.skin, rough);
            d.pin(&on.fasten(&d.positions())?, self.skin.frame());
            drapes.push(if self.untangle {
                d.with_untangling(on.mesh, &sheet)?
            } else {
                d
            });
        }
        let s = self.settings.schedule;
        let (fine_step, finishing, cleared) = (s.fine_step, s.finishing, s.cleared);
        let mut fine = Layers::new(&self.garments, drapes)?;
        fine.each(&self.skin, &self.offsets, |_, d, on| {
            d.recover_sleeves(&self.skin);
            d.untangle_at_rest(on, cleared);
            d.run(on, finishing, fine_step, 1.0);
            if d.untangle_at_rest(on, cleared) > 0 {
                // Smoothed cloth is compressed, and spreads.
                d.run(on, finishing / 2, fine_step, 1.0);
                d.untangle_at_rest(on, cleared);
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
        let wearer = Wearer {
            template: &t,
            rest: &rest,
            pose: &b,
        };
        let bodies = wearer.bodies_between(&a, &b, 3);
        assert_eq!(bodies.len(), 4);
        let far = |x: &[P3], y: &[P3]| {
            let pairs = x.iter().zip(y);
            pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f32::max)
        };
        for (body, at) in [(&bodies[0], &a), (&bodies[3], &b)] {
            let alone = wearer.bodies_between(at, at, 1);
            assert!(far(body, &alone[0]) < 1e-5);
        }
        assert!(far(&bodies[1], &bodies[2]) < far(&bodies[0], &bodies[3]));
    }
}
