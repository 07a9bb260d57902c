//! A new body in the captured outfit (eq. 24, 25), in the captured or any other pose.

use super::CaptureError;
use super::archive::FrameDisplacements;
use super::layers::clear_body;
use super::multi::MultiCloth;
use super::retarget::{PenetrationSolver, RetargetReport, SolidBody, on_body};
use super::settings::PenetrationSettings;
use super::topology::ClothTemplate;
use std::sync::Arc;
use tryon_body::{ArmClearance, BoneTransforms, Pose, PosedSkin, RestBody, Template};
use tryon_geometry::math::{P3, World};
use tryon_geometry::par::Par;

/// Dressed body in one pose.
#[derive(Clone, Debug)]
pub struct DressedPose {
    /// Pose, with arms turned out where they had to be.
    pub pose: Pose<World>,
    /// Bones of the pose.
    pub bones: BoneTransforms,
    /// Posed body, its pressing parts apart, world, metres.
    pub body: Vec<P3>,
    /// Posed garments, world, metres.
    pub garments: Vec<Vec<P3>>,
    /// Report of each garment.
    pub reports: Vec<RetargetReport>,
}

/// Dresses bodies of one template in one outfit.
#[derive(Debug)]
pub struct BodyDresser<'a> {
    template: Arc<Template>,
    surface: ClothTemplate,
    cloth: &'a MultiCloth,
    solid: SolidBody,
    solvers: Vec<PenetrationSolver>,
}

impl<'a> BodyDresser<'a> {
    /// Prepares the systems of all garments.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a garment too large, [`CaptureError::Topology`] for a body without legs under a skirt.
    pub fn new(template: Arc<Template>, cloth: &'a MultiCloth) -> Result<Self, CaptureError> {
        let solvers = cloth.parts.iter().map(PenetrationSolver::new);
        Ok(Self {
            surface: ClothTemplate::new(&template, cloth.legs)?,
            solid: SolidBody::new(&template, PenetrationSettings::default())?,
            solvers: solvers.collect::<Result<_, _>>()?,
            template,
            cloth,
        })
    }

    /// Surface that the garments are parts of.
    pub fn surface(&self) -> &ClothTemplate {
        &self.surface
    }

    /// Dresses a rest body with the displacements of one scan and poses it, garments free of penetration. Where a wider
    /// body leaves no room for sleeves, its arms are turned outwards.
    ///
    /// # Errors
    /// [`CaptureError::Displacements`] for those of another outfit.
    pub fn dress(
        &mut self,
        target: &RestBody,
        displacements: &FrameDisplacements,
        pose: &Pose<World>,
    ) -> Result<DressedPose, CaptureError> {
        let inside = |d: &DressedPose| d.reports.iter().map(|r| r.inside).sum::<usize>();
        let first = self.dress_as_posed(target, displacements, pose)?;
        if inside(&first) == 0 {
            return Ok(first);
        }
        let Some(arms) = ArmClearance::new(&self.template, target) else {
            return Ok(first);
        };
        let apart = arms.separate(&self.template, target, pose, &mut BoneTransforms::default());
        let second = self.dress_as_posed(target, displacements, &apart)?;
        Ok(if inside(&second) < inside(&first) {
            second
        } else {
            first
        })
    }

    /// [`BodyDresser::dress`] in exactly the given pose.
    fn dress_as_posed(
        &mut self,
        target: &RestBody,
        displacements: &FrameDisplacements,
        pose: &Pose<World>,
    ) -> Result<DressedPose, CaptureError> {
        self.check(target, displacements)?;
        let rest = target.vertices.iter().zip(&displacements.body);
        let rest: Vec<P3> = rest.map(|(p, d)| p + d).collect();
        let mut bones = BoneTransforms::default();
        pose.bones(self.template.skeleton(), target, &mut bones);
        let (mut body, template) = (Vec::new(), &self.template);
        template.pose_vertices(Par::Rayon, &rest, &bones, &mut body);
        self.solid.place(&body)?;
        let rest = self.surface.extend(&rest);
        let skin = PosedSkin::new(self.surface.template(), &bones);
        let parts = self.cloth.parts.iter().zip(&displacements.garments);
        let posed = parts.map(|(part, d)| {
            let nodes = part.nodes.iter().map(|v| *v as usize);
            skin.pose(nodes, &on_body(part, d, &rest))
        });
        let mut garments: Vec<Vec<P3>> = posed.collect();
        let reports = clear_body(self.cloth, &mut self.solvers, &self.solid, &mut garments)?;
        Ok(DressedPose {
            pose: pose.clone(),
            bones,
            body: self.solid.vertices().to_vec(),
            garments,
            reports,
        })
    }

    /// Checks that body and displacements belong to the template and the outfit.
    fn check(
        &self,
        target: &RestBody,
        displacements: &FrameDisplacements,
    ) -> Result<(), CaptureError> {
        let garments = displacements.garments.iter().map(Vec::len);
        let got = [target.vertices.len(), displacements.body.len()].into_iter();
        let got: Vec<usize> = got.chain(garments).collect();
        let parts = self.cloth.parts.iter().map(|p| p.nodes.len());
        let body = self.template.mesh().vertices().len();
        let wanted: Vec<usize> = [body; 2].into_iter().chain(parts).collect();
        if got == wanted {
            return Ok(());
        }
        let why = format!("body, its displacements, garments: {got:?} vertices, not {wanted:?}");
        Err(CaptureError::Displacements { why })
    }
}
