//! Motion of garments: contact, elasticity of thin sheets, live steps against a moving body, fine steps without intersections.
//!
//! # Ideas
//!
//! The body as cloth meets it:
//!
//! - Once a pose: [`mod@contact::collision_body`].
//! - Noise of the tracked body: [`mod@contact::body_filter`].
//! - Pressing parts and bent joints moved apart: [`mod@contact::part_clearance`], [`mod@contact::joint_clearance`].
//! - Skin inside other skin: [`mod@contact::interior`].
//! - Closest points: [`mod@contact::closest_point`].
//! - Virtual depth maps (section 4): [`mod@contact::depth_maps`].
//!
//! Contact of the offline cloth:
//!
//! - Stencils with derivatives: [`mod@contact::distance`].
//! - Barrier and smoothed Coulomb friction of a pair, and their assembly: [`mod@contact::potential`] (decision 066).
//! - Candidates within a distance or along a step: [`mod@contact::broad_phase`].
//! - First time of impact: [`mod@contact::ccd`] (decision 065).
//! - Exact intersections: [`mod@contact::broad_phase::intersections`].
//!
//! Cloth:
//!
//! - The step: [`mod@live::step`], with [`mod@live::collide`], [`mod@live::solve`], [`mod@live::commit`].
//! - Membrane, bending, sheet: [`mod@live::model::membrane`], [`mod@live::model::bending`],
//!   [`mod@live::model::sheet`].
//! - Substeps (symplectic Euler): [`mod@live::solver::explicit::substeps`].
//! - Stable step: [`mod@live::solver::explicit::stability`].
//! - Mass filter: [`mod@live::solver::explicit::mass_filter`].
//! - Exchange between patches: [`mod@live::solver::explicit::halo`].
//! - Eight floats at once: [`mod@live::solver::explicit::simd`].
//! - Skin contact: [`mod@live::contact::body_contact`].
//! - Cloth on cloth: [`mod@live::contact::pair_contact`].
//! - Near pairs of features: [`mod@live::contact::near_candidates`], [`mod@live::contact::near_pairs`].
//! - Islands that sleep and wake: [`mod@live::sleep::islands`].
//! - Thresholds: [`mod@live::sleep::criteria`].
//! - Motion that wakes: [`mod@live::sleep::wake_source`].
//! - Tangles: [`mod@live::repair::untangle`].
//! - A body that teleports: [`mod@live::repair::teleport`].
//! - The outfit as it was put on: [`mod@live::repair::reference`].
//!
//! Elasticity of the offline solver:
//!
//! - Energy, gradient, Hessian of a whole sheet: [`mod@elastic::model`], summed by [`mod@elastic::assembly`].
//! - Membrane (Volino et al. 2009): [`mod@elastic::membrane`], laws: [`mod@elastic::stretch_law`],
//!   [`mod@elastic::bend_law`].
//! - Tension curves and loading curves of KES: [`mod@elastic::tension_law`], [`mod@elastic::loading_bend`].
//! - Those of measured fabrics (Wang et al. 2011): [`mod@elastic::measured_stretch`], [`mod@elastic::measured_bend`].
//! - Dihedral angles: [`mod@elastic::dihedral`].
//! - A curvature tensor a vertex from the angles around it: [`mod@elastic::curvature_set`], its weights:
//!   [`mod@elastic::curvature_weights`].
//! - Rest shapes: [`mod@elastic::rest_sheet`].
//!
//! Offline cloth:
//!
//! - The step and its length: [`mod@fine::step`].
//! - Regions that sleep: [`mod@fine::sleep`], [`mod@fine::sleepers`].
//! - BDF2: [`mod@fine::integrator`].
//! - What it minimises: [`mod@fine::problem`], [`mod@fine::potential`], [`mod@fine::energy_term`].
//! - Newton with a line search limited by contact: [`mod@fine::newton`].
//! - Candidates, barrier, friction: [`mod@fine::contacts`].
//! - Skin that yields: [`mod@fine::obstacle`].
//! - Repair of a start: [`mod@fine::start`].
//! - Static drape: [`mod@fine::drape`].
//! - Drag of still air: [`mod@fine::air_drag`].
//! - Whole animations: [`mod@fine::animation`], [`mod@fine::checkpoint`].
//! - Garments as one cloth: [`mod@fine::garment_cloth`].
//!
//! Scenes, one sheet among moving solids:
//!
//! - Files: [`mod@scene::file`].
//! - Textile tests: [`mod@scene::fabric_test`] on [`mod@specimens`].
//! - By the live step: [`mod@scene::live_run`]; by the offline one: [`mod@scene::fine_run`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub mod contact;
pub mod elastic;
pub mod fine;
pub mod live;
pub mod scene;
pub mod settings;
mod specimens;

pub use live::{
    AnchorBinding, BendingResolution, ClothError, Config, Element, GarmentState, Hinge, Input,
    Model, Outfit, Sheet, StagesMs, State, StepReport, Workspace, WornReference, collision_model,
    model, solver, step,
};
