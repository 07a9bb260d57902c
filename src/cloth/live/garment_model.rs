//! Immutable data of one garment in an outfit.

use super::contact::contact_topology::ContactTopology;
use super::error::ClothError;
use super::model::Sheet;
use super::outfit::AnchorBinding;
use super::sleep::island_model::{ISLAND, IslandModel};
use super::solver::explicit::{PatchModel, StableSheet, StepSpec};
use crate::contact::SurfaceModel;
use crate::settings::Config;
use tryon_garment::{GarmentMesh, Region};

/// Inverse of the time that [`Config::most_steps`] counts for, 1/s.
const BUDGET_RATE: f64 = 60.0;

/// Immutable data of one garment.
#[derive(Debug)]
pub(super) struct GarmentModel {
    pub(super) sheet: Sheet,
    pub(super) patches: Vec<PatchModel>,
    /// Substep, s.
    pub(super) h: f64,
    /// Substeps between two evaluations of bending.
    pub(super) bending_interval: usize,
    /// Degree of the filter of accelerations.
    pub(super) filter_degree: usize,
    /// Share of the membrane stiffness that the substep admits.
    pub(super) softened: f64,
    /// Body parts of each vertex: cloth ends outside these.
    pub(super) own: Vec<u8>,
    /// All other body parts, which push where there is clearance.
    pub(super) other: Vec<u8>,
    /// Distance from the skin, metres.
    pub(super) offset: f64,
    pub(super) topology: ContactTopology,
    pub(super) islands: IslandModel,
    /// Patch vertex and index of the binding, for each patch.
    pub(super) anchors: Vec<Vec<(u32, usize)>>,
}

impl GarmentModel {
    /// Prepares a garment, the mechanical system `sheet`, that lies at `offset` metres from the skin.
    pub(super) fn new(
        g: &GarmentMesh,
        sheet: Sheet,
        config: &Config,
        offset: f64,
    ) -> Result<Self, ClothError> {
        let spec = substep(&sheet, config);
        let stable = StableSheet::new(&sheet, &spec, &config.solver);
        // A substep couples one ring, one more per degree of smoothing, and one more for bending.
        let rings = 1 + spec.filter_degree + 1;
        let patches = stable.compile_patches(g.vertices.div_ceil(config.patch), rings, ISLAND);
        let own: Vec<u8> = g.regions.iter().map(|r| r.decisive().0).collect();
        let surface = SurfaceModel::new(g.faces.clone(), g.topology()?, own.clone());
        let lengths = sheet.edges.iter().map(|e| e.1 as f32);
        let topology = ContactTopology::new(surface, lengths);
        let [near, edges] = config.stillness.wake_distance;
        let wake_distance = near + edges * topology.edge();
        Ok(Self {
            islands: IslandModel::new(&patches, g.vertices, &sheet.edges, wake_distance),
            sheet,
            patches,
            h: spec.h,
            bending_interval: spec.bending_interval,
            filter_degree: spec.filter_degree,
            softened: stable.kept_stiffness,
            other: own.iter().map(|o| Region::ALL.0 & !o).collect(),
            own,
            offset,
            topology,
            anchors: Vec::new(),
        })
    }

    /// Assigns bindings to the patches that hold their vertices.
    pub(super) fn assign_anchors(&mut self, bindings: &[AnchorBinding]) {
        self.anchors.clear();
        for patch in &self.patches {
            let mut local: Vec<(u32, u32)> = (0u32..)
                .zip(&patch.vertices)
                .map(|(i, v)| (*v, i))
                .collect();
            local.sort_unstable();
            let find = |v: u32| {
                let k = local.binary_search_by_key(&v, |l| l.0).ok()?;
                Some(local[k].1)
            };
            let assigned = bindings.iter().enumerate();
            self.anchors.push(
                assigned
                    .filter_map(|(k, a)| Some((find(a.vertex)?, k)))
                    .collect(),
            );
        }
    }
}

/// Longest stable substep of a sheet within the budget, and the smoothing it needs.
///
/// Smoothing of degree two tore clothes of 12 mm edges where layers and folds touch: finer ones are softened instead.
fn substep(sheet: &Sheet, config: &Config) -> StepSpec {
    let settings = &config.solver;
    let stable = StableSheet::stable_steps(sheet, config.force_lookahead, settings);
    let plain = stable(0);
    let smoothed = (plain < settings.unsmoothed_step)
        .then(|| stable(1))
        .filter(|h| *h >= settings.unsmoothed_step);
    let (smooth, h) = smoothed.map_or((0, plain), |h| (1, h));
    let shortest = 1.0 / (BUDGET_RATE * config.most_steps as f64);
    let h = h.clamp(shortest, settings.max_substep);
    StepSpec {
        h,
        lookahead: config.force_lookahead,
        bending_interval: StableSheet::bending_interval(sheet, h, settings),
        filter_degree: smooth,
    }
}
