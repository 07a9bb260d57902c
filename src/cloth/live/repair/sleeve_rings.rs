//! Rings of sleeves around the arms, and which of them lost their arm.
//!
//! Contact knows the nearest skin only. An arm that passes through its sleeve in one step finds all cloth outside, on one
//! side. A ring of cloth tells: it encloses the centre line of the arm, or it is moved rigidly to where it does.

pub use crate::settings::SleeveSettings;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use tryon_body::Template;
use tryon_garment::{GarmentMesh, Region};
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::distances;

/// Least vertices of a ring.
const MIN_VERTICES: usize = 6;
/// Directions around the arm.
const SECTORS: usize = 36;
/// Adjacent sectors without cloth from which on the arm is lost: 200°.
const LOST_SECTORS: usize = 20;
/// Percentage of edges that are at most as long as the length a ring must exceed.
const EDGE_PERCENTILE: usize = 95;
/// Left and right arm.
const ARMS: [Region; 2] = [Region::LEFT_ARM, Region::RIGHT_ARM];

/// Rings of skin along both arms, from the shoulder to the finger tips.
#[derive(Debug, Default)]
pub struct Arms {
    rings: [Vec<Vec<u32>>; 2],
    settings: SleeveSettings,
}

impl Arms {
    /// Rings of a body whose vertices belong to these `parts`.
    pub fn new(template: &Template, parts: &[u8], settings: SleeveSettings) -> Self {
        let at = template.mesh().vertices();
        let edges: Vec<([u32; 2], f64)> = template
            .topology()
            .edges()
            .iter()
            .map(|e| {
                (
                    [e.v[0], e.v[1]],
                    f64::from((at[e.v[0] as usize] - at[e.v[1] as usize]).norm()),
                )
            })
            .collect();
        let rings = ARMS.map(|arm| {
            let on = |v: usize| parts[v] == arm.0;
            let far = distances(at.len(), &edges, f64::INFINITY, |v| !on(v));
            let mut rings: Vec<Vec<u32>> = Vec::new();
            for (v, d) in far
                .iter()
                .enumerate()
                .filter(|(v, d)| on(*v) && d.is_finite())
            {
                let k = (d / settings.skin_ring) as usize;
                rings.resize_with(rings.len().max(k + 1), Vec::new);
                rings[k].push(v as u32);
            }
            rings.retain(|r| !r.is_empty());
            rings
        });
        Self { rings, settings }
    }
    /// Centre lines of both arms of a posed body, metres.
    pub fn lines(&self, body: &[P3]) -> [CentreLine; 2] {
        self.rings.each_ref().map(|rings| {
            let centres = rings.iter();
            let points = centres.map(|r| centre(r.iter().map(|v| body[*v as usize])));
            CentreLine::new(points, self.settings)
        })
    }
}

/// Centre line of an arm, from the shoulder to the finger tips.
#[derive(Debug)]
pub struct CentreLine {
    points: Vec<P3>,
    /// Arc length at each point, metres.
    along: Vec<f32>,
    settings: SleeveSettings,
}

impl CentreLine {
    fn new(points: impl Iterator<Item = P3>, settings: SleeveSettings) -> Self {
        let points: Vec<P3> = points.collect();
        let mut along = vec![0.0; points.len()];
        for k in 1..points.len() {
            along[k] = along[k - 1] + (points[k] - points[k - 1]).norm();
        }
        Self {
            points,
            along,
            settings,
        }
    }
    fn length(&self) -> f32 {
        self.along.last().copied().unwrap_or(0.0)
    }
    fn at(&self, s: f32) -> P3 {
        let k = self
            .along
            .partition_point(|a| *a < s)
            .clamp(1, self.points.len() - 1);
        let step = (self.along[k] - self.along[k - 1]).max(f32::MIN_POSITIVE);
        let t = ((s - self.along[k - 1]) / step).clamp(0.0, 1.0);
        self.points[k - 1] + (self.points[k] - self.points[k - 1]) * t
    }
    /// Unit direction, zero where it has none.
    fn toward(&self, s: f32) -> V3 {
        let reach = self.settings.direction;
        (self.at(s + reach) - self.at(s - reach))
            .try_normalize(0.0)
            .unwrap_or_else(V3::zeros)
    }
    /// Arc length of the point nearest to `p` between two others, metres.
    fn nearest(&self, p: &P3, from: f32, to: f32) -> f32 {
        let n = ((to - from) / self.settings.scan).ceil().max(1.0) as usize;
        let far = |s: &f32| (self.at(*s) - p).norm_squared();
        let all = (0..=n).map(|k| from + (to - from) * k as f32 / n as f32);
        all.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(from)
    }
}

/// A sleeve as rings of its vertices from the armhole to the cuff.
#[derive(Debug)]
pub struct Sleeve {
    arm: usize,
    rings: Vec<Vec<u32>>,
    /// Distance between two rings on the cloth, metres.
    spacing: f32,
}

/// A ring of a sleeve that lost its arm.
#[derive(Debug)]
pub struct LostRing<'a> {
    /// Vertices of the cloth.
    pub vertices: &'a [u32],
    /// Rigid motion that puts it around the arm.
    pub recovery: Isometry3<f32>,
}

impl Sleeve {
    /// The sleeves of a garment whose edges have these rest lengths, metres.
    pub fn find(
        mesh: &GarmentMesh,
        edges: &[([u32; 2], f64)],
        settings: &SleeveSettings,
    ) -> Vec<Self> {
        let mut lengths: Vec<f64> = edges.iter().map(|e| e.1).collect();
        let edge = percentile(&mut lengths, EDGE_PERCENTILE).unwrap_or(0.0) as f32;
        let width = settings.ring.max(settings.ring_edges * edge);
        let border = border(mesh);
        (0..ARMS.len())
            .filter_map(|arm| Self::of_arm(mesh, edges, &border, arm, width))
            .collect()
    }

    /// The sleeve of one arm, in rings at least `width` metres wide; `None` without cloth from armhole to cuff.
    fn of_arm(
        mesh: &GarmentMesh,
        edges: &[([u32; 2], f64)],
        border: &[bool],
        arm: usize,
        width: f32,
    ) -> Option<Self> {
        let on = |v: usize| mesh.regions[v].decisive() == ARMS[arm];
        let edges: Vec<([u32; 2], f64)> = edges
            .iter()
            .filter(|e| e.0.iter().any(|v| on(*v as usize)))
            .copied()
            .collect();
        let from = |is_start: &dyn Fn(usize) -> bool| {
            distances(mesh.vertices, &edges, f64::INFINITY, is_start)
        };
        let from_armhole = from(&|v| !on(v));
        let from_cuff = from(&|v| border[v] && on(v));
        let length = |v: usize| from_armhole[v] + from_cuff[v];
        let own: Vec<usize> = (0..mesh.vertices)
            .filter(|v| on(*v) && length(*v).is_finite())
            .collect();
        let mut lengths: Vec<f64> = own.iter().map(|v| length(*v)).collect();
        let median = median(&mut lengths)? as f32;
        let n = (median / width).floor().max(1.0);
        let mut rings = vec![Vec::new(); n as usize];
        for v in own {
            let share = from_armhole[v] / length(v).max(f64::MIN_POSITIVE);
            rings[((share as f32 * n) as usize).min(n as usize - 1)].push(v as u32);
        }
        Some(Self {
            arm,
            rings,
            spacing: median / n,
        })
    }

    /// Rings that do not enclose their arm. `at`: position of a vertex, metres.
    pub fn lost_rings<'a>(
        &'a self,
        lines: &[CentreLine; 2],
        at: impl Fn(u32) -> P3,
    ) -> Vec<LostRing<'a>> {
        let line = &lines[self.arm];
        let settings = &line.settings;
        if line.length() <= 0.0 {
            return Vec::new();
        }
        let of = |r: &Vec<u32>| centre(r.iter().map(|v| at(*v)));
        let centres: Vec<P3> = self.rings.iter().map(of).collect();
        let mut out = Vec::new();
        let mut last = 0.0;
        for (k, ring) in self.rings.iter().enumerate() {
            let most = if k == 0 {
                settings.armhole
            } else {
                last + settings.max_spacing * self.spacing
            };
            let mut s = line.nearest(&centres[k], last, most.min(line.length()));
            // The first ring goes over the shoulder, which holds it.
            if k > 0
                && ring.len() >= MIN_VERTICES
                && !encloses(ring.iter().map(|v| at(*v)), &line.at(s), &line.toward(s))
            {
                s = (last + settings.recovered_spacing * self.spacing).min(line.length());
                let axis = centres[(k + 1).min(centres.len() - 1)] - centres[k - 1];
                let turn =
                    UnitQuaternion::rotation_between(&axis, &line.toward(s)).unwrap_or_default();
                let to = Translation3::from(line.at(s).coords);
                out.push(LostRing {
                    vertices: ring,
                    recovery: to * turn * Translation3::from(-centres[k].coords),
                });
            }
            last = s;
        }
        out
    }
}

/// Points enclose a line through `centre` along the unit vector `along`.
fn encloses(points: impl Iterator<Item = P3>, centre: &P3, along: &V3) -> bool {
    let u = if along.x.abs() < 0.6 {
        V3::x()
    } else {
        V3::y()
    }
    .cross(along)
    .normalize();
    let v = along.cross(&u);
    let mut occupied = [false; SECTORS];
    for p in points {
        let d = p - centre;
        let turn = d.dot(&v).atan2(d.dot(&u)) / std::f32::consts::TAU + 0.5;
        occupied[((turn * SECTORS as f32) as usize).min(SECTORS - 1)] = true;
    }
    let (mut run, mut longest) = (0, 0);
    for k in 0..2 * SECTORS {
        run = if occupied[k % SECTORS] { 0 } else { run + 1 };
        longest = longest.max(run);
    }
    longest < LOST_SECTORS
}

fn centre(points: impl Iterator<Item = P3>) -> P3 {
    let (sum, n) = points.fold((V3::zeros(), 0.0f32), |(s, n), p| (s + p.coords, n + 1.0));
    P3::from(sum / n.max(1.0))
}

/// Vertices at the border of a mesh.
fn border(mesh: &GarmentMesh) -> Vec<bool> {
    mesh.topology()
        .map_or_else(|_| vec![false; mesh.vertices], |t| t.boundary_vertices())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::Triangulation;

    fn line_of(points: impl Iterator<Item = P3>) -> CentreLine {
        CentreLine::new(points, SleeveSettings::default())
    }

    /// Twelve rings of twelve vertices, 4 cm apart, around an arm that bends by a right angle after 24 cm.
    fn bent() -> (Sleeve, [CentreLine; 2], Vec<P3>) {
        let arm = |s: f32| {
            if s < 0.24 {
                P3::new(s, 0.0, 0.0)
            } else {
                P3::new(0.24, s - 0.24, 0.0)
            }
        };
        let line = || line_of((0..30).map(|k| arm(0.02 * k as f32)));
        let mut at = Vec::new();
        let rings = (0..12).map(|k| {
            let s = 0.02 + 0.04 * k as f32;
            let along = (arm(s + 0.001) - arm(s - 0.001)).normalize();
            let u = along.cross(&V3::z());
            for j in 0..12 {
                let turn = std::f32::consts::TAU * j as f32 / 12.0;
                at.push(arm(s) + (u * turn.cos() + V3::z() * turn.sin()) * 0.06);
            }
            (12 * k..12 * (k + 1)).collect()
        });
        (
            Sleeve {
                arm: 0,
                rings: rings.collect(),
                spacing: 0.04,
            },
            [line(), line()],
            at,
        )
    }

    #[test]
    fn sleeve_beside_its_arm_is_recovered_and_one_around_it_stays() {
        let (sleeve, lines, mut at) = bent();
        assert!(sleeve.lost_rings(&lines, |v| at[v as usize]).is_empty());
        // From the elbow on it hangs down instead, 10 cm beside the forearm at first and 30 cm at its end.
        let before = at.clone();
        let swung = Isometry3::rotation_wrt_point(
            UnitQuaternion::from_axis_angle(&V3::z_axis(), -2.0),
            P3::new(0.30, 0.0, 0.0),
        );
        at[96..].iter_mut().for_each(|p| *p = swung * *p);
        let found = sleeve.lost_rings(&lines, |v| at[v as usize]);
        assert_eq!(
            found.iter().map(|f| f.vertices[0]).collect::<Vec<_>>(),
            [96, 108, 120, 132]
        );
        for f in found {
            f.vertices
                .iter()
                .for_each(|v| at[*v as usize] = f.recovery * at[*v as usize]);
        }
        let lost = sleeve.lost_rings(&lines, |v| at[v as usize]);
        assert!(lost.is_empty(), "{} rings are still lost", lost.len());
        for (k, ring) in sleeve.rings.iter().enumerate() {
            let of = |p: &[P3]| centre(ring.iter().map(|v| p[*v as usize]));
            let far = (of(&at) - of(&before)).norm();
            assert!(
                far < 0.06,
                "ring {k} is {far} m from where it was on the arm"
            );
        }
    }

    #[test]
    fn rings_of_a_pattern_cover_its_sleeves_from_armhole_to_cuff() {
        let pattern =
            tryon_garment::library::pattern("longsleeve", tryon_garment::Size::M).expect("a shirt");
        let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let sheet = crate::live::Sheet::of_garment(&mesh).expect("a sheet");
        let sleeves = Sleeve::find(&mesh, &sheet.edges, &SleeveSettings::default());
        assert_eq!(sleeves.iter().map(|s| s.arm).collect::<Vec<_>>(), [0, 1]);
        for s in &sleeves {
            let on: usize = mesh
                .regions
                .iter()
                .filter(|r| r.decisive() == ARMS[s.arm])
                .count();
            assert_eq!(
                s.rings.iter().map(Vec::len).sum::<usize>(),
                on,
                "each vertex is in one ring"
            );
            let length = s.spacing * s.rings.len() as f32;
            assert!((0.4..0.8).contains(&length), "{length} m of sleeve");
            assert!(s.rings.iter().all(|r| r.len() >= 2 * MIN_VERTICES));
        }
    }

    #[test]
    fn without_an_arm_or_cloth_no_ring_is_lost() {
        let (sleeve, lines, at) = bent();
        let none = || line_of(std::iter::empty());
        let point = || line_of(std::iter::repeat_n(P3::origin(), 5));
        assert!(
            sleeve
                .lost_rings(&[none(), none()], |v| at[v as usize])
                .is_empty()
        );
        assert!(
            sleeve
                .lost_rings(&[point(), point()], |v| at[v as usize])
                .is_empty()
        );
        // All of a sleeve in one place on the arm's line, or few vertices beside it.
        assert!(
            sleeve.lost_rings(&lines, |_| P3::origin()).iter().all(|f| f
                .recovery
                .translation
                .vector
                .iter()
                .all(|c| c.is_finite()))
        );
        let few = Sleeve {
            arm: 0,
            rings: vec![vec![0], vec![1, 2]],
            spacing: 0.04,
        };
        assert!(
            few.lost_rings(&lines, |_| P3::new(1.0, 1.0, 1.0))
                .is_empty()
        );
    }
}
