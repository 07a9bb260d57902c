//! The person: the nearest connected thing of the size of a body that is neither floor nor wall.

use super::ScenePlanes;
use super::planes::Bands;
use crate::math::{P3, principal_axes};
use crate::spatial::{Label, OrganisedCloud};
use nalgebra::Vector3;

/// Neighbouring cells connect when their depths differ by less than this (metres) plus [`LINK_SLOPE`] × z.
const LINK: f32 = 0.08;
/// See [`LINK`].
const LINK_SLOPE: f32 = 0.015;
/// Smallest visible area of a body, m²: head and shoulders seen from the front.
const LEAST_AREA: f32 = 0.08;
/// Largest visible area of a body, m²; a big man in a T-pose shows 0.9.
const MOST_AREA: f32 = 1.6;
/// Tallest body with raised arms, and its least visible height, metres.
const HEIGHT: [f32; 2] = [0.35, 2.6];
/// Widest body, arms spread, metres.
const MOST_WIDTH: f32 = 2.2;
/// Parts cut off from the body by its own limbs lie within this depth of its median, metres.
const LIMB_REACH: f32 = 0.9;
/// A part this near in the image (cells) to the body may belong to it.
const PART_GAP: i32 = 2;
/// Parts beside the main one are at most as large as this share of it.
const LARGE_PART: f32 = 1.0;
/// A candidate that hangs on a side of the image over this share of its rows is furniture or a wall.
const SIDE_SHARE: f32 = 0.5;

/// Unless it is a person whom the side of the picture cuts: at least this tall (metres) with the head in the picture,
const CUT_HEIGHT: f32 = 1.0;
/// no deeper than this (metres; a wall or a table seen along its length is),
const CUT_DEPTH: f32 = 0.9;
/// and rounder than a door or a wardrobe: standard deviation from its own plane, metres. A sensor's noise at 3 m is 1 cm,
/// half of a standing person has 5.
const ROUND: f64 = 0.025;

/// A hand shows so many cells at least, fingers taken together, and less than this area, m²: a hand with the wrist is 0.02.
const LEAST_HAND: usize = 2;
/// See [`LEAST_HAND`].
const MOST_HAND: f32 = 0.03;
/// It is at most as far from what is seen of the body as a long arm reaches from the edge of the chest, metres.
const SLEEVE: f32 = 0.80;
/// Between them lie so many cells at least, and this share of them without a reading.
const LEAST_HOLE: i32 = 3;
/// See [`LEAST_HOLE`].
const HOLE_SHARE: f32 = 0.7;
/// So many such things are looked at, and every n-th cell of the body.
const MOST_HANDS: usize = 6;
/// See [`MOST_HANDS`].
const HAND_STEP: usize = 8;

/// Single cells without a reading between cells of the body, as a share of the body's: more and holes mean nothing. A
/// picture of which nine tenths of the pixels are lost has 0.18, whole ones next to none.
const MOST_PORES: f32 = 0.03;
/// Parts of a hand lie within this distance, metres.
const HAND_LENGTH: f32 = 0.15;

/// So many cells on the rim make a thing hang on it.
const HANGING: usize = 3;
/// A thing on a side of the image ranks as if it were this much farther away, metres.
const SIDE_COST: f32 = 4.0;
/// The same for the upper rim; a person close by may reach it.
const TOP_COST: f32 = 2.0;
/// A thing lower than this (metres) is a box or a chair rather than a person, and ranks by [`LOW_COST`] farther away.
const UPRIGHT: f32 = 0.8;
/// See [`UPRIGHT`], metres.
const LOW_COST: f32 = 1.5;

/// Where the person was a moment ago.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Middle of the body, camera frame, metres.
    pub centre: P3,
    /// How far it may have gone, metres.
    pub reach: f32,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PersonSearch {
    /// Row-major cells of the person, ascending; empty when nobody is there.
    pub cells: Vec<u32>,
    /// Part of the person may lie beyond the lower rim of the image.
    pub cut_below: bool,
    /// Middles of small things beside a hole that begins on the person, camera frame, metres: hands beyond sleeves that
    /// give no return.
    pub hands: Vec<P3>,
    /// Cells that were neither floor nor background.
    pub candidates: usize,
    /// How many separate things were looked at.
    pub components: usize,
}

/// Scratch of the search; holds nothing that matters.
#[derive(Clone, Debug, Default)]
pub struct SegmentScratch {
    bands: Bands,
    component: Vec<u32>,
    stack: Vec<u32>,
}

/// One connected thing.
struct Component {
    id: u32,
    cells: usize,
    area: f32,
    lo: P3,
    hi: P3,
    centre: P3,
    side_rows: usize,
    rows: usize,
    top_cells: usize,
}

/// Labels floor, background and the person in a sampled cloud. With a prior the component nearest to it wins;
/// without one, the nearest body-sized thing.
pub fn find_person(
    cloud: &mut OrganisedCloud,
    scene: &ScenePlanes,
    prior: Option<Prior>,
    scratch: &mut SegmentScratch,
) -> PersonSearch {
    let mut out = PersonSearch::default();
    let (columns, rows) = cloud.size();
    let up = scene
        .floor
        .map_or_else(|| Vector3::new(0.0, -1.0, 0.0), |f| f.normal)
        .cast::<f32>();
    scratch.bands.update(scene, cloud);
    out.candidates = classify(cloud, &scratch.bands);
    let mut dark = false;
    if scene.floor.is_none() && scene.background.is_empty() {
        // A picture without floor and wall is one whose background was taken out: nothing means empty.
        let known = cloud.depth.iter().filter(|d| **d > 0.0).count();
        dark = 2 * known < columns * rows;
        if dark {
            for i in 0..columns * rows {
                if cloud.depth[i] == 0.0 {
                    cloud.labels[i] = Label::Background;
                }
            }
        }
    }
    if out.candidates == 0 {
        return out;
    }
    let components = connect(cloud, &up, scratch);
    out.components = components.len();
    let cut = || {
        components
            .iter()
            .filter(|c| prior.is_none() && is_cut(c, cloud, scratch))
            .min_by(nearer)
    };
    let Some(main) = choose(&components, prior).or_else(cut) else {
        return out;
    };
    // The main part, and what its own limbs cut off: parts beside it in the image and near it in depth.
    let mut belongs = vec![false; components.len()];
    belongs[main.id as usize] = true;
    let (depth, mut area) = (main.centre.z, main.area);
    for _ in 0..2 {
        for i in 0..columns * rows {
            let id = scratch.component[i];
            if id == u32::MAX || belongs[id as usize] {
                continue;
            }
            let c = &components[id as usize];
            let limb = (c.centre.z - depth).abs() < LIMB_REACH
                && c.lo.z > main.lo.z - LIMB_REACH
                && c.hi.z < main.hi.z + LIMB_REACH
                && area + c.area < MOST_AREA
                && (c.area <= LARGE_PART * main.area || above_or_below(c, main))
                && (c.side_rows as f32) < SIDE_SHARE * c.rows as f32;
            if limb && touches(cloud, scratch, &belongs, i) {
                belongs[id as usize] = true;
                area += c.area;
            }
        }
    }
    for i in 0..columns * rows {
        let id = scratch.component[i];
        if id != u32::MAX && belongs[id as usize] {
            cloud.labels[i] = Label::Person;
            out.cells.push(i as u32);
        }
    }
    out.hands = hands(&components, cloud, scratch, &belongs, main, dark);
    let bottom = (rows - 1) * columns;
    out.cut_below = out.cells.iter().filter(|&&c| c as usize >= bottom).count() >= 2;
    out
}

/// Labels every reading as floor, background or something else; returns how many are something else.
fn classify(cloud: &mut OrganisedCloud, bands: &Bands) -> usize {
    let n = cloud.depth.len();
    let mut candidates = 0;
    for i in 0..n {
        let z = cloud.depth[i];
        if z <= 0.0 {
            continue;
        }
        let inside = |band: Option<&[f32; 2]>| band.is_some_and(|[lo, hi]| z > *lo && z < *hi);
        cloud.labels[i] = if inside(bands.floor.get(i)) {
            Label::Floor
        } else if bands.background.iter().any(|b| inside(b.get(i))) {
            Label::Background
        } else {
            candidates += 1;
            Label::Other
        };
    }
    candidates
}

/// Connected components of [`Label::Other`] cells.
fn connect(
    cloud: &OrganisedCloud,
    up: &Vector3<f32>,
    scratch: &mut SegmentScratch,
) -> Vec<Component> {
    let (columns, rows) = cloud.size();
    let focal = cloud.focal();
    scratch.component.clear();
    scratch.component.resize(columns * rows, u32::MAX);
    let right = up.cross(&Vector3::z());
    let mut components: Vec<Component> = Vec::new();
    for seed in 0..columns * rows {
        if cloud.labels[seed] != Label::Other || scratch.component[seed] != u32::MAX {
            continue;
        }
        let id = components.len() as u32;
        let mut c = Component {
            id,
            cells: 0,
            area: 0.0,
            lo: P3::new(f32::MAX, f32::MAX, f32::MAX),
            hi: P3::new(f32::MIN, f32::MIN, f32::MIN),
            centre: P3::origin(),
            side_rows: 0,
            rows: 0,
            top_cells: 0,
        };
        let (mut first_row, mut last_row) = (rows, 0);
        scratch.component[seed] = id;
        scratch.stack.push(seed as u32);
        while let Some(i) = scratch.stack.pop() {
            let i = i as usize;
            let (u, v) = (i % columns, i / columns);
            let (p, z) = (cloud.centre(i), cloud.depth[i]);
            let q = P3::new(right.dot(&p.coords), up.dot(&p.coords), z);
            (c.lo, c.hi) = (c.lo.inf(&q), c.hi.sup(&q));
            c.centre += p.coords;
            c.cells += 1;
            c.area += z * z / (focal[0] * focal[1]);
            c.side_rows += usize::from(u == 0 || u + 1 == columns);
            c.top_cells += usize::from(v == 0);
            (first_row, last_row) = (first_row.min(v), last_row.max(v));
            let link = LINK + LINK_SLOPE * z;
            for (du, dv) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                let Some(k) = cloud.cell(u as i32 + du, v as i32 + dv) else {
                    continue;
                };
                let open = cloud.labels[k] == Label::Other && scratch.component[k] == u32::MAX;
                if open && (cloud.depth[k] - z).abs() < link {
                    scratch.component[k] = id;
                    scratch.stack.push(k as u32);
                }
            }
        }
        c.centre = P3::from(c.centre.coords / c.cells as f32);
        c.rows = last_row + 1 - first_row;
        components.push(c);
    }
    components
}

fn choose(components: &[Component], prior: Option<Prior>) -> Option<&Component> {
    let sized = |c: &&Component| {
        let size = c.hi - c.lo;
        (LEAST_AREA..MOST_AREA).contains(&c.area)
            && (HEIGHT[0]..HEIGHT[1]).contains(&size.y)
            && size.x < MOST_WIDTH
            && (c.side_rows as f32) < SIDE_SHARE * c.rows as f32
    };
    if let Some(prior) = prior {
        let off = |c: &Component| (c.centre - prior.centre).norm();
        // Enough of it must be left to call it the person; half hidden is fine, a hand alone is not.
        return components
            .iter()
            .filter(|c| c.area > 0.3 * LEAST_AREA && c.area < MOST_AREA && off(c) < prior.reach)
            .max_by(|a, b| a.area.total_cmp(&b.area).then(b.id.cmp(&a.id)));
    }
    // What hangs on a side or on the top is more likely a wall, a door or a shelf, unless nothing else is there.
    let rank = |c: &Component| {
        let side = if c.side_rows > HANGING {
            SIDE_COST
        } else {
            0.0
        };
        let top = if c.top_cells > HANGING { TOP_COST } else { 0.0 };
        let low = if c.hi.y - c.lo.y < UPRIGHT {
            LOW_COST
        } else {
            0.0
        };
        c.centre.z + side + top + low
    };
    components
        .iter()
        .filter(sized)
        .min_by(|a, b| rank(a).total_cmp(&rank(b)).then(a.id.cmp(&b.id)))
}

/// Hands beyond sleeves that give no return: small things at the end of a hole that begins on the person. Their middles,
/// camera frame.
fn hands(
    components: &[Component],
    cloud: &OrganisedCloud,
    scratch: &SegmentScratch,
    belongs: &[bool],
    main: &Component,
    dark: bool,
) -> Vec<P3> {
    let depth = main.centre.z;
    let small = |c: &&Component| {
        // In the dark all around the person is a hole: there a hand must be well apart.
        c.id != main.id
            && !(dark && belongs[c.id as usize])
            && c.area < MOST_HAND
            && (c.centre.z - depth).abs() < SLEEVE
            && c.side_rows <= HANGING
            && c.top_cells <= HANGING
    };
    // Fingers are things of their own.
    let mut groups: Vec<(usize, Vector3<f32>, Vec<u32>)> = Vec::new();
    for c in components.iter().filter(small) {
        let near = |g: &&mut (usize, Vector3<f32>, Vec<u32>)| {
            (g.1 / g.0 as f32 - c.centre.coords).norm() < HAND_LENGTH
        };
        match groups.iter_mut().find(near) {
            Some(g) => {
                g.0 += c.cells;
                g.1 += c.centre.coords * c.cells as f32;
                g.2.push(c.id);
            }
            None => groups.push((c.cells, c.centre.coords * c.cells as f32, vec![c.id])),
        }
    }
    groups.retain(|g| g.0 >= LEAST_HAND);
    groups.truncate(MOST_HANDS);
    if groups.is_empty() {
        return Vec::new();
    }
    let columns = cloud.size().0;
    // A hand that hangs beside the hip counts as a part of the body already.
    let part = |id: u32| {
        id != u32::MAX && belongs[id as usize] && components[id as usize].area >= MOST_HAND
    };
    let own = |i: &usize| part(scratch.component[*i]);
    let body: Vec<usize> = (0..scratch.component.len())
        .filter(own)
        .step_by(HAND_STEP)
        .collect();
    // A picture full of pores is a bad picture, not one of sleeves.
    let inside = |i: usize, step: usize| {
        i >= step && i + step < cloud.depth.len() && own(&(i - step)) && own(&(i + step))
    };
    let pore = |i: &usize| cloud.depth[*i] <= 0.0 && (inside(*i, 1) || inside(*i, columns));
    let pores = (0..cloud.depth.len()).filter(pore).count();
    if pores as f32 > MOST_PORES * (HAND_STEP * body.len()) as f32 {
        return Vec::new();
    }
    let joined = |(cells, sum, ids): (usize, Vector3<f32>, Vec<u32>)| {
        let centre = P3::from(sum / cells as f32);
        let (u, v) = cloud.cell_of(&centre)?;
        let hole = |&k: &usize| {
            if (cloud.centre(k) - centre).norm() > SLEEVE {
                return false;
            }
            let (du, dv) = ((k % columns) as i32 - u, (k / columns) as i32 - v);
            let steps = du.abs().max(dv.abs());
            let (mut empty, mut between) = (0, 0);
            for s in 1..steps {
                let Some(at) = cloud.cell(u + du * s / steps, v + dv * s / steps) else {
                    return false;
                };
                let id = scratch.component[at];
                if ids.contains(&id) || part(id) {
                    continue;
                }
                between += 1;
                empty += i32::from(cloud.depth[at] <= 0.0);
            }
            between >= LEAST_HOLE && empty as f32 >= HOLE_SHARE * between as f32
        };
        body.iter().any(hole).then_some(centre)
    };
    groups.into_iter().filter_map(joined).collect()
}

/// The nearer of two things, for [`Iterator::min_by`].
fn nearer(a: &&Component, b: &&Component) -> std::cmp::Ordering {
    a.centre.z.total_cmp(&b.centre.z).then(a.id.cmp(&b.id))
}

/// A thing that hangs on a side of the image over most of its rows, and yet looks like a part of a person.
fn is_cut(c: &Component, cloud: &OrganisedCloud, scratch: &SegmentScratch) -> bool {
    let size = c.hi - c.lo;
    let fits = (LEAST_AREA..MOST_AREA).contains(&c.area)
        && (CUT_HEIGHT..HEIGHT[1]).contains(&size.y)
        && size.x < MOST_WIDTH
        && size.z < CUT_DEPTH
        && c.top_cells <= HANGING;
    let points = || {
        let own = scratch
            .component
            .iter()
            .enumerate()
            .filter(|(_, id)| **id == c.id);
        own.map(|(i, _)| cloud.centre(i)).collect::<Vec<P3>>()
    };
    fits && principal_axes(&points()).is_some_and(|(_, _, variance)| variance[2].sqrt() > ROUND)
}

/// A part of the same column: an arm across the body cuts it into an upper and a lower part, of which either may be the
/// larger.
fn above_or_below(c: &Component, main: &Component) -> bool {
    let overlap = c.hi.x.min(main.hi.x) - c.lo.x.max(main.lo.x);
    overlap > 0.5 * (c.hi.x - c.lo.x) && c.hi.x - c.lo.x < MOST_WIDTH * 0.5
}

fn touches(
    cloud: &OrganisedCloud,
    scratch: &SegmentScratch,
    belongs: &[bool],
    cell: usize,
) -> bool {
    let columns = cloud.size().0;
    let (u, v) = ((cell % columns) as i32, (cell / columns) as i32);
    (-PART_GAP..=PART_GAP).any(|dv| {
        (-PART_GAP..=PART_GAP).any(|du| {
            cloud.cell(u + du, v + dv).is_some_and(|k| {
                let id = scratch.component[k];
                id != u32::MAX && belongs[id as usize]
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::planes::tests::room;
    use super::super::{ScenePlanes, find_planes};
    use super::*;

    #[test]
    fn the_box_is_the_person_and_the_room_is_not() {
        let (mut cloud, _) = room(0.1, true);
        let scene = find_planes(&cloud);
        let found = find_person(&mut cloud, &scene, None, &mut SegmentScratch::default());
        // 0.4 × 1.7 m at 2.5 m with a focal length of 131 cells, less 20 mm of floor.
        let expected = 0.4 * 1.68 * (131.25f32 / 2.5).powi(2);
        assert!(
            (found.cells.len() as f32 / expected - 1.0).abs() < 0.1,
            "{} of {expected}",
            found.cells.len()
        );
        assert!(!found.cut_below);
        let prior = Prior {
            centre: P3::new(0.0, 0.2, 2.5),
            reach: 0.5,
        };
        cloud.labels.fill(Label::Unknown);
        let again = find_person(
            &mut cloud,
            &scene,
            Some(prior),
            &mut SegmentScratch::default(),
        );
        assert_eq!(again.cells, found.cells);
    }

    /// Half a figure at the right rim at 2 m, 1.5 m tall: a half cylinder of 0.3 m, or a board that is turned by 30°.
    fn at_the_rim(round: bool) -> OrganisedCloud {
        use crate::camera::{DepthImage, Intrinsics};
        let k = Intrinsics {
            width: 320,
            height: 240,
            fx: 262.5,
            fy: 262.5,
            cx: 159.5,
            cy: 119.5,
        };
        let edge = 160.5 / 262.5 * 2.0;
        let data = (0..k.pixels()).map(|i| {
            let (x, y) = (
                ((i % 320) as f64 - k.cx) / k.fx * 2.0,
                ((i / 320) as f64 - k.cy) / k.fy * 2.0,
            );
            let across = edge - x;
            if across > 0.3 || y.abs() > 0.75 {
                return 0;
            }
            let z = if round {
                2.0 - (0.09 - across * across).max(0.0).sqrt()
            } else {
                2.0 + 0.58 * across
            };
            (z * 1000.0) as u16
        });
        let image = DepthImage::new(320, 240, data.collect()).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(2));
        cloud.sample(&image, 8.0);
        cloud
    }

    #[test]
    fn half_a_person_at_the_rim_is_found_and_half_a_door_is_not() {
        let mut scratch = SegmentScratch::default();
        let found = find_person(
            &mut at_the_rim(true),
            &ScenePlanes::default(),
            None,
            &mut scratch,
        );
        assert!(found.cells.len() > 500, "{} cells", found.cells.len());
        let door = find_person(
            &mut at_the_rim(false),
            &ScenePlanes::default(),
            None,
            &mut scratch,
        );
        assert!(
            door.cells.is_empty() && door.components == 1,
            "{} cells",
            door.cells.len()
        );
    }

    /// A box of 0.4 × 1.4 m at 2 m before a wall at 4 m, a hand of 6 × 10 cm half a metre to its right, and between them
    /// `hole` or the wall.
    fn sleeve(hole: bool) -> OrganisedCloud {
        use crate::camera::{DepthImage, Intrinsics};
        let k = Intrinsics {
            width: 320,
            height: 240,
            fx: 262.5,
            fy: 262.5,
            cx: 159.5,
            cy: 119.5,
        };
        let data = (0..k.pixels()).map(|i| {
            let (x, y) = (
                ((i % 320) as f64 - k.cx) / k.fx * 2.0,
                ((i / 320) as f64 - k.cy) / k.fy * 2.0,
            );
            let body = x.abs() < 0.2 && y.abs() < 0.7;
            let hand = (0.7..0.76).contains(&x) && y.abs() < 0.05;
            let arm = (0.2..0.7).contains(&x) && y.abs() < 0.05;
            if body || hand {
                2000
            } else if arm && hole {
                0
            } else {
                4000
            }
        });
        let image = DepthImage::new(320, 240, data.collect()).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(2));
        cloud.sample(&image, 8.0);
        cloud
    }

    #[test]
    fn a_hand_at_the_end_of_a_hole_is_told() {
        for hole in [true, false] {
            let mut cloud = sleeve(hole);
            let scene = find_planes(&cloud);
            let found = find_person(&mut cloud, &scene, None, &mut SegmentScratch::default());
            assert!(
                !found.cells.is_empty() && found.hands.len() == usize::from(hole),
                "{hole}: {:?}",
                found.hands
            );
            for hand in found.hands {
                assert!((hand - P3::new(0.73, 0.0, 2.0)).norm() < 0.02, "{hand}");
            }
        }
    }

    #[test]
    fn an_empty_room_and_an_empty_image_hold_nobody() {
        let (mut cloud, _) = room(0.0, false);
        let scene = find_planes(&cloud);
        let mut scratch = SegmentScratch::default();
        assert!(
            find_person(&mut cloud, &scene, None, &mut scratch)
                .cells
                .is_empty()
        );
        cloud.depth.fill(0.0);
        assert!(
            find_person(&mut cloud, &ScenePlanes::default(), None, &mut scratch)
                .cells
                .is_empty()
        );
    }
}
