//! The implicit surface the figure is carved from: lofted tubes, ellipsoids, round cones, smooth unions and bumps.
//!
//! Only + − × ÷ and √ are used: the surface has the same bits on every machine.

use tryon_geometry::math::{P3d, V3d};

/// Numbers of a station: centre (u, w), radii (+u, −u, +w, −w), squareness (0 ellipse, 1 superellipse of order 4).
const CHANNELS: usize = 7;

/// A cross-section of a loft.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// Position along the axis, metres.
    pub t: f64,
    /// Centre (u, w), radii (+u, −u, +w, −w) in metres, squareness.
    pub c: [f64; CHANNELS],
}

impl Station {
    /// An ellipse with half axes `ru`, `rw` around (cu, cw).
    pub(super) fn ellipse(t: f64, cu: f64, cw: f64, ru: f64, rw: f64) -> Self {
        Self {
            t,
            c: [cu, cw, ru, ru, rw, rw, 0.0],
        }
    }
}

/// A right-handed orthonormal frame at a point; `a` is the axis of a loft.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub origin: P3d,
    pub u: V3d,
    pub w: V3d,
    pub a: V3d,
}

impl Frame {
    /// Axis from `from` towards `to`; `w` as near to `front` as it can be.
    pub(super) fn along(from: P3d, to: P3d, front: V3d) -> Self {
        let a = (to - from).normalize();
        let w = (front - a * front.dot(&a)).normalize();
        Self {
            origin: from,
            u: w.cross(&a),
            w,
            a,
        }
    }
    /// The world's axes at a point, axis up: u = x, w = z, a = y.
    pub(super) fn upright(origin: P3d) -> Self {
        Self {
            origin,
            u: V3d::x(),
            w: V3d::z(),
            a: V3d::y(),
        }
    }
    /// Local coordinates (u, w, along the axis).
    pub(super) fn local(&self, p: &P3d) -> V3d {
        let d = p - self.origin;
        V3d::new(d.dot(&self.u), d.dot(&self.w), d.dot(&self.a))
    }
    /// A point from local coordinates (u, w, along the axis).
    pub(super) fn point(&self, u: f64, w: f64, t: f64) -> P3d {
        self.origin + self.u * u + self.w * w + self.a * t
    }
}

/// A tube with varying, asymmetric sections along a straight axis, closed by ellipsoidal caps.
#[derive(Clone, Debug)]
pub(super) struct Loft {
    frame: Frame,
    stations: Vec<Station>,
    /// Change of the section per metre at each station.
    slopes: Vec<[f64; CHANNELS]>,
    caps: [f64; 2],
}

impl Loft {
    /// Stations in order along the axis, at least two; heights of the caps before the first and after the last, metres.
    pub(super) fn new(frame: Frame, stations: Vec<Station>, caps: [f64; 2]) -> Self {
        let n = stations.len();
        let secant = |i: usize, k: usize| {
            (stations[i + 1].c[k] - stations[i].c[k]) / (stations[i + 1].t - stations[i].t)
        };
        // Inside, the parabola through three points; at the ends, the chord.
        let slope = |i: usize, k: usize| match i {
            0 => secant(0, k),
            i if i + 1 == n => secant(i - 1, k),
            i => {
                let (l, r) = (
                    stations[i].t - stations[i - 1].t,
                    stations[i + 1].t - stations[i].t,
                );
                (secant(i - 1, k) * r + secant(i, k) * l) / (l + r)
            }
        };
        let slopes = (0..n)
            .map(|i| std::array::from_fn(|k| slope(i, k)))
            .collect();
        Self {
            frame,
            stations,
            slopes,
            caps,
        }
    }
    /// Section at `t`: a cubic Hermite through the stations.
    fn section(&self, t: f64) -> [f64; CHANNELS] {
        let s = &self.stations;
        let i = s[1..s.len() - 1].iter().take_while(|q| q.t <= t).count();
        let (p, q) = (&s[i], &s[i + 1]);
        let h = q.t - p.t;
        let x = (t - p.t) / h;
        let (x2, x3) = (x * x, x * x * x);
        let (b1, b2, b3) = (3.0 * x2 - 2.0 * x3, h * (x3 - 2.0 * x2 + x), h * (x3 - x2));
        let (m, n) = (&self.slopes[i], &self.slopes[i + 1]);
        std::array::from_fn(|k| p.c[k] + (q.c[k] - p.c[k]) * b1 + m[k] * b2 + n[k] * b3)
    }
    fn distance(&self, p: &P3d) -> f64 {
        let l = self.frame.local(p);
        let (t0, t1) = (self.stations[0].t, self.stations[self.stations.len() - 1].t);
        let tc = l.z.clamp(t0, t1);
        let c = self.section(tc);
        let (du, dw) = (l.x - c[0], l.y - c[1]);
        let ru = if du > 0.0 { c[2] } else { c[3] };
        let rw = if dw > 0.0 { c[4] } else { c[5] };
        let cap = if l.z < t0 { self.caps[0] } else { self.caps[1] };
        let (x, y, e) = (du / ru, dw / rw, (l.z - tc) / cap);
        let (x2, y2, e2) = (x * x, y * y, e * e);
        let r2 = (x2 + y2 + e2).sqrt();
        let r4 = (x2 * x2 + y2 * y2 + e2 * e2).sqrt().sqrt();
        let r = r2 + (r4 - r2) * c[6];
        let g = ((x2 / (ru * ru) + y2 / (rw * rw) + e2 / (cap * cap))
            / (r2 * r2).max(f64::MIN_POSITIVE))
        .sqrt();
        if r2 < CENTRE {
            return -ru.min(rw);
        }
        (r - 1.0) / g
    }
    fn bounds(&self) -> (P3d, P3d) {
        let mut lo = P3d::from(V3d::repeat(f64::INFINITY));
        let mut hi = P3d::from(V3d::repeat(f64::NEG_INFINITY));
        let last = self.stations.len() - 1;
        for (i, s) in self.stations.iter().enumerate() {
            let t0 = s.t - if i == 0 { self.caps[0] } else { 0.0 };
            let t1 = s.t + if i == last { self.caps[1] } else { 0.0 };
            for (u, w) in [
                (s.c[2], s.c[4]),
                (s.c[2], -s.c[5]),
                (-s.c[3], s.c[4]),
                (-s.c[3], -s.c[5]),
            ] {
                for t in [t0, t1] {
                    let q = self.frame.point(s.c[0] + u, s.c[1] + w, t);
                    lo = lo.inf(&q);
                    hi = hi.sup(&q);
                }
            }
        }
        (lo, hi)
    }
}

/// A solid.
#[derive(Clone, Debug)]
pub(super) enum FieldPrimitive {
    Loft(Loft),
    /// Axes of the frame with half lengths (u, w, a).
    Ellipsoid(Frame, V3d),
    /// Two points with a radius each.
    Cone([P3d; 2], [f64; 2]),
}

impl FieldPrimitive {
    fn distance(&self, p: &P3d) -> f64 {
        match self {
            Self::Loft(l) => l.distance(p),
            Self::Ellipsoid(f, r) => {
                let l = f.local(p).component_div(r);
                let k0 = l.norm();
                let k1 = l.component_div(r).norm();
                if k0 < CENTRE {
                    -r.min()
                } else {
                    k0 * (k0 - 1.0) / k1
                }
            }
            Self::Cone([a, b], [ra, rb]) => {
                let d = b - a;
                let t = ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
                (p - (a + d * t)).norm() - (ra + (rb - ra) * t)
            }
        }
    }
    fn bounds(&self) -> (P3d, P3d) {
        match self {
            Self::Loft(l) => l.bounds(),
            Self::Ellipsoid(f, r) => {
                let e = (f.u.abs() * r.x) + (f.w.abs() * r.y) + (f.a.abs() * r.z);
                (f.origin - e, f.origin + e)
            }
            Self::Cone([a, b], [ra, rb]) => {
                let (ea, eb) = (V3d::repeat(*ra), V3d::repeat(*rb));
                ((a - ea).inf(&(b - eb)), (a + ea).sup(&(b + eb)))
            }
        }
    }
}

/// A solid of the union.
#[derive(Clone, Debug)]
struct BlendedSolid {
    solid: FieldPrimitive,
    /// Blend radius, metres.
    blend: f64,
    bounds: (P3d, P3d),
}

/// A smooth swelling (or dent, when negative) of limited reach.
#[derive(Clone, Debug)]
struct Bump {
    frame: Frame,
    radii: V3d,
    height: f64,
    /// Square of the largest radius.
    reach: f64,
}

/// The figure's left half (x ≥ 0), mirrored: negative inside.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    solids: Vec<BlendedSolid>,
    bumps: Vec<Bump>,
}

/// Smooth minimum with twice continuous joins: differs from `min` only where |a − b| < k.
fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * h * k / 6.0
}

impl Field {
    /// Adds a solid, blended over `blend` metres.
    pub(super) fn add(&mut self, solid: FieldPrimitive, blend: f64) {
        let bounds = solid.bounds();
        self.solids.push(BlendedSolid {
            solid,
            blend,
            bounds,
        });
    }
    pub(super) fn cone(&mut self, a: P3d, b: P3d, ra: f64, rb: f64, blend: f64) {
        self.add(FieldPrimitive::Cone([a, b], [ra, rb]), blend);
    }
    pub(super) fn ellipsoid(&mut self, c: impl Into<P3d>, r: [f64; 3], blend: f64) {
        // Frame::upright stores (u, w, a) = (x, z, y).
        self.add(
            FieldPrimitive::Ellipsoid(Frame::upright(c.into()), V3d::new(r[0], r[2], r[1])),
            blend,
        );
    }
    /// Raises the surface by about `height` metres at `c`, fading out at the radii (x, y, z).
    pub(super) fn bump(&mut self, c: impl Into<P3d>, r: [f64; 3], height: f64) {
        self.bump_in(Frame::upright(c.into()), [r[0], r[2], r[1]], height);
    }
    /// The same in a given frame, radii (u, w, along the axis).
    pub(super) fn bump_in(&mut self, frame: Frame, r: [f64; 3], height: f64) {
        let radii = V3d::from(r);
        self.bumps.push(Bump {
            frame,
            radii,
            height,
            reach: radii.max() * radii.max(),
        });
    }
    /// Signed distance estimate, metres; near the surface its gradient is about one.
    pub(super) fn value(&self, at: &P3d) -> f64 {
        let p = P3d::new(at.x.abs(), at.y, at.z);
        let mut d = f64::INFINITY;
        for part in &self.solids {
            let (lo, hi) = &part.bounds;
            let lower = (lo - p).sup(&(p - hi)).sup(&V3d::zeros()).norm_squared();
            // smooth_min changes nothing beyond d + blend; the factor covers the estimate's error.
            let reach = 1.5 * (d + part.blend);
            if d < f64::INFINITY && reach > 0.0 && lower > reach * reach {
                continue;
            }
            let e = part.solid.distance(&p);
            d = if d == f64::INFINITY {
                e
            } else {
                smooth_min(d, e, part.blend)
            };
        }
        for b in &self.bumps {
            if (p - b.frame.origin).norm_squared() > b.reach {
                continue;
            }
            let l = b.frame.local(&p).component_div(&b.radii);
            let q = 1.0 - l.norm_squared();
            if q > 0.0 {
                d -= b.height * q * q * q;
            }
        }
        d
    }
    /// Gradient by forward differences from `value` at `p`.
    fn gradient(&self, p: &P3d, value: f64) -> V3d {
        /// Step, metres: far below the smallest feature (a fingertip), far above rounding.
        const H: f64 = 1e-4;
        let d = |v: V3d| (self.value(&(p + v)) - value) / H;
        V3d::new(d(V3d::x() * H), d(V3d::y() * H), d(V3d::z() * H))
    }
    /// Moves a point onto the surface along the gradient; a point on the plane x = 0 stays on it.
    pub(super) fn project(&self, p: &P3d, steps: usize) -> P3d {
        let mut q = *p;
        for _ in 0..steps {
            let v = self.value(&q);
            if v.abs() < ON_SURFACE {
                break;
            }
            let mut g = self.gradient(&q, v);
            if p.x == 0.0 {
                g.x = 0.0;
            }
            let n2 = g.norm_squared();
            if n2 < 0.01 {
                break;
            }
            // Near creases the estimate overshoots.
            let step = g * (v / n2);
            q -= step * (MAX_STEP / step.norm().max(MAX_STEP));
        }
        q
    }
}

/// Relative distance from the middle of a section below which the outward direction is undefined.
const CENTRE: f64 = 1e-9;
/// Distance from the surface at which projection ends, metres.
const ON_SURFACE: f64 = 2e-5;
/// Longest projection step, metres.
const MAX_STEP: f64 = 0.012;
