//! Garments on offer: those of the library and of the configured folder, as the wire lists them.

use crate::folder::{GarmentFolder, name_of};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use tryon::body::embedded;
use tryon::clothcap::segment::Slot;
use tryon::dressing::{GarmentFile, MeshGarment, MeshGarmentSettings, SourceBody};
use tryon::garment::{GarmentKind, Material, Size, Triangulation, library};
use tryon::mirror::{CapturedWardrobe, Choice};
use tryon_kit::config::ClothConfig;
use tryon_kit::server::StartError;
use tryon_proto::convert::WireError;
use tryon_proto::keys::is_name;
use tryon_proto::v1::{GarmentChoice, GarmentInfo};

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

/// Colour on the wire, 0x00RRGGBB.
pub(crate) fn rgb([r, g, b]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, r, g, b])
}

/// Category of a captured garment.
fn category(slot: Slot) -> &'static str {
    match slot {
        Slot::Under => "under",
        Slot::Shoes => "shoes",
        Slot::Bottom => "bottom",
        Slot::Skin | Slot::Hair | Slot::Top | Slot::OnePiece => "top",
    }
}

/// The size of that name, in any case.
fn size(name: &str) -> Option<Size> {
    Size::ALL
        .into_iter()
        .find(|s| s.to_string().eq_ignore_ascii_case(name))
}

/// Materials of the garments of the folder.
struct Materials<'a> {
    all: Material,
    single: BTreeMap<&'a str, Material>,
}

impl<'a> Materials<'a> {
    fn new(config: &'a ClothConfig) -> Result<Self, StartError> {
        let material =
            |key: &str, name: &str| Material::preset(name).map_err(|e| fault(key, e.to_string()));
        let mut single = BTreeMap::new();
        for (garment, name) in &config.garment_materials {
            let key = format!("garment_materials.{garment}");
            single.insert(garment.as_str(), material(&key, name)?);
        }
        Ok(Self {
            all: material("garments_material", &config.garments_material)?,
            single,
        })
    }
    fn of(&self, garment: &str) -> &Material {
        self.single.get(garment).unwrap_or(&self.all)
    }
}

/// Fault of a key of the configuration.
fn fault(key: &str, why: String) -> StartError {
    StartError::Config {
        key: format!("cloth.{key}"),
        why,
    }
}

/// Garment of the folder.
#[derive(Debug)]
struct OfferedMesh {
    garment: Arc<MeshGarment>,
    category: &'static str,
}

/// Everything that can be worn.
#[derive(Debug, Default)]
pub(crate) struct Library {
    meshes: BTreeMap<String, OfferedMesh>,
}

impl Library {
    /// Reads the garments of the configured folder; what is at fault in it is logged and left out.
    ///
    /// # Errors
    /// A folder, body or material that cannot be used, by its key.
    pub(crate) fn read(config: &ClothConfig) -> Result<Self, StartError> {
        let materials = Materials::new(config)?;
        let mut found = Self::default();
        if config.garments.as_os_str().is_empty() {
            return Ok(found);
        }
        let unreadable =
            |e: std::io::Error| fault("garments", format!("{}: {e}", config.garments.display()));
        let folder = GarmentFolder::list(&config.garments).map_err(unreadable)?;
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
        for file in &folder.files {
            let name = name_of(file);
            let added = found.add_file(&name, file, body.clone(), materials.of(&name));
            report(file, added.map(|notes| vec![(name, notes)]));
        }
        for capture in &folder.captures {
            report(capture, found.add_capture(capture, &materials));
        }
        if let Some(garment) = materials
            .single
            .keys()
            .find(|g| !found.meshes.contains_key(**g))
        {
            tracing::warn!(
                garment,
                "cloth.garment_materials names a garment that the folder does not offer"
            );
        }
        Ok(found)
    }

    /// Adds the garment of a file; its notes.
    fn add_file(
        &mut self,
        name: &str,
        file: &Path,
        body: Option<SourceBody>,
        material: &Material,
    ) -> Result<String, String> {
        self.check_name(name)?;
        let settings = MeshGarmentSettings::with_edge(Triangulation::default().edge_length);
        let file = GarmentFile::new(file, body);
        let garment = MeshGarment::read_on(file, material, &settings)
            .map_err(|e| e.to_string())?
            .named(name);
        let category = if garment.layer() > 0 { "top" } else { "bottom" };
        Ok(self.offer(garment, category))
    }

    /// Adds the garments of a capture as `CAPTURE_SLOT`; their names and notes. All or none.
    fn add_capture(
        &mut self,
        folder: &Path,
        materials: &Materials<'_>,
    ) -> Result<Vec<(String, String)>, String> {
        let captured = CapturedWardrobe::read(folder, &embedded::template());
        let captured = captured.map_err(|e| e.to_string())?;
        let edge = Triangulation::default().edge_length;
        let mut made = Vec::new();
        for (k, own) in captured.names().iter().enumerate() {
            let name = format!("{}_{own}", name_of(folder));
            self.check_name(&name)?;
            let garment = captured.garment(k, &name, materials.of(&name), edge);
            let garment = garment.map_err(|e| format!("{}: {own}: {e}", folder.display()))?;
            made.push((garment, category(captured.slot(k))));
        }
        let offered = made.into_iter().map(|(garment, category)| {
            let name = garment.name.clone();
            (name, self.offer(garment, category))
        });
        Ok(offered.collect())
    }

    fn check_name(&self, name: &str) -> Result<(), String> {
        if !is_name(name) {
            return Err(format!(
                "the name {name} has none of [a-z0-9_-], or more than 64 characters"
            ));
        }
        if library::names().contains(&name) || self.meshes.contains_key(name) {
            return Err(format!("there is another garment named {name}"));
        }
        Ok(())
    }

    /// Offers a garment; its notes.
    fn offer(&mut self, garment: MeshGarment, category: &'static str) -> String {
        let notes = garment.notes.join("; ");
        let name = garment.name.clone();
        let garment = Arc::new(garment);
        self.meshes.insert(name, OfferedMesh { garment, category });
        notes
    }

    /// A checked wire choice in the terms of the chain. Without a size the body decides.
    pub(crate) fn choice(&self, c: &GarmentChoice) -> Choice {
        match self.meshes.get(&c.garment) {
            Some(mesh) => Choice::Mesh {
                garment: Arc::clone(&mesh.garment),
                size: size(&c.size),
            },
            None => Choice::Library {
                name: c.garment.clone(),
                size: size(&c.size),
            },
        }
    }

    /// Every garment, sorted by name.
    pub(crate) fn garments(&self) -> Vec<GarmentInfo> {
        let every = || Size::ALL.iter().map(Size::to_string).collect();
        let cut = library::names().iter().map(|name| {
            let kind = library::pattern(name, Size::M).map(|p| p.kind);
            let over = matches!(kind, Ok(GarmentKind::Top | GarmentKind::Dress));
            GarmentInfo {
                name: (*name).into(),
                title: title(name),
                category: if over { "top" } else { "bottom" }.into(),
                sizes: every(),
                color_rgb: rgb(library::dye(name)),
            }
        });
        // Meshes on a body that is only guessed are made to measure: they come in one size.
        let made = self.meshes.iter().map(|(name, mesh)| GarmentInfo {
            name: name.clone(),
            title: title(name),
            category: mesh.category.into(),
            sizes: mesh.garment.own_size().map_or_else(Vec::new, |_| every()),
            color_rgb: rgb(mesh.garment.color.unwrap_or_else(|| library::dye(name))),
        });
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
            let mesh = self.meshes.get(&c.garment);
            if mesh.is_none() && !library::names().contains(&c.garment.as_str()) {
                let all: Vec<String> = self.garments().into_iter().map(|g| g.name).collect();
                return fault(
                    "garment",
                    format!("`{}` is not known; there are {}", c.garment, all.join(", ")),
                );
            }
            let is_single = mesh.is_some_and(|m| m.garment.own_size().is_none());
            if is_single && !c.size.is_empty() {
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

/// Logs the garments of a file or capture, or why it has none.
fn report(from: &Path, added: Result<Vec<(String, String)>, String>) {
    match added {
        Ok(offered) => {
            for (garment, notes) in offered {
                tracing::info!(garment, file = %from.display(), notes, "offered");
            }
        }
        Err(why) => tracing::error!(file = %from.display(), why, "a garment is left out"),
    }
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
                print: None,
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
            print: None,
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
        std::fs::create_dir_all(dir.join("scan")).expect("folder");
        std::fs::write(dir.join("scan/capture.json"), "{\"version\": 1}").expect("written");
        let mut config = ClothConfig {
            garments: dir.clone(),
            ..ClothConfig::default()
        };
        config
            .garment_materials
            .insert("tube_skirt".into(), "denim".into());
        let found = Library::read(&config);
        let torn = Library::default().add_file(
            "torn",
            &dir.join("more/torn.obj"),
            None,
            &Material::preset("cotton").expect("preset"),
        );
        let cotton = Materials::new(&config).expect("materials");
        let damaged = Library::default().add_capture(&dir.join("scan"), &cotton);
        std::fs::remove_dir_all(&dir).expect("removed");
        let damaged = damaged.expect_err("no template");
        assert!(
            damaged.contains("capture.json") && damaged.contains("template"),
            "{damaged}"
        );
        let library = found.expect("read");
        let names: Vec<&String> = library.meshes.keys().collect();
        assert_eq!(
            names,
            ["tube_skirt"],
            "the torn one, the damaged capture and the one named like ours are left out"
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
