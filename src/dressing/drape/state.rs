//! State of one garment that is being draped.

use crate::hood::Hood;
use crate::plane::DrapePlane;
use crate::settings::{HeldDownSettings, OutfitDrapeSettings};
use crate::skin::Skin;
use std::collections::BTreeSet;
use tryon_cloth::contact::Part;
use tryon_cloth::sleeve_rings::{Sleeve, SleeveSettings};
use tryon_cloth::untangler::{Untangler, UntanglerSettings};
use tryon_cloth::{Hinge, Sheet};
use tryon_garment::{GarmentError, GarmentMesh, Region};
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::distances;

/// Share of the membrane stiffness that an edge of a hexagonal spring lattice carries: √3/2.
const LATTICE: f64 = 0.866;
/// Parts that cloth around the trunk touches.
const AROUND: Region = Region::TRUNK.with(Region::LEFT_LEG).with(Region::RIGHT_LEG);

/// Distance constraint along an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeConstraint {
    pub(super) ends: [u32; 2],
    /// Length at rest (m).
    pub(super) rest: f64,
    /// m/N.
    pub(super) compliance: f64,
}

/// One garment being draped.
#[derive(Debug, Default)]
pub(crate) struct Drape {
    pub(super) settings: OutfitDrapeSettings,
    /// Positions in the world (m).
    pub(crate) x: Vec<V3d>,
    pub(super) velocity: Vec<V3d>,
    /// Positions at the begin of the substep (m).
    pub(super) before: Vec<V3d>,
    pub(super) inverse_mass: Vec<f64>,
    /// From top to bottom, so that one pass propagates a pull down the whole garment.
    pub(super) edges: Vec<EdgeConstraint>,
    pub(super) hinges: Vec<Hinge>,
    /// Body parts that each vertex belongs to.
    pub(super) own: Vec<Part>,
    pub(super) sleeves: Vec<Sleeve>,
    /// True where friction keeps a vertex from sliding up: around the trunk, away from sleeves and shoulders.
    pub(super) held_down: Vec<bool>,
    /// Nearest body vertex among the own parts, then among the others.
    pub(crate) nearest: Vec<[u32; 2]>,
    pub(super) planes: Vec<[DrapePlane; 2]>,
    /// Nearest vertex of every garment further out, shape `[garments][vertices]`.
    pub(super) nearest_outer: Vec<Vec<u32>>,
    /// Vertices under an outer garment, each with the plane that bounds it.
    pub(super) outer_planes: Vec<(u32, DrapePlane)>,
    pub(super) pinned: Vec<Option<V3d>>,
    /// Depth that a vertex may sink below its offset where cloth is tangled between skins (m).
    pub(super) slack: Vec<f64>,
    /// Present if the sheet is to be untangled.
    pub(super) untangler: Option<Untangler>,
    pub(super) hood: Option<Hood>,
    /// Self-intersections at the last query.
    pub(super) crossings: usize,
    /// True if it was prolonged from a coarser drape of the same garment.
    pub(super) fine: bool,
    /// True once it was smoothed locally, which leaves it compressed.
    pub(super) compressed: bool,
    /// Substeps so far.
    pub(crate) steps: usize,
}

/// True for cloth that belongs to arms alone: a sleeve.
pub(super) fn on_arms(own: Part) -> bool {
    own & !Region::ARMS.0 == 0
}

impl Drape {
    pub(crate) fn new(
        mesh: &GarmentMesh,
        sheet: &Sheet,
        x: Vec<P3>,
        settings: &OutfitDrapeSettings,
    ) -> Self {
        let n = x.len();
        let own: Vec<Part> = mesh.regions.iter().map(|r| r.decisive().0).collect();
        Self {
            settings: *settings,
            held_down: held_down(mesh, sheet, &own, &settings.held_down),
            velocity: vec![V3d::zeros(); n],
            inverse_mass: sheet.mass.iter().map(|m| 1.0 / m).collect(),
            edges: edges_from_top(mesh, sheet, &x),
            hinges: sheet.hinges.iter().copied().filter(|h| h.w > 0.0).collect(),
            own,
            sleeves: Sleeve::find(mesh, &sheet.edges, &SleeveSettings::default()),
            nearest: vec![[u32::MAX; 2]; n],
            planes: vec![[DrapePlane::default(); 2]; n],
            pinned: vec![None; n],
            slack: vec![0.0; n],
            x: x.iter().map(|p| p.coords.cast()).collect(),
            ..Self::default()
        }
    }
    /// The same with untangling of the sheet, and contact of a hood with itself.
    pub(crate) fn with_untangling(
        mut self,
        mesh: &GarmentMesh,
        sheet: &Sheet,
    ) -> Result<Self, GarmentError> {
        self.untangler = Some(Untangler::new(
            &mesh.faces,
            &self.x,
            UntanglerSettings::default(),
        ));
        self.hood = Hood::new(mesh, sheet, self.settings.hood)?;
        Ok(self)
    }
    /// Positions in single precision (m).
    pub(crate) fn positions(&self) -> Vec<P3> {
        self.x.iter().map(|p| P3::from(p.cast::<f32>())).collect()
    }
    /// Position of one vertex in single precision (m).
    pub(super) fn point(&self, i: usize) -> P3 {
        P3::from(self.x[i].cast::<f32>())
    }
    /// Inverse mass of a vertex, 0 if it is pinned [1/kg].
    pub(super) fn weight(&self, i: u32) -> f64 {
        match self.pinned[i as usize] {
            Some(_) => 0.0,
            None => self.inverse_mass[i as usize],
        }
    }
    /// Sets all velocities to zero.
    pub(crate) fn stop(&mut self) {
        self.velocity.fill(V3d::zeros());
    }
    /// True if the last intersections include cloth that is on no arm.
    pub(crate) fn crosses_off_arms(&self) -> bool {
        let crosses = |u: &Untangler| {
            let mut all = u.displacements.iter().zip(&self.own);
            all.any(|((_, n), own)| *n > 0.0 && !on_arms(*own))
        };
        self.crossings > 0 && self.untangler.as_ref().is_some_and(crosses)
    }
    /// Largest depth of a vertex under the skin of its own parts (m), and the 99th percentile of the edges' stretch.
    pub(crate) fn measure(&self, skin: &Skin<'_>) -> (f64, f64) {
        let mut deepest = 0.0f64;
        for i in 0..self.x.len() {
            let c = skin.closest(&self.point(i), self.nearest[i][0], self.own[i]);
            if !c.on_part_boundary && !skin.is_interior(&c) {
                deepest = deepest.max(-f64::from(c.signed_distance));
            }
        }
        let stretch = |e: &EdgeConstraint| {
            let [a, b] = e.ends.map(|v| self.x[v as usize]);
            (a - b).norm() / e.rest - 1.0
        };
        let mut all: Vec<f64> = self.edges.iter().map(stretch).collect();
        (deepest, percentile(&mut all, 99).unwrap_or(0.0))
    }
}

fn edges_from_top(mesh: &GarmentMesh, sheet: &Sheet, x: &[P3]) -> Vec<EdgeConstraint> {
    let height = |k: usize| {
        let v = sheet.edges[k].0;
        x[v[0] as usize].y + x[v[1] as usize].y
    };
    let mut order: Vec<usize> = (0..sheet.edges.len()).collect();
    order.sort_by(|a, b| height(*b).total_cmp(&height(*a)).then(a.cmp(b)));
    let membrane = LATTICE * (mesh.material.stretch_warp * mesh.material.stretch_weft).sqrt();
    let edge = |k: usize| EdgeConstraint {
        ends: sheet.edges[k].0,
        rest: sheet.edges[k].1,
        compliance: 1.0 / membrane,
    };
    order.into_iter().map(edge).collect()
}

fn held_down(
    mesh: &GarmentMesh,
    sheet: &Sheet,
    own: &[Part],
    settings: &HeldDownSettings,
) -> Vec<bool> {
    let (sleeve, top) = (settings.sleeve, settings.top);
    let n = own.len();
    let from_sleeve = distances(n, &sheet.edges, sleeve, |i| {
        mesh.regions[i].meets(Region::ARMS)
    });
    let soft = mesh.anchors.iter().filter(|a| a.strength < 1.0);
    let tops: BTreeSet<u32> = soft.flat_map(|a| &a.vertices).copied().collect();
    let from_top = distances(n, &sheet.edges, top, |i| tops.contains(&(i as u32)));
    (0..n)
        .map(|i| own[i] == AROUND.0 && from_sleeve[i] > sleeve && from_top[i] > top)
        .collect()
}
