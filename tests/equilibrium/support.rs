//! Bodies on all lattices, as systems to be solved.

use flockform::flock::block::{Block, plus};
use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::rules::Rotation;
use flockform::flock::vectors::Vectors;
use flockform::material::cells::{Cells, neighbourhood};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::weights::assemble;
use flockform::solve::equilibrium::{Choice, Request, Solved, Solver, System, solve};
use flockform::solve::operator::{Operator, Row};

pub const KINDS: [LatticeKind; 6] = LatticeKind::SAMPLES;

/// How a particle's neighbours pull on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feel {
    /// As the cells between them would.
    Material,
    /// All alike (Eq. 1), and so many neighbours that the rule is one of them.
    Barycentre,
}

pub const FEELS: [Feel; 2] = [Feel::Material, Feel::Barycentre];

pub fn grid(lattice: &Lattice) -> [[f64; 2]; 2] {
    [lattice.vector([1, 0]), lattice.vector([0, 1])]
}

/// Shapes cut from a rectangle: whether there is matter at a place, both coordinates from 0 to 1.
pub type Shape = fn([f64; 2]) -> bool;

pub fn plate(_: [f64; 2]) -> bool {
    true
}

/// A round hole and a slit from the upper edge.
pub fn holed([x, y]: [f64; 2]) -> bool {
    let slit = (0.7..0.8).contains(&x) && y > 0.75;
    (x - 0.4).hypot(y - 0.5) > 0.2 && !slit
}

/// Thin legs, held at one end, that join at the other.
pub fn fork([x, y]: [f64; 2]) -> bool {
    !(0.1..0.85).contains(&x) || (y * 4.0).fract() < 0.45
}

/// A rectangle of sites cut to a shape, less what is in no cell.
pub fn body(kind: LatticeKind, [columns, rows]: [u32; 2], shape: Shape) -> (Body, Neighbours) {
    let lattice = Lattice::new(kind, [3.0, -2.0], 0.3);
    let near = neighbourhood(&lattice);
    let (full, _) = Body::build(lattice, &Cut::Count { columns, rows }, &near, None).expect("fits");
    let mut body = full.clone();
    let last = full.sites[full.count() - 1];
    let across = f64::from(last[0] + 1);
    let place = |[i, j]: [i32; 2]| [(f64::from(i) + 0.5) / across, (f64::from(j) + 0.5) / f64::from(rows)];
    let keep: Vec<usize> = (0..full.count()).filter(|&i| shape(place(full.sites[i]))).collect();
    body.sites = keep.iter().map(|&i| full.sites[i]).collect();
    body.reference = keep.iter().map(|&i| full.reference.get(i)).collect::<Vectors>().into();
    body.is_frame = vec![false; keep.len()];
    keep_largest_part(&mut body);
    let neighbours = lists(&body, &near);
    (body, neighbours)
}

/// The largest set of particles that cells join.
fn keep_largest_part(body: &mut Body) {
    let parts = body.components(&Cells::of_body(body).cell_neighbours(body.count()));
    let size = |part: u32| parts.iter().filter(|&&other| other == part).count();
    let largest = (0..body.count() as u32).max_by_key(|&part| size(part)).expect("particles");
    let keep: Vec<usize> = (0..body.count()).filter(|&i| parts[i] == largest).collect();
    body.sites = keep.iter().map(|&i| body.sites[i]).collect();
    body.reference = keep.iter().map(|&i| body.reference.get(i)).collect::<Vectors>().into();
    body.is_frame = vec![false; keep.len()];
}

fn lists(body: &Body, near: &Neighbourhood) -> Neighbours {
    let offsets = near.offsets(&body.lattice).expect("fits");
    Neighbours::from_lists(body.sites.iter().map(|site| {
        let offsets = offsets[body.lattice.sublattice(*site)].clone();
        let there = move |o: [i32; 2]| body.sites.binary_search(&[site[0] + o[0], site[1] + o[1]]).ok();
        offsets.into_iter().filter_map(there).map(|i| i as u32).collect::<Vec<_>>()
    }))
}

/// The operator of a body whose particles `held` do not follow.
pub fn operator(body: &Body, neighbours: Neighbours, feel: Feel, held: impl Fn(usize) -> bool) -> Operator {
    let follows: Vec<bool> = (0..body.count()).map(|i| !held(i)).collect();
    let offset = |i: usize, j: u32| {
        let (a, b) = (body.sites[i], body.sites[j as usize]);
        [b[0] - a[0], b[1] - a[1]]
    };
    let row: Box<dyn Fn(usize) -> Row> = match feel {
        Feel::Barycentre => Box::new(move |i| {
            let seen = neighbours.of(i).iter().map(|&j| (offset(i, j), [[1.0, 0.0], [0.0, 1.0]]));
            let count = neighbours.of(i).len() as f64;
            Row { diagonal: [[count, 0.0], [0.0, count]], entries: seen.collect() }
        }),
        Feel::Material => {
            let steel = Constants::Isotropic { young: 1000.0, poisson: 0.33, plane: Plane::Stress };
            let elastic = Elastic::new(steel, 1.0).expect("admissible");
            let cells = Cells::of_body(body);
            let weights = assemble(&cells, body, &neighbours, &elastic, Rotation::Small).expect("holds");
            Box::new(move |i| {
                let blocks = weights.stiffness_of(i);
                let diagonal = blocks.iter().fold(Block::default(), |sum, block| plus(&sum, block));
                let seen = neighbours.of(i).iter().map(|&j| offset(i, j));
                Row { diagonal, entries: seen.zip(blocks.iter().copied()).collect() }
            })
        }
    };
    Operator::from_rows(&body.sites, grid(&body.lattice), follows, row).expect("an operator")
}

/// Clamped along one end and moved along the other, pushed everywhere.
pub fn system(body: &Body, neighbours: Neighbours, feel: Feel) -> System {
    let columns = [body.sites[0][0], body.sites[body.count() - 1][0]];
    let held = |i: usize| body.sites[i][0] <= columns[0] + 1;
    let operator = operator(body, neighbours, feel, held);
    let wave = |i: usize| [1e-3 * (0.05 * i as f64).sin(), -2e-3];
    let forces = (0..body.count()).map(wave).collect();
    let lead = |i: usize| if held(i) { [0.01, 0.02 * body.reference.y[i]] } else { [f64::NAN; 2] };
    System::new(operator, forces, (0..body.count()).map(lead).collect())
}

pub fn by(solver: Solver, tolerance: f64) -> Request {
    Request { solver: Choice::This(solver), tolerance, ..Request::default() }
}

pub fn solved(system: &System, solver: Solver, tolerance: f64) -> Solved {
    let solved = solve(system, &by(solver, tolerance)).unwrap_or_else(|error| panic!("{solver}: {error}"));
    assert!(solved.converged, "{solver} {:?}", solved.residuals.last());
    solved
}

/// Relative L2 difference of two displacements.
pub fn difference(found: &Vectors, truth: &Vectors) -> f64 {
    let square = |p: [f64; 2]| p[0] * p[0] + p[1] * p[1];
    let error: f64 = found.iter().zip(truth.iter()).map(|(a, b)| square([a[0] - b[0], a[1] - b[1]])).sum();
    (error / truth.iter().map(square).sum::<f64>()).sqrt()
}
