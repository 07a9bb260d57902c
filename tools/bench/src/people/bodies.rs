//! Bodies far outside the embedded body's shape space, built from MakeHuman's base mesh and morph targets.

use super::person::Person;
use crate::EvaluateError;
use std::path::Path;
use std::sync::Arc;
use tryon_body::Template;
use tryon_formats::morph_target::{MAKEHUMAN_UNIT, read_morph_target};
use tryon_formats::npz::{SmplArrays, read_smpl};
use tryon_formats::obj::read_obj;
use tryon_synth::{Belly, Covering, Physique};

/// Folder below the data with the base mesh and its targets.
pub(super) const FOLDER: &str = "body/makehuman_hm08_cc0";
/// Rigged body of the same topology, whose weights and joint regressor are taken.
const RIGGED: &str = "body/makehuman_smpl_layout/template.npz";
/// Base mesh below [`FOLDER`].
const BASE: &str = "makehuman_app/3dobjs/base.obj";

/// Recipe of a body: sex, shares of muscle and weight targets, measures, and changes.
struct Recipe {
    name: &'static str,
    sex: &'static str,
    /// Macro targets (muscle, weight) and their share; what is missing to 1 is the average one.
    build: &'static [(&'static str, f32)],
    /// Measure targets by name, with their weight.
    measures: &'static [(&'static str, f32)],
    physique: Physique,
}

const PLAIN: Physique = Physique::UNCHANGED;

const fn belly(depth: f32, height: f32, radius: [f32; 2]) -> Option<Belly> {
    Some(Belly {
        depth,
        height,
        radius,
    })
}

/// The average young woman.
const AVERAGE: Recipe = Recipe {
    name: "average",
    sex: "female",
    build: &[],
    measures: &[],
    physique: PLAIN,
};

/// The bodies. Every third one (index 2, 5, …) is kept apart, see [`super::PeoplePlan::unseen`].
#[rustfmt::skip]
const RECIPES: [Recipe; 12] = [
    Recipe { name: "old_man_belly", sex: "male", build: &[("minmuscle-averageweight", 0.6)], measures: &[("waist-circ-incr", 0.6), ("neck-circ-decr", 0.4)],
        physique: Physique { belly: belly(0.12, 0.60, [0.16, 0.17]), scale: 0.97, stoop: 0.30, ..PLAIN } },
    Recipe { name: "old_woman", sex: "female", build: &[("minmuscle-averageweight", 0.9)], measures: &[("hips-circ-incr", 0.5), ("waist-circ-incr", 0.6)],
        physique: Physique { scale: 0.93, stoop: 0.50, ..PLAIN } },
    Recipe { name: "very_tall", sex: "male", physique: Physique { legs: 1.08, scale: 1.12, ..PLAIN }, ..AVERAGE },
    Recipe { name: "very_short", sex: "female", physique: Physique { legs: 0.90, head: 1.08, scale: 0.89, ..PLAIN }, ..AVERAGE },
    Recipe { name: "heavy_woman", sex: "female", build: &[("averagemuscle-maxweight", 1.35)],
        measures: &[("hips-circ-incr", 0.6)], ..AVERAGE },
    Recipe { name: "heavy_man", sex: "male", build: &[("averagemuscle-maxweight", 1.9)],
        physique: Physique { belly: belly(0.12, 0.60, [0.20, 0.22]), ..PLAIN }, ..AVERAGE },
    Recipe { name: "pregnant", sex: "female", measures: &[("bust-circ-incr", 0.5)],
        physique: Physique { belly: belly(0.16, 0.60, [0.15, 0.15]), ..PLAIN }, ..AVERAGE },
    Recipe { name: "muscular", sex: "male", build: &[("maxmuscle-averageweight", 1.3)],
        measures: &[("shoulder-dist-incr", 0.7)], ..AVERAGE },
    Recipe { name: "child", sex: "female", build: &[("minmuscle-averageweight", 0.8)], measures: &[("hips-circ-decr", 0.8), ("bust-circ-decr", 1.0)],
        physique: Physique { legs: 0.90, head: 1.28, scale: 0.72, ..PLAIN } },
    Recipe { name: "very_thin", sex: "male", build: &[("minmuscle-minweight", 1.2)], ..AVERAGE },
    Recipe { name: "wide_coat", sex: "male", physique: Physique { covering: Some(Covering::WideCoat), ..PLAIN }, ..AVERAGE },
    Recipe { name: "long_hair", sex: "female", physique: Physique { covering: Some(Covering::LongHair), ..PLAIN }, ..AVERAGE },
];

/// Base body of which the recipes are changes.
struct MorphBase<'a> {
    folder: &'a Path,
    rigged: SmplArrays,
    vertices: Vec<[f32; 3]>,
}

impl<'a> MorphBase<'a> {
    fn read(data: &Path, folder: &'a Path) -> Result<Self, String> {
        let rigged = read_smpl(data.join(RIGGED)).map_err(|e| e.to_string())?;
        let mesh = read_obj(&folder.join(BASE))
            .map_err(|e| e.to_string())?
            .mesh;
        let body = mesh.vertices().iter().take(rigged.vertices.len());
        let vertices: Vec<[f32; 3]> = body
            .map(|p| [p.x, p.y, p.z].map(|c| c * MAKEHUMAN_UNIT))
            .collect();
        if vertices.len() < rigged.vertices.len() {
            return Err(format!("{BASE}: {} vertices", vertices.len()));
        }
        Ok(Self {
            folder,
            rigged,
            vertices,
        })
    }

    /// The rigged arrays with the vertices of a recipe.
    fn build(&self, recipe: &Recipe) -> Result<SmplArrays, String> {
        let mut vertices = self.vertices.clone();
        let mut add = |path: String, weight: f32| {
            let target = read_morph_target(&self.folder.join(path)).map_err(|e| e.to_string())?;
            target.add_to(&mut vertices, weight);
            Ok::<(), String>(())
        };
        let sex = recipe.sex;
        let average = ("averagemuscle-averageweight", 1.0);
        let taken: f32 = recipe.build.iter().map(|b| b.1).sum();
        add(format!("macrodetails/caucasian-{sex}-young.target.gz"), 1.0)?;
        for (build, share) in recipe.build.iter().chain([&(average.0, average.1 - taken)]) {
            add(
                format!("macrodetails/universal-{sex}-young-{build}.target.gz"),
                *share,
            )?;
        }
        for (measure, weight) in recipe.measures {
            add(
                format!("makehuman_app/targets/measure/measure-{measure}.target"),
                *weight,
            )?;
        }
        Ok(SmplArrays {
            vertices,
            ..self.rigged.clone()
        })
    }
}

/// All bodies; none without `data` or without the base mesh in it.
///
/// # Errors
/// Names the body whose files cannot be read.
pub(super) fn bodies(data: Option<&Path>) -> Result<Vec<Person>, EvaluateError> {
    let Some(data) = data.filter(|d| d.join(FOLDER).exists()) else {
        return Ok(vec![]);
    };
    let fault = |name: &str, why: String| EvaluateError::new(name, why);
    let folder = data.join(FOLDER);
    let base = MorphBase::read(data, &folder).map_err(|why| fault(FOLDER, why))?;
    let person = |recipe: &Recipe| {
        let build = || -> Result<Template, String> {
            let arrays = base.build(recipe)?;
            let template = recipe.physique.template(recipe.name, &arrays);
            template.map_err(|e| e.to_string())
        };
        let template = build().map_err(|why| fault(recipe.name, why))?;
        let shape = Default::default();
        Ok(Person::foreign(recipe.name, Arc::new(template), shape))
    };
    RECIPES.iter().map(person).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::measure::measure;
    use tryon_formats::shared_data;

    #[test]
    fn no_data_is_no_body() {
        assert!(bodies(None).expect("nothing to read").is_empty());
        let nowhere = bodies(Some(Path::new("/nowhere")));
        assert!(nowhere.expect("nothing to read").is_empty());
    }

    #[test]
    fn the_average_woman_is_that_of_the_rigged_set() {
        let (Some(folder), Some(data)) = (shared_data(FOLDER), shared_data("")) else {
            return;
        };
        let base = MorphBase::read(&data, &folder).expect("base");
        let arrays = base.build(&AVERAGE).expect("targets");
        let ours = PLAIN.template("average", &arrays).expect("a body");
        let theirs = crate::scenes::subject(&data, "subject_f_avg").expect("a body");
        let off = |a: &tryon_body::Joint| {
            let b = theirs.skeleton().index(&a.name).expect("the same skeleton");
            (a.rest - theirs.skeleton().joints()[b].rest).norm()
        };
        let mean =
            ours.skeleton().joints().iter().map(off).sum::<f64>() / ours.skeleton().len() as f64;
        assert!(mean < 0.05, "{mean} m");
    }

    #[test]
    fn bodies_have_the_measures_that_their_names_say() {
        let Some(data) = shared_data(FOLDER).and(shared_data("")) else {
            return;
        };
        let people = bodies(Some(&data)).expect("bodies");
        let of = |name: &str| {
            let actor = &people.iter().find(|p| p.name == name).expect(name).actor;
            let rest = actor.template.personalise(&actor.shape);
            measure(&actor.template, &rest).expect("a body")
        };
        assert!(of("very_tall").stature > 2.0, "{:?}", of("very_tall"));
        assert!(of("very_short").stature < 1.5, "{:?}", of("very_short"));
        assert!(of("child").stature < 1.3, "{:?}", of("child"));
        let waist = |name: &str| of(name).waist / of(name).stature;
        assert!(waist("heavy_man") > 0.65, "{:?}", of("heavy_man"));
        assert!(waist("pregnant") > waist("very_thin") + 0.12);
        for person in &people {
            assert!(
                person.actor.template.topology().is_closed(),
                "{}",
                person.name
            );
        }
    }
}
