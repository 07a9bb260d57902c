//! Unknowns of a calibration, in words.

/// An unknown of the calibration, in axes of the colour camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExtrinsicAxis {
    /// Translation to the right.
    Right,
    /// Translation down.
    Down,
    /// Translation ahead.
    Ahead,
    /// Rotation about the axis to the right: tilt.
    Tilt,
    /// Rotation about the axis down: pan.
    Pan,
    /// Rotation about the optical axis: roll.
    Roll,
    /// Time offset.
    Time,
}

impl std::fmt::Display for ExtrinsicAxis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Right => "the translation to the right",
            Self::Down => "the translation down",
            Self::Ahead => "the translation ahead",
            Self::Tilt => "the tilt between the cameras",
            Self::Pan => "the pan between the cameras",
            Self::Roll => "the roll between the cameras",
            Self::Time => "the time offset",
        })
    }
}

impl ExtrinsicAxis {
    /// All, in the order of the unknowns.
    pub const ALL: [Self; 7] = [
        Self::Right,
        Self::Down,
        Self::Ahead,
        Self::Tilt,
        Self::Pan,
        Self::Roll,
        Self::Time,
    ];

    /// Unit of its deviation in words.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Right | Self::Down | Self::Ahead => "mm",
            Self::Tilt | Self::Pan | Self::Roll => "degrees",
            Self::Time => "ms",
        }
    }

    /// Motion that determines it.
    pub fn advice(self) -> &'static str {
        match self {
            Self::Right | Self::Down | Self::Tilt | Self::Pan => {
                "walk towards the camera and away from it, from 1.5 to 3.5 m"
            }
            Self::Ahead | Self::Roll => "walk to both sides of the picture, near the camera too",
            Self::Time => "walk across the picture, faster",
        }
    }

    /// From metres, radians and seconds to its unit.
    pub(crate) fn in_unit(self, value: f64) -> f64 {
        match self {
            Self::Tilt | Self::Pan | Self::Roll => value.to_degrees(),
            _ => 1e3 * value,
        }
    }
}
