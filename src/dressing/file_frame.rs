//! Unit and frame of a mesh file.

use nalgebra::Matrix3;
use tryon_formats::mesh_frame::{
    IMPERIAL_UNITS, METRIC_UNITS, MeshAxis, MeshFrame, unit_name, upright_rotation,
};
use tryon_geometry::math::{P3, V3};

/// Map from a file's own unit and frame to metres, y up, facing +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FileFrame {
    /// Metres in one unit of the file.
    pub(super) scale: f32,
    pub(super) rotation: Matrix3<f32>,
    /// Added last, metres.
    pub(super) shift: V3,
}

impl FileFrame {
    /// The project's own frame.
    pub(super) fn metres() -> Self {
        FileAxes::OWN.frame()
    }
    pub(super) fn to_metres(self, p: &P3) -> P3 {
        self.rotation * p * self.scale + self.shift
    }
}

/// Unit and axes in which a file may be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FileAxes {
    /// Metres in one unit of the file.
    pub(super) unit: f64,
    pub(super) up: MeshAxis,
    pub(super) facing: MeshAxis,
}

impl FileAxes {
    const OWN: Self = Self {
        unit: 1.0,
        up: MeshAxis::Y,
        facing: MeshAxis::Z,
    };

    /// All that agree with what is stated. Units are those in which `extent` lies within `limits` (m); metres where none is.
    pub(super) fn candidates(extent: f32, limits: [f32; 2], stated: &MeshFrame) -> Vec<Self> {
        let is_plausible = |unit: &f64| {
            let metres = f64::from(extent) * unit;
            metres > f64::from(limits[0]) && metres < f64::from(limits[1])
        };
        let mut units: Vec<f64> = match stated.metres_per_unit {
            Some(unit) => vec![unit],
            None => METRIC_UNITS
                .into_iter()
                .chain(IMPERIAL_UNITS)
                .filter(is_plausible)
                .collect(),
        };
        if units.is_empty() {
            units.push(1.0);
        }
        let axes = |stated: Option<MeshAxis>| stated.map_or(MeshAxis::ALL.to_vec(), |a| vec![a]);
        let mut out = Vec::new();
        for unit in units {
            for up in axes(stated.up) {
                let across = axes(stated.facing).into_iter();
                let facing = across.filter(|f| f.index != up.index);
                out.extend(facing.map(|facing| Self { unit, up, facing }));
            }
        }
        out
    }
    /// The map to metres, without a shift.
    pub(super) fn frame(&self) -> FileFrame {
        let rotation = upright_rotation(self.up, self.facing);
        FileFrame {
            scale: self.unit as f32,
            rotation: rotation.map_or_else(Matrix3::identity, |r| r.cast()),
            shift: V3::zeros(),
        }
    }
    /// True for the axes of most files: y up and facing z, or z up and facing -y.
    pub(super) fn is_conventional(&self) -> bool {
        let usual = [
            (MeshAxis::Y, MeshAxis::Z),
            (MeshAxis::Z, MeshAxis::Y.opposite()),
        ];
        usual.contains(&(self.up, self.facing))
    }
    /// The same, facing the other way.
    pub(super) fn turned(&self) -> Self {
        Self {
            facing: self.facing.opposite(),
            ..*self
        }
    }
}

impl std::fmt::Display for FileAxes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (unit, up, facing) = (unit_name(self.unit), self.up, self.facing);
        write!(f, "in {unit}, {up} up, facing {facing}")
    }
}

/// Lowest and highest corner of some points.
pub(super) fn bounds<'a>(points: impl Iterator<Item = &'a P3>) -> (P3, P3) {
    points.fold(
        (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3])),
        |(lo, hi), p| (lo.inf(p), hi.sup(p)),
    )
}
