//! What stays the same while an outfit is worn.

use super::regions::{REGION, Regions, clusters};
use crate::body::parts::{BodyPart, hinge_vertices, opposing_masks, pressing_masks, vertex_masks};
use crate::body::{SkinWeights, Template};
use crate::cloth::folds::FoldModel;
use crate::cloth::model::partition::Partition;
use crate::cloth::sleeves::{Arms, Sleeve};
use crate::cloth::solver::explicit::{PatchModel, StableSheet, StepSpec};
use crate::cloth::{ClothError, Sheet};
use crate::contact::{Crease, MapDetail, MapView, SurfaceModel};
use crate::garment::{GarmentMesh, Region};
use crate::math::{Camera, Rigid, World};
use crate::mesh::Topology;
use serde::{Deserialize, Serialize};

/// A garment vertex tied to a triangle of the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnchorBinding {
    /// Simulation vertex.
    pub vertex: u32,
    /// Body triangle.
    pub body: [u32; 3],
    /// Barycentric weights.
    pub weights: [f32; 3],
    /// Height above the triangle along its normal, metres.
    pub height: f32,
    /// How firmly, 0 to 1.
    pub strength: f64,
}

/// Garments that have been put on one body: meshes and what ties them to it. Innermost first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outfit {
    /// Garments, innermost layer first.
    pub garments: Vec<GarmentMesh>,
    /// Anchors of each garment.
    pub anchors: Vec<Vec<AnchorBinding>>,
}

/// How to simulate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The most small steps in 1/60 s. A garment takes as many as its fabric and triangles need to be stable with all
    /// their stiffness; where that is more than this, its stiffest triangles are softened. Fewer
    /// strain cloth more, more cost time: docs/benchmarks.md.
    pub most_steps: usize,
    /// How far ahead of positions forces are evaluated, in small steps: damps ringing.
    pub ahead: f64,
    /// Vertices of a patch, which is what a thread works on. Changes bits, so it is a setting and not the machine's. A
    /// garment that is cut pays for ghosts: of two garments with 10k vertices together each shall be one.
    pub patch: usize,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Distance of the outermost layer from the skin, metres; the others lie evenly between.
    pub offset: f64,
    /// Horizontal direction the real camera looks along, world x and z: its depth map is the fine one.
    pub camera_toward: [f32; 2],
    /// Which depth maps of the body are fine.
    pub map_detail: MapDetail,
    /// Press inner layers under outer ones where they meet.
    pub layers: bool,
    /// Keep the folds of a garment apart.
    pub self_collision: bool,
    /// Distance between cloth and cloth, metres.
    pub thickness: f64,
    /// Skin further than this from cloth beyond its distance is left out until the next search, metres; what it moves
    /// in between is added. Large while panels are being sewn, which pulls cloth faster than anything later.
    pub reach: f64,
    /// Body vertices that were measured to move by less than this between two calls are hardly followed, metres; 0 for a
    /// body that is known exactly. A tracked body trembles by 1 to 3 mm, and cloth on it would never rest.
    pub steady: f64,
    /// Let cloth sleep when it and the body are still.
    pub sleep: bool,
    /// Let regions of it sleep while others move, if it may sleep at all.
    pub sleep_regions: bool,
    /// Time from one look at all of a garment, which takes it out of itself, to the next, s; 0 for never.
    pub untangle: f64,
    /// How far apart two corners across an edge stay, over their distance where it is flat: ½ lets a fold close to 60°. 0 for
    /// no limit.
    pub sharpest: f64,
    /// Leave out searches for skin and for other folds of vertices that cannot have come near them since the last one.
    pub skip_far: bool,
    /// A body vertex that moves further than this between two calls has jumped, metres.
    pub teleport: f64,
    /// Threads.
    #[serde(skip)]
    pub par: crate::par::Par,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            most_steps: 72,
            ahead: 0.25,
            patch: 6000,
            gravity: [0.0, -9.81, 0.0],
            offset: 0.005,
            camera_toward: [0.0, -1.0],
            map_detail: MapDetail::InView,
            layers: true,
            self_collision: true,
            thickness: 0.003,
            reach: 0.008,
            steady: 0.0,
            sleep: true,
            sleep_regions: true,
            untangle: 0.13,
            sharpest: 0.6,
            skip_far: true,
            teleport: 0.2,
            par: crate::par::Par::Rayon,
        }
    }
}

impl Config {
    /// What two layers of cloth need between parts of the body that press on each other, metres.
    pub(crate) fn room(&self) -> f32 {
        (2.0 * self.offset + self.thickness) as f32
    }
    /// For a body that is tracked by a camera.
    pub fn tracked() -> Self {
        /// A standing body trembles by 3 mm with a Kinect v1 at 2.4 m (95 % of its vertices, from call to call); at
        /// 5 mm twice as much of that was left, metres.
        const TREMBLE: f64 = 8e-3;
        Self {
            steady: TREMBLE,
            ..Self::default()
        }
    }
    /// The same for a camera that stands there. One that looks straight down or up leaves the direction as it is.
    #[must_use]
    pub fn seen_from(self, world_from_camera: &Rigid<World, Camera>) -> Self {
        let axis = world_from_camera.vector(&crate::math::V3d::z());
        /// Sine of the angle to the vertical below which a direction says nothing.
        const LEVEL: f64 = 1e-3;
        if axis.x.hypot(axis.z) < LEVEL {
            self
        } else {
            Self {
                camera_toward: [axis.x as f32, axis.z as f32],
                ..self
            }
        }
    }
}

/// One garment's constant data.
#[derive(Debug)]
pub(super) struct GarmentModel {
    pub(super) sheet: Sheet,
    pub(super) patches: Vec<PatchModel>,
    /// Small step, s.
    pub(super) h: f64,
    /// Steps from one evaluation of bending to the next.
    pub(super) bend_every: usize,
    /// Degree of the smoothing of accelerations.
    pub(super) smooth: usize,
    /// Share of the membrane stiffness that the step carries.
    pub(super) softened: f64,
    /// Body parts that decide: cloth ends outside these.
    pub(super) own: Vec<u8>,
    /// Body parts that push where there is room.
    pub(super) other: Vec<u8>,
    /// Distance from the skin, metres.
    pub(super) offset: f64,
    /// The garment itself as something to touch.
    pub(super) folds: FoldModel,
    pub(super) regions: Regions,
    pub(super) sleeves: Vec<Sleeve>,
    /// Local vertex and number of the binding, for each patch.
    pub(super) anchors: Vec<Vec<(u32, usize)>>,
}

/// Everything immutable about an outfit on a body. Share it by `Arc`.
#[derive(Debug)]
pub struct Model {
    /// What is worn.
    pub outfit: Outfit,
    /// How it is simulated.
    pub config: Config,
    pub(super) garments: Vec<GarmentModel>,
    pub(super) surface: SurfaceModel,
    /// Part of the body that each of its vertices may lie in.
    pub(super) opposite: Vec<u8>,
    /// Its elbows and knees.
    pub(super) creases: Vec<Crease>,
    /// The same where both are thick: part of the body that presses on each of its vertices.
    pub(super) pressing: Vec<u8>,
    /// Its vertices, some at a time.
    pub(super) clusters: Partition,
    pub(super) arms: Arms,
    pub(super) weights: SkinWeights,
    pub(super) joints: usize,
    pub(super) views: [MapView; 4],
}

/// Evaluations of bending between two looks at which planes are within reach.
pub(super) const RECALLED: usize = 2;
/// A garment that is stable at this step needs no more smoothing, s. At 1/2400 s, with higher degrees, a still person's
/// cloth trembled on and never slept.
const LONG_ENOUGH: f64 = 1.0 / 3600.0;

/// A garment's regions are masks of body parts.
const _: () = {
    let masks = [
        Region::TRUNK,
        Region::LEFT_ARM,
        Region::RIGHT_ARM,
        Region::LEFT_LEG,
        Region::RIGHT_LEG,
    ];
    let mut k = 0;
    while k < masks.len() {
        assert!(masks[k].0 == BodyPart::ALL[k].mask());
        k += 1;
    }
};

/// Folds of the body's elbows and knees.
pub(super) fn creases(template: &Template, surface: &SurfaceModel) -> Vec<Crease> {
    hinge_vertices(template)
        .into_iter()
        .filter_map(|[upper, lower]| Crease::new(surface, upper, lower))
        .collect()
}

impl Model {
    /// Prepares an outfit for simulation on a body made from `template`.
    ///
    /// # Errors
    /// Faults of the garments (triangle or edge named) or of the settings (field named).
    pub fn new(template: &Template, outfit: Outfit, config: Config) -> Result<Self, ClothError> {
        let field = |field: &str, why: &str| ClothError::Field {
            field: field.to_owned(),
            why: why.to_owned(),
        };
        if config.most_steps == 0 || config.patch == 0 {
            return Err(field("most_steps, patch", "both must be at least 1"));
        }
        if !(config.ahead >= 0.0 && config.ahead <= 1.0) {
            return Err(field("ahead", "must be between 0 and 1 step"));
        }
        if !(config.offset.is_finite()
            && config.teleport > 0.0
            && config.steady >= 0.0
            && config.untangle >= 0.0)
        {
            return Err(field(
                "offset, teleport, steady, untangle",
                "they must be finite, teleport positive, steady and untangle not negative",
            ));
        }
        if !(0.0..1.0).contains(&config.sharpest) {
            return Err(field("sharpest", "must be at least 0 and less than 1"));
        }
        if outfit.anchors.len() != outfit.garments.len() {
            return Err(ClothError::Count {
                what: "anchor lists",
                got: outfit.anchors.len(),
                expected: outfit.garments.len(),
            });
        }
        let body = template.mesh().vertices().len();
        let mut garments = Vec::new();
        for (order, (g, anchors)) in outfit.garments.iter().zip(&outfit.anchors).enumerate() {
            if let Some(a) = anchors.iter().find(|a| {
                a.vertex as usize >= g.vertices || a.body.iter().any(|v| *v as usize >= body)
            }) {
                return Err(field(
                    &format!("anchor of vertex {}", a.vertex),
                    "it names a vertex that does not exist",
                ));
            }
            let sheet = Sheet::of_garment(g)?;
            // Of the second degree, layers and folds tore the dancer's clothes of 12 mm edges apart: finer garments are
            // softened to the step instead.
            let (smooth, h) = {
                let step = StableSheet::stable_steps(&sheet, config.ahead);
                let plain = step(0);
                let smoothed = (plain < LONG_ENOUGH)
                    .then(|| step(1))
                    .filter(|h| *h >= LONG_ENOUGH);
                smoothed.map_or((0, plain), |h| (1, h))
            };
            let h = h.clamp(1.0 / (60.0 * config.most_steps as f64), 1e-3);
            let bend_every = StableSheet::bending_interval(&sheet, h);
            let fit = StepSpec {
                h,
                lookahead: config.ahead,
                springs_only: false,
                bending_interval: bend_every,
                filter_degree: smooth,
            };
            let plan = StableSheet::new(&sheet, &fit);
            // A step moves news by one ring and by one more for each degree, an evaluation of bending by one more.
            let patches =
                plan.compile_patches(g.vertices.div_ceil(config.patch), 1 + smooth + 1, REGION);
            let own: Vec<u8> = g.regions.iter().map(|r| r.decisive().0).collect();
            let other = own.iter().map(|o| Region::ALL.0 & !o).collect();
            // Evenly between the skin and where the outermost lies.
            let offset = config.offset * (order + 1) as f64 / outfit.garments.len() as f64;
            let surface = SurfaceModel::new(g.faces.clone(), g.topology()?, own.clone());
            let folds = FoldModel::new(surface, sheet.edges.iter().map(|e| e.1 as f32));
            let regions = Regions::new(&patches, g.vertices, &sheet.edges, folds.edge());
            garments.push(GarmentModel {
                sleeves: Sleeve::of(g, &sheet.edges),
                sheet,
                patches,
                h,
                bend_every,
                smooth,
                softened: plan.kept_stiffness,
                own,
                other,
                offset,
                folds,
                regions,
                anchors: Vec::new(),
            });
        }
        let parts = vertex_masks(template);
        let opposite = opposing_masks(template, &parts);
        let surface = SurfaceModel::new(
            template.mesh().faces().to_vec(),
            Topology::new(template.mesh())?,
            parts.clone(),
        );
        let mut model = Self {
            pressing: pressing_masks(template, opposite.clone()),
            opposite,
            creases: creases(template, &surface),
            clusters: clusters(&surface),
            arms: Arms::new(template, &parts),
            surface,
            weights: template.weights().clone(),
            joints: template.skeleton().len(),
            views: MapView::around(config.camera_toward, config.map_detail),
            garments,
            outfit,
            config,
        };
        model.sort_anchors();
        Ok(model)
    }
    /// Vertices of the body it was made for.
    pub fn body_vertices(&self) -> usize {
        self.surface.vertices()
    }
    /// The same body and settings with other anchors.
    pub(crate) fn set_anchors(&mut self, anchors: Vec<Vec<AnchorBinding>>) {
        self.outfit.anchors = anchors;
        self.sort_anchors();
    }
    /// Which anchors each patch has, by its local vertices.
    fn sort_anchors(&mut self) {
        for (g, anchors) in self.garments.iter_mut().zip(&self.outfit.anchors) {
            g.anchors = g
                .patches
                .iter()
                .map(|f| {
                    let mut local: Vec<(u32, u32)> = f
                        .vertices
                        .iter()
                        .enumerate()
                        .map(|(i, v)| (*v, i as u32))
                        .collect();
                    local.sort_unstable();
                    let find = |v: u32| {
                        local
                            .binary_search_by_key(&v, |l| l.0)
                            .ok()
                            .map(|k| local[k].1)
                    };
                    anchors
                        .iter()
                        .enumerate()
                        .filter_map(|(k, a)| Some((find(a.vertex)?, k)))
                        .collect()
                })
                .collect();
        }
    }
    /// Local vertex and binding of a patch's anchors.
    pub(super) fn anchors_of(
        &self,
        garment: usize,
        patch: usize,
    ) -> impl Iterator<Item = (u32, &AnchorBinding)> {
        let bindings = &self.outfit.anchors[garment];
        self.garments[garment].anchors[patch]
            .iter()
            .map(move |(i, k)| (*i, &bindings[*k]))
    }
    /// The body surface that garments touch.
    pub(crate) fn surface(&self) -> &SurfaceModel {
        &self.surface
    }
    /// The part that presses on each vertex of it, see [`Apart::make_room`](crate::contact::Apart::make_room).
    pub(crate) fn pressing(&self) -> &[u8] {
        &self.pressing
    }
    /// See [`Config::room`].
    pub(crate) fn room(&self) -> f32 {
        self.config.room()
    }
    pub(crate) fn creases(&self) -> &[Crease] {
        &self.creases
    }
    /// The part that each vertex of it may lie in.
    pub(crate) fn opposite(&self) -> &[u8] {
        &self.opposite
    }
    pub(crate) fn arms(&self) -> &Arms {
        &self.arms
    }
    /// Distance from the skin of one garment's layer, metres.
    pub(crate) fn offset(&self, garment: usize) -> f64 {
        self.garments[garment].offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn the_fine_map_looks_where_the_camera_looks() {
        use crate::math::V3d;
        let turned = |axis, angle: f64| -> Rigid<Camera, Camera> {
            Rigid::from_parts(V3d::zeros(), UnitQuaternion::from_axis_angle(&axis, angle))
        };
        let level = Rigid::<World, Camera>::level(1.2);
        let toward = |camera: Rigid<Camera, Camera>| {
            let [x, z] = Config::tracked().seen_from(&(level * camera)).camera_toward;
            let n = x.hypot(z);
            [x / n, z / n]
        };
        let close =
            |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        // Tilted down or mounted upright it looks along −z all the same: that is what the default says.
        let default = Config::default().camera_toward;
        assert!(close(toward(turned(V3d::x_axis(), -0.3)), default));
        assert!(close(
            toward(turned(V3d::z_axis(), std::f64::consts::FRAC_PI_2)),
            default
        ));
        // Turned to its right (about its own axis down) it looks towards +x.
        let (sin, cos) = 0.5f32.sin_cos();
        assert!(close(toward(turned(V3d::y_axis(), 0.5)), [sin, -cos]));
        // Straight down: nothing is level, the default stays.
        assert!(close(
            toward(turned(V3d::x_axis(), -std::f64::consts::FRAC_PI_2)),
            default
        ));
    }
}
