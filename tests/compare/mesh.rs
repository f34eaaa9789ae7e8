//! The truth's mesh covers the cells, conforming, and knows its particles.

use std::collections::HashSet;

use flockform::compare::mesh::{MeshError, TruthMesh};
use flockform::flock::lattice::Lattice;
use flockform::material::cells::Cells;
use flockform::material::stiffness::area;

use crate::support::*;

/// Nodes and sides of a linear mesh, and of the quadratic one on the same corners its nodes, by counting.
fn area_of(mesh: &flockform::fem::Mesh) -> f64 {
    let corners = mesh.kind().corners();
    let of_cell = |cell: usize| {
        let at = |&node: &u32| [mesh.x()[node as usize], mesh.y()[node as usize]];
        area(&mesh.cell(cell)[..corners].iter().map(at).collect::<Vec<_>>())
    };
    (0..mesh.cell_count()).map(of_cell).sum()
}

#[test]
fn the_mesh_is_conforming_by_eulers_formula_on_every_lattice() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        for refine in [1, 2, 3, 5] {
            let mesh = TruthMesh::new(&cells, &body.reference, refine).expect("meshes");
            let fine = mesh.mesh();
            let corners = fine.kind().corners();
            let mut sides = HashSet::new();
            let mut vertices: HashSet<u32> = HashSet::new();
            for cell in 0..fine.cell_count() {
                let nodes = &fine.cell(cell)[..corners];
                vertices.extend(nodes);
                for k in 0..corners {
                    let (a, b) = (nodes[k], nodes[(k + 1) % corners]);
                    sides.insert([a.min(b), a.max(b)]);
                }
            }
            // A body in one part without holes: vertices - sides + cells = 1.
            assert_eq!(vertices.len() + fine.cell_count(), sides.len() + 1, "{kind:?} {refine}");
            let centres = if corners == 4 { fine.cell_count() } else { 0 };
            assert_eq!(fine.node_count(), vertices.len() + sides.len() + centres, "{kind:?} {refine}");
            // Unshared nodes would make inner sides boundary sides.
            let outer = cells.boundary_sides(&cells.incidence(body.count())).len();
            assert_eq!(fine.boundary().len(), refine * outer, "{kind:?} {refine}");
        }
    }
}

#[test]
fn the_mesh_has_the_area_of_the_cells_and_cuts_each_into_as_many_parts_as_promised() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        let whole: f64 = (0..cells.count()).map(|c| area(cells.shape(c))).sum();
        for refine in [1, 4] {
            let mesh = TruthMesh::new(&cells, &body.reference, refine).expect("meshes");
            assert!((area_of(mesh.mesh()) / whole - 1.0).abs() < 1e-13, "{kind:?}");
            let fan = if cells.most_corners() == 6 { 6 } else { 1 };
            assert_eq!(mesh.mesh().cell_count(), cells.count() * fan * refine * refine, "{kind:?}");
            assert_eq!(mesh.refine(), refine);
        }
    }
}

#[test]
fn every_particle_is_a_node_and_every_node_lies_where_its_carriers_put_it() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        let mesh = TruthMesh::new(&cells, &body.reference, 3).expect("meshes");
        let fine = mesh.mesh();
        for i in 0..body.count() {
            let node = mesh.node_of(i).expect("in a cell");
            assert_eq!([fine.x()[node], fine.y()[node]], body.reference.get(i));
            assert_eq!(mesh.carriers(node).collect::<Vec<_>>(), [(i as u32, 1.0)]);
        }
        for node in 0..fine.node_count() {
            let [x, y] = mesh.interpolate(node, &body.reference);
            assert!((x - fine.x()[node]).abs() + (y - fine.y()[node]).abs() < 1e-13, "{kind:?} {node}");
            let sum: f64 = mesh.carriers(node).map(|(_, share)| share).sum();
            let count = mesh.carriers(node).count();
            assert!((sum - 1.0).abs() < 1e-14 && [1, 2, 3, 4, 6].contains(&count), "{kind:?} {node}");
        }
    }
}

#[test]
fn a_frame_and_loose_sites_have_no_node() {
    use flockform::flock::body::{Body, Cut};
    use flockform::flock::frame::FrameRule;
    use flockform::flock::neighbourhood::Neighbourhood;
    let lattice = Lattice::new(KINDS[0], [0.0; 2], 0.0);
    let cut = Cut::Count { columns: 4, rows: 3 };
    let near = Neighbourhood::Ring { radius: 1 };
    let (body, _) = Body::build(lattice, &cut, &near, Some(FrameRule::Lagged)).expect("builds");
    let mesh = TruthMesh::new(&Cells::of_body(&body), &body.reference, 2).expect("meshes");
    for i in 0..body.count() {
        assert_eq!(mesh.node_of(i).is_none(), body.is_frame[i]);
    }
    assert_eq!(mesh.mesh().node_count(), 13 * 9);
}

#[test]
fn a_body_without_cells_no_refinement_and_too_much_of_it_are_refused() {
    let (body, cells) = sample(KINDS[0]);
    let refused =
        |cells: &Cells, refine| TruthMesh::new(cells, &body.reference, refine).expect_err("refused");
    assert_eq!(refused(&cells, 0), MeshError::NotRefined);
    assert!(matches!(refused(&cells, 100_000), MeshError::TooLarge { cells: 36, refine: 100_000, .. }));
    let none = Cells { index: Vec::new(), kind: Vec::new(), ..cells };
    assert_eq!(refused(&none, 2), MeshError::NoCells);
}

#[test]
fn the_default_refinement_is_fine_for_small_bodies_and_bounded_for_large_ones() {
    for (aspect, most) in [(1, 100_000), (10, 100_000)] {
        let (body, cells) = beam(aspect);
        let refine = TruthMesh::default_refinement(&cells);
        let mesh = TruthMesh::new(&cells, &body.reference, refine).expect("meshes");
        assert!(refine >= 4 && mesh.mesh().node_count() < most, "{aspect}: {refine}");
    }
}
