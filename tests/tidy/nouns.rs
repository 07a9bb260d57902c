//! Nouns of the charters, each with the file or item of the module that it names.

/// Modules whose charter is ahead of their code; they hold `mod.rs` alone.
pub(crate) const NOT_BUILT: &[&str] = &[];

/// A noun of a charter, and a path below the module or an item that the module declares.
pub(crate) type Noun = (&'static str, &'static str);

/// Module and the nouns of its charter.
pub(crate) const NOUNS: &[(&str, &[Noun])] = &[
    (
        "math",
        &[
            ("so(3)/se(3) maps", "exp_se3"),
            ("twists", "Twist"),
            ("polar", "polar.rs"),
            ("PSD projection", "project_psd"),
            ("element energy", "element_energy.rs"),
            ("derivative check", "derivative_check.rs"),
        ],
    ),
    (
        "par",
        &[
            ("door to rayon", "Par"),
            ("parallel loops", "for_chunks"),
            ("reductions", "map_into"),
        ],
    ),
    (
        "mesh",
        &[
            ("Triangle meshes", "TriMesh"),
            ("topology", "Topology"),
            ("construction", "MeshError"),
            ("normals", "normals.rs"),
            ("boundaries", "boundary_vertices"),
            ("isotropic remeshing", "remesh.rs"),
            ("neighbour smoothing", "smoothing.rs"),
        ],
    ),
    (
        "camera",
        &[
            ("Intrinsics", "Intrinsics"),
            ("depth and colour images", "DepthImage"),
            ("projection", "project"),
            ("noise models", "NoiseModel"),
            ("what a sensor saw and when", "RgbdFrame"),
        ],
    ),
    (
        "linear",
        &[
            ("Sparse symmetric systems", "SymmetricPattern"),
            ("assembly", "pattern.rs"),
            ("factorisation", "cholesky.rs"),
            ("preconditioned iteration", "conjugate_gradient.rs"),
            ("report", "CgReport"),
        ],
    ),
    (
        "spatial",
        &[
            ("refit BVH", "Bvh"),
            ("closest", "closest"),
            ("overlap", "overlapping"),
            ("ray parity", "winding_number"),
            ("hash grid", "HashGrid"),
            ("kd-tree", "kdtree.rs"),
            ("organised image", "OrganisedCloud"),
            ("brute-force oracle", "brute.rs"),
        ],
    ),
    (
        "raster",
        &[
            ("Meshes", "LayeredMesh"),
            ("depth", "VisibilityBuffer"),
            ("id images", "VisibilityBuffer"),
            ("fast path", "fast.rs"),
            ("judge", "reference.rs"),
        ],
    ),
    (
        "formats",
        &[
            ("MCAP", "mcap_file"),
            ("RGBD folders", "rgbd_folder"),
            ("npz bodies", "npz.rs"),
            ("OBJ", "obj.rs"),
            ("glTF", "gltf"),
            ("patterns", "garmentcode.rs"),
            ("never a panic", "FormatError"),
        ],
    ),
    (
        "body",
        &[
            ("articulated template", "Template"),
            ("skeleton", "Skeleton"),
            ("twists", "Pose"),
            ("skinning", "skinning.rs"),
            ("shape", "ShapeSpace"),
            ("bone scales", "BodyShape"),
            ("displacements", "RestBody"),
            ("map from vertices to parts and limbs", "parts"),
            ("embedded body", "embedded"),
            ("importers", "import.rs"),
        ],
    ),
    (
        "garment",
        &[
            ("panels", "Panel"),
            ("seams", "Seam"),
            ("materials", "Material"),
            ("rest shape", "GarmentMesh"),
            ("sizes", "Size"),
            ("anchors", "Anchor"),
        ],
    ),
    (
        "segment",
        &[
            ("person", "person.rs"),
            ("floor", "planes.rs"),
            ("background", "plane_bands.rs"),
            ("nearest body", "components.rs"),
            ("edges", "edges.rs"),
            ("body parts", "part_forest"),
        ],
    ),
    (
        "registration",
        &[
            ("Correspondences", "pairing.rs"),
            ("robust kernels", "GemanMcClure"),
            ("Gauss–Newton", "solve_damped"),
        ],
    ),
    (
        "tracking",
        &[
            ("step", "step.rs"),
            ("last state", "TrackerState"),
            ("pose", "model.rs"),
            ("displacements", "surface.rs"),
            ("confidence report", "JointConfidence"),
        ],
    ),
    (
        "clothcap",
        &[
            ("Garments from scans", "capture.rs"),
            ("alignment", "align"),
            ("segmentation", "segment"),
            ("multi-part templates", "MultiCloth"),
            ("undressing", "undress.rs"),
            ("retargeting", "retarget.rs"),
        ],
    ),
    (
        "composite",
        &[
            ("captured image", "captured.rs"),
            ("garments", "GarmentView"),
            ("visibility", "evidence.rs"),
            ("shading", "shading.rs"),
            ("edges", "matte.rs"),
        ],
    ),
    (
        "gpu",
        &[
            ("twins", "Renderer"),
            ("inputs and outputs", "targets.rs"),
            ("naming wgpu", "adapter.rs"),
        ],
    ),
    (
        "dressing",
        &[
            ("panel placement", "place"),
            ("sewing", "sew.rs"),
            ("size choice", "suggest.rs"),
            ("first drape", "drape"),
            ("fit map", "FitMap"),
        ],
    ),
    (
        "synth",
        &[
            ("people", "Actor"),
            ("garments", "paint.rs"),
            ("cameras", "Setting"),
            ("sequences", "Sequence"),
            ("known truth", "Truth"),
        ],
    ),
    (
        "offline",
        &[
            ("contact", "contacts.rs"),
            ("steps", "step.rs"),
            ("static drape", "drape.rs"),
            ("animation", "animation.rs"),
            ("checkpoints", "checkpoint.rs"),
            ("obstacle springs", "ObstacleSpring"),
        ],
    ),
    (
        "session",
        &[
            ("transition table", "table.rs"),
            ("Opening", "State"),
            ("Calibrating", "State"),
            ("Live", "State"),
            ("Draining", "State"),
            ("Closed", "State"),
            ("Degraded(why)", "Fault"),
        ],
    ),
    (
        "mirror",
        &[
            ("track", "chain.rs"),
            ("choose size", "choice.rs"),
            ("dress", "DressedOutfit"),
            ("simulate", "chain.rs"),
            ("composite", "picture.rs"),
            ("chain", "Mirror"),
        ],
    ),
    (
        "evaluate",
        &[
            ("Run time against error", "run_time_against_error"),
            ("standard scenes", "scenes.rs"),
            ("methods side by side", "ablation.rs"),
            ("tables", "Table"),
            ("plots", "plot.rs"),
        ],
    ),
    (
        "contact",
        &[
            ("collision body", "CollisionBody"),
            ("filtered", "body_filter.rs"),
            ("parts", "part_clearance.rs"),
            ("joints separated", "joint_clearance.rs"),
            ("closest points", "closest_point.rs"),
            ("inside tests", "interior.rs"),
            ("virtual depth maps", "depth_maps.rs"),
            ("Contact pairs", "ContactPair"),
            ("broad phase", "broad_phase/mod.rs"),
            ("continuous collision detection", "ccd/mod.rs"),
            ("distances", "distance/mod.rs"),
            ("barrier", "Barrier"),
            ("friction", "Friction"),
        ],
    ),
    (
        "elastic",
        &[
            ("stretch", "stretch_law.rs"),
            ("bend laws", "bend_law.rs"),
            ("membranes", "membrane.rs"),
            ("hinges", "hinge.rs"),
            ("dihedral angles", "dihedral.rs"),
            ("cloth model", "ClothModel"),
            ("masses", "model.rs"),
            ("assembly", "assembly.rs"),
        ],
    ),
    (
        "cloth",
        &[
            ("step", "step.rs"),
            ("filter", "collision.rs"),
            ("collide", "collide.rs"),
            ("solve", "solve.rs"),
            ("commit", "commit.rs"),
            ("sheet", "model/sheet.rs"),
            ("membrane", "model/membrane.rs"),
            ("bending", "model/bending.rs"),
            ("partition", "model/partition.rs"),
            ("explicit", "solver/explicit"),
            ("xpbd", "solver/xpbd"),
            ("implicit", "solver/implicit"),
            ("trait", "Solver"),
            ("`sleep/`", "sleep"),
            ("`repair/`", "repair"),
        ],
    ),
];
