//! Garments: fabrics, patterns, GarmentCode, scenes.

use super::{Target, lossy, text};
use crate::bundle::Bundle;
use std::path::Path;
use tryon::cloth::scene;
use tryon::formats::fabric_json::parse_fabric;
use tryon::formats::garmentcode::{is_garmentcode, parse_garmentcode};
use tryon::garment::import::from_garmentcode;
use tryon::garment::{Material, Pattern, Size};

/// Measured fabrics.
pub(super) const FABRIC: Target = Target::new(
    "fabric",
    "src/formats/fabric_json.rs",
    |b, _| {
        let fabric = parse_fabric(&lossy(b.first()), Path::new("fabric.json")).map_err(text)?;
        Ok(fabric.bending.len())
    },
    || {
        let json = serde_json::json!({
            "density": 0.2, "stretching": vec![[50.0, 8.0, 40.0, 20.0]; 6], "bending": vec![[1e-5; 5]; 3],
        });
        vec![Bundle::of("fabric.json", json.to_string())]
    },
)
.words("density stretching bending");

/// GarmentCode's patterns.
pub(super) const GARMENTCODE: Target = Target::new(
    "garmentcode",
    "src/formats/garmentcode.rs, src/garment/import/garmentcode/",
    |b, _| {
        let json = lossy(b.first());
        let _ = is_garmentcode(&json);
        let raw = parse_garmentcode(&json, Path::new("p.json")).map_err(text)?;
        let cotton = Material::preset("cotton").map_err(text)?;
        // A square is no garment for a body: refusing it is fine.
        let _ = from_garmentcode(&raw, "p", Size::M, cotton);
        Ok(raw.panels.len())
    },
    || vec![Bundle::of("p.json", SQUARE)],
)
.words("circle quadratic cubic curvature params endpoints units_in_meter translation rotation")
.allow(1 << 20, 2000);

const SQUARE: &str = r#"{"pattern":{"panels":{"a":{"translation":[0,0,10],"rotation":[0,10,0],
    "vertices":[[0,0],[50,0],[50,50],[0,50]],
    "edges":[{"endpoints":[0,1]},{"endpoints":[1,2],"curvature":{"type":"circle","params":[30,0,1]}},
    {"endpoints":[2,3],"curvature":[0.5,0.1]},{"endpoints":[3,0]}]},
    "b":{"translation":[0,0,-10],"vertices":[[0,0],[50,0],[50,50],[0,50]],
    "edges":[{"endpoints":[0,1]},{"endpoints":[1,2],"curvature":{"type":"cubic","params":[[0.3,0.1],[0.7,0.1]]}},
    {"endpoints":[2,3],"curvature":{"type":"quadratic","params":[[0.5,0.1]]}},{"endpoints":[3,0]}]}},
    "stitches":[[{"panel":"a","edge":1},{"panel":"b","edge":3}],[{"panel":"a","edge":3},{"panel":"b","edge":1}]]},
    "properties":{"units_in_meter":100,"curvature_coords":"relative"}}"#;

/// Our own patterns.
pub(super) const PATTERN: Target = Target::new(
    "pattern",
    "src/garment/pattern.rs",
    |b, _| {
        let pattern = Pattern::from_json(&lossy(b.first())).map_err(text)?;
        Ok(pattern.panels.len())
    },
    || {
        let pattern = tryon::garment::library::pattern("tshirt", Size::M);
        let json = pattern.map(|p| p.to_json()).unwrap_or_default();
        vec![Bundle::of("tshirt.json", json)]
    },
)
.words("Line Quadratic Cubic reversed panel edge")
.allow(1 << 20, 400);

/// Scenes of `tryon simulate` and of requests.
pub(super) const SCENE: Target = Target::new(
    "scene",
    "src/cloth/scene/file.rs, collider_file.rs",
    |b, scratch| {
        let folder = scratch.fill(b)?;
        let at = folder.join("scene.json");
        let scene = scene::parse(&lossy(b.get("scene.json")), &at, Some(folder)).map_err(text)?;
        Ok(scene.faces.len())
    },
    || {
        let swing = "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.1,0,0.1,0,0,0,0,1\n";
        let with_file = scene_json().replace("\"mesh_obj\"", "\"mesh_obj_unused\"");
        let with_file = with_file.replacen('{', "{\"mesh\":\"cloth.obj\",", 1);
        let mut value: serde_json::Value = serde_json::from_str(&with_file).unwrap_or_default();
        value["colliders"][0]["motion_csv"] = "swing.csv".into();
        let bundle = Bundle::of("scene.json", value.to_string()).and("cloth.obj", MESH);
        vec![
            Bundle::of("scene.json", scene_json()),
            bundle.and("swing.csv", swing),
        ]
    },
)
.words("sphere capsule world body motion motion_csv mesh_obj")
.allow(1 << 20, 2000);

const MESH: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

/// A scene that is complete in itself.
pub(super) fn scene_json() -> String {
    let scene = serde_json::json!({
        "mesh_obj": MESH, "pinned_vertices": [0, 1], "pinned_to": "world",
        "material": {
            "name": "cotton", "area_density_kg_m2": 0.2, "thickness_m": 5e-4, "young_membrane_N_m": 100.0,
            "poisson": 0.3, "bending_rigidity_N_m": 1e-3, "friction": 0.3,
        },
        "colliders": [
            {"type": "sphere", "radius": 0.2, "center": [0.0, -1.0, 0.0], "friction": 0.2},
            {"type": "capsule", "radius": 0.1, "half_segment": 0.2,
             "motion": [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0]]},
        ],
        "gravity": [0.0, -9.81, 0.0], "duration_s": 0.2, "output_fps": 60.0,
    });
    scene.to_string()
}
