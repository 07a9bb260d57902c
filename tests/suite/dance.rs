//! A T-shirt and a skirt on a body that dances fast and touches itself.

use tryon::body::parts::vertex_masks;
use tryon::cloth::Config;
use tryon::formats::shared_data;
use tryon_bench::OutfitSpec;
use tryon_bench::dance::load;

#[test]
fn an_outfit_survives_a_dance_outside_the_body_and_unstretched() {
    let Some(folder) = shared_data("garments/cipc_apache2") else {
        return;
    };
    let dance = load(&folder).unwrap();
    // The skeleton that was found for the bare mesh lies in it.
    assert!(dance.fit < 0.012, "{}", dance.fit);
    // Pegs in its wrists and ankles, four pieces of five vertices, are no skin: cloth in front of their tips is inside a limb.
    let parts = vertex_masks(&dance.template);
    assert_eq!(parts.iter().filter(|p| **p == 0).count(), 20);
    let garments = ["tshirt", "skirt"].map(str::to_owned).to_vec();
    let outfit = OutfitSpec {
        garments,
        edge: 0.022,
        config: Config::default(),
    };
    let report = dance.run(&outfit, 10.0).unwrap();
    println!(
        "{} vertices, p99 strain {:.3}, penetration {:?} m",
        report.vertices, report.p99_strain, report.penetration
    );
    assert_eq!((report.faults, report.ms.len()), (0, 288));
    // She touches herself and no skin of hers is ever inside another limb: taken to be, a shoulder blade (107 vertices,
    // with an arm stretched back) held no cloth for a tenth of a second. Skin moved back for room may fold at the end of a
    // crease: one vertex there; it takes two for a triangle to hold nothing.
    assert!(report.buried < 2, "{}", report.buried);
    // Speeds of single vertices carried through contact tore the skirt apart: 0.7 to 2.4. Pegs taken for skin: 0.16.
    assert!(report.p99_strain < 0.12, "{}", report.p99_strain);
    // The deepest vertex hangs on roundings: 1.4 to 3.9 mm over six lengths of edges.
    assert!(
        report.penetration[0] < 1e-3 && report.penetration[1] < 5e-3,
        "{:?}",
        report.penetration
    );
}
