//! Settings of the stages of a picture.

use tryon_geometry::settings;

settings! {
    /// Settings of the brightness of the room.
    pub struct ExposureSettings {
        /// A bright but not blown-out surface (skin, a light wall) in a well exposed room, linear light.
        pub well_exposed: f32 = 0.26,
        /// Share of the measured pixels that are darker than the one compared with `well_exposed`.
        pub bright_percentile: f32 = 0.85,
        /// Least and greatest light on garments: black clothes on a black ground carry little information about the room.
        pub range: [f32; 2] = [0.45, 1.25],
    }

    /// Settings of the light of the room.
    pub struct RoomLightSettings {
        /// Time between two measurements, seconds: lamps don't move.
        pub interval: f64 = 0.25,
        /// Time in which a new light takes the place of an old one, seconds. Smaller flickers with the pose.
        pub memory: f32 = 1.5,
        /// Patches of the body looked at, at most. More cost time.
        pub most_patches: usize = 3000,
        /// Patches of which a light is told, at least. Fewer fit folds.
        pub least_patches: usize = 150,
        /// Cosine of the viewing angle below which a patch is an outline.
        pub least_facing: f32 = 0.25,
        /// Distance of the reading from the tracked skin beyond which something else is seen, metres.
        pub most_apart: f32 = 0.06,
        /// Brightest channel of a usable colour: below it is noise, above it is blown out.
        pub exposed: [u8; 2] = [12, 250],
        /// Difference of brightness over the mean that counts half: folds, prints, shine.
        pub spread: f32 = 0.25,
        /// Weight of the usual light, from above and before, against what is seen: the side that no camera sees says nothing.
        pub ridge: f32 = 0.02,
        /// The usual light.
        pub prior: [f32; 3] = [-0.1, -0.5, -0.35],
        /// Largest change with the normal over the mean: a lamp close by in a dark room.
        pub most_slope: f32 = 0.9,
        /// Share of the difference between colours that is believed.
        pub tint: f32 = 0.5,
        /// Least light of a side, over the mean.
        pub least_light: f32 = 0.05,
    }

    /// Settings of the part of the captured picture that a cropped one shows.
    pub struct FocusSettings {
        /// Distance from the focus within which a person moves no picture, share of its side.
        pub rest: f64 = 0.05,
        /// Distance at which a moving picture has arrived, share of its side.
        pub arrived: f64 = 0.005,
        /// Time constant of the movement, seconds: less swings, more loses who walks.
        pub glide: f64 = 0.4,
        /// Place of the middle of the body and of the top of the head in the picture, shares of its sides.
        pub place: [f64; 2] = [0.5, 0.12],
    }

    /// Settings of the scene without the person.
    pub struct PlateSettings {
        /// Distance around the person in which nothing is learned of what is not behind it, metres: own clothes, hair, bags.
        pub margin: f32 = 0.25,
        /// Distance behind the farthest of the person beyond which something is the scene, metres.
        pub behind: f32 = 0.3,
    }

    /// Settings of own clothes that disappear.
    pub struct OwnClothesSettings {
        /// Own clothes are taken away; otherwise they stay as captured.
        pub are_removed: bool = true,
        /// Share of a half of the person that garments cover when they take the place of the own clothes there.
        pub covered: f32 = 0.6,
        /// Distance of a reading from the tracked skin within which it tells the colour of own clothes, metres.
        pub on_body: f32 = 0.06,
        /// Distance in depth within which a pixel beside the body is the person, metres.
        pub off_body: f32 = 0.25,
        /// Reach of own clothes off the tracked body across the picture, metres: loose sleeves.
        pub reach: f32 = 0.1,
        /// Reach of own clothes off the tracked body within which they become skin where the scene was never seen, metres.
        pub close: f32 = 0.025,
        /// Distance from the outline of the body to a garment up to which the limb between them is dressed, metres.
        pub sliver: f32 = 0.03,
        /// Radius about the head in which hair may fall over clothes, metres.
        pub head: f32 = 0.2,
        /// Share of the clothes' colours below which hair falls over them; above it clothes have its colour.
        pub hair_over: f32 = 0.4,
        /// Share of the hair that looks like clothes above which nothing near the head is changed.
        pub like_hair: f32 = 0.2,
        /// Tones of clothes looked at, at most.
        pub most_tones: usize = 400,
        /// Brightness (sRGB) of the clothes' 90th percentile over that of the 10th up to which they are plain: their shades are
        /// the light's and stay on skin that takes their place.
        pub plain: f32 = 1.7,
        /// Share of the clothes that looks like skin above which nothing can be told apart.
        pub mixed: f32 = 0.3,
        /// Skin against clothes by colour. Light on arms and legs is not that on the face: chroma tells more than brightness.
        pub colors: SkinSettings = SkinSettings {
            min_sigma: [20.0, 3.0, 3.0],
            unknown_clothes: -12.0,
            ..SkinSettings::default()
        },
    }

    /// Settings of the mean light of the room.
    pub struct RoomLevelSettings {
        /// Columns of the picture looked at.
        pub columns: u32 = 80,
        /// Fewest pixels beside the person of which a light is told.
        pub least: usize = 250,
        /// Distance around the person that is left out: own clothes, what is held (metres).
        pub margin: f32 = 0.15,
        /// Distance of a reading from the tracked face within which it is seen, metres.
        pub on_face: f32 = 0.05,
        /// Percentiles of brightness between which pixels are paint: their mean colour is the light's.
        pub brighter: f32 = 0.4,
        /// See `brighter`; the upper one is as bright as `paint`.
        pub paint_percentile: f32 = 0.85,
        /// Reflectance of a light wall: white paint 0.8, grey and wood 0.4.
        pub paint: f32 = 0.6,
        /// Least and greatest reflectance of skin (0.05 in the darkest, 0.45 in the fairest).
        pub skin: [f32; 2] = [0.05, 0.45],
        /// Share of the paint's colour that is believed to be the light's: cameras balance the greater part away.
        pub tint: f32 = 0.5,
        /// Least and greatest channel over the mean.
        pub tints: [f32; 2] = [0.8, 1.25],
        /// Least and greatest light: cameras expose.
        pub range: [f32; 2] = [0.2, 1.1],
    }

    /// Settings of the camera's grain.
    pub struct GrainSettings {
        /// Columns and rows between two looked at.
        pub step: usize = 5,
        /// Fewest pixels of which a grain is told.
        pub least: usize = 200,
        /// Share of the pixels that are smooth, those of the least slopes. More take fabrics and hair for noise.
        pub smooth: f32 = 0.4,
        /// Brightness of a usable pixel: below and above it noise is cut off.
        pub exposed: [u8; 2] = [16, 240],
        /// Greatest grain given to garments, grey levels: two pictures of 2 differ by more than 8 in one pixel of 200.
        pub most: f32 = 2.0,
    }

    /// Settings of the camera's blur.
    pub struct BlurSettings {
        /// Rows and columns between two looked at.
        pub step: usize = 4,
        /// Fewest edges of which a blur is told.
        pub least: usize = 100,
        /// Least slope of an edge, grey levels a pixel: less is shading and noise.
        pub steep: f32 = 12.0,
        /// Slope along an edge over that across it above which it is slanted and looks wider.
        pub slanted: f32 = 0.4,
        /// Greatest blur given to garments, pixels: more is motion.
        pub most: f32 = 1.2,
    }

    /// Settings of the matte of the captured scene over the garments.
    pub struct MatteSettings {
        /// Distance from a patch's edge at which depths are compared, depth pixels: flying pixels lie in between.
        pub edge_step: f64 = 3.0,
        /// Colour difference (sum over channels) at which a neighbour's weight is e⁻¹.
        pub color_scale: f32 = 48.0,
        /// Radius of the soft edge in depth pixels: the misalignment of depth and colour edges that it must bridge.
        pub edge_radius: f64 = 3.0,
        /// Depth between two sheets of cloth, metres: neighbours on another sheet have no vote. Less splits steep folds.
        pub sheets_apart: f32 = 0.05,
        /// Vote share that maps to 0; one minus it maps to 1. Sharpens: half-way votes are edges, not transparent arms.
        pub certain_share: f32 = 0.25,
    }

    /// Settings of bare hands and forearms, found by colour.
    pub struct BareArmSettings {
        /// Distance from the axis below which skin colour seeds a region, metres.
        pub seed_distance: f32 = 0.045,
        /// Share of the forearm next to the elbow that is left to depth: a sleeve may end there.
        pub elbow: f32 = 0.15,
        /// Largest depth difference of neighbours on one surface, metres a pixel of depth, on top of the noise.
        pub step: f32 = 0.015,
        /// Distance of cloth in front of a hand above which it really is in front (a wide skirt), metres. A shirt that falls
        /// straight over the waist hangs up to 10 cm in front of a hand on the hip.
        pub loose: f32 = 0.12,
        /// Distance behind the tracked trunk above which skin is no hand on it, metres.
        pub behind: f32 = 0.03,
        /// Share of a region at the end of the reach above which its colour has leaked into clothes.
        pub leak: f32 = 0.2,
        /// Share of the reach beyond which a cell lies at its end.
        pub end: f32 = 0.88,
        /// Smallest region, square metres.
        pub smallest: f32 = 4e-4,
        /// Largest distance of a forearm's skin from its tracked axis, metres: half its width, and the tracking error.
        pub forearm_reach: f32 = 0.07,
        /// Largest distance of a hand's skin from the tracked wrist, metres: a hand's length. The tracked direction of a hand is
        /// unreliable: half of a real hand on a hip was 8 cm and more off the tracked axis, the wrist 2 cm.
        pub hand_reach: f32 = 0.21,
        /// Side of a cell, metres.
        pub cell: f32 = 0.004,
        /// Largest depth difference of a captured point on a tracked limb, metres: tracked limbs are right to 3 cm.
        pub limb_tolerance: f32 = 0.03,
        /// The same on the trunk, whose clothes hang loosely.
        pub trunk_tolerance: f32 = 0.06,
        /// Distance from an arm's axis within which nothing counts as trunk, metres.
        pub arm_clearance: f32 = 0.09,
        /// Distance of the four test points from a sampled point, depth pixels: rejects outlines.
        pub sample_radius: f64 = 2.0,
        /// Largest distance of a sleeve from the axis, metres.
        pub sleeve_radius: f32 = 0.10,
        /// Skin by colour.
        pub skin: SkinSettings = SkinSettings::default(),
    }

    /// Settings of skin against clothes by colour.
    pub struct SkinSettings {
        /// Least standard deviation of brightness and chroma, grey levels: sensor noise and shading of folds.
        pub min_sigma: [f32; 3] = [8.0, 2.5, 2.5],
        /// Logarithm of the density of clothes of an unknown colour, everywhere; larger rejects more skin.
        pub unknown_clothes: f32 = -18.0,
        /// Weight of brightness against chroma in clustering: one cloth in light and shade is one or two components.
        pub brightness: f32 = 0.3,
        /// Least share of the face or the hands that is like the forearms, which makes them skin: to begin, to go on.
        pub agree: [f32; 2] = [0.5, 0.4],
        /// Largest share of the trunk that is like skin (a neckline, an unexpected hand): to begin, to go on.
        pub mixed: [f32; 2] = [0.08, 0.14],
    }

    /// Settings of the garments off the recorded person.
    pub struct OffPersonSettings {
        /// Distance from the person above which a garment pixel is off it, metres: the cloth of tops hangs closer.
        pub radius: f32 = 0.04,
        /// Difference from the garments' depth within which a reading is the person, metres: arms reach that far.
        pub person_depth: f32 = 0.7,
        /// Smallest garment that is measured, square metres: less is the end of a sleeve at the picture's edge.
        pub smallest: f32 = 0.02,
        /// Cells along the radius, at least, where pixels are that small. An edge is right to half a cell, and without bias.
        pub cells: f32 = 12.0,
    }

    /// Settings of the parts of a template.
    pub struct LimbSettings {
        /// Half the length of the rings at elbow, wrist and tips, as a share of the forearm.
        pub ring: f64 = 0.08,
        /// Height range of the face, as shares of the head's extent upwards from the chin.
        pub face: [f32; 2] = [0.2, 0.6],
        /// Front part of the head that is the face, as a share of its depth.
        pub face_front: f32 = 0.75,
    }
}
