//! Garments put on a subject and simulated from pose to pose.

use super::settings::ScanSettings;
use super::skinned::{BoundGarment, SkinnedGarment};
use tryon::mirror::Choice;
use tryon_body::measure::measure;
use tryon_body::{BoneTransforms, Pose, RestBody, Template, skin};
use tryon_cloth::{Input, Workspace, step};
use tryon_dressing::{DressOptions, Dressed, GarmentSource, dress_all};
use tryon_garment::GarmentMesh;
use tryon_geometry::math::{P3, World};
use tryon_geometry::par::Par;

/// Garment of a scanned outfit.
#[derive(Clone, Debug)]
pub struct ScanGarment {
    /// Garment and its size.
    pub choice: Choice,
    /// Layer on the body, 0 innermost; `None` for the garment's own. Meshes keep their own.
    ///
    /// A shirt of layer 0 under trousers of layer 1 is tucked in.
    pub layer: Option<u8>,
}

impl From<Choice> for ScanGarment {
    fn from(choice: Choice) -> Self {
        Self {
            choice,
            layer: None,
        }
    }
}

/// Garments of a subject of scans.
pub(super) struct ScanWardrobe<'a> {
    /// Simulated garments.
    pub(super) patterns: &'a [ScanGarment],
    /// Edge length of garments cut from patterns (m).
    pub(super) edge: f64,
    /// Garments that move with the skin below them.
    pub(super) skinned: &'a [SkinnedGarment],
    pub(super) settings: &'a ScanSettings,
}

/// Body and cloth in one pose of a motion.
pub(super) struct ClothRun<'a> {
    template: &'a Template,
    rest: &'a RestBody,
    /// `None` for a subject without garments.
    dressed: Option<Dressed>,
    skinned: Vec<BoundGarment>,
    work: Workspace,
    bones: BoneTransforms,
    body: Vec<P3>,
    /// Largest 99th percentile of the stretch so far.
    pub(super) strain: f64,
}

impl<'a> ClothRun<'a> {
    /// Dresses a body in its first pose and lets the cloth settle for some steps of `dt` (s).
    pub(super) fn new(
        template: &'a Template,
        rest: &'a RestBody,
        pose: &Pose<World>,
        wardrobe: &ScanWardrobe<'_>,
        dt: f64,
    ) -> Result<Self, String> {
        let gaps = (1..).map(|layer: u16| wardrobe.settings.skinned_gap * f32::from(layer));
        let bound = wardrobe.skinned.iter().zip(gaps);
        let bound = bound.map(|(g, gap)| g.bind(template, rest, gap));
        let mut run = Self {
            skinned: bound.collect::<Result<_, _>>()?,
            template,
            rest,
            dressed: None,
            work: Workspace::default(),
            bones: BoneTransforms::default(),
            body: Vec::new(),
            strain: 0.0,
        };
        if !wardrobe.patterns.is_empty() {
            run.dressed = Some(put_on(template, rest, pose, wardrobe)?);
            for _ in 0..wardrobe.settings.settling_steps {
                run.step(pose, dt)?;
            }
            run.strain = 0.0;
        }
        run.step(pose, dt)?;
        Ok(run)
    }

    /// Moves the body to a pose and the cloth by `dt` (s).
    pub(super) fn step(&mut self, pose: &Pose<World>, dt: f64) -> Result<(), String> {
        pose.bones(self.template.skeleton(), self.rest, &mut self.bones);
        let (rest, weights) = (&self.rest.vertices, self.template.weights());
        skin(Par::Rayon, rest, weights, &self.bones, &mut self.body);
        for garment in &mut self.skinned {
            garment.pose(&self.bones);
        }
        let Some(dressed) = &mut self.dressed else {
            return Ok(());
        };
        let input = Input {
            body: &self.body,
            dt,
        };
        let report = step(&dressed.model, &mut dressed.state, &input, &mut self.work);
        let report = report.map_err(|e| e.to_string())?;
        self.strain = self.strain.max(report.p99_strain);
        Ok(())
    }

    /// Skin as the cloth met it, world (m): parts that press on each other are apart.
    pub(super) fn body(&self) -> &[P3] {
        let collision = self
            .dressed
            .as_ref()
            .map(|d| d.state.collision_body().vertices());
        collision.unwrap_or(&self.body)
    }

    /// Garments with the positions of their simulation vertices, innermost first; skinned ones lie over simulated ones.
    pub(super) fn garments(&self) -> impl Iterator<Item = (&GarmentMesh, &[P3])> {
        let simulated = self.dressed.iter().flat_map(|d| {
            let meshes = d.model.outfit.garments.iter();
            let states = d.state.garments.iter().map(|g| g.positions.as_slice());
            meshes.zip(states)
        });
        simulated.chain(self.skinned.iter().map(BoundGarment::surface))
    }
}

/// Garments of any size on a body, each pattern in the size that was chosen or that fits best, meshes made to measure.
fn put_on(
    template: &Template,
    rest: &RestBody,
    pose: &Pose<World>,
    wardrobe: &ScanWardrobe<'_>,
) -> Result<Dressed, String> {
    let measures = measure(template, rest).map_err(|e| e.to_string())?;
    let mut patterns = Vec::new();
    for garment in wardrobe.patterns {
        let sized = garment.choice.sized(&measures).map_err(|e| e.to_string())?;
        let mut pattern = sized.pattern().cloned();
        if let (Some(pattern), Some(layer)) = (&mut pattern, garment.layer) {
            pattern.layer = layer;
        }
        patterns.push(pattern);
    }
    let sources = wardrobe.patterns.iter().zip(&patterns);
    let sources: Vec<GarmentSource<'_>> = sources
        .filter_map(|(garment, pattern)| match (&garment.choice, pattern) {
            (Choice::Mesh { garment, .. }, _) => Some(GarmentSource::Mesh(garment)),
            (_, pattern) => pattern.as_ref().map(GarmentSource::Pattern),
        })
        .collect();
    let mut options = DressOptions {
        any_size: true,
        ..DressOptions::default()
    };
    options.triangulation.edge_length = wardrobe.edge;
    dress_all(template, rest, pose, &sources, &options).map_err(|e| e.to_string())
}
