//! Maximum flow against brute-force cuts, its own cut, and faulty or extreme input.

use super::super::test_graphs::{TestRandom, random_edges};
use super::*;

/// Network as data: terminal capacities, and edges with both capacities.
struct Case {
    terminals: Vec<i32>,
    edges: Vec<[u32; 2]>,
    capacities: Vec<[i32; 2]>,
}

impl Case {
    fn random(random: &mut TestRandom, nodes: usize, edges: usize, largest: usize) -> Self {
        let edges = random_edges(random, nodes, edges);
        let mut capacity = || random.below(largest + 1) as i32;
        let terminals = (0..nodes).map(|_| capacity() - capacity()).collect();
        let capacities = edges.iter().map(|_| [capacity(), capacity()]).collect();
        Self {
            terminals,
            edges,
            capacities,
        }
    }

    fn solve(&self, network: &mut MaxFlow) -> i64 {
        for (node, &excess) in self.terminals.iter().enumerate() {
            network.set_terminal(node, excess);
        }
        for (edge, &[forward, backward]) in self.capacities.iter().enumerate() {
            network.set_edge(edge, forward, backward);
        }
        network.solve()
    }

    /// Capacity of the cut between the nodes of `source` and the rest.
    fn cut(&self, source: impl Fn(usize) -> bool) -> i64 {
        let terminal = |(node, &excess): (usize, &i32)| match source(node) {
            true => i64::from(-excess).max(0),
            false => i64::from(excess).max(0),
        };
        let between = |(&[a, b], &[forward, backward]): (&[u32; 2], &[i32; 2])| match (
            source(a as usize),
            source(b as usize),
        ) {
            (true, false) => i64::from(forward),
            (false, true) => i64::from(backward),
            _ => 0,
        };
        let terminals: i64 = self.terminals.iter().enumerate().map(terminal).sum();
        terminals
            + self
                .edges
                .iter()
                .zip(&self.capacities)
                .map(between)
                .sum::<i64>()
    }

    /// Checks that the flow equals its own cut, and that residuals conserve flow.
    fn check(&self, network: &MaxFlow, flow: i64) {
        assert_eq!(flow, self.cut(|node| network.in_source(node)));

        let mut balance: Vec<i64> = self.terminals.iter().map(|&c| i64::from(c)).collect();
        for (edge, (&[a, b], &[forward, backward])) in
            self.edges.iter().zip(&self.capacities).enumerate()
        {
            let residual = network.residual(edge);
            assert!((0..=forward + backward).contains(&residual));
            balance[a as usize] -= i64::from(forward - residual);
            balance[b as usize] += i64::from(forward - residual);
        }
        for (node, balance) in balance.into_iter().enumerate() {
            assert_eq!(balance, i64::from(network.excess(node)), "node {node}");
        }
    }
}

#[test]
fn flow_is_the_least_of_all_cuts() {
    let mut random = TestRandom(1);
    for case in 0..400 {
        let nodes = 1 + random.below(10);
        let edges = random.below(3 * nodes);
        let case = Case::random(&mut random, nodes, edges, [3, 20, 1000][case % 3]);
        let mut network = MaxFlow::new(nodes, &case.edges).unwrap();
        let flow = case.solve(&mut network);

        let cuts = (0..1usize << nodes).map(|set| case.cut(|node| set >> node & 1 == 1));
        assert_eq!(Some(flow), cuts.min());
        case.check(&network, flow);
    }
}

#[test]
fn source_side_is_the_smallest() {
    let mut random = TestRandom(2);
    for _ in 0..100 {
        let case = Case::random(&mut random, 8, 14, 2);
        let mut network = MaxFlow::new(8, &case.edges).unwrap();
        let flow = case.solve(&mut network);
        let side = (0..8)
            .filter(|&n| network.in_source(n))
            .fold(0usize, |s, n| s | 1 << n);
        let minima = (0..1usize << 8).filter(|s| case.cut(|n| s >> n & 1 == 1) == flow);
        assert_eq!(side, minima.fold(usize::MAX, |a, b| a & b));
    }
}

#[test]
fn flow_equals_cut_on_large_graphs_and_repeats() {
    let mut random = TestRandom(3);
    for (nodes, edges, largest) in [(300, 400, 9), (500, 3000, 50), (2000, 6000, 1)] {
        let first = Case::random(&mut random, nodes, edges, largest);
        let second = Case {
            terminals: vec![1; nodes],
            ..Case::random(&mut random, nodes, 0, 1)
        };
        let mut network = MaxFlow::new(nodes, &first.edges).unwrap();
        let flow = first.solve(&mut network);
        first.check(&network, flow);

        for (node, &excess) in second.terminals.iter().enumerate() {
            network.set_terminal(node, excess);
        }
        assert_eq!(network.solve(), 0);
        assert_eq!(first.solve(&mut network), flow, "capacities were reset");
        first.check(&network, flow);
    }
}

/// Long path whose only source and sink are at its ends, with a bottleneck of 3.
#[test]
fn long_path_carries_its_bottleneck() {
    let nodes = 1000;
    let edges: Vec<[u32; 2]> = (1..nodes as u32).map(|n| [n - 1, n]).collect();
    let mut capacities = vec![[7, 0]; edges.len()];
    capacities[400] = [3, 0];
    let mut terminals = vec![0; nodes];
    (terminals[0], terminals[nodes - 1]) = (10, -5);
    let case = Case {
        terminals,
        edges,
        capacities,
    };
    let mut network = MaxFlow::new(nodes, &case.edges).unwrap();
    let flow = case.solve(&mut network);
    assert_eq!(flow, 3);
    assert!(network.in_source(400) && !network.in_source(401));
    case.check(&network, flow);
}

#[test]
fn disconnected_nodes_and_zero_capacities_carry_nothing() {
    let case = Case {
        terminals: vec![5, -5, 0, 4, -9],
        edges: vec![[0, 1], [3, 4]],
        capacities: vec![[0, 0], [0, 8]],
    };
    let mut network = MaxFlow::new(5, &case.edges).unwrap();
    assert_eq!(case.solve(&mut network), 0);
    let sides = [0, 1, 2, 3, 4].map(|n| network.in_source(n));
    assert_eq!(sides, [true, false, false, true, false]);
    assert_eq!(MaxFlow::new(0, &[]).unwrap().solve(), 0);
}

#[test]
fn huge_capacities_do_not_overflow() {
    let edges = vec![[0, 1], [1, 2], [0, 2], [0, 1]];
    let mut network = MaxFlow::new(3, &edges).unwrap();
    for edge in 0..edges.len() {
        network.set_edge(edge, i32::MAX, i32::MAX);
    }
    for (node, excess) in [i32::MAX, 0, i32::MIN].into_iter().enumerate() {
        network.set_terminal(node, excess);
    }
    assert_eq!(network.solve(), i64::from(MAX_CAPACITY));
    network.set_edge(0, -4, -4);
    assert_eq!(network.residual(0), 0);
}

#[test]
fn faulty_edges_are_named() {
    let range = MrfError::EdgeOutOfRange {
        edge: 1,
        node: 2,
        nodes: 2,
    };
    assert_eq!(MaxFlow::new(2, &[[0, 1], [0, 2]]).unwrap_err(), range);
    let circle = MrfError::SelfLoop { edge: 0, node: 1 };
    assert_eq!(MaxFlow::new(2, &[[1, 1]]).unwrap_err(), circle);
    assert!(matches!(
        MaxFlow::new(usize::MAX, &[]),
        Err(MrfError::TooLarge { .. })
    ));
}
