//! Alpha expansion against brute-force optima and moves, iterated conditional modes, and faulty input.

use super::super::test_graphs::{TestRandom, random_edges};
use super::*;

/// Random labelling problem with integer costs.
struct Problem {
    edges: Vec<[u32; 2]>,
    weights: Vec<f32>,
    unary: Vec<f32>,
    init: Vec<u32>,
    count: usize,
}

impl Problem {
    fn random(random: &mut TestRandom, nodes: usize, count: usize) -> Self {
        let edges = random_edges(random, nodes, 2 * nodes);
        let strength = [5, 20, 60][random.below(3)];
        Self {
            weights: edges
                .iter()
                .map(|_| random.below(strength) as f32)
                .collect(),
            unary: (0..nodes * count)
                .map(|_| random.below(40) as f32 - 10.0)
                .collect(),
            init: (0..nodes).map(|_| random.below(count) as u32).collect(),
            edges,
            count,
        }
    }

    fn model(&self) -> MrfModel<'_> {
        MrfModel {
            edges: &self.edges,
            weights: &self.weights,
        }
    }

    fn energy(&self, labels: &[u32]) -> f64 {
        self.model().energy(&self.unary, labels)
    }

    /// Final labels, checked for convergence and for the reported energy.
    fn solve(&self) -> Vec<u32> {
        let mut labels = self.init.clone();
        let config = ExpansionConfig::default();
        let report = self
            .model()
            .expand(&self.unary, &mut labels, &config)
            .unwrap();
        assert!(report.is_converged && report.energy == self.energy(&labels));
        assert!(report.energy <= self.energy(&self.init));
        labels
    }

    /// Least energy of all labellings.
    fn optimum(&self) -> f64 {
        let (nodes, count) = (self.init.len(), self.count);
        let labelling = |mut code: usize| -> Vec<u32> {
            let mut digit = || {
                let label = code % count;
                code /= count;
                label as u32
            };
            (0..nodes).map(|_| digit()).collect()
        };
        let energies = (0..count.pow(nodes as u32)).map(|code| self.energy(&labelling(code)));
        energies.fold(f64::INFINITY, f64::min)
    }

    /// Local minimum of single label changes (iterated conditional modes), from `labels`.
    fn icm(&self, mut labels: Vec<u32>) -> f64 {
        let mut best = self.energy(&labels);
        loop {
            let before = best;
            for node in 0..labels.len() {
                for label in 0..self.count as u32 {
                    let old = std::mem::replace(&mut labels[node], label);
                    let energy = self.energy(&labels);
                    if energy < best {
                        best = energy;
                    } else {
                        labels[node] = old;
                    }
                }
            }
            if best == before {
                return best;
            }
        }
    }
}

#[test]
fn two_labels_reach_the_optimum() {
    let mut random = TestRandom(1);
    for _ in 0..150 {
        let nodes = 1 + random.below(10);
        let problem = Problem::random(&mut random, nodes, 2);
        assert_eq!(problem.energy(&problem.solve()), problem.optimum());
    }
}

#[test]
fn several_labels_stay_within_twice_the_optimum() {
    let mut random = TestRandom(2);
    for case in 0..60 {
        let mut problem = Problem::random(&mut random, 6, 3 + case % 2);
        problem.unary.iter_mut().for_each(|cost| *cost += 10.0); // The bound needs costs of at least 0.
        let found = problem.energy(&problem.solve());
        assert!(found <= 2.0 * problem.optimum());
    }
}

#[test]
fn single_changes_improve_nothing() {
    let mut random = TestRandom(3);
    let (mut ours, mut icm) = (0.0, 0.0);
    for _ in 0..30 {
        let problem = Problem::random(&mut random, 60, 4);
        let labels = problem.solve();
        let found = problem.energy(&labels);
        assert_eq!(problem.icm(labels), found);
        ours += found;
        icm += problem.icm(problem.init.clone());
    }
    assert!(
        ours < icm,
        "{ours} against {icm} of iterated conditional modes"
    );
}

#[test]
fn no_expansion_improves_the_result() {
    let mut random = TestRandom(4);
    for case in 0..60 {
        let nodes = 4 + random.below(5);
        let problem = Problem::random(&mut random, nodes, 3 + case % 3);
        let labels = problem.solve();
        let found = problem.energy(&labels);
        for label in 0..problem.count as u32 {
            for set in 0..1usize << nodes {
                let moved = |node: usize| {
                    if set >> node & 1 == 1 {
                        label
                    } else {
                        labels[node]
                    }
                };
                let moved: Vec<u32> = (0..nodes).map(moved).collect();
                assert!(problem.energy(&moved) >= found);
            }
        }
    }
}

#[test]
fn energy_falls_with_each_cycle_and_a_reused_solver_agrees() {
    let mut random = TestRandom(5);
    let problem = Problem::random(&mut random, 400, 5);
    let mut solver = AlphaExpansion::new(400, &problem.edges).unwrap();
    let mut last = problem.energy(&problem.init);
    for max_cycles in 0..8 {
        let mut labels = problem.init.clone();
        let config = ExpansionConfig { max_cycles };
        let (weights, unary) = (&problem.weights, &problem.unary);
        let report = solver.expand(weights, unary, &mut labels, &config).unwrap();
        assert!(report.energy <= last && report.cycles <= max_cycles);
        last = report.energy;
    }
    assert_eq!(last, problem.energy(&problem.solve()));
}

#[test]
fn hard_constraints_hold_beside_small_costs() {
    let (edges, weights) = ([[0, 1], [1, 2], [2, 3]], [0.5, 0.25, 0.5]);
    let unary = [0.0, 1e9, 0.01, 0.0, 0.0, 0.02, 1e9, 0.0];
    let mut labels = [1, 1, 0, 0];
    let model = MrfModel {
        edges: &edges,
        weights: &weights,
    };
    let report = model
        .expand(&unary, &mut labels, &ExpansionConfig::default())
        .unwrap();
    assert_eq!(labels, [0, 0, 1, 1]);
    assert!((report.energy - 0.28).abs() < 1e-6);
}

#[test]
fn degenerate_problems_are_solved() {
    let config = ExpansionConfig::default();
    let solve = |edges: &[[u32; 2]], unary: &[f32], labels: &mut [u32]| {
        let weights = vec![1.0; edges.len()];
        MrfModel {
            edges,
            weights: &weights,
        }
        .expand(unary, labels, &config)
        .unwrap()
    };

    let mut one = [0];
    assert_eq!(solve(&[], &[3.0, 1.0, 2.0], &mut one).energy, 1.0);
    assert_eq!(one, [1]);

    let mut close = [0, 1];
    solve(&[], &[2e-9, 1e-9, 1e-9, 2e-9], &mut close);
    assert_eq!(close, [1, 0]);

    let mut equal = [2, 2, 2];
    let report = solve(&[[0, 1], [1, 2]], &[7.0; 9], &mut equal);
    assert_eq!((equal, report.changes), ([2, 2, 2], 0));

    let single = solve(&[[0, 1]], &[1.0, 2.0], &mut [0, 0]);
    assert_eq!((single.energy, single.is_converged), (3.0, true));
    assert_eq!(solve(&[], &[], &mut []).energy, 0.0);
}

#[test]
fn faulty_input_is_named() {
    let expand = |weights: &[f32], unary: &[f32], labels: &mut [u32]| {
        let model = MrfModel {
            edges: &[[0, 1]],
            weights,
        };
        model
            .expand(unary, labels, &ExpansionConfig::default())
            .unwrap_err()
    };
    let costs = [0.0; 4];
    let mut labels = [0, 1];

    let error = MrfError::UnaryNotFinite { node: 1, label: 0 };
    assert_eq!(
        expand(&[1.0], &[0.0, 0.0, f32::NAN, 0.0], &mut labels),
        error
    );
    let error = MrfError::InvalidWeight {
        edge: 0,
        weight: -1.0,
    };
    assert_eq!(expand(&[-1.0], &costs, &mut labels), error);
    assert!(matches!(
        expand(&[f32::INFINITY], &costs, &mut labels),
        MrfError::InvalidWeight { edge: 0, .. }
    ));
    let error = MrfError::LabelOutOfRange {
        node: 1,
        label: 2,
        labels: 2,
    };
    assert_eq!(expand(&[1.0], &costs, &mut [0, 2]), error);
    let error = MrfError::WeightCount {
        weights: 2,
        edges: 1,
    };
    assert_eq!(expand(&[1.0, 1.0], &costs, &mut labels), error);
    let error = MrfError::UnaryCount {
        unaries: 3,
        nodes: 2,
    };
    assert_eq!(expand(&[1.0], &costs[..3], &mut labels), error);
    let error = MrfError::EdgeOutOfRange {
        edge: 0,
        node: 1,
        nodes: 1,
    };
    assert_eq!(expand(&[1.0], &costs, &mut [0]), error);
    let mut solver = AlphaExpansion::new(2, &[[0, 1]]).unwrap();
    let found = solver.expand(&[1.0], &costs, &mut [0], &ExpansionConfig::default());
    assert_eq!(
        found,
        Err(MrfError::LabelCount {
            labels: 1,
            nodes: 2
        })
    );
}
