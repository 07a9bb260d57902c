//! From one body to another: what lies near the skin of the first comes to lie as near to the skin of the second.
//!
//! Bones carry it first, each turned, stretched to the other's length and widened to its girth; then what is still between
//! the two skins is added, smoothed over the first one.

use super::figure::Figure;
use super::made_on::MadeOn;
use crate::body::Template;
use crate::body::parts::vertex_masks;
use crate::garment::Region;
use crate::math::{P3, P3d, V3, V3d};
use crate::mesh::vertex_normals;
use crate::par::Par;
use crate::spatial::PointTree;
use nalgebra::{Matrix3, UnitQuaternion};

/// x ↦ to + m (x − from).
#[derive(Clone, Copy, Debug)]
struct Bone {
    m: Matrix3<f64>,
    from: P3d,
    to: P3d,
}

/// From the body that a garment was made on to the one that it is put on.
#[derive(Clone, Debug)]
pub(super) struct Carrier {
    /// Shape `[joints of the first body]`.
    bones: Vec<Bone>,
    /// What bones leave to do, metres, shape `[vertices of the first body]`.
    rest: Vec<V3d>,
}

/// Skin of the second body further than this from where the bones put the first says nothing, metres: a belly.
const REACH: f32 = 0.15;
/// Skins that face each other with a smaller cosine are not the same skin.
const SAME_SIDE: f32 = 0.3;
/// A step along the normal that keeps the other side of a limb further away, metres.
const STEP: f32 = 0.04;
/// Rounds of smoothing of what bones leave to do, the first and the second time. An edge of 1 cm a round.
const SMOOTHING: [usize; 2] = [30, 8];

impl Carrier {
    pub(super) fn new(made_on: &MadeOn, template: &Template, figure: &Figure) -> Self {
        let source = &*made_on.template;
        let bones = bones(source, template, figure);
        let n = source.mesh().vertices().len();
        let mut out = Self {
            bones,
            rest: vec![V3d::zeros(); n],
        };
        let parts = vertex_masks(source);
        let mut normals = Vec::new();
        let faces = template.mesh().faces();
        vertex_normals(
            Par::Rayon,
            &figure.vertices,
            faces,
            template.topology().vertex_faces(),
            &mut normals,
        );
        let skins: Vec<(Region, Vec<usize>, PointTree)> = [
            Region::TRUNK,
            Region::LEFT_ARM,
            Region::RIGHT_ARM,
            Region::LEFT_LEG,
            Region::RIGHT_LEG,
        ]
        .into_iter()
        .map(|part| {
            let own: Vec<usize> = (0..figure.parts.len())
                .filter(|i| figure.parts[*i] & part.0 != 0)
                .collect();
            let points: Vec<P3> = own
                .iter()
                .map(|i| figure.vertices[*i] + normals[*i] * STEP)
                .collect();
            (part, own, PointTree::new(&points))
        })
        .collect();
        for rounds in SMOOTHING {
            let carried: Vec<P3> = (0..n).map(|i| out.skin_vertex(source, i)).collect();
            let mut own = Vec::new();
            vertex_normals(
                Par::Rayon,
                &carried,
                source.mesh().faces(),
                source.topology().vertex_faces(),
                &mut own,
            );
            let mut more: Vec<Option<V3d>> = (0..n)
                .map(|i| {
                    let (_, index, tree) = skins.iter().find(|(p, ..)| parts[i] & p.0 != 0)?;
                    let (k, _) = tree.nearest(&(carried[i] + own[i] * STEP), REACH)?;
                    let (q, m) = (figure.vertices[index[k]], normals[index[k]]);
                    // Only across the skin: along it the bones know better.
                    (m.dot(&own[i]) > SAME_SIDE).then(|| (m * m.dot(&(q - carried[i]))).cast())
                })
                .collect();
            for _ in 0..rounds {
                more = (0..n)
                    .map(|i| {
                        let around = source
                            .topology()
                            .vertex_neighbours()
                            .row(i)
                            .iter()
                            .map(|v| *v as usize);
                        let known = around.chain([i]).filter_map(|v| more[v]);
                        let (sum, count) =
                            known.fold((V3d::zeros(), 0.0), |(s, c), d| (s + d, c + 1.0));
                        (count > 0.0).then(|| sum / count)
                    })
                    .collect();
            }
            out.rest
                .iter_mut()
                .zip(&more)
                .for_each(|(r, m)| *r += m.unwrap_or_else(V3d::zeros));
        }
        out
    }
    fn skin_vertex(&self, source: &Template, i: usize) -> P3 {
        let w = source.weights();
        let row = (0..4).map(|k| (usize::from(w.joints[i][k]), f64::from(w.weights[i][k])));
        P3::from((self.by_bones(&source.mesh().vertices()[i], row) + self.rest[i]).cast::<f32>())
    }
    fn by_bones(&self, p: &P3, weights: impl Iterator<Item = (usize, f64)>) -> V3d {
        let p: P3d = p.cast();
        weights
            .filter(|w| w.1 > 0.0)
            .fold(V3d::zeros(), |s, (j, w)| {
                let b = &self.bones[j];
                s + (b.to.coords + b.m * (p - b.from)) * w
            })
    }
    /// Where a point goes that hangs on bones with these weights and over these vertices of the first skin.
    pub(super) fn point(&self, p: &P3, weights: &[f32], over: &[(u32, f32)]) -> P3 {
        let moved = self.by_bones(
            p,
            weights.iter().enumerate().map(|(j, w)| (j, f64::from(*w))),
        );
        let rest = over.iter().fold(V3d::zeros(), |s, (v, w)| {
            s + self.rest[*v as usize] * f64::from(*w)
        });
        P3::from((moved + rest).cast::<f32>())
    }
}

/// How each bone of the first body lies on the second.
fn bones(source: &Template, template: &Template, figure: &Figure) -> Vec<Bone> {
    let sk = source.skeleton();
    let from = |n: &str| sk.index(n).map(|j| sk.joints()[j].rest);
    let to = |n: &str| template.skeleton().index(n).map(|j| figure.joints[j]);
    let middle = |at: &dyn Fn(&str) -> Option<P3d>, n: &str| {
        Some(nalgebra::center(
            &at(&format!("left_{n}"))?,
            &at(&format!("right_{n}"))?,
        ))
    };
    let apart = |at: &dyn Fn(&str) -> Option<P3d>, n: &str| {
        Some((at(&format!("left_{n}"))? - at(&format!("right_{n}"))?).norm())
    };
    let ratio = |a: Option<f64>, b: Option<f64>| match (a, b) {
        // Bodies differ by less than this.
        (Some(a), Some(b)) if a > 1e-3 => (b / a).clamp(0.5, 2.0),
        _ => 1.0,
    };
    // The trunk is one bone: where its joints sit along the spine differs between skeletons, hips and shoulders don't.
    let (hips, shoulders) = (
        [middle(&from, "hip"), middle(&to, "hip")],
        [middle(&from, "shoulder"), middle(&to, "shoulder")],
    );
    let height = |k: usize| Some((shoulders[k]? - hips[k]?).y);
    let (wide, high) = (
        ratio(apart(&from, "shoulder"), apart(&to, "shoulder")),
        ratio(height(0), height(1)),
    );
    let trunk = Bone {
        m: Matrix3::from_diagonal(&V3d::new(wide, high, wide)),
        from: hips[0].unwrap_or_else(P3d::origin),
        to: hips[1].unwrap_or_else(P3d::origin),
    };
    let girth = |template: &Template, vertices: &[P3], joint: &str, a: P3d, b: P3d| {
        let j = template.skeleton().index(joint)?;
        let u = (b - a).try_normalize(0.0)?;
        let (sum, count) = (0..vertices.len())
            .filter(|i| template.weights().dominant(*i) == j)
            .map(|i| {
                let d: V3d = vertices[i].cast::<f64>() - a;
                (d - u * u.dot(&d)).norm()
            })
            .fold((0.0, 0.0), |(s, c), r| (s + r, c + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let head = {
        let tall = |at: &dyn Fn(&str) -> Option<P3d>| Some((at("head_end")? - at("head")?).norm());
        let s = ratio(tall(&from), tall(&to));
        let neck = from("head").zip(to("head"));
        neck.map(|(from, to)| Bone {
            m: Matrix3::identity() * s,
            from,
            to,
        })
    };
    let mut out: Vec<Bone> = Vec::with_capacity(sk.len());
    for joint in sk.joints() {
        let name = joint.name.as_str();
        let above = joint.parent.map(|p| out[p]);
        let side = name.split_once('_').map_or("", |(s, _)| s);
        let part = name.split_once('_').map_or("", |(_, p)| p);
        let bone = match part {
            "shoulder" | "elbow" | "hip" | "knee" => {
                let next =
                    ["elbow", "wrist", "knee", "ankle"][["shoulder", "elbow", "hip", "knee"]
                        .iter()
                        .position(|p| *p == part)
                        .unwrap_or(0)];
                let end = format!("{side}_{next}");
                (|| {
                    let (a, b) = (from(name)?, from(&end)?);
                    let (c, d) = (to(name)?, to(&end)?);
                    let (u, v) = ((b - a).try_normalize(0.0)?, (d - c).try_normalize(0.0)?);
                    let along = ratio(Some((b - a).norm()), Some((d - c).norm()));
                    let around = ratio(
                        girth(source, source.mesh().vertices(), name, a, b),
                        girth(template, &figure.vertices, name, c, d),
                    );
                    let q = UnitQuaternion::rotation_between(&u, &v)?.to_rotation_matrix();
                    let stretch =
                        Matrix3::identity() * around + u * u.transpose() * (along - around);
                    Some(Bone {
                        m: q.matrix() * stretch,
                        from: a,
                        to: c,
                    })
                })()
            }
            // Hands keep their size and turn with the forearm; feet stand as they stood.
            "wrist" => from(name).zip(to(name)).zip(above).map(|((from, to), b)| {
                let turn = UnitQuaternion::from_matrix(&b.m).to_rotation_matrix();
                Bone {
                    m: *turn.matrix(),
                    from,
                    to,
                }
            }),
            "ankle" => (|| {
                let foot = format!("{side}_foot");
                let s = ratio(
                    Some((from(&foot)? - from(name)?).norm()),
                    Some((to(&foot)? - to(name)?).norm()),
                );
                Some(Bone {
                    m: Matrix3::identity() * s,
                    from: from(name)?,
                    to: to(name)?,
                })
            })(),
            _ if name == "head" => head,
            _ if name == "neck"
                || part == "collar"
                || name.starts_with("spine")
                || joint.parent.is_none() =>
            {
                None
            }
            _ => above,
        };
        out.push(bone.unwrap_or(trunk));
    }
    out
}

/// Vertices of a skin with shares.
type Over = Vec<(u32, f32)>;

/// Points over the skin of a body: which vertices they lie over and what they hang on.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Bound {
    /// Vertices of the skin with shares, shape `[points]`.
    pub(super) over: Vec<Over>,
    /// Weights of all joints, shape `[points][joints]`.
    pub(super) weights: Vec<Vec<f32>>,
    /// Distance from the nearest vertex of the skin, metres.
    pub(super) far: Vec<f32>,
    /// Outward normal of the skin there.
    pub(super) normal: Vec<V3>,
}

/// Rounds of averaging over the garment: a nearest vertex jumps, cloth doesn't.
const ROUNDS: usize = 6;
/// Cloth further than this from the skin, a skirt between the legs, is averaged over more of it, metres.
const LOOSE: f32 = 0.04;
/// Rounds for that.
const LOOSE_ROUNDS: usize = 30;

/// Binds garment vertices (frame of the body, metres) to a body; `neighbours` along the garment's edges.
pub(super) fn bind(
    template: &Template,
    points: &[P3],
    neighbours: impl Fn(usize) -> Vec<u32>,
) -> Bound {
    let body = template.mesh().vertices();
    let mut normals = Vec::new();
    vertex_normals(
        Par::Rayon,
        body,
        template.mesh().faces(),
        template.topology().vertex_faces(),
        &mut normals,
    );
    let tree = PointTree::new(body);
    let joints = template.skeleton().len();
    let mut out = Bound::default();
    for p in points {
        let (near, d2) = tree.nearest(p, 100.0).unwrap_or((0, 0.0));
        let mut row = vec![0.0f32; joints];
        let w = template.weights();
        for k in 0..4 {
            row[usize::from(w.joints[near][k])] += w.weights[near][k];
        }
        out.over.push(vec![(near as u32, 1.0)]);
        out.weights.push(row);
        out.far.push(d2.sqrt());
        out.normal.push(normals[near]);
    }
    let around: Vec<Vec<u32>> = (0..points.len()).map(neighbours).collect();
    for round in 0..ROUNDS + LOOSE_ROUNDS {
        let busy = |i: usize| round < ROUNDS || out.far[i] > LOOSE;
        let next: Vec<Option<(Vec<f32>, Over)>> = (0..points.len())
            .map(|i| {
                if !busy(i) || around[i].is_empty() {
                    return None;
                }
                let share = 0.5 / around[i].len() as f32;
                let mut row: Vec<f32> = out.weights[i].iter().map(|w| 0.5 * w).collect();
                let mut over: std::collections::BTreeMap<u32, f32> =
                    std::collections::BTreeMap::new();
                out.over[i]
                    .iter()
                    .for_each(|(v, w)| *over.entry(*v).or_default() += 0.5 * w);
                for n in around[i].iter().map(|n| *n as usize) {
                    row.iter_mut()
                        .zip(&out.weights[n])
                        .for_each(|(a, b)| *a += share * b);
                    out.over[n]
                        .iter()
                        .for_each(|(v, w)| *over.entry(*v).or_default() += share * w);
                }
                // Few enough to stay cheap: the heaviest, made to sum to one.
                let mut over: Vec<(u32, f32)> = over.into_iter().collect();
                over.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
                over.truncate(MOST_OVER);
                let sum: f32 = over.iter().map(|o| o.1).sum();
                over.iter_mut()
                    .for_each(|o| o.1 /= sum.max(f32::MIN_POSITIVE));
                Some((row, over))
            })
            .collect();
        for (i, n) in next.into_iter().enumerate() {
            if let Some((row, over)) = n {
                out.weights[i] = row;
                out.over[i] = over;
            }
        }
    }
    out
}

/// Vertices of the skin that a point lies over, at most.
const MOST_OVER: usize = 16;
