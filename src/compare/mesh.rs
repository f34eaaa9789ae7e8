//! The truth's mesh: the cells of a body, each cut into many small elements.
//!
//! A quadrilateral becomes `refine` x `refine` biquadratic quadrilaterals, a triangle `refine`^2 quadratic
//! triangles, a hexagon the six triangles about its centre and each of those `refine`^2 triangles. Nodes on
//! shared sides are shared, so the mesh is conforming, and it covers the cells and nothing else.
//!
//! Every node knows the particles that its place is interpolated from (its *carriers*): a particle's own node
//! has one, a node on a side of a cell two, any other all corners of the cell. What is known at particles
//! can so be carried to the nodes.

use std::collections::HashMap;

use crate::fem::{CellKind, FemError, Mesh};
use crate::flock::points::Points;
use crate::material::cells::Cells;

/// A mesh of the default refinement has about this many nodes at most: solved within a second, and on
/// the paper's beam within 6e-5 of twice the refinement (relative L2 displacement).
const ENOUGH_NODES: usize = 80_000;
/// The default never cuts the side of a cell finer than this.
const FINEST: usize = 8;
/// More nodes than this are refused: the direct solution would not fit in memory.
const MOST_NODES: usize = 2_000_000;

/// A mesh over the cells of a body.
#[derive(Clone, Debug)]
pub struct TruthMesh {
    mesh: Mesh,
    refine: usize,
    /// Node of each particle, shape \[particles\]; `None` for those in no cell.
    node_of: Vec<Option<u32>>,
    carriers: Carriers,
}

/// Why cells cannot be meshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    #[error("the body has no cells: no particles of it are the corners of a whole cell of the lattice")]
    NoCells,
    #[error("the refinement must be at least 1, but it is 0")]
    NotRefined,
    #[error(
        "{cells} cells refined {refine} times have about {nodes} nodes, more than the {MOST_NODES} that a direct solution can take"
    )]
    TooLarge { cells: usize, refine: usize, nodes: usize },
    #[error(transparent)]
    Fem(#[from] FemError),
}

impl TruthMesh {
    /// Cuts each side of each cell into `refine` parts; `reference` are the particles \[length\].
    ///
    /// # Errors
    /// Refuses a body without cells, a refinement of 0, and more nodes than can be solved for.
    pub fn new(cells: &Cells, reference: &Points, refine: usize) -> Result<Self, MeshError> {
        if cells.count() == 0 {
            return Err(MeshError::NoCells);
        }
        if refine == 0 {
            return Err(MeshError::NotRefined);
        }
        let nodes = expected_nodes(cells, refine);
        if nodes > MOST_NODES {
            return Err(MeshError::TooLarge { cells: cells.count(), refine, nodes });
        }
        let mut cut =
            Cut { refine, carriers: Carriers::default(), sides: HashMap::new(), elements: Vec::new() };
        let node_of = cut.particles(cells, reference.len());
        for cell in cells.iter() {
            let corners: Vec<u32> = cell.iter().filter_map(|&particle| node_of[particle as usize]).collect();
            cut.cell(&corners);
        }
        let (kind, mut carriers) =
            (if cells.most_corners() == 4 { CellKind::Quad4 } else { CellKind::Tri3 }, cut.carriers);
        let (x, y) = (0..carriers.count()).map(|node| carriers.interpolate(node, reference).into()).unzip();
        let mesh = Mesh::new(kind, x, y, cut.elements)?.promoted();
        carriers.promote(&mesh);
        Ok(Self { mesh, refine, node_of, carriers })
    }

    /// The refinement at which the truth's own error is small beside that of any rule, and its solution
    /// still takes no more than seconds.
    pub fn default_refinement(cells: &Cells) -> usize {
        (1..=FINEST).rev().find(|&n| expected_nodes(cells, n) <= ENOUGH_NODES).unwrap_or(1)
    }

    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Parts into which each side of a cell is cut.
    pub fn refine(&self) -> usize {
        self.refine
    }

    /// Node of a particle; `None` if it is in no cell.
    pub fn node_of(&self, particle: usize) -> Option<usize> {
        self.node_of[particle].map(|node| node as usize)
    }

    /// Particles that a node's place is interpolated from, with their shares, which add up to 1.
    pub fn carriers(&self, node: usize) -> impl Iterator<Item = (u32, f64)> {
        self.carriers.of(node)
    }

    /// A field at the particles, shape \[particles\], carried to a node.
    pub fn interpolate(&self, node: usize, field: &Points) -> [f64; 2] {
        self.carriers.interpolate(node, field)
    }
}

/// About how many nodes the mesh will have.
fn expected_nodes(cells: &Cells, refine: usize) -> usize {
    let of_cell = match cells.most_corners() {
        3 => 2,
        4 => 4,
        _ => 12,
    };
    cells.count().saturating_mul(of_cell).saturating_mul(refine).saturating_mul(refine)
}

/// Particles and shares of every node, in compressed form.
#[derive(Clone, Debug, Default)]
struct Carriers {
    /// Where the list of each node ends.
    ends: Vec<usize>,
    particle: Vec<u32>,
    share: Vec<f64>,
}

impl Carriers {
    fn count(&self) -> usize {
        self.ends.len()
    }

    fn of(&self, node: usize) -> impl Iterator<Item = (u32, f64)> {
        let start = if node == 0 { 0 } else { self.ends[node - 1] };
        let list = start..self.ends[node];
        self.particle[list.clone()].iter().copied().zip(self.share[list].iter().copied())
    }

    fn interpolate(&self, node: usize, field: &Points) -> [f64; 2] {
        self.of(node).fold([0.0; 2], |[x, y], (particle, share)| {
            let [px, py] = field.get(particle as usize);
            [x + share * px, y + share * py]
        })
    }

    /// A new node that lies where `parts` of other nodes put it.
    fn blend(&mut self, parts: &[(u32, f64)]) -> u32 {
        let mut list: Vec<(u32, f64)> = Vec::with_capacity(8);
        for &(node, part) in parts {
            for (particle, share) in self.of(node as usize) {
                match list.iter_mut().find(|(known, _)| *known == particle) {
                    Some((_, sum)) => *sum += part * share,
                    None => list.push((particle, part * share)),
                }
            }
        }
        self.push(&list)
    }

    fn push(&mut self, list: &[(u32, f64)]) -> u32 {
        self.particle.extend(list.iter().map(|&(particle, _)| particle));
        self.share.extend(list.iter().map(|&(_, share)| share));
        self.ends.push(self.particle.len());
        (self.ends.len() - 1) as u32
    }

    /// Follows the mesh to its quadratic form, whose new nodes are numbered in order of first use.
    fn promote(&mut self, mesh: &Mesh) {
        let n = mesh.kind().corners();
        for cell in 0..mesh.cell_count() {
            let nodes = mesh.cell(cell);
            for side in 0..n {
                if nodes[n + side] as usize == self.count() {
                    self.blend(&[(nodes[side], 0.5), (nodes[(side + 1) % n], 0.5)]);
                }
            }
            if mesh.kind() == CellKind::Quad9 {
                self.blend(&[0, 1, 2, 3].map(|corner| (nodes[corner], 0.25)));
            }
        }
        debug_assert_eq!(self.count(), mesh.node_count());
    }
}

/// A linear mesh under way.
struct Cut {
    refine: usize,
    carriers: Carriers,
    /// Inner nodes of each side between two nodes, from the lower number to the higher.
    sides: HashMap<[u32; 2], Vec<u32>>,
    elements: Vec<u32>,
}

impl Cut {
    /// One node for each particle that is a corner.
    fn particles(&mut self, cells: &Cells, count: usize) -> Vec<Option<u32>> {
        let mut is_corner = vec![false; count];
        cells.index.iter().for_each(|&particle| is_corner[particle as usize] = true);
        let node = |i: usize| is_corner[i].then(|| self.carriers.push(&[(i as u32, 1.0)]));
        (0..count).map(node).collect()
    }

    fn cell(&mut self, corners: &[u32]) {
        match *corners {
            [a, b, c] => self.triangle([a, b, c]),
            [a, b, c, d] => self.quadrilateral([a, b, c, d]),
            _ => {
                let count = corners.len();
                let parts: Vec<_> = corners.iter().map(|&corner| (corner, 1.0 / count as f64)).collect();
                let centre = self.carriers.blend(&parts);
                (0..count).for_each(|k| self.triangle([corners[k], corners[(k + 1) % count], centre]));
            }
        }
    }

    /// Nodes along a side, both ends included.
    fn side(&mut self, from: u32, to: u32) -> Vec<u32> {
        let ends = [from.min(to), from.max(to)];
        let (refine, carriers) = (self.refine, &mut self.carriers);
        let inner = self.sides.entry(ends).or_insert_with(|| {
            let at = |k: usize| k as f64 / refine as f64;
            (1..refine).map(|k| carriers.blend(&[(ends[0], 1.0 - at(k)), (ends[1], at(k))])).collect()
        });
        let mut nodes = vec![ends[0]];
        nodes.extend(&*inner);
        nodes.push(ends[1]);
        if from > to {
            nodes.reverse();
        }
        nodes
    }

    fn quadrilateral(&mut self, [a, b, c, d]: [u32; 4]) {
        let n = self.refine;
        let (bottom, top) = (self.side(a, b), self.side(d, c));
        let (left, right) = (self.side(a, d), self.side(b, c));
        let mut rows = vec![bottom];
        for j in 1..n {
            let t = j as f64 / n as f64;
            let inner = |i: usize| {
                let s = i as f64 / n as f64;
                let parts = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
                self.carriers.blend(&[(a, parts[0]), (b, parts[1]), (c, parts[2]), (d, parts[3])])
            };
            let mut row = vec![left[j]];
            row.extend((1..n).map(inner));
            row.push(right[j]);
            rows.push(row);
        }
        rows.push(top);
        for (low, high) in rows.iter().zip(&rows[1..]) {
            for i in 0..n {
                self.elements.extend([low[i], low[i + 1], high[i + 1], high[i]]);
            }
        }
    }

    fn triangle(&mut self, [a, b, c]: [u32; 3]) {
        let n = self.refine;
        let (bottom, left, slope) = (self.side(a, b), self.side(a, c), self.side(b, c));
        let mut rows = vec![bottom];
        for j in 1..=n {
            let inner = |i: usize| {
                let [s, t] = [i, j].map(|k| k as f64 / n as f64);
                self.carriers.blend(&[(a, 1.0 - s - t), (b, s), (c, t)])
            };
            let mut row = vec![left[j]];
            row.extend((1..n - j).map(inner));
            if j < n {
                row.push(slope[j]);
            }
            rows.push(row);
        }
        for (low, high) in rows.iter().zip(&rows[1..]) {
            for i in 0..high.len() {
                self.elements.extend([low[i], low[i + 1], high[i]]);
                if i + 1 < high.len() {
                    self.elements.extend([low[i + 1], high[i + 1], high[i]]);
                }
            }
        }
    }
}
