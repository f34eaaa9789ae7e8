//! What cannot carry a material is refused with the reason.

use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::Lattice;
use flockform::flock::neighbourhood::Neighbourhood;
use flockform::flock::vectors::Vectors;
use flockform::geometry::shape::Shape;
use flockform::material::cells::{Cells, neighbourhood};
use flockform::material::mechanism::Mechanism;
use flockform::material::weights::WeightsError;

use crate::support::*;

#[test]
fn neighbours_that_cannot_carry_the_material_are_refused_with_the_reason() {
    for (kind, few) in [
        (KINDS[0], Neighbourhood::First { keep: None }),
        (KINDS[3], Neighbourhood::First { keep: Some(4) }),
        (KINDS[5], Neighbourhood::Second),
    ] {
        let (body, neighbours, cells) = of_whole_cells(&Lattice::new(kind, [0.0; 2], 0.0), &CUT, &few);
        let refused = MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1.0, 0.3));
        let Err(error @ WeightsError::MissingNeighbour { .. }) = refused else {
            panic!("{kind:?}: {refused:?}")
        };
        let message = error.to_string();
        assert!(message.contains("cannot carry shear coupling"), "{message}");
        assert_eq!(message.contains("diagonal pairs are missing"), kind == KINDS[0], "{message}");
    }
}

const CUT: Cut = Cut::Count { columns: 6, rows: 6 };

#[test]
fn more_neighbours_than_cells_need_change_nothing() {
    let lattice = Lattice::new(KINDS[0], [0.0; 2], 0.0);
    let (body, many) =
        Body::build(lattice, &CUT, &Neighbourhood::Chebyshev { radius: 2 }, None).expect("builds");
    let cells = Cells::of_body(&body);
    let elastic = sheet(1000.0, 0.33);
    let few = MaterialWeights::assemble(&cells, &body, cells.cell_neighbours(body.count()), &elastic)
        .expect("fits");
    let many = MaterialWeights::assemble(&cells, &body, many, &elastic).expect("fits");
    let field: Vectors = body.reference.iter().map(|[x, y]| [x * y, (x - y).sin()]).collect();
    for i in 0..body.count() {
        let (a, b) = (few.force(i, &field), many.force(i, &field));
        assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-10);
    }
}

#[test]
fn a_particle_in_no_cell_is_refused_by_name_and_the_body_without_it_passes() {
    // The outermost sites of a disc on a square lattice stick out.
    let disc = Cut::Shape(Shape::Disc { centre: [0.0, 0.0], radius: 3.0 });
    let lattice = Lattice::new(KINDS[0], [0.0; 2], 0.0);
    let (body, neighbours, cells) = build(lattice.clone(), &disc);
    let refused = MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1.0, 0.3));
    assert_eq!(refused, Err(WeightsError::Mechanism(Mechanism::NoCell { particle: 1 })));
    let (smaller, neighbours, cells) = of_whole_cells(&lattice, &disc, &neighbourhood(&lattice));
    assert_eq!(smaller.count(), body.count() - 4);
    assert!(MaterialWeights::assemble(&cells, &smaller, neighbours, &sheet(1.0, 0.3)).is_ok());
}

#[test]
fn a_body_that_folds_at_a_corner_is_refused_by_name() {
    // Two squares that touch at one site, as an hourglass lying on its side.
    let left = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
    let right = left.map(|[x, y]| [x + 2.0, y + 2.0]);
    let vertices = [left[0], left[1], right[0], right[1], right[2], right[3], left[2], left[3]].to_vec();
    let cut = Cut::Shape(Shape::Polygon { vertices });
    let (body, neighbours, cells) = build(Lattice::new(KINDS[0], [0.0; 2], 0.0), &cut);
    let at = (0..body.count()).find(|&i| body.reference.get(i) == [2.0, 2.0]).expect("a particle");
    let refused = MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1.0, 0.3));
    assert_eq!(refused, Err(WeightsError::Mechanism(Mechanism::Hinge { particle: at + 1 })));
}
