//! The person: the nearest connected component of the size of a body that is neither floor nor background.

use super::ScenePlanes;
use super::components::{Component, ComponentMap, RIM_CELLS};
use super::expected_body::{ExpectedBody, drop_others};
use super::hands::{BodyComponents, find_hands};
use super::plane_bands::PlaneBands;
use super::refusals::{CandidateBox, Refusal, Refusals};
use crate::settings::{PersonSettings, SegmentSettings};
use nalgebra::Vector3;
use tryon_geometry::math::P3;
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Selection among the components of the size of a body.
#[derive(Clone, Copy, Debug)]
pub enum PersonChoice<'a> {
    /// The most likely one.
    First,
    /// The one that covers most of a predicted body, or the largest one near its place.
    Near(PersonPrior<'a>),
    /// The most likely one among those least often refused.
    Untried {
        /// Candidates that were nobody.
        refusals: &'a Refusals,
        /// Place of a person lost a moment ago; nobody elsewhere is taken.
        recent: Option<PersonPrior<'a>>,
    },
}

/// Predicted place of the person, from the last frame.
#[derive(Clone, Copy, Debug)]
pub struct PersonPrior<'a> {
    /// Middle of the body, camera frame, metres.
    pub centre: P3,
    /// Largest displacement since, metres.
    pub reach: f32,
    /// Depth of the body in each cell, infinity beside it, metres, shape `[cells]`; empty when unknown.
    pub body: &'a [f32],
}

/// Result of the segmentation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PersonSearch {
    /// Row-major cells of the person, ascending; empty without a person.
    pub cells: Vec<u32>,
    /// Part of the person may lie beyond the lower rim of the image.
    pub cut_below: bool,
    /// Middles of hands beyond sleeves that give no return, camera frame, metres.
    pub hands: Vec<P3>,
    /// Components of the size of a body, refused ones that wait included; 0 with a predicted place.
    pub rivals: usize,
    /// Main component of the person.
    pub candidate: Option<CandidateBox>,
    /// Cells that are neither floor nor background.
    pub candidates: usize,
    /// Connected components among them.
    pub components: usize,
}

/// Scratch of the search; dropping it changes no result.
#[derive(Clone, Debug, Default)]
pub struct SegmentScratch {
    bands: PlaneBands,
    components: ComponentMap,
    /// Distance of each cell to the predicted body, cells.
    to_body: Vec<u16>,
}

/// Labels floor, background and the person in a sampled cloud.
pub fn find_person(
    cloud: &mut OrganisedCloud,
    scene: &ScenePlanes,
    choice: PersonChoice<'_>,
    settings: &SegmentSettings,
    scratch: &mut SegmentScratch,
) -> PersonSearch {
    let mut out = PersonSearch::default();
    scratch.bands.update(scene, cloud, &settings.planes);
    out.candidates = classify(cloud, &scratch.bands);
    let background_removed = label_removed_background(cloud, scene);
    if out.candidates == 0 {
        return out;
    }
    let up = scene
        .floor
        .map_or_else(|| Vector3::new(0.0, -1.0, 0.0), |f| f.normal)
        .cast::<f32>();
    scratch.components.update(cloud, &up, &settings.person);
    let map = &scratch.components;
    out.components = map.list.len();
    let expected = ExpectedBody {
        depth: match choice {
            PersonChoice::Near(prior) => prior.body,
            _ => &[],
        },
        settings: &settings.expected_body,
    };
    let sizes = &settings.person;
    let main = match choice {
        PersonChoice::Near(prior) => {
            let covering = expected.covering(cloud, map, sizes.prior_share * sizes.least_area);
            let moved = || nearest(&map.list, prior, sizes).filter(|_| !expected.is_hidden(cloud));
            covering.or_else(moved)
        }
        PersonChoice::First => {
            let ranked = ranked(cloud, map, sizes);
            out.rivals = ranked.len();
            ranked.first().copied()
        }
        PersonChoice::Untried { refusals, recent } => {
            let ranked = ranked(cloud, map, sizes);
            out.rivals = ranked.len();
            untried(&ranked, recent, |c| refusals.of(c, &settings.refusals))
        }
    };
    let Some(main) = main else {
        return out;
    };
    out.candidate = Some(main.candidate());

    let mut members = with_limbs(cloud, map, main, &expected.own(cloud, map), sizes);
    let to_body = &mut scratch.to_body;
    let limit = expected.split_limit(cloud, map, &members, to_body);
    if let Some(limit) = limit {
        drop_others(map, main, |cell| to_body[cell] <= limit, &mut members);
    }
    for i in 0..cloud.depth.len() {
        let is_near = limit.is_none_or(|limit| to_body[i] <= limit);
        if is_near && map.member(i, &members).is_some() {
            cloud.labels[i] = Label::Person;
            out.cells.push(i as u32);
        }
    }
    let body = BodyComponents {
        map,
        members: &members,
        main,
        background_removed,
        settings: &settings.hands,
    };
    out.hands = find_hands(cloud, &body);
    let (columns, rows) = cloud.size();
    let bottom = (rows - 1) * columns;
    out.cut_below = out.cells.iter().filter(|&&c| c as usize >= bottom).count() >= 2;
    out
}

/// Labels every reading as floor, background or other; returns the number of others.
fn classify(cloud: &mut OrganisedCloud, bands: &PlaneBands) -> usize {
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

/// Labels missing readings as background where the background was removed from the image: there is neither floor nor
/// wall, and most cells are empty.
fn label_removed_background(cloud: &mut OrganisedCloud, scene: &ScenePlanes) -> bool {
    if scene.floor.is_some() || !scene.background.is_empty() {
        return false;
    }
    let cells = cloud.depth.len();
    let known = cloud.depth.iter().filter(|d| **d > 0.0).count();
    let removed = 2 * known < cells;
    if removed {
        for i in 0..cells {
            if cloud.depth[i] == 0.0 {
                cloud.labels[i] = Label::Background;
            }
        }
    }
    removed
}

/// The largest component near the predicted place.
fn nearest<'a>(
    components: &'a [Component],
    prior: PersonPrior<'_>,
    settings: &PersonSettings,
) -> Option<&'a Component> {
    let off = |c: &Component| (c.centre - prior.centre).norm();
    components
        .iter()
        .filter(|c| {
            c.area > settings.prior_share * settings.least_area
                && c.area < settings.most_area
                && off(c) < prior.reach
        })
        .max_by(|a, b| a.area.total_cmp(&b.area).then(b.id.cmp(&a.id)))
}

/// The first of the least often refused components, of those that need not wait.
fn untried<'a, 'r>(
    ranked: &[&'a Component],
    recent: Option<PersonPrior<'_>>,
    refusal: impl Fn(&CandidateBox) -> Option<&'r Refusal>,
) -> Option<&'a Component> {
    let count = |c: &Component| match refusal(&c.candidate()) {
        Some(refusal) => (refusal.wait == 0).then_some(refusal.count),
        None => Some(0),
    };
    ranked
        .iter()
        .filter(|c| recent.is_none_or(|p| (c.centre - p.centre).norm() < p.reach))
        .filter_map(|c| Some((count(c)?, *c)))
        .min_by_key(|(count, _)| *count)
        .map(|(_, c)| c)
}

/// All components of the size of a body, the most likely first; those that a side of the image cuts last.
fn ranked<'a>(
    cloud: &OrganisedCloud,
    map: &'a ComponentMap,
    settings: &PersonSettings,
) -> Vec<&'a Component> {
    let sized = |c: &&Component| {
        let size = c.hi - c.lo;
        (settings.least_area..settings.most_area).contains(&c.area)
            && (settings.heights[0]..settings.heights[1]).contains(&size.y)
            && size.x < settings.most_width
            && (c.side_cells as f32) < settings.side_share * c.rows as f32
    };
    // A component on a side or at the top is more likely a wall, a door or a shelf.
    let cost = |c: &Component| {
        let penalty = |applies: bool, cost: f32| if applies { cost } else { 0.0 };
        c.centre.z
            + penalty(c.side_cells > RIM_CELLS, settings.side_cost)
            + penalty(c.top_cells > RIM_CELLS, settings.top_cost)
            + penalty(c.hi.y - c.lo.y < settings.upright, settings.low_cost)
    };
    let by = |key: &dyn Fn(&Component) -> f32, list: &mut Vec<&Component>| {
        list.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.id.cmp(&b.id)));
    };
    let mut whole: Vec<&Component> = map.list.iter().filter(sized).collect();
    by(&cost, &mut whole);
    let is_cut = |c: &&Component| !sized(c) && is_cut(c, cloud, map, settings);
    let mut cut: Vec<&Component> = map.list.iter().filter(is_cut).collect();
    by(&|c| c.centre.z, &mut cut);
    whole.extend(cut);
    whole
}

/// The main component and the parts that its own limbs cut off, of those that may be its `own`: near it in the image and in
/// depth. Shape `[components]`.
fn with_limbs(
    cloud: &OrganisedCloud,
    map: &ComponentMap,
    main: &Component,
    own: &[bool],
    settings: &PersonSettings,
) -> Vec<bool> {
    let mut members = vec![false; map.list.len()];
    members[main.id as usize] = true;
    let mut area = main.area;
    // Twice: a part may be cut off from another part.
    for _ in 0..2 {
        for (i, id) in map.of_cell.iter().enumerate() {
            if *id == ComponentMap::NONE || members[*id as usize] {
                continue;
            }
            let c = &map.list[*id as usize];
            let limb = own[*id as usize]
                && (c.centre.z - main.centre.z).abs() < settings.limb_reach
                && c.lo.z > main.lo.z - settings.limb_reach
                && c.hi.z < main.hi.z + settings.limb_reach
                && area + c.area < settings.most_area
                && (c.area <= settings.large_part * main.area
                    || is_above_or_below(c, main, settings))
                && (c.side_cells as f32) < settings.side_share * c.rows as f32;
            if limb && map.is_near(cloud, &members, i) {
                members[*id as usize] = true;
                area += c.area;
            }
        }
    }
    members
}

/// True for a component on a side of the image over most of its rows that has the shape of a person.
fn is_cut(
    c: &Component,
    cloud: &OrganisedCloud,
    map: &ComponentMap,
    settings: &PersonSettings,
) -> bool {
    let size = c.hi - c.lo;
    (settings.least_area..settings.most_area).contains(&c.area)
        && (settings.cut_height..settings.heights[1]).contains(&size.y)
        && size.x < settings.most_width
        && size.z < settings.cut_depth
        && c.top_cells <= RIM_CELLS
        && map
            .thickness(c, cloud)
            .is_some_and(|t| t > settings.roundness)
}

/// True for a part in the same column of the image: an arm across the body cuts it into an upper and a lower part, and
/// either may be the larger.
fn is_above_or_below(c: &Component, main: &Component, settings: &PersonSettings) -> bool {
    let overlap = c.hi.x.min(main.hi.x) - c.lo.x.max(main.lo.x);
    overlap > 0.5 * (c.hi.x - c.lo.x) && c.hi.x - c.lo.x < settings.most_width * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::find_planes;
    use crate::segment::fixture::{cloud_of, room};

    #[test]
    fn a_box_in_a_room_is_segmented_with_and_without_a_prior() {
        let mut cloud = room(0.1, true);
        let scene = find_planes(&cloud, &Default::default());
        let found = find_person(
            &mut cloud,
            &scene,
            PersonChoice::First,
            &Default::default(),
            &mut SegmentScratch::default(),
        );
        // 0.4 × 1.7 m at 2.5 m with a focal length of 131 cells, less 20 mm of floor.
        let expected = 0.4 * 1.68 * (131.25f32 / 2.5).powi(2);
        assert!(
            (found.cells.len() as f32 / expected - 1.0).abs() < 0.1,
            "{} of {expected}",
            found.cells.len()
        );
        assert!(!found.cut_below);
        let prior = PersonPrior {
            centre: P3::new(0.0, 0.2, 2.5),
            reach: 0.5,
            body: &[],
        };
        cloud.labels.fill(Label::Unknown);
        let again = find_person(
            &mut cloud,
            &scene,
            PersonChoice::Near(prior),
            &Default::default(),
            &mut SegmentScratch::default(),
        );
        assert_eq!(again.cells, found.cells);
    }

    /// Half a figure at the right rim at 2 m, 1.5 m tall: a half cylinder of 0.3 m, or a board turned by 30°.
    fn at_the_rim(round: bool) -> OrganisedCloud {
        let edge = 160.5 / 262.5 * 2.0;
        cloud_of(|x, y| {
            let (x, y) = (x * 2.0, y * 2.0);
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
        })
    }

    #[test]
    fn half_a_person_at_the_rim_is_found_and_half_a_door_is_not() {
        let mut scratch = SegmentScratch::default();
        let found = find_person(
            &mut at_the_rim(true),
            &ScenePlanes::default(),
            PersonChoice::First,
            &SegmentSettings::default(),
            &mut scratch,
        );
        assert!(found.cells.len() > 500, "{} cells", found.cells.len());
        let door = find_person(
            &mut at_the_rim(false),
            &ScenePlanes::default(),
            PersonChoice::First,
            &SegmentSettings::default(),
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
        cloud_of(|x, y| {
            let (x, y) = (x * 2.0, y * 2.0);
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
        })
    }

    #[test]
    fn a_hand_at_the_end_of_a_hole_is_found() {
        for hole in [true, false] {
            let mut cloud = sleeve(hole);
            let scene = find_planes(&cloud, &Default::default());
            let found = find_person(
                &mut cloud,
                &scene,
                PersonChoice::First,
                &Default::default(),
                &mut SegmentScratch::default(),
            );
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
        let mut cloud = room(0.0, false);
        let scene = find_planes(&cloud, &Default::default());
        let mut scratch = SegmentScratch::default();
        assert!(
            find_person(
                &mut cloud,
                &scene,
                PersonChoice::First,
                &Default::default(),
                &mut scratch
            )
            .cells
            .is_empty()
        );
        cloud.depth.fill(0.0);
        assert!(
            find_person(
                &mut cloud,
                &ScenePlanes::default(),
                PersonChoice::First,
                &Default::default(),
                &mut scratch
            )
            .cells
            .is_empty()
        );
    }
}
