//! Sleeves stay around their arms.
//!
//! Contact only knows the nearest skin. A thin arm that passes through its sleeve between two pictures finds all of it
//! outside, on one side, and the sleeve hangs empty from then on. What contact cannot see a ring of cloth can: the middle
//! of the arm is inside it or not. A ring that lost its arm is put around it again as it is, and contact does the rest.

use crate::body::Template;
use crate::garment::{GarmentMesh, Region};
use crate::math::{P3, V3};
use crate::mesh::distances;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Distance between two rings of skin, metres.
const SKIN_RING: f64 = 0.02;
/// Width of a ring of cloth, metres, and at least in longest edges: narrower ones have gaps.
const RING: f32 = 0.04;
const RING_EDGES: f32 = 1.2;
/// Fewer vertices are no ring.
const FEWEST: usize = 6;
/// Directions around the arm that are told apart.
const SECTORS: usize = 36;
/// An arm is lost where so many of them in a row are without cloth: 200°.
const LOST: usize = 20;
/// The armhole lies within this along the arm, metres.
const ARMHOLE: f32 = 0.3;
/// The next ring of a sleeve is at most so many times its distance on the cloth further along the arm; one that is put
/// back goes so many times as far.
const FURTHER: f32 = 1.5;
const BACK: f32 = 0.9;
/// The direction of an arm is taken over this on either side, metres.
const AHEAD: f32 = 0.03;
/// The arms, left and right.
const ARMS: [Region; 2] = [Region::LEFT_ARM, Region::RIGHT_ARM];

/// Rings of skin along both arms, from the shoulder to the finger tips.
#[derive(Debug)]
pub(crate) struct Arms([Vec<Vec<u32>>; 2]);

impl Arms {
    /// Of a body whose vertices belong to these `parts`.
    pub(crate) fn new(template: &Template, parts: &[u8]) -> Self {
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
        Self(ARMS.map(|arm| {
            let on = |v: usize| parts[v] == arm.0;
            let far = distances(at.len(), &edges, f64::INFINITY, |v| !on(v));
            let mut rings: Vec<Vec<u32>> = Vec::new();
            for (v, d) in far
                .iter()
                .enumerate()
                .filter(|(v, d)| on(*v) && d.is_finite())
            {
                let k = (d / SKIN_RING) as usize;
                rings.resize_with(rings.len().max(k + 1), Vec::new);
                rings[k].push(v as u32);
            }
            rings.retain(|r| !r.is_empty());
            rings
        }))
    }
    /// The middles of both arms of a body that stands like this.
    pub(crate) fn lines(&self, body: &[P3]) -> [Line; 2] {
        self.0.each_ref().map(|rings| {
            Line::new(
                rings
                    .iter()
                    .map(|r| middle(r.iter().map(|v| body[*v as usize]))),
            )
        })
    }
}

/// The middle of an arm.
#[derive(Debug)]
pub(crate) struct Line {
    points: Vec<P3>,
    /// Way along it to each point, metres.
    along: Vec<f32>,
}

impl Line {
    fn new(points: impl Iterator<Item = P3>) -> Self {
        let points: Vec<P3> = points.collect();
        let mut along = vec![0.0; points.len()];
        for k in 1..points.len() {
            along[k] = along[k - 1] + (points[k] - points[k - 1]).norm();
        }
        Self { points, along }
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
        (self.at(s + AHEAD) - self.at(s - AHEAD))
            .try_normalize(0.0)
            .unwrap_or_else(V3::zeros)
    }
    /// Way along it to the place nearest to `p` between two others.
    fn nearest(&self, p: &P3, from: f32, to: f32) -> f32 {
        const STEP: f32 = 0.005;
        let n = ((to - from) / STEP).ceil().max(1.0) as usize;
        let far = |s: &f32| (self.at(*s) - p).norm_squared();
        let all = (0..=n).map(|k| from + (to - from) * k as f32 / n as f32);
        all.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(from)
    }
}

/// One sleeve: rings of its vertices from the armhole to the cuff.
#[derive(Debug)]
pub(crate) struct Sleeve {
    arm: usize,
    rings: Vec<Vec<u32>>,
    /// Distance between two of them on the cloth, metres.
    apart: f32,
}

/// Where a ring of a sleeve goes that lost its arm.
#[derive(Debug)]
pub(crate) struct Found<'a> {
    /// Vertices of the cloth.
    pub(crate) ring: &'a [u32],
    /// How they go as one.
    pub(crate) way: Isometry3<f32>,
}

impl Sleeve {
    /// All sleeves of a garment whose edges have these rest lengths, metres.
    pub(crate) fn of(mesh: &GarmentMesh, edges: &[([u32; 2], f64)]) -> Vec<Self> {
        let mut lengths: Vec<f64> = edges.iter().map(|e| e.1).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let long = lengths
            .get(lengths.len() * 95 / 100)
            .copied()
            .unwrap_or(0.0) as f32;
        let width = RING.max(RING_EDGES * long);
        let rim = rim(mesh);
        let sleeve = |(arm, part): (usize, &Region)| {
            let on = |v: usize| mesh.regions[v].decisive() == *part;
            let edges: Vec<([u32; 2], f64)> = edges
                .iter()
                .filter(|e| e.0.iter().any(|v| on(*v as usize)))
                .copied()
                .collect();
            let from_armhole = distances(mesh.vertices, &edges, f64::INFINITY, |v| !on(v));
            let from_cuff = distances(mesh.vertices, &edges, f64::INFINITY, |v| rim[v] && on(v));
            let mine: Vec<usize> = (0..mesh.vertices)
                .filter(|v| on(*v) && (from_armhole[*v] + from_cuff[*v]).is_finite())
                .collect();
            let mut whole: Vec<f64> = mine
                .iter()
                .map(|v| from_armhole[*v] + from_cuff[*v])
                .collect();
            if whole.is_empty() {
                return None;
            }
            whole.sort_unstable_by(f64::total_cmp);
            let length = whole[whole.len() / 2] as f32;
            let n = (length / width).floor().max(1.0);
            let mut rings = vec![Vec::new(); n as usize];
            for &v in &mine {
                let share =
                    from_armhole[v] / (from_armhole[v] + from_cuff[v]).max(f64::MIN_POSITIVE);
                rings[((share as f32 * n) as usize).min(n as usize - 1)].push(v as u32);
            }
            Some(Self {
                arm,
                rings,
                apart: length / n,
            })
        };
        ARMS.iter().enumerate().filter_map(sleeve).collect()
    }
    /// Rings that are not around their arm, and how each comes back. `at`: where a vertex is, metres.
    pub(crate) fn lost<'a>(&'a self, lines: &[Line; 2], at: impl Fn(u32) -> P3) -> Vec<Found<'a>> {
        let line = &lines[self.arm];
        if line.length() <= 0.0 {
            return Vec::new();
        }
        let middles: Vec<P3> = self
            .rings
            .iter()
            .map(|r| middle(r.iter().map(|v| at(*v))))
            .collect();
        let mut out = Vec::new();
        let mut last = 0.0;
        for (k, ring) in self.rings.iter().enumerate() {
            let most = if k == 0 {
                ARMHOLE
            } else {
                last + FURTHER * self.apart
            };
            let mut s = line.nearest(&middles[k], last, most.min(line.length()));
            // What begins at the armhole goes over the shoulder, and is held by it.
            if k > 0
                && ring.len() >= FEWEST
                && !around(&line.at(s), &line.toward(s), ring.iter().map(|v| at(*v)))
            {
                s = (last + BACK * self.apart).min(line.length());
                let axis = middles[(k + 1).min(middles.len() - 1)] - middles[k - 1];
                let turn =
                    UnitQuaternion::rotation_between(&axis, &line.toward(s)).unwrap_or_default();
                let to = Translation3::from(line.at(s).coords);
                out.push(Found {
                    ring,
                    way: to * turn * Translation3::from(-middles[k].coords),
                });
            }
            last = s;
        }
        out
    }
}

/// Whether points lie around a line through `centre` along the unit vector `along`.
fn around(centre: &P3, along: &V3, points: impl Iterator<Item = P3>) -> bool {
    let u = if along.x.abs() < 0.6 {
        V3::x()
    } else {
        V3::y()
    }
    .cross(along)
    .normalize();
    let v = along.cross(&u);
    let mut seen = [false; SECTORS];
    for p in points {
        let d = p - centre;
        let turn = d.dot(&v).atan2(d.dot(&u)) / std::f32::consts::TAU + 0.5;
        seen[((turn * SECTORS as f32) as usize).min(SECTORS - 1)] = true;
    }
    let (mut run, mut longest) = (0, 0);
    for k in 0..2 * SECTORS {
        run = if seen[k % SECTORS] { 0 } else { run + 1 };
        longest = longest.max(run);
    }
    longest < LOST
}

fn middle(points: impl Iterator<Item = P3>) -> P3 {
    let (sum, n) = points.fold((V3::zeros(), 0.0f32), |(s, n), p| (s + p.coords, n + 1.0));
    P3::from(sum / n.max(1.0))
}

/// Vertices at the border of a mesh.
fn rim(mesh: &GarmentMesh) -> Vec<bool> {
    mesh.topology()
        .map_or_else(|_| vec![false; mesh.vertices], |t| t.boundary_vertices())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::garment::Triangulation;

    /// Twelve rings of twelve vertices, 4 cm apart, around an arm that bends by a right angle after 24 cm.
    fn bent() -> (Sleeve, [Line; 2], Vec<P3>) {
        let arm = |s: f32| {
            if s < 0.24 {
                P3::new(s, 0.0, 0.0)
            } else {
                P3::new(0.24, s - 0.24, 0.0)
            }
        };
        let line = || Line::new((0..30).map(|k| arm(0.02 * k as f32)));
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
                apart: 0.04,
            },
            [line(), line()],
            at,
        )
    }

    #[test]
    fn a_sleeve_on_its_arm_is_left_alone_and_one_beside_it_is_put_back() {
        let (sleeve, lines, mut at) = bent();
        assert!(sleeve.lost(&lines, |v| at[v as usize]).is_empty());
        // From the elbow on it hangs down instead, 10 cm beside the forearm at first and 30 cm at its end.
        let before = at.clone();
        let swung = Isometry3::rotation_wrt_point(
            UnitQuaternion::from_axis_angle(&V3::z_axis(), -2.0),
            P3::new(0.30, 0.0, 0.0),
        );
        at[96..].iter_mut().for_each(|p| *p = swung * *p);
        let found = sleeve.lost(&lines, |v| at[v as usize]);
        assert_eq!(
            found.iter().map(|f| f.ring[0]).collect::<Vec<_>>(),
            [96, 108, 120, 132]
        );
        for f in found {
            f.ring
                .iter()
                .for_each(|v| at[*v as usize] = f.way * at[*v as usize]);
        }
        let lost = sleeve.lost(&lines, |v| at[v as usize]);
        assert!(lost.is_empty(), "{} rings are still lost", lost.len());
        for (k, ring) in sleeve.rings.iter().enumerate() {
            let of = |p: &[P3]| middle(ring.iter().map(|v| p[*v as usize]));
            let far = (of(&at) - of(&before)).norm();
            assert!(
                far < 0.06,
                "ring {k} is {far} m from where it was on the arm"
            );
        }
    }

    #[test]
    fn rings_of_a_pattern_go_from_the_armhole_to_the_cuff() {
        let pattern = crate::garment::library::pattern("longsleeve", crate::garment::Size::M)
            .expect("a shirt");
        let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let sheet = crate::cloth::Sheet::of_garment(&mesh).expect("a sheet");
        let sleeves = Sleeve::of(&mesh, &sheet.edges);
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
            let length = s.apart * s.rings.len() as f32;
            assert!((0.4..0.8).contains(&length), "{length} m of sleeve");
            assert!(s.rings.iter().all(|r| r.len() >= 2 * FEWEST));
        }
    }

    #[test]
    fn without_an_arm_or_cloth_nothing_is_lost() {
        let (sleeve, lines, at) = bent();
        let none = || Line::new(std::iter::empty());
        let point = || Line::new(std::iter::repeat_n(P3::origin(), 5));
        assert!(
            sleeve
                .lost(&[none(), none()], |v| at[v as usize])
                .is_empty()
        );
        assert!(
            sleeve
                .lost(&[point(), point()], |v| at[v as usize])
                .is_empty()
        );
        // All of a sleeve in one place on the arm's line, or few vertices beside it.
        assert!(
            sleeve.lost(&lines, |_| P3::origin()).iter().all(|f| f
                .way
                .translation
                .vector
                .iter()
                .all(|c| c.is_finite()))
        );
        let few = Sleeve {
            arm: 0,
            rings: vec![vec![0], vec![1, 2]],
            apart: 0.04,
        };
        assert!(few.lost(&lines, |_| P3::new(1.0, 1.0, 1.0)).is_empty());
    }
}
