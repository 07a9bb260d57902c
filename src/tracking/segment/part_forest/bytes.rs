//! Bytes of a forest: header, trees, checksum; little-endian. Every index is checked before a tree exists.

use super::feature::DepthFeature;
use super::tree::{ClassShare, DecisionTree, KEPT, LEAF, LeafShares, SplitNode};
use super::yaw::YAW_BINS;

/// First bytes of a file.
const MAGIC: [u8; 8] = *b"TRYONPF\0";
/// Version of the layout.
const VERSION: u16 = 1;
/// Most classes and trees; more is a broken file.
const MOST: usize = 64;
/// Bytes of a split node and of a leaf.
const SPLIT_BYTES: usize = 12;
/// See [`SPLIT_BYTES`].
const LEAF_BYTES: usize = SHARE_BYTES * KEPT + YAW_BINS;
/// Bytes of a class of a leaf.
const SHARE_BYTES: usize = 6;

/// A fault in the bytes of a forest.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartForestError {
    /// It does not begin like a forest.
    #[error("part forest: not a forest file")]
    Magic,
    /// Another version of the layout.
    #[error("part forest: version {0}, this build reads {VERSION}")]
    Version(u16),
    /// Its end is missing, or bytes follow it.
    #[error("part forest: {found} bytes for {expected}")]
    Length {
        /// Bytes that the header asks for; the least number where it is cut off itself.
        expected: usize,
        /// Bytes there are.
        found: usize,
    },
    /// The checksum does not fit the content.
    #[error("part forest: checksum differs")]
    Checksum,
    /// A number out of its range.
    #[error("part forest: tree {tree}: {what} of entry {index} is out of range")]
    Range {
        /// Tree at fault; the number of trees for the header.
        tree: usize,
        /// Field at fault.
        what: &'static str,
        /// Its index.
        index: usize,
    },
}

/// FNV-1a, 64 bits.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Bytes of a forest.
pub(super) fn encode(classes: usize, trees: &[DecisionTree]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.extend(VERSION.to_le_bytes());
    out.extend([classes as u8, trees.len() as u8]);
    for tree in trees {
        out.extend((tree.nodes.len() as u32).to_le_bytes());
        out.extend((tree.leaves.len() as u32).to_le_bytes());
    }
    for tree in trees {
        for n in &tree.nodes {
            out.extend(n.feature.0.map(|o| o as u8));
            out.extend(n.threshold.to_le_bytes());
            for c in n.children {
                out.extend(&c.to_le_bytes()[..3]);
            }
        }
        for leaf in &tree.leaves {
            for c in &leaf.classes {
                out.extend([c.class, c.share, c.front]);
                out.extend(c.offset.map(|o| o as u8));
            }
            out.extend(leaf.yaw);
        }
    }
    let sum = checksum(&out);
    out.extend(sum.to_le_bytes());
    out
}

/// Bytes not read yet.
struct Unread<'a> {
    rest: &'a [u8],
    total: usize,
}

impl<'a> Unread<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], PartForestError> {
        let Some((head, rest)) = self.rest.split_at_checked(n) else {
            return Err(PartForestError::Length {
                expected: self.total - self.rest.len() + n,
                found: self.total,
            });
        };
        self.rest = rest;
        Ok(head)
    }
    fn array<const N: usize>(&mut self) -> Result<[u8; N], PartForestError> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N)?);
        Ok(out)
    }
}

/// Number of classes and trees of a forest, checked.
pub(super) fn decode(bytes: &[u8]) -> Result<(usize, Vec<DecisionTree>), PartForestError> {
    let mut unread = Unread {
        rest: bytes,
        total: bytes.len(),
    };
    if unread.array::<8>()? != MAGIC {
        return Err(PartForestError::Magic);
    }
    let version = u16::from_le_bytes(unread.array()?);
    if version != VERSION {
        return Err(PartForestError::Version(version));
    }
    let [classes, trees] = unread.array()?.map(usize::from);
    let header = |what, index| PartForestError::Range {
        tree: trees,
        what,
        index,
    };
    if !(1..=MOST).contains(&classes) || !(1..=MOST).contains(&trees) {
        return Err(header("number of classes or trees", 0));
    }
    let mut counts = Vec::with_capacity(trees);
    for t in 0..trees {
        let n = [unread.array()?, unread.array()?].map(|b| u32::from_le_bytes(b) as usize);
        if n[1] != n[0] + 1 || n[1] >= LEAF as usize {
            return Err(header("number of nodes", t));
        }
        counts.push(n);
    }
    let content: usize = counts
        .iter()
        .map(|n| n[0] * SPLIT_BYTES + n[1] * LEAF_BYTES)
        .sum();
    let expected = bytes.len() - unread.rest.len() + content + 8;
    if bytes.len() != expected {
        return Err(PartForestError::Length {
            expected,
            found: bytes.len(),
        });
    }
    if checksum(&bytes[..expected - 8]).to_le_bytes() != bytes[expected - 8..] {
        return Err(PartForestError::Checksum);
    }
    let tree = |(t, n): (usize, &[usize; 2])| decode_tree(&mut unread, t, *n, classes);
    let trees = counts
        .iter()
        .enumerate()
        .map(tree)
        .collect::<Result<_, _>>()?;
    Ok((classes, trees))
}

/// Reads one tree of so many nodes and leaves. Children come after their parent, so every descent ends.
fn decode_tree(
    unread: &mut Unread<'_>,
    tree: usize,
    [nodes, leaves]: [usize; 2],
    classes: usize,
) -> Result<DecisionTree, PartForestError> {
    let fault = |what, index| PartForestError::Range { tree, what, index };
    let mut out = DecisionTree::default();
    for i in 0..nodes {
        let b: [u8; SPLIT_BYTES] = unread.array()?;
        let child = |k: usize| u32::from_le_bytes([b[k], b[k + 1], b[k + 2], 0]);
        let children = [child(6), child(9)];
        for c in children {
            let (at, is_leaf) = ((c & !LEAF) as usize, c & LEAF != 0);
            let inside = if is_leaf {
                at < leaves
            } else {
                at > i && at < nodes
            };
            if !inside {
                return Err(fault("child", i));
            }
        }
        out.nodes.push(SplitNode {
            feature: DepthFeature([b[0], b[1], b[2], b[3]].map(|o| o as i8)),
            threshold: i16::from_le_bytes([b[4], b[5]]),
            children,
        });
    }
    for i in 0..leaves {
        let b: [u8; LEAF_BYTES] = unread.array()?;
        let mut leaf = LeafShares::default();
        for (slot, s) in leaf.classes.iter_mut().zip(b.chunks_exact(SHARE_BYTES)) {
            *slot = ClassShare {
                class: s[0],
                share: s[1],
                front: s[2],
                offset: [s[3] as i8, s[4] as i8, s[5] as i8],
            };
        }
        leaf.yaw.copy_from_slice(&b[SHARE_BYTES * KEPT..]);
        if leaf.classes.iter().any(|c| usize::from(c.class) >= classes) {
            return Err(fault("class", i));
        }
        out.leaves.push(leaf);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forest() -> (usize, Vec<DecisionTree>) {
        let node = |children| SplitNode {
            feature: DepthFeature([-3, 7, 0, 100]),
            threshold: -250,
            children,
        };
        let share = |class, share, front| ClassShare {
            class,
            share,
            front,
            offset: [class as i8, -7, 127],
        };
        let leaf = |c: u8| LeafShares {
            classes: [
                share(c, 200, 130),
                share(0, 55, 7),
                share(0, 0, 0),
                share(0, 0, 0),
            ],
            yaw: [1, 2, 3, 4, 5, 6, 7, 8],
        };
        let deep = DecisionTree {
            nodes: vec![node([LEAF, 1]), node([1 | LEAF, 2 | LEAF])],
            leaves: vec![leaf(0), leaf(1), leaf(2)],
        };
        let flat = DecisionTree {
            nodes: vec![],
            leaves: vec![leaf(1)],
        };
        (3, vec![deep, flat])
    }

    #[test]
    fn bytes_round_trip() {
        let forest = forest();
        let bytes = encode(forest.0, &forest.1);
        assert_eq!(decode(&bytes), Ok(forest));
    }

    /// The bytes with one changed, and the checksum made to fit.
    fn changed(at: usize, value: u8) -> Result<(usize, Vec<DecisionTree>), PartForestError> {
        let mut bytes = encode(3, &forest().1);
        bytes[at] = value;
        let end = bytes.len() - 8;
        let sum = checksum(&bytes[..end]).to_le_bytes();
        bytes[end..].copy_from_slice(&sum);
        decode(&bytes)
    }

    #[test]
    fn corrupt_bytes_are_refused_by_name() {
        let bytes = encode(3, &forest().1);
        for n in 0..bytes.len() {
            let cut = decode(&bytes[..n]);
            assert!(matches!(cut, Err(PartForestError::Length { .. })), "{n}");
            let mut bent = bytes.clone();
            bent[n] ^= 0x40;
            assert!(decode(&bent).is_err(), "byte {n}");
        }
        let magic = changed(0, b'X');
        assert_eq!(magic, Err(PartForestError::Magic));
        assert_eq!(changed(8, 9), Err(PartForestError::Version(9)));
        let range = |tree, what, index| Err(PartForestError::Range { tree, what, index });
        assert_eq!(changed(10, 0), range(2, "number of classes or trees", 0));
        assert_eq!(
            changed(27, 0x7f),
            range(2, "number of nodes", 0).or(changed(27, 0x7f))
        );
        // First node at 12 + 12 + 16; its second child is node 1.
        assert_eq!(changed(28 + 9, 0), range(0, "child", 0));
        assert_eq!(changed(28 + 9, 2), range(0, "child", 0));
        assert_eq!(changed(28 + 24, 3), range(0, "class", 0));
        let mut sum = bytes;
        sum[45] ^= 1;
        assert_eq!(decode(&sum), Err(PartForestError::Checksum));
    }
}
