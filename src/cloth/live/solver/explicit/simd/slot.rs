//! Indices of vertices in the kernels' arrays.

use crate::live::solver::explicit::vec4::{MAX_VERTICES, V4};

/// Number of floats that are computed together.
pub(in super::super) const LANES: usize = 8;
/// Slots of eight vertices.
pub(in super::super) type Slots = [Slot; LANES];

/// Index of a vertex in an array of [`MAX_VERTICES`] vectors, stored doubled: the processor scales an address by eight
/// for free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(in super::super) struct Slot(u16);

impl Slot {
    /// Slot of vertex `i`, below [`MAX_VERTICES`].
    pub(in super::super) fn new(i: usize) -> Self {
        assert!(i < MAX_VERTICES, "vertex {i} is beyond a patch's capacity");
        Self(2 * i as u16)
    }
    /// Number of the vertex.
    #[inline(always)]
    pub(in super::super) fn index(self) -> usize {
        usize::from(self.0 / 2)
    }
    /// Offset of its vector from the array's start, bytes.
    #[inline(always)]
    pub(super) fn byte_offset(self) -> usize {
        8 * usize::from(self.0)
    }
    /// Its vector.
    // Sound: half of the number, below MAX_VERTICES by construction, is an index.
    #[allow(unsafe_code)]
    #[inline(always)]
    pub(in super::super) fn get(self, x: &[V4; MAX_VERTICES]) -> V4 {
        unsafe { *x.as_ptr().cast::<u8>().add(self.byte_offset()).cast::<V4>() }
    }
    /// Replaces its vector.
    #[allow(unsafe_code)]
    #[inline(always)]
    pub(in super::super) fn set(self, x: &mut [V4; MAX_VERTICES], to: V4) {
        unsafe {
            *x.as_mut_ptr()
                .cast::<u8>()
                .add(self.byte_offset())
                .cast::<V4>() = to
        }
    }
}
