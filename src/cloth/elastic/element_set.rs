//! Elements of one kind with their place in the sums over vertices and vertex pairs.

use super::ElasticExpansion;
use super::packed::Packed;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Csr;
use tryon_geometry::par::{Par, map_into};

/// Vertex index of a corner that an element lacks.
pub(super) const ABSENT: u32 = u32::MAX;
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

/// Vertices of the elements of one kind and the lists that sum their expansions.
#[derive(Clone, Debug)]
pub(super) struct ElementSet<const K: usize, const P: usize> {
    vertices: Vec<[u32; K]>,
    gradient: Csr<Term>,
    diagonal: Csr<Term>,
    off_diagonal: Csr<Term>,
}

/// Pairs of different vertices that share an element, smaller first, with repetitions.
pub(super) fn pairs_of<const K: usize>(elements: &[[u32; K]]) -> Vec<[u32; 2]> {
    let mut out = Vec::new();
    for v in elements {
        for i in 0..K {
            for j in i + 1..K {
                if v[i] != ABSENT && v[j] != ABSENT && v[i] != v[j] {
                    out.push([v[i].min(v[j]), v[i].max(v[j])]);
                }
            }
        }
    }
    out
}

impl<const K: usize, const P: usize> ElementSet<K, P> {
    /// Elements on these vertices; `pairs` is sorted and holds all of [`pairs_of`].
    pub(super) fn new(vertices: Vec<[u32; K]>, count: usize, pairs: &[[u32; 2]]) -> Self {
        let (mut gradient, mut diagonal, mut off_diagonal) = (Vec::new(), Vec::new(), Vec::new());
        for (element, v) in vertices.iter().enumerate() {
            let term = |slot: usize, transposed| Term {
                element: element as u32,
                slot: slot as u16,
                transposed,
            };
            let mut p = 0;
            for i in 0..K {
                if v[i] != ABSENT {
                    gradient.push((v[i], term(i, false)));
                }
                for j in i..K {
                    let slot = p;
                    p += 1;
                    if v[i] == ABSENT || v[j] == ABSENT {
                        continue;
                    }
                    if v[i] == v[j] {
                        diagonal.push((v[i], term(slot, false)));
                        // A vertex at two corners: both mixed blocks are on its diagonal.
                        if i != j {
                            diagonal.push((v[i], term(slot, true)));
                        }
                    } else if let Ok(row) = pairs.binary_search(&[v[i].min(v[j]), v[i].max(v[j])]) {
                        off_diagonal.push((row as u32, term(slot, v[i] > v[j])));
                    }
                }
            }
        }
        Self {
            vertices,
            gradient: Csr::from_pairs(count, &gradient),
            diagonal: Csr::from_pairs(count, &diagonal),
            off_diagonal: Csr::from_pairs(pairs.len(), &off_diagonal),
        }
    }
    /// Vertices of an element.
    pub(super) fn vertices(&self, element: usize) -> &[u32; K] {
        &self.vertices[element]
    }
    /// Number of elements.
    pub(super) fn len(&self) -> usize {
        self.vertices.len()
    }
    /// Corner positions of an element; an absent corner lies at the first.
    pub(super) fn corners(&self, element: usize, x: &[V3d]) -> [V3d; K] {
        let v = &self.vertices[element];
        v.map(|i| x[if i == ABSENT { v[0] } else { i } as usize])
    }
    /// Adds the expansions of the elements, evaluated one by one by `expand`, to the sums.
    pub(super) fn assemble(
        &self,
        par: Par,
        buffer: &mut Vec<Packed<K, P>>,
        out: &mut ElasticExpansion,
        expand: impl Fn(usize) -> Packed<K, P> + Sync,
    ) {
        map_into(par, self.len(), CHUNK, buffer, expand);
        out.value += buffer.iter().map(|e| e.value).sum::<f64>();
        let buffer = &*buffer;
        let block = |t: &Term| {
            let b = &buffer[t.element as usize].blocks[t.slot as usize];
            if t.transposed { b.transpose() } else { *b }
        };
        tryon_geometry::par::for_chunks(par, &mut out.gradient, CHUNK, |start, chunk| {
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
            tryon_geometry::par::for_chunks(par, sums, CHUNK, |start, chunk| {
                for (k, sum) in chunk.iter_mut().enumerate() {
                    for t in terms.row(start + k) {
                        *sum += block(t);
                    }
                }
            });
        }
    }
}
