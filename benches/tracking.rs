//! Kernels of tracking: segmentation, correspondences, normal equations, solve, a whole step; each with a degenerate case.
//!
//! `cargo bench --bench tracking`

#![allow(missing_docs)] // criterion_group! writes a public function without any
#![allow(clippy::expect_used)] // a bench stops at the first fault

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{DMatrix, Vector3};
use tryon::body::skin;
use tryon::geometry::camera::{DepthImage, NoiseModel, RgbdFrame};
use tryon::geometry::math::{P3, Twist, V3};
use tryon::geometry::par::Par;
use tryon::geometry::spatial::{OrganisedCloud, PointTree};
use tryon::synth::{Actor, Routine, Sequence, Setting};
use tryon::tracking::registration::residual::PointTerm;
use tryon::tracking::registration::{
    Association, Dof, Metric, ModelPoints, NormalEquations, Observation, PairingConfig,
    PairingScratch, pair_surfaces,
};
use tryon::tracking::segment::part_network::{PartNetwork, PersonCells, PersonParts};
use tryon::tracking::segment::{
    Contour, PersonChoice, SegmentScratch, contour, find_person, find_planes,
};
use tryon::tracking::settings::{RegistrationSettings, SegmentSettings};
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

fn subject(routine: Routine) -> Sequence {
    let setting = Setting {
        routine,
        noise: NoiseModel::KinectV1,
        color: false,
        ..Setting::default()
    };
    Sequence::new(Actor::default(), setting)
}

fn segmentation(c: &mut Criterion) {
    let sequence = subject(Routine::TryOn);
    let (frame, _) = sequence.frame(0);
    let settings = SegmentSettings::default();
    let mut grid = OrganisedCloud::new(&sequence.calibration().depth, None);
    c.bench_function("segment/sample 640x480", |b| {
        b.iter(|| grid.sample(&frame.depth, 8.0))
    });
    c.bench_function("segment/planes", |b| {
        b.iter(|| find_planes(&grid, &settings.planes))
    });
    let planes = find_planes(&grid, &settings.planes);
    let (mut scratch, mut edges) = (SegmentScratch::default(), Contour::default());
    c.bench_function("segment/person and outline", |b| {
        b.iter(|| {
            grid.sample(&frame.depth, 8.0);
            let person = find_person(
                &mut grid,
                &planes,
                PersonChoice::First,
                &settings,
                &mut scratch,
            );
            grid.refine(&frame.depth, &person.cells);
            contour(&grid, &person.cells, &settings, &mut edges);
            person.cells.len()
        });
    });
    let empty = DepthImage::empty(frame.depth.width(), frame.depth.height());
    c.bench_function("segment/no reading at all", |b| {
        b.iter(|| {
            grid.sample(&empty, 8.0);
            find_person(
                &mut grid,
                &planes,
                PersonChoice::First,
                &settings,
                &mut scratch,
            )
            .cells
            .len()
        });
    });
}

/// A thousand points of the subject's surface at its true pose, with their normals and dominant bones.
fn samples(sequence: &Sequence) -> (Vec<P3>, Vec<V3>, Vec<u8>) {
    let template = &sequence.actor().template;
    let truth = sequence.truth(0);
    let every = template.mesh().vertices().len() / 1000;
    let pick = |i: &usize| i.is_multiple_of(every);
    let rest = sequence.rest();
    let mut bones = Default::default();
    truth.pose.bones(template.skeleton(), rest, &mut bones);
    let mut posed = vec![];
    skin(
        Par::Seq,
        &rest.vertices,
        template.weights(),
        &bones,
        &mut posed,
    );
    let chosen: Vec<usize> = (0..posed.len()).filter(pick).collect();
    let bone = |i: &usize| template.weights().dominant(*i) as u8;
    let turn = |i: &usize| {
        (bones.bones[template.weights().dominant(*i)]
            .rotation
            .cast::<f32>())
            * rest.normals[*i]
    };
    (
        chosen.iter().map(|i| posed[*i]).collect(),
        chosen.iter().map(turn).collect(),
        chosen.iter().map(bone).collect(),
    )
}

/// Readings of the subject in the first frame of the try-on routine.
struct Readings {
    sequence: Sequence,
    grid: OrganisedCloud,
    cells: Vec<u32>,
    edges: Contour,
    points: Vec<P3>,
}

fn readings() -> Readings {
    let sequence = subject(Routine::TryOn);
    let (frame, _) = sequence.frame(0);
    let settings = SegmentSettings::default();
    let mut grid = OrganisedCloud::new(&sequence.calibration().depth, None);
    grid.sample(&frame.depth, 8.0);
    let planes = find_planes(&grid, &settings.planes);
    let cells = find_person(
        &mut grid,
        &planes,
        PersonChoice::First,
        &settings,
        &mut SegmentScratch::default(),
    )
    .cells;
    grid.refine(&frame.depth, &cells);
    let mut edges = Contour::default();
    contour(&grid, &cells, &settings, &mut edges);
    Readings {
        points: cells.iter().map(|&k| grid.points[k as usize]).collect(),
        sequence,
        grid,
        cells,
        edges,
    }
}

fn correspondences(c: &mut Criterion) {
    let r = readings();
    c.bench_function("pairs/tree over the readings", |b| {
        b.iter(|| PointTree::new(&r.points))
    });
    let tree = PointTree::new(&r.points);
    let observation = Observation {
        grid: &r.grid,
        cells: &r.cells,
        false_edges: &r.edges.false_edges,
        true_edges: &r.edges.true_edges,
        tree: Some(&tree),
    };
    let (positions, normals, bones) = samples(&r.sequence);
    let joints = r.sequence.actor().template.skeleton().joints();
    let parents: Vec<Option<usize>> = joints.iter().map(|j| j.parent).collect();
    // The body is somewhere else: nothing pairs, every reading pulls.
    let shift = V3::new(3.0, 0.0, 0.0);
    let away: Vec<P3> = positions.iter().map(|p| p + shift).collect();
    let (mut scratch, mut pairs) = (PairingScratch::default(), vec![]);
    for (name, positions, association) in [
        ("windows, 1,000 points", &positions, Association::Projective),
        ("kd-tree, 1,000 points", &positions, Association::KdTree),
        ("kd-tree, the body is elsewhere", &away, Association::KdTree),
    ] {
        let model = ModelPoints {
            positions,
            normals: &normals,
            bones: &bones,
            parents: &parents,
            spacing: 0.04,
        };
        let config = PairingConfig {
            association,
            distance: 0.12,
            pull: 0.35,
            data_step: 2,
            settings: RegistrationSettings {
                reuse: 0.0,
                ..RegistrationSettings::default()
            },
        };
        c.bench_function(&format!("pairs/{name}"), |b| {
            b.iter(|| pair_surfaces(&model, &observation, &config, &mut scratch, &mut pairs));
        });
    }
}

/// A tree of 24 bones with three rotations each and the root's shift, and 1,600 residuals on them.
fn chain() -> (Vec<Option<usize>>, Vec<Dof>, Vec<PointTerm>) {
    let parents: Vec<Option<usize>> = (0..24usize).map(|b| (b > 0).then(|| (b - 1) / 2)).collect();
    let axis = |k: usize| Vector3::from_fn(|r, _| f64::from(u8::from(r == k)));
    let mut dofs: Vec<Dof> = (0..3)
        .map(|k| Dof {
            bone: 0,
            twist: Twist {
                linear: axis(k),
                angular: Vector3::zeros(),
            },
        })
        .collect();
    for bone in 0..24 {
        let at = Vector3::new(0.1 * bone as f64, (bone as f64).sin(), 0.05);
        dofs.extend((0..3).map(|k| Dof {
            bone,
            twist: Twist::revolute(axis(k), at),
        }));
    }
    let residual = |i: usize| {
        let t = i as f64 * 0.37;
        let direction = Vector3::new(t.sin(), t.cos(), 0.3).normalize();
        PointTerm {
            sample: i,
            bone: i % 24,
            point: Vector3::new((1.3 * t).sin(), (0.7 * t).cos(), 0.1 * t.sin()),
            residual: direction * 0.01,
            metric: Metric {
                isotropic: 0.1,
                directional: 1.0,
                direction,
            },
            weight: 1.0,
            cost: 0.0,
        }
    };
    (parents, dofs, (0..1600).map(residual).collect())
}

fn equations(c: &mut Criterion) {
    let (parents, dofs, residuals) = chain();
    let mut sums = NormalEquations::default();
    let fill = |sums: &mut NormalEquations, list: &[PointTerm]| {
        sums.reset(parents.len());
        let centre = Vector3::zeros();
        list.iter().for_each(|t| sums.add_point(t, &centre));
        sums.assemble(&parents, &dofs);
    };
    c.bench_function("equations/1,600 residuals, 75 unknowns", |b| {
        b.iter(|| fill(&mut sums, &residuals))
    });
    c.bench_function("equations/no residual", |b| b.iter(|| fill(&mut sums, &[])));
    fill(&mut sums, &residuals);
    let damping = vec![1e-1; dofs.len()];
    c.bench_function("solve/75 unknowns", |b| {
        b.iter(|| sums.solve_damped(&damping))
    });
    sums.hessian = DMatrix::zeros(dofs.len(), dofs.len());
    c.bench_function("solve/nothing known but the damping", |b| {
        b.iter(|| sums.solve_damped(&damping))
    });
    sums.hessian.fill(f64::NAN);
    c.bench_function("solve/not a number", |b| {
        b.iter(|| sums.solve_damped(&damping))
    });
}

fn parts(c: &mut Criterion) {
    let Readings { grid, cells, .. } = readings();
    let (network, mut parts) = (PartNetwork::embedded(), PersonParts::default());
    let person = |cells| PersonCells {
        cloud: &grid,
        cells,
        up: V3::new(0.0, -1.0, 0.0),
    };
    c.bench_function("parts/person", |b| {
        b.iter(|| network.infer(&person(&cells), &mut parts));
    });
    c.bench_function("parts/nobody", |b| {
        b.iter(|| network.infer(&person(&[]), &mut parts));
    });
}

fn whole_step(c: &mut Criterion) {
    for (name, routine) in [("still person", Routine::Still), ("nobody", Routine::Empty)] {
        let sequence = subject(routine);
        let template = sequence.actor().template.clone();
        let model = TrackerModel::new(
            template,
            sequence.calibration().clone(),
            TrackerConfig::default(),
        );
        let (mut state, mut workspace) = (TrackerState::new(&model), Workspace::default());
        let frames: Vec<RgbdFrame> = (0..10).map(|i| sequence.frame(i).0).collect();
        let mut next = 0u64;
        let mut one = || {
            let frame = RgbdFrame {
                sequence: next,
                time_ns: next * 33_333_333,
                ..frames[(next % 10) as usize].clone()
            };
            next += 1;
            step(&model, &mut state, &frame, &mut workspace).expect("a frame of the camera")
        };
        (0..100).for_each(|_| {
            one();
        });
        c.bench_function(&format!("step/{name}"), |b| b.iter(&mut one));
    }
}

criterion_group!(
    benches,
    segmentation,
    correspondences,
    equations,
    parts,
    whole_step
);
criterion_main!(benches);
