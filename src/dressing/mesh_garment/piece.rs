//! One piece of a mesh garment: a sheet of cloth, or an accessory that keeps its shape.

use super::anchors::anchors;
use super::classifier::{LEGS, PieceClassifier, PieceShape, Support};
use super::file_part::FilePart;
use super::grading::{Grading, LimbShares};
use super::skin_lift::lifted;
use super::surface::{follow_both_legs, orient_outwards, unroll};
use crate::retarget::Retargeting;
use crate::settings::{MeshGarmentSettings, PieceSettings};
use tryon_body::{SkinBinding, SkinSearch};
use tryon_formats::obj::ObjMesh;
use tryon_formats::sewn_obj::SewnObj;
use tryon_garment::import::{
    coarsen, from_mesh, median_edge, panels_in_metres, some_faces, unfold, widened,
};
use tryon_garment::{
    AnchorKind, AnchorSet, GarmentError, GarmentKind, GarmentMesh, Material, Region, Size,
    rest_area,
};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, Topology, TriMesh, face_normal, remesh};

/// A piece on the body that it was made on.
#[derive(Clone, Debug)]
pub(super) struct GarmentPiece {
    pub(super) garment: GarmentMesh,
    /// Metres, frame of the source body.
    pub(super) positions: Vec<P3>,
    pub(super) binding: SkinBinding,
    rest: RestShape,
    /// Mean share of the way that it goes around the source body.
    pub(super) wrap: f64,
    /// Part of the file that it comes from.
    pub(super) part: FilePart,
}

/// Origin of a piece's rest shape on another body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RestShape {
    /// Taken from the other body, as the programs of their makers do.
    Fitted,
    /// Flat panels that keep their shape and are scaled to the body.
    Scaled,
    /// That of a size, on any body.
    Sized,
}

/// Settings that all pieces of a garment share.
pub(super) struct PieceBuilder<'a> {
    pub(super) classifier: &'a PieceClassifier<'a>,
    pub(super) name: &'a str,
    pub(super) material: &'a Material,
    pub(super) settings: &'a MeshGarmentSettings,
}

impl PieceBuilder<'_> {
    /// A sheet of cloth, the `number`th, and a note about it.
    pub(super) fn cloth(
        &self,
        number: usize,
        sewn: SewnObj,
    ) -> Result<(GarmentPiece, String), GarmentError> {
        let part = FilePart::new(number, &sewn);
        let (sewn, settings) = (self.remeshed(sewn), self.settings);
        let made = from_mesh(&sewn, self.name, GarmentKind::Top, self.material.clone())?;
        let (mut garment, mut x) = (made.garment, made.positions);
        let mut more = String::new();
        if made.open + made.closed > 0 {
            more = format!(
                ", {} stitches open, {} triangles closed",
                made.open, made.closed
            );
        }
        if made.flat && median_edge(&garment) < settings.piece.finer * settings.edge {
            more += &format!(", {} in the file", garment.vertices);
            (garment, x) = coarsen(&garment, &x, settings.edge, &settings.coarsen);
        }
        let topology = garment.topology()?;
        let template = self.classifier.template;
        let neighbours = |i: usize| topology.vertex_neighbours().row(i).to_vec();
        let mut binding = SkinBinding::new(template, &x, neighbours);
        orient_outwards(&mut garment, &x, &binding);
        if !made.flat {
            unroll(&mut garment, &x, settings.surface.unroll_radius);
            for rest in &mut garment.rest {
                *rest = widened(*rest, settings.piece.least_height);
            }
        }
        let shape = self
            .classifier
            .classify(&topology, &garment.faces, &x, &binding);
        if !shape.has_legs {
            follow_both_legs(template, &x, &mut binding, &settings.surface);
        }
        garment.kind = shape.kind;
        garment.regions = regions(&shape, &topology, &x, settings.piece.middle);
        garment.anchors = anchors(template, &shape, &x, &settings.anchors);
        let note = format!(
            "{part}: {}, {} vertices, {}{more}",
            kind_name(shape.kind),
            garment.vertices,
            if made.flat {
                "panels graded to the body"
            } else {
                "fitted to the body"
            }
        );
        let piece = GarmentPiece {
            garment,
            positions: x,
            binding,
            wrap: shape.wrap,
            part,
            rest: if made.flat {
                RestShape::Scaled
            } else {
                RestShape::Fitted
            },
        };
        Ok((piece, note))
    }
    /// The accessories as one rigid piece; `None` where no triangle of them has an area.
    pub(super) fn rigid(&self, pieces: &[SewnObj]) -> Result<Option<GarmentPiece>, GarmentError> {
        let has_area = |m: &TriMesh, f: &Face| {
            0.5 * f64::from(face_normal(m.vertices(), f).norm()) > self.settings.piece.least_area
        };
        let kept = merge(pieces).and_then(|merged| {
            let mesh = &merged.obj.mesh;
            let faces = 0..mesh.faces().len();
            let kept: Vec<usize> = faces
                .filter(|f| has_area(mesh, &mesh.faces()[*f]))
                .collect();
            some_faces(&merged, &kept)
        });
        let Some(sewn) = kept else {
            return Ok(None);
        };
        let made = from_mesh(&sewn, self.name, GarmentKind::Top, self.material.clone())?;
        let (mut garment, positions) = (made.garment, made.positions);
        garment.anchors = vec![AnchorSet {
            kind: AnchorKind::Rigid,
            vertices: (0..positions.len() as u32).collect(),
            strength: 1.0,
        }];
        Ok(Some(GarmentPiece {
            garment,
            binding: SkinBinding::new(self.classifier.template, &positions, |_| Vec::new()),
            positions,
            rest: RestShape::Fitted,
            wrap: 0.0,
            part: FilePart::default(),
        }))
    }
    /// A mesh without flat panels gets even triangles.
    fn remeshed(&self, sewn: SewnObj) -> SewnObj {
        let is_plain = sewn.stitches.is_empty() && sewn.obj.face_uv.is_empty();
        if !is_plain && panels_in_metres(&sewn) {
            return sewn;
        }
        SewnObj {
            obj: ObjMesh::from(remesh(&sewn.obj.mesh, self.settings.edge)),
            stitches: Vec::new(),
        }
    }
}

fn kind_name(kind: GarmentKind) -> &'static str {
    match kind {
        GarmentKind::Top => "top",
        GarmentKind::Skirt => "skirt",
        GarmentKind::Trousers => "trousers",
        GarmentKind::Dress => "dress or suit",
    }
}

/// Body parts that each vertex may touch: its own, at the border of sleeve and trunk both, and both legs within `middle`
/// metres of the sagittal plane.
fn regions(shape: &PieceShape, topology: &Topology, x: &[P3], middle: f32) -> Vec<Region> {
    let own = |i: usize| -> Region {
        let p = Region(shape.parts[i]);
        if p.meets(Region::ARMS) {
            return p;
        }
        let over_trunk = p.meets(Region::TRUNK) && shape.support == Support::Shoulders;
        Region::TRUNK.with(if !shape.has_legs || over_trunk || x[i].x.abs() < middle {
            LEGS
        } else if x[i].x > 0.0 {
            Region::LEFT_LEG
        } else {
            Region::RIGHT_LEG
        })
    };
    let own: Vec<Region> = (0..x.len()).map(own).collect();
    (0..x.len())
        .map(|i| {
            let around = topology.vertex_neighbours().row(i).iter();
            around.fold(own[i], |r, n| r.with(own[*n as usize]))
        })
        .collect()
}

/// One surface of some; without their stitches if there are several.
pub(super) fn merge(pieces: &[SewnObj]) -> Option<SewnObj> {
    let mut out = pieces.first()?.clone();
    let (mut vertices, mut faces) = (
        out.obj.mesh.vertices().to_vec(),
        out.obj.mesh.faces().to_vec(),
    );
    for p in &pieces[1..] {
        let first = vertices.len() as u32;
        vertices.extend(p.obj.mesh.vertices());
        faces.extend(p.obj.mesh.faces().iter().map(|f| f.map(|v| v + first)));
        out.obj.face_uv.extend(&p.obj.face_uv);
        out.obj.origins.faces.extend(&p.obj.origins.faces);
    }
    if pieces.len() > 1 {
        out.stitches.clear();
    }
    out.obj.mesh = TriMesh::new(vertices, faces).ok()?;
    Some(out)
}

impl GarmentPiece {
    pub(super) fn is_rigid(&self) -> bool {
        let mut anchors = self.garment.anchors.iter();
        anchors.any(|a| a.kind == AnchorKind::Rigid)
    }
    /// The piece on another body: its mesh, and positions in the canonical pose (m). Points are put above `skin`.
    pub(super) fn retargeted(
        &self,
        map: &Retargeting,
        skin: &SkinSearch<'_>,
        settings: &MeshGarmentSettings,
    ) -> (GarmentMesh, Vec<P3>) {
        let (binding, rigid) = (&self.binding, self.is_rigid());
        let x: Vec<P3> = (0..self.positions.len())
            .map(|i| {
                let p = map.point(&self.positions[i], &binding.joints[i], &binding.vertices[i]);
                if rigid {
                    p
                } else {
                    lifted(skin, p, &settings.lift)
                }
            })
            .collect();
        let mut garment = self.garment.clone();
        match self.rest {
            RestShape::Scaled => self.scale_rest(&x, &mut garment),
            RestShape::Fitted => take_rest(&x, &mut garment, settings.piece.collapsed),
            RestShape::Sized => {}
        }
        (garment, x)
    }
    /// Scales flat panels by the square root of the change of area, from the source body to positions `x`.
    fn scale_rest(&self, x: &[P3], garment: &mut GarmentMesh) {
        let area = |x: &[P3]| {
            let faces = garment.faces.iter();
            faces
                .map(|f| f64::from(face_normal(x, f).norm()))
                .sum::<f64>()
        };
        let grade = (area(x) / area(&self.positions).max(f64::MIN_POSITIVE)).sqrt();
        for c in garment.rest.iter_mut().flatten().flatten() {
            *c *= grade;
        }
    }
    /// The piece in a size, its rest shape fixed: that over the source body at `x` (m, off its skin), graded.
    pub(super) fn in_size(
        &self,
        size: Size,
        grading: &Grading<'_>,
        x: &[P3],
        settings: &PieceSettings,
    ) -> Self {
        let mut out = self.clone();
        out.garment.size = size;
        if self.is_rigid() {
            return out;
        }
        if self.rest == RestShape::Fitted {
            take_rest(x, &mut out.garment, settings.collapsed);
        }
        let shares: Vec<LimbShares> = self
            .binding
            .joints
            .iter()
            .map(|row| grading.limbs.shares(row))
            .collect();
        for (rest, f) in out.garment.rest.iter_mut().zip(&self.garment.faces) {
            let of_face = f.map(|v| shares[v as usize]);
            let mean = std::array::from_fn(|k| of_face.iter().map(|s| s[k]).sum::<f64>() / 3.0);
            *rest = grading.graded(rest, f.map(|v| x[v as usize]), &mean);
        }
        out.rest = RestShape::Sized;
        out
    }
}

/// Takes the rest shape of all triangles that have not collapsed from positions `x`, metres.
fn take_rest(x: &[P3], garment: &mut GarmentMesh, collapsed: f64) {
    for (rest, f) in garment.rest.iter_mut().zip(&garment.faces) {
        let t = unfold(f.map(|v| x[v as usize].coords.cast()));
        if rest_area(&t) > collapsed * rest_area(rest) {
            *rest = t;
        }
    }
}

#[cfg(test)]
mod tests;
