//! Picture frame: shear force of a square patch by the angle of the frame's bars.
//!
//! Bars of length L at the angle π/2 − γ shear the patch homogeneously, an equilibrium of every mesh. The work of the force
//! along the diagonal is that of the bars: T L cos γ dγ. The shear stiffness is T/(L γ) at 2.5°, where KES-FB1 ends its
//! slope (Kawabata 1980).

use super::{FabricReading, FabricSolver, FabricTestReport, FabricTrial, carried};
use crate::elastic::{ClothModel, ElasticExpansion, ElasticFabric, RestSheet};
use crate::fine::OfflineError;
use crate::live::Sheet;
use crate::scene::SceneError;
use crate::settings::FabricTestSettings;
use crate::specimens::strip::{StripPattern, strip};
use nalgebra::Vector2;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

/// Length of a bar (m).
const SIDE: f64 = 0.1;

/// Runs the test.
pub(super) fn run(
    trial: &FabricTrial,
    settings: &FabricTestSettings,
) -> Result<FabricTestReport, SceneError> {
    let n = (SIDE / trial.edge).round().max(2.0);
    let mesh = strip(
        SIDE * (n - 1.5) / n,
        n as usize,
        n as usize,
        StripPattern::Alternating,
    );
    let first = mesh.at[0];
    let at: Vec<Vector2<f64>> = mesh.at.iter().map(|p| p - first).collect();
    let angle = settings.shear_angle;
    let (s, c) = angle.sin_cos();
    let x: Vec<V3d> = at
        .iter()
        .map(|p| V3d::new(p.x + p.y * s, 0.0, -p.y * c))
        .collect();
    let mut report = trial.report();
    let gradient = match trial.solver {
        FabricSolver::Offline => {
            let offline = offline(trial, &mesh.faces, &at, &x);
            offline.map_err(|e| SceneError::Offline(Box::new(e)))?
        }
        FabricSolver::Realtime => {
            let rest: Vec<[[f64; 2]; 3]> = (mesh.faces.iter())
                .map(|f| f.map(|v| at[v as usize].into()))
                .collect();
            let (limit, material) = carried(trial, &rest);
            report.resolution = Some(limit);
            let sheet = Sheet::new(at.len(), &mesh.faces, &rest, &material, None)?;
            let mut gradient = vec![V3d::zeros(); at.len()];
            sheet.add_gradient(&x, &mut gradient);
            gradient
        }
    };
    let rates = at.iter().map(|p| V3d::new(p.y * c, 0.0, p.y * s));
    let work: f64 = gradient.iter().zip(rates).map(|(g, r)| g.dot(&r)).sum();
    let force = work / (SIDE * c);
    report.readings.push(FabricReading {
        quantity: "shear stiffness",
        unit: "N/m",
        measured: force / (SIDE * angle),
        published: Some(trial.fabric.material.shear)
            .filter(|_| !trial.fabric.is_estimated("shear")),
        origin: "of the same fabric",
    });
    Ok(report)
}

/// Derivative of the offline energy by the positions (N).
fn offline(
    trial: &FabricTrial,
    faces: &[Face],
    at: &[Vector2<f64>],
    x: &[V3d],
) -> Result<Vec<V3d>, OfflineError> {
    let rest = RestSheet::flat(faces.to_vec(), at)?;
    let fabric = ElasticFabric::of_material(&trial.fabric.material);
    let model = ClothModel::new(&rest, at.len(), fabric)?;
    let mut e = ElasticExpansion::default();
    model.expand(Par::Rayon, x, &mut e);
    Ok(e.gradient)
}
