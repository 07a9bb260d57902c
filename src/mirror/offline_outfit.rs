//! A dressed outfit for the offline solver: finer garments, the real-time result as start, the tracked body as obstacle.

use super::error::MirrorError;
use super::outfit::DressedOutfit;
use std::collections::BTreeMap;
use tryon_cloth::AnchorBinding;
use tryon_cloth::contact::broad_phase::EdgeFace;
use tryon_cloth::contact::{ContactMesh, ContactSurface};
use tryon_cloth::fine::{
    JoinedSurfaces, MotionState, OfflineCloth, OfflineError, OfflineSettings, OfflineSolver,
    OfflineState, PinTarget, StartReport,
};
use tryon_garment::{GarmentMesh, GarmentSubdivision, joined_faces};
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

/// Anchor strength from which a vertex is tied to the skin; weaker anchors are left to friction.
const TIED: f64 = 1.0;

/// Garments of an outfit on finer meshes. Vertices and faces of all garments have one numbering, in the outfit's order.
#[derive(Debug)]
pub struct OfflineOutfit {
    /// Subdivisions of each garment.
    level: usize,
    coarse: Vec<GarmentMesh>,
    /// Refinements of each garment, from coarse to fine.
    refinements: Vec<Vec<GarmentSubdivision>>,
    garments: Vec<GarmentMesh>,
    cloth: OfflineCloth,
    body_faces: Vec<Face>,
    /// Tied vertices, by the numbers of the cloth.
    anchors: Vec<AnchorBinding>,
}

/// Number of subdivisions, each by four, that brings `vertices` nearest to `wanted`, as a ratio.
fn levels(vertices: usize, wanted: usize) -> usize {
    let ratio = wanted.max(1) as f64 / vertices.max(1) as f64;
    ratio.log(4.0).round().max(0.0) as usize
}

impl OfflineOutfit {
    /// Garments of `worn` with about `vertices` vertices in all, on a body with these triangles.
    ///
    /// # Errors
    /// A garment without area or mass, by face or vertex.
    pub fn new(
        worn: &DressedOutfit,
        body_faces: &[Face],
        vertices: usize,
    ) -> Result<Self, MirrorError> {
        let coarse = worn.model.outfit.garments.iter();
        let levels = levels(coarse.map(|g| g.vertices).sum(), vertices);
        Self::with_level(worn, body_faces, levels)
    }

    /// Garments of `worn` whose triangles were divided by four `levels` times.
    pub(super) fn with_level(
        worn: &DressedOutfit,
        body_faces: &[Face],
        levels: usize,
    ) -> Result<Self, MirrorError> {
        let outfit = &worn.model.outfit;
        let coarse = outfit.garments.clone();
        let refine = |garment: &GarmentMesh| {
            let mut all: Vec<GarmentSubdivision> = Vec::new();
            for _ in 0..levels {
                let finer = GarmentSubdivision::new(all.last().map_or(garment, |s| &s.mesh));
                all.push(finer);
            }
            all
        };
        let refinements: Vec<_> = coarse.iter().map(refine).collect();
        let garments: Vec<GarmentMesh> = (coarse.iter().zip(&refinements))
            .map(|(g, finer)| finer.last().map_or(g, |s| &s.mesh).clone())
            .collect();
        let gravity = V3d::from(worn.model.config().gravity);
        let cloth = OfflineCloth::of_garments(&garments, gravity)?;

        let mut anchors = Vec::new();
        let mut first = 0;
        for (garment, own) in garments.iter().zip(&outfit.anchors) {
            let tied = own.iter().filter(|a| a.strength >= TIED);
            anchors.extend(tied.map(|a| AnchorBinding {
                vertex: a.vertex + first,
                ..*a
            }));
            first += garment.vertices as u32;
        }
        Ok(Self {
            level: levels,
            coarse,
            refinements,
            garments,
            cloth,
            body_faces: body_faces.to_vec(),
            anchors,
        })
    }

    /// Garments on their finer meshes.
    pub fn garments(&self) -> &[GarmentMesh] {
        &self.garments
    }

    /// Cloth of all garments.
    pub fn cloth(&self) -> &OfflineCloth {
        &self.cloth
    }

    /// Number of subdivisions.
    pub(super) fn level(&self) -> usize {
        self.level
    }

    /// Triangles of the obstacle.
    pub(super) fn body_faces(&self) -> &[Face] {
        &self.body_faces
    }

    /// Solver of the cloth with the mean friction of the fabrics, weighted by vertices.
    ///
    /// # Errors
    /// A state of another outfit or with a number that is not finite.
    pub(super) fn solver(
        &self,
        state: OfflineState,
        par: Par,
    ) -> Result<OfflineSolver<'_>, OfflineError> {
        let mut settings = OfflineSettings::default();
        if let Some(contact) = &mut settings.contact {
            let total: f64 = (self.garments.iter())
                .map(|g| g.material.friction * g.vertices as f64)
                .sum();
            contact.friction = total / self.cloth.len().max(1) as f64;
        }
        OfflineSolver::new(&self.cloth, &self.body_faces, state, settings, par)
    }

    /// Start at rest from the real-time result, on the body that it met. Intersections are repaired on the coarse meshes;
    /// their subdivision has none.
    ///
    /// # Errors
    /// [`MirrorError::TangledStart`] when intersections stay.
    pub fn start(
        &self,
        worn: &DressedOutfit,
        par: Par,
    ) -> Result<(OfflineState, StartReport), MirrorError> {
        let mut x = positions(worn);
        let mut report = self.repair(&self.coarse, par, &mut x)?;
        let mut fine = self.refine(0, &x);
        if self.level > 0 {
            // Rounding of the middles.
            let again = self.repair(&self.garments, par, &mut fine)?;
            report.found += again.found;
            report.passes += again.passes;
        }
        Ok((self.state(fine, worn), report))
    }

    /// State at rest at these vertices of the finer meshes and the body.
    fn state(&self, mut x: Vec<V3d>, worn: &DressedOutfit) -> OfflineState {
        let placed = x.split_off(self.cloth.len());
        OfflineState {
            now: MotionState {
                v: vec![V3d::zeros(); x.len()],
                x,
            },
            obstacle: [placed, vectors(worn.state.collision_body().vertices())],
            ..OfflineState::default()
        }
    }

    /// State of a `coarse` outfit of the same preview, at rest, on these finer meshes.
    pub(super) fn refined(&self, coarse: &Self, state: &OfflineState) -> OfflineState {
        let x = self.refine(coarse.level, &state.now.x);
        OfflineState {
            time: state.time,
            now: MotionState {
                v: vec![V3d::zeros(); x.len()],
                x,
            },
            earlier: None,
            obstacle: state.obstacle.clone(),
        }
    }

    /// Vertices of the finer meshes from those of a coarser level; further ones stay behind them.
    fn refine(&self, level: usize, x: &[V3d]) -> Vec<V3d> {
        let (mut fine, mut first) = (Vec::new(), 0);
        for (garment, refinements) in self.coarse.iter().zip(&self.refinements) {
            let (known, further) = refinements.split_at(level);
            let count = known.last().map_or(garment.vertices, |s| s.mesh.vertices);
            let mut own = x[first..first + count].to_vec();
            first += count;
            for finer in further {
                own = finer.refine(&own);
            }
            fine.extend(own);
        }
        fine.extend(&x[first..]);
        fine
    }

    /// Frees `x`, the vertices of `garments` and of the body, of intersections.
    fn repair(
        &self,
        garments: &[GarmentMesh],
        par: Par,
        x: &mut [V3d],
    ) -> Result<StartReport, MirrorError> {
        let faces = joined_faces(garments);
        let count = garments.iter().map(|g| g.vertices).sum();
        let surface = |vertices, faces| ContactSurface { vertices, faces };
        let mesh = ContactMesh::new(
            surface(count, &faces),
            surface(x.len() - count, &self.body_faces),
        )
        .map_err(OfflineError::from)?;
        JoinedSurfaces(&mesh)
            .repair(par, x)
            .map_err(|fault| match fault {
                OfflineError::IntersectingStart { crossings, .. } => MirrorError::TangledStart {
                    found: crossings.len(),
                    places: places(garments, &mesh, &crossings, x),
                },
                other => other.into(),
            })
    }

    /// Targets of the tied vertices on a body (world, metres).
    pub fn pins(&self, body: &[P3]) -> Vec<PinTarget> {
        let target = |a: &AnchorBinding| PinTarget {
            vertex: a.vertex,
            target: a.position(a.body.map(|v| body[v as usize])).coords.cast(),
        };
        self.anchors.iter().map(target).collect()
    }

    /// Vertices of the drawn mesh of each garment (world, metres) from those of the cloth.
    pub fn drawn_positions(&self, x: &[P3]) -> Vec<Vec<P3>> {
        let mut first = 0;
        let drawn = |g: &GarmentMesh| {
            let mut out = Vec::new();
            g.render_positions(&x[first..first + g.vertices], &mut out);
            first += g.vertices;
            out
        };
        self.garments.iter().map(drawn).collect()
    }
}

/// Vertices of the garments, then of the body that they met (m).
fn positions(worn: &DressedOutfit) -> Vec<V3d> {
    let cloth = worn.state.garments.iter();
    let mut x: Vec<V3d> = cloth.flat_map(|g| vectors(&g.positions)).collect();
    x.extend(vectors(worn.state.collision_body().vertices()));
    x
}

fn vectors(points: &[P3]) -> Vec<V3d> {
    points.iter().map(|p| p.coords.cast()).collect()
}

/// Number of crossings between each pair of surfaces, with the place of the first (m).
fn places(
    garments: &[GarmentMesh],
    mesh: &ContactMesh,
    crossings: &[EdgeFace],
    x: &[V3d],
) -> String {
    let surface = |vertex: u32| {
        let mut first = 0;
        let own = garments.iter().find(|g| {
            first += g.vertices;
            (vertex as usize) < first
        });
        own.map_or("body", |g| g.name.as_str())
    };
    let mut found: BTreeMap<[&str; 2], (usize, V3d)> = BTreeMap::new();
    for EdgeFace { edge, face } in crossings {
        let (edge, face) = (mesh.edges()[*edge as usize], mesh.faces()[*face as usize]);
        let middle = (x[edge[0] as usize] + x[edge[1] as usize]) * 0.5;
        let pair = [surface(edge[0]), surface(face[0])];
        found.entry(pair).or_insert((0, middle)).0 += 1;
    }
    let each = found.iter().map(|([a, b], (count, at))| {
        format!(
            "{count} of {a} through {b}, first at ({:.3}, {:.3}, {:.3})",
            at.x, at.y, at.z
        )
    });
    each.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subdivisions_bring_the_count_nearest() {
        assert_eq!(levels(2000, 30_000), 2);
        assert_eq!(levels(2000, 0), 0);
        assert_eq!(levels(2000, 3900), 0);
        assert_eq!(levels(2000, 4100), 1);
        assert_eq!(levels(0, 10), 2);
    }
}
