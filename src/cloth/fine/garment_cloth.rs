//! Sewn garments as cloth of the offline solver: all in one index space, each of its own fabric.

use super::{
    AirDrag, ElasticTerm, ElementTerm, EnergyTerm, OfflineCloth, OfflineError, StitchSprings,
    sewn_pairs,
};
use crate::elastic::{ClothModel, ElasticFabric, RestSheet};
use crate::settings::AirSettings;
use nalgebra::Vector2;
use tryon_garment::{GarmentMesh, Material};
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

impl OfflineCloth {
    /// Garments in still air, flat at rest as cut, their vertices one after another.
    ///
    /// # Errors
    /// Names the face or modulus at fault; a vertex without a face has no mass.
    pub fn of_garments(garments: &[GarmentMesh], gravity: V3d) -> Result<Self, OfflineError> {
        let count = garments.iter().map(|g| g.vertices).sum();
        let (mut mass, mut faces, mut terms) = (vec![0.0; count], Vec::new(), Vec::new());
        let mut first = 0;
        for garment in garments {
            let own: Vec<Face> = (garment.faces.iter())
                .map(|f| f.map(|v| v + first as u32))
                .collect();
            let rest = RestSheet {
                faces: own.clone(),
                corners: (garment.rest.iter())
                    .map(|t| t.map(Vector2::from))
                    .collect(),
                folded: None,
            };
            let fabric = ElasticFabric::of_material(&garment.material);
            let model = ClothModel::new(&rest, count, fabric)?;
            for (sum, own) in mass.iter_mut().zip(model.masses()) {
                *sum += own;
            }
            terms.push(Box::new(ElasticTerm::new(model)) as Box<dyn EnergyTerm>);
            let air = AirDrag::new(own.clone(), &AirSettings::default());
            terms.push(Box::new(ElementTerm::new(air)));
            faces.extend(own);
            first += garment.vertices;
        }
        Self::new(mass, faces, gravity, terms)
    }

    /// One sheet of `count` vertices whose panels hold together by `seams`, flat at rest as cut.
    ///
    /// # Errors
    /// Names the face or modulus at fault; a vertex without a face has no mass.
    pub fn of_sewn_sheet(
        rest: &RestSheet,
        count: usize,
        material: &Material,
        seams: StitchSprings,
        gravity: V3d,
    ) -> Result<Self, OfflineError> {
        let fabric = ElasticFabric::of_material(material);
        let model = ClothModel::new(rest, count, fabric)?;
        let (mass, sewn) = (model.masses().to_vec(), sewn_pairs(&seams.stitches));
        let terms: Vec<Box<dyn EnergyTerm>> = vec![
            Box::new(ElasticTerm::new(model)),
            Box::new(ElementTerm::new(seams)),
        ];
        let mut cloth = Self::new(mass, rest.faces.clone(), gravity, terms)?;
        cloth.sewn = sewn;
        Ok(cloth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{Size, Triangulation, library, rest_area};

    #[test]
    fn garments_keep_their_weight_and_numbers() {
        let sew = |name| {
            let pattern = library::pattern(name, Size::M).expect("a pattern");
            GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn")
        };
        let garments = ["skirt", "tshirt"].map(sew);
        let cloth = OfflineCloth::of_garments(&garments, V3d::zeros()).expect("cloth");
        let mut first = 0;
        for g in &garments {
            let area: f64 = g.rest.iter().map(rest_area).sum();
            let mass: f64 = cloth.mass[first..first + g.vertices].iter().sum();
            assert!(
                (mass - area * g.material.area_density).abs() < 1e-9,
                "{mass} kg"
            );
            first += g.vertices;
        }
        assert_eq!(cloth.len(), first);
        let second = cloth.faces[garments[0].faces.len()];
        let offset = garments[0].vertices as u32;
        assert_eq!(second, garments[1].faces[0].map(|v| v + offset));
    }
}
