//! Depth in metres as millimetres.

/// Millimetres of a depth in metres; 0, "no reading", for values that 16 bits do not hold.
pub(crate) fn metres_to_mm(metres: f64) -> u16 {
    let mm = (metres * 1000.0).round();
    if mm >= 0.0 && mm <= f64::from(u16::MAX) {
        mm as u16
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_that_are_none_become_zero() {
        for (metres, mm) in [
            (1.2344, 1234),
            (65.535, 65_535),
            (65.536, 0),
            (-1.0, 0),
            (f64::NAN, 0),
            (f64::INFINITY, 0),
        ] {
            assert_eq!(metres_to_mm(metres), mm, "{metres}");
        }
    }
}
