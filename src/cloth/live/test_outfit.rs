//! A square of cloth in front of the embedded body, for tests.

use super::{Config, Model, Outfit, State};
use tryon_body::embedded;
use tryon_body::parts::vertex_masks;
use tryon_garment::{GarmentKind, GarmentMesh, Material, Region, RenderMesh, Size};
use tryon_geometry::math::P3;
use tryon_geometry::par::Par;

/// Edge of a cell of the square, metres.
const CELL: f64 = 0.015;

/// Upright square of `cells`² cells that touches nothing, and faces the body.
fn square(cells: u32) -> GarmentMesh {
    let id = |i: u32, j: u32| i * (cells + 1) + j;
    let cell = |(i, j)| {
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let cells_of = (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j)));
    let faces: Vec<[u32; 3]> = cells_of.flat_map(cell).collect();
    let flat = |v: u32| [v / (cells + 1), v % (cells + 1)].map(|k| CELL * f64::from(k));
    let vertices = (cells + 1).pow(2) as usize;
    GarmentMesh {
        name: "square".into(),
        kind: GarmentKind::Skirt,
        size: Size::M,
        material: Material::preset("jersey").expect("a preset"),
        layer: 0,
        vertices,
        rest: faces.iter().map(|f| f.map(flat)).collect(),
        faces,
        face_panel: vec![],
        panels: vec![],
        placements: vec![],
        corners: vec![],
        uv: vec![],
        regions: vec![Region::TRUNK; vertices],
        anchors: vec![],
        seams: vec![],
        render: RenderMesh::default(),
        min_angle: 45.0,
    }
}

/// Square at rest, its plane `gap` metres in front of the foremost vertex of the trunk, and the body.
pub(super) fn square_in_front(cells: u32, gap: f32) -> (Model, State, Vec<P3>) {
    let template = embedded::template();
    let body = template.mesh().vertices().to_vec();
    let trunk = vertex_masks(&template).into_iter().zip(&body);
    let trunk = trunk.filter(|(mask, _)| mask & Region::TRUNK.0 != 0);
    let foremost = trunk.map(|(_, p)| *p).max_by(|a, b| a.z.total_cmp(&b.z));
    let at = foremost.expect("a trunk");
    let place = |v: u32| {
        let half = 0.5 * f64::from(cells);
        let [x, y] = [v / (cells + 1), v % (cells + 1)].map(|k| CELL * (f64::from(k) - half));
        P3::new(at.x + x as f32, at.y + y as f32, at.z + gap)
    };
    let mesh = square(cells);
    let positions: Vec<P3> = (0..mesh.vertices as u32).map(place).collect();
    let outfit = Outfit {
        garments: vec![mesh],
        anchors: vec![Vec::new()],
    };
    let config = Config {
        par: Par::Seq,
        ..Config::default()
    };
    let model = Model::new(&template, outfit, config).expect("a model");
    let state = State::new(&model, vec![positions], &body).expect("a state");
    (model, state, body)
}
