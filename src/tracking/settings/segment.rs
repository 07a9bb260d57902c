//! Settings of the segmentation: scene planes, the person, expected body, hands, ends of limbs, refusals.

use super::settings;

settings! {
    /// Settings of the segmentation.
    pub struct SegmentSettings {
        /// Frames without a subject after which the scene planes are searched again. Smaller costs 1.5 ms more often.
        pub scene_interval: u32 = 60,
        /// Reach of the search around the last position, metres: six times a sprint between two frames. Larger follows
        /// somebody else.
        pub reach: f32 = 0.8,
        /// Age of a last pose up to which a lost person is searched near it alone, frames: nobody leaves and is replaced
        /// within a second. Larger waits longer for who has left.
        pub recall: u32 = 30,
        /// Reach of that search at first, metres: somebody beside the lost person is farther away.
        pub recent_reach: f32 = 0.3,
        /// Growth of `recent_reach` per frame, metres: a brisk walk. Smaller misses who walks on.
        pub walk: f32 = 0.04,
        /// Least number of cells of a subject; fewer are a thing or noise.
        pub least_cells: usize = 60,
        /// Depth difference from which a neighbour occludes, metres; smaller and folds of cloth count as edges.
        pub occluder: f32 = 0.06,
        /// Floor and background.
        pub planes: PlaneSettings = PlaneSettings::default(),
        /// The person among the connected components.
        pub person: PersonSettings = PersonSettings::default(),
        /// People side by side.
        pub expected_body: ExpectedBodySettings = ExpectedBodySettings::default(),
        /// Hands beyond sleeves without return.
        pub hands: HandSettings = HandSettings::default(),
        /// Ends of limbs.
        pub extremities: ExtremitySettings = ExtremitySettings::default(),
        /// Candidates refused before.
        pub refusals: RefusalSettings = RefusalSettings::default(),
    }

    /// Settings of the scene planes and their search.
    pub struct PlaneSettings {
        /// Distance from the floor that still counts as floor, metres (paper, section 6: 20 mm). Larger cuts feet off.
        pub floor_tolerance: f32 = 0.020,
        /// Distance from a background plane that still counts as background, metres (paper, section 6: 200 mm). Larger takes
        /// who leans on a wall for it.
        pub background_tolerance: f32 = 0.200,
        /// The floor's normal is within this angle of the image's up direction: cameras are tilted, seldom rolled. Larger,
        /// radians, takes slopes for floors.
        pub floor_tilt: f64 = 0.75,
        /// Least share of all cells on a plane. A person's chest held 4 % at most. Smaller takes a chest for a plane.
        pub share: f64 = 0.04,
        /// Least standard deviation of a plane in its second direction, metres; a person's front has 0.15. Smaller takes a
        /// front for a wall.
        pub spread: f64 = 0.20,
        /// Least visible area of a background plane, m²: more than the largest body, who may stand alone in the picture.
        pub least_background: f64 = 1.2,
        /// Largest share of the readings behind a background plane or below the floor. Larger takes tables for floors.
        pub behind: f64 = 0.03,
        /// Pitches of the floor normal in the coarse vote, radians: first, last, step.
        pub pitches: [f64; 3] = [-0.7, 0.7, 0.05],
        /// Rolls of the floor normal in the coarse vote, radians: first, last, step.
        pub rolls: [f64; 3] = [-0.35, 0.35, 0.07],
        /// Ratio of the coarse to the fine step of the vote. Larger costs its square in time.
        pub finer: f64 = 5.0,
        /// Heights of the floor below the camera and width of their bins, metres: first, last, step.
        pub heights: [f32; 3] = [0.2, 3.0, 0.04],
        /// Points in the vote; more cost time and find no other floor.
        pub floor_points: usize = 1500,
        /// Least-squares refits of the voted floor. More move the floor by less than its tolerance.
        pub floor_refits: usize = 4,
        /// Random triples tried for each plane; a wall that fills a fifth of the picture is hit with 1 − 10⁻⁵.
        pub trials: usize = 150,
        /// Every n-th point counts in the score of a triple. Larger is faster and ranks by fewer points.
        pub score_step: usize = 4,
        /// Largest number of background planes.
        pub most_planes: usize = 4,
        /// Largest distance of the corners of a triple, cells: near ones likely share a plane.
        pub triple_reach: i32 = 20,
    }

    /// Settings of the connected components and of the person among them.
    pub struct PersonSettings {
        /// Depth difference below which neighbouring cells connect, metres; plus `link_slope` × z. Larger joins people to
        /// furniture, smaller cuts limbs off.
        pub link: f32 = 0.08,
        /// Growth of `link` with the distance, as noise grows.
        pub link_slope: f32 = 0.015,
        /// Smallest visible area of a body, m²: head and shoulders seen from the front. Smaller starts on bags.
        pub least_area: f32 = 0.08,
        /// Share of `least_area` that identifies the person near the prior: half hidden suffices, a hand alone does not.
        pub prior_share: f32 = 0.3,
        /// Largest visible area of a body, m²; a big man in a T-pose shows 0.9. Larger starts on cupboards.
        pub most_area: f32 = 1.6,
        /// Least visible height of a body, and the tallest body with raised arms, metres.
        pub heights: [f32; 2] = [0.35, 2.6],
        /// Widest body, arms spread, metres.
        pub most_width: f32 = 2.2,
        /// Largest depth of a cut-off part from the median of the body, metres. Smaller drops an arm held out.
        pub limb_reach: f32 = 0.9,
        /// Largest area of a further part, as a share of the main one.
        pub large_part: f32 = 1.0,
        /// Share of its rows on a side of the image above which a candidate is furniture or a wall.
        pub side_share: f32 = 0.5,
        /// Least height of a person cut by the side of the image, with the head in the picture, metres.
        pub cut_height: f32 = 1.0,
        /// Largest depth of a person cut by the side, metres; a wall or a table seen along its length is deeper.
        pub cut_depth: f32 = 0.9,
        /// Least standard deviation of a person cut by the side from a plane, metres: half a standing person has 0.05, the
        /// noise of a sensor at 3 m is 0.01. Doors and wardrobes are flatter.
        pub roundness: f64 = 0.025,
        /// Rank penalty of a component on a side of the image, metres of distance. Smaller tries walls first.
        pub side_cost: f32 = 4.0,
        /// Rank penalty at the upper rim, metres of distance; a person close by may reach it.
        pub top_cost: f32 = 2.0,
        /// Height below which a component is more likely a box or a chair, metres.
        pub upright: f32 = 0.8,
        /// Rank penalty of a component lower than `upright`, metres of distance. Smaller tries boxes first.
        pub low_cost: f32 = 1.5,
    }

    /// Settings of the body that is expected in a frame.
    pub struct ExpectedBodySettings {
        /// Difference in depth up to which a reading is the expected body's, metres: a sprint between two frames. Larger
        /// takes who stands behind.
        pub same_body: f32 = 0.3,
        /// Area of the person over that of the expected body from which something else may be among it. Smaller splits loose
        /// clothes off.
        pub larger: f32 = 1.25,
        /// Distance from the expected body, across the view, within which cells then stay the person's, metres: a fast hand
        /// moves by 0.1 between two frames.
        pub around: f32 = 0.15,
        /// Share of a component's cells near the expected body from which it may be a limb of it. Smaller takes who passes for
        /// one, larger leaves hands that move fast.
        pub own_share: f32 = 0.25,
        /// Area of an expected body below which nothing is split, m²: a head alone.
        pub least_area: f32 = 0.08,
    }

    /// Settings of the hands beyond sleeves without return.
    pub struct HandSettings {
        /// Least cells of a hand, fingers taken together. 1 takes noise for hands.
        pub least_cells: usize = 2,
        /// Largest area of a hand, m²; with the wrist it has 0.02. Larger takes heads for hands.
        pub most_area: f32 = 0.03,
        /// Largest distance of a hand from the visible body, metres: a long arm from the edge of the chest.
        pub arm_length: f32 = 0.80,
        /// Least cells between hand and body.
        pub least_gap: i32 = 3,
        /// Least share of the cells between hand and body without a reading. Smaller joins things across a gap.
        pub hole_share: f32 = 0.7,
        /// Most candidates examined; bounds the time in a cluttered room.
        pub most_candidates: usize = 6,
        /// Every n-th cell of the body is tested as the start of a hole. Larger is faster and misses narrow holes.
        pub body_step: usize = 8,
        /// Largest share of single missing cells on the body. A picture with nine tenths of its pixels lost has 0.18, a
        /// whole one next to none; above this, holes mean nothing.
        pub most_pores: f32 = 0.03,
        /// Largest distance between parts of one hand, metres. Larger joins both hands.
        pub hand_length: f32 = 0.15,
    }

    /// Settings of the geodesic ends of the body.
    pub struct ExtremitySettings {
        /// Distance from which neighbours lie on different limbs, metres; plus `jump_slope` × z. Larger joins an arm to the
        /// chest before which it is held.
        pub jump: f32 = 0.06,
        /// Growth of `jump` with the depth, as cells grow.
        pub jump_slope: f32 = 0.015,
        /// Least geodesic distance of an end from the torso and from earlier paths, metres; shorter ones are folds and
        /// noise.
        pub shortest: f32 = 0.2,
        /// Ends to detect: head, hands, feet, and elbows of hands that lie on the body.
        pub most: usize = 7,
    }

    /// Settings of the memory of refused candidates.
    pub struct RefusalSettings {
        /// Displacement of a centre below which a candidate is the same thing, metres. Larger mistakes a person in motion
        /// for what was refused; smaller forgets things whose outline flickers.
        pub same_centre: f32 = 0.08,
        /// The same for the corners of the box, where single cells flicker, metres. The lower side says nothing: thin poles
        /// and shins come and go near the floor.
        pub same_corner: f32 = 0.25,
        /// Refusals without a wait: a second start may succeed where noise spoilt the first.
        pub free_trials: u32 = 2,
        /// Longest wait, frames: 2 s. Larger overlooks a person who takes a thing's place for longer.
        pub longest: u32 = 64,
        /// Most refusals kept; the oldest is forgotten.
        pub most: usize = 32,
    }
}
