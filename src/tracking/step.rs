//! One frame (Algorithm 1): segment, place or predict, pose, size, displacements, and what it all means.

use super::align::{
    ANNEAL, Fit, START, START_TERMS, Schedule, Seen, TRACK, Terms, align, evaluate, limit,
    wants_tree,
};
use super::calm::calm;
use super::confidence::confidence;
use super::kinematics::{extrapolate, motion};
use super::place::{outline, place};
use super::report::Stopwatch;
use super::size::from_stature;
use super::sleeve::assign;
use super::stand::{Feet, Ground, below, tallest, unfold};
use super::unchanged::Reference;
use super::{
    LostReason, SizeEstimate, Skipped, StagesMs, Status, StepError, StepReport, TrackerModel,
    TrackerState, Workspace, surface,
};
use crate::body::{BodyShape, BoneTransforms, Pose};
use crate::camera::RgbdFrame;
use crate::math::{Camera, P3, Rigid};
use crate::segment::{PersonPrior, PersonSearch, contour, find_person, find_planes};
use crate::spatial::{OrganisedCloud, PointTree};
use nalgebra::{Translation3, Vector3};

/// The room is looked at again after this many frames without a person.
const SCENE_INTERVAL: u32 = 60;
/// A person moves by less than this between two frames, metres; six times a sprint.
const REACH: f32 = 0.8;
/// Fewer cells than this are no person.
const LEAST_CELLS: usize = 60;
/// Below this share of explained readings a frame is bad.
const LEAST_EXPLAINED: f64 = 0.45;
/// Below this share of visible points with a reading a frame is bad.
const LEAST_MATCHED: f64 = 0.35;
/// So many bad frames in a row lose the person.
const PATIENCE: u32 = 8;
/// After this many frames without the person, whoever comes is measured anew.
const FORGET: u32 = 150;
/// A prediction is as good as the last fit when it explains a share of the readings no smaller than this less, and its
/// residual is no larger than this factor and this length (metres) more.
const AS_GOOD_EXPLAINED: f64 = 0.015;
/// See [`AS_GOOD_EXPLAINED`].
const AS_GOOD_RESIDUAL: [f64; 2] = [1.2, 0.3e-3];
/// Coarse iterations are left out only when nothing moves by more than this from frame to frame, metres.
const SLOW: f64 = 0.02;
/// Motion below this from frame to frame, metres, is not extrapolated: what is left then is the jitter of the fit, which
/// prediction would keep alive.
const STILL: f64 = 3e-3;
/// So many frames in a row nothing has moved by more than [`RESTLESS`], metres, before pictures are compared: a fit still
/// creeps to its place for a dozen frames (an arm that points at the camera by 0.3 mm a frame), and would do so in jerks.
const SETTLED_STILL: u32 = 15;
/// See [`SETTLED_STILL`].
const RESTLESS: f64 = 2.0 * STILL;
/// An empty room is compared at every so many-th cell of the grid.
const NOBODY_STEP: u32 = 2;
/// A residual at which the quality of a frame is halved, metres.
const POOR_RESIDUAL: f64 = 0.02;
/// Rounds of pose and size at the start (Algorithm 1), and the change that ends them.
const ROUNDS: usize = 8;
/// Rounds after which another height is compared, and how it is aligned: from a fitted pose shifted by [`SHIFT`] eight
/// iterations tell as much as the twenty of a first placement (real still 122 → 95 ms for all of size, same winner).
const TRIAL_ROUNDS: usize = 2;
/// See [`TRIAL_ROUNDS`].
const TRIAL: Schedule = Schedule {
    iterations: 8,
    ..START
};
const SETTLED: f64 = 0.05;
/// A first fit with a larger residual (metres) is tried again from higher and lower by [`SHIFT`] (metres), and the best
/// kept: along an upright body the surface hardly changes, so a fit a hand's width too high can settle there (6.6 mm of
/// residual against 2.1 on the synthetic shopper, time-of-flight and Kinect noise lie between).
const WELL_FITTED: f64 = 4e-3;
const SHIFT: f64 = 0.15;
/// Frames of calibration that must have gone by before the status says `Tracking`.
const CALIBRATING: u32 = 15;
/// The status also waits until the root joint has moved less than this from frame to frame, metres, for so many frames:
/// a first fit that is off slides into place at about 1.2 cm a frame, and nobody should be dressed meanwhile.
const STEADY_MOTION: f64 = 6e-3;
const STEADY_FRAMES: u32 = 6;
/// But not longer than this many frames of calibration: a shopper who walks is dressed walking.
const LONGEST_CALIBRATION: u32 = 90;
/// Displacements whose root mean square change at a fit is below this (metres) have settled; they are then fitted at
/// longer and longer intervals, up to this many frames.
const SETTLED_DISPLACEMENT: f32 = 0.4e-3;
/// See [`SETTLED_DISPLACEMENT`].
const LONGEST_INTERVAL: u32 = 24;
/// Longest interval over which motion is extrapolated, in intervals between frames.
const FARTHEST_AHEAD: f64 = 3.0;
/// Extrapolated motion is damped: a limb that stops overshoots less.
const AHEAD: f64 = 0.9;

/// Tracks one frame. On success the state holds the newest pose and status; a frame without a usable person keeps the
/// last good pose and says why.
///
/// # Errors
/// When the image does not fit the calibration or the state the template; the state is unchanged.
pub fn step(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    workspace: &mut Workspace,
) -> Result<StepReport, StepError> {
    let camera = &model.calibration.depth;
    let (got, expected) = (
        (frame.depth.width(), frame.depth.height()),
        (camera.width, camera.height),
    );
    if got != expected {
        return Err(StepError::ImageSize { got, expected });
    }
    let dofs = model.template.skeleton().dofs();
    if state.pose.angles.len() != dofs {
        return Err(StepError::ForeignState {
            got: state.pose.angles.len(),
            expected: dofs,
        });
    }
    let mut watch = Stopwatch::start();
    let mut stages = StagesMs::default();
    if let Some(mut report) = kept(state, frame) {
        report.stages_ms.segment = watch.lap();
        return Ok(report);
    }
    state.unchanged = None;
    let fresh = workspace
        .grid
        .take()
        .filter(|g| g.fits(camera, model.config.stride));
    let mut grid = fresh.unwrap_or_else(|| OrganisedCloud::new(camera, model.config.stride));
    state.frames += 1;
    let person = segment(model, state, frame, &mut grid, workspace);
    stages.segment = watch.lap();
    let mut report = StepReport {
        status: state.status,
        iterations: 0,
        converged: false,
        visible_points: 0,
        person_cells: person.cells.len(),
        residual_mm: 0.0,
        explained: 0.0,
        matched: 0.0,
        quality: 0.0,
        confidence: Vec::new(),
        pose_age: 0,
        skipped: Skipped {
            cells: grid.depth.len() - person.cells.len(),
            ..Skipped::default()
        },
        stages_ms: stages,
    };
    let nobody = person.cells.len() < LEAST_CELLS;
    if nobody {
        lose(state, LostReason::NoPerson);
    } else {
        follow(
            model,
            state,
            frame,
            &grid,
            &person,
            workspace,
            &mut report,
            &mut watch,
        );
    }
    report.status = state.status;
    report.pose_age = state.pose_age;
    if model.config.skip_unchanged {
        state.unchanged = if nobody {
            Some(Reference::of_all(
                &frame.depth,
                NOBODY_STEP * grid.stride(),
                &report,
            ))
        } else {
            still(model, state)
                .then(|| Reference::of_cells(&frame.depth, &grid, &person.cells, &report))
        };
    }
    workspace.grid = Some(grid);
    Ok(report)
}

/// What holds for a frame that shows the same as one before it: that one's pose and report.
fn kept(state: &mut TrackerState, frame: &RgbdFrame) -> Option<StepReport> {
    let mut report = state.unchanged.as_mut()?.keep(&frame.depth)?.clone();
    state.frames += 1;
    state.scene_age = state.scene_age.map(|a| a.saturating_add(1));
    if !state.status.is_live() {
        lose(state, LostReason::NoPerson);
    }
    report.status = state.status;
    report.pose_age = state.pose_age;
    report.iterations = 0;
    report.skipped.frames = 1;
    report.skipped.displacements = state.shape.displacements.len();
    Some(report)
}

/// The person stands still in a settled pose, so that a picture like this one would be answered by it. Counts for how long.
fn still(model: &TrackerModel, state: &mut TrackerState) -> bool {
    let moved = state.before.as_ref().map_or(f64::MAX, |b| {
        motion(model.template.skeleton(), b, &state.pose)
    });
    state.still = if moved < RESTLESS {
        state.still.saturating_add(1)
    } else {
        0
    };
    state.status == Status::Tracking
        && state.calibrated(&model.config)
        && state.bad_frames == 0
        && state.still >= SETTLED_STILL
        && moved < STILL
}

/// Depth image to the person's refined cells and outline.
fn segment(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    grid: &mut OrganisedCloud,
    workspace: &mut Workspace,
) -> PersonSearch {
    if grid.sample(&frame.depth, model.config.farthest) == 0 {
        return PersonSearch::default();
    }
    state.scene_age = state.scene_age.map(|a| a.saturating_add(1));
    if !state.status.is_live() && state.scene_age.is_none_or(|a| a >= SCENE_INTERVAL) {
        let scene = find_planes(grid);
        // A plane once known is not given up because someone stands before it.
        if scene.floor.is_some() || state.scene_age.is_none() || state.scene.floor.is_none() {
            state.set_scene(scene);
        }
    }
    let prior = state.status.is_live().then_some(PersonPrior {
        centre: state.centre,
        reach: REACH,
    });
    let mut person = find_person(grid, &state.scene, prior, &mut workspace.segment);
    if person.cells.len() >= LEAST_CELLS {
        grid.refine(&frame.depth, &person.cells);
        person.cells.retain(|&c| grid.depth[c as usize] > 0.0);
        contour(grid, &person.cells, &mut workspace.contour);
    }
    person
}

fn lose(state: &mut TrackerState, reason: LostReason) {
    state.pose_age = state.pose_age.saturating_add(1);
    state.before = None;
    if state.status != Status::Searching {
        state.status = Status::Lost { reason };
    }
    state.bad_frames = 0;
}

/// A person is in view: find or follow the pose.
#[allow(clippy::too_many_arguments)] // one caller, and each is a different thing
fn follow(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    grid: &OrganisedCloud,
    person: &PersonSearch,
    workspace: &mut Workspace,
    report: &mut StepReport,
    watch: &mut Stopwatch,
) {
    let skeleton = model.template.skeleton();
    let points: Vec<P3> = if wants_tree(model) {
        person
            .cells
            .iter()
            .map(|&c| grid.points[c as usize])
            .collect()
    } else {
        Vec::new()
    };
    let tree = wants_tree(model).then(|| PointTree::new(&points));
    let outline_of_person = std::mem::take(&mut workspace.contour);
    let seen = Seen {
        grid,
        cells: &person.cells,
        contour: &outline_of_person,
        tree: tree.as_ref(),
    };
    workspace.align.pairing.forget();
    let up = state.world_from_camera.inverse().vector(&Vector3::y());
    let searching = !state.status.is_live();
    let mut pose = state.pose.clone();
    let mut fine = false;
    workspace.align.terms = if searching {
        START_TERMS
    } else {
        Terms::tracking(&model.config)
    };

    if !searching && model.config.standing {
        workspace.rest_body(model, &state.shape);
        let height = if state.floor_known {
            Some(-state.world_from_camera.iso().translation.vector.y)
        } else {
            state.tallest.and_then(|t| below(model, &workspace.rest, t))
        };
        workspace.align.terms.ground = height.map(|height| Ground {
            up,
            height,
            feet: state.feet,
        });
    }
    if searching {
        if state.pose_age > FORGET {
            state.reset(model);
        }
        // Over a floor the crown tells the stature, whether the feet are in view or not.
        let floor = state
            .floor_known
            .then(|| state.world_from_camera.iso().translation.vector.y);
        let first_look = outline(&seen, &up.cast(), person.cut_below, floor);
        let stature = first_look
            .and_then(|o| o.stature)
            .filter(|s| (1.3..2.2).contains(s));
        if let Some(stature) = stature.filter(|_| state.size.frames == 0 && model.config.adapt_size)
        {
            state.shape = from_stature(model, stature);
        }
        workspace.rest_body(model, &state.shape);
        let rest = (&workspace.rest, &workspace.samples);
        let placed =
            first_look.and_then(|o| place(model, rest, &seen, &o, &up, &mut workspace.align));
        report.stages_ms.place = watch.lap();
        match placed {
            Some((p, fit)) if fit.explained >= LEAST_EXPLAINED => pose = p,
            _ => {
                workspace.contour = outline_of_person;
                lose(state, LostReason::Residual);
                return;
            }
        }
        (state.before, state.tallest, state.feet) = (None, None, None);
        state.drift.clear();
    } else {
        workspace.rest_body(model, &state.shape);
        let rest = (&workspace.rest, &workspace.samples);
        // Constant velocity, but only where it explains the frame as well as the last pose did its own, or better than
        // standing still.
        let mut look = |pose: &Pose<Camera>| {
            evaluate(
                model,
                rest,
                pose,
                &seen,
                TRACK.distance[0],
                &mut workspace.align,
            )
        };
        let [explained, residual] = state.quality;
        let as_good = |fit: &Fit| {
            model.config.skip_coarse
                && state.calibrated(&model.config)
                && fit.explained > explained - AS_GOOD_EXPLAINED
                && fit.residual < AS_GOOD_RESIDUAL[0] * residual + AS_GOOD_RESIDUAL[1]
        };
        let moving = |before: &&Pose<Camera>| motion(skeleton, before, &pose) > STILL;
        let before = state
            .before
            .as_ref()
            .filter(|_| model.config.predict && state.interval_ns > 0);
        let guess = before.filter(moving).map(|before| {
            let ahead =
                frame.time_ns.saturating_sub(state.time_ns) as f64 / state.interval_ns as f64;
            extrapolate(skeleton, before, &pose, AHEAD * ahead.min(FARTHEST_AHEAD))
        });
        match guess {
            Some(mut guess) => {
                limit(model, &mut guess);
                let moved = look(&guess);
                fine = motion(skeleton, &pose, &guess) < SLOW && as_good(&moved);
                if fine || moved.cost < look(&pose).cost {
                    pose = guess;
                }
            }
            None if model.config.skip_coarse => fine = as_good(&look(&pose)),
            None => {}
        }
    }

    let expected = (!searching && model.config.calm > 0.0).then(|| state.pose.clone());
    if !person.hands.is_empty() {
        workspace.align.terms.hands =
            assign(model, &workspace.rest, &mut pose, &seen, &person.hands);
    }

    // Pose; at the start alternating with size until both have settled (Algorithm 1).
    let mut schedule = TRACK;
    schedule.iterations = model.config.iterations;
    schedule.ahead = if fine { ANNEAL } else { 0 };
    report.skipped.coarse_iterations = schedule.ahead;
    let rest = (&workspace.rest, &workspace.samples);
    let mut fit = align(
        model,
        rest,
        &mut pose,
        &seen,
        if searching { &START } else { &schedule },
        &mut workspace.align,
    );
    if let Some(ground) = workspace.align.terms.ground {
        unfold(
            model,
            &workspace.rest,
            grid,
            &ground,
            &workspace.align,
            &mut pose,
        );
    }
    report.stages_ms.pose = watch.lap();
    if model.config.rescue && !searching && state.rescue.due(&fit) {
        let found = state.rescue.look(
            model,
            rest,
            &mut pose,
            &seen,
            &schedule,
            &mut workspace.align,
        );
        fit = found.unwrap_or(fit);
        report.stages_ms.place = watch.lap();
    }
    let good = fit.explained >= LEAST_EXPLAINED && fit.matched >= LEAST_MATCHED && pose.is_finite();
    if good && !state.calibrated(&model.config) {
        if state.size.frames == 0 {
            let start = (state.size.clone(), state.shape.clone(), pose.clone());
            let mut best = settle(
                model,
                start.clone(),
                &seen,
                &schedule,
                ROUNDS,
                person.cut_below,
                workspace,
            );
            if best.3.residual > WELL_FITTED {
                let half = person.cut_below;
                let trials = [-SHIFT, SHIFT].map(|shift| {
                    let mut other = start.clone();
                    other.2.root = Rigid::new(Translation3::from(up * shift) * other.2.root.iso());
                    settle(model, other, &seen, &TRIAL, TRIAL_ROUNDS, half, workspace)
                });
                let better = trials
                    .into_iter()
                    .filter(|t| t.4 < best.4)
                    .min_by(|a, b| a.4.total_cmp(&b.4));
                if let Some((size, shape, pose, ..)) = better {
                    best = settle(
                        model,
                        (size, shape, pose),
                        &seen,
                        &schedule,
                        ROUNDS,
                        false,
                        workspace,
                    );
                }
            }
            (state.size, state.shape, pose, fit, _) = best;
            workspace.rest_body(model, &state.shape);
        }
        let rest = (&workspace.rest, &workspace.samples);
        state.size.observe(
            model,
            rest,
            &pose,
            &seen,
            &mut state.shape,
            &mut workspace.align,
            true,
        );
        workspace.rest_body(model, &state.shape);
        report.stages_ms.size = watch.lap();
    }
    let good = good && pose.is_finite();

    report.iterations = fit.iterations;
    report.converged = fit.converged;
    report.visible_points = fit.pairs.visible;
    report.residual_mm = fit.residual * 1e3;
    report.explained = fit.explained;
    report.matched = fit.matched;
    report.quality = fit.explained.min(fit.matched) / (1.0 + fit.residual / POOR_RESIDUAL);
    report.skipped.hidden_points = fit.pairs.hidden;
    report.skipped.inconsistent_pairs = fit.pairs.inconsistent;
    report.skipped.searches = fit.pairs.reused;
    report.skipped.iterations = model.config.iterations.saturating_sub(fit.iterations);
    report.skipped.displacements = state.shape.displacements.len();

    if !pose.is_finite() {
        workspace.contour = outline_of_person;
        lose(state, LostReason::NotFinite);
        return;
    }
    if let Some(expected) = expected.filter(|_| good) {
        pose = calm(
            model,
            &workspace.rest,
            &expected,
            &pose,
            model.config.calm * fit.residual,
            &mut state.drift,
        );
    }
    state.bad_frames = if good { 0 } else { state.bad_frames + 1 };
    if state.bad_frames > PATIENCE {
        workspace.contour = outline_of_person;
        lose(state, LostReason::Residual);
        return;
    }
    let root = model.template.skeleton().joints()[0].rest;
    let moved = (pose.root.point(&root) - state.pose.root.point(&root)).norm();
    report.confidence = confidence(model, &pose, &seen, &workspace.align);
    state.steady = if !searching && moved < STEADY_MOTION {
        state.steady.saturating_add(1)
    } else {
        0
    };
    state.calibration_age = if searching {
        0
    } else {
        state.calibration_age.saturating_add(1)
    };
    state.before = (!searching).then(|| std::mem::replace(&mut state.pose, pose.clone()));
    state.pose = pose;
    state.interval_ns = frame.time_ns.saturating_sub(state.time_ns);
    state.time_ns = frame.time_ns;
    state.pose_age = 0;
    state.centre = centre_of(grid, &person.cells);
    state.quality = [fit.explained, fit.residual];
    let settling = state.status != Status::Tracking
        && state.steady < STEADY_FRAMES
        && state.calibration_age < LONGEST_CALIBRATION;
    let calibrating = model.config.adapt_size && (state.size.frames < CALIBRATING || settling);
    state.status = if calibrating {
        Status::Calibrating
    } else {
        Status::Tracking
    };

    state.tallest = tallest(model, &up, state.tallest, &workspace.align);
    let mut bones = BoneTransforms::default();
    state.pose.bones(skeleton, &workspace.rest, &mut bones);
    let feet = Feet::of(model, &bones.joints);
    state.feet = Some(state.feet.map_or(feet, |kept| kept.followed(feet)));

    let [wait, interval] = &mut state.surface_due;
    *wait = wait.saturating_sub(1);
    *interval = (*interval).max(model.config.displacement_interval.max(1));
    if good && model.config.displacements && !calibrating && *wait == 0 {
        let rest = (&workspace.rest, &workspace.samples);
        super::align::pair(
            model,
            rest,
            &state.pose,
            &seen,
            0.05,
            0.0,
            &mut workspace.align,
        );
        let (updated, change) = surface::fit(
            model,
            &workspace.rest,
            &workspace.align.bones,
            &seen,
            &workspace.align.pairing.image,
            &mut state.shape.displacements,
            &mut state.surface,
            &mut workspace.surface,
        );
        report.skipped.displacements = state.shape.displacements.len() - updated;
        // What hardly changed is looked at half as often, what changed as often as configured.
        let settled = model.config.skip_settled && change < SETTLED_DISPLACEMENT;
        *interval = if settled {
            (*interval * 2).min(LONGEST_INTERVAL)
        } else {
            model.config.displacement_interval.max(1)
        };
        *wait = *interval;
        report.stages_ms.surface = watch.lap();
    }
    workspace.contour = outline_of_person;
}

/// Size, shape and pose in turns until both have settled (Algorithm 1), from a given start; last comes the cost by
/// which starts compare.
fn settle(
    model: &TrackerModel,
    (mut size, mut shape, mut pose): (SizeEstimate, BodyShape, Pose<Camera>),
    seen: &Seen<'_>,
    schedule: &Schedule,
    rounds: usize,
    half: bool,
    workspace: &mut Workspace,
) -> (SizeEstimate, BodyShape, Pose<Camera>, Fit, f64) {
    workspace.rest_body(model, &shape);
    let rest = (&workspace.rest, &workspace.samples);
    let mut fit = align(model, rest, &mut pose, seen, schedule, &mut workspace.align);
    // Once size and pose know of each other, neither kernel nor reach need to shrink anew; but what is seen of half a
    // body says so little about size that its pose had better stay free (5 mm on waist-up scenes).
    let near = Schedule {
        ahead: if half { schedule.ahead } else { ANNEAL },
        ..*schedule
    };
    for _ in 0..rounds {
        let rest = (&workspace.rest, &workspace.samples);
        let change = size.observe(
            model,
            rest,
            &pose,
            seen,
            &mut shape,
            &mut workspace.align,
            false,
        );
        workspace.sketch(model, &shape);
        let rest = (&workspace.rest, &workspace.samples);
        fit = align(model, rest, &mut pose, seen, &near, &mut workspace.align);
        if change < SETTLED {
            break;
        }
    }
    workspace.rest_body(model, &shape);
    let rest = (&workspace.rest, &workspace.samples);
    let cost = evaluate(
        model,
        rest,
        &pose,
        seen,
        TRACK.distance[0],
        &mut workspace.align,
    )
    .cost;
    (size, shape, pose, fit, cost)
}

fn centre_of(grid: &OrganisedCloud, cells: &[u32]) -> P3 {
    let sum = cells.iter().fold(Vector3::zeros(), |s, &c| {
        s + grid.points[c as usize].coords.cast::<f64>()
    });
    P3::from((sum / cells.len().max(1) as f64).cast::<f32>())
}
