//! Nearest faces of scan points, kept from iteration to iteration while the surface around them hardly moves.

use crate::math::P3;
use crate::mesh::Face;
use crate::spatial::{Bvh, SurfacePoint};
use serde::{Deserialize, Serialize};

/// Counts of nearest-point queries of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueryCounts {
    /// Searches of the whole surface.
    pub made: usize,
    /// Searches left out: the face of the last one was kept.
    pub skipped: usize,
}

impl std::ops::AddAssign for QueryCounts {
    fn add_assign(&mut self, other: Self) {
        self.made += other.made;
        self.skipped += other.skipped;
    }
}

/// Face of one point and the way that it had moved when it was found.
#[derive(Clone, Copy, Debug)]
struct KeptFace {
    face: u32,
    travel: f32,
}

/// Faces of the points of one fit.
#[derive(Debug)]
pub(in crate::clothcap) struct FaceCache {
    /// Motion of a face since it was found up to which it is kept, metres; 0 keeps none.
    settled: f32,
    /// Searches start at the last face: of two faces equally near, another one may be found.
    starts: bool,
    kept: Vec<Option<KeptFace>>,
    /// Every so many points are searched in each iteration; scans of meshes have those between beside them.
    stride: usize,
    /// Way of each face so far: the sum of the largest motions of its corners, metres.
    travel: Vec<f32>,
    /// Surface of the last iteration.
    last: Vec<P3>,
    counts: QueryCounts,
}

impl FaceCache {
    /// Cache of a fit to so many points, each `stride`-th in its iterations; `settled` is the motion up to which a face is
    /// kept, metres; at 0 each search is made from nothing.
    pub(in crate::clothcap) fn new(points: usize, stride: usize, settled: f32) -> Self {
        Self {
            settled,
            starts: settled > 0.0,
            kept: vec![None; points],
            stride: stride.max(1),
            travel: Vec::new(),
            last: Vec::new(),
            counts: QueryCounts::default(),
        }
    }

    /// Keeps no face from now on: every point is searched, from the face that it had.
    pub(in crate::clothcap) fn search_all(&mut self) {
        self.settled = 0.0;
    }

    /// Starts the first search of point `i` at a face.
    pub(in crate::clothcap) fn start_at(&mut self, i: usize, face: u32) {
        // As if it had moved a long way since.
        let travel = f32::NEG_INFINITY;
        self.kept[i] = Some(KeptFace { face, travel });
    }

    /// Starts the first searches of points without a face at those of their neighbours by triangles of the scan.
    pub(in crate::clothcap) fn spread(&mut self, faces: &[Face]) {
        let given = self.kept.clone();
        for f in faces {
            let Some(known) = f.iter().find_map(|v| given[*v as usize]) else {
                continue;
            };
            let open = f.iter().filter(|v| given[**v as usize].is_none());
            open.for_each(|v| self.start_at(*v as usize, known.face));
        }
    }

    /// Measures the motion of the faces since the last call.
    pub(in crate::clothcap) fn advance(&mut self, faces: &[Face], surface: &[P3]) {
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

    /// Point of the surface closest to point `i`, on its kept face or searched.
    pub(in crate::clothcap) fn closest(
        &self,
        i: usize,
        (bvh, surface): (&Bvh, &[P3]),
        p: &P3,
    ) -> Option<Found> {
        let kept = self.kept[i];
        if let Some(k) = kept
            && self.travel[k.face as usize] - k.travel < self.settled
        {
            let point = bvh.point_of_face(surface, p, k.face);
            return Some(Found { point, kept });
        }
        let beside = self.kept[i - i % self.stride];
        let near = kept.or(beside).filter(|_| self.starts).map(|k| k.face);
        let point = bvh.closest_near(surface, p, near)?;
        Some(Found { point, kept: None })
    }

    /// Keeps what was found for point `i`.
    pub(in crate::clothcap) fn keep(&mut self, i: usize, found: &Found) {
        let face = found.point.face;
        let fresh = KeptFace {
            face,
            travel: self.travel[face as usize],
        };
        match found.kept {
            Some(_) => self.counts.skipped += 1,
            None => self.counts.made += 1,
        }
        self.kept[i] = Some(found.kept.unwrap_or(fresh));
    }

    /// Queries so far.
    pub(in crate::clothcap) fn counts(&self) -> QueryCounts {
        self.counts
    }
}

/// Closest point, and its face in the cache if that was kept.
#[derive(Clone, Copy, Debug)]
pub(in crate::clothcap) struct Found {
    pub(in crate::clothcap) point: SurfacePoint,
    kept: Option<KeptFace>,
}
