//! Settings of the segmentation: appearances, labels of template and scan, garments that are told apart.

use super::settings;

settings! {
    /// Settings of a segmentation.
    pub struct LabelSettings {
        /// Distance up to which a scan point shows the surface below it, metres.
        pub near: f32 = 0.03,
        /// Points of a node that count as independent: neighbours in a scan share their light and their weave.
        pub independent: f64 = 2.0,
        /// Cost of a label change between neighbours of equal colour, nats (ψ of eq. 14).
        pub smoothness: f32 = 2.0,
        /// Share of it left between neighbours of different colour.
        pub least_smoothness: f32 = 0.1,
        /// Difference of colours that halves the rest.
        pub contrast: f32 = 0.10,
        /// Step down from the upper to the lower node that halves it, metres: hems lie on what is below.
        pub step: f32 = 0.003,
        /// Cost of another label than in the first frame, nats: garments slide over the body by little.
        pub change: f32 = 1.0,
        /// Cost of a top at a thigh where tops are known to reach there, nats.
        pub long_top: f32 = 0.3,
        /// Cost of a garment at a node between the legs without a scan point, nats: below a hem there is nothing.
        pub empty: f32 = 2.0,
        /// Mean cost above that of their own appearance from which colours are no skin, nats: arms have 2.0, shirts from 7.7.
        pub unlike_skin: f64 = 4.0,
        /// Mean cost above that of its own appearance from which a region is no skin, nats.
        pub distinct: f64 = 0.8,
        /// Least share of a garment's first nodes that it covers.
        pub least_cloth: f64 = 0.2,
        /// Turns of appearances and labels.
        pub turns: usize = 5,
        /// Farthest that a point of a garment lies off the surface, metres: the surface follows cloth to a few millimetres.
        pub farthest: f32 = 0.10,
        /// Rings of nodes about a boundary of labels within which points may change theirs, their neighbours included.
        pub boundary_rings: usize = 5,
        /// Appearances.
        pub colors: MixtureSettings = MixtureSettings::default(),
        /// Number and kinds of garments.
        pub outfit: OutfitLabelSettings = OutfitLabelSettings::default(),
        /// Two garments on the torso.
        pub torso: TorsoSettings = TorsoSettings::default(),
        /// Islands.
        pub islands: IslandSettings = IslandSettings::default(),
        /// Labels of the scan.
        pub scan: ScanLabelSettings = ScanLabelSettings::default(),
        /// Unseen parts of the body.
        pub unseen: UnseenSettings = UnseenSettings::default(),
        /// Gains of the cameras of a cloud.
        pub gains: CameraGainSettings = CameraGainSettings::default(),
    }

    /// Settings of mixtures of colours (eq. 13).
    pub struct MixtureSettings {
        /// Modes of a garment: prints, folds and shadows need a few.
        pub modes: usize = 4,
        /// Modes of skin, hair and what hands hold.
        pub skin_modes: usize = 6,
        /// Iterations of k-means before.
        pub clustering: usize = 8,
        /// Iterations of expectation maximisation.
        pub maximising: usize = 8,
        /// Least standard deviation of a mode along each axis: noise of a colour camera.
        pub noise: f64 = 0.025,
        /// Share of colours that no mode explains: logos, highlights, wrong texture.
        pub outliers: f64 = 0.02,
        /// Largest number of colours that a fit uses, evenly chosen.
        pub samples: usize = 3000,
    }

    /// Settings of the number and kinds of garments.
    pub struct OutfitLabelSettings {
        /// Least difference between the dyes of shoes and skin, light left out: bare feet have up to 0.11, shoes from 0.37.
        pub dye: f64 = 0.2,
        /// Least share of the feet that shoes cover: hems of trousers lie there, too.
        pub feet: f64 = 0.3,
        /// Mean step at a hem from which a garment lies over another, metres: dresses have 0.0009, tops over bottoms 0.0012.
        pub overlap: f64 = 0.0012,
        /// Largest step that counts, metres.
        pub most_overlap: f64 = 0.01,
    }

    /// Settings of two garments on the torso.
    pub struct TorsoSettings {
        /// Clusters in which the colours of torso and arms start; each way to join them to two is tried.
        pub clusters: usize = 6,
        /// Least share of torso and arms that is a garment of its own.
        pub least_share: f64 = 0.04,
        /// Least step of colour where garments meet, in their standard deviations: shades have 0.86, jackets over shirts 1.4.
        pub least_step: f64 = 1.1,
        /// Largest ratio of edges between two garments to those within the smaller one: stripes and spots have over 0.8.
        pub most_mixed: f64 = 0.5,
        /// Least share of its border at which a garment meets skin or that of the legs: prints meet their own garment only.
        pub least_free: f64 = 0.05,
        /// Brightness added before colours are divided by it: hues of dark colours are noise.
        pub dark: f64 = 0.1,
        /// Weight of the logarithm of brightness beside hue and saturation: light changes it, dyes do too.
        pub brightness: f64 = 0.4,
    }

    /// Settings of islands: stripes and prints in another garment's colour.
    pub struct IslandSettings {
        /// Share of the nodes of a garment's largest piece up to which another one, beside another garment, is an island.
        pub most_share: f64 = 0.3,
        /// Least share of an island's neighbours that belong to one other garment.
        pub beside: f64 = 0.4,
    }

    /// Settings of the labels of a scan.
    pub struct ScanLabelSettings {
        /// Width of the band about the template's boundaries in which the scan decides, rings of nodes.
        pub band: u32 = 3,
        /// Cost of another label than the template's within the band, nats a ring.
        pub pull: f32 = 0.7,
        /// Cost of a label change between neighbours of equal colour, nats.
        pub smoothness: f32 = 2.0,
        /// Share of it left across a change of colour.
        pub least_smoothness: f32 = 0.2,
        /// Difference of colours that halves the rest.
        pub contrast: f32 = 0.08,
    }

    /// Settings of unseen parts of the body.
    pub struct UnseenSettings {
        /// Height of a slice across a bone, metres.
        pub slice: f32 = 0.02,
        /// Share of a slice's nodes with a scan point from which it is seen: one side of a limb has a third.
        pub slice_share: f64 = 0.1,
        /// Share of a region's vertices with a point below which the region is unseen.
        pub region_share: f64 = 0.2,
    }

    /// Settings of the gains of cameras.
    pub struct CameraGainSettings {
        /// Height of a ring along its bone, metres.
        pub ring: f32 = 0.04,
        /// Horizontal part of a normal from which it has an azimuth: less and less of a gain is known below.
        pub level: f32 = 0.3,
        /// Least points of a ring at an azimuth that have a vote.
        pub least_points: f32 = 3.0,
        /// Brightness added before logarithms, of 255: ratios of dark colours are noise.
        pub dark: f32 = 12.0,
        /// Logarithm of a ratio from which differences count by their size only: garments differ by more than light and gains.
        pub robust: f64 = 0.05,
        /// Rounds of reweighting.
        pub rounds: usize = 30,
        /// Weight of the difference of neighbouring azimuths, votes.
        pub smooth: f64 = 4.0,
        /// Weight of a gain itself, votes.
        pub own: f64 = 0.5,
        /// Largest logarithm of a gain: white balance and exposure of one camera type.
        pub largest: f64 = 0.4,
    }
}
