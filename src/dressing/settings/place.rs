//! Settings of the placement of panels around the canonical body.

use super::settings;

settings! {
    /// Settings of the placement.
    pub struct PlaceSettings {
        /// Tubes around the body.
        pub tube: TubeSettings = TubeSettings::default(),
        /// Additional clearance for each garment below, metres: with less, layers start in each other.
        pub layer: f32 = 0.025,
        /// Clearance of the shoulder seam over the skin, metres: less sinks in where the shoulder is hollow.
        pub seam_clearance: f32 = 0.008,
        /// Height of a shoulder seam over bodies without shoulders, metres.
        pub default_seam_height: f32 = 1.4,
        /// Length of arm at the armhole that is measured farther out, metres: the skin is open there.
        pub armhole: f32 = 0.07,
        /// Sleeves.
        pub sleeve: SleevePlaceSettings = SleevePlaceSettings::default(),
        /// Trunk.
        pub trunk: TrunkPlaceSettings = TrunkPlaceSettings::default(),
        /// Legs.
        pub leg: LegPlaceSettings = LegPlaceSettings::default(),
        /// Skirts and waistbands.
        pub skirt: SkirtPlaceSettings = SkirtPlaceSettings::default(),
        /// Hoods.
        pub hood: HoodPlaceSettings = HoodPlaceSettings::default(),
    }

    /// Settings of tubes around the body.
    pub struct TubeSettings {
        /// Clearance between body and cloth at the start, metres: less starts inside the skin, more falls farther.
        pub clearance: f32 = 0.015,
        /// Largest factor by which a wide garment widens the body's ellipse; a tent is draped from there.
        pub widest: f32 = 1.6,
    }

    /// Settings of the trunk's panels.
    pub struct TrunkPlaceSettings {
        /// Depth over which a shirt turns over the shoulder, metres: less makes a sharp crease there.
        pub shoulder_depth: f32 = 0.10,
        /// Distance below the armpit from which rows go around the legs too, metres: a long top over the hips.
        pub lower_body: f32 = 0.05,
        /// Least distance of an underarm point outside and below the shoulder tip, metres.
        pub underarm: [f64; 2] = [0.01, 0.05],
        /// Least half width of a row, metres.
        pub least_half: f32 = 0.05,
        /// Underarm point of a panel that has none, panel coordinates, metres (library T-shirt, M).
        pub default_underarm: [f64; 2] = [0.26, -0.22],
    }

    /// Settings of sleeves.
    pub struct SleevePlaceSettings {
        /// Distance between the stations at which an arm is measured, metres.
        pub station: f32 = 0.01,
        /// Radius of an arm beyond the measured stations, metres.
        pub default_radius: f32 = 0.05,
        /// Share of the half width from which a corner of the outline belongs to the bicep line.
        pub bicep: f32 = 0.97,
        /// Least half width of a row, metres.
        pub least_half: f32 = 0.02,
        /// Left shoulder joint of a skeleton without one, metres.
        pub default_shoulder: [f32; 3] = [0.17, 1.35, 0.0],
        /// Way from there to the elbow of a skeleton without one, metres.
        pub default_upper_arm: [f32; 3] = [0.25, -0.1, 0.0],
    }

    /// Settings of trouser panels.
    pub struct LegPlaceSettings {
        /// Least distance of a trouser leg from the sagittal plane, metres: closer, the legs start in each other.
        pub inseam_gap: f32 = 0.001,
        /// Highest section of one leg alone, metres below the crotch. Less cuts the other thigh too.
        pub top: f32 = 0.04,
        /// Height of the crotch line of a panel without one, panel coordinates, metres.
        pub default_hip_line: f64 = -0.2,
    }

    /// Settings of skirts and waistbands.
    pub struct SkirtPlaceSettings {
        /// Share of its length over which a skirt starts: it settles downwards.
        pub shortened: f32 = 0.97,
        /// Least height of a waistband above the hip, metres: lower it slides off.
        pub above_hip: f32 = 0.05,
        /// Right end of a waist without edges, panel coordinates, metres.
        pub default_end: [f64; 2] = [0.0, 0.02],
        /// Least sag of the waist line, metres: a straight one would have its apex at infinity.
        pub least_sag: f64 = 1e-4,
        /// Step and tolerance in which the height of a waistband is searched, metres of height and of girth.
        pub waist_step: f32 = 0.01,
        /// Least half width of a row, metres.
        pub least_half: f32 = 0.02,
    }

    /// Settings of hoods, laid back.
    pub struct HoodPlaceSettings {
        /// Angle by which a hood lies back, radians; with less its back turns inside out.
        pub recline: f32 = 2.5,
        /// Height of cloth over which it folds back, metres.
        pub fold: f32 = 0.25,
        /// Height of the fold's axis above the nape, metres; below the nape the back would turn inside out.
        pub axis: f32 = 0.03,
        /// Width of cloth over which a hood turns from the crown to the side of the head, metres.
        pub crown_turn: f32 = 0.11,
        /// Height above the shoulder line from which skin is head, metres.
        pub head: f32 = 0.10,
        /// Height of the nape above the shoulder line, metres.
        pub nape: f32 = 0.01,
    }
}

impl PlaceSettings {
    /// Settings of a garment that goes over `inner` others.
    pub(crate) fn over(mut self, inner: usize) -> Self {
        let more = self.layer * inner as f32;
        self.tube.clearance += more;
        self.seam_clearance += more;
        self
    }
}
