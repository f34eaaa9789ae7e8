use super::*;
use crate::flock::body::Cut;
use crate::geometry::point::area;
use crate::material::elastic::{Constants, Plane};

fn body(kind: LatticeKind, orientation: f64) -> (Body, Neighbours) {
    let lattice = Lattice::new(kind, [5.0, -3.0], orientation);
    let neighbourhood = neighbourhood(&lattice);
    Body::build(lattice, &Cut::Count { columns: 9, rows: 9 }, &neighbourhood, None).expect("builds")
}

#[test]
fn cells_run_counter_clockwise_and_each_particle_has_its_share_of_them() {
    for kind in LatticeKind::SAMPLES {
        for orientation in [0.0, 2.0] {
            let (body, _) = body(kind, orientation);
            let cells = Cells::of_body(&body);
            let on_points = cells.on_points(&body.reference);
            let cell_area = area(cells.shape(0));
            for cell in 0..cells.count() {
                assert!((area(on_points.shape(cell)) - cell_area).abs() < 1e-12, "{kind:?}");
            }
            // One lattice cell for each particle: as many cells as fill its Voronoi area.
            let around_each = cells.most_corners() as f64 * body.lattice.cell_area() / cell_area;
            let incidence = cells.incidence(body.count());
            let most = (0..body.count()).map(|i| incidence.of(i).len()).max();
            assert_eq!(most, Some(around_each.round() as usize), "{kind:?}");
        }
    }
}

#[test]
fn mates_are_the_neighbourhood_that_the_room_asks_for() {
    for kind in LatticeKind::SAMPLES {
        let (body, neighbours) = body(kind, 0.4);
        let cell_neighbours = Cells::of_body(&body).cell_neighbours(body.count());
        let fullest = (0..body.count()).max_by_key(|&i| cell_neighbours.of(i).len()).expect("particles");
        let mut asked = neighbours.of(fullest).to_vec();
        asked.sort_unstable();
        assert_eq!(asked, cell_neighbours.of(fullest), "{kind:?}");
    }
}

#[test]
fn a_material_that_averages_dilatations_has_the_mates_of_mates_for_neighbours() {
    let constants = |poisson| Constants::Isotropic { young: 1.0, poisson, plane: Plane::Strain };
    let elastic = |poisson| Elastic::new(constants(poisson), 1.0).expect("admissible");
    for kind in LatticeKind::SAMPLES {
        let lattice = Lattice::new(kind, [5.0, -3.0], 0.4);
        let cut = Cut::Count { columns: 15, rows: 15 };
        for poisson in [0.3, 0.49] {
            let near = neighbourhood_of(&lattice, &elastic(poisson));
            let (body, neighbours) = Body::build(lattice.clone(), &cut, &near, None).expect("builds");
            let cells = Cells::of_body(&body);
            let needed = cells.neighbours(body.count(), &elastic(poisson));
            let fullest = (0..body.count()).max_by_key(|&i| needed.of(i).len()).expect("particles");
            let mut asked = neighbours.of(fullest).to_vec();
            asked.sort_unstable();
            assert_eq!(asked, needed.of(fullest), "{kind:?}");
        }
    }
}

#[test]
fn a_frame_has_no_cells() {
    let lattice = Lattice::new(LatticeKind::SAMPLES[0], [0.0; 2], 0.0);
    let frame = crate::flock::frame::FrameRule::Lagged;
    let cut = Cut::Count { columns: 4, rows: 3 };
    let (body, _) =
        Body::build(lattice, &cut, &Neighbourhood::Chebyshev { radius: 1 }, Some(frame)).expect("builds");
    let cells = Cells::of_body(&body);
    assert_eq!(cells.count(), 6);
    assert!(cells.index.iter().all(|&i| !body.is_frame[i as usize]));
}

#[test]
fn the_boundary_of_a_rectangle_runs_around_it_once() {
    let (body, _) = body(LatticeKind::SAMPLES[0], 0.0);
    let cells = Cells::of_body(&body);
    let sides = cells.boundary_sides(&cells.incidence(body.count()));
    assert_eq!(sides.len(), 32);
    let enclosed: f64 = sides
        .iter()
        .map(|&[a, b]| {
            let (a, b) = (body.reference.get(a as usize), body.reference.get(b as usize));
            0.5 * (a[0] * b[1] - a[1] * b[0])
        })
        .sum();
    assert!((enclosed - 64.0).abs() < 1e-12);
}
