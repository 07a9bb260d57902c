//! Published body measurements that the figure's means and standard deviations come from.
//!
//! Source: Gordon et al., 2012 Anthropometric Survey of U.S. Army Personnel (ANSUR II), NATICK/TR-15/007, 2014:
//! 4,082 men and 1,986 women. Means and standard deviations in metres, rounded to millimetres.

/// Mean and standard deviation of men and of women, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistic {
    /// Men: mean, standard deviation.
    pub men: [f64; 2],
    /// Women: mean, standard deviation.
    pub women: [f64; 2],
    /// Correlation within a sex, rounded: of a girth with body mass, of a length or breadth with stature; 0 where unused.
    pub correlation: f64,
}

impl Statistic {
    const fn new(men: [f64; 2], women: [f64; 2], correlation: f64) -> Self {
        Self {
            men,
            women,
            correlation,
        }
    }
    /// Middle between the means of both sexes.
    pub const fn mean(&self) -> f64 {
        0.5 * (self.men[0] + self.women[0])
    }
    /// Middle of the standard deviations within each sex.
    pub const fn deviation(&self) -> f64 {
        0.5 * (self.men[1] + self.women[1])
    }
    /// Half the difference between the sexes.
    pub const fn sex(&self) -> f64 {
        0.5 * (self.men[0] - self.women[0])
    }
    /// Standard deviation at a given body mass or stature.
    pub fn residual(&self) -> f64 {
        let r = self.correlation;
        self.deviation() * (1.0 - r * r).sqrt()
    }
}

/// Stature.
pub const STATURE: Statistic = Statistic::new([1.756, 0.069], [1.628, 0.064], 0.0);
/// Chest circumference (at bust point height).
pub const CHEST: Statistic = Statistic::new([1.059, 0.087], [0.947, 0.083], 0.90);
/// Waist circumference (omphalion).
pub const WAIST: Statistic = Statistic::new([0.941, 0.112], [0.861, 0.100], 0.90);
/// Buttock circumference.
pub const HIP: Statistic = Statistic::new([1.020, 0.076], [1.021, 0.076], 0.93);
/// Neck circumference.
pub const NECK: Statistic = Statistic::new([0.398, 0.026], [0.330, 0.018], 0.0);
/// Thigh circumference, under the fold of the buttock.
pub const THIGH: Statistic = Statistic::new([0.625, 0.058], [0.617, 0.056], 0.0);
/// Calf circumference.
pub const CALF: Statistic = Statistic::new([0.392, 0.029], [0.372, 0.029], 0.0);
/// Biacromial breadth.
pub const SHOULDERS: Statistic = Statistic::new([0.416, 0.019], [0.365, 0.018], 0.45);
/// Crotch height.
pub const CROTCH: Statistic = Statistic::new([0.846, 0.046], [0.779, 0.045], 0.87);
/// Sitting height.
pub const SITTING: Statistic = Statistic::new([0.918, 0.036], [0.857, 0.033], 0.79);
