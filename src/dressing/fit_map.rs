//! Fit map: stretch, pressure and gap of a garment on the body that wears it, per vertex and per body region.
//!
//! Pressure follows from balance: the skin carries the force of the stretched cloth and its weight. Positions suffice, so any
//! solver's state will do; in fast motion inertia reads as pressure.

use super::settings::FitMapSettings;
use super::suggest::FitClass;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use tryon_body::Template;
use tryon_body::parts::{BodySegment, BodySide};
use tryon_cloth::contact::{SurfaceFrame, SurfaceModel};
use tryon_cloth::{ClothError, Sheet};
use tryon_cloth::{Model, State};
use tryon_garment::{GarmentMesh, Region};
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::par::Par;

/// Fit at one vertex of a garment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VertexFit {
    /// Larger principal stretch minus one, mean of the triangles around.
    pub stretch: f32,
    /// Pressure on the skin, Pa; zero where the cloth does not touch.
    pub pressure: f32,
    /// Distance from the skin, metres.
    pub gap: f32,
}

/// Fit over one region of the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionFit {
    /// Tailor's name: `chest`, `waist`, `hip`, `left upper arm` …
    pub name: String,
    /// Area of cloth there, m².
    pub area: f64,
    /// Mean and 95th percentile of the stretch.
    pub stretch: [f64; 2],
    /// Mean pressure over the touching part and 95th percentile, Pa.
    pub pressure: [f64; 2],
    /// Share of the cloth that touches.
    pub touching: f64,
    /// Mean distance from the skin, metres.
    pub gap: f64,
    /// Class of the fit.
    pub fit: FitClass,
}

/// Fit of one garment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitMap {
    /// Shape `[simulation vertices]`.
    pub vertices: Vec<VertexFit>,
    /// From top to bottom.
    pub regions: Vec<RegionFit>,
}

/// Percentile of stretch and pressure that is reported; the maximum is noise of single vertices.
const PERCENTILE: usize = 95;
/// Gravity, m/s².
const GRAVITY: V3d = V3d::new(0.0, -9.81, 0.0);

/// Colours of loose, fitted and tight cloth, sRGB.
pub const FIT_COLORS: [[u8; 3]; 3] = [[58, 104, 190], [96, 168, 96], [206, 58, 48]];

impl VertexFit {
    /// From −1 (loose) by 0 (follows the body) to 1 (tight).
    pub fn tightness(&self, limits: &FitMapSettings) -> f32 {
        let tight = (self.stretch / limits.tight_stretch as f32)
            .max(self.pressure / limits.tight_pressure as f32)
            .clamp(0.0, 1.0);
        let loose = (self.gap / limits.loose_gap as f32).clamp(0.0, 1.0);
        if tight >= loose {
            tight
        } else {
            -loose * (1.0 - tight)
        }
    }
    /// Blue where loose, green where fitted, red where tight, sRGB.
    pub fn color(&self, limits: &FitMapSettings) -> [u8; 3] {
        let [loose, fitted, tight] = FIT_COLORS.map(|c| c.map(f32::from));
        let t = self.tightness(limits);
        let to = if t >= 0.0 { tight } else { loose };
        std::array::from_fn(|k| (fitted[k] + (to[k] - fitted[k]) * t.abs()).round() as u8)
    }
}

/// Probe that measures the fit of an outfit; keeps the nearest skin of each vertex between queries.
#[derive(Debug)]
pub struct FitProbe {
    /// Limits of the classes.
    pub settings: FitMapSettings,
    sheets: Vec<Sheet>,
    /// Region number of each body vertex.
    region: Vec<u8>,
    nearest: Vec<Vec<u32>>,
    frame: SurfaceFrame,
}

/// Regions from top to bottom, and the segments whose skin they are.
const REGIONS: [(&str, Option<BodySide>, &[BodySegment]); 15] = {
    use BodySegment::*;
    const LEFT: Option<BodySide> = Some(BodySide::Left);
    const RIGHT: Option<BodySide> = Some(BodySide::Right);
    [
        ("head", None, &[Head]),
        ("neck", None, &[Neck]),
        ("left shoulder", LEFT, &[Collar]),
        ("right shoulder", RIGHT, &[Collar]),
        ("chest", None, &[Chest]),
        ("left upper arm", LEFT, &[UpperArm]),
        ("right upper arm", RIGHT, &[UpperArm]),
        ("left forearm", LEFT, &[Forearm, Hand, Fingers]),
        ("right forearm", RIGHT, &[Forearm, Hand, Fingers]),
        ("waist", None, &[Abdomen]),
        ("hip", None, &[Pelvis]),
        ("left thigh", LEFT, &[Thigh]),
        ("right thigh", RIGHT, &[Thigh]),
        ("left lower leg", LEFT, &[Shin, Foot, Toes]),
        ("right lower leg", RIGHT, &[Shin, Foot, Toes]),
    ]
};
/// Region of the pelvis, for joints in no other.
const HIP: usize = 10;

impl FitProbe {
    /// Prepares an outfit.
    ///
    /// # Errors
    /// Faults of the garments.
    pub fn new(template: &Template, model: &Model) -> Result<Self, ClothError> {
        let parts = template.parts();
        let by_joint: Vec<u8> = (0..template.skeleton().len())
            .map(|j| {
                let is = |(_, side, segments): &(_, _, &[_])| {
                    *side == parts.side(j) && segments.contains(&parts.segment(j))
                };
                REGIONS.iter().position(is).unwrap_or(HIP) as u8
            })
            .collect();
        let n = template.mesh().vertices().len();
        let garments = &model.outfit.garments;
        Ok(Self {
            settings: FitMapSettings::default(),
            sheets: garments
                .iter()
                .map(Sheet::of_garment)
                .collect::<Result<_, _>>()?,
            region: (0..n)
                .map(|v| by_joint[template.weights().dominant(v)])
                .collect(),
            nearest: vec![Vec::new(); garments.len()],
            frame: SurfaceFrame::default(),
        })
    }
    /// Fit of every garment, in the order of the outfit; `body` is the posed body of the last step (world, metres).
    ///
    /// # Errors
    /// When the state or the body is not of this outfit.
    pub fn measure(
        &mut self,
        model: &Model,
        state: &State,
        body: &[P3],
    ) -> Result<Vec<FitMap>, ClothError> {
        let count = |what, got, expected| ClothError::Count {
            what,
            got,
            expected,
        };
        let surface = model.collision().surface();
        if body.len() != surface.vertices() || body.len() != self.region.len() {
            return Err(count("body vertices", body.len(), self.region.len()));
        }
        if state.garments.len() != self.sheets.len()
            || model.outfit.garments.len() != self.sheets.len()
        {
            return Err(count("garments", state.garments.len(), self.sheets.len()));
        }
        self.frame.vertices.clear();
        self.frame.vertices.extend_from_slice(body);
        surface.update_normals(Par::Rayon, &mut self.frame);
        let mut out = Vec::new();
        for (k, g) in state.garments.iter().enumerate() {
            let mesh = &model.outfit.garments[k];
            if g.positions.len() != mesh.vertices {
                return Err(count("garment vertices", g.positions.len(), mesh.vertices));
            }
            let worn = WornGarment {
                sheet: &self.sheets[k],
                mesh,
                positions: &g.positions,
                surface,
                frame: &self.frame,
                offset: model.offset(k) as f32,
                settings: &self.settings,
            };
            let near = &mut self.nearest[k];
            let vertices = worn.vertex_fits(near);
            let regions = worn.region_fits(&vertices, near, &self.region);
            out.push(FitMap { vertices, regions });
        }
        Ok(out)
    }
}

/// One garment on the posed body.
struct WornGarment<'a> {
    sheet: &'a Sheet,
    mesh: &'a GarmentMesh,
    positions: &'a [P3],
    surface: &'a SurfaceModel,
    frame: &'a SurfaceFrame,
    /// Distance of its layer from the skin, metres.
    offset: f32,
    settings: &'a FitMapSettings,
}

impl WornGarment<'_> {
    /// Fit of each vertex; `near`: nearest body vertices of the last query, or empty.
    fn vertex_fits(&self, near: &mut Vec<u32>) -> Vec<VertexFit> {
        let n = self.positions.len();
        let x: Vec<V3d> = self.positions.iter().map(|p| p.coords.cast()).collect();
        let mut gradient = vec![V3d::zeros(); n];
        self.sheet.add_gradient(&x, &mut gradient);
        let (mut area, mut stretch) = (vec![0.0f64; n], vec![0.0f64; n]);
        for e in &self.sheet.elements {
            let f = e.gradient(&x);
            let c = f.transpose() * f;
            // Larger eigenvalue of the 2×2 Cauchy–Green tensor.
            let (half, det) = (0.5 * c.trace(), c.determinant());
            let largest = (half + (half * half - det).max(0.0).sqrt()).sqrt() - 1.0;
            for v in e.v {
                area[v as usize] += e.area / 3.0;
                stretch[v as usize] += largest * e.area / 3.0;
            }
        }
        let mask = |i: usize| self.mesh.regions.get(i).map_or(Region::ALL.0, |r| r.0);
        let (surface, frame) = (self.surface, self.frame);
        if near.len() != n {
            *near = (0..n)
                .map(|i| surface.nearest_vertex(frame, &self.positions[i], mask(i)))
                .collect();
        }
        (0..n)
            .map(|i| {
                let c = surface.closest_across_parts(frame, &self.positions[i], near[i], mask(i));
                near[i] = c.vertex;
                let a = area[i].max(f64::MIN_POSITIVE);
                let gap = c.signed_distance.max(0.0);
                let pressure = if gap < self.offset + self.settings.touch {
                    // −gradient + weight + skin = 0 along the normal.
                    let force = gradient[i] - GRAVITY * self.sheet.mass[i];
                    c.normal.cast::<f64>().dot(&force).max(0.0) / a
                } else {
                    0.0
                };
                VertexFit {
                    stretch: (stretch[i] / a) as f32,
                    pressure: pressure as f32,
                    gap,
                }
            })
            .collect()
    }
    /// Fit of each region that has enough cloth; `region` per body vertex.
    fn region_fits(&self, fits: &[VertexFit], near: &[u32], region: &[u8]) -> Vec<RegionFit> {
        let limits = self.settings;
        let mut area = vec![0.0f64; fits.len()];
        for e in &self.sheet.elements {
            e.v.iter().for_each(|v| area[*v as usize] += e.area / 3.0);
        }
        // Firm anchors stretch the cloth where they hold it.
        let firm = self.mesh.anchors.iter().filter(|a| a.strength >= 1.0);
        let held: BTreeSet<u32> = firm.flat_map(|a| a.vertices.iter().copied()).collect();
        let mut out = Vec::new();
        for (r, (name, ..)) in REGIONS.iter().enumerate() {
            let own: Vec<usize> = (0..fits.len())
                .filter(|i| usize::from(region[near[*i] as usize]) == r)
                .collect();
            let total: f64 = own.iter().map(|i| area[*i]).sum();
            if total < limits.least_area {
                continue;
            }
            let most = |value: &dyn Fn(&VertexFit) -> f32| {
                let free = own.iter().filter(|i| !held.contains(&(**i as u32)));
                let mut all: Vec<f32> = free.map(|i| value(&fits[*i])).collect();
                percentile(&mut all, PERCENTILE).map_or(0.0, f64::from)
            };
            let mean = |value: &dyn Fn(&VertexFit) -> f32| {
                own.iter()
                    .map(|i| f64::from(value(&fits[*i])) * area[*i])
                    .sum::<f64>()
                    / total
            };
            let touching = mean(&|v| f32::from(u8::from(v.pressure > 0.0)));
            let stretch = [mean(&|v| v.stretch), most(&|v| v.stretch)];
            let on_skin = if touching > 0.0 {
                mean(&|v| v.pressure) / touching
            } else {
                0.0
            };
            let pressure = [on_skin, most(&|v| v.pressure)];
            let gap = mean(&|v| v.gap);
            let fit = if stretch[1] > limits.tight_stretch || pressure[0] > limits.tight_pressure {
                FitClass::Tight
            } else if gap > limits.loose_gap {
                FitClass::Loose
            } else {
                FitClass::Fitted
            };
            out.push(RegionFit {
                name: (*name).to_owned(),
                area: total,
                stretch,
                pressure,
                touching,
                gap,
                fit,
            });
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;
    use tryon_garment::{GarmentKind, Material, RenderMesh, Size};
    use tryon_geometry::mesh::{Face, Topology, TriMesh};

    /// An open tube about y, radius `r`, `n` × `m` cells, 0.3 m high; faces outward.
    fn tube(r: f64, n: u32, m: u32) -> (Vec<P3>, Vec<Face>) {
        let at = |i: u32, j: u32| j * n + i % n;
        let mut v = Vec::new();
        for j in 0..=m {
            for i in 0..n {
                let a = TAU * f64::from(i) / f64::from(n);
                v.push(P3::new(
                    (r * a.sin()) as f32,
                    0.3 * j as f32 / m as f32,
                    (r * a.cos()) as f32,
                ));
            }
        }
        let f = (0..m).flat_map(|j| {
            (0..n).flat_map(move |i| {
                [
                    [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                    [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                ]
            })
        });
        (v, f.collect())
    }

    /// A garment tube of girth `girth` worn at radius `r` on a body cylinder of 10 cm.
    fn worn(girth: f64, r: f64) -> Vec<VertexFit> {
        let (n, m) = (64, 20);
        let (body, body_faces) = tube(0.1, 96, 30);
        let mesh = TriMesh::new(body.clone(), body_faces.clone()).expect("mesh");
        let surface = SurfaceModel::new(
            body_faces,
            Topology::new(&mesh).expect("topology"),
            vec![1; body.len()],
        );
        let mut frame = SurfaceFrame {
            vertices: body,
            normals: Vec::new(),
        };
        surface.update_normals(Par::Seq, &mut frame);
        let (x, faces) = tube(r, n, m);
        let flat = |v: u32, wrap: bool| {
            let (i, j) = (v % n, v / n);
            let i = if wrap && i == 0 { n } else { i };
            [
                girth * f64::from(i) / f64::from(n),
                0.3 * f64::from(j) / f64::from(m),
            ]
        };
        let rest: Vec<[[f64; 2]; 3]> = faces
            .iter()
            .map(|f| {
                let wrap = f.iter().any(|v| v % n == n - 1);
                f.map(|v| flat(v, wrap))
            })
            .collect();
        let material = Material {
            coupling: 0.0,
            area_density: 1e-9,
            ..Material::preset("jersey").expect("preset")
        };
        let sheet = Sheet::new(x.len(), &faces, &rest, &material, None).expect("sheet");
        let garment = GarmentMesh {
            name: "tube".into(),
            kind: GarmentKind::Skirt,
            size: Size::M,
            material,
            layer: 0,
            vertices: x.len(),
            faces,
            rest,
            face_panel: vec![],
            panels: vec![],
            placements: vec![],
            corners: vec![],
            uv: vec![],
            regions: vec![Region(1); x.len()],
            anchors: vec![],
            seams: vec![],
            render: RenderMesh::default(),
            min_angle: 45.0,
        };
        WornGarment {
            sheet: &sheet,
            mesh: &garment,
            positions: &x,
            surface: &surface,
            frame: &frame,
            offset: 0.005,
            settings: &FitMapSettings::default(),
        }
        .vertex_fits(&mut Vec::new())
    }

    #[test]
    fn pressure_of_a_stretched_tube_is_tension_over_radius() {
        let (r, strain) = (0.105, 0.04);
        let fit = worn(TAU * r / (1.0 + strain), r);
        let m = Material::preset("jersey").expect("preset");
        let expected = m.stretch_weft * strain / r; // Laplace: p = T/r
        // Rows away from the rims.
        let middle: Vec<&VertexFit> = fit.iter().skip(64 * 5).take(64 * 10).collect();
        let mean = |f: &dyn Fn(&VertexFit) -> f32| {
            middle.iter().map(|v| f64::from(f(v))).sum::<f64>() / middle.len() as f64
        };
        assert!(
            (mean(&|v| v.stretch) - strain).abs() < 2e-3,
            "{}",
            mean(&|v| v.stretch)
        );
        let p = mean(&|v| v.pressure);
        assert!(
            (p - expected).abs() < 0.05 * expected,
            "{p} Pa, {expected} expected"
        );
        let limits = FitMapSettings::default();
        assert!(
            middle
                .iter()
                .all(|v| v.tightness(&limits) > 0.5 && v.color(&limits)[0] > v.color(&limits)[2])
        );
    }

    #[test]
    fn a_tube_off_the_body_has_no_pressure_and_its_gap_is_the_distance() {
        let (fit, limits) = (worn(TAU * 0.15, 0.15), FitMapSettings::default());
        for v in fit.iter().skip(64 * 5).take(64 * 10) {
            assert!(
                v.pressure == 0.0 && (v.gap - 0.05).abs() < 1e-3 && v.stretch.abs() < 2e-3,
                "{v:?}"
            );
            assert!(v.tightness(&limits) < -0.9 && v.color(&limits)[2] > v.color(&limits)[0]);
        }
    }
}
