//! Marching tetrahedra over the cells that the surface can pass, left half only; always a manifold.

use super::BodySettings;
use super::field::Field;
use std::collections::BTreeMap;
use tryon_geometry::math::P3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};

/// Cells along the edge of a block.
const BLOCK: i32 = 4;
/// Nodes along the edge of a block.
const SIDE: usize = (BLOCK + 1) as usize;
/// Levels of blocks above the smallest; each level doubles the edge.
const LEVELS: u32 = 3;
/// The six tetrahedra around the diagonal of a cube; corners are bits x, y, z.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 6, 4, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
];

type Node = [i32; 3];

/// A field on a grid.
struct Grid<'a> {
    field: &'a Field,
    settings: &'a BodySettings,
}

impl Grid<'_> {
    fn position(&self, n: &Node) -> P3d {
        P3d::from(n.map(|k| f64::from(k) * self.settings.cell))
    }

    /// Blocks (by their lowest node) that may hold a piece of the surface.
    fn blocks(&self, lo: Node, hi: Node) -> Vec<Node> {
        let mut edge = BLOCK << LEVELS;
        let mut list = Vec::new();
        for x in (lo[0]..hi[0]).step_by(edge as usize) {
            for y in (lo[1]..hi[1]).step_by(edge as usize) {
                for z in (lo[2]..hi[2]).step_by(edge as usize) {
                    list.push([x, y, z]);
                }
            }
        }
        loop {
            // The estimate may be off by a third; half the diagonal with that margin.
            let reach = 0.87 * 1.4 * f64::from(edge) * self.settings.cell;
            let mut keep = Vec::new();
            par::map_into(Par::Rayon, list.len(), 64, &mut keep, |i| {
                let half = f64::from(edge) * 0.5 * self.settings.cell;
                let c = self.position(&list[i]) + nalgebra::Vector3::repeat(half);
                self.field.value(&c).abs() < reach
            });
            list = list
                .iter()
                .zip(&keep)
                .filter(|(_, k)| **k)
                .map(|(b, _)| *b)
                .collect();
            if edge == BLOCK {
                return list;
            }
            edge /= 2;
            list = list
                .iter()
                .flat_map(|b| {
                    (0..8).map(move |k| {
                        [
                            b[0] + edge * (k & 1),
                            b[1] + edge * (k >> 1 & 1),
                            b[2] + edge * (k >> 2),
                        ]
                    })
                })
                .collect();
        }
    }

    /// Field values at the nodes of a block, x fastest.
    fn node_values(&self, block: &Node) -> Vec<f64> {
        let gap = self.settings.node_gap;
        let mut values = Vec::with_capacity(SIDE * SIDE * SIDE);
        for z in 0..=BLOCK {
            for y in 0..=BLOCK {
                for x in 0..=BLOCK {
                    let d = self.field.value(&self.position(&[
                        block[0] + x,
                        block[1] + y,
                        block[2] + z,
                    ]));
                    // Never exactly on a node, nor so near that an edge has no length.
                    values.push(if d.abs() < gap { gap } else { d });
                }
            }
        }
        values
    }
}

/// The corners of a cube: nodes and field values, by bits x, y, z.
struct Cube {
    nodes: [Node; 8],
    values: [f64; 8],
}

impl Cube {
    /// One cell of a block with these node values.
    fn new(block: &Node, values: &[f64], cell: i32) -> Self {
        let o = [cell % BLOCK, cell / BLOCK % BLOCK, cell / (BLOCK * BLOCK)];
        let corner = |k: usize| {
            let bits = [k & 1, k >> 1 & 1, k >> 2];
            std::array::from_fn::<i32, 3, _>(|a| o[a] + bits[a] as i32)
        };
        Self {
            nodes: std::array::from_fn(|k| {
                let c = corner(k);
                std::array::from_fn(|a| block[a] + c[a])
            }),
            values: std::array::from_fn(|k| {
                let c = corner(k).map(|x| x as usize);
                values[(c[2] * SIDE + c[1]) * SIDE + c[0]]
            }),
        }
    }
    fn is_cut(&self) -> bool {
        let inside = self.values.iter().filter(|x| **x < 0.0).count();
        inside != 0 && inside != 8
    }
}

/// The surface while cubes are added; vertices on shared edges are shared.
struct Polygons<'a> {
    grid: Grid<'a>,
    vertices: Vec<P3d>,
    faces: Vec<Face>,
    cuts: BTreeMap<(Node, Node), u32>,
}

impl Polygons<'_> {
    /// The vertex between an inner and an outer corner of a cube.
    fn cut(&mut self, cube: &Cube, inner: usize, outer: usize) -> u32 {
        let (p, q) = (cube.nodes[inner], cube.nodes[outer]);
        let key = if p < q { (p, q) } else { (q, p) };
        *self.cuts.entry(key).or_insert_with(|| {
            let s = cube.values[inner] / (cube.values[inner] - cube.values[outer]);
            let [p, q] = [p, q].map(|n| self.grid.position(&n));
            let vertex = p + (q - p) * s;
            self.vertices.push(vertex);
            (self.vertices.len() - 1) as u32
        })
    }
    /// A face that points away from an inner node.
    fn push(&mut self, f: Face, inner: &Node) {
        let [x, y, z] = f.map(|i| self.vertices[i as usize]);
        let outward = (y - x)
            .cross(&(z - x))
            .dot(&(x - self.grid.position(inner)))
            > 0.0;
        self.faces
            .push(if outward { f } else { [f[0], f[2], f[1]] });
    }
    fn add_tetrahedron(&mut self, cube: &Cube, corners: [usize; 4]) {
        let (ins, out): (Vec<usize>, Vec<usize>) =
            corners.iter().partition(|&&k| cube.values[k] < 0.0);
        let pairs: &[(usize, usize)] = match ins.len() {
            1 => &[(0, 0), (0, 1), (0, 2)],
            2 => &[(0, 0), (0, 1), (1, 1), (1, 0)],
            3 => &[(0, 0), (1, 0), (2, 0)],
            _ => return,
        };
        let q: Vec<u32> = pairs
            .iter()
            .map(|&(i, o)| self.cut(cube, ins[i], out[o]))
            .collect();
        // The plane separates the outer corners from any inner one.
        let inner = &cube.nodes[ins[0]];
        for k in 1..q.len() - 1 {
            self.push([q[0], q[k], q[k + 1]], inner);
        }
    }
}

/// The zero level of `field` for x ≥ 0 between `lo` and `hi` (metres): vertices and outward faces.
/// The boundary lies exactly on x = 0.
pub(super) fn polygonise(
    settings: &BodySettings,
    field: &Field,
    lo: P3d,
    hi: P3d,
) -> (Vec<P3d>, Vec<Face>) {
    let node = |p: P3d| -> Node { [p.x, p.y, p.z].map(|x| (x / settings.cell).floor() as i32) };
    let grid = Grid { field, settings };
    let blocks = grid.blocks(node(lo), node(hi));
    let mut values: Vec<Vec<f64>> = Vec::new();
    par::map_into(Par::Rayon, blocks.len(), 16, &mut values, |i| {
        grid.node_values(&blocks[i])
    });
    let mut out = Polygons {
        grid,
        vertices: Vec::new(),
        faces: Vec::new(),
        cuts: BTreeMap::new(),
    };
    for (block, values) in blocks.iter().zip(&values) {
        for cell in 0..BLOCK * BLOCK * BLOCK {
            let cube = Cube::new(block, values, cell);
            if cube.is_cut() {
                TETRAHEDRA
                    .iter()
                    .for_each(|t| out.add_tetrahedron(&cube, *t));
            }
        }
    }
    (out.vertices, out.faces)
}
