//! Settings of dressing: one struct a stage, each field with its documentation and default side by side.

mod drape;
mod fit;
mod mesh_garment;
mod place;
mod sections;

pub use drape::OutfitDrapeSettings;
pub use fit::{FitMapSettings, WornSizeSettings};
pub use mesh_garment::{
    AnchorSettings, AvatarSettings, ClassifierSettings, GarmentSurfaceSettings, GuessSettings,
    LiftSettings, LiningSettings, MeshGarmentSettings, PieceSettings, RetargetSettings,
};
pub use place::{
    HoodPlaceSettings, LegPlaceSettings, PlaceSettings, SkirtPlaceSettings, SleevePlaceSettings,
    TrunkPlaceSettings, TubeSettings,
};
pub use sections::{CanonicalSettings, SectionSettings};

use tryon_geometry::settings;

settings! {
    /// Settings of the stages of dressing.
    pub struct StageSettings {
        /// Canonical pose and cross-sections of the body.
        pub sections: SectionSettings = SectionSettings::default(),
        /// Placement of panels.
        pub place: PlaceSettings = PlaceSettings::default(),
        /// Drape.
        pub drape: OutfitDrapeSettings = OutfitDrapeSettings::default(),
        /// Sizes that patterns are worn in.
        pub size: WornSizeSettings = WornSizeSettings::default(),
    }
}
