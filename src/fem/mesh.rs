//! Unstructured meshes of one cell kind in the plane.

use std::collections::HashMap;

use super::element::{CellKind, MAX_NODES};
use super::error::FemError;
use crate::geometry::lists::lists_of;

/// Nodes as parallel arrays and cells as one flat list. Always sound: indices exist, every node is used,
/// coordinates are finite and every cell has positive area, nodes counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    kind: CellKind,
    x: Vec<f64>,
    y: Vec<f64>,
    cells: Vec<u32>,
}

/// One side of one cell: side s runs from corner s to corner s + 1, counter-clockwise, so the outward
/// normal is on its right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Side {
    /// The cell, from 0.
    pub cell: u32,
    /// The side of that cell, from 0.
    pub side: u32,
}

impl Mesh {
    /// A mesh from node coordinates `x`, `y` \[m\], shape \[nodes\], and the node numbers of each cell one
    /// after the other, shape [cells * kind.nodes()], in the order given in [`CellKind`]'s module:
    /// corners counter-clockwise, middles of the sides, centre.
    ///
    /// # Errors
    /// [`FemError::Length`], [`FemError::NoSuch`], [`FemError::NotFinite`], [`FemError::UnusedNode`] or
    /// [`FemError::InvertedCell`] for arrays that are not a mesh.
    pub fn new(kind: CellKind, x: Vec<f64>, y: Vec<f64>, cells: Vec<u32>) -> Result<Mesh, FemError> {
        if x.len() != y.len() {
            return Err(FemError::Length { what: "y", found: y.len(), expected: x.len().to_string() });
        }
        if cells.is_empty() || !cells.len().is_multiple_of(kind.nodes()) {
            let expected = format!("a positive multiple of {}", kind.nodes());
            return Err(FemError::Length { what: "cells", found: cells.len(), expected });
        }
        if let Some(index) = (0..x.len()).find(|&i| !(x[i].is_finite() && y[i].is_finite())) {
            return Err(FemError::NotFinite { what: "node", index });
        }
        let mut used = vec![false; x.len()];
        for &node in &cells {
            let index = node as usize;
            *used.get_mut(index).ok_or(FemError::NoSuch { what: "node", index, count: x.len() })? = true;
        }
        if let Some(node) = used.iter().position(|&u| !u) {
            return Err(FemError::UnusedNode { node });
        }
        let mesh = Mesh { kind, x, y, cells };
        mesh.check_cells()?;
        Ok(mesh)
    }

    /// The determinant must be positive at the quadrature points and not negative at the nodes, compared
    /// with the square of the cell's diameter.
    fn check_cells(&self) -> Result<(), FemError> {
        let inner = self.kind.stiffness_rule();
        let outer: Vec<_> = self.kind.reference_nodes().iter().map(|&p| self.kind.shape(p)).collect();
        for cell in 0..self.cell_count() {
            let at = self.positions(cell);
            let at = &at[..self.kind.nodes()];
            let extent = |i: usize| {
                let (low, high) =
                    at.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[i]), h.max(p[i])));
                high - low
            };
            let slack = 1e-12 * (extent(0).powi(2) + extent(1).powi(2));
            let inside = inner.points.iter().map(|(s, _)| s.determinant(at)).fold(f64::MAX, f64::min);
            let at_nodes = outer.iter().map(|s| s.determinant(at)).fold(f64::MAX, f64::min);
            if inside <= slack || at_nodes < -slack {
                return Err(FemError::InvertedCell { cell, determinant: inside.min(at_nodes) });
            }
        }
        Ok(())
    }

    /// The kind of every cell.
    pub fn kind(&self) -> CellKind {
        self.kind
    }

    /// Abscissae of the nodes \[m\], shape \[nodes\].
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Ordinates of the nodes \[m\], shape \[nodes\].
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// Node numbers, shape [cells * kind.nodes()].
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }

    /// Node numbers of one cell, shape [kind.nodes()].
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.cells[cell * self.kind.nodes()..][..self.kind.nodes()]
    }

    /// Number of nodes.
    pub(crate) fn node_count(&self) -> usize {
        self.x.len()
    }

    /// Number of cells.
    pub(crate) fn cell_count(&self) -> usize {
        self.cells.len() / self.kind.nodes()
    }

    /// Centre of a cell \[m\]: the image of the reference cell's centre.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn centre(&self, cell: usize) -> [f64; 2] {
        let at = self.positions(cell);
        self.kind.shape(self.kind.reference_centre()).interpolate(&at[..self.kind.nodes()])
    }

    /// Node positions of a cell, padded to the largest kind.
    pub(crate) fn positions(&self, cell: usize) -> [[f64; 2]; MAX_NODES] {
        self.gather(cell, &self.x, &self.y)
    }

    /// Two nodal fields brought together over one cell, padded to the largest kind.
    pub(crate) fn gather(&self, cell: usize, a: &[f64], b: &[f64]) -> [[f64; 2]; MAX_NODES] {
        let mut out = [[0.0; 2]; MAX_NODES];
        for (slot, &node) in out.iter_mut().zip(self.cell(cell)) {
            *slot = [a[node as usize], b[node as usize]];
        }
        out
    }

    /// Nodes whose position (x, y) \[m\] satisfies `inside`, ascending.
    pub fn nodes_where(&self, inside: impl Fn(f64, f64) -> bool) -> Vec<u32> {
        (0..self.x.len()).filter(|&i| inside(self.x[i], self.y[i])).map(|i| i as u32).collect()
    }

    /// Sides that belong to one cell only, in order of cell and side.
    pub fn boundary(&self) -> Vec<Side> {
        let mut owners: HashMap<[u32; 2], u32> = HashMap::new();
        let ends = |s: Side| {
            let (cell, n) = (self.cell(s.cell as usize), self.kind.corners());
            let (a, b) = (cell[s.side as usize], cell[(s.side as usize + 1) % n]);
            [a.min(b), a.max(b)]
        };
        for side in self.sides() {
            *owners.entry(ends(side)).or_default() += 1;
        }
        self.sides().filter(|&s| owners[&ends(s)] == 1).collect()
    }

    /// Boundary sides all of whose nodes satisfy `inside`.
    pub fn boundary_where(&self, inside: impl Fn(f64, f64) -> bool) -> Vec<Side> {
        let mut sides = self.boundary();
        sides.retain(|&s| self.side_nodes(s).all(|n| inside(self.x[n], self.y[n])));
        sides
    }

    fn sides(&self) -> impl Iterator<Item = Side> {
        let n = self.kind.corners() as u32;
        (0..self.cell_count() as u32).flat_map(move |cell| (0..n).map(move |side| Side { cell, side }))
    }

    /// Node numbers of a side that exists: start, end and, for the quadratic kinds, middle.
    pub(crate) fn side_nodes(&self, side: Side) -> impl Iterator<Item = usize> {
        let cell = self.cell(side.cell as usize);
        self.kind.side_nodes(side.side as usize).map(|local| cell[local] as usize)
    }

    /// The same cells, sharing nodes with cells of the same part alone; `part` by cell. Nodes are copied behind the others,
    /// which keep their numbers; the second array has the node that each is at.
    pub(crate) fn parted(&self, part: impl Fn(usize) -> u32) -> (Mesh, Vec<u32>) {
        let mut own = vec![None; self.node_count()];
        let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
        let (mut mesh, mut at): (Mesh, Vec<u32>) = (self.clone(), (0..self.node_count() as u32).collect());
        for (place, node) in mesh.cells.iter_mut().enumerate() {
            let part = part(place / self.kind.nodes());
            if *own[*node as usize].get_or_insert(part) != part {
                *node = *copies.entry((*node, part)).or_insert_with(|| {
                    at.push(*node);
                    at.len() as u32 - 1
                });
            }
        }
        let of = |values: &[f64]| at.iter().map(|&node| values[node as usize]).collect();
        (mesh.x, mesh.y) = (of(&self.x), of(&self.y));
        (mesh, at)
    }

    /// For each node the cells that use it, ascending: list i is `cells[start[i]..start[i + 1]]`.
    pub(crate) fn cells_of_nodes(&self) -> (Vec<u32>, Vec<u32>) {
        let cell = |at: usize| (at / self.kind.nodes()) as u32;
        lists_of(self.node_count(), || self.cells.iter().enumerate().map(|(at, &node)| (node, cell(at))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(x: Vec<f64>, y: Vec<f64>, cells: Vec<u32>) -> Result<Mesh, FemError> {
        Mesh::new(CellKind::Tri3, x, y, cells)
    }

    #[test]
    fn a_clockwise_cell_is_named_by_its_index() {
        let (x, y) = (vec![0.0, 1.0, 1.0, 0.0], vec![0.0, 0.0, 1.0, 1.0]);
        let refused = triangle(x.clone(), y.clone(), vec![0, 1, 2, 0, 3, 2]);
        assert!(matches!(refused, Err(FemError::InvertedCell { cell: 1, .. })), "{refused:?}");
        assert!(triangle(x, y, vec![0, 1, 2, 0, 2, 3]).is_ok());
    }

    #[test]
    fn a_quadrilateral_with_a_re_entrant_corner_and_a_flat_triangle_are_refused() {
        let dart = Mesh::new(
            CellKind::Quad4,
            vec![0.0, 1.0, 0.45, 0.0],
            vec![0.0, 0.0, 0.45, 1.0],
            vec![0, 1, 2, 3],
        );
        assert!(matches!(dart, Err(FemError::InvertedCell { cell: 0, .. })), "{dart:?}");
        let flat = triangle(vec![0.0, 0.1, 0.3], vec![0.0, 0.1, 0.3], vec![0, 1, 2]);
        assert!(matches!(flat, Err(FemError::InvertedCell { cell: 0, .. })), "{flat:?}");
    }

    #[test]
    fn arrays_that_are_not_a_mesh_are_refused_by_name() {
        let (x, y) = (vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 1.0]);
        assert!(matches!(
            triangle(x.clone(), vec![0.0], vec![0, 1, 2]),
            Err(FemError::Length { what: "y", .. })
        ));
        assert!(matches!(
            triangle(x.clone(), y.clone(), vec![0, 1]),
            Err(FemError::Length { what: "cells", .. })
        ));
        let past = triangle(x.clone(), y.clone(), vec![0, 1, 7]);
        assert_eq!(past, Err(FemError::NoSuch { what: "node", index: 7, count: 3 }));
        let lone = triangle(vec![0.0, 1.0, 0.0, 5.0], vec![0.0, 0.0, 1.0, 5.0], vec![0, 1, 2]);
        assert_eq!(lone, Err(FemError::UnusedNode { node: 3 }));
        let nan = triangle(vec![0.0, f64::NAN, 0.0], y, vec![0, 1, 2]);
        assert_eq!(nan, Err(FemError::NotFinite { what: "node", index: 1 }));
    }

    #[test]
    fn the_boundary_of_a_rectangle_has_each_outer_side_once() {
        for kind in CellKind::ALL {
            let mesh = Mesh::rectangle(kind, [4, 3], [0.0, 0.0], [2.0, 1.0]).unwrap();
            assert_eq!(mesh.boundary().len(), 14, "{kind:?}");
            assert_eq!(mesh.boundary_where(|x, _| x > 1.999).len(), 3, "{kind:?}");
        }
    }
}
