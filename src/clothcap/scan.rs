//! A scan made ready: finite points in metres, y up, with normals and colours.

use super::CaptureError;
pub(super) use super::cloud::mean_spacing;
use super::cloud::{are_strays, neighbour_edges, plane_normals, spatial_order, turn_outwards};
use super::floor::{Floor, are_floor_rests, inner_range};
use super::settings::{CloudSettings, ScanSettings};
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};
use tryon_formats::TexturePoint;
use tryon_formats::scan::ScanMesh;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, Face, MeshRepairReport, edges, vertex_normals};
use tryon_geometry::par::Par;

/// Units of scans, metres: metre, centimetre, millimetre, inch, decimetre.
const UNITS: [f64; 5] = [1.0, 0.01, 0.001, 0.0254, 0.1];
/// Largest coordinate, metres: single precision resolves a millimetre up to it.
const FARTHEST: f64 = 8e3;

/// Units and axes of a scan file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanFrame {
    /// Metres per unit of the file.
    pub metres_per_unit: f64,
    /// Direction against gravity in the file's axes, unit vector.
    pub up: [f64; 3],
    /// Height along it, in the file's units, below which points belong to the floor.
    #[serde(default)]
    pub floor: Option<f64>,
}

impl Default for ScanFrame {
    /// Metres, y up.
    fn default() -> Self {
        Self {
            metres_per_unit: 1.0,
            up: [0.0, 1.0, 0.0],
            floor: None,
        }
    }
}

impl ScanFrame {
    /// Rotation from the file's axes to y up.
    pub fn rotation(&self) -> Rotation3<f64> {
        rotation_to_y(self.up.into())
    }

    /// The same frame with the floor that points stand on, if they do.
    pub fn with_floor(self, points: &[P3]) -> Self {
        let settings = ScanSettings::default();
        let up: Vector3<f64> = self.up.into();
        let floor = Floor::find(points, &settings.floor)
            .filter(|f| f.up.cast::<f64>().dot(&up) > settings.level);
        Self {
            floor: floor.map(|f| f64::from(f.top())),
            ..self
        }
    }

    /// Frames in which points could be an upright person, most likely first; a floor tells the axis.
    ///
    /// # Errors
    /// [`CaptureError::NoPersonSize`] without any.
    pub fn candidates(points: &[P3]) -> Result<Vec<Self>, CaptureError> {
        let settings = ScanSettings::default();
        let Some(floor) = Floor::find(points, &settings.floor) else {
            return Self::along_axes(points, &settings);
        };
        let up = floor.up.cast::<f64>();
        let turn = rotation_to_y(up).cast::<f32>();
        let person = points.iter().filter(|p| !floor.holds(p));
        let person: Vec<P3> = person.map(|p| turn * p).collect();
        let mut all = Self::along_axes(&person, &settings)?;
        all.retain(|f| f.up == Self::default().up);
        for frame in &mut all {
            (frame.up, frame.floor) = (up.into(), Some(f64::from(floor.top())));
        }
        if all.is_empty() {
            let extent = extent(&person, settings.strays);
            return Err(CaptureError::NoPersonSize { extent });
        }
        Ok(all)
    }

    /// Frames with an upright axis of the file.
    fn along_axes(points: &[P3], settings: &ScanSettings) -> Result<Vec<Self>, CaptureError> {
        let extent = extent(points, settings.strays);
        let largest = extent.iter().copied().fold(0.0, f32::max);
        let [least, most] = settings.heights;
        let is_person = |unit: &f64| (least..=most).contains(&(f64::from(largest) * unit));
        let mut all = Vec::new();
        for &metres_per_unit in UNITS.iter().filter(|u| is_person(u)) {
            let is_tall =
                |a: &usize| f64::from(extent[*a]) >= settings.upright * f64::from(largest);
            let mut axes: Vec<usize> = (0..3).filter(is_tall).collect();
            axes.sort_by(|&a, &b| extent[b].total_cmp(&extent[a]));
            for (axis, sign) in axes.into_iter().flat_map(|a| [(a, 1.0), (a, -1.0)]) {
                let mut frame = Self {
                    metres_per_unit,
                    up: [0.0; 3],
                    floor: None,
                };
                frame.up[axis] = sign;
                all.push(frame);
            }
        }
        if all.is_empty() {
            return Err(CaptureError::NoPersonSize { extent });
        }
        // The convention of this field first: y up.
        all.sort_by_key(|f| f.up != [0.0, 1.0, 0.0]);
        Ok(all)
    }
}

fn rotation_to_y(up: Vector3<f64>) -> Rotation3<f64> {
    // Opposite directions leave the axis open; a half turn about x keeps left and right.
    Rotation3::rotation_between(&up, &Vector3::y())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// Extent of a cloud along x, y, z without its strays.
fn extent(points: &[P3], strays: f64) -> [f32; 3] {
    let [low, high] = bounds(points, strays);
    (high - low).into()
}

/// Bounds of the finite coordinates without a share of strays at each end of an axis.
pub(super) fn bounds(points: &[P3], strays: f64) -> [P3; 2] {
    let range = |axis: usize| {
        let finite = points.iter().map(|p| p[axis]).filter(|v| v.is_finite());
        inner_range(finite, strays)
    };
    let ranges = [0, 1, 2].map(range);
    [0, 1].map(|end| P3::from(ranges.map(|r| r[end])))
}

/// Colour of a scan's texture between its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureColor {
    /// Place, metres.
    pub at: P3,
    /// Nearest corner of its triangle.
    pub point: u32,
    /// sRGB.
    pub color: [u8; 3],
}

/// A scan: finite points, metres, y up.
#[derive(Clone, Debug, Default)]
pub struct BodyScan {
    /// Points, shape `[points]`.
    pub points: Vec<P3>,
    /// Unit normals, outward where `oriented`; zero where undefined. Shape `[points]`.
    pub normals: Vec<V3>,
    /// Colours, sRGB, shape `[points]`; empty if absent.
    pub colors: Vec<[u8; 3]>,
    /// Colours of its texture between the points; empty without one.
    pub texture: Vec<TextureColor>,
    /// Triangles between kept points.
    pub faces: Vec<Face>,
    /// Point of each row of the file; `u32::MAX` for a row left out. Equal positions share a point.
    pub point_of_row: Vec<u32>,
    /// Normals point outwards.
    pub oriented: bool,
    /// Its file has neither faces nor normals: depth images of several cameras.
    pub is_cloud: bool,
    /// Rows of the file that are no point.
    pub left_out: LeftOut,
    /// Changes of its surface by the reader and here, faces named by line or number, for people.
    pub notes: Vec<String>,
}

/// Counts of the rows of a file that are left out of its scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Coordinates that are not finite, or farther from the origin than single precision resolves.
    pub not_finite: usize,
    /// Below the top of the floor.
    pub floor: usize,
    /// Positions that another row has.
    pub repeated: usize,
    /// Apart from the rest of a cloud without normals.
    #[serde(default)]
    pub strays: usize,
}

impl BodyScan {
    /// Converts a file to metres with y up; non-finite points, repeated positions and the floor are left out.
    ///
    /// # Errors
    /// [`CaptureError::TooFewPoints`]; [`CaptureError::NoPersonSize`] if the frame makes it no person's size.
    pub fn new(file: &ScanMesh, frame: &ScanFrame) -> Result<Self, CaptureError> {
        let settings = ScanSettings::default();
        let turn = frame.rotation();
        let up: Vector3<f64> = frame.up.into();
        let height = |p: &P3| up.dot(&p.coords.cast::<f64>());
        let is_floor = |p: &P3| frame.floor.is_some_and(|top| height(p) < top);
        let farthest = FARTHEST / frame.metres_per_unit;
        let mut seen = std::collections::HashMap::new();
        let mut scan = Self::default();
        for (row, p) in file.points.iter().enumerate() {
            let is_usable = p.iter().all(|v| f64::from(v.abs()) < farthest);
            if !is_usable || is_floor(p) {
                scan.left_out.not_finite += usize::from(!is_usable);
                scan.left_out.floor += usize::from(is_usable);
                scan.point_of_row.push(u32::MAX);
                continue;
            }
            let key = [p.x, p.y, p.z].map(f32::to_bits);
            let next = scan.points.len() as u32;
            let point = *seen.entry(key).or_insert(next);
            if point == next {
                let q = turn * (p.cast::<f64>() * frame.metres_per_unit);
                scan.points.push(q.cast());
                scan.colors.extend(file.colors.get(row));
                if let Some(n) = file.normals.get(row) {
                    let n = (turn * n.cast::<f64>()).cast::<f32>();
                    let unit = n.try_normalize(f32::MIN_POSITIVE);
                    let unit = unit.filter(|n| n.iter().all(|v| v.is_finite()));
                    scan.normals.push(unit.unwrap_or_default());
                }
            } else {
                scan.left_out.repeated += 1;
            }
            scan.point_of_row.push(point);
        }
        let mut scan = scan.checked()?;
        // Files with normals are surfaces that were cleaned before.
        scan.is_cloud = file.faces.is_empty() && file.normals.is_empty();
        if scan.is_cloud {
            let strays = are_strays(&scan.points, &settings.cloud);
            scan.left_out.strays += scan.leave_out(&strays);
            if let Some(top) = frame.floor {
                // Floors of several cameras are tilted against each other.
                let top = (top * frame.metres_per_unit) as f32;
                let rests = are_floor_rests(&scan.points, top, &settings.floor);
                scan.left_out.floor += scan.leave_out(&rests);
            }
        }
        let extents = extent(&scan.points, settings.strays);
        let largest = extents.into_iter().fold(0.0, f32::max);
        let [least, most] = settings.usable;
        if !(least..=most).contains(&f64::from(largest)) {
            let extent = extent(&file.points, settings.strays);
            return Err(CaptureError::NoPersonSize { extent });
        }
        if scan.colors.len() != scan.points.len() {
            // Colours of some points only say nothing of the others.
            scan.colors.clear();
        }
        scan.take_faces(file);
        scan.texture = scan.texture_of(file);
        scan.find_normals(&settings.cloud);
        Ok(scan)
    }

    /// Takes the faces of a file whose points are known; those that lost a corner or collapsed are left out and noted.
    fn take_faces(&mut self, file: &ScanMesh) {
        let mut report = MeshRepairReport::default();
        for (number, face) in (0..).zip(&file.faces) {
            match self.corners(face) {
                Some([a, b, c]) if a != b && b != c && a != c => self.faces.push([a, b, c]),
                Some(_) => report.collapsed.add(number),
                None => report.cut.add(number),
            }
        }
        let clauses = report.clauses(|face| file.origins.place(face as usize));
        self.notes = [&file.notes[..], &clauses].concat();
    }

    /// Leaves out some points; the number of rows that had one of them.
    fn leave_out(&mut self, strays: &[bool]) -> usize {
        let mut rows = 0;
        let mut next = 0;
        let number = |is_stray: &bool| {
            next += u32::from(!is_stray);
            if *is_stray { u32::MAX } else { next - 1 }
        };
        let numbers: Vec<u32> = strays.iter().map(number).collect();
        for point in self.point_of_row.iter_mut().filter(|p| **p != u32::MAX) {
            *point = numbers[*point as usize];
            rows += usize::from(*point == u32::MAX);
        }
        retain(&mut self.points, strays);
        retain(&mut self.normals, strays);
        retain(&mut self.colors, strays);
        rows
    }

    /// Points of a file's face; `None` if a corner is left out.
    fn corners(&self, face: &Face) -> Option<Face> {
        let point = |v: u32| {
            self.point_of_row
                .get(v as usize)
                .filter(|p| **p != u32::MAX)
        };
        let [a, b, c] = face.map(point);
        Some([*a?, *b?, *c?])
    }

    /// Texture of a file whose points are known.
    fn texture_of(&self, file: &ScanMesh) -> Vec<TextureColor> {
        let color = |t: &TexturePoint| {
            let corners = self.corners(file.faces.get(t.face as usize)?)?;
            let [x, y, z] = corners.map(|p| self.points[p as usize].coords);
            let w = t.weights;
            Some(TextureColor {
                at: P3::from(x * w[0] + y * w[1] + z * w[2]),
                point: corners[largest(w)],
                color: t.color,
            })
        };
        file.texture.iter().filter_map(color).collect()
    }

    /// Typical distance between its colours, metres: those of the texture, or of the points.
    pub(super) fn color_spacing(&self) -> f32 {
        if self.texture.is_empty() {
            return mean_spacing(&self.points);
        }
        mean_spacing(&self.texture.iter().map(|t| t.at).collect::<Vec<_>>())
    }

    /// The scan, if it has the points of a person.
    pub(super) fn checked(self) -> Result<Self, CaptureError> {
        let (points, least) = (self.points.len(), ScanSettings::default().least_points);
        if points < least {
            return Err(CaptureError::TooFewPoints { points, least });
        }
        Ok(self)
    }

    /// Normals from faces, else from the file, else from neighbours, outwards where they are seen from.
    fn find_normals(&mut self, settings: &CloudSettings) {
        if !self.faces.is_empty() {
            let (points, faces) = (&self.points, &self.faces);
            let around = Csr::of_faces(points.len(), faces);
            vertex_normals(Par::Rayon, points, faces, &around, &mut self.normals);
            self.oriented = true;
        } else if self.normals.len() == self.points.len() {
            self.oriented = true;
        } else {
            self.normals = plane_normals(&self.points, settings);
            self.oriented = turn_outwards(&self.points, &mut self.normals, settings);
        }
        if self.oriented && is_inside_out(&self.points, &self.normals) {
            self.normals.iter_mut().for_each(|n| *n = -*n);
            self.faces.iter_mut().for_each(|f| f.swap(1, 2));
        }
    }

    /// The same points in the same colours, none farther from its place in the other scan than noise.
    pub fn is_unchanged(&self, other: &Self) -> bool {
        let most = ScanSettings::default().unchanged;
        let near = |(p, q): (&P3, &P3)| (p - q).norm_squared() <= most * most;
        self.points.len() == other.points.len()
            && self.colors == other.colors
            && self.faces == other.faces
            && self.points.iter().zip(&other.points).all(near)
    }

    /// The normal of a point and a unit normal of a surface [`agree`].
    pub(super) fn agrees(&self, point: usize, surface: &V3, least: f32) -> bool {
        agree(&self.normals[point], surface, self.oriented, least)
    }

    /// Order of the points in which neighbours are near in space, shape `[points]`.
    pub(super) fn order(&self) -> Vec<u32> {
        spatial_order(&self.points)
    }

    /// Edges of the faces, or between near points of a cloud, the lower index first, each once; of a cloud those of the
    /// wanted points.
    pub fn edges(&self, is_wanted: impl Fn(usize) -> bool) -> Vec<[u32; 2]> {
        if !self.faces.is_empty() {
            return edges(&self.faces);
        }
        neighbour_edges(&self.points, &ScanSettings::default().cloud, is_wanted)
    }

    /// Label of each row of the file from one a point; `absent` for rows left out.
    pub fn rows<T: Copy>(&self, of_points: &[T], absent: T) -> Vec<T> {
        let label = |p: &u32| of_points.get(*p as usize).copied().unwrap_or(absent);
        self.point_of_row.iter().map(label).collect()
    }
}

/// A scan point's normal, zero if unknown, agrees with one of a surface to the least cosine; one that isn't oriented is of
/// either sign.
pub(super) fn agree(normal: &V3, surface: &V3, oriented: bool, least: f32) -> bool {
    let cos = surface.dot(normal);
    let cos = if oriented { cos } else { cos.abs() };
    *normal == V3::zeros() || cos >= least
}

/// Number of the largest of three shares, the first of equal ones.
pub(super) fn largest([a, b, c]: [f32; 3]) -> usize {
    if a >= b && a >= c {
        0
    } else if b >= c {
        1
    } else {
        2
    }
}

/// Leaves out values of points; arrays of another length are those of no or some points only.
fn retain<T>(values: &mut Vec<T>, left_out: &[bool]) {
    if values.len() == left_out.len() {
        let mut left_out = left_out.iter();
        values.retain(|_| left_out.next() == Some(&false));
    }
}

/// Normals of most of a person point at its middle: the file has the other orientation.
fn is_inside_out(points: &[P3], normals: &[V3]) -> bool {
    let n = points.len().max(1) as f32;
    let middle = points.iter().map(|p| p.coords).sum::<V3>() / n;
    let outwards = |(p, n): (&P3, &V3)| f64::from(n.dot(&(p.coords - middle)));
    points.iter().zip(normals).map(outwards).sum::<f64>() < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cylinder of 1.7 m about `axis`, in units of `unit` metres.
    fn cylinder(axis: usize, unit: f32) -> Vec<P3> {
        let point = |i: i32| {
            let angle = i as f32 * 2.4;
            let p = [
                0.2 * angle.cos(),
                0.15 * angle.sin(),
                1.7 * i as f32 / 4000.0,
            ];
            let mut q = P3::origin();
            (0..3).for_each(|k| q[(axis + 1 + k) % 3] = p[k] / unit);
            q
        };
        (0..4000).map(point).collect()
    }

    #[test]
    fn normals_of_either_sign_and_unknown_ones_agree() {
        let agrees = |normal: V3, oriented| agree(&normal, &V3::z(), oriented, 0.2);
        assert!(agrees(V3::z(), true) && !agrees(-V3::z(), true) && agrees(-V3::z(), false));
        assert!(!agrees(V3::x(), false) && agrees(V3::zeros(), true));
    }

    #[test]
    fn unit_and_axis_are_found() {
        for (axis, unit) in [(1, 1.0), (2, 0.01), (0, 0.001)] {
            let frames = ScanFrame::candidates(&cylinder(axis, unit)).expect("a person");
            assert_eq!(frames.len(), 2, "{frames:?}");
            assert!((frames[0].metres_per_unit - f64::from(unit)).abs() < 1e-9);
            assert_eq!(frames[0].up[axis].abs(), 1.0);
            let file = ScanMesh {
                points: cylinder(axis, unit),
                ..ScanMesh::default()
            };
            let scan = BodyScan::new(&file, &frames[0]).expect("enough points");
            assert!((extent(&scan.points, 0.0)[1] - 1.7).abs() < 0.01);
        }
        let large: Vec<P3> = cylinder(1, 1.0).iter().map(|p| p * 3.7).collect();
        let refused = ScanFrame::candidates(&large);
        assert!(matches!(refused, Err(CaptureError::NoPersonSize { .. })));
    }

    #[test]
    fn rows_left_out_keep_their_place() {
        let mut points = cylinder(1, 1.0);
        points[7] = P3::new(f32::NAN, 0.0, 0.0);
        points[9] = points[8];
        let file = ScanMesh {
            points: points.clone(),
            faces: vec![[6, 7, 8], [8, 9, 10], [10, 11, 12]],
            ..ScanMesh::default()
        };
        let scan = BodyScan::new(&file, &ScanFrame::default()).expect("enough points");
        assert_eq!(scan.points.len(), points.len() - 2);
        assert_eq!(scan.point_of_row[7], u32::MAX);
        let left_out = (scan.left_out.not_finite, scan.left_out.repeated);
        assert_eq!((left_out, scan.left_out.floor), ((1, 1), 0));
        assert_eq!(scan.point_of_row[9], scan.point_of_row[8]);
        let mut corners = scan.faces[0];
        corners.sort_unstable();
        assert_eq!((scan.faces.len(), corners), (1, [8, 9, 10]));
        let [collapsed, cut] = &scan.notes[..] else {
            panic!("{:?}", scan.notes)
        };
        assert!(collapsed.starts_with("1 face ") && collapsed.ends_with("(face 1)"));
        assert!(cut.starts_with("1 face ") && cut.ends_with("(face 0)"));
        let labels: Vec<u8> = (0..scan.points.len()).map(|i| (i % 3) as u8).collect();
        let rows = scan.rows(&labels, 255);
        assert_eq!((rows[7], rows[8] == rows[9]), (255, true));
    }

    #[test]
    fn clouds_get_normals_outwards() {
        let file = ScanMesh {
            points: cylinder(1, 1.0),
            ..ScanMesh::default()
        };
        let scan = BodyScan::new(&file, &ScanFrame::default()).expect("enough points");
        assert!(scan.oriented);
        let radial = scan.points.iter().zip(&scan.normals).filter(|(p, n)| {
            let out = V3::new(p.x / 0.0225, 0.0, p.z / 0.04).normalize();
            n.dot(&out) > 0.9
        });
        assert!(radial.count() > 3500);
    }
}
