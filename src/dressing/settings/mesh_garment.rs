//! Settings of mesh garments: classification, anchors, rest shape, sizes, retargeting, guessed bodies.

use super::{SectionSettings, WornSizeSettings, settings};
use tryon_garment::import::CoarsenSettings;

settings! {
    /// Settings of mesh garments.
    pub struct MeshGarmentSettings {
        /// Edge length of meshes without flat panels, metres; flat panels get it where theirs is shorter.
        pub edge: f64 = 0.021,
        /// Classification of pieces.
        pub classifier: ClassifierSettings = ClassifierSettings::default(),
        /// Linings.
        pub lining: LiningSettings = LiningSettings::default(),
        /// Anchors.
        pub anchors: AnchorSettings = AnchorSettings::default(),
        /// Triangles and rest shape.
        pub piece: PieceSettings = PieceSettings::default(),
        /// Coarsening of flat panels.
        pub coarsen: CoarsenSettings = CoarsenSettings::default(),
        /// Clearance over the skin.
        pub lift: LiftSettings = LiftSettings::default(),
        /// Texture coordinates and joint weights.
        pub surface: GarmentSurfaceSettings = GarmentSurfaceSettings::default(),
        /// Retargeting.
        pub retarget: RetargetSettings = RetargetSettings::default(),
        /// Person in a garment's file.
        pub avatar: AvatarSettings = AvatarSettings::default(),
        /// Body under a garment whose file has none.
        pub guess: GuessSettings = GuessSettings::default(),
        /// Cross-sections of the source body.
        pub sections: SectionSettings = SectionSettings::default(),
        /// Size advice.
        pub size: WornSizeSettings = WornSizeSettings::default(),
        /// Share of a body's girth below which cloth does not go around it. Smaller takes scarves for tops.
        pub around: f64 = 0.8,
        /// Heights between which the chest is fullest, shares of the way from waist to shoulders.
        pub chest: [f32; 2] = [0.35, 0.85],
    }

    /// Settings of the classification of pieces.
    pub struct ClassifierSettings {
        /// Extent below which a piece is a button or a buckle, metres.
        pub smallest: f32 = 0.08,
        /// Extent below which it is one if its name says so, metres.
        pub smallest_named: f32 = 0.25,
        /// Share of vertices over head, hands or feet from which a piece is an accessory.
        pub accessory: f64 = 0.85,
        /// Diameter below which an opening is a slit, metres.
        pub opening: f32 = 0.06,
        /// Tenths of an opening that lie over one leg where the opening is a trouser hem.
        pub hem_tenths: usize = 9,
        /// Distance below the shoulders' height from which they hold cloth, metres.
        pub near_shoulder: f32 = 0.02,
        /// Share of vertices over legs from which a garment is a dress (from the shoulders) or a skirt (from an opening).
        pub over_legs: [f64; 2] = [0.25, 0.15],
        /// Mean share of the way around the body from which cloth is worn. Garments have 0.80 to 0.97, shirt fronts 0.34 to 0.39, a
        /// few flat triangles up to 0.32; an open vest leaves a third.
        pub wrap: f64 = 0.6,
        /// Height of the shoulders of a skeleton without joints there, metres.
        pub default_shoulder: f32 = 1.4,
        /// Distance within which skin is searched, metres.
        pub search: f32 = 10.0,
    }

    /// Settings of linings.
    pub struct LiningSettings {
        /// Depth below the outer sheet between which cloth lines it, metres: cloth is 1 to 3 mm thick, padding 10 mm.
        pub depth: [f32; 2] = [-0.002, 0.012],
        /// Distance within which the outer sheet's vertices are searched, metres: an edge of its mesh.
        pub reach: f32 = 0.03,
        /// Share of its vertices below the outer sheet from which a piece is a lining.
        pub share: f64 = 0.85,
        /// The same for one whose name says so.
        pub share_named: f64 = 0.5,
    }

    /// Settings of the anchors.
    pub struct AnchorSettings {
        /// Height of the anchored ring at the top of cloth without an opening there, metres.
        pub ring: f32 = 0.025,
        /// Rise of an opening from which it is no band, metres: waistbands rise by 3 cm to the back.
        pub level: f32 = 0.08,
        /// Half width of the anchored strip on a shoulder, metres.
        pub strip: f32 = 0.012,
        /// Inner end of the strip, share of the way from the neck to the shoulder joint.
        pub inner: f32 = 0.3,
    }

    /// Settings of the triangles and rest shapes of pieces.
    pub struct PieceSettings {
        /// Share of the wanted edge length below which panels are coarsened: finer ones cannot be simulated in time.
        pub finer: f64 = 0.7,
        /// Least height of a triangle of cloth over its longest side: remeshing leaves a sliver now and then.
        pub least_height: f64 = 0.02,
        /// Distance from the sagittal plane within which cloth may touch both legs, metres.
        pub middle: f32 = 0.02,
        /// Share of its area below which a retargeted triangle has collapsed and keeps its rest shape.
        pub collapsed: f64 = 0.2,
        /// Smallest triangle of an accessory, m².
        pub least_area: f64 = 2e-8,
    }

    /// Settings of the clearance over the skin: a rest shape taken below it would be too tight for good.
    pub struct LiftSettings {
        /// Least height of cloth above the skin at the start, metres.
        pub above: f32 = 0.006,
        /// Distance from the skin within which cloth is lifted, metres.
        pub near: f32 = 0.04,
    }

    /// Settings of texture coordinates and joint weights.
    pub struct GarmentSurfaceSettings {
        /// Radius at which unrolled texture coordinates are lengths, metres: about a trunk's.
        pub unroll_radius: f32 = 0.15,
        /// Height below the hip joints over which a skirt comes to follow the legs alone, metres.
        pub leg_fade: f32 = 0.12,
        /// Height over which a knee bends a skirt, metres.
        pub knee: f32 = 0.10,
        /// Least half distance of the hip joints, metres.
        pub least_hip: f32 = 0.05,
    }

    /// Settings of retargeting.
    pub struct RetargetSettings {
        /// Distance from the mapped source skin beyond which target skin is not its counterpart, metres: a belly's depth.
        pub reach: f32 = 0.15,
        /// Least cosine between the normals of two skins that correspond.
        pub same_side: f32 = 0.3,
        /// Offset along the normals before the search, metres: it moves the other side of a limb farther away.
        pub offset: f32 = 0.04,
        /// Smoothing iterations of the skin residual in the first and the second pass, one edge (1 cm) each.
        pub smoothing: [usize; 2] = [30, 8],
        /// Lengths below this have no ratio, metres.
        pub shortest: f64 = 1e-3,
        /// Limits of the ratio of two bodies' lengths: grown bodies differ by less.
        pub ratio: [f64; 2] = [0.5, 2.0],
    }

    /// Settings of the person in a garment's file.
    pub struct AvatarSettings {
        /// Least vertices.
        pub vertices: usize = 500,
        /// Least extent, share of the file's.
        pub tall: f32 = 0.8,
        /// Diameter of its openings below which a surface counts as closed, share of its extent.
        pub opening: f32 = 0.06,
        /// Distance of the fitted body from it up to which it is a person, metres.
        pub residual: f64 = 0.02,
        /// Height over the skin up to which other parts belong to it, such as eyes, metres.
        pub skin: f32 = 0.004,
    }

    /// Settings of the guessed body.
    pub struct GuessSettings {
        /// Horizontal distance of a garment from the file's zero from which it is moved there first, metres.
        pub aside: f32 = 0.4,
        /// Garment vertices in the cost; more change the guess by less than its error.
        pub samples: usize = 500,
        /// Distance from the skin at which the cost saturates, metres.
        pub far: f32 = 0.08,
        /// Mean cost over `far` from which no body wears the garment; one in mid-air has 1.
        pub not_worn: f32 = 0.9,
        /// Weight of vertices inside the body against those outside.
        pub inside: f32 = 4.0,
        /// Usual height of cloth over skin, metres.
        pub above: f32 = 0.008,
        /// Standard deviation of stature over its mean.
        pub stature_spread: f64 = 0.05,
        /// Standard deviation of the floor's height in files, metres.
        pub floor_spread: f64 = 0.03,
        /// Mean distance that one variance of stature or floor is worth, metres; larger prefers the usual body to the better fit.
        pub prior: f32 = 0.002,
        /// Mean cost below which a garment needs no other frame than its body's, metres.
        pub worn: f32 = 0.06,
        /// Variances beyond which a floor at an unusual height costs no more.
        pub floor_cap: f64 = 25.0,
        /// Most that an unusual place and stature count among frames, metres: a file may have its zero anywhere.
        pub most_prior: f32 = 0.012,
        /// Height over the floor below which no garment hangs, metres.
        pub underground: f64 = -0.05,
        /// Largest extent below which a garment is a small one, metres.
        pub smallest: f32 = 0.6,
        /// Price of a small garment by the logarithm of its smallness, metres.
        pub small: f32 = 0.03,
        /// Garment vertices in the first cost of a frame.
        pub rough_samples: usize = 120,
        /// Step of the heights that a frame is tried at first, metres.
        pub height_step: f64 = 0.08,
        /// Frames that are refined.
        pub refined: usize = 8,
        /// Price of axes that few files have, metres.
        pub unusual: f32 = 0.0015,
        /// Least lead in cost over the next frame, metres: cloth worn back to front costs 3.5 mm more at the least (30 garments).
        pub margin: f32 = 0.0015,
        /// Mean distance of a garment from itself turned by half a turn below which its facing is of no matter, metres.
        pub symmetric: f32 = 0.02,
        /// Scale and arms [rad below the horizontal] at the start.
        pub start: [f64; 2] = [1.0, 0.75],
        /// Limits of the scale.
        pub scales: [f64; 2] = [0.8, 1.15],
        /// Limits of the arms (rad).
        pub arms: [f64; 2] = [-0.3, 1.4],
        /// First steps of the search: scale, arms (rad), shift up and to the front (m).
        pub steps: [f64; 4] = [0.04, 0.2, 0.04, 0.02],
        /// Halvings of the steps.
        pub halvings: usize = 5,
        /// Limits of a garment's largest extent, metres; they decide the file's unit.
        pub extent: [f32; 2] = [0.22, 2.2],
        /// Distance within which skin is searched, metres.
        pub search: f32 = 10.0,
    }
}

impl MeshGarmentSettings {
    /// Defaults with another edge length, metres.
    pub fn with_edge(edge: f64) -> Self {
        Self {
            edge,
            ..Self::default()
        }
    }
}
