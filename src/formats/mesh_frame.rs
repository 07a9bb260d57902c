//! Unit and axes of a mesh file as its user states them, and the map to metres, y up, facing +z.

use nalgebra::Matrix3;
use std::fmt;
use std::str::FromStr;

/// Metric units that exporters write, metres.
pub const METRIC_UNITS: [f64; 4] = [1.0, 0.1, 0.01, 0.001];
/// Inch and foot, metres.
pub const IMPERIAL_UNITS: [f64; 2] = [0.0254, 0.3048];

/// Names of units in options, with their length in metres. The first name of a length is the one shown.
const UNITS: [(&str, f64); 11] = [
    ("m", 1.0),
    ("dm", 0.1),
    ("cm", 0.01),
    ("mm", 0.001),
    ("inch", 0.0254),
    ("foot", 0.3048),
    ("in", 0.0254),
    ("ft", 0.3048),
    ("metre", 1.0),
    ("centimetre", 0.01),
    ("millimetre", 0.001),
];

/// Signed coordinate axis, written `y`, `+y` or `-y`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshAxis {
    /// 0 for x, 1 for y, 2 for z.
    pub index: usize,
    /// Points to smaller coordinates.
    pub is_negative: bool,
}

impl MeshAxis {
    /// All six, positive ones first.
    pub const ALL: [Self; 6] = [
        Self::new(0, false),
        Self::new(1, false),
        Self::new(2, false),
        Self::new(0, true),
        Self::new(1, true),
        Self::new(2, true),
    ];
    /// Up in this project's frames.
    pub const Y: Self = Self::new(1, false);
    /// Facing of a body in this project's frames.
    pub const Z: Self = Self::new(2, false);

    /// Axis of an index below 3.
    const fn new(index: usize, is_negative: bool) -> Self {
        Self { index, is_negative }
    }
    /// The axis that points the other way.
    pub const fn opposite(self) -> Self {
        Self::new(self.index, !self.is_negative)
    }
    /// Unit vector.
    pub fn vector(self) -> [f64; 3] {
        let mut out = [0.0; 3];
        out[self.index] = if self.is_negative { -1.0 } else { 1.0 };
        out
    }
    /// The axis nearest to a direction, and the cosine of the angle between them; `None` for a vector without length.
    pub fn nearest(direction: [f64; 3]) -> Option<(Self, f64)> {
        let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let index = (0..3).max_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs()))?;
        let axis = Self::new(index, direction[index] < 0.0);
        Some((axis, direction[index].abs() / length))
    }
}

impl fmt::Display for MeshAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.is_negative { "-" } else { "" };
        write!(f, "{sign}{}", ["x", "y", "z"][self.index.min(2)])
    }
}

impl FromStr for MeshAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.trim().to_ascii_lowercase();
        let (is_negative, letter) = match lower.strip_prefix('-') {
            Some(letter) => (true, letter),
            None => (false, lower.strip_prefix('+').unwrap_or(&lower)),
        };
        let index = ["x", "y", "z"].iter().position(|a| *a == letter);
        index
            .map(|index| Self::new(index, is_negative))
            .ok_or_else(|| format!("`{text}` is no axis; expected x, y, z, -x, -y or -z"))
    }
}

/// Metres in a unit by its name: `m`, `dm`, `cm`, `mm`, `inch`, `foot`, or metres as a number.
///
/// # Errors
/// Lists the names.
pub fn metres_per_unit(text: &str) -> Result<f64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let named = UNITS.iter().find(|(name, _)| *name == lower).map(|u| u.1);
    let number = || {
        lower
            .parse()
            .ok()
            .filter(|m: &f64| m.is_finite() && *m > 0.0)
    };
    named.or_else(number).ok_or_else(|| {
        format!("`{text}` is no unit; expected m, dm, cm, mm, inch, foot or metres as a number")
    })
}

/// Name of the unit of this many metres, or the number of metres.
pub fn unit_name(metres: f64) -> String {
    let named = UNITS.iter().find(|u| (u.1 - metres).abs() < 1e-9 * metres);
    named.map_or_else(|| format!("{metres} m"), |u| u.0.to_owned())
}

/// Names of the options by which a file's frame is stated, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameOptions {
    /// Of [`MeshFrame::metres_per_unit`].
    pub unit: &'static str,
    /// Of [`MeshFrame::up`].
    pub up: &'static str,
    /// Of [`MeshFrame::facing`].
    pub facing: &'static str,
}

impl FrameOptions {
    /// Options of the only file with a frame.
    pub const PLAIN: Self = Self {
        unit: "--unit",
        up: "--up",
        facing: "--facing",
    };
}

impl Default for FrameOptions {
    fn default() -> Self {
        Self::PLAIN
    }
}

/// Unit and axes of a mesh file as far as its user states them; the rest is recognised from the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshFrame {
    /// Metres in one unit of the file.
    pub metres_per_unit: Option<f64>,
    /// Axis of the file that points from the feet to the head.
    pub up: Option<MeshAxis>,
    /// Axis of the file that points ahead of the wearer.
    pub facing: Option<MeshAxis>,
    /// Options that state these.
    pub options: FrameOptions,
}

impl MeshFrame {
    /// The project's own frame: metres, y up, facing +z.
    pub const OWN: Self = Self {
        metres_per_unit: Some(1.0),
        up: Some(MeshAxis::Y),
        facing: Some(MeshAxis::Z),
        options: FrameOptions::PLAIN,
    };
}

/// Proper rotation that takes the file's `up` to +y and its `facing` to +z; `None` if they lie along one axis.
pub fn upright_rotation(up: MeshAxis, facing: MeshAxis) -> Option<Matrix3<f64>> {
    let [y, z] = [up, facing].map(|a| nalgebra::Vector3::from(a.vector()));
    let x = y.cross(&z);
    (up.index != facing.index)
        .then(|| Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_and_units_are_read_and_written() {
        for (text, shown) in [("y", "y"), ("+Z", "z"), ("-x", "-x")] {
            let axis: MeshAxis = text.parse().expect("an axis");
            assert_eq!(axis.to_string(), shown);
        }
        assert!(
            "up".parse::<MeshAxis>()
                .expect_err("no axis")
                .contains("-z")
        );
        assert_eq!(metres_per_unit("cm"), Ok(0.01));
        assert_eq!(metres_per_unit("0.5"), Ok(0.5));
        assert!(
            metres_per_unit("furlong")
                .expect_err("unknown")
                .contains("inch")
        );
        assert_eq!(
            (unit_name(0.0254), unit_name(0.3)),
            ("inch".into(), "0.3 m".into())
        );
    }

    #[test]
    fn rotations_are_proper_and_bring_up_to_y() {
        for up in MeshAxis::ALL {
            for facing in MeshAxis::ALL {
                let Some(m) = upright_rotation(up, facing) else {
                    assert_eq!(up.index, facing.index);
                    continue;
                };
                assert!((m.determinant() - 1.0).abs() < 1e-12);
                assert_eq!(
                    m * nalgebra::Vector3::from(up.vector()),
                    nalgebra::Vector3::y()
                );
                assert_eq!(
                    m * nalgebra::Vector3::from(facing.vector()),
                    nalgebra::Vector3::z()
                );
            }
        }
        assert_eq!(
            MeshAxis::nearest([0.1, -0.9, 0.0]).map(|n| n.0),
            "-y".parse().ok()
        );
    }
}
