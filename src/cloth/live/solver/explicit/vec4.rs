//! Four-float vectors and the arrays that kernels index without bounds checks.

use tryon_geometry::math::{P3, V3d};

/// Vector of four floats that load at once: x, y, z and a spare lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct V4(pub [f32; 4]);

impl V4 {
    /// Vector of three components.
    #[inline(always)]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        Self([x, y, z, 0.0])
    }
    /// The first three components as a point.
    #[inline(always)]
    pub fn point(self) -> P3 {
        P3::new(self.0[0], self.0[1], self.0[2])
    }
    /// The first three components in double precision.
    pub fn to_f64(self) -> V3d {
        V3d::new(
            f64::from(self.0[0]),
            f64::from(self.0[1]),
            f64::from(self.0[2]),
        )
    }
    /// Inner product of the first three components.
    #[inline(always)]
    pub fn dot(self, o: Self) -> f32 {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }
    /// All lanes times a number.
    #[inline(always)]
    pub fn scale(self, s: f32) -> Self {
        Self(self.0.map(|c| c * s))
    }
}

impl From<V3d> for V4 {
    fn from(v: V3d) -> Self {
        Self::new(v.x as f32, v.y as f32, v.z as f32)
    }
}

impl std::ops::Add for V4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self([
            self.0[0] + o.0[0],
            self.0[1] + o.0[1],
            self.0[2] + o.0[2],
            self.0[3] + o.0[3],
        ])
    }
}

impl std::ops::Sub for V4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self([
            self.0[0] - o.0[0],
            self.0[1] - o.0[1],
            self.0[2] - o.0[2],
            self.0[3] - o.0[3],
        ])
    }
}

/// Most vertices of a patch: a slot has 15 bits.
pub(super) const MAX_VERTICES: usize = 1 << 15;
/// Mask of a slot number: a masked index needs no bounds check.
pub(super) const SLOT_MASK: usize = MAX_VERTICES - 1;
/// Stagger between arrays [vectors], beside whole pages. A load that shares the last 12 address bits with a recent
/// store stalls (4K aliasing).
const STAGGER: usize = 72;

/// Array of one vector for every slot.
#[derive(Clone, Debug)]
pub(super) struct SlotArray {
    storage: Vec<V4>,
    offset: usize,
}

impl SlotArray {
    /// Array number `index` of those that kernels use together.
    pub(super) fn new(index: usize) -> Self {
        // Zeroed pages are mapped on first use, so a small patch costs less than a large one.
        let offset = index * STAGGER;
        Self {
            storage: vec![V4::default(); MAX_VERTICES + offset],
            offset,
        }
    }
}

impl std::ops::Deref for SlotArray {
    type Target = [V4; MAX_VERTICES];
    #[inline(always)]
    fn deref(&self) -> &[V4; MAX_VERTICES] {
        self.storage[self.offset..]
            .first_chunk()
            .expect("allocated with this length")
    }
}

impl std::ops::DerefMut for SlotArray {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [V4; MAX_VERTICES] {
        self.storage[self.offset..]
            .first_chunk_mut()
            .expect("allocated with this length")
    }
}
