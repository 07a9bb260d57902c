//! Landmarks from the numbers of the network.

use crate::detection::probability;
use crate::landmark::LANDMARKS;
use crate::network::{LANDMARK_PIXELS, LandmarkOutput};
use crate::{Landmark, LandmarkError, PersonRegion, PoseLandmarks};
use nalgebra::Vector3;

/// Numbers of a point in the picture: column, row, depth, visibility, presence.
const NUMBERS: usize = 5;
/// Points of the network: the landmarks, the middle between the hips and the reach of the body, four of the hands.
const POINTS: usize = 39;

/// Landmarks of a person whom the network saw in `region` of a picture of `image` columns and rows.
///
/// # Errors
/// [`LandmarkError::Network`] for another number of points.
pub(crate) fn decode(
    output: &LandmarkOutput,
    region: PersonRegion,
    image: [u32; 2],
) -> Result<PoseLandmarks, LandmarkError> {
    let (screen, _) = output.screen.as_chunks::<NUMBERS>();
    let (world, _) = output.world.as_chunks::<3>();
    if screen.len() != POINTS || world.len() != POINTS {
        let why = format!("{} and {} points, not {POINTS}", screen.len(), world.len());
        return Err(LandmarkError::network("landmarks", why));
    }
    let pixel = |k: usize| {
        let [x, y, ..] = screen[k];
        region.pixel([x, y].map(|c| c / LANDMARK_PIXELS as f32 - 0.5))
    };
    let landmarks = std::array::from_fn(|k| {
        let [.., visibility, presence] = screen[k].map(probability);
        let [x, y, z] = world[k];
        let [x, y] = region.direction([x, y]);
        Landmark {
            pixel: pixel(k),
            visibility,
            presence,
            guess: Vector3::new(x, y, z),
        }
    });
    Ok(PoseLandmarks {
        landmarks,
        presence: output.presence,
        image,
        region,
        next_region: PersonRegion::around(pixel(LANDMARKS), pixel(LANDMARKS + 1)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LandmarkKind;

    #[test]
    fn numbers_become_pixels_of_the_turned_region() {
        let mut output = LandmarkOutput {
            screen: [128.0, 128.0, 0.0, 0.0, 50.0].repeat(POINTS),
            presence: 0.75,
            world: [0.0; 3].repeat(POINTS),
        };
        let elbow = LandmarkKind::LeftElbow as usize;
        assert_eq!(elbow, 13);
        output.screen[elbow * NUMBERS..][..2].copy_from_slice(&[192.0, 128.0]);
        output.world[elbow * 3..][..3].copy_from_slice(&[0.1, 0.0, -0.2]);
        // The reach lies a quarter of the side above.
        output.screen[34 * NUMBERS + 1] = 64.0;
        let region = PersonRegion {
            centre: [50.0, 60.0],
            side: 100.0,
            roll: std::f32::consts::FRAC_PI_2,
        };
        let pose = decode(&output, region, [320, 240]).expect("39 points");
        let landmark = pose.at(LandmarkKind::LeftElbow);
        // The right of an upright person who is turned clockwise by a quarter is the picture's lower side.
        assert!((landmark.pixel[0] - 50.0).abs() < 1e-4 && (landmark.pixel[1] - 85.0).abs() < 1e-4);
        assert!((landmark.guess - Vector3::new(0.0, 0.1, -0.2)).norm() < 1e-6);
        assert_eq!((landmark.visibility, landmark.presence), (0.5, 1.0));
        let next = pose.next_region.expect("an extent");
        assert!((next.side - 62.5).abs() < 1e-3 && (next.roll - region.roll).abs() < 1e-5);
        output.world.pop();
        assert!(decode(&output, region, [320, 240]).is_err());
    }
}
