//! Medians, percentiles and quantiles by nearest rank: always one of the values, found in linear time.

use std::cmp::Ordering;
use std::ops::Index;

/// A scalar in total order; a positive NaN counts as largest.
pub trait TotalOrder: Copy {
    /// Total comparison.
    fn total_order(&self, other: &Self) -> Ordering;
}

macro_rules! total_order {
    ($($scalar:ty, $compare:path);*) => {$(
        impl TotalOrder for $scalar {
            fn total_order(&self, other: &Self) -> Ordering {
                $compare(self, other)
            }
        }
    )*};
}
total_order!(f32, f32::total_cmp; f64, f64::total_cmp; u8, Ord::cmp);

/// Value of an ascending rank from 0, the last at most; `None` of nothing.
fn ranked<T: TotalOrder>(values: &mut [T], rank: usize) -> Option<T> {
    let rank = rank.min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(rank, T::total_order).1)
}

/// Value of rank ⌊n · `hundredths` / 100⌋ of n values, which are reordered; `None` of nothing.
pub fn percentile<T: TotalOrder>(values: &mut [T], hundredths: usize) -> Option<T> {
    ranked(values, values.len() * hundredths / 100)
}

/// Value of the rank nearest to (n − 1) · `share` of n values, which are reordered; `None` of nothing.
pub fn quantile<T: TotalOrder>(values: &mut [T], share: f64) -> Option<T> {
    let last = values.len().saturating_sub(1) as f64;
    ranked(values, (share * last).round() as usize)
}

/// Median of some values, which are reordered; of an even number the larger middle one. `None` of nothing.
pub fn median<T: TotalOrder>(values: &mut [T]) -> Option<T> {
    percentile(values, 50)
}

/// Median of each coordinate of some vectors; `None` of nothing.
pub fn medians<T, const N: usize>(vectors: &[impl Index<usize, Output = T>]) -> Option<[T; N]>
where
    T: TotalOrder + Default,
{
    let mut out = [T::default(); N];
    for (k, out) in out.iter_mut().enumerate() {
        *out = median(&mut vectors.iter().map(|v| v[k]).collect::<Vec<_>>())?;
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::V3d;

    #[test]
    fn percentiles_of_a_range_have_their_closed_form_and_of_nothing_none() {
        let mut all: Vec<f32> = (0..200).rev().map(|i| i as f32).collect();
        assert_eq!(percentile(&mut all, 95), Some(190.0));
        assert_eq!(percentile(&mut all, 100), Some(199.0));
        assert_eq!(percentile(&mut [3.0], 99), Some(3.0));
        assert_eq!(percentile::<f32>(&mut [], 99), None);
        assert_eq!(percentile(&mut [f32::NAN, 1.0, 2.0], 34), Some(2.0));
    }

    #[test]
    fn quantiles_take_the_nearest_rank() {
        let mut all = [4.0, 1.0, 3.0, 2.0, 5.0];
        let ranks = [0.0, 0.1, 0.2, 0.5, 1.0].map(|share| quantile(&mut all, share));
        assert_eq!(ranks, [1.0, 1.0, 2.0, 3.0, 5.0].map(Some));
        assert_eq!(quantile::<f64>(&mut [], 0.5), None);
    }

    #[test]
    fn medians_are_of_each_coordinate() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4u8, 1, 2, 3]), Some(3));
        let vectors = [V3d::new(1.0, 5.0, 2.0), V3d::x(), V3d::new(0.0, 9.0, 1.0)];
        assert_eq!(medians(&vectors), Some([1.0, 5.0, 1.0]));
        assert_eq!(medians::<u8, 3>(&[[0u8; 3]; 0]), None);
    }
}
