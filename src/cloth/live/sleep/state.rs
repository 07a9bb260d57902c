//! Sleep state of an outfit: stillness of the body, and which islands sleep.

use super::island_model::IslandModel;
use crate::live::garment_model::GarmentModel;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3, V3};

/// State of one island.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::live) struct Island {
    /// Steps in a row below the sleep speed.
    pub(super) slow_steps: u32,
    pub(super) asleep: bool,
    /// Speed in the last step, m/s.
    pub(super) speed: f32,
    /// Supporting body vertices and their positions when it fell asleep; empty while awake.
    pub(super) skin: Vec<(u32, P3)>,
    /// Its boundary edges when it fell asleep.
    pub(super) boundary: Vec<V3>,
}

/// Sleep state of an outfit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::live) struct SleepState {
    /// Body when it last moved beyond the sleep thresholds.
    pub(super) reference: Vec<P3>,
    /// Time that the body has been still, s.
    pub(in crate::live) still_time: f64,
    /// Steps in a row with body and cloth still.
    pub(super) still_steps: u32,
    /// Islands of each garment.
    pub(super) islands: Vec<Vec<Island>>,
    /// Position of each body vertex when it last moved, and steps since.
    pub(super) calm: Vec<(P3, u32)>,
    /// Position of each body vertex when it last moved far enough to wake cloth near it.
    pub(super) wake_reference: Vec<P3>,
}

impl SleepState {
    pub(in crate::live) fn new(body: &[P3]) -> Self {
        Self {
            reference: body.to_vec(),
            ..Self::default()
        }
    }
    /// Forgets all about islands.
    pub(super) fn reset_islands(&mut self) {
        self.islands.clear();
        self.calm.clear();
        self.wake_reference.clear();
    }
    /// Resets islands that do not fit the garments or the body.
    pub(super) fn fit(&mut self, garments: &[GarmentModel], body: &[P3]) {
        let counts = || garments.iter().map(|g| g.islands.members.len());
        if !self.islands.iter().map(Vec::len).eq(counts()) || self.calm.len() != body.len() {
            self.islands = counts().map(|n| vec![Island::default(); n]).collect();
            self.calm = body.iter().map(|p| (*p, 0)).collect();
            self.wake_reference = body.to_vec();
        }
    }
    /// Wakes all islands.
    pub(in crate::live) fn wake_all(&mut self) {
        let all = self.islands.iter_mut().flatten();
        all.for_each(|island| *island = Island::default());
    }
    pub(super) fn is_all_awake(&self) -> bool {
        self.islands.iter().flatten().all(|island| !island.asleep)
    }
    /// Sleeping vertices.
    pub(in crate::live) fn sleeping(&self, garments: &[GarmentModel]) -> usize {
        let of = |(m, islands): (&GarmentModel, &Vec<Island>)| -> usize {
            let all = islands.iter().zip(&m.islands.members);
            all.filter(|(island, _)| island.asleep)
                .map(|(_, members)| members.len())
                .sum()
        };
        garments.iter().zip(&self.islands).map(of).sum()
    }
    /// A vertex sleeps.
    pub(in crate::live) fn is_asleep(&self, m: &IslandModel, garment: usize, vertex: u32) -> bool {
        let island = || m.of[vertex as usize] as usize;
        self.islands
            .get(garment)
            .is_some_and(|all| all[island()].asleep)
    }
}
