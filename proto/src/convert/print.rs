//! Prints of garments on the wire.

use super::WireError;
use crate::v1;

/// Shortest and longest repeat, metres.
const PERIODS: [f32; 2] = [0.005, 1.0];

/// Checks a print in the field of that name; none is fine.
///
/// # Errors
/// Names its field at fault.
pub(super) fn check(field: &str, print: Option<&v1::GarmentPrint>) -> Result<(), WireError> {
    let Some(print) = print else {
        return Ok(());
    };
    let fault = |name: &str, why: &str| Err(WireError::new(format!("{field}.{name}"), why));
    if print.kind() == v1::GarmentPrintKind::Unspecified {
        return fault("kind", "is not known");
    }
    if print.color_rgb > 0xff_ff_ff {
        return fault("color_rgb", "0xRRGGBB, so at most 16777215");
    }
    let [least, most] = PERIODS;
    if !(print.period >= least && print.period <= most) {
        return fault("period", "0.005 to 1 m");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_name_their_field() {
        let good = v1::GarmentPrint {
            kind: v1::GarmentPrintKind::Check.into(),
            color_rgb: 0x10_20_30,
            period: 0.06,
        };
        assert!(check("p", Some(&good)).is_ok() && check("p", None).is_ok());
        let kind = v1::GarmentPrint { kind: 99, ..good };
        let color = v1::GarmentPrint {
            color_rgb: 0x1_00_00_00,
            ..good
        };
        let period = v1::GarmentPrint {
            period: f32::NAN,
            ..good
        };
        for (bad, name) in [
            (kind, "p.kind"),
            (color, "p.color_rgb"),
            (period, "p.period"),
        ] {
            assert_eq!(check("p", Some(&bad)).expect_err(name).field, name);
        }
    }
}
