//! Templates, poses and shapes.

use super::{WireError, bulk, geometry, required};
use crate::v1;
use nalgebra::{Point3, Vector3};
use tryon_body::{
    BodyShape, Joint, JointMotion, Pose, ShapeSpace, Skeleton, SkinWeights, Template,
};
use tryon_geometry::math::{Camera, P3, V3};
use tryon_geometry::mesh::TriMesh;
use tryon_tracking::KnownBody;

const MAX_VERTICES: u32 = 65_536;
const MAX_FACES: u32 = 131_072;
const MAX_JOINTS: usize = 255;
const MAX_DIRECTIONS: usize = 64;

/// Step of a displacement on the wire [m]: a tenth of a sensor's noise, with a range of 3.2 m.
const DISPLACEMENT_UNIT: f32 = 1e-4;

/// Wire message of a template.
pub fn template_to_wire(t: &Template) -> v1::BodyTemplate {
    let (mesh, weights) = (t.mesh(), t.weights());
    v1::BodyTemplate {
        name: t.name().into(),
        vertex_count: mesh.vertices().len() as u32,
        face_count: mesh.faces().len() as u32,
        vertices: bulk::write(mesh.vertices().iter().map(|p| [p.x, p.y, p.z])),
        faces: bulk::write(mesh.faces().iter().copied()),
        joints: t.skeleton().joints().iter().map(joint_to_wire).collect(),
        skin_joints: bulk::write(weights.joints.iter().copied()),
        skin_weights: bulk::write(weights.weights.iter().copied()),
        shape_directions: t.shape_space().map_or_else(Vec::new, |s| {
            (0..s.names.len())
                .map(|d| v1::ShapeDirection {
                    name: s.names[d].clone(),
                    vertices: bulk::write(s.vertices[d].iter().map(|v| [v.x, v.y, v.z])),
                    joints: bulk::write(s.joints[d].iter().map(|v| [v.x, v.y, v.z])),
                })
                .collect()
        }),
    }
}

fn joint_to_wire(j: &Joint) -> v1::Joint {
    let (kind, axis, limits) = match &j.motion {
        JointMotion::Fixed => (v1::JointKind::Fixed, None, vec![]),
        JointMotion::Hinge { axis, limits } => (
            v1::JointKind::Hinge,
            Some(geometry::vector_to_wire(&Vector3::from(*axis))),
            limits.to_vec(),
        ),
        JointMotion::Ball { limits } => (v1::JointKind::Ball, None, limits.concat()),
    };
    v1::Joint {
        name: j.name.clone(),
        parent: j.parent.map(|p| p as u32),
        rest: Some(geometry::vector_to_wire(&j.rest.coords)),
        kind: kind.into(),
        axis,
        limits,
    }
}

fn joint(j: &v1::Joint, field: &str) -> Result<Joint, WireError> {
    let fault = |f: &str, why: &str| WireError::new(format!("{field}.{f}"), why);
    let pair = |i: usize| [j.limits[2 * i], j.limits[2 * i + 1]];
    let angles = match j.kind() {
        v1::JointKind::Unspecified => return Err(fault("kind", "is required")),
        v1::JointKind::Fixed => 0,
        v1::JointKind::Hinge => 1,
        v1::JointKind::Ball => 3,
    };
    if j.limits.len() != 2 * angles {
        return Err(fault("limits", "two numbers for each angle are needed"));
    }
    let motion = match angles {
        0 => JointMotion::Fixed,
        1 => {
            let axis = geometry::vector_from_wire(j.axis.as_ref(), &format!("{field}.axis"))?;
            JointMotion::Hinge {
                axis: axis.into(),
                limits: pair(0),
            }
        }
        _ => JointMotion::Ball {
            limits: [pair(0), pair(1), pair(2)],
        },
    };
    Ok(Joint {
        name: j.name.clone(),
        parent: j.parent.map(|p| p as usize),
        rest: Point3::from(geometry::vector_from_wire(
            j.rest.as_ref(),
            &format!("{field}.rest"),
        )?),
        motion,
    })
}

/// Template with consistent sizes.
///
/// # Errors
/// Names the field that is of the wrong size, not finite or not a body.
pub fn template_from_wire(t: &v1::BodyTemplate) -> Result<Template, WireError> {
    let n = bulk::count("body_template.vertex_count", t.vertex_count, MAX_VERTICES)?;
    let m = bulk::count("body_template.face_count", t.face_count, MAX_FACES)?;
    if t.joints.len() > MAX_JOINTS {
        return Err(WireError::new(
            "body_template.joints",
            format!("at most {MAX_JOINTS}"),
        ));
    }
    if t.shape_directions.len() > MAX_DIRECTIONS {
        return Err(WireError::new(
            "body_template.shape_directions",
            format!("at most {MAX_DIRECTIONS}"),
        ));
    }
    let vertices = bulk::read::<f32, 3>("body_template.vertices", n, &t.vertices)?
        .into_iter()
        .map(P3::from)
        .collect();
    let faces = bulk::faces("body_template.faces", m, n, &t.faces)?;
    let mesh = TriMesh::new(vertices, faces)
        .map_err(|e| WireError::new("body_template.faces", e.to_string()))?;
    let joints = t
        .joints
        .iter()
        .enumerate()
        .map(|(i, j)| joint(j, &format!("body_template.joints[{i}]")));
    let skeleton = Skeleton::new(joints.collect::<Result<_, _>>()?)
        .map_err(|e| WireError::new("body_template.joints", e.to_string()))?;
    let weights = SkinWeights {
        joints: bulk::read("body_template.skin_joints", n, &t.skin_joints)?,
        weights: bulk::read("body_template.skin_weights", n, &t.skin_weights)?,
    };
    let mut space = ShapeSpace::default();
    for (d, s) in t.shape_directions.iter().enumerate() {
        let field = format!("body_template.shape_directions[{d}]");
        let v = bulk::read::<f32, 3>(&format!("{field}.vertices"), n, &s.vertices)?;
        let j = bulk::read::<f64, 3>(&format!("{field}.joints"), skeleton.len(), &s.joints)?;
        space.names.push(s.name.clone());
        space.vertices.push(v.into_iter().map(V3::from).collect());
        space
            .joints
            .push(j.into_iter().map(Vector3::from).collect());
    }
    let space = (!space.names.is_empty()).then_some(space);
    Template::new(t.name.clone(), mesh, skeleton, weights, space)
        .map_err(|e| WireError::new("body_template", e.to_string()))
}

/// Wire message of a pose.
pub fn pose_to_wire(p: &Pose<Camera>) -> v1::BodyPose {
    v1::BodyPose {
        camera_from_body: Some(geometry::rigid_to_wire(&p.root)),
        angles: bulk::write_flat(&p.angles),
    }
}

/// Pose of a skeleton with `dofs` angles.
///
/// # Errors
/// Names the field that is absent, of the wrong size or not finite.
pub fn pose_from_wire(p: &v1::BodyPose, dofs: usize) -> Result<Pose<Camera>, WireError> {
    let root = required(p.camera_from_body.as_ref(), "body_pose.camera_from_body")?;
    let angles = bulk::read::<f64, 1>("body_pose.angles", dofs, &p.angles)?;
    Ok(Pose {
        root: geometry::rigid_from_wire(root, "body_pose.camera_from_body")?,
        angles: angles.into_iter().map(|[a]| a).collect(),
    })
}

/// Wire message of a shape; displacements are rounded to a tenth of a millimetre.
pub fn shape_to_wire(s: &BodyShape) -> v1::BodyShape {
    let quantised: Vec<i16> = s
        .displacements
        .iter()
        .map(|d| (d / DISPLACEMENT_UNIT).round().clamp(-32767.0, 32767.0) as i16)
        .collect();
    v1::BodyShape {
        coefficients: bulk::write_flat(&s.coefficients),
        bone_scales: bulk::write_flat(&s.bone_scales),
        displacements: bulk::write_flat(&quantised),
        displacement_unit: DISPLACEMENT_UNIT,
    }
}

/// Shape of `template`.
///
/// # Errors
/// Names the field whose size does not fit the template or whose numbers are not finite.
pub fn shape_from_wire(s: &v1::BodyShape, template: &Template) -> Result<BodyShape, WireError> {
    let directions = template.shape_space().map_or(0, |d| d.names.len());
    let coefficients =
        bulk::read_flat::<f64>("body_shape.coefficients", directions, &s.coefficients)?;
    let joints = if s.bone_scales.is_empty() {
        0
    } else {
        template.skeleton().len()
    };
    let bone_scales = bulk::read::<f64, 1>("body_shape.bone_scales", joints, &s.bone_scales)?;
    if bone_scales.iter().any(|[b]| *b <= 0.0) {
        return Err(WireError::new(
            "body_shape.bone_scales",
            "a scale must be positive",
        ));
    }
    let n = if s.displacements.is_empty() {
        0
    } else {
        template.mesh().vertices().len()
    };
    let steps = bulk::read::<i16, 1>("body_shape.displacements", n, &s.displacements)?;
    let unit = s.displacement_unit;
    if n > 0 && !(unit.is_finite() && unit > 0.0) {
        return Err(WireError::new(
            "body_shape.displacement_unit",
            "must be positive",
        ));
    }
    Ok(BodyShape {
        coefficients,
        bone_scales: bone_scales.into_iter().map(|[b]| b).collect(),
        displacements: steps.into_iter().map(|[q]| f32::from(q) * unit).collect(),
    })
}

/// Wire message of a known body of `template`.
pub fn known_body_to_wire(k: &KnownBody, template: &Template) -> v1::KnownBody {
    v1::KnownBody {
        subject: k.subject,
        shape: Some(shape_to_wire(&k.shape)),
        template_name: template.name().into(),
        residual_mm: (k.residual * 1e3) as f32,
    }
}

/// Largest residual of a known body [mm]: a tracked one stays below a fifth of it.
const MOST_RESIDUAL_MM: f32 = 100.0;

/// Known body of `template`, in the field `known_body` of `message`.
///
/// # Errors
/// Names the field that is absent, of another template, or no body that a tracker may have reported.
pub fn known_body_from_wire(
    k: &v1::KnownBody,
    template: &Template,
    message: &str,
) -> Result<KnownBody, WireError> {
    let fault = |f: &str, why: &str| WireError::new(format!("{message}.known_body.{f}"), why);
    if k.subject == 0 {
        return Err(fault("subject", "from 1 on"));
    }
    if k.template_name != template.name() {
        let why = format!("the template is `{}`", template.name());
        return Err(fault("template_name", &why));
    }
    if !(0.0..=MOST_RESIDUAL_MM).contains(&k.residual_mm) {
        return Err(fault("residual_mm", "0 to 100 mm"));
    }
    let shape = (k.shape.as_ref()).ok_or_else(|| fault("shape", "is required"))?;
    let shape = shape_from_wire(shape, template).map_err(|e| {
        let part = e.field.replacen("body_shape", "shape", 1);
        fault(&part, &e.why)
    })?;
    let known = KnownBody {
        subject: k.subject,
        shape,
        residual: f64::from(k.residual_mm) * 1e-3,
    };
    let checked = known.check(template);
    checked.map_err(|e| fault(&format!("shape.{}", e.part), &e.why))?;
    Ok(known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytes::Bytes;

    /// A tetrahedron on two bones.
    pub(crate) fn small_template() -> Template {
        let p = |x: f32, y: f32, z: f32| P3::new(x, y, z);
        let mesh = TriMesh::new(
            vec![
                p(0.0, 0.0, 0.0),
                p(1.0, 0.0, 0.0),
                p(0.0, 1.0, 0.0),
                p(0.0, 0.0, 1.0),
            ],
            vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        )
        .expect("a tetrahedron");
        let at = |y: f64| Point3::new(0.0, y, 0.0);
        let ball = JointMotion::Ball {
            limits: [[-1.0, 1.0]; 3],
        };
        let hinge = JointMotion::Hinge {
            axis: [0.0, 0.0, 1.0],
            limits: [0.0, 2.0],
        };
        let skeleton = Skeleton::new(vec![
            Joint {
                name: "pelvis".into(),
                parent: None,
                rest: at(0.0),
                motion: JointMotion::Fixed,
            },
            Joint {
                name: "spine1".into(),
                parent: Some(0),
                rest: at(0.5),
                motion: ball,
            },
            Joint {
                name: "head".into(),
                parent: Some(1),
                rest: at(1.0),
                motion: hinge,
            },
        ])
        .expect("a chain");
        let weights =
            SkinWeights::from_rows((0..4).map(|i| vec![(i % 3, 0.75), ((i + 1) % 3, 0.25)]))
                .expect("weights");
        let space = ShapeSpace {
            names: vec!["stature".into()],
            vertices: vec![vec![V3::new(0.0, 0.1, 0.0); 4]],
            joints: vec![vec![Vector3::new(0.0, 0.1, 0.0); 3]],
        };
        Template::new("small", mesh, skeleton, weights, Some(space)).expect("fits")
    }

    #[test]
    fn templates_poses_and_shapes_round_trip() {
        let t = small_template();
        let back = template_from_wire(&template_to_wire(&t)).expect("same");
        assert_eq!(back.mesh(), t.mesh());
        assert_eq!(back.skeleton(), t.skeleton());
        assert_eq!(back.weights(), t.weights());
        assert_eq!(back.shape_space(), t.shape_space());
        let pose = Pose {
            angles: vec![0.1, 0.2, 0.3, 0.4],
            root: tryon_geometry::math::Rigid::identity(),
        };
        assert_eq!(pose_from_wire(&pose_to_wire(&pose), 4).expect("same"), pose);
        let shape = BodyShape {
            coefficients: vec![1.5],
            bone_scales: vec![1.0, 1.1, 0.9],
            displacements: vec![0.0, 0.00123, -0.02, 0.004],
        };
        let s = shape_from_wire(&shape_to_wire(&shape), &t).expect("same");
        assert_eq!(
            (&s.coefficients, &s.bone_scales),
            (&shape.coefficients, &shape.bone_scales)
        );
        for (a, b) in s.displacements.iter().zip(&shape.displacements) {
            assert!((a - b).abs() <= DISPLACEMENT_UNIT / 2.0 * 1.001);
        }
    }

    #[test]
    fn a_known_body_comes_back_and_one_that_is_none_names_its_field() {
        let t = small_template();
        let known = KnownBody {
            subject: 3,
            shape: BodyShape {
                coefficients: vec![1.5],
                bone_scales: vec![1.0, 1.1, 0.9],
                displacements: Vec::new(),
            },
            residual: 0.002,
        };
        let wire = known_body_to_wire(&known, &t);
        let back = known_body_from_wire(&wire, &t, "m").expect("same");
        assert_eq!((back.subject, &back.shape), (3, &known.shape));
        assert!((back.residual - known.residual).abs() < 1e-8);

        type Spoil = fn(&mut v1::KnownBody);
        fn shape(w: &mut v1::KnownBody) -> &mut v1::BodyShape {
            w.shape.as_mut().expect("given")
        }
        let faults: [(&str, Spoil); 10] = [
            ("subject", |w| w.subject = 0),
            ("template_name", |w| w.template_name = "other".into()),
            ("residual_mm", |w| w.residual_mm = f32::NAN),
            ("residual_mm", |w| w.residual_mm = -1.0),
            ("shape", |w| w.shape = None),
            ("shape.coefficients[0]", |w| {
                shape(w).coefficients = bulk::write_flat(&[f64::INFINITY]);
            }),
            ("shape.coefficients[0]", |w| {
                shape(w).coefficients = bulk::write_flat(&[8.5]);
            }),
            ("shape.bone_scales", |w| {
                shape(w).bone_scales = bulk::write_flat(&[1.0, 0.0, 1.0]);
            }),
            ("shape.bone_scales[2]", |w| {
                shape(w).bone_scales = bulk::write_flat(&[1.0, 1.0, 3.0]);
            }),
            ("shape.displacements[1]", |w| {
                shape(w).displacements = bulk::write_flat(&[0i16, 2001, 0, 0]);
            }),
        ];
        for (field, spoil) in faults {
            let mut w = wire.clone();
            spoil(&mut w);
            let refused = known_body_from_wire(&w, &t, "m").expect_err(field);
            assert_eq!(refused.field, format!("m.known_body.{field}"));
        }
    }

    #[test]
    fn faults_name_their_field() {
        let t = small_template();
        let fault = |change: &dyn Fn(&mut v1::BodyTemplate)| {
            let mut w = template_to_wire(&t);
            change(&mut w);
            template_from_wire(&w).expect_err("must be refused").field
        };
        assert_eq!(
            fault(&|w| w.vertex_count = u32::MAX),
            "body_template.vertex_count"
        );
        assert_eq!(
            fault(&|w| w.vertices = w.vertices.slice(..40)),
            "body_template.vertices"
        );
        assert_eq!(fault(&|w| w.face_count = 5), "body_template.faces");
        assert_eq!(
            fault(&|w| w.joints[1].kind = 77),
            "body_template.joints[1].kind"
        );
        assert_eq!(
            fault(&|w| w.joints[1].limits.clear()),
            "body_template.joints[1].limits"
        );
        assert_eq!(
            fault(&|w| w.joints[2].parent = Some(9)),
            "body_template.joints"
        );
        assert_eq!(
            fault(&|w| w.skin_joints = Bytes::from_static(&[9; 16])),
            "body_template"
        );
        assert_eq!(
            fault(&|w| w.shape_directions[0].joints = Bytes::new()),
            "body_template.shape_directions[0].joints"
        );
        let pose = v1::BodyPose {
            camera_from_body: Some(geometry::rigid_to_wire(&tryon_geometry::math::Rigid::<
                Camera,
                Camera,
            >::identity())),
            angles: bulk::write_flat(&[f64::NAN; 4]),
        };
        assert_eq!(
            pose_from_wire(&pose, 4).expect_err("NaN").field,
            "body_pose.angles[0]"
        );
        assert_eq!(
            pose_from_wire(&pose, 5).expect_err("size").field,
            "body_pose.angles"
        );
        let s = v1::BodyShape {
            displacements: Bytes::from_static(&[0; 6]),
            ..Default::default()
        };
        assert_eq!(
            shape_from_wire(&s, &t).expect_err("size").field,
            "body_shape.displacements"
        );
    }
}
