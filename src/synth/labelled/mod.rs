//! Random labelled frames: people of any shape and pose before any camera, with the class and the depth of every cell.
//!
//! A person is a function of seed and number. Each person is seen in several poses.

mod crops;
mod people;
mod settings;
mod stances;
mod surroundings;
mod viewpoint;

use super::furniture::NEAR;
use super::stance::Rig;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;
use surroundings::{Owner, PosedPerson, Surroundings};
use tryon_body::{BoneTransforms, RestBody, Template, skin};
use tryon_geometry::camera::DepthImage;
use tryon_geometry::math::{P3, P3d, V3, V3d};
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};
use tryon_geometry::spatial::{Label, OrganisedCloud};
use tryon_tracking::part_classes::PART_CLASSES;
use tryon_tracking::segment::part_network::PersonCells;
use tryon_tracking::{PartClasses, yaw_of_joints};
use viewpoint::Viewpoint;

pub use crops::{DEPTH_STEPS, NO_DEPTH, RECORD_BYTES};
pub use settings::LabelledSettings;

/// Label of a cell whose class the render does not give.
pub const NO_CLASS: u8 = u8::MAX;
/// Label of a cell that shows something else than the person.
pub const NOT_PERSON: u8 = PART_CLASSES as u8;
/// Frames of one person: a shape costs as much as a frame.
pub const FRAMES_PER_PERSON: usize = 4;
/// A frame with its truth.
#[derive(Clone, Debug)]
pub struct LabelledFrame {
    /// The depth image on the tracker's grid.
    pub cloud: OrganisedCloud,
    /// The person's cells that have a reading, ascending.
    pub cells: Vec<u32>,
    /// Class of each of them; [`NO_CLASS`] where unknown.
    pub labels: Vec<u8>,
    /// Unit direction against gravity, camera frame.
    pub up: V3,
    /// Posed joints, camera frame, metres; none where nobody is.
    pub joints: Vec<P3d>,
    /// Turn of the torso about gravity from facing the camera to the subject's left, radians; `None` for one that lies and
    /// for nobody.
    pub yaw: Option<f64>,
}

impl LabelledFrame {
    /// The person's cells.
    pub fn person(&self) -> PersonCells<'_> {
        PersonCells {
            cloud: &self.cloud,
            cells: &self.cells,
            up: self.up,
        }
    }
}

/// Source of labelled frames.
#[derive(Clone, Debug)]
pub struct LabelledFrames {
    template: Arc<Template>,
    classes: PartClasses,
    seed: u64,
    settings: LabelledSettings,
}

impl LabelledFrames {
    /// Frames of a template; poses come from the try-on routine and from random key poses.
    pub fn new(template: Arc<Template>, seed: u64) -> Self {
        Self {
            classes: PartClasses::new(&template),
            template,
            seed,
            settings: LabelledSettings::default(),
        }
    }
    /// Classes of the template.
    pub fn classes(&self) -> &PartClasses {
        &self.classes
    }

    /// The frames of one person, at most [`FRAMES_PER_PERSON`].
    pub fn person(&self, number: u64) -> Vec<LabelledFrame> {
        let mut rng = Pcg64Mcg::new(u128::from(self.seed) << 64 | u128::from(number) << 1 | 1);
        let mut rng = Pcg64Mcg::seed_from_u64(rng.random());
        let rest = people::draw(&self.settings, &self.template, &self.classes, &mut rng);
        let rig = Rig::new(self.template.skeleton(), &rest);
        let mut out = Vec::with_capacity(FRAMES_PER_PERSON);
        for _ in 0..FRAMES_PER_PERSON {
            out.extend((0..self.settings.tries).find_map(|_| self.frame(&rest, &rig, &mut rng)));
        }
        out
    }

    /// One frame; `None` if it shows too little.
    fn frame(&self, rest: &RestBody, rig: &Rig, rng: &mut Pcg64Mcg) -> Option<LabelledFrame> {
        let (mut vertices, mut joints) = self.pose(rest, rig, rng);
        let lowest = vertices.iter().map(|v| v.y).fold(f32::INFINITY, f32::min);
        let drop = V3::new(0.0, -lowest, 0.0);
        let height = |p: &P3d| p.y - f64::from(lowest);
        let (head, pelvis) = (self.template.skeleton().index("head")?, 0);
        let view = Viewpoint::draw(
            &self.settings,
            [height(&joints[pelvis]), height(&joints[head])],
            rng,
        );
        let to_camera = view.world_from_camera.inverse();
        let place = V3d::new(view.place[0], 0.0, view.place[1]);
        joints
            .iter_mut()
            .for_each(|j| *j += drop.cast::<f64>() + place);
        let person = PosedPerson {
            classes: &self.classes,
            joints: &joints,
            view: &view,
        };
        let is_deserted = rng.random_bool(self.settings.deserted);
        let surroundings = if is_deserted {
            Surroundings::draw_alone(&self.settings, &person, rng)
        } else {
            Surroundings::draw(&self.settings, &person, rng)
        };
        if is_deserted {
            joints.clear();
        }
        joints.iter_mut().for_each(|j| *j = to_camera.point(j));
        let rotation = to_camera.iso().cast::<f32>();
        let place = drop + place.cast::<f32>();
        vertices
            .iter_mut()
            .for_each(|v| *v = rotation * (*v + place));
        let up = to_camera.vector(&V3d::y()).cast::<f32>();
        let scene = PersonScene {
            view: &view,
            vertices: &vertices,
            joints: &joints,
            surroundings: &surroundings,
        };
        self.capture(&scene, rng)
            .map(|(cloud, cells, labels)| LabelledFrame {
                cloud,
                cells,
                labels,
                yaw: yaw_of_joints(&self.classes, &joints, &up),
                up,
                joints,
            })
    }

    /// Vertices and joints of a random pose, world frame, pelvis over the origin.
    fn pose(&self, rest: &RestBody, rig: &Rig, rng: &mut Pcg64Mcg) -> (Vec<P3>, Vec<P3d>) {
        let skeleton = self.template.skeleton();
        let mut bones = BoneTransforms::default();
        for _ in 0..self.settings.tries {
            let stance = stances::draw(&self.settings, rig, rng);
            rig.pose(&stance).bones(skeleton, rest, &mut bones);
            if !stances::penetrates(skeleton, &bones.joints, self.settings.inside)
                || rng.random_bool(0.1)
            {
                break;
            }
        }
        let mut vertices = Vec::new();
        let weights = self.template.weights();
        skin(Par::Seq, &rest.vertices, weights, &bones, &mut vertices);
        (vertices, bones.joints)
    }

    /// Depth image of the scene with noise, on the grid; cells and their labels.
    fn capture(
        &self,
        scene: &PersonScene<'_>,
        rng: &mut Pcg64Mcg,
    ) -> Option<(OrganisedCloud, Vec<u32>, Vec<u8>)> {
        let (view, camera) = (scene.view, scene.view.camera);
        let options = Options {
            par: Par::Seq,
            cull: Cull::Back,
            ..Options::default()
        };
        let pinhole = View::Perspective { camera, near: NEAR };
        let mut buffer = VisibilityBuffer::default();
        let is_deserted = scene.joints.is_empty();
        let faces = match self.template.mesh().faces() {
            _ if is_deserted => &[],
            faces => faces,
        };
        rasterise_with(options, &pinhole, scene.vertices, faces, &mut buffer);
        let owners = scene.surroundings.overlay(view, &mut buffer.depth);
        let mut image = view.noise.apply(&camera, &buffer.depth, rng.random(), 0);
        if let Some(step) = view.quantum {
            image = quantised(&image, step);
        }
        let mut cloud = OrganisedCloud::new(&camera, None);
        cloud.sample(&image, self.settings.farthest);
        let label = |cloud: &OrganisedCloud, cell: u32| {
            self.label(scene, &buffer, &owners, cloud, cell as usize)
        };
        let mut cells = self.cells(view, &cloud, rng);
        cells.retain(|c| label(&cloud, *c) != NOT_PERSON || scene.is_joined(&cloud, *c));
        refine(&mut cloud, &image, &mut cells);
        let mut labels: Vec<u8> = cells.iter().map(|c| label(&cloud, *c)).collect();
        drop_strays(&cloud, &mut cells, &mut labels);
        let is_own = |l: &&u8| is_deserted || **l < NOT_PERSON;
        let own = labels.iter().filter(is_own).count();
        (own >= self.settings.least_cells).then_some((cloud, cells, labels))
    }

    /// Cells with a reading, without those lost to the floor and at the outline.
    fn cells(&self, view: &Viewpoint, cloud: &OrganisedCloud, rng: &mut Pcg64Mcg) -> Vec<u32> {
        let settings = &self.settings;
        let floor = if rng.random_bool(settings.floor_loss) {
            rng.random_range(settings.floor_height[0]..settings.floor_height[1])
        } else {
            f64::NEG_INFINITY
        };
        let loss = rng.random_bool(settings.outline_loss[0]);
        let columns = cloud.size().0 as i32;
        let border = HiddenSide::draw(settings, view, rng);
        let mut keep = |c: &u32| {
            let cell = *c as usize;
            if cloud.depth[cell] <= 0.0 {
                return false;
            }
            let p = view
                .world_from_camera
                .point(&cloud.centre(cell).cast::<f64>());
            if p.y < floor || border.is_some_and(|b| b.hides(&p)) {
                return false;
            }
            let (u, v) = (*c as i32 % columns, *c as i32 / columns);
            let empty = |du: i32, dv: i32| {
                let k = cloud.cell(u + du, v + dv);
                k.is_some_and(|k| cloud.depth[k] <= 0.0)
            };
            let outline = empty(-1, 0) || empty(1, 0) || empty(0, -1) || empty(0, 1);
            !(loss && outline && rng.random_bool(settings.outline_loss[1]))
        };
        let mut cells: Vec<u32> = (0..cloud.depth.len() as u32).collect();
        cells.retain(|c| keep(c));
        cells
    }

    /// Class of the rendered surface in a cell at the cell's depth.
    fn label(
        &self,
        scene: &PersonScene<'_>,
        buffer: &VisibilityBuffer,
        owners: &[Owner],
        cloud: &OrganisedCloud,
        cell: usize,
    ) -> u8 {
        let (columns, s) = (cloud.size().0, cloud.stride() as usize);
        let (u, v) = (cell % columns * s, cell / columns * s);
        let z = cloud.depth[cell];
        let (mut best, mut least) = (None, self.settings.same_surface);
        for (du, dv) in [(1, 1), (1, 3), (3, 1), (3, 3), (2, 2)] {
            let (du, dv) = (du * s / 4, dv * s / 4);
            let k = (v + dv) * buffer.width as usize + u + du;
            let off = (buffer.depth[k] - z).abs();
            if off < least {
                (best, least) = (Some(k), off);
            }
        }
        let Some(pixel) = best else {
            return NO_CLASS;
        };
        match owners[pixel] {
            Owner::Other => NOT_PERSON,
            Owner::Worn => self.nearest_class(scene.joints, &cloud.centre(cell)),
            Owner::Body if buffer.face[pixel] == VisibilityBuffer::NONE => NO_CLASS,
            Owner::Body => {
                let face = self.template.mesh().faces()[buffer.face[pixel] as usize];
                self.classes.of_vertex()[face[0] as usize]
            }
        }
    }

    /// Class whose anchor is nearest to a point.
    fn nearest_class(&self, joints: &[P3d], p: &P3) -> u8 {
        let off = |c: &u8| {
            let anchor = self.classes.anchor_of(*c, joints);
            anchor.map_or(f64::INFINITY, |a| (a - p.cast::<f64>()).norm())
        };
        let nearest = (0..NOT_PERSON).min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.unwrap_or(NO_CLASS)
    }
}

/// A posed person before a camera, camera frame, metres; without joints nobody, things alone.
struct PersonScene<'a> {
    view: &'a Viewpoint,
    vertices: &'a [P3],
    joints: &'a [P3d],
    surroundings: &'a Surroundings,
}

impl PersonScene<'_> {
    /// True for a cell so near to the person's axis that segmentation takes it for theirs.
    fn is_joined(&self, cloud: &OrganisedCloud, cell: u32) -> bool {
        let p = cloud.centre(cell as usize).cast::<f64>();
        let p = self.view.world_from_camera.point(&p);
        let [x, z] = self.view.place;
        let off = (p.x - x).hypot(p.z - z);
        off < f64::from(self.surroundings.reach)
    }
}

/// Half-space of the world that furniture hides: points whose product with `normal` is below `offset`.
#[derive(Clone, Copy, Debug)]
struct HiddenSide {
    normal: V3d,
    offset: f64,
}

impl HiddenSide {
    /// A random border, in some frames.
    fn draw(settings: &LabelledSettings, view: &Viewpoint, rng: &mut Pcg64Mcg) -> Option<Self> {
        if !rng.random_bool(settings.hidden) {
            return None;
        }
        if rng.random_bool(settings.tables) {
            let [pelvis, head] = view.heights;
            let [low, high] = settings.table_heights;
            let share = rng.random_range(low..high);
            return Some(Self {
                normal: V3d::y(),
                offset: pelvis + share * (head - pelvis),
            });
        }
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let [near, far] = settings.border_distances;
        let away = rng.random_range(near..far);
        let normal = V3d::x() * side;
        Some(Self {
            normal,
            offset: side * view.place[0] - away,
        })
    }
    fn hides(&self, p: &P3d) -> bool {
        self.normal.dot(&p.coords) < self.offset
    }
}

/// Depth rounded to multiples of a step, millimetres.
fn quantised(image: &DepthImage, step: u16) -> DepthImage {
    let round = |d: &u16| (d.saturating_add(step / 2) / step).saturating_mul(step);
    let data = image.data().iter().map(round).collect();
    // The sizes are those of the image.
    DepthImage::new(image.width(), image.height(), data).unwrap_or_else(|_| image.clone())
}

/// Drops cells of unknown class beside which nothing of a known class is seen: readings between a thing and what is behind.
fn drop_strays(cloud: &OrganisedCloud, cells: &mut Vec<u32>, labels: &mut Vec<u8>) {
    let columns = cloud.size().0 as i32;
    let mut is_known = vec![false; cloud.depth.len()];
    let known = cells
        .iter()
        .zip(labels.iter())
        .filter(|(_, l)| **l != NO_CLASS);
    known.for_each(|(c, _)| is_known[*c as usize] = true);
    let is_beside = |c: u32| {
        let (u, v) = (c as i32 % columns, c as i32 / columns);
        let mut about = (-1..=1).flat_map(|dv| (-1..=1).map(move |du| (u + du, v + dv)));
        about.any(|(u, v)| cloud.cell(u, v).is_some_and(|k| is_known[k]))
    };
    let keep: Vec<bool> = cells.iter().map(|c| is_beside(*c)).collect();
    let mut kept = keep.iter();
    cells.retain(|_| kept.next() == Some(&true));
    let mut kept = keep.iter();
    labels.retain(|_| kept.next() == Some(&true));
}

/// Refines the person's cells and drops those that lose their reading.
fn refine(cloud: &mut OrganisedCloud, image: &DepthImage, cells: &mut Vec<u32>) {
    for &c in cells.iter() {
        cloud.labels[c as usize] = Label::Person;
    }
    cloud.refine(image, cells);
    cells.retain(|c| cloud.depth[*c as usize] > 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    /// Largest distance of a part's skin from its anchor, metres: half a thigh under a wide coat.
    const PART_REACH: f64 = 0.45;

    fn frames(seed: u64) -> LabelledFrames {
        LabelledFrames::new(embedded::template(), seed)
    }

    #[test]
    fn labels_lie_about_their_anchors() {
        let frames = frames(5);
        let (mut cells, mut unknown) = (0, 0);
        let mut seen = [0usize; PART_CLASSES];
        for frame in (0..12).flat_map(|i| frames.person(i)) {
            assert_eq!(frame.cells.len(), frame.labels.len());
            assert!(frame.cells.is_sorted() && frame.cells.len() >= frames.settings.least_cells);
            for (&cell, &label) in frame.cells.iter().zip(&frame.labels) {
                cells += 1;
                if label == NO_CLASS {
                    unknown += 1;
                    continue;
                }
                if label == NOT_PERSON {
                    continue;
                }
                seen[usize::from(label)] += 1;
                let anchor = frames
                    .classes()
                    .anchor_of(label, &frame.joints)
                    .expect("a joint");
                let p = frame.cloud.centre(cell as usize).cast::<f64>();
                let off = (p - anchor).norm();
                assert!(off < PART_REACH, "class {label}: {off}");
            }
        }
        assert!(
            20 * unknown < cells,
            "{unknown} of {cells} cells without a class"
        );
        assert!(seen.iter().all(|n| *n > 0), "{seen:?}");
    }

    #[test]
    fn frames_are_a_function_of_seed_and_number() {
        let look = |seed: u64| {
            let person = frames(seed).person(7);
            let of = |f: LabelledFrame| (f.cells, f.labels, f.cloud.depth, f.joints);
            person.into_iter().map(of).collect::<Vec<_>>()
        };
        assert_eq!(look(1), look(1));
        assert_ne!(look(1), look(2));
    }

    #[test]
    fn coarse_depth_is_a_multiple_of_its_step() {
        let image = DepthImage::new(4, 1, vec![0, 1004, 1006, u16::MAX]).expect("sizes agree");
        assert_eq!(quantised(&image, 12).data()[..3], [0, 1008, 1008]);
        assert_eq!(quantised(&image, 10).data()[1], 1000);
    }
}
