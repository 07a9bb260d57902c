//! Averages over neighbours: the one smoothing of quantities on a mesh.

use super::Csr;
use crate::par::{self, Par};
use nalgebra::SVector;

/// A quantity that can be averaged.
pub trait Averaged: Clone {
    /// Adds `other` times `weight`.
    fn add_scaled(&mut self, other: &Self, weight: f64);
    /// Divides by `by`.
    fn divide(&mut self, by: f64);
}

macro_rules! averaged {
    ($($scalar:ty),*) => {$(
        impl Averaged for $scalar {
            fn add_scaled(&mut self, other: &Self, weight: f64) {
                *self += other * weight as $scalar;
            }
            fn divide(&mut self, by: f64) {
                *self /= by as $scalar;
            }
        }
    )*};
}
averaged!(f32, f64);

macro_rules! averaged_by_element {
    ($($collection:ty, [$($size:tt)*]);*) => {$(
        impl<T: Averaged + nalgebra::Scalar, $($size)*> Averaged for $collection {
            fn add_scaled(&mut self, other: &Self, weight: f64) {
                let pairs = self.iter_mut().zip(other);
                pairs.for_each(|(a, b)| a.add_scaled(b, weight));
            }
            fn divide(&mut self, by: f64) {
                self.iter_mut().for_each(|a| a.divide(by));
            }
        }
    )*};
}
averaged_by_element!(SVector<T, N>, [const N: usize]; [T; N], [const N: usize]; Vec<T>, []);

/// Mean of some values, added in their order; `None` of none.
pub fn mean<'a, T: Averaged + 'a>(mut values: impl Iterator<Item = &'a T>) -> Option<T> {
    let mut sum = values.next()?.clone();
    let mut count = 1.0;
    for value in values {
        sum.add_scaled(value, 1.0);
        count += 1.0;
    }
    sum.divide(count);
    Some(sum)
}

/// Half of a value and half of the mean of its neighbours; the value itself without neighbours.
pub fn half_mean<'a, T: Averaged + 'a>(
    own: &T,
    neighbours: impl ExactSizeIterator<Item = &'a T>,
) -> T {
    let mut sum = own.clone();
    if neighbours.len() > 0 {
        let share = 0.5 / neighbours.len() as f64;
        sum.divide(2.0);
        neighbours.for_each(|value| sum.add_scaled(value, share));
    }
    sum
}

/// One pass of [`half_mean`] over all vertices; shapes `[vertices]`.
pub fn smoothed<T: Averaged + Default + Send + Sync>(
    par: Par,
    neighbours: &Csr,
    values: &[T],
) -> Vec<T> {
    let mut next = Vec::new();
    par::map_into(par, values.len(), 256, &mut next, |i| {
        let around = neighbours.row(i).iter();
        half_mean(&values[i], around.map(|n| &values[*n as usize]))
    });
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    #[test]
    fn a_constant_stays_and_a_peak_spreads() {
        // A path of five vertices and one alone.
        let pairs: Vec<(u32, u32)> = (0..4).flat_map(|i| [(i, i + 1), (i + 1, i)]).collect();
        let path = Csr::from_pairs(6, &pairs);
        assert_eq!(smoothed(Par::Seq, &path, &[3.0f32; 6]), [3.0; 6]);
        let peak = smoothed(Par::Seq, &path, &[0.0, 0.0, 4.0, 0.0, 0.0, 7.0]);
        assert_eq!(peak, [0.0, 1.0, 2.0, 1.0, 0.0, 7.0]);
        let rows = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
        let pair = Csr::from_pairs(2, &[(0, 1), (1, 0)]);
        assert_eq!(smoothed(Par::Seq, &pair, &rows), [[0.5; 2]; 2]);
    }

    #[test]
    fn a_mean_of_nothing_is_nothing() {
        assert_eq!(mean(std::iter::empty::<&f64>()), None);
        let v = [Vector2::new(1.0f32, 2.0), Vector2::new(3.0, -2.0)];
        assert_eq!(mean(v.iter()), Some(Vector2::new(2.0, 0.0)));
    }
}
