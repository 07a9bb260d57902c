//! Bare hands and forearms in front of a garment that hangs loosely before them.
//!
//! A hand on the hip presses the shirt; the simulated shirt knows nothing of it and hangs a few centimetres in front.
//! Depth cannot tell (a hand flat on the body is as thick as the tracker's error), colour can: what is connected, near
//! the tracked hand in space, and of the colour of this shopper's forearms is the hand.

use super::framing::Stage;
use super::limbs::{Bones, Limbs};
use super::occlusion::{noise, says};
use super::skin::{Skin, Source, State, tone};
use super::surface::{Area, NEAR};
use crate::camera::ColorImage;
use crate::math::P3;

/// What was done about the arms, for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HandReport {
    /// Arms near a garment whose colour was looked at.
    pub looked: usize,
    /// Arms that no garment is near, or that are covered, skipped.
    pub skipped: usize,
    /// Colour told skin from clothes.
    pub known: bool,
    /// Pixels decided for an arm.
    pub pixels: usize,
}

/// Picture and depth, as one of them sees both.
pub(super) struct Seen<'a> {
    pub(super) stage: &'a Stage,
    /// The captured picture at the output's size.
    pub(super) image: &'a ColorImage,
    /// Captured depth, millimetres, shape `stage.depth`.
    pub(super) depth: &'a [u16],
}

/// Posed body in the picture's camera.
pub(super) struct Body<'a> {
    pub(super) limbs: &'a Limbs,
    pub(super) vertices: &'a [P3],
}

/// A captured point is on the tracked limb when depths differ by less, metres: tracked limbs are right to 3 cm.
const FIT: f32 = 0.03;
/// The same for clothes on the trunk, which hang loosely.
const LOOSE_FIT: f32 = 0.06;
/// Nearer to an arm's bones nothing counts as trunk, metres.
const CLEAR_OF_ARM: f32 = 0.09;

impl Seen<'_> {
    /// Captured depth at a pixel, metres; 0 = none.
    fn metres(&self, u: u32, v: u32) -> f32 {
        match (self.stage.depth_at(0, u), self.stage.depth_at(1, v)) {
            (Some(x), Some(y)) => {
                f32::from(self.depth[(y * self.stage.depth[0] + x) as usize]) * 1e-3
            }
            _ => 0.0,
        }
    }
    /// Colour where the body's surface is captured at `p`, not at an outline.
    fn color(&self, p: &P3, fit: f32) -> Option<[u8; 3]> {
        if p.z.is_nan() || p.z <= NEAR {
            return None;
        }
        let q = self.stage.camera.project(p);
        let away = (2.0 * self.stage.pixels_per_depth()) as f32;
        let inside = |x: f32, side: u32| x >= away && x + away + 1.0 < side as f32;
        if !inside(q.x, self.image.width()) || !inside(q.y, self.image.height()) {
            return None;
        }
        let fits = |dx: f32, dy: f32| {
            let z = self.metres(
                (q.x + dx * away + 0.5) as u32,
                (q.y + dy * away + 0.5) as u32,
            );
            z > 0.0 && (z - p.z).abs() < fit + noise(z)
        };
        let all = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
            .iter()
            .all(|&(x, y)| fits(x, y));
        all.then(|| self.image.at((q.x + 0.5) as u32, (q.y + 0.5) as u32))
    }
}

/// Takes this picture's colours and makes a model of them.
fn learn(
    state: &mut State,
    seen: &Seen<'_>,
    body: &Body<'_>,
    bones: &[Option<Bones>; 2],
) -> Option<Skin> {
    let mut put = |source: Source, vertices: &[u32], fit: f32| {
        let due: Vec<(usize, u32)> = state.due(source, vertices).collect();
        for (slot, v) in due {
            let p = &body.vertices[v as usize];
            let by_arm = || {
                bones
                    .iter()
                    .flatten()
                    .any(|b| b.place(p).away < CLEAR_OF_ARM)
            };
            if source == Source::Trunk && by_arm() {
                continue;
            }
            if let Some(rgb) = seen.color(p, fit) {
                state.put(source, slot, rgb);
            }
        }
    };
    let both = |part: fn(&super::limbs::Arm) -> &Vec<u32>| -> Vec<u32> {
        body.limbs
            .arms
            .iter()
            .flat_map(|a| part(a).iter().copied())
            .collect()
    };
    put(Source::Forearm, &both(|a| &a.forearm), FIT);
    put(Source::Hand, &both(|a| &a.hand), FIT);
    put(Source::Face, &body.limbs.face, FIT);
    put(Source::Trunk, &body.limbs.trunk, LOOSE_FIT);
    state.learn()
}

/// How far from the tracked forearm's bone its skin may be, metres: half its width, and the tracker's error.
const FOREARM: f32 = 0.07;
/// How far from the tracked wrist the hand's skin may be, metres: a hand's length. Where the hand points is often tracked
/// wrongly: on a real hand on a hip half of it was 8 cm and more from the tracked one's bone, its wrist 2 cm.
const HAND: f32 = 0.21;
/// What is this near is surely the limb if it has its colour, metres.
const SURE: f32 = 0.045;
/// The part of the forearm next to the elbow is left to depth: a sleeve may end there. Share of the forearm.
const ELBOW: f32 = 0.15;
/// Neighbours on one surface differ in depth by less, metres a pixel of depth, on top of the noise.
const STEP: f32 = 0.015;
/// Side of a cell that is decided as one, metres.
const CELL: f32 = 0.004;
/// A cloth that hangs farther than this in front of a hand is really in front of it (a wide skirt), metres. The shirt
/// hangs up to 10 cm in front of the real hand on a hip, since it falls straight over the waist.
const LOOSE: f32 = 0.12;
/// Skin that lies this far behind the tracked trunk is no hand on it, metres.
const BEHIND: f32 = 0.03;
/// When this share of a region's skin lies at the end of the reach, the colour has leaked into clothes.
const LEAK: f32 = 0.2;
/// The end of the reach: the outermost share of it.
const END: f32 = 0.88;
/// Smaller regions are no hand, square metres.
const SMALLEST: f32 = 4e-4;

const NO: u8 = 0;
const SKIN: u8 = 1;
const SURELY: u8 = 2;
const TAKEN: u8 = 3;

/// Scratch of [`Hands::mark`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Hands {
    cells: Vec<u8>,
    depth: Vec<f32>,
    far: Vec<bool>,
    stack: Vec<u32>,
    region: Vec<u32>,
}

/// What a pixel of the drawn area knows about garment and trunk: depths in metres, infinity = none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Behind {
    pub(super) garment: f32,
    pub(super) trunk: f32,
}

/// An arm, and from where on it is bare.
#[derive(Clone, Copy, Debug)]
struct Bare {
    bones: Bones,
    bare: f32,
}

/// Cells of a part of the drawn area.
#[derive(Clone, Copy, Debug)]
struct Grid {
    /// First column and row, within the area, pixels.
    from: [usize; 2],
    /// Cells.
    size: [usize; 2],
    /// Pixels a side of a cell.
    step: usize,
    /// Square metres of a cell.
    cell: f32,
}

impl Hands {
    /// Marks in `marks` (shape `[area]`) what is a bare arm in front of its garment.
    #[allow(clippy::too_many_arguments)] // one call
    pub(super) fn mark(
        &mut self,
        state: &mut State,
        seen: &Seen<'_>,
        body: &Body<'_>,
        garments: &[P3],
        area: &Area,
        marks: &mut [u8],
        behind: impl Fn(usize, usize) -> Behind,
    ) -> HandReport {
        let mut report = HandReport::default();
        if !body.limbs.fit(body.vertices.len()) {
            return report;
        }
        let bones = body.limbs.arms.each_ref().map(|a| a.bones(body.vertices));
        let width = area.width as usize;
        let grids = bones.map(|b| {
            let grid = Grid::around(&b?, seen.stage, area)?;
            grid.pixels()
                .any(|(x, y)| marks[y * width + x] != says::OUTSIDE)
                .then_some(grid)
        });
        report.skipped = grids.iter().filter(|g| g.is_none()).count();
        if report.skipped == grids.len() {
            return report;
        }
        report.looked = grids.len() - report.skipped;
        let Some(skin) = learn(state, seen, body, &bones) else {
            return report;
        };
        report.known = true;
        let arms = bones.map(|b| {
            b.map(|bones| Bare {
                bones,
                bare: bones.bare_from(garments).max(ELBOW),
            })
        });
        for (side, grid) in grids.iter().enumerate() {
            let (Some(grid), Some(arm), other) = (grid, &arms[side], &arms[1 - side]) else {
                continue;
            };
            self.look(grid, arm, other, &skin, seen, area);
            let pixels = self.take(grid, width, seen, marks, &behind);
            report.pixels += pixels;
            if pixels > 0 {
                fill(grid, width, &skin, seen.image, area, marks);
            }
        }
        report
    }

    /// Which cells are skin that may belong to the arm.
    fn look(
        &mut self,
        grid: &Grid,
        arm: &Bare,
        other: &Option<Bare>,
        skin: &Skin,
        seen: &Seen<'_>,
        area: &Area,
    ) {
        let bones = &arm.bones;
        let n = grid.size[0] * grid.size[1];
        self.cells.clear();
        self.depth.clear();
        self.far.clear();
        self.cells.resize(n, NO);
        self.depth.resize(n, 0.0);
        self.far.resize(n, false);
        let nearest = (bones.elbow.z - FOREARM)
            .min(bones.wrist.z - HAND)
            .max(NEAR);
        let farthest = (bones.elbow.z + FOREARM).max(bones.wrist.z + HAND);
        for (i, (x, y)) in grid.pixels().enumerate() {
            let (u, v) = (area.left + x as u32, area.top + y as u32);
            let z = seen.metres(u, v);
            if z < nearest || z > farthest {
                continue;
            }
            let p = seen.stage.camera.unproject(u as f32, v as f32, z);
            let place = bones.place(&p);
            // Shares of the reach.
            let out = (place.away / FOREARM).min((p - bones.wrist).norm() / HAND);
            if place.along < arm.bare || out > 1.0 || !skin.likes(&tone(seen.image.at(u, v))) {
                continue;
            }
            // Skin under the other arm's sleeve stays there.
            let sleeved = other.is_some_and(|o| {
                let at = o.bones.place(&p);
                at.along < o.bare && at.away < place.away
            });
            if sleeved {
                continue;
            }
            self.depth[i] = z;
            self.far[i] = out > END;
            self.cells[i] = if place.away < SURE { SURELY } else { SKIN };
        }
    }

    /// Grows regions from what is surely the arm, and marks those that do not leak.
    fn take(
        &mut self,
        grid: &Grid,
        width: usize,
        seen: &Seen<'_>,
        marks: &mut [u8],
        behind: &impl Fn(usize, usize) -> Behind,
    ) -> usize {
        let across = grid.size[0];
        let per_cell = (grid.step as f64 / seen.stage.pixels_per_depth()).max(1.0) as f32;
        let smallest = (SMALLEST / grid.cell).ceil() as usize;
        let mut taken = 0;
        for seed in 0..self.cells.len() {
            if self.cells[seed] != SURELY {
                continue;
            }
            self.region.clear();
            self.stack.clear();
            self.stack.push(seed as u32);
            self.cells[seed] = TAKEN;
            let mut far = 0;
            while let Some(i) = self.stack.pop() {
                self.region.push(i);
                let i = i as usize;
                far += usize::from(self.far[i]);
                let z = self.depth[i];
                let beside = [
                    (!i.is_multiple_of(across)).then(|| i - 1),
                    (i % across + 1 < across).then(|| i + 1),
                    i.checked_sub(across),
                    (i + across < self.cells.len()).then(|| i + across),
                ];
                for j in beside.into_iter().flatten() {
                    let joined = (self.depth[j] - z).abs() < STEP * per_cell + noise(z);
                    if matches!(self.cells[j], SKIN | SURELY) && joined {
                        self.cells[j] = TAKEN;
                        self.stack.push(j as u32);
                    }
                }
            }
            if self.region.len() < smallest || far as f32 > LEAK * self.region.len() as f32 {
                continue;
            }
            // One word for all of it: single pixels would come and go with the noise.
            let (mut covered, mut front) = (0, 0);
            for &i in &self.region {
                let (x, y) = grid.pixel(i as usize);
                if marks[y * width + x] != says::OUTSIDE {
                    let (b, z) = (behind(x, y), self.depth[i as usize]);
                    covered += 1;
                    front += i32::from(z - b.garment < LOOSE && z < b.trunk + BEHIND);
                }
            }
            if 2 * front < covered {
                continue;
            }
            for (x, y) in self
                .region
                .iter()
                .flat_map(|&i| grid.cell_pixels(i as usize))
            {
                let mark = &mut marks[y * width + x];
                if *mark != says::OUTSIDE {
                    *mark = says::LIMB;
                    taken += 1;
                }
            }
        }
        taken
    }
}

/// Beside a hand the depth sensor is blind: what is not skin there is no hand.
fn fill(grid: &Grid, width: usize, skin: &Skin, image: &ColorImage, area: &Area, marks: &mut [u8]) {
    for (x, y) in (0..grid.size[0] * grid.size[1]).flat_map(|i| grid.cell_pixels(i)) {
        let mark = &mut marks[y * width + x];
        if *mark == says::UNKNOWN
            && !skin.likes(&tone(image.at(area.left + x as u32, area.top + y as u32)))
        {
            *mark = says::GARMENT;
        }
    }
}

impl Grid {
    /// Around forearm and hand as far as the reach goes; `None` outside the area.
    fn around(bones: &Bones, stage: &Stage, area: &Area) -> Option<Self> {
        let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let c = &stage.camera;
        for (p, reach) in [(bones.elbow, FOREARM), (bones.wrist, HAND)] {
            if p.z < 2.0 * reach {
                return None;
            }
            let q = c.project(&p);
            let r = [reach * c.fx as f32 / p.z, reach * c.fy as f32 / p.z];
            for k in 0..2 {
                lo[k] = lo[k].min(q[k] - r[k]);
                hi[k] = hi[k].max(q[k] + r[k]);
            }
        }
        let (start, side) = ([area.left, area.top], [area.width, area.height]);
        let clip = |x: f32, k: usize| (x - start[k] as f32).clamp(0.0, side[k] as f32) as usize;
        let pixel = [bones.wrist.z / c.fx as f32, bones.wrist.z / c.fy as f32];
        let step = ((CELL / pixel[0]).round() as usize).max(1);
        let from = [0, 1].map(|k| clip(lo[k], k));
        let size = [0, 1].map(|k| (clip(hi[k], k) - from[k]) / step);
        let cell = pixel[0] * pixel[1] * (step * step) as f32;
        (size[0] > 0 && size[1] > 0).then_some(Self {
            from,
            size,
            step,
            cell,
        })
    }

    /// The pixel that stands for a cell.
    #[inline]
    fn pixel(&self, cell: usize) -> (usize, usize) {
        let at = |k: usize, i: usize| self.from[k] + i * self.step + self.step / 2;
        (at(0, cell % self.size[0]), at(1, cell / self.size[0]))
    }

    /// The pixel that stands for each cell, row by row.
    fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let grid = *self;
        (0..grid.size[0] * grid.size[1]).map(move |i| grid.pixel(i))
    }

    /// All pixels of a cell.
    fn cell_pixels(&self, cell: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (x, y) = (
            cell % self.size[0] * self.step + self.from[0],
            cell / self.size[0] * self.step + self.from[1],
        );
        let step = self.step;
        (0..step * step).map(move |k| (x + k % step, y + k / step))
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{SKIN, Scenery};
    use super::super::{BodyView, Input, Model, RenderReport, Workspace, render};
    use super::*;

    const RED: [u8; 3] = [150, 30, 40];

    /// With the limbs of `s`, others, or no body at all.
    fn draw(s: &Scenery, state: &mut State, limbs: Option<&Limbs>) -> (ColorImage, RenderReport) {
        let garments = [s.garment()];
        let body = limbs.map(|limbs| BodyView {
            limbs,
            ..s.body_view()
        });
        let input = Input {
            body,
            ..s.input(&garments, None)
        };
        render(&Model::default(), state, &input, &mut Workspace::default()).expect("drawn")
    }

    #[test]
    fn a_flat_hand_is_in_front_of_a_loose_shirt() {
        for (own, light) in [
            (RED, 1.0),
            (RED, 0.3),
            ([40, 60, 120], 1.0),
            ([200, 200, 205], 0.5),
            ([25, 25, 27], 1.0),
        ] {
            let s = Scenery::resting(5, own, SKIN, light);
            let (image, report) = draw(&s, &mut State::default(), Some(&s.limbs));
            let [arm, shirt] = s.mistakes(&image, 2);
            assert!(
                report.hands.known && report.hands.pixels > 800,
                "{own:?} {light}: {report:?}"
            );
            assert!(
                arm < 0.02 && shirt < 0.002,
                "{own:?} {light}: arm {arm}, shirt {shirt}"
            );
            // Without the body's parts it is painted over, or this proves nothing.
            let none = Limbs::default();
            let (image, report) = draw(&s, &mut State::default(), Some(&none));
            assert!(s.mistakes(&image, 2)[0] > 0.5 && report.hands == HandReport::default());
        }
    }

    #[test]
    fn where_colour_cannot_tell_nothing_changes() {
        let cases = [
            ("own sleeve", RED, RED),
            ("other sleeve", RED, [60, 70, 120]),
            ("skin-coloured", SKIN, SKIN),
        ];
        for (name, own, sleeve) in cases {
            let s = Scenery::resting(6, own, sleeve, 1.0);
            let (image, report) = draw(&s, &mut State::default(), Some(&s.limbs));
            assert!(
                !report.hands.known && report.hands.looked == 1,
                "{name}: {report:?}"
            );
            let none = Limbs::default();
            let before = draw(&s, &mut State::default(), Some(&none));
            assert!(image == before.0, "{name}");
        }
    }

    #[test]
    fn without_colour_body_or_numbers_nothing_is_looked_at() {
        let mut s = Scenery::resting(7, RED, SKIN, 1.0);
        let mut state = State::default();
        draw(&s, &mut state, Some(&s.limbs));
        assert_ne!(state, State::default());
        let (_, report) = draw(&s, &mut state, None);
        assert_eq!(
            (report.hands, state),
            (HandReport::default(), State::default())
        );
        let first = s.limbs.arms[0].hand[0] as usize;
        s.body.0[first].x = f32::NAN;
        let (_, report) = draw(&s, &mut State::default(), Some(&s.limbs));
        assert_eq!((report.hands.looked, report.hands.skipped), (0, 2));
        s.frame.color = None;
        let (_, report) = draw(&s, &mut State::default(), Some(&s.limbs));
        assert_eq!(report.hands, HandReport::default());
    }

    #[test]
    fn decisions_are_steady_from_picture_to_picture() {
        let mut state = State::default();
        let mut last: Option<Vec<bool>> = None;
        for seed in 20..26 {
            let s = Scenery::resting(seed, RED, SKIN, 1.0);
            let (image, report) = draw(&s, &mut state, Some(&s.limbs));
            assert!(report.hands.known);
            let captured = s.frame.color.as_ref().expect("colour");
            let open: Vec<bool> = image
                .data()
                .chunks(3)
                .zip(captured.data().chunks(3))
                .map(|(a, b)| a == b)
                .collect();
            let arm: Vec<usize> = (0..open.len())
                .filter(|&i| s.arm[i] && s.shirt_seen[i])
                .collect();
            if let Some(last) = last.replace(open.clone()) {
                let flips = arm.iter().filter(|&&i| last[i] != open[i]).count();
                assert!(flips * 20 < arm.len(), "{flips} of {}", arm.len());
            }
        }
    }

    #[test]
    fn a_long_sleeve_of_the_garment_hides_the_forearm() {
        let s = Scenery::resting(8, RED, SKIN, 1.0);
        let bones = s.limbs.arms[0].bones(&s.body.0).expect("bones");
        assert_eq!(bones.bare_from(&s.shirt.0), 0.0);
        // A tube around the forearm down to six tenths of it.
        let axis = bones.wrist - bones.elbow;
        let side = axis.cross(&crate::math::V3::z()).normalize();
        let other = axis.cross(&side).normalize();
        let sleeve: Vec<P3> = (0..160)
            .map(|k| {
                let a = 0.7 * k as f32;
                bones.elbow
                    + axis * (k as f32 / 160.0 * 0.58)
                    + (side * a.cos() + other * a.sin()) * 0.06
            })
            .collect();
        assert_eq!(bones.bare_from(&sleeve), 0.6);
    }

    #[test]
    fn places_on_the_arm() {
        let at = |x: f32| P3::new(x, 0.0, 2.0);
        let bones = Bones {
            elbow: at(0.0),
            wrist: at(0.25),
            tip: at(0.45),
        };
        let place = bones.place(&P3::new(0.125, 0.03, 2.0));
        assert!((place.along - 0.5).abs() < 1e-6 && (place.away - 0.03).abs() < 1e-6);
        let place = bones.place(&P3::new(0.35, 0.0, 2.04));
        assert!((place.along - 1.5).abs() < 1e-5 && (place.away - 0.04).abs() < 1e-6);
        assert!((bones.place(&at(0.55)).away - 0.1).abs() < 1e-6);
    }
}
