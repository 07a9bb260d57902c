//! Triangles of a sheet with their place in the sums over vertices and vertex pairs.

use super::ElasticExpansion;
use super::packed::Packed;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::{Csr, Face};
use tryon_geometry::par::{Par, for_chunks, map_into};

/// Elements and sums evaluated by one task.
pub(super) const CHUNK: usize = 256;

/// One entry of a sum over elements.
#[derive(Clone, Copy, Debug, Default)]
struct Term {
    element: u32,
    /// Corner, or block of the packed expansion.
    slot: u16,
    transposed: bool,
}

/// Triangles and the lists that sum their expansions.
#[derive(Clone, Debug)]
pub(super) struct ElementSet {
    faces: Vec<Face>,
    gradient: Csr<Term>,
    diagonal: Csr<Term>,
    off_diagonal: Csr<Term>,
}

impl ElementSet {
    /// Triangles on `count` vertices; `pairs` is sorted and holds all their edges.
    pub(super) fn new(faces: Vec<Face>, count: usize, pairs: &[[u32; 2]]) -> Self {
        let (mut gradient, mut diagonal, mut off_diagonal) = (Vec::new(), Vec::new(), Vec::new());
        for (element, v) in faces.iter().enumerate() {
            let term = |slot: usize, transposed| Term {
                element: element as u32,
                slot: slot as u16,
                transposed,
            };
            let mut slot = 0;
            for i in 0..3 {
                gradient.push((v[i], term(i, false)));
                diagonal.push((v[i], term(slot, false)));
                slot += 1;
                for j in i + 1..3 {
                    if let Ok(row) = pairs.binary_search(&[v[i].min(v[j]), v[i].max(v[j])]) {
                        off_diagonal.push((row as u32, term(slot, v[i] > v[j])));
                    }
                    slot += 1;
                }
            }
        }
        Self {
            faces,
            gradient: Csr::from_pairs(count, &gradient),
            diagonal: Csr::from_pairs(count, &diagonal),
            off_diagonal: Csr::from_pairs(pairs.len(), &off_diagonal),
        }
    }
    /// Vertices of an element.
    pub(super) fn vertices(&self, element: usize) -> &Face {
        &self.faces[element]
    }
    /// Corner positions of an element.
    pub(super) fn corners(&self, element: usize, x: &[V3d]) -> [V3d; 3] {
        self.faces[element].map(|v| x[v as usize])
    }
    /// Adds the expansions of the elements, evaluated one by one by `expand`, to the sums.
    pub(super) fn assemble(
        &self,
        par: Par,
        buffer: &mut Vec<Packed>,
        out: &mut ElasticExpansion,
        expand: impl Fn(usize) -> Packed + Sync,
    ) {
        map_into(par, self.faces.len(), CHUNK, buffer, expand);
        out.value += buffer.iter().map(|e| e.value).sum::<f64>();
        let buffer = &*buffer;
        let block = |t: &Term| {
            let b = &buffer[t.element as usize].blocks[t.slot as usize];
            if t.transposed { b.transpose() } else { *b }
        };
        for_chunks(par, &mut out.gradient, CHUNK, |start, chunk| {
            for (k, g) in chunk.iter_mut().enumerate() {
                for t in self.gradient.row(start + k) {
                    *g += buffer[t.element as usize].gradient[t.slot as usize];
                }
            }
        });
        for (terms, sums) in [
            (&self.diagonal, &mut out.diagonal),
            (&self.off_diagonal, &mut out.off_diagonal),
        ] {
            for_chunks(par, sums, CHUNK, |start, chunk| {
                for (k, sum) in chunk.iter_mut().enumerate() {
                    for t in terms.row(start + k) {
                        *sum += block(t);
                    }
                }
            });
        }
    }
}
