//! Energies of all contact pairs in parallel, with the same bits at any thread count; buffers are reused.

use super::barrier::Barrier;
use super::composition::Curvature;
use super::friction::{Friction, FrictionPair};
use crate::contact::pair::ActivePair;
use tryon_geometry::math::{ElementEnergy, V3d};
use tryon_geometry::par::{Par, map_into};

/// Pairs that one thread takes at a time.
const CHUNK: usize = 256;
/// Elements that are made before they are consumed: 1.3 MB. Fewer wake the threads too often, more leave the cache.
const BLOCK: usize = 1024;
/// Elements of a block that one thread takes at a time.
const BLOCK_CHUNK: usize = 64;

/// Energy of one contact and the vertices that it acts on.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ContactElement {
    /// Vertices of the stencil; unknown `3 k + i` of the energy is axis `i` of vertex `k`.
    pub vertices: [u32; 4],
    /// Value, gradient and Hessian.
    pub energy: ElementEnergy<12>,
}

/// Buffers that are used again from call to call.
#[derive(Clone, Debug, Default)]
pub struct ContactAssembly {
    scalars: Vec<f64>,
    elements: Vec<ContactElement>,
}

impl ContactAssembly {
    /// Pairs within reach of the barrier, in the order of `pairs`. `positions` (m) of all vertices.
    ///
    /// # Panics
    /// With fewer positions than the pairs' indices need.
    pub fn within_reach(
        &mut self,
        par: Par,
        barrier: &Barrier,
        positions: &[V3d],
        pairs: &[ActivePair],
    ) -> Vec<ActivePair> {
        let reach = barrier.reach() * barrier.reach();
        map_into(par, pairs.len(), CHUNK, &mut self.scalars, |i| {
            let pair = pairs[i].pair;
            let corners = pair.corners(positions);
            let gap = pair.box_gap_squared(&corners);
            if gap >= reach {
                gap
            } else {
                pair.separation(&corners).squared
            }
        });
        let squared = self.scalars.iter().zip(pairs);
        squared
            .filter_map(|(s, pair)| (*s < reach).then_some(*pair))
            .collect()
    }
    /// Calls `add` on the element of each pair in turn; one out of reach is zero.
    ///
    /// Elements are 1.3 kB each: a block of them stays in the cache.
    ///
    /// # Panics
    /// With fewer positions than the pairs' indices need.
    pub fn for_each_barrier(
        &mut self,
        par: Par,
        barrier: &Barrier,
        positions: &[V3d],
        pairs: &[ActivePair],
        mut add: impl FnMut(&ContactElement),
    ) {
        for block in pairs.chunks(BLOCK) {
            map_into(par, block.len(), BLOCK_CHUNK, &mut self.elements, |k| {
                element(barrier, positions, &block[k])
            });
            self.elements.iter().for_each(&mut add);
        }
    }
    /// Energy of all pairs (J), without derivatives: infinite as soon as one pair is at or below the thickness.
    ///
    /// # Panics
    /// With fewer positions than the pairs' indices need.
    pub fn barrier_value(
        &mut self,
        par: Par,
        barrier: &Barrier,
        positions: &[V3d],
        pairs: &[ActivePair],
    ) -> f64 {
        map_into(par, pairs.len(), CHUNK, &mut self.scalars, |i| {
            barrier.value(&pairs[i], &pairs[i].pair.corners(positions))
        });
        self.scalars.iter().sum()
    }
    /// Calls `add` on the element of lagged friction of each pair in turn. `positions` (m) of all vertices.
    ///
    /// # Panics
    /// With fewer positions than the pairs' indices need.
    pub fn for_each_friction(
        &mut self,
        par: Par,
        friction: &Friction,
        positions: &[V3d],
        pairs: &[FrictionPair],
        mut add: impl FnMut(&ContactElement),
    ) {
        for block in pairs.chunks(BLOCK) {
            map_into(par, block.len(), BLOCK_CHUNK, &mut self.elements, |k| {
                ContactElement {
                    vertices: block[k].vertices,
                    energy: friction.energy(&block[k], &block[k].corners(positions)),
                }
            });
            self.elements.iter().for_each(&mut add);
        }
    }
    /// Energy of lagged friction of all pairs (J).
    ///
    /// # Panics
    /// With fewer positions than the pairs' indices need.
    pub fn friction_value(
        &mut self,
        par: Par,
        friction: &Friction,
        positions: &[V3d],
        pairs: &[FrictionPair],
    ) -> f64 {
        map_into(par, pairs.len(), CHUNK, &mut self.scalars, |k| {
            friction.value(&pairs[k], &pairs[k].corners(positions))
        });
        self.scalars.iter().sum()
    }
}

/// Element of one pair, with the projected curvature.
fn element(barrier: &Barrier, positions: &[V3d], active: &ActivePair) -> ContactElement {
    let corners = active.pair.corners(positions);
    ContactElement {
        vertices: active.pair.stencil(),
        energy: barrier
            .energy(active, &corners, Curvature::Projected)
            .unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::pair::ContactPair;
    use tryon_geometry::par::with_threads;

    /// Two triangulated strips, 5 mm apart.
    fn scene() -> (Vec<V3d>, Vec<ActivePair>) {
        let layer = |y: f64, shift: f64| {
            (0..600).map(move |i| {
                let along = f64::from(i / 2) * 0.01 + shift;
                let wave = 1e-3 * (f64::from(i) * 0.7).sin();
                V3d::new(along, y + wave, f64::from(i % 2) * 0.01)
            })
        };
        let x: Vec<V3d> = layer(0.0, 0.0).chain(layer(0.005, 0.003)).collect();
        let mut pairs = Vec::new();
        for i in 0..590u32 {
            for k in 0..4 {
                let f = [i + k, i + k + 1, i + k + 2];
                pairs.push(ContactPair::VertexFace { v: 600 + i, f });
                let (a, b) = ([600 + i, 601 + i], [i + k, i + k + 1]);
                pairs.push(ContactPair::EdgeEdge { a, b });
            }
        }
        let active = pairs.iter().map(|p| ActivePair::new(*p, &x)).collect();
        (x, active)
    }

    #[test]
    fn elements_are_the_same_at_any_thread_count() {
        let (x, pairs) = scene();
        let barrier = Barrier {
            stiffness: 1e-3,
            activation: 6e-3,
            thickness: 5e-4,
        };
        let run = |par| {
            let mut assembly = ContactAssembly::default();
            let near = assembly.within_reach(par, &barrier, &x, &pairs);
            let value = assembly.barrier_value(par, &barrier, &x, &pairs);
            let mut elements = Vec::new();
            let add = |e: &ContactElement| elements.push(*e);
            assembly.for_each_barrier(par, &barrier, &x, &near, add);
            (elements, near, value)
        };
        let one = run(Par::Seq);
        assert!(
            one.0.len() > 1000 && one.0.len() < pairs.len(),
            "{}",
            one.0.len()
        );
        for threads in [1, 2, 5] {
            let other = with_threads(threads, || run(Par::Rayon)).expect("threads");
            assert!(other == one, "{threads} threads");
        }
        let sum: f64 = one.0.iter().map(|e| e.energy.value).sum();
        assert!((sum - one.2).abs() < 1e-12 * sum);
    }

    #[test]
    fn a_box_gap_bounds_the_distance() {
        let (x, pairs) = scene();
        for active in &pairs {
            let corners = active.pair.corners(&x);
            let squared = active.pair.separation(&corners).squared;
            let gap = active.pair.box_gap_squared(&corners);
            assert!(gap <= squared * (1.0 + 1e-12), "{gap} {squared}");
        }
    }
}
