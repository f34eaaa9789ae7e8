//! Building meshes: rectangles, their images under a map, and quadratic meshes from linear ones.

use std::collections::HashMap;

use super::element::CellKind;
use super::error::FemError;
use super::mesh::Mesh;

impl Mesh {
    /// The rectangle from corner `low` to corner `high` \[m\], cut into `cells` = [nx, ny] equal
    /// quadrilaterals, each of them into two triangles by the diagonal from its low corner to its high one
    /// if the kind asks for it.
    ///
    /// Corner node (i, j) of the grid has number j (nx + 1) + i; the quadratic kinds number their further
    /// nodes after all the corners, as [`Mesh::promoted`] does.
    ///
    /// # Errors
    /// [`FemError::Length`] if nx or ny is 0; [`FemError::NotFinite`] or [`FemError::InvertedCell`] if
    /// the corners span no area.
    pub fn rectangle(
        kind: CellKind,
        cells: [usize; 2],
        low: [f64; 2],
        high: [f64; 2],
    ) -> Result<Mesh, FemError> {
        let [nx, ny] = cells;
        let at = |i: usize, n: usize, axis: usize| {
            let t = i as f64 / n as f64;
            low[axis] * (1.0 - t) + high[axis] * t
        };
        let grid = (0..=ny).flat_map(|j| (0..=nx).map(move |i| (i, j)));
        let (x, y) = grid.map(|(i, j)| (at(i, nx, 0), at(j, ny, 1))).unzip();
        let mut list = Vec::with_capacity(4 * nx * ny);
        for (j, i) in (0..ny).flat_map(|j| (0..nx).map(move |i| (j, i))) {
            let a = (j * (nx + 1) + i) as u32;
            let (b, d) = (a + 1, a + nx as u32 + 1);
            let c = d + 1;
            match kind.corners() {
                3 => list.extend([a, b, c, a, c, d]),
                _ => list.extend([a, b, c, d]),
            }
        }
        let linear = if kind.corners() == 3 { CellKind::Tri3 } else { CellKind::Quad4 };
        let mesh = Mesh::new(linear, x, y, list)?;
        Ok(if kind == linear { mesh } else { mesh.promoted() })
    }

    /// The same cells with every node moved to `map(x, y)` \[m\]: an annulus, a tapered panel, a plate with a
    /// hole. The map must keep the orientation. The middles of the sides are moved too, so the quadratic
    /// kinds follow a curved boundary to third order.
    ///
    /// # Errors
    /// [`FemError::NotFinite`] or [`FemError::InvertedCell`] for what the map spoils.
    pub fn mapped(&self, map: impl Fn(f64, f64) -> [f64; 2]) -> Result<Mesh, FemError> {
        let (x, y) = self.x().iter().zip(self.y()).map(|(&x, &y)| map(x, y).into()).unzip();
        Mesh::new(self.kind(), x, y, self.cells().to_vec())
    }

    /// The quadratic mesh with the same corners: Tri3 becomes Tri6, Quad4 becomes Quad9, with straight
    /// sides. Old nodes keep their numbers; middles of sides (once per shared side) and centres follow in
    /// order of first use. A quadratic mesh is returned as it is.
    pub fn promoted(&self) -> Mesh {
        let kind = match self.kind() {
            CellKind::Tri3 => CellKind::Tri6,
            CellKind::Quad4 => CellKind::Quad9,
            CellKind::Tri6 | CellKind::Quad9 => return self.clone(),
        };
        let (mut x, mut y) = (self.x().to_vec(), self.y().to_vec());
        let mut middle: HashMap<[u32; 2], u32> = HashMap::new();
        let mut cells = Vec::with_capacity(self.cell_count() * kind.nodes());
        for c in 0..self.cell_count() {
            let corners = self.cell(c);
            let mut mean = |of: &[u32]| {
                let average = |v: &[f64]| of.iter().map(|&n| v[n as usize]).sum::<f64>() / of.len() as f64;
                let (mx, my) = (average(&x), average(&y));
                x.push(mx);
                y.push(my);
                (x.len() - 1) as u32
            };
            cells.extend_from_slice(corners);
            for (s, &a) in corners.iter().enumerate() {
                let b = corners[(s + 1) % corners.len()];
                cells.push(*middle.entry([a.min(b), a.max(b)]).or_insert_with(|| mean(&[a, b])));
            }
            if kind == CellKind::Quad9 {
                cells.push(mean(corners));
            }
        }
        Mesh::new(kind, x, y, cells).expect("straight-sided quadratic cells of a sound mesh are sound")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_has_the_expected_nodes_cells_and_area_for_every_kind() {
        for (kind, nodes, cells) in [
            (CellKind::Tri3, 20, 24),
            (CellKind::Tri6, 63, 24),
            (CellKind::Quad4, 20, 12),
            (CellKind::Quad9, 63, 12),
        ] {
            let mesh = Mesh::rectangle(kind, [4, 3], [1.0, 2.0], [5.0, 3.0]).unwrap();
            assert_eq!((mesh.node_count(), mesh.cell_count()), (nodes, cells), "{kind:?}");
            let rule = kind.stiffness_rule();
            let area: f64 = (0..cells)
                .map(|c| {
                    let at = mesh.positions(c);
                    rule.points.iter().map(|(s, w)| w * s.determinant(&at[..kind.nodes()])).sum::<f64>()
                })
                .sum();
            assert!((area - 4.0).abs() < 1e-13, "{kind:?}: {area}");
        }
    }

    #[test]
    fn a_map_that_mirrors_or_an_empty_rectangle_is_refused() {
        let mesh = Mesh::rectangle(CellKind::Quad9, [2, 2], [0.0, 0.0], [1.0, 1.0]).unwrap();
        assert!(matches!(mesh.mapped(|x, y| [-x, y]), Err(FemError::InvertedCell { cell: 0, .. })));
        let empty = Mesh::rectangle(CellKind::Quad4, [0, 2], [0.0, 0.0], [1.0, 1.0]);
        assert!(matches!(empty, Err(FemError::Length { .. })), "{empty:?}");
    }
}
