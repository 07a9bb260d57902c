//! Floor residual: the joints of a hidden foot stand at their known height over the floor; a planted foot keeps its
//! ankle's place and its direction.

use super::{Residual, RowTerm};
use crate::registration::{Dof, ROOT_UNKNOWNS, is_ancestor};
use crate::settings::FloorSettings;
use nalgebra::Vector3;
use tryon_geometry::math::P3d;
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Foot of one leg and the joint angles that move it.
#[derive(Clone, Debug)]
pub struct FootChain {
    /// Ankle, then ball: joint and its height over the floor in a standing foot, metres.
    pub soles: Vec<(usize, f64)>,
    /// Joint angles from the hip down.
    pub angles: Vec<usize>,
}

/// Floor under the subject, camera frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorPlane {
    /// Unit vector against gravity.
    pub up: Vector3<f64>,
    /// Height of the floor along it, metres.
    pub height: f64,
}

/// Hidden joints of one foot.
#[derive(Clone, Copy)]
pub struct FloorResidual<'a> {
    /// Foot and angles.
    pub foot: &'a FootChain,
    /// Floor.
    pub floor: FloorPlane,
    /// Remembered positions of ankle and ball when the foot is planted.
    pub planted: Option<[Vector3<f64>; 2]>,
    /// Joints of the posed body, camera frame.
    pub joints: &'a [P3d],
    /// Parent of each joint.
    pub parents: &'a [Option<usize>],
    /// All degrees of freedom, as twists about `centre`.
    pub dofs: &'a [Dof],
    /// Origin of the twists.
    pub centre: &'a Vector3<f64>,
    /// Share (0 to 1) of each joint angle that no reading holds: only that share moves.
    pub unseen: &'a [f64],
    /// Readings: a joint in view follows them and is left out.
    pub grid: &'a OrganisedCloud,
    /// Weights and kernel.
    pub settings: FloorSettings,
}

/// Row of the residual: distance `off` along `along` of `joint`, relative to the joint `from` where there is one, metres.
struct FloorRow {
    joint: usize,
    from: Option<usize>,
    off: Vector3<f64>,
    along: Vector3<f64>,
    weight: f64,
}

/// Depth behind a reading from which a joint is hidden by it, metres: twice the radius of a limb.
const HIDDEN: f32 = 0.15;

/// True for a joint whose cell has a reading of the subject, or of something not before it: it follows readings instead of the
/// floor.
pub fn is_in_view(grid: &OrganisedCloud, joint: &P3d) -> bool {
    let joint = joint.cast::<f32>();
    let home = grid.cell_of(&joint).and_then(|(u, v)| grid.cell(u, v));
    home.is_some_and(|k| {
        let is_before = grid.depth[k] > 0.0 && grid.depth[k] < joint.z - HIDDEN;
        match grid.labels[k] {
            Label::Unknown => false,
            Label::Person => true,
            Label::Background | Label::Floor | Label::Other => !is_before,
        }
    })
}

impl FloorResidual<'_> {
    /// Velocity of a joint per unit of a degree of freedom, metres.
    fn velocity(&self, joint: usize, dof: &Dof) -> Vector3<f64> {
        if is_ancestor(self.parents, dof.bone, joint) {
            let at = self.joints[joint].coords - self.centre;
            dof.twist.velocity_at(&at)
        } else {
            Vector3::zeros()
        }
    }

    /// Visits one row.
    fn row(&self, row: &FloorRow, visit: &mut impl FnMut(&RowTerm<'_>)) {
        let along = row.along;
        let slope = |&k: &usize| {
            let dof = &self.dofs[ROOT_UNKNOWNS + k];
            let base = row
                .from
                .map_or_else(Vector3::zeros, |f| self.velocity(f, dof));
            along.dot(&(self.velocity(row.joint, dof) - base)) * self.unseen[k]
        };
        let slopes: Vec<f64> = self.foot.angles.iter().map(slope).collect();
        visit(&RowTerm {
            angles: &self.foot.angles,
            slopes: &slopes,
            residual: along.dot(&row.off),
            weight: row.weight,
        });
    }
}

impl Residual for FloorResidual<'_> {
    type Term<'t> = RowTerm<'t>;

    fn for_each(&self, mut visit: impl FnMut(&RowTerm<'_>)) {
        let up = self.floor.up;
        let (Some(&(ankle, _)), Some(across)) = (
            self.foot.soles.first(),
            up.cross(&Vector3::z()).try_normalize(0.0),
        ) else {
            return;
        };
        for (part, &(joint, height)) in self.foot.soles.iter().enumerate() {
            let at = self.joints[joint];
            if is_in_view(self.grid, &at) {
                continue;
            }
            let off = self.floor.height + height - up.dot(&at.coords);
            let weight = match self.planted {
                Some(_) => self.settings.planted_height,
                None => self.settings.height,
            };
            let kernel = self.settings.kernel * self.settings.kernel;
            let weight = weight * (kernel / (kernel + off * off)).powi(2);
            let rise = FloorRow {
                joint,
                from: None,
                off: up * off,
                along: up,
                weight,
            };
            self.row(&rise, &mut visit);
            let Some([kept_ankle, kept_ball]) = self.planted else {
                continue;
            };
            let (from, off, weight) = if part == 0 {
                (None, kept_ankle - at.coords, self.settings.place)
            } else {
                let now = at - self.joints[ankle];
                let kept = kept_ball - kept_ankle;
                (Some(ankle), kept - now, self.settings.direction)
            };
            for along in [across, up.cross(&across)] {
                let slide = FloorRow {
                    joint,
                    from,
                    off,
                    along,
                    weight,
                };
                self.row(&slide, &mut visit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::residual::check::Chain;
    use tryon_geometry::camera::{DepthImage, Intrinsics};

    #[test]
    fn a_joint_behind_a_reading_is_hidden() {
        let camera = Intrinsics::KINECT_V1;
        let mut depth = DepthImage::empty(camera.width, camera.height);
        depth.data_mut().fill(2000);
        let mut grid = OrganisedCloud::new(&camera, None);
        grid.sample(&depth, 8.0);
        grid.labels.fill(Label::Floor);
        for (z, is_seen) in [(1.9, true), (2.1, true), (2.3, false)] {
            assert_eq!(is_in_view(&grid, &P3d::new(0.1, 0.2, z)), is_seen, "{z} m");
        }
        let behind = P3d::new(0.1, 0.2, 2.3);
        for (label, is_seen) in [(Label::Unknown, false), (Label::Person, true)] {
            grid.labels.fill(label);
            assert_eq!(is_in_view(&grid, &behind), is_seen, "{label:?}");
        }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let grid = OrganisedCloud::new(&Intrinsics::KINECT_V1, None);
        let ball_and_ankle = [Vector3::new(0.1, 0.6, 2.0), Vector3::new(0.2, 0.6, 1.9)];
        for planted in [None, Some(ball_and_ankle)] {
            Chain::check_rows(|chain, x, weight, visit| {
                let joints = chain.moved(x);
                let floor = FloorResidual {
                    foot: &FootChain {
                        soles: vec![(2, 0.05), (3, 0.02)],
                        angles: chain.angles.clone(),
                    },
                    floor: FloorPlane {
                        up: -Vector3::y(),
                        height: -0.7,
                    },
                    planted,
                    joints: &joints,
                    parents: &chain.parents,
                    dofs: &chain.dofs,
                    centre: &chain.centre,
                    unseen: &[1.0; 4],
                    grid: &grid,
                    settings: FloorSettings {
                        height: weight,
                        planted_height: 0.5 * weight,
                        place: 2.0 * weight,
                        direction: weight,
                        ..FloorSettings::default()
                    },
                };
                floor.for_each(visit);
            });
        }
    }
}
