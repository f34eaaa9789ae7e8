//! Boxes in a tree: which of many overlap a given one, and which of many things is nearest to a point.

use super::point::{Point, bounds};

/// Boxes that one leaf holds at most.
const LEAF: usize = 8;

/// The part of the largest coordinate by which boxes are widened, so that rounding hides nothing that touches them.
const ROUNDING: f64 = 1e-12;

/// Boxes, numbered from 0, halved again and again across the longer side of what they cover.
#[derive(Clone, Debug)]
pub struct BoxTree {
    /// Every node before those below it.
    nodes: Vec<Node>,
    /// The boxes, leaf after leaf.
    boxes: Vec<Numbered>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Point,
    high: Point,
    /// The first node that does not lie below this one.
    next: u32,
    /// Where the boxes of a leaf begin and end; an inner node has none of its own.
    boxes: [u32; 2],
}

#[derive(Clone, Copy, Debug)]
struct Numbered {
    low: Point,
    high: Point,
    number: u32,
}

impl BoxTree {
    /// A tree of boxes, each given by its lowest and highest coordinates \[length\].
    pub fn new(boxes: impl Iterator<Item = (Point, Point)>) -> Self {
        let number = |(number, (low, high))| Numbered { low, high, number: number as u32 };
        let mut boxes: Vec<Numbered> = boxes.enumerate().map(number).collect();
        let ends = boxes.iter().flat_map(|one| [one.low, one.high]).flatten();
        let slack = ROUNDING * ends.fold(0.0, |most: f64, end| most.max(end.abs()));
        for one in &mut boxes {
            one.low = one.low.map(|v| v - slack);
            one.high = one.high.map(|v| v + slack);
        }
        let mut tree = Self { nodes: Vec::with_capacity(boxes.len() / 2 + 1), boxes };
        if !tree.boxes.is_empty() {
            tree.divide(0, tree.boxes.len());
        }
        tree
    }

    /// Adds the node of some of the boxes, and those below it.
    fn divide(&mut self, from: usize, to: usize) {
        let (low, high) = bounds(self.boxes[from..to].iter().flat_map(|one| [one.low, one.high]));
        let at = self.nodes.len();
        self.nodes.push(Node { low, high, next: 0, boxes: [0; 2] });
        if to - from <= LEAF {
            self.nodes[at].boxes = [from as u32, to as u32];
        } else {
            let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
            // Half of each: the sum of two coordinates may be infinite.
            let middle = |one: &Numbered| 0.5 * one.low[axis] + 0.5 * one.high[axis];
            let half = (to - from) / 2;
            self.boxes[from..to].select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            self.divide(from, from + half);
            self.divide(from + half, to);
        }
        self.nodes[at].next = self.nodes.len() as u32;
    }

    /// Numbers of the boxes that overlap or touch the one between two corners, and perhaps of some that miss it by a
    /// rounding error; in no particular order.
    pub(crate) fn overlapping(&self, low: Point, high: Point) -> impl Iterator<Item = usize> + Clone + '_ {
        let is_apart = move |l: &Point, h: &Point| (0..2).any(|k| l[k] > high[k] || h[k] < low[k]);
        let mut at = 0;
        let leaves = std::iter::from_fn(move || {
            while let Some(node) = self.nodes.get(at) {
                let apart = is_apart(&node.low, &node.high);
                at = if apart { node.next as usize } else { at + 1 };
                let [from, to] = node.boxes;
                if !apart && from < to {
                    return Some(&self.boxes[from as usize..to as usize]);
                }
            }
            None
        });
        let near = leaves.flatten().filter(move |one| !is_apart(&one.low, &one.high));
        near.map(|one| one.number as usize)
    }

    /// The number of what is nearest to a point, and how far it is \[length\]: the lowest number of those equally far.
    /// `distance` says how far the thing in the box of a number is; one that is no number is the farthest.
    pub fn nearest(&self, p: Point, distance: impl Fn(usize) -> f64) -> Option<(usize, f64)> {
        let mut best = None;
        if !self.nodes.is_empty() {
            self.search(0, p, &distance, &mut best);
        }
        best
    }

    fn search(&self, at: usize, p: Point, distance: &impl Fn(usize) -> f64, best: &mut Option<(usize, f64)>) {
        let node = &self.nodes[at];
        let [from, to] = node.boxes;
        for one in &self.boxes[from as usize..to as usize] {
            let next = (one.number as usize, distance(one.number as usize));
            let is_better = |best: &(usize, f64)| next.1 < best.1 || next.1 == best.1 && next.0 < best.0;
            if !next.1.is_nan() && best.as_ref().is_none_or(is_better) {
                *best = Some(next);
            }
        }
        if from < to {
            return;
        }
        let left = at + 1;
        let mut below = [left, self.nodes[left].next as usize].map(|at| (self.nodes[at].away(p), at));
        if below[1].0 < below[0].0 {
            below.swap(0, 1);
        }
        for (away, at) in below {
            // Boxes are as far as what they hold, but for rounding.
            if best.is_none_or(|(_, least)| away <= least * (1.0 + ROUNDING)) {
                self.search(at, p, distance, best);
            }
        }
    }
}

impl Node {
    /// Distance of a point \[length\].
    fn away(&self, p: Point) -> f64 {
        let [x, y] = [0, 1].map(|k| (self.low[k] - p[k]).max(p[k] - self.high[k]).max(0.0));
        x.hypot(y)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Numbers from 0 to 1 that look drawn by chance.
    pub fn chance(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        }
    }

    #[test]
    fn the_tree_finds_what_a_look_at_every_box_finds() {
        for count in [0, 1, 8, 9, 17, 500] {
            let mut next = chance(count);
            // On a coarse raster many boxes touch and many are equally far.
            let mut coarse = move || (next() * 20.0).floor();
            let corner = |coarse: &mut dyn FnMut() -> f64| [coarse(), coarse()];
            let boxes: Vec<(Point, Point)> = (0..count)
                .map(|_| {
                    let (a, size) = (corner(&mut coarse), corner(&mut coarse).map(|v| v / 4.0));
                    (a, [a[0] + size[0], a[1] + size[1]])
                })
                .collect();
            let tree = BoxTree::new(boxes.iter().copied());
            for _ in 0..50 {
                let (low, size) = (corner(&mut coarse), corner(&mut coarse).map(|v| v / 8.0));
                let high = [low[0] + size[0], low[1] + size[1]];
                let mut found: Vec<usize> = tree.overlapping(low, high).collect();
                found.sort_unstable();
                let overlaps = |k: &usize| {
                    let (l, h) = boxes[*k];
                    (0..2).all(|axis| l[axis] <= high[axis] && h[axis] >= low[axis])
                };
                assert_eq!(found, (0..boxes.len()).filter(overlaps).collect::<Vec<_>>());
                let away = |k: usize| {
                    let (l, h) = boxes[k];
                    let [x, y] = [0, 1].map(|axis| (l[axis] - low[axis]).max(low[axis] - h[axis]).max(0.0));
                    x.hypot(y)
                };
                let all = (0..boxes.len()).map(|k| (k, away(k)));
                let first = all.reduce(|best, next| if next.1 < best.1 { next } else { best });
                assert_eq!(tree.nearest(low, away), first);
            }
        }
    }
}
