//! Depth of the Kinect v1's disparity, with the constants of its design.

/// Disparity of a pixel without a reading (`FREENECT_DEPTH_RAW_NO_VALUE`).
const NO_DISPARITY: u16 = 2047;
/// Largest depth that libfreenect states, millimetres (`FREENECT_DEPTH_MM_MAX_VALUE`).
const MAX_MM: f64 = 10_000.0;
/// Distance of the reference plane, millimetres: libfreenect's zero plane, whose values in the devices agree within 1 %.
pub(super) const REFERENCE_MM: f64 = 1200.0;
/// Size of a pixel on the reference plane of the sensor's 1280 columns, millimetres.
pub(super) const REFERENCE_PIXEL_MM: f64 = 1.042;
/// Distance of infrared camera and projector, millimetres.
const EMITTER_MM: f64 = 75.0;
/// Disparity of the reference plane, eighths of a pixel of 640 columns.
const REFERENCE_DISPARITY: f64 = 800.0;
/// Eighths of a pixel of 640 columns in a pixel of 1280.
const STEPS: f64 = 4.0;
/// Offset of the sensor's correlation window, pixels of 1280 columns.
const WINDOW: f64 = 0.375;

/// Depth in millimetres of a disparity, 0 where there is none: similar triangles on the reference plane, as
/// `freenect_raw_to_mm` of libfreenect's registration.c.
pub(crate) fn disparity_to_mm(disparity: u16) -> u16 {
    if disparity >= NO_DISPARITY {
        return 0;
    }
    let shift = (f64::from(disparity) - REFERENCE_DISPARITY) / STEPS - WINDOW;
    let shift_mm = shift * REFERENCE_PIXEL_MM;
    let mm = REFERENCE_MM * (1.0 + shift_mm / (EMITTER_MM - shift_mm));
    if mm > 0.0 && mm <= MAX_MM {
        mm as u16
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disparities_have_the_depths_that_others_measured() {
        // Depth of a published calibration, metres (Magnenat, "openkinect: imaging information", 2010; 1 % up to 3 m).
        let measured = |d: u16| 0.1236 * (f64::from(d) / 2842.5 + 1.1863).tan();
        for d in [500, 600, 700, 800, 900, 950] {
            let (got, want) = (f64::from(disparity_to_mm(d)) * 1e-3, measured(d));
            assert!((got / want - 1.0).abs() < 0.03, "{d}: {got} and {want} m");
        }
    }

    #[test]
    fn disparities_without_a_depth_are_zero() {
        for d in [1092, 1200, 2046, 2047, 2048, u16::MAX] {
            assert_eq!(disparity_to_mm(d), 0, "{d}");
        }
        assert!((0..1050).all(|d| disparity_to_mm(d) <= disparity_to_mm(d + 1)));
    }
}
