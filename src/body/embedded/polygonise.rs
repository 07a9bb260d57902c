//! Marching tetrahedra over the cells that the surface can pass, left half only; always a manifold.

use super::field::Field;
use crate::math::P3d;
use crate::mesh::Face;
use crate::par::{self, Par};
use std::collections::BTreeMap;

/// Grid spacing, metres: three cells across a finger.
const CELL: f64 = 0.0065;
/// Cells along the edge of a block.
const BLOCK: i32 = 4;
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

fn position(n: &Node) -> P3d {
    P3d::new(
        f64::from(n[0]) * CELL,
        f64::from(n[1]) * CELL,
        f64::from(n[2]) * CELL,
    )
}

/// Blocks (by their lowest node) that may hold a piece of the surface.
fn blocks(field: &Field, lo: Node, hi: Node) -> Vec<Node> {
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
        let reach = 0.87 * 1.4 * f64::from(edge) * CELL;
        let mut keep = Vec::new();
        par::map_into(Par::Rayon, list.len(), 64, &mut keep, |i| {
            let half = f64::from(edge) * 0.5 * CELL;
            let c = position(&list[i]) + nalgebra::Vector3::repeat(half);
            field.value(&c).abs() < reach
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

/// The zero level of `field` for x ≥ 0 between `lo` and `hi` (metres): vertices and outward faces.
/// The boundary lies exactly on x = 0.
pub(super) fn polygonise(field: &Field, lo: P3d, hi: P3d) -> (Vec<P3d>, Vec<Face>) {
    let node = |p: &P3d| -> Node {
        [
            (p.x / CELL).floor() as i32,
            (p.y / CELL).floor() as i32,
            (p.z / CELL).floor() as i32,
        ]
    };
    let blocks = blocks(field, node(&lo), node(&hi));
    let side = (BLOCK + 1) as usize;
    let mut values: Vec<Vec<f64>> = Vec::new();
    par::map_into(Par::Rayon, blocks.len(), 16, &mut values, |i| {
        let b = blocks[i];
        let mut v = Vec::with_capacity(side * side * side);
        for z in 0..=BLOCK {
            for y in 0..=BLOCK {
                for x in 0..=BLOCK {
                    let d = field.value(&position(&[b[0] + x, b[1] + y, b[2] + z]));
                    // Never exactly on a node, nor so near that an edge has no length.
                    v.push(if d.abs() < NODE_GAP { NODE_GAP } else { d });
                }
            }
        }
        v
    });
    let mut vertices = Vec::new();
    let mut faces: Vec<Face> = Vec::new();
    let mut cuts: BTreeMap<(Node, Node), u32> = BTreeMap::new();
    for (b, v) in blocks.iter().zip(&values) {
        for cell in 0..BLOCK * BLOCK * BLOCK {
            let o = [cell % BLOCK, cell / BLOCK % BLOCK, cell / (BLOCK * BLOCK)];
            let corner = |k: usize| {
                [
                    o[0] + (k & 1) as i32,
                    o[1] + (k >> 1 & 1) as i32,
                    o[2] + (k >> 2) as i32,
                ]
            };
            let value = |k: usize| {
                let c = corner(k).map(|x| x as usize);
                v[(c[2] * side + c[1]) * side + c[0]]
            };
            let d: [f64; 8] = std::array::from_fn(value);
            let inside = d.iter().filter(|x| **x < 0.0).count();
            if inside == 0 || inside == 8 {
                continue;
            }
            let at = |k: usize| {
                let c = corner(k);
                [b[0] + c[0], b[1] + c[1], b[2] + c[2]]
            };
            for t in TETRAHEDRA {
                let (ins, out): (Vec<usize>, Vec<usize>) = t.iter().partition(|&&k| d[k] < 0.0);
                let mut cut = |i: usize, o: usize| {
                    let (p, q) = (at(i), at(o));
                    let key = if p < q { (p, q) } else { (q, p) };
                    *cuts.entry(key).or_insert_with(|| {
                        let s = d[i] / (d[i] - d[o]);
                        vertices.push(position(&p) + (position(&q) - position(&p)) * s);
                        (vertices.len() - 1) as u32
                    })
                };
                let mut push = |f: Face, inner: usize, vertices: &[P3d]| {
                    let [x, y, z] = f.map(|i| vertices[i as usize]);
                    let outward = (y - x).cross(&(z - x)).dot(&(x - position(&at(inner)))) > 0.0;
                    faces.push(if outward { f } else { [f[0], f[2], f[1]] });
                };
                match ins.len() {
                    1 => {
                        let f = [
                            cut(ins[0], out[0]),
                            cut(ins[0], out[1]),
                            cut(ins[0], out[2]),
                        ];
                        push(f, ins[0], &vertices);
                    }
                    3 => {
                        let f = [
                            cut(ins[0], out[0]),
                            cut(ins[1], out[0]),
                            cut(ins[2], out[0]),
                        ];
                        // The plane separates the outer corner from any inner one.
                        push(f, ins[0], &vertices);
                    }
                    2 => {
                        let q = [
                            cut(ins[0], out[0]),
                            cut(ins[0], out[1]),
                            cut(ins[1], out[1]),
                            cut(ins[1], out[0]),
                        ];
                        push([q[0], q[1], q[2]], ins[0], &vertices);
                        push([q[0], q[2], q[3]], ins[0], &vertices);
                    }
                    _ => {}
                }
            }
        }
    }
    (vertices, faces)
}

/// Smallest distance value kept at a grid node, metres.
const NODE_GAP: f64 = 1e-5;
