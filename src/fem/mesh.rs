//! Unstructured meshes of quadratic triangles in the plane.

use std::collections::HashMap;

use super::element::{CORNERS, NODES, Pairs, REFERENCE_NODES, Rule, Shape, side_nodes};
use super::error::FemError;
use crate::geometry::lists::Lists;
use crate::geometry::point::bounds;

/// Quadratic triangles: the nodes as parallel arrays, and those of each cell: corners counter-clockwise, then the middle of
/// the side behind each. Coordinates are finite and every cell has positive area.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    x: Vec<f64>,
    y: Vec<f64>,
    cells: Vec<[u32; NODES]>,
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
    /// A mesh from node coordinates `x`, `y` \[m\] and the node numbers of each cell.
    ///
    /// # Errors
    /// [`FemError::NotFinite`] or [`FemError::InvertedCell`].
    pub(crate) fn new(x: Vec<f64>, y: Vec<f64>, cells: Vec<[u32; NODES]>) -> Result<Mesh, FemError> {
        if let Some(index) = (0..x.len()).find(|&i| !(x[i].is_finite() && y[i].is_finite())) {
            return Err(FemError::NotFinite { what: "node", index });
        }
        let mesh = Mesh { x, y, cells };
        mesh.check_cells()?;
        Ok(mesh)
    }

    /// The determinant must be positive at the quadrature points and not negative at the nodes, compared
    /// with the square of the cell's diameter.
    fn check_cells(&self) -> Result<(), FemError> {
        let (inner, outer) = (Rule::of_stiffness(), REFERENCE_NODES.map(Shape::at));
        for cell in 0..self.cell_count() {
            let at = self.positions(cell);
            let (low, high) = bounds(at);
            let slack = 1e-12 * ((high[0] - low[0]).powi(2) + (high[1] - low[1]).powi(2));
            let inside = inner.points.iter().map(|(s, _)| s.determinant(&at)).fold(f64::MAX, f64::min);
            let at_nodes = outer.iter().map(|s| s.determinant(&at)).fold(f64::MAX, f64::min);
            if inside <= slack || at_nodes < -slack {
                return Err(FemError::InvertedCell { cell, determinant: inside.min(at_nodes) });
            }
        }
        Ok(())
    }

    /// Abscissae of the nodes \[m\], shape \[nodes\].
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Ordinates of the nodes \[m\], shape \[nodes\].
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// Node numbers of the cells, shape \[cells\].
    pub fn cells(&self) -> &[[u32; 6]] {
        &self.cells
    }

    /// Node numbers of one cell.
    pub(crate) fn cell(&self, cell: usize) -> &[u32; NODES] {
        &self.cells[cell]
    }

    /// Number of nodes.
    pub(crate) fn node_count(&self) -> usize {
        self.x.len()
    }

    /// Number of cells.
    pub(crate) fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// Node positions of a cell.
    pub(crate) fn positions(&self, cell: usize) -> Pairs {
        self.gather(cell, &self.x, &self.y)
    }

    /// Two nodal fields brought together over one cell.
    pub(crate) fn gather(&self, cell: usize, a: &[f64], b: &[f64]) -> Pairs {
        self.cells[cell].map(|node| [a[node as usize], b[node as usize]])
    }

    /// Nodes whose position (x, y) \[m\] satisfies `inside`, ascending.
    pub fn nodes_where(&self, inside: impl Fn(f64, f64) -> bool) -> Vec<u32> {
        (0..self.x.len()).filter(|&i| inside(self.x[i], self.y[i])).map(|i| i as u32).collect()
    }

    /// Sides that belong to one cell only, in order of cell and side.
    pub(crate) fn boundary(&self) -> Vec<Side> {
        let mut owners: HashMap<[usize; 2], u32> = HashMap::new();
        let ends = |s: Side| {
            let [a, b, _] = self.side_nodes(s);
            [a.min(b), a.max(b)]
        };
        for side in self.sides() {
            *owners.entry(ends(side)).or_default() += 1;
        }
        self.sides().filter(|&s| owners[&ends(s)] == 1).collect()
    }

    fn sides(&self) -> impl Iterator<Item = Side> {
        let of_cell = |cell| (0..CORNERS as u32).map(move |side| Side { cell, side });
        (0..self.cell_count() as u32).flat_map(of_cell)
    }

    /// Node numbers of a side that exists: start, end and middle.
    pub(crate) fn side_nodes(&self, side: Side) -> [usize; 3] {
        let cell = self.cell(side.cell as usize);
        side_nodes(side.side as usize).map(|local| cell[local] as usize)
    }

    /// The same cells, sharing nodes with cells of the same part alone; `part` by cell. Nodes are copied behind the others,
    /// which keep their numbers; the second array has the node that each is at.
    pub(crate) fn parted(&self, part: impl Fn(usize) -> u32) -> (Mesh, Vec<u32>) {
        let mut own = vec![None; self.node_count()];
        let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
        let (mut mesh, mut at): (Mesh, Vec<u32>) = (self.clone(), (0..self.node_count() as u32).collect());
        for (place, node) in mesh.cells.as_flattened_mut().iter_mut().enumerate() {
            let part = part(place / NODES);
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

    /// For each node the cells that use it, ascending.
    pub(crate) fn cells_of_nodes(&self) -> Lists {
        let nodes = || self.cells.as_flattened().iter().enumerate();
        Lists::sorted(self.node_count(), || nodes().map(|(at, &node)| (node, (at / NODES) as u32)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clockwise_or_flat_cell_is_named_by_its_index_and_a_node_that_is_nowhere_by_its_own() {
        let unit = Mesh::rectangle([1, 1], [0.0, 0.0], [1.0, 1.0]);
        let new = |cells: &[[u32; NODES]]| Mesh::new(unit.x.clone(), unit.y.clone(), cells.to_vec());
        let [first, [a, b, c, ab, bc, ca]] = *unit.cells() else { panic!("two cells") };
        let refused = new(&[first, [a, c, b, ca, bc, ab]]);
        assert!(matches!(refused, Err(FemError::InvertedCell { cell: 1, .. })), "{refused:?}");
        assert!(new(&[first, [a, b, c, ab, bc, ca]]).is_ok());
        let flat = unit.mapped(|x, _| [x, x]);
        assert!(matches!(flat, Err(FemError::InvertedCell { cell: 0, .. })), "{flat:?}");
        let mirrored = unit.mapped(|x, y| [-x, y]);
        assert!(matches!(mirrored, Err(FemError::InvertedCell { cell: 0, .. })), "{mirrored:?}");
        // The middle of the diagonal beyond the opposite corner.
        let folded = unit.mapped(|x, y| if (x, y) == (0.5, 0.5) { [1.1, -0.1] } else { [x, y] });
        assert!(matches!(folded, Err(FemError::InvertedCell { cell: 0, .. })), "{folded:?}");
        let nan = unit.mapped(|x, y| [if x == 0.5 { f64::NAN } else { x }, y]);
        assert_eq!(nan, Err(FemError::NotFinite { what: "node", index: 1 }));
    }

    #[test]
    fn a_rectangle_has_the_expected_nodes_cells_area_and_each_outer_side_once() {
        let mesh = Mesh::rectangle([4, 3], [1.0, 2.0], [5.0, 3.0]);
        assert_eq!((mesh.node_count(), mesh.cell_count()), (63, 24));
        let area = |cell: usize| -> f64 {
            let at = mesh.positions(cell);
            Rule::of_stiffness().points.iter().map(|(s, w)| w * s.determinant(&at)).sum()
        };
        let area: f64 = (0..mesh.cell_count()).map(area).sum();
        assert!((area - 4.0).abs() < 1e-13, "{area}");
        assert_eq!(mesh.boundary().len(), 14);
        assert_eq!(mesh.boundary_where(|x, _| x > 4.999).len(), 3);
    }
}
