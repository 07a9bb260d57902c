//! Pairs of scan points and surface points, by distance and normal. Faces are kept from iteration to iteration while the
//! surface around them hardly moves, and start the next search where it does.

use super::quadratic::{Pull, PullPlace};
use crate::scan::{BodyScan, largest};
use crate::settings::SurfaceFitSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Csr, Face, vertex_normals};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::{Bvh, SurfacePoint, WarmQuery};
use tryon_tracking::registration::GemanMcClure;

/// Points of a scan that are paired with a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanPoints<'a> {
    pub(crate) scan: &'a BodyScan,
    /// Step from one that takes part to the next; at least 1.
    pub(crate) stride: usize,
    /// Points that take no part, shape `[points]`, or empty.
    pub(crate) left_out: &'a [bool],
}

impl<'a> ScanPoints<'a> {
    /// All points of a scan, `stride` or 1 from one to the next.
    pub(crate) fn of(scan: &'a BodyScan, stride: usize) -> Self {
        Self {
            scan,
            stride: stride.max(1),
            left_out: &[],
        }
    }

    /// Pulls of the surface to paired points, each of which stands for its share of `area`, m².
    pub(crate) fn pulls(
        &self,
        matches: &'a [SurfaceMatch],
        area: f64,
    ) -> impl Iterator<Item = Pull> + use<'a> {
        let per_point = area / matches.len().max(1) as f64;
        let points = self.scan.points.iter().step_by(self.stride);
        let pairs = matches.iter().zip(points).filter(|(m, _)| m.weight > 0.0);
        pairs.map(move |(m, p)| Pull {
            at: PullPlace::Face(m.face, m.corners),
            weight: per_point * m.weight,
            target: *p,
        })
    }
}

/// Place of a scan point on the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceMatch {
    /// Triangle.
    pub face: u32,
    /// Barycentric coordinates in it.
    pub corners: [f32; 3],
    /// Distance, metres.
    pub distance: f32,
    /// Robust weight; 0 for a point that the surface does not explain.
    pub weight: f64,
}

impl SurfaceMatch {
    /// Vertex of the triangle with the largest share.
    pub fn nearest_vertex(&self, faces: &[Face]) -> u32 {
        faces[self.face as usize][largest(self.corners)]
    }
}

/// Mean distance of explained points from the surface, metres, and their number.
pub(crate) fn explained(matches: &[SurfaceMatch]) -> (f64, usize) {
    let good = matches.iter().filter(|m| m.weight > 0.0);
    let (sum, n) = good.fold((0.0, 0), |(s, n), m| (s + f64::from(m.distance), n + 1));
    (sum / n.max(1) as f64, n)
}

/// Counts of nearest-point queries of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueryCounts {
    /// Searches of the whole surface.
    pub made: usize,
    /// Searches of the faces around the last one.
    #[serde(default)]
    pub near: usize,
    /// Searches left out: the face of the last one was kept.
    pub skipped: usize,
}

impl std::ops::AddAssign for QueryCounts {
    fn add_assign(&mut self, other: Self) {
        self.made += other.made;
        self.near += other.near;
        self.skipped += other.skipped;
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum FaceSearch {
    /// None: the face in the cache.
    Skipped,
    /// Faces around the last one.
    Near,
    /// All faces.
    Whole,
}

/// Face of one point and the travel that it had when it was found, metres.
#[derive(Clone, Copy, Debug)]
struct KeptFace {
    face: u32,
    travel: f32,
}

/// Pairing of the points of one scan with a moving surface.
#[derive(Debug)]
pub(crate) struct ScanPairing {
    tree: Bvh,
    around: Csr,
    /// Points are compared with normals interpolated over faces, else with those of the faces.
    is_smooth: bool,
    /// Smallest cosine between normals of a pair.
    least: f32,
    /// Motion of a face since it was found up to which it is kept, metres; 0 keeps none.
    settled: f32,
    /// Searches start at the last face: of two faces equally near, another one may be found.
    is_warm: bool,
    kept: Vec<Option<KeptFace>>,
    /// Travel of each face so far: the sum of the largest motions of its corners, metres.
    travel: Vec<f32>,
    last: Vec<P3>,
    counts: QueryCounts,
}

impl ScanPairing {
    /// Pairing with the surface of some faces, `rest` their vertices in any pose, metres. Normals are interpolated if it
    /// is smooth.
    pub(crate) fn new(faces: &[Face], rest: &[P3], is_smooth: bool) -> Self {
        Self {
            tree: Bvh::new(faces, rest),
            around: Csr::of_faces(rest.len(), faces),
            is_smooth,
            least: 0.0,
            settled: 0.0,
            is_warm: false,
            kept: Vec::new(),
            travel: Vec::new(),
            last: Vec::new(),
            counts: QueryCounts::default(),
        }
    }

    /// Begins a scan of so many points. Where no face is kept, each search is made from nothing.
    pub(crate) fn begin(&mut self, points: usize, settings: &SurfaceFitSettings) {
        (self.least, self.settled) = (settings.normals, settings.settled);
        self.is_warm = self.settled > 0.0;
        self.kept.clear();
        self.kept.resize(points, None);
        self.travel.clear();
        self.travel.resize(self.tree.faces().len(), 0.0);
        self.last.clear();
        self.counts = QueryCounts::default();
    }

    /// Keeps no face from now on: every point is searched, from the face that it had.
    pub(crate) fn search_all(&mut self) {
        self.settled = 0.0;
    }

    /// Starts the first search of point `i` around a vertex.
    pub(crate) fn start_around(&mut self, i: usize, vertex: usize) {
        if let Some(face) = self.around.row(vertex).last() {
            self.start_at(i, *face);
        }
    }

    fn start_at(&mut self, i: usize, face: u32) {
        // As if it had moved a long way since.
        let travel = f32::NEG_INFINITY;
        self.kept[i] = Some(KeptFace { face, travel });
    }

    /// Starts the first searches of points at the face of the last point before them that was searched, in an order in which
    /// neighbours are near.
    pub(crate) fn spread(&mut self, order: &[u32]) {
        let mut last = None;
        for i in order.iter().map(|i| *i as usize) {
            match (self.kept[i].filter(|k| k.travel.is_finite()), last) {
                (Some(found), _) => last = Some(found.face),
                (None, Some(face)) => self.start_at(i, face),
                (None, None) => (),
            }
        }
    }

    /// Places on `surface` of the points that take part; `sigma` is the width of the Geman–McClure kernel, metres.
    pub(crate) fn pair(
        &mut self,
        points: &ScanPoints<'_>,
        surface: &[P3],
        sigma: f64,
    ) -> Vec<SurfaceMatch> {
        self.tree.refit(surface);
        self.advance(surface);
        let mut normals = Vec::new();
        if self.is_smooth {
            let faces = self.tree.faces();
            vertex_normals(Par::Rayon, surface, faces, &self.around, &mut normals);
        }
        let kernel = GemanMcClure { sigma };
        let normal = |at: &SurfacePoint| {
            if !self.is_smooth {
                return self.tree.unit_normal(surface, at.face);
            }
            let face = self.tree.faces()[at.face as usize];
            let corners = face.iter().zip(at.weights);
            Some(corners.map(|(v, w)| normals[*v as usize] * w).sum())
        };
        let matched = |i: usize, at: &SurfacePoint| {
            let agrees = normal(at).is_some_and(|own| points.scan.agrees(i, &own, self.least));
            let e2 = f64::from(at.distance * at.distance);
            SurfaceMatch {
                face: at.face,
                corners: at.weights,
                distance: at.distance,
                weight: if agrees { kernel.weight(e2) } else { 0.0 },
            }
        };
        let count = points.scan.points.len().div_ceil(points.stride);
        let mut found = Vec::new();
        par::map_into(Par::Rayon, count, 256, &mut found, |k| {
            let i = k * points.stride;
            let takes_part = !points.left_out.get(i).is_some_and(|out| *out);
            let (at, search) = takes_part.then(|| self.closest(i, points, surface))??;
            Some((matched(i, &at), search))
        });
        let kept = |(k, found): (usize, Option<(SurfaceMatch, FaceSearch)>)| {
            let Some((found, search)) = found else {
                return SurfaceMatch::default();
            };
            self.keep(k * points.stride, found.face, search);
            found
        };
        found.into_iter().enumerate().map(kept).collect()
    }

    /// Measures the motion of the faces since the last iteration.
    fn advance(&mut self, surface: &[P3]) {
        if self.last.len() == surface.len() {
            let pairs = surface.iter().zip(&self.last);
            let moved: Vec<f32> = pairs.map(|(a, b)| (a - b).norm()).collect();
            for (travel, f) in self.travel.iter_mut().zip(self.tree.faces()) {
                let [a, b, c] = f.map(|v| moved[v as usize]);
                *travel += a.max(b).max(c);
            }
        }
        self.last.clear();
        self.last.extend_from_slice(surface);
    }

    /// Point of the surface closest to point `i`, on its kept face, near it or searched.
    fn closest(
        &self,
        i: usize,
        points: &ScanPoints<'_>,
        surface: &[P3],
    ) -> Option<(SurfacePoint, FaceSearch)> {
        let (p, kept) = (&points.scan.points[i], self.kept[i]);
        if let Some(k) = kept
            && self.travel[k.face as usize] - k.travel < self.settled
        {
            let point = self.tree.point_of_face(surface, p, k.face);
            return Some((point, FaceSearch::Skipped));
        }
        let near = kept.filter(|_| self.is_warm).map(|k| k.face);
        let query = WarmQuery {
            tree: &self.tree,
            vertices: surface,
            around: &self.around,
        };
        let descend = |f| query.descend(p, f, |own| points.scan.agrees(i, own, self.least));
        if let Some(point) = near.and_then(descend) {
            return Some((point, FaceSearch::Near));
        }
        let point = self.tree.closest_near(surface, p, near)?;
        Some((point, FaceSearch::Whole))
    }

    /// Keeps the face that was found for point `i`.
    fn keep(&mut self, i: usize, face: u32, search: FaceSearch) {
        let count = match search {
            FaceSearch::Skipped => &mut self.counts.skipped,
            FaceSearch::Near => &mut self.counts.near,
            FaceSearch::Whole => &mut self.counts.made,
        };
        *count += 1;
        if search != FaceSearch::Skipped {
            let travel = self.travel[face as usize];
            self.kept[i] = Some(KeptFace { face, travel });
        }
    }

    pub(crate) fn counts(&self) -> QueryCounts {
        self.counts
    }
}
