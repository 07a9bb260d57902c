//! Cuts of the library's garments: ease, lengths, darts. Lengths in metres.

use tryon_geometry::settings;

settings! {
    /// Cuts of all garments of the library.
    pub struct LibraryCuts {
        /// T-shirt.
        pub tshirt: TopCut = TopCut::default(),
        /// Long-sleeved shirt.
        pub longsleeve: TopCut = TopCut {
            sleeve: Some(SleeveCut { length: None, cuff: 0.50, ..SleeveCut::default() }),
            ..TopCut::default()
        },
        /// Tank top.
        pub tank: TopCut = TopCut {
            ease: [0.05, 0.04],
            neck: 0.035,
            drop: [0.125, 0.065],
            strap: 0.052,
            longer: 0.03,
            sleeve: None,
            ..TopCut::default()
        },
        /// Hooded top.
        pub hoodie: TopCut = TopCut {
            ease: [0.16, 0.09],
            neck: 0.020,
            drop: [0.085, 0.020],
            scye: 0.125,
            longer: 0.04,
            sleeve: Some(SleeveCut { ease: 0.12, length: None, cuff: 0.50, ..SleeveCut::default() }),
            hood: Some(HoodCut::default()),
            ..TopCut::default()
        },
        /// Sleeveless dress.
        pub dress: DressCut = DressCut::default(),
        /// Flared skirt.
        pub skirt: SkirtCut = SkirtCut::default(),
        /// Straight skirt.
        pub straight_skirt: StraightSkirtCut = StraightSkirtCut::default(),
        /// Straight trousers.
        pub trousers: TrousersCut = TrousersCut::default(),
        /// Shorts.
        pub shorts: TrousersCut =
            TrousersCut { inseam: Some(0.20), taper: 0.96, ..TrousersCut::default() },
    }

    /// Cut of a top, by default of a T-shirt.
    pub struct TopCut {
        /// Ease at chest and hip; a regular-fit T-shirt has 8 to 12 cm at the chest.
        pub ease: [f64; 2] = [0.10, 0.08],
        /// Half width of the neck opening beyond a fifth of the neck girth (drafting rule of Aldrich 2015).
        pub neck: f64 = 0.012,
        /// Drop of the front and back neckline below the high point of the shoulder.
        pub drop: [f64; 2] = [0.085, 0.022],
        /// Width of the shoulder seam; zero for a seam to the shoulder tip.
        pub strap: f64 = 0.0,
        /// Fall of the shoulder seam from neck to tip.
        pub shoulder_fall: f64 = 0.045,
        /// Scye depth beyond an eighth of the chest.
        pub scye: f64 = 0.105,
        /// Length below the hip line.
        pub longer: f64 = 0.045,
        /// Sleeves.
        pub sleeve: Option<SleeveCut> = Some(SleeveCut::default()),
        /// Hood.
        pub hood: Option<HoodCut> = None,
    }

    /// Cut of a sleeve, by default a short one.
    pub struct SleeveCut {
        /// Ease over the upper arm.
        pub ease: f64 = 0.085,
        /// Length from the shoulder tip; `None` for a sleeve to the wrist.
        pub length: Option<f64> = Some(0.215),
        /// Width at the cuff over width at the underarm; long sleeves wider than half slide to the elbow.
        pub cuff: f64 = 0.93,
        /// Length of a sleeve cap over that of the armhole.
        pub cap_ease: f64 = 1.02,
    }

    /// Cut of a hood.
    pub struct HoodCut {
        /// Height from the neckline to its top: head height and clearance.
        pub height: f64 = 0.355,
        /// Depth at its widest.
        pub depth: f64 = 0.245,
    }

    /// Cut of a sleeveless dress: bodice and flared skirt.
    pub struct DressCut {
        /// Ease at the chest.
        pub chest_ease: f64 = 0.06,
        /// Half width of the neck opening beyond a fifth of the neck girth.
        pub neck: f64 = 0.028,
        /// Distance of the armhole from the shoulder tip.
        pub inset: f64 = 0.022,
        /// Fall of the shoulder seam from neck to tip.
        pub shoulder_fall: f64 = 0.045,
        /// Scye depth beyond an eighth of the chest.
        pub scye: f64 = 0.098,
        /// Drop of the front and back neckline.
        pub drop: [f64; 2] = [0.105, 0.045],
        /// Length of the bodice below the waist.
        pub longer: f64 = 0.01,
        /// Width of each of the four darts.
        pub dart: f64 = 0.026,
        /// Depth of the darts, front and back.
        pub dart_depth: [f64; 2] = [0.12, 0.14],
        /// Position of the darts between the centre and the side, share of the half waist.
        pub dart_at: f64 = 0.52,
        /// Skirt.
        pub skirt: SkirtCut =
            SkirtCut { waist_ease: 0.04, hip_ease: 0.10, length: 0.58, ..SkirtCut::default() },
    }

    /// Cut of a flared skirt to the knee.
    pub struct SkirtCut {
        /// Ease at the waist.
        pub waist_ease: f64 = 0.015,
        /// Least ease at the hip.
        pub hip_ease: f64 = 0.07,
        /// Waist to hip line.
        pub hip_depth: f64 = 0.20,
        /// Waist to hem.
        pub length: f64 = 0.56,
        /// Least half angle of each panel, radians: both panels together make a third of a circle.
        pub flare: f64 = 0.30,
    }

    /// Cut of a straight skirt to the knee.
    pub struct StraightSkirtCut {
        /// Ease at the waist.
        pub waist_ease: f64 = 0.015,
        /// Ease at the hip.
        pub hip_ease: f64 = 0.045,
        /// Waist to hip line.
        pub hip_depth: f64 = 0.20,
        /// Waist to hem.
        pub length: f64 = 0.56,
        /// Least difference of half hip and half waist.
        pub least_shaping: f64 = 0.012,
        /// Half hip less half hem.
        pub hem_taper: f64 = 0.012,
        /// Rise of the waist from the centre to the side.
        pub waist_rise: f64 = 0.012,
        /// Position of the darts between the centre and the side, share of the half waist.
        pub dart_at: f64 = 0.52,
        /// Depth of the darts, front and back.
        pub dart_depth: [f64; 2] = [0.095, 0.13],
    }

    /// Cut of trousers, by default long ones.
    pub struct TrousersCut {
        /// Ease at the waist.
        pub waist_ease: f64 = 0.02,
        /// Ease at the hip.
        pub hip_ease: f64 = 0.055,
        /// Height of the body's crotch above that of the garment.
        pub rise_ease: f64 = 0.015,
        /// Extension of the crotch beyond the centre line, share of the hip: front and back.
        pub crotch: [f64; 2] = [0.045, 0.085],
        /// Inseam; `None` for that of the body.
        pub inseam: Option<f64> = None,
        /// Width at the hem over that at the crotch.
        pub taper: f64 = 0.64,
    }
}
