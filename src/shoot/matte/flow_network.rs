//! Minimum cut between subject and background on a grid of pixels (Boykov and Kolmogorov 2004, "An experimental
//! comparison of min-cut/max-flow algorithms for energy minimization in vision").

use std::collections::VecDeque;

/// Directions to the eight neighbours as columns and rows; direction `d` is opposite to `7 - d`.
pub const NEIGHBOURS: [(isize, isize); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

const TERMINAL: u8 = 8;
const ORPHAN: u8 = 9;
const NONE: u8 = 10;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

impl Tree {
    /// Sign of the flow along the tree's branches: 1 away from the root, −1 towards it.
    fn sign(self) -> i64 {
        if self == Self::Source { 1 } else { -1 }
    }
}

/// Pixels with links to their neighbours and to two terminals. A border of free pixels around them saves every
/// bounds check.
pub struct FlowNetwork {
    stride: usize,
    width: usize,
    height: usize,
    /// Remaining capacity of the link to the source, or, negative, to the sink.
    terminal: Vec<i64>,
    /// Remaining capacities of the links to the neighbours.
    links: Vec<[i32; 8]>,
    tree: Vec<Tree>,
    parent: Vec<u8>,
    /// Time stamp of each pixel's known distance to its terminal.
    stamp: Vec<u32>,
    distance: Vec<u32>,
    queued: Vec<bool>,
    active: VecDeque<usize>,
    orphans: Vec<usize>,
    time: u32,
}

impl FlowNetwork {
    /// A network of `width × height` pixels without links.
    pub fn new(width: usize, height: usize) -> Self {
        let count = (width + 2) * (height + 2);
        Self {
            stride: width + 2,
            width,
            height,
            terminal: vec![0; count],
            links: vec![[0; 8]; count],
            tree: vec![Tree::Free; count],
            parent: vec![NONE; count],
            stamp: vec![0; count],
            distance: vec![0; count],
            queued: vec![false; count],
            active: VecDeque::new(),
            orphans: Vec::new(),
            time: 0,
        }
    }

    fn index(&self, x: usize, y: usize) -> usize {
        (y + 1) * self.stride + x + 1
    }

    fn neighbour(&self, pixel: usize, direction: u8) -> usize {
        let (x, y) = NEIGHBOURS[direction as usize];
        pixel.wrapping_add_signed(y * self.stride as isize + x)
    }

    /// Sets the costs of assigning a pixel to the sink and to the source.
    pub fn set_terminal(&mut self, x: usize, y: usize, to_sink: i32, to_source: i32) {
        let pixel = self.index(x, y);
        self.terminal[pixel] = i64::from(to_sink) - i64::from(to_source);
    }

    /// Sets the cost, at least 0, of separating a pixel from its neighbour in direction `d`, which must be within
    /// the grid.
    pub fn link(&mut self, x: usize, y: usize, d: usize, cost: i32) {
        let pixel = self.index(x, y);
        let other = self.neighbour(pixel, d as u8);
        self.links[pixel][d] = cost;
        self.links[other][7 - d] = cost;
    }

    /// True for each pixel, row by row, on the source's side of a minimum cut. Among several cuts, the one with the
    /// fewest such pixels.
    pub fn source_side(mut self) -> Vec<bool> {
        for pixel in 0..self.terminal.len() {
            self.tree[pixel] = match self.terminal[pixel] {
                0 => continue,
                1.. => Tree::Source,
                _ => Tree::Sink,
            };
            self.parent[pixel] = TERMINAL;
            self.distance[pixel] = 1;
            self.activate(pixel);
        }
        while let Some((source, direction)) = self.grow() {
            self.augment(source, direction);
            self.adopt();
        }
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| self.tree[self.index(x, y)] == Tree::Source)
            .collect()
    }

    fn activate(&mut self, pixel: usize) {
        if !self.queued[pixel] {
            self.queued[pixel] = true;
            self.active.push_back(pixel);
        }
    }

    /// Remaining capacity of the link between a pixel of a tree and its neighbour, away from the tree's source or
    /// towards its sink.
    fn residue(&self, tree: Tree, pixel: usize, direction: u8) -> i32 {
        match tree {
            Tree::Source => self.links[pixel][direction as usize],
            _ => self.links[self.neighbour(pixel, direction)][7 - direction as usize],
        }
    }

    /// Grows both trees until they touch: a pixel of the source's tree, and the direction of one of the sink's.
    fn grow(&mut self) -> Option<(usize, u8)> {
        while let Some(&pixel) = self.active.front() {
            let tree = self.tree[pixel];
            if tree != Tree::Free {
                for direction in 0..8 {
                    if self.residue(tree, pixel, direction) == 0 {
                        continue;
                    }
                    let other = self.neighbour(pixel, direction);
                    if self.tree[other] == Tree::Free {
                        self.tree[other] = tree;
                        self.hang(other, pixel, 7 - direction);
                        self.activate(other);
                    } else if self.tree[other] != tree {
                        return Some(match tree {
                            Tree::Source => (pixel, direction),
                            _ => (other, 7 - direction),
                        });
                    } else if self.distance[other] > self.distance[pixel] + 1 && self.stamp[other] <= self.stamp[pixel]
                    {
                        self.hang(other, pixel, 7 - direction);
                    }
                }
            }
            self.active.pop_front();
            self.queued[pixel] = false;
        }
        None
    }

    /// Makes `parent`, in `direction`, the parent of `child`.
    fn hang(&mut self, child: usize, parent: usize, direction: u8) {
        self.parent[child] = direction;
        self.stamp[child] = self.stamp[parent];
        self.distance[child] = self.distance[parent] + 1;
    }

    /// Pushes the maximum flow from source to sink across the link where the trees touch.
    fn augment(&mut self, source: usize, direction: u8) {
        let sink = self.neighbour(source, direction);
        let mut flow = i64::from(self.links[source][direction as usize]);
        for (end, tree) in [(source, Tree::Source), (sink, Tree::Sink)] {
            let mut pixel = end;
            while self.parent[pixel] < TERMINAL {
                let up = self.parent[pixel];
                let above = self.neighbour(pixel, up);
                flow = flow.min(i64::from(self.residue(tree, above, 7 - up)));
                pixel = above;
            }
            flow = flow.min(self.terminal[pixel].abs());
        }
        // One link of the path is no wider than an i32.
        let narrow = flow as i32;
        self.links[source][direction as usize] -= narrow;
        self.links[sink][7 - direction as usize] += narrow;
        for (end, tree) in [(source, Tree::Source), (sink, Tree::Sink)] {
            let mut pixel = end;
            while self.parent[pixel] < TERMINAL {
                let up = self.parent[pixel];
                let above = self.neighbour(pixel, up);
                let (from, to, out) = match tree {
                    Tree::Source => (above, pixel, 7 - up),
                    _ => (pixel, above, up),
                };
                self.links[from][out as usize] -= narrow;
                self.links[to][7 - out as usize] += narrow;
                if self.links[from][out as usize] == 0 {
                    self.orphan(pixel);
                }
                pixel = above;
            }
            self.terminal[pixel] -= tree.sign() * flow;
            if self.terminal[pixel] == 0 {
                self.orphan(pixel);
            }
        }
    }

    fn orphan(&mut self, pixel: usize) {
        self.parent[pixel] = ORPHAN;
        self.orphans.push(pixel);
    }

    /// Finds new parents for orphaned pixels; those without one become free.
    fn adopt(&mut self) {
        self.time += 1;
        while let Some(pixel) = self.orphans.pop() {
            let tree = self.tree[pixel];
            let mut best: Option<(u32, u8)> = None;
            for direction in 0..8 {
                let other = self.neighbour(pixel, direction);
                if self.tree[other] != tree || self.residue(tree, other, 7 - direction) == 0 {
                    continue;
                }
                if let Some(distance) = self.distance_to_terminal(other)
                    && best.is_none_or(|(least, _)| distance < least)
                {
                    best = Some((distance, direction));
                }
            }
            if let Some((distance, direction)) = best {
                self.parent[pixel] = direction;
                self.stamp[pixel] = self.time;
                self.distance[pixel] = distance + 1;
                continue;
            }
            for direction in 0..8 {
                let other = self.neighbour(pixel, direction);
                if self.tree[other] != tree {
                    continue;
                }
                if self.residue(tree, other, 7 - direction) > 0 {
                    self.activate(other);
                }
                if self.parent[other] == 7 - direction {
                    self.orphan(other);
                }
            }
            self.stamp[pixel] = 0;
            self.tree[pixel] = Tree::Free;
            self.parent[pixel] = NONE;
        }
    }

    /// Number of steps from a pixel to its terminal; None if the path ends at an orphan. Writes the result along
    /// the path.
    fn distance_to_terminal(&mut self, start: usize) -> Option<u32> {
        let (mut pixel, mut steps) = (start, 0);
        let distance = loop {
            if self.stamp[pixel] == self.time {
                break self.distance[pixel] + steps;
            }
            match self.parent[pixel] {
                TERMINAL => {
                    self.stamp[pixel] = self.time;
                    self.distance[pixel] = 1;
                    break steps + 1;
                }
                ORPHAN | NONE => return None,
                up => pixel = self.neighbour(pixel, up),
            }
            steps += 1;
        };
        let (mut pixel, mut left) = (start, distance);
        while self.stamp[pixel] != self.time {
            self.stamp[pixel] = self.time;
            self.distance[pixel] = left;
            left -= 1;
            pixel = self.neighbour(pixel, self.parent[pixel]);
        }
        Some(distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A random network, as `(to sink, to source)` of each pixel and `(x, y, direction, cost)` of each link.
    type Costs = (Vec<(i32, i32)>, Vec<(usize, usize, usize, i32)>);

    fn random(width: usize, height: usize, seed: u32) -> Costs {
        let mut state = seed.wrapping_mul(2_654_435_761) | 1;
        let mut below = |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 8) % n) as i32
        };
        let terminals = (0..width * height).map(|_| (below(20), below(20))).collect();
        let mut links = Vec::new();
        for y in 0..height {
            for x in 0..width {
                for (d, &(across, down)) in NEIGHBOURS.iter().enumerate().skip(4) {
                    let (nx, ny) = (x as isize + across, y as isize + down);
                    if (0..width as isize).contains(&nx) && ny < height as isize {
                        links.push((x, y, d, below(12)));
                    }
                }
            }
        }
        (terminals, links)
    }

    fn cost((terminals, links): &Costs, width: usize, source: &[bool]) -> i32 {
        let ends = terminals.iter().zip(source);
        let ends: i32 = ends.map(|(&(sink, own), &s)| if s { own } else { sink }).sum();
        let parted = links.iter().filter(|&&(x, y, d, _)| {
            let (across, down) = NEIGHBOURS[d];
            let other = (y as isize + down) as usize * width + (x as isize + across) as usize;
            source[y * width + x] != source[other]
        });
        ends + parted.map(|link| link.3).sum::<i32>()
    }

    #[test]
    fn no_other_cut_costs_less() {
        for seed in 0..300 {
            let (width, height) = [(3, 4), (4, 3), (1, 9), (6, 2), (1, 1)][seed as usize % 5];
            let costs = random(width, height, seed);
            let mut network = FlowNetwork::new(width, height);
            for (pixel, &(sink, source)) in costs.0.iter().enumerate() {
                network.set_terminal(pixel % width, pixel / width, sink, source);
            }
            for &(x, y, d, cost) in &costs.1 {
                network.link(x, y, d, cost);
            }
            let found = cost(&costs, width, &network.source_side());
            let count = width * height;
            let least = (0..1u32 << count)
                .map(|bits| {
                    let side: Vec<bool> = (0..count).map(|i| bits >> i & 1 == 1).collect();
                    cost(&costs, width, &side)
                })
                .min()
                .unwrap();
            assert_eq!(found, least, "seed {seed}");
        }
    }
}
