//! What can be worn: the library in the words of the wire.

use tryon::garment::{GarmentKind, Size, library};
use tryon_proto::convert::WireError;
use tryon_proto::v1::{GarmentChoice, GarmentInfo};

/// For people.
fn title(name: &str) -> String {
    match name {
        "tshirt" => "T-shirt".into(),
        "longsleeve" => "Long-sleeved shirt".into(),
        "tank" => "Tank top".into(),
        "hoodie" => "Hooded top".into(),
        other => (other[..1].to_uppercase() + &other[1..]).replace('_', " "),
    }
}

/// The colour a garment has unless another is chosen.
pub(crate) fn own_color(garment: &str) -> u32 {
    let [r, g, b] = library::dye(garment);
    u32::from_be_bytes([0, r, g, b])
}

/// Every garment, sorted by name.
pub(crate) fn garments() -> Vec<GarmentInfo> {
    let mut all: Vec<GarmentInfo> = library::names()
        .iter()
        .map(|name| {
            let kind = library::pattern(name, Size::M).map(|p| p.kind);
            GarmentInfo {
                name: (*name).into(),
                title: title(name),
                category: if matches!(kind, Ok(GarmentKind::Top | GarmentKind::Dress)) { "top" } else { "bottom" }
                    .into(),
                sizes: Size::ALL.iter().map(Size::to_string).collect(),
                color_rgb: own_color(name),
            }
        })
        .collect();
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}

/// The size of that name, in any case.
pub(crate) fn size(name: &str) -> Option<Size> {
    Size::ALL.into_iter().find(|s| s.to_string().eq_ignore_ascii_case(name))
}

/// Refuses what the library does not have.
pub(crate) fn check(choices: &[GarmentChoice]) -> Result<(), WireError> {
    for (i, c) in choices.iter().enumerate() {
        let fault = |f: &str, why: String| Err(WireError::new(format!("dress_request.garments[{i}].{f}"), why));
        if !library::names().contains(&c.garment.as_str()) {
            return fault(
                "garment",
                format!("`{}` is not known; there are {}", c.garment, library::names().join(", ")),
            );
        }
        if !c.size.is_empty() && size(&c.size).is_none() {
            let all = Size::ALL.iter().map(Size::to_string).collect::<Vec<_>>().join(", ");
            return fault("size", format!("`{}` is not known; there are {all}", c.size));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_listed_and_what_it_lacks_is_refused() {
        let all = garments();
        assert!(all.windows(2).all(|w| w[0].name < w[1].name));
        for g in &all {
            let choice = GarmentChoice { garment: g.name.clone(), size: g.sizes[0].clone(), color_rgb: None };
            check(&[choice]).expect("listed, so known");
        }
        let cape = GarmentChoice { garment: "cape".into(), ..Default::default() };
        assert_eq!(check(&[cape]).expect_err("no cape").field, "dress_request.garments[0].garment");
        let huge = GarmentChoice { garment: "tshirt".into(), size: "XXXXL".into(), color_rgb: None };
        assert_eq!(check(&[huge]).expect_err("no such size").field, "dress_request.garments[0].size");
    }
}
