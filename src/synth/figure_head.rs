//! Head of a display figure: features smoothed away, hair in a knot.

use super::base_layer::BaseLayer;
use super::rest_pose::{ramp, rest_joint};
use super::settings::FigureSettings;
use tryon_body::parts::BodySegment;
use tryon_body::{RestBody, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::smoothing::smoothed;
use tryon_geometry::par::Par;

/// Gives a rest body the head of a figure. Joints and limbs stay.
pub(super) fn sculpt(template: &Template, rest: &mut RestBody, settings: &FigureSettings) {
    let head = FigureHead::of(template, rest);
    let displaced = rest.vertices.iter().zip(&rest.base);
    let displacements: Vec<V3> = displaced.map(|(p, base)| p - base).collect();
    let points = rest.base.iter().enumerate();
    let on_egg: Vec<f32> = points.map(|(i, p)| head.share(template, i, p)).collect();
    smooth(template, &mut rest.base, settings.smoothing, |i, _| {
        on_egg[i]
    });
    for (p, share) in rest.base.iter_mut().zip(&on_egg) {
        *p = P3::from(p.coords.lerp(&head.on_egg(p), *share));
    }
    smooth(template, &mut rest.base, settings.jaw, |_, p| head.jaw(p));

    rest.normals = template.normals(&rest.base);
    let [hair, knot] = settings.thickness;
    for i in 0..rest.base.len() {
        let p = rest.base[i];
        let thickness = hair * ramp(head.hair(&p), -0.002, 0.010) + knot * head.knot(&p);
        rest.base[i] += rest.normals[i] * (thickness * ramp(head_share(template, i), 0.3, 0.6));
    }
    // Fitted cloth spans the hollows of the skin.
    let cut = BaseLayer::new(template, rest);
    smooth(template, &mut rest.base, settings.span, |_, p| {
        ramp(cut.top(p).max(cut.leggings(p)), 0.0, 0.03)
    });
    rest.normals = template.normals(&rest.base);
    let displaced = rest.base.iter().zip(&displacements);
    rest.vertices = displaced.map(|(base, d)| base + d).collect();
}

/// Skinning weight of a vertex on the joints of the head.
pub(super) fn head_share(template: &Template, vertex: usize) -> f32 {
    let (weights, parts) = (template.weights(), template.parts());
    let joints = weights.joints[vertex].iter().zip(&weights.weights[vertex]);
    let is_head = |joint: u8| parts.segment(usize::from(joint)) == BodySegment::Head;
    let of_head = joints.filter(|(joint, _)| is_head(**joint));
    of_head.map(|(_, w)| *w).sum()
}

/// Smooths vertices in a number of passes, each by its share.
fn smooth(template: &Template, vertices: &mut [P3], passes: usize, by: impl Fn(usize, &P3) -> f32) {
    let around = template.topology().vertex_neighbours();
    let mut soft: Vec<V3> = vertices.iter().map(|p| p.coords).collect();
    for _ in 0..passes {
        soft = smoothed(Par::Seq, around, &soft);
    }
    for (i, (p, soft)) in vertices.iter_mut().zip(soft).enumerate() {
        *p = P3::from(p.coords.lerp(&soft, by(i, p)));
    }
}

/// Egg of a head without features.
pub(super) struct FigureHead {
    /// Middle of the skull, metres.
    middle: V3,
    /// Half width, half height and half depth, metres.
    half: V3,
}

/// Half width and half depth of the skull, share of its half height: mean adult heads without ears and nose.
const SKULL: [f32; 2] = [0.70, 0.87];
/// Length from crown to chin over that from crown to the joint of the head.
const LENGTH: f32 = 1.44;
/// Middle of the skull before the joint of the head (m).
const AHEAD: f32 = 0.005;
/// Taper of the egg towards the chin: of its width, and of its depth behind; and the chin's shift to the front.
const TAPER: [f32; 3] = [0.34, 0.50, 0.10];
/// Middle of the face on the egg: height, and half width and height of its oval.
const FACE: [f32; 3] = [-0.30, 0.84, 0.98];
/// Depth of the ears on the egg: all behind is hair.
const EARS: f32 = -0.05;
/// Height of the hairline at the nape on the egg.
const NAPE: f32 = -0.55;
/// Direction of the knot from the middle, and the cosine at which it begins.
const KNOT: [f32; 3] = [0.0, 0.05, -1.0];
const KNOT_EDGE: f32 = 0.90;
/// Bisections of the way to the egg, from 0 to 2 half heights: 0.1 mm.
const BISECTIONS: usize = 12;

impl FigureHead {
    /// Egg of a body with a head of its own or of a figure.
    pub(super) fn of(template: &Template, rest: &RestBody) -> Self {
        let skull = rest_joint(template, rest, "head");
        let crown = rest.base.iter().map(|p| p.y).fold(skull.y, f32::max);
        let half = 0.5 * LENGTH * (crown - skull.y).max(f32::EPSILON);
        let [width, depth] = SKULL;
        Self {
            middle: V3::new(0.0, crown - half, skull.z + AHEAD),
            half: half * V3::new(width, 1.0, depth),
        }
    }

    /// Share of a vertex that is on the egg: of the head's skin, and of the chin's, which moves with the neck.
    fn share(&self, template: &Template, vertex: usize, p: &P3) -> f32 {
        let q = self.local(&p.coords);
        let chin = ramp(q.z, 0.3, 0.6) * ramp(q.y, -1.15, -0.95);
        chin.max(ramp(head_share(template, vertex), 0.15, 0.75))
    }

    /// Share of a vertex that is between egg and neck.
    fn jaw(&self, p: &P3) -> f32 {
        let y = self.local(&p.coords).y;
        ramp(y, -1.6, -1.1) * ramp(-y, 0.45, 0.75)
    }

    /// Position on the unit head: x to the side, y up, z to the front.
    fn local(&self, p: &V3) -> V3 {
        (p - self.middle).component_div(&self.half)
    }

    /// Point of the egg in the direction of `p` from its middle, metres.
    fn on_egg(&self, p: &P3) -> V3 {
        let d = (p.coords - self.middle).normalize() * self.half.y;
        let (mut inside, mut outside) = (0.0f32, 2.0f32);
        for _ in 0..BISECTIONS {
            let t = 0.5 * (inside + outside);
            if egg(&self.local(&(self.middle + d * t))) < 1.0 {
                inside = t;
            } else {
                outside = t;
            }
        }
        self.middle + d * inside
    }

    /// Signed distance from the hairline, positive in the hair, metres.
    pub(super) fn hair(&self, p: &P3) -> f32 {
        let q = self.local(&p.coords);
        let [face, width, height] = FACE;
        let oval = ((q.x / width).hypot((q.y - face) / height) - 1.0) * self.half.x;
        let above_nape = (q.y - NAPE - 0.5 * (q.z + 1.0).max(0.0)) * self.half.y;
        let behind = (EARS - q.z) * self.half.z;
        oval.max(behind).min(above_nape)
    }

    /// Share of the knot's height at a point: 1 in its middle.
    fn knot(&self, p: &P3) -> f32 {
        let cosine = self
            .local(&p.coords)
            .normalize()
            .dot(&V3::from(KNOT).normalize());
        ramp(cosine, KNOT_EDGE, 1.0)
    }
}

/// Below 1 within the unit egg.
fn egg(q: &V3) -> f32 {
    let [width, behind, chin] = TAPER;
    let low = ramp(-q.y, 0.0, 1.3);
    let x = q.x / (1.0 - width * low);
    let z = q.z - chin * low;
    let z = if z < 0.0 { z / (1.0 - behind * low) } else { z };
    x * x + q.y * q.y + z * z
}
