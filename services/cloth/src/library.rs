//! Garments on offer: those of the library and of the configured folder, as the wire lists them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::dressing::{MeshGarment, SourceBody};
use tryon::garment::{GarmentKind, Material, Size, Triangulation, library};
use tryon::mirror::Choice;
use tryon_kit::config::ClothConfig;
use tryon_kit::server::StartError;
use tryon_proto::convert::WireError;
use tryon_proto::keys::is_name;
use tryon_proto::v1::{GarmentChoice, GarmentInfo};

/// Endings of mesh garment files.
const MESHES: [&str; 4] = ["mhclo", "obj", "glb", "gltf"];

/// Title of a garment for people.
fn title(name: &str) -> String {
    match name {
        "tshirt" => "T-shirt".into(),
        "longsleeve" => "Long-sleeved shirt".into(),
        "tank" => "Tank top".into(),
        "hoodie" => "Hooded top".into(),
        other => (other[..1].to_uppercase() + &other[1..]).replace('_', " "),
    }
}

/// Colour of a garment unless another is chosen, 0x00RRGGBB.
pub(crate) fn own_color(garment: &str) -> u32 {
    let [r, g, b] = library::dye(garment);
    u32::from_be_bytes([0, r, g, b])
}

/// The size of that name, in any case.
fn size(name: &str) -> Option<Size> {
    Size::ALL
        .into_iter()
        .find(|s| s.to_string().eq_ignore_ascii_case(name))
}

/// Everything that can be worn.
#[derive(Debug, Default)]
pub(crate) struct Library {
    meshes: BTreeMap<String, Arc<MeshGarment>>,
}

impl Library {
    /// Reads the garments of the configured folder; what is at fault in it is logged and left out.
    ///
    /// # Errors
    /// A folder, body or material that cannot be used, by its key.
    pub(crate) fn read(config: &ClothConfig) -> Result<Self, StartError> {
        let fault = |key: &str, why: String| StartError::Config {
            key: format!("cloth.{key}"),
            why,
        };
        let material =
            |key: &str, name: &str| Material::preset(name).map_err(|e| fault(key, e.to_string()));
        let all = material("garments_material", &config.garments_material)?;
        let mut single = BTreeMap::new();
        for (garment, name) in &config.garment_materials {
            let key = format!("garment_materials.{garment}");
            single.insert(garment.as_str(), material(&key, name)?);
        }
        let mut found = Self::default();
        if config.garments.as_os_str().is_empty() {
            return Ok(found);
        }
        let unreadable =
            |e: std::io::Error| fault("garments", format!("{}: {e}", config.garments.display()));
        let files = files(&config.garments).map_err(unreadable)?;
        let body = &config.garments_body;
        let body = (!body.as_os_str().is_empty())
            .then(|| SourceBody::read(body))
            .transpose();
        let body = body.map_err(|e| {
            fault(
                "garments_body",
                format!("{}: {e}", config.garments_body.display()),
            )
        })?;
        for file in files {
            let name = name_of(&file);
            let material = single.get(name.as_str()).unwrap_or(&all);
            match found.add(&name, &file, body.clone(), material) {
                Ok(notes) => {
                    tracing::info!(garment = name, file = %file.display(), notes, "offered")
                }
                Err(why) => tracing::error!(file = %file.display(), why, "a garment is left out"),
            }
        }
        if let Some(garment) = single.keys().find(|g| !found.meshes.contains_key(**g)) {
            tracing::warn!(
                garment,
                "cloth.garment_materials names a garment that the folder does not offer"
            );
        }
        Ok(found)
    }

    fn add(
        &mut self,
        name: &str,
        file: &Path,
        body: Option<SourceBody>,
        material: &Material,
    ) -> Result<String, String> {
        if !is_name(name) {
            return Err("its name has none of [a-z0-9_-], or more than 64 characters".into());
        }
        if library::names().contains(&name) || self.meshes.contains_key(name) {
            return Err(format!("there is another garment named {name}"));
        }
        let edge = Triangulation::default().edge_length;
        let wear = MeshGarment::read_on(file, body, material, edge)
            .map_err(|e| e.to_string())?
            .named(name);
        let notes = wear.notes.join("; ");
        self.meshes.insert(name.to_owned(), Arc::new(wear));
        Ok(notes)
    }

    /// A checked wire choice in the terms of the chain. Without a size, and for meshes, the body decides.
    pub(crate) fn choice(&self, c: &GarmentChoice) -> Choice {
        match self.meshes.get(&c.garment) {
            Some(mesh) => Choice::Mesh(Arc::clone(mesh)),
            None => Choice::Library {
                name: c.garment.clone(),
                size: size(&c.size),
            },
        }
    }

    /// Every garment, sorted by name.
    pub(crate) fn garments(&self) -> Vec<GarmentInfo> {
        let info = |name: &str, over: bool, sizes: Vec<String>| GarmentInfo {
            name: name.into(),
            title: title(name),
            category: if over { "top" } else { "bottom" }.into(),
            sizes,
            color_rgb: own_color(name),
        };
        let cut = library::names().iter().map(|name| {
            let kind = library::pattern(name, Size::M).map(|p| p.kind);
            let over = matches!(kind, Ok(GarmentKind::Top | GarmentKind::Dress));
            info(name, over, Size::ALL.iter().map(Size::to_string).collect())
        });
        // Meshes are fitted to the body: they come in one size.
        let made = self
            .meshes
            .iter()
            .map(|(name, m)| info(name, m.layer() > 0, Vec::new()));
        let mut all: Vec<GarmentInfo> = cut.chain(made).collect();
        all.sort_by(|a, b| a.name.cmp(&b.name));
        all
    }

    /// Refuses unknown garments and sizes.
    ///
    /// # Errors
    /// Names the field of the request.
    pub(crate) fn check(&self, choices: &[GarmentChoice]) -> Result<(), WireError> {
        for (i, c) in choices.iter().enumerate() {
            let fault = |f: &str, why: String| {
                Err(WireError::new(
                    format!("dress_request.garments[{i}].{f}"),
                    why,
                ))
            };
            let is_mesh = self.meshes.contains_key(&c.garment);
            if !is_mesh && !library::names().contains(&c.garment.as_str()) {
                let all: Vec<String> = self.garments().into_iter().map(|g| g.name).collect();
                return fault(
                    "garment",
                    format!("`{}` is not known; there are {}", c.garment, all.join(", ")),
                );
            }
            if is_mesh && !c.size.is_empty() {
                return fault(
                    "size",
                    format!("`{}` comes in one size; leave it empty", c.garment),
                );
            }
            if !c.size.is_empty() && size(&c.size).is_none() {
                let all = Size::ALL
                    .iter()
                    .map(Size::to_string)
                    .collect::<Vec<_>>()
                    .join(", ");
                return fault(
                    "size",
                    format!("`{}` is not known; there are {all}", c.size),
                );
            }
        }
        Ok(())
    }
}

/// Garment files of a folder and of the folders in it, in the order of their paths. The mesh that an `.mhclo` binds is no
/// garment of its own.
fn files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let list = |folder: &Path| -> std::io::Result<Vec<PathBuf>> {
        std::fs::read_dir(folder)?
            .map(|entry| Ok(entry?.path()))
            .collect()
    };
    let mut all = list(folder)?;
    for inner in all.clone().iter().filter(|p| p.is_dir()) {
        all.extend(list(inner)?);
    }
    let kind = |p: &Path| {
        p.extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
    };
    all.retain(|p| p.is_file() && kind(p).is_some_and(|k| MESHES.contains(&k.as_str())));
    let bound: Vec<PathBuf> = all
        .iter()
        .filter(|p| kind(p).as_deref() == Some("mhclo"))
        .cloned()
        .collect();
    all.retain(|p| {
        kind(p).as_deref() == Some("mhclo")
            || !bound
                .iter()
                .any(|b| b.with_extension("") == p.with_extension(""))
    });
    all.sort();
    Ok(all)
}

/// Name of the garment in a file: lower case, with `_` for every other character.
fn name_of(file: &Path) -> String {
    let stem = file
        .file_stem()
        .map_or_else(String::new, |s| s.to_string_lossy().to_lowercase());
    stem.chars()
        .map(|c| {
            if c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' {
                c
            } else {
                '_'
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_listed_and_what_it_lacks_is_refused() {
        let library = Library::default();
        let all = library.garments();
        assert!(all.windows(2).all(|w| w[0].name < w[1].name));
        for g in &all {
            let choice = GarmentChoice {
                garment: g.name.clone(),
                size: g.sizes[0].clone(),
                color_rgb: None,
            };
            library.check(&[choice]).expect("listed, so known");
        }
        let cape = GarmentChoice {
            garment: "cape".into(),
            ..Default::default()
        };
        assert_eq!(
            library.check(&[cape]).expect_err("no cape").field,
            "dress_request.garments[0].garment"
        );
        let huge = GarmentChoice {
            garment: "tshirt".into(),
            size: "XXXXL".into(),
            color_rgb: None,
        };
        assert_eq!(
            library.check(&[huge]).expect_err("no such size").field,
            "dress_request.garments[0].size"
        );
    }

    /// A skirt-like tube around a standing person's hips, as OBJ; `broken` has a face beyond its vertices.
    fn tube(broken: bool) -> String {
        let (rings, around) = (12, 36);
        let mut text = String::new();
        for k in 0..=rings {
            let (y, r) = (
                0.55 + 0.45 * f64::from(k) / f64::from(rings),
                0.24 - 0.04 * f64::from(k) / f64::from(rings),
            );
            for j in 0..around {
                let t = std::f64::consts::TAU * f64::from(j) / f64::from(around);
                text.push_str(&format!("v {} {y} {}\n", r * t.cos(), -r * t.sin()));
            }
        }
        for k in 0..rings {
            for j in 0..around {
                let (a, b) = (k * around + j + 1, k * around + (j + 1) % around + 1);
                text.push_str(&format!(
                    "f {a} {b} {}\nf {b} {} {}\n",
                    a + around,
                    b + around,
                    a + around
                ));
            }
        }
        if broken {
            text.push_str("f 1 2 99999\n");
        }
        text
    }

    #[test]
    fn a_folder_of_meshes_is_offered_and_faults_in_it_stop_nothing() {
        let dir = std::env::temp_dir().join(format!("tryon-garments-{}", std::process::id()));
        std::fs::create_dir_all(dir.join("more")).expect("folder");
        std::fs::write(dir.join("Tube Skirt.obj"), tube(false)).expect("written");
        std::fs::write(dir.join("more/torn.obj"), tube(true)).expect("written");
        std::fs::write(dir.join("tshirt.obj"), tube(false)).expect("written");
        std::fs::write(dir.join("notes.txt"), "no garment").expect("written");
        let mut config = ClothConfig {
            garments: dir.clone(),
            ..ClothConfig::default()
        };
        config
            .garment_materials
            .insert("tube_skirt".into(), "denim".into());
        let found = Library::read(&config);
        let torn = Library::default().add(
            "torn",
            &dir.join("more/torn.obj"),
            None,
            &Material::preset("cotton").expect("preset"),
        );
        std::fs::remove_dir_all(&dir).expect("removed");
        let library = found.expect("read");
        let names: Vec<&String> = library.meshes.keys().collect();
        assert_eq!(
            names,
            ["tube_skirt"],
            "the torn one and the one named like ours are left out"
        );
        let info = library
            .garments()
            .into_iter()
            .find(|g| g.name == "tube_skirt")
            .expect("listed");
        assert_eq!((info.title.as_str(), info.sizes.len()), ("Tube skirt", 0));
        let choice = GarmentChoice {
            garment: "tube_skirt".into(),
            ..Default::default()
        };
        library.check(std::slice::from_ref(&choice)).expect("known");
        let sized = GarmentChoice {
            size: "M".into(),
            ..choice
        };
        assert_eq!(
            library.check(&[sized]).expect_err("one size").field,
            "dress_request.garments[0].size"
        );
        let why = torn.expect_err("a face beyond the vertices");
        assert!(why.contains("torn.obj") && why.contains("99999"), "{why}");
        // Settings that cannot be used stop the service, by their key.
        config.garments_material = "chainmail".into();
        let e = Library::read(&config)
            .expect_err("no such material")
            .to_string();
        assert!(
            e.contains("cloth.garments_material") && e.contains("denim"),
            "{e}"
        );
        config.garments_material = "cotton".into();
        let e = Library::read(&config)
            .expect_err("the folder is gone")
            .to_string();
        assert!(e.contains("cloth.garments"), "{e}");
    }
}
