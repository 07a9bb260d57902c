//! Recordings that yield no calibration.

use super::axis::ExtrinsicAxis;
use tryon_formats::FormatError;

/// Recording from which the extrinsics cannot be estimated.
#[derive(Debug, thiserror::Error)]
pub enum ExtrinsicsError {
    /// A recording that cannot be read again.
    #[error(transparent)]
    Recording(#[from] FormatError),
    /// Colour without a camera of its own.
    #[error(
        "the calibration has no `color` camera, which means that colour is registered to depth already: give the lens of \
         the colour camera in a camera.json"
    )]
    Registered,
    /// Too few frames with depth and colour.
    #[error("{got} frames have depth and colour, {least} are needed: record for ten seconds")]
    TooFewFrames {
        /// Frames read.
        got: usize,
        /// Frames needed.
        least: usize,
    },
    /// A scene without light.
    #[error(
        "the picture is too dark: its median brightness is {brightness} of 255, {least} is needed"
    )]
    TooDark {
        /// Median of the brightest channel of the empty scene.
        brightness: u8,
        /// Brightness needed.
        least: u8,
    },
    /// Nobody who moves.
    #[error(
        "a person who moves is in {with_person} of {frames} frames, {least} are needed: one person walks before the camera, \
         and the camera stands still"
    )]
    Nobody {
        /// Frames with a person.
        with_person: usize,
        /// Frames searched.
        frames: usize,
        /// Frames needed.
        least: usize,
    },
    /// An outline that colour does not show.
    #[error(
        "{share:.0} % of the person's outline is found in colour, {least:.0} % are needed: the clothes have the colour of \
         the wall, the light changes, or the cameras differ by more than 7° or 10 cm from the calibration to start from"
    )]
    NotMet {
        /// Share found (percent).
        share: f64,
        /// Share needed (percent).
        least: f64,
    },
    /// Outlines that don't fit.
    #[error(
        "outlines in colour and depth differ by {residual:.1} pixels, at most {most:.1} are allowed: the intrinsics are \
         wrong, or the camera moved"
    )]
    Unlike {
        /// Standard deviation of the residuals (pixels of reduced colour).
        residual: f64,
        /// Largest allowed.
        most: f64,
    },
    /// An unknown that the motion does not determine.
    #[error("{axis} is known to ±{deviation:.1} {} only, ±{most:.1} {} are needed: {}", axis.unit(), axis.unit(), axis.advice())]
    Unobservable {
        /// The least known one.
        axis: ExtrinsicAxis,
        /// Its standard deviation, in the unit of the axis.
        deviation: f64,
        /// Largest allowed.
        most: f64,
    },
}
