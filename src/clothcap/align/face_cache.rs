//! Nearest faces of scan points, kept from iteration to iteration while the surface around them hardly moves.

use super::face_walk::QuerySurface;
use super::pairing::ScanNormal;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::SurfacePoint;

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

/// Face of one point and the way that it had moved when it was found.
#[derive(Clone, Copy, Debug)]
struct KeptFace {
    face: u32,
    travel: f32,
}

/// Points of a scan that look for a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QueryPoints<'a> {
    /// All of them, metres.
    pub(crate) points: &'a [P3],
    /// Their normals, see [`ScanNormal::normal`].
    pub(crate) normals: &'a [V3],
    /// See [`ScanNormal::oriented`].
    pub(crate) oriented: bool,
    /// Every so manieth takes part; at least 1.
    pub(crate) stride: usize,
    /// Points that take no part, shape `[points]`, or empty.
    pub(crate) left_out: &'a [bool],
}

impl QueryPoints<'_> {
    fn normal(&self, i: usize) -> ScanNormal {
        ScanNormal {
            normal: self.normals[i],
            oriented: self.oriented,
        }
    }
}

/// Faces of the points of one fit.
#[derive(Debug)]
pub(crate) struct FaceCache {
    /// Motion of a face since it was found up to which it is kept, metres; 0 keeps none.
    settled: f32,
    /// Searches start at the last face: of two faces equally near, another one may be found.
    starts: bool,
    kept: Vec<Option<KeptFace>>,
    /// Way of each face so far: the sum of the largest motions of its corners, metres.
    travel: Vec<f32>,
    /// Surface of the last iteration.
    last: Vec<P3>,
    counts: QueryCounts,
}

impl FaceCache {
    /// Cache of a fit to so many points; `settled` is the motion up to which a face is kept, metres; at 0 each search is
    /// made from nothing.
    pub(crate) fn new(points: usize, settled: f32) -> Self {
        Self {
            settled,
            starts: settled > 0.0,
            kept: vec![None; points],
            travel: Vec::new(),
            last: Vec::new(),
            counts: QueryCounts::default(),
        }
    }

    /// Keeps no face from now on: every point is searched, from the face that it had.
    pub(crate) fn search_all(&mut self) {
        self.settled = 0.0;
    }

    /// Starts the first search of point `i` at a face.
    pub(crate) fn start_at(&mut self, i: usize, face: u32) {
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

    /// Measures the motion of the faces since the last call.
    pub(crate) fn advance(&mut self, faces: &[Face], surface: &[P3]) {
        self.travel.resize(faces.len(), 0.0);
        if self.last.len() == surface.len() {
            let moved: Vec<f32> = surface
                .iter()
                .zip(&self.last)
                .map(|(a, b)| (a - b).norm())
                .collect();
            for (travel, f) in self.travel.iter_mut().zip(faces) {
                let [a, b, c] = f.map(|v| moved[v as usize]);
                *travel += a.max(b).max(c);
            }
        }
        self.last.clear();
        self.last.extend_from_slice(surface);
    }

    /// Points of the surface closest to every `stride`-th point, with the point's index and normal; each is kept.
    pub(crate) fn closest_each(
        &mut self,
        surface: &QuerySurface<'_>,
        points: &QueryPoints<'_>,
        least: f32,
    ) -> Vec<(usize, ScanNormal, Option<SurfacePoint>)> {
        let count = points.points.len().div_ceil(points.stride);
        let mut found = Vec::new();
        par::map_into(Par::Rayon, count, 256, &mut found, |k| {
            let i = k * points.stride;
            let takes_part = !points.left_out.get(i).is_some_and(|out| *out);
            let point = (&points.points[i], points.normal(i));
            takes_part.then(|| self.closest(i, surface, point, least))?
        });
        let kept = |(k, found): (usize, Option<Found>)| {
            let i = k * points.stride;
            if let Some(found) = &found {
                self.keep(i, found);
            }
            (i, points.normal(i), found.map(|f| f.point))
        };
        found.into_iter().enumerate().map(kept).collect()
    }

    /// Point of the surface closest to point `i`, on its kept face, near it or searched; `least` is the smallest cosine
    /// between normals of a pair.
    fn closest(
        &self,
        i: usize,
        surface: &QuerySurface<'_>,
        (p, normal): (&P3, ScanNormal),
        least: f32,
    ) -> Option<Found> {
        let kept = self.kept[i];
        if let Some(k) = kept
            && self.travel[k.face as usize] - k.travel < self.settled
        {
            let point = surface.tree.point_of_face(surface.vertices, p, k.face);
            let search = FaceSearch::Skipped(k);
            return Some(Found { point, search });
        }
        let near = kept.filter(|_| self.starts).map(|k| k.face);
        if let Some(point) = near.and_then(|f| surface.descend((p, normal), f, least)) {
            let search = FaceSearch::Near;
            return Some(Found { point, search });
        }
        let point = surface.tree.closest_near(surface.vertices, p, near)?;
        let search = FaceSearch::Whole;
        Some(Found { point, search })
    }

    /// Keeps what was found for point `i`.
    fn keep(&mut self, i: usize, found: &Found) {
        let face = found.point.face;
        let fresh = KeptFace {
            face,
            travel: self.travel[face as usize],
        };
        self.kept[i] = Some(match found.search {
            FaceSearch::Skipped(kept) => {
                self.counts.skipped += 1;
                kept
            }
            FaceSearch::Near => {
                self.counts.near += 1;
                fresh
            }
            FaceSearch::Whole => {
                self.counts.made += 1;
                fresh
            }
        });
    }

    /// Queries so far.
    pub(crate) fn counts(&self) -> QueryCounts {
        self.counts
    }
}

/// Extent of a search.
#[derive(Clone, Copy, Debug)]
enum FaceSearch {
    /// None: the face in the cache.
    Skipped(KeptFace),
    /// Faces around the last one.
    Near,
    /// All faces.
    Whole,
}

/// Closest point and the search that found it.
#[derive(Clone, Copy, Debug)]
struct Found {
    point: SurfacePoint,
    search: FaceSearch,
}
