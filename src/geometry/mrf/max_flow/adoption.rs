//! Orphans of the search trees: nodes whose path to their root was saturated.
//!
//! Each takes a parent one level above it, or moves to the least level that a neighbour offers, or leaves the
//! tree. Orphans of lower depth go first, so the level above an orphan has none.

use super::{END, FREE, FlowNode, MaxFlow, ORPHAN, SINK, SOURCE, signed};

impl MaxFlow {
    /// Removal of a node from its parent; the node waits for `adopt`.
    pub(super) fn orphan(&mut self, node: u32) {
        self.unlink(node);
        self.queue_orphan(node);
    }

    /// Entry of a node among the orphans of its depth.
    fn queue_orphan(&mut self, node: u32) {
        let orphan = &mut self.nodes[node as usize];
        orphan.parent = ORPHAN;
        let depth = orphan.level.unsigned_abs() as usize;
        if self.orphans.len() <= depth {
            self.orphans.resize_with(depth + 1, Vec::new);
        }
        self.orphans[depth].push(node);
        self.orphan_count += 1;
    }

    /// New parents for all orphans, or their release, from the shallowest level down.
    pub(super) fn adopt(&mut self) {
        let mut depth = 1;
        while self.orphan_count > 0 {
            while let Some(node) = self.orphans[depth].pop() {
                self.orphan_count -= 1;
                if self.nodes[node as usize].level > 0 {
                    self.adopt_one::<SOURCE>(node);
                } else {
                    self.adopt_one::<SINK>(node);
                }
            }
            depth += 1;
        }
    }

    /// New parent of one orphan: at the level above it, at a deeper level, or none.
    fn adopt_one<const TREE: usize>(&mut self, node: u32) {
        let FlowNode { level, current, .. } = self.nodes[node as usize];
        let end = self.nodes[node as usize + 1].first;
        let above = level - signed::<TREE>(1);
        if above != 0 {
            let is_parent = |&position: &u32| {
                let arc = self.incident[position as usize];
                let head = self.arcs[arc as usize].head;
                self.nodes[head as usize].level == above && self.capacity_to_child::<TREE>(arc) > 0
            };
            if let Some(position) = (current..end).find(is_parent) {
                self.link(node, self.incident[position as usize]);
                self.nodes[node as usize].current = position;
                return;
            }
        }

        self.orphan_children(node);
        match self.shallowest_parent::<TREE>(node) {
            Some((position, depth)) => self.lower::<TREE>(node, position, depth + 1),
            None => {
                let node = &mut self.nodes[node as usize];
                node.level = 0;
                node.parent = FREE;
            }
        }
    }

    /// Conversion of all children of a node to orphans.
    fn orphan_children(&mut self, node: u32) {
        let mut child = std::mem::replace(&mut self.nodes[node as usize].child, END);
        while child != END {
            let sibling = self.nodes[child as usize].sibling;
            self.queue_orphan(child);
            child = sibling;
        }
    }

    /// Arc position and depth of the shallowest neighbour in the same tree. Orphans count: their depth is a
    /// lower bound.
    fn shallowest_parent<const TREE: usize>(&self, node: u32) -> Option<(u32, i32)> {
        let mut limit = self.trees[TREE].depth + i32::from(self.growing == TREE);
        let mut best = None;
        for position in self.nodes[node as usize].first..self.nodes[node as usize + 1].first {
            let arc = self.incident[position as usize];
            let head = self.arcs[arc as usize].head;
            let depth = signed::<TREE>(self.nodes[head as usize].level);
            if depth > 0 && depth < limit && self.capacity_to_child::<TREE>(arc) > 0 {
                limit = depth;
                best = Some((position, depth));
            }
        }
        best
    }

    /// Move of an orphan to `depth` below the neighbour at `position`. Below another orphan it stays one.
    fn lower<const TREE: usize>(&mut self, node: u32, position: u32, depth: i32) {
        let moved = &mut self.nodes[node as usize];
        let has_moved = moved.level != signed::<TREE>(depth);
        moved.level = signed::<TREE>(depth);
        moved.current = position;

        let arc = self.incident[position as usize];
        let parent = self.arcs[arc as usize].head;
        if self.nodes[parent as usize].parent == ORPHAN {
            self.queue_orphan(node);
        } else {
            self.link(node, arc);
        }

        let tree = &mut self.trees[TREE];
        if depth > tree.depth {
            tree.next.push(node);
        } else if depth == tree.depth && has_moved {
            let queue = if self.growing == TREE {
                &mut self.late
            } else {
                &mut tree.front
            };
            queue.push(node);
        }
    }

    /// Removal of a node from its parent's children.
    fn unlink(&mut self, node: u32) {
        let FlowNode {
            parent, sibling, ..
        } = self.nodes[node as usize];
        if parent >= ORPHAN {
            return;
        }

        let parent = self.arcs[parent as usize].head as usize;
        let mut child = self.nodes[parent].child;
        if child == node {
            self.nodes[parent].child = sibling;
            return;
        }
        while self.nodes[child as usize].sibling != node {
            child = self.nodes[child as usize].sibling;
        }
        self.nodes[child as usize].sibling = sibling;
    }
}
