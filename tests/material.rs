//! The material rule on whole bodies: patch test, the paper's beam, convergence, refusals.

use std::path::Path;

use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::points::Points;
use flockform::flock::shape::Shape;
use flockform::material::Block;
use flockform::material::cells::{Cells, neighbourhood};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::loads::{Loads, Traction};
use flockform::material::mechanism::Mechanism;
use flockform::material::weights::{MaterialWeights, WeightsError};

const KINDS: [LatticeKind; 6] = [
    LatticeKind::Square { spacing: 1.0 },
    LatticeKind::Rectangular { a: 1.0, b: 1.5 },
    LatticeKind::CentredRectangular { a: 1.0, b: 1.4 },
    LatticeKind::Hexagonal { spacing: 1.0 },
    LatticeKind::Oblique { a: 1.0, b: 1.2, angle: 1.2 },
    LatticeKind::Honeycomb { spacing: 1.0 },
];

fn sheet(young: f64, poisson: f64) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane: Plane::Stress }, 1.0).expect("admissible")
}

fn fibres() -> Elastic {
    let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
    Elastic::new(constants, 0.7).expect("admissible")
}

fn build(lattice: Lattice, cut: &Cut) -> (Body, Neighbours, Cells) {
    let near = neighbourhood(&lattice);
    let (body, neighbours) = Body::build(lattice, cut, &near, None).expect("builds");
    let cells = Cells::of_body(&body);
    (body, neighbours, cells)
}

/// A body whose every particle is a corner of a cell.
fn sample(kind: LatticeKind, orientation: f64) -> (Body, Neighbours, Cells) {
    let (body, _, cells) =
        build(Lattice::new(kind, [3.0, -2.0], orientation), &Cut::Count { columns: 8, rows: 9 });
    let incidence = cells.incidence(body.count());
    let keep: Vec<usize> = (0..body.count()).filter(|&i| !incidence.of(i).is_empty()).collect();
    let sites: Vec<_> = keep.iter().map(|&i| body.sites[i]).collect();
    let lookup = |site| sites.binary_search(&site).ok().map(|i| i as u32);
    let cells = Cells::of_sites(&body.lattice, &sites, lookup);
    let reference: Points = keep.iter().map(|&i| body.reference.get(i)).collect();
    let neighbours = cells.mates(reference.len());
    let is_frame = vec![false; sites.len()];
    (Body { sites, reference: reference.into(), is_frame, ..body }, neighbours, cells)
}

/// Particles on a free side.
fn on_boundary(cells: &Cells, count: usize) -> Vec<bool> {
    let mut boundary = vec![false; count];
    for [a, b] in cells.boundary_sides(&cells.incidence(count)) {
        (boundary[a as usize], boundary[b as usize]) = (true, true);
    }
    boundary
}

/// Followers at rest under their neighbours and loads, leaders where `displacement` has them: banded
/// Cholesky over the followers in their numbering.
fn equilibrium(weights: &MaterialWeights, leads: &[bool], forces: &Points, displacement: &Points) -> Points {
    let followers: Vec<usize> = (0..leads.len()).filter(|&i| !leads[i]).collect();
    let mut place = vec![usize::MAX; leads.len()];
    followers.iter().enumerate().for_each(|(row, &i)| place[i] = row);
    let mut entries: Vec<(usize, usize, Block)> = Vec::new();
    let mut right: Vec<f64> = Vec::new();
    for (row, &i) in followers.iter().enumerate() {
        entries.push((row, row, weights.diagonal[i]));
        let mut load = forces.get(i);
        for bond in weights.neighbours.bonds(i) {
            let (j, block) = (weights.neighbours.index[bond] as usize, weights.blocks[bond]);
            if leads[j] {
                let u = displacement.get(j);
                (0..2).for_each(|a| load[a] += block[a][0] * u[0] + block[a][1] * u[1]);
            } else {
                entries.push((row, place[j], block.map(|row| row.map(|x| -x))));
            }
        }
        right.extend(load);
    }
    let solution = banded_cholesky(right.len(), &entries, right);
    let mut result = displacement.clone();
    followers
        .iter()
        .enumerate()
        .for_each(|(row, &i)| result.set(i, [solution[2 * row], solution[2 * row + 1]]));
    result
}

fn banded_cholesky(n: usize, entries: &[(usize, usize, Block)], mut x: Vec<f64>) -> Vec<f64> {
    let band = entries.iter().map(|&(r, c, _)| 2 * r.abs_diff(c) + 2).max().unwrap_or(1);
    // l[i][d] is the entry in row i, column i - d.
    let mut l = vec![vec![0.0; band]; n];
    for (row, column, block) in entries {
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (i, j) = (2 * row + a, 2 * column + b);
            if j <= i {
                l[i][i - j] += block[a][b];
            }
        }
    }
    for i in 0..n {
        for j in i.saturating_sub(band - 1)..=i {
            let first = i.saturating_sub(band - 1).max(j.saturating_sub(band - 1));
            let sum: f64 = (first..j).map(|k| l[i][i - k] * l[j][j - k]).sum();
            let rest = l[i][i - j] - sum;
            l[i][i - j] = if i == j { rest.sqrt() } else { rest / l[j][0] };
        }
        let sum: f64 = (1..band.min(i + 1)).map(|d| l[i][d] * x[i - d]).sum();
        x[i] = (x[i] - sum) / l[i][0];
    }
    for i in (0..n).rev() {
        let sum: f64 = (1..band.min(n - i)).map(|d| l[i + d][d] * x[i + d]).sum();
        x[i] = (x[i] - sum) / l[i][0];
    }
    x
}

fn affine([x, y]: [f64; 2]) -> [f64; 2] {
    [0.2 + 0.03 * x - 0.01 * y, -0.1 + 0.04 * x + 0.02 * y]
}

fn largest_difference(a: &Points, b: &Points) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs())).fold(0.0, f64::max)
}

#[test]
fn an_affine_boundary_is_followed_exactly_on_every_lattice() {
    for kind in KINDS {
        for elastic in [sheet(1000.0, 0.33), sheet(1.0, -0.9), fibres()] {
            let (body, neighbours, cells) = sample(kind, 0.3);
            let weights = MaterialWeights::assemble(&cells, &body, neighbours, &elastic).expect("assembles");
            let exact: Points = body.reference.iter().map(affine).collect();
            let leads = on_boundary(&cells, body.count());
            assert!(leads.iter().filter(|&&leads| !leads).count() > 10, "{kind:?} has an interior");
            let led = (0..body.count()).map(|i| if leads[i] { exact.get(i) } else { [0.0; 2] }).collect();
            let found = equilibrium(&weights, &leads, &Points::zeros(body.count()), &led);
            assert!(largest_difference(&found, &exact) < 1e-12, "{kind:?}");
            for i in (0..body.count()).filter(|&i| !leads[i]) {
                let force = weights.force(i, &exact);
                assert!(force[0].hypot(force[1]) < 1e-12 * elastic.stiffness().norm(), "{kind:?}");
            }
        }
    }
}

#[test]
fn an_affine_boundary_is_followed_exactly_where_points_are_out_of_place() {
    for kind in KINDS {
        let (body, _, cells) = sample(kind, 0.3);
        let shift = |i: usize| [0.11 * (7.3 * i as f64).sin(), 0.11 * (3.1 * i as f64 + 1.0).sin()];
        let points: Points = (0..body.count())
            .map(|i| {
                let (p, s) = (body.reference.get(i), shift(i));
                [p[0] + s[0], p[1] + s[1]]
            })
            .collect();
        // A contrast of materials must not matter to a field of constant strain led on its boundary only
        // if it is none: all cells alike here.
        let weights =
            MaterialWeights::on_points(&cells, &points, &sheet(1000.0, 0.33), None).expect("assembles");
        let exact: Points = points.iter().map(affine).collect();
        let leads = on_boundary(&cells, body.count());
        let led = (0..body.count()).map(|i| if leads[i] { exact.get(i) } else { [0.0; 2] }).collect();
        let found = equilibrium(&weights, &leads, &Points::zeros(body.count()), &led);
        assert!(largest_difference(&found, &exact) < 1e-12, "{kind:?}");
    }
}

#[test]
fn sweeping_the_rule_itself_reaches_the_affine_field() {
    // Positions, matrix-weighted mean plus rest offset: what a host will sweep.
    let (body, neighbours, cells) = sample(KINDS[5], 0.0);
    let weights =
        MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1000.0, 0.33)).expect("assembles");
    let (w, rest) = (weights.weights(), weights.rest_offsets(&body.reference, None));
    let leads = on_boundary(&cells, body.count());
    let goal: Points = body
        .reference
        .iter()
        .map(|p| {
            let u = affine(p);
            [p[0] + u[0], p[1] + u[1]]
        })
        .collect();
    let mut x: Points =
        (0..body.count()).map(|i| if leads[i] { goal.get(i) } else { body.reference.get(i) }).collect();
    for _ in 0..500 {
        for i in (0..body.count()).filter(|&i| !leads[i]) {
            let mean = weights.neighbours.bonds(i).fold(rest.get(i), |sum, bond| {
                let p = x.get(weights.neighbours.index[bond] as usize);
                [0, 1].map(|a| sum[a] + w[bond][a][0] * p[0] + w[bond][a][1] * p[1])
            });
            x.set(i, mean);
        }
    }
    assert!(largest_difference(&x, &goal) < 1e-12);
}

#[test]
fn rigid_motions_cost_no_force_anywhere_free_edges_included() {
    for kind in KINDS {
        let (body, neighbours, cells) = sample(kind, 0.3);
        let weights = MaterialWeights::assemble(&cells, &body, neighbours, &fibres()).expect("assembles");
        let scale = fibres().stiffness().norm();
        let shifted: Points = body.reference.iter().map(|_| [0.7, -1.3]).collect();
        let turned: Points = body.reference.iter().map(|[x, y]| [-y, x]).collect();
        for i in 0..body.count() {
            assert_eq!(weights.force(i, &shifted), [0.0; 2]);
            let force = weights.force(i, &turned);
            assert!(force[0].hypot(force[1]) < 1e-12 * scale, "{kind:?} particle {i}: {force:?}");
        }
        assert!(weights.energy(&turned).abs() < 1e-12 * scale);
    }
}

#[test]
fn weights_sum_to_the_identity_and_forces_come_in_equal_and_opposite_pairs() {
    for kind in KINDS {
        let (body, neighbours, cells) = sample(kind, 0.3);
        let weights = MaterialWeights::assemble(&cells, &body, neighbours, &fibres()).expect("assembles");
        for i in 0..body.count() {
            let mut sum = [[0.0; 2]; 2];
            for bond in weights.neighbours.bonds(i) {
                let w = weights.weight(i, bond);
                (0..4).for_each(|k| sum[k / 2][k % 2] += w[k / 2][k % 2]);
                let j = weights.neighbours.index[bond] as usize;
                let back = weights.neighbours.bonds(j).find(|&b| weights.neighbours.index[b] as usize == i);
                let [[a, b], [c, d]] = weights.blocks[back.expect("seen back")];
                assert_eq!(weights.blocks[bond], [[a, c], [b, d]], "{kind:?}");
            }
            let error = (sum[0][0] - 1.0).abs() + sum[0][1].abs() + sum[1][0].abs() + (sum[1][1] - 1.0).abs();
            assert!(error < 1e-12, "{kind:?} {sum:?}");
        }
    }
}

#[test]
fn an_edge_column_under_uniform_tension_stretches_uniformly_and_contracts_freely() {
    // Traction on the right, symmetry on the left: u = s x / E, v = -nu s y / E, sides free.
    for (kind, right) in [(KINDS[0], 7.0), (KINDS[1], 7.0)] {
        let (body, neighbours, cells) =
            build(Lattice::new(kind, [0.0; 2], 0.0), &Cut::Count { columns: 8, rows: 5 });
        let weights =
            MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1000.0, 0.33)).expect("assembles");
        let pulled =
            |&[a, b]: &[u32; 2]| [a, b].iter().all(|&i| (body.reference.x[i as usize] - right).abs() < 1e-9);
        let sides = cells.boundary_sides(&cells.incidence(body.count()));
        let tractions =
            sides.into_iter().filter(pulled).map(|side| Traction::uniform(side, [50.0, 0.0])).collect();
        let forces =
            Loads { tractions, ..Loads::default() }.on_particles(&cells, &body.reference).expect("fits");
        let exact: Points = body.reference.iter().map(|[x, y]| [0.05 * x, -0.33 * 0.05 * y]).collect();
        for i in 0..body.count() {
            if body.reference.x[i] > 0.0 {
                let (pull, load) = (weights.force(i, &exact), forces.get(i));
                assert!((pull[0] + load[0]).abs() + (pull[1] + load[1]).abs() < 1e-11, "{kind:?} {i}");
            }
        }
    }
}

/// Relative L2 error of a Timoshenko cantilever of length 8 and depth 2 with `rows` cells over its
/// depth, its root led by the exact solution, its end loaded by the parabolic shear of that solution.
fn cantilever_error(rows: u32, spacings: impl Fn(f64) -> LatticeKind) -> f64 {
    let (young, poisson, length, depth, load) = (1000.0, 0.3, 8.0, 2.0, 1.0);
    let inertia = depth * depth * depth / 12.0;
    let exact = |[x, y]: [f64; 2]| {
        let p = load / (6.0 * young * inertia);
        let u = -p * y * ((6.0 * length - 3.0 * x) * x + (2.0 + poisson) * (y * y - depth * depth / 4.0));
        let bending = 3.0 * poisson * y * y * (length - x) + (3.0 * length - x) * x * x;
        [u, p * (bending + (4.0 + 5.0 * poisson) * depth * depth * x / 4.0)]
    };
    let h = depth / f64::from(rows);
    let kind = spacings(h);
    let width = if let LatticeKind::Rectangular { a, .. } = kind { a } else { h };
    let cut = Cut::Shape(Shape::Rectangle { min: [0.0, -1.0], max: [length, 1.0] });
    let (body, neighbours, cells) = build(Lattice::new(kind, [0.0, -1.0], 0.0), &cut);
    assert_eq!(body.count(), (rows as usize + 1) * ((length / width).round() as usize + 1));
    let weights =
        MaterialWeights::assemble(&cells, &body, neighbours, &sheet(young, poisson)).expect("assembles");
    let x = |i: u32| body.reference.x[i as usize];
    let sides = cells.boundary_sides(&cells.incidence(body.count()));
    let shear = |i: u32| {
        let y = body.reference.y[i as usize];
        [0.0, load / (2.0 * inertia) * (depth * depth / 4.0 - y * y)]
    };
    let tractions = sides
        .into_iter()
        .filter(|&[a, b]| x(a) > length - 1e-9 && x(b) > length - 1e-9)
        .map(|[a, b]| Traction { side: [a, b], at_ends: [shear(a), shear(b)] })
        .collect();
    let forces = Loads { tractions, ..Loads::default() }.on_particles(&cells, &body.reference).expect("fits");
    let truth: Points = body.reference.iter().map(exact).collect();
    let leads: Vec<bool> = (0..body.count() as u32).map(|i| x(i) < 1e-9).collect();
    let found = equilibrium(&weights, &leads, &forces, &truth);
    relative_l2(&found, &truth, |_| true)
}

fn relative_l2(found: &Points, truth: &Points, counts: impl Fn(usize) -> bool) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for i in (0..truth.len()).filter(|&i| counts(i)) {
        let (f, t) = (found.get(i), truth.get(i));
        error += (f[0] - t[0]).powi(2) + (f[1] - t[1]).powi(2);
        size += t[0] * t[0] + t[1] * t[1];
    }
    (error / size).sqrt()
}

#[test]
fn a_cantilever_converges_with_the_square_of_the_spacing() {
    for spacings in
        [|h: f64| LatticeKind::Square { spacing: h }, |h: f64| LatticeKind::Rectangular { a: 2.0 * h, b: h }]
    {
        let errors = [4, 8, 16].map(|rows| cantilever_error(rows, spacings));
        for pair in errors.windows(2) {
            let rate = (pair[0] / pair[1]).log2();
            assert!((1.85..2.15).contains(&rate), "{errors:?}");
        }
    }
}

#[test]
fn neighbours_that_cannot_carry_the_material_are_refused_with_the_reason() {
    for (kind, few) in [
        (KINDS[0], Neighbourhood::First { keep: None }),
        (KINDS[3], Neighbourhood::First { keep: Some(4) }),
        (KINDS[5], Neighbourhood::Second),
    ] {
        let lattice = Lattice::new(kind, [0.0; 2], 0.0);
        let (_, body_with_few) = (0, Body::build(lattice.clone(), &CUT, &few, None).expect("builds"));
        let (body, neighbours) = body_with_few;
        let cells = Cells::of_body(&body);
        let refused = MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1.0, 0.3));
        let message = match refused {
            Err(error @ WeightsError::MissingNeighbour { .. }) => error.to_string(),
            Err(WeightsError::Mechanism(Mechanism::NoCell { .. })) => continue,
            other => panic!("{kind:?}: {other:?}"),
        };
        assert!(message.contains("cannot carry shear coupling"), "{message}");
        assert_eq!(message.contains("diagonal pairs are missing"), kind == KINDS[0], "{message}");
    }
}

const CUT: Cut = Cut::Count { columns: 6, rows: 6 };

#[test]
fn more_neighbours_than_cells_need_change_nothing() {
    let lattice = Lattice::new(KINDS[0], [0.0; 2], 0.0);
    let (body, many) = Body::build(lattice, &CUT, &Neighbourhood::Ring { radius: 2 }, None).expect("builds");
    let cells = Cells::of_body(&body);
    let elastic = sheet(1000.0, 0.33);
    let few = MaterialWeights::assemble(&cells, &body, cells.mates(body.count()), &elastic).expect("fits");
    let many = MaterialWeights::assemble(&cells, &body, many, &elastic).expect("fits");
    let field: Points = body.reference.iter().map(|[x, y]| [x * y, (x - y).sin()]).collect();
    for i in 0..body.count() {
        let (a, b) = (few.force(i, &field), many.force(i, &field));
        assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-10);
    }
}

#[test]
fn a_particle_in_no_cell_is_refused_by_name() {
    // The corner site of a disc on a square lattice sticks out.
    let disc = Cut::Shape(Shape::Disc { centre: [0.0, 0.0], radius: 3.0 });
    let (body, neighbours, cells) = build(Lattice::new(KINDS[0], [0.0; 2], 0.0), &disc);
    let refused = MaterialWeights::assemble(&cells, &body, neighbours, &sheet(1.0, 0.3));
    assert_eq!(refused, Err(WeightsError::Mechanism(Mechanism::NoCell { particle: 1 })));
}

#[test]
fn stiffness_factors_are_felt_and_bad_ones_refused() {
    let (body, _, cells) = build(Lattice::new(KINDS[0], [0.0; 2], 0.0), &CUT);
    let with = |factor: &[f64]| {
        MaterialWeights::on_points(&cells, &body.reference, &sheet(1000.0, 0.33), Some(factor))
    };
    let plain = with(&[1.0; 25]).expect("fits");
    let mut factor = vec![1.0; 25];
    factor[0] = 1e12;
    let stiff = with(&factor).expect("fits");
    assert!(stiff.diagonal[0][0][0] > 0.9e12 * plain.diagonal[0][0][0]);
    assert_eq!(stiff.diagonal[35], plain.diagonal[35]);
    assert_eq!(with(&[1.0; 24]), Err(WeightsError::FactorCount { given: 24, cells: 25 }));
    factor[3] = 0.0;
    assert_eq!(with(&factor), Err(WeightsError::Factor { cell: 4, value: 0.0 }));
}

/// Points and displacements of a reference file, and the body with the same particles in its numbering.
fn beam(aspect: u32) -> (Body, Neighbours, Cells, Points) {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../shared/reference/beam_aspect{aspect}.csv"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let rows: Vec<[f64; 4]> = text
        .lines()
        .skip(1)
        .map(|line| {
            let values: Vec<f64> = line.split(',').map(|v| v.parse().expect("a number")).collect();
            values.try_into().expect("four columns")
        })
        .collect();
    let lattice = Lattice::new(KINDS[0], [10.0, 10.0], 0.0);
    let (body, neighbours, cells) = build(lattice, &Cut::Count { columns: 11 * aspect + 1, rows: 12 });
    let at = |p: [f64; 2]| rows.iter().find(|r| (r[0] - p[0]).hypot(r[1] - p[1]) < 1e-9).expect("listed");
    let truth = body.reference.iter().map(|p| [at(p)[2], at(p)[3]]).collect();
    (body, neighbours, cells, truth)
}

fn end_columns(body: &Body) -> Vec<bool> {
    let (low, high) = body.reference.bounds(0..body.count()).expect("particles");
    body.reference.x.iter().map(|&x| x < low[0] + 0.5 || x > high[0] - 0.5).collect()
}

fn von_mises_error(cells: &Cells, elastic: &Elastic, found: &Points, truth: &Points) -> f64 {
    let stress = |u: &Points| cells.strains(u).into_iter().map(|e| elastic.von_mises(e)).collect::<Vec<_>>();
    let (found, truth) = (stress(found), stress(truth));
    let error: f64 = found.iter().zip(&truth).map(|(f, t)| (f - t).powi(2)).sum();
    (error / truth.iter().map(|t| t * t).sum::<f64>()).sqrt()
}

/// Displacement and von Mises errors of the material rule, both end columns led by the truth.
fn beam_errors(aspect: u32) -> [f64; 2] {
    let (body, neighbours, cells, truth) = beam(aspect);
    let elastic = sheet(1000.0, 0.33);
    let weights = MaterialWeights::assemble(&cells, &body, neighbours, &elastic).expect("assembles");
    let leads = end_columns(&body);
    let found = equilibrium(&weights, &leads, &Points::zeros(body.count()), &truth);
    [relative_l2(&found, &truth, |i| !leads[i]), von_mises_error(&cells, &elastic, &found, &truth)]
}

#[test]
#[ignore = "needs ../shared/reference"]
fn the_beam_led_by_the_truth_matches_it() {
    for (aspect, displacement, von_mises) in [(1, 0.005, 0.025), (5, 0.01, 0.01), (10, 0.01, 0.01)] {
        let errors = beam_errors(aspect);
        println!(
            "aspect {aspect}: displacement {:.4} %, von Mises {:.4} %",
            100.0 * errors[0],
            100.0 * errors[1]
        );
        assert!(errors[0] <= displacement && errors[1] <= von_mises, "aspect {aspect}: {errors:?}");
    }
}

#[test]
#[ignore = "needs ../shared/reference"]
fn the_beam_loaded_by_traction_matches_it() {
    let (body, neighbours, cells, truth) = beam(1);
    let elastic = sheet(1000.0, 0.33);
    let weights = MaterialWeights::assemble(&cells, &body, neighbours, &elastic).expect("assembles");
    let leads: Vec<bool> = body.reference.x.iter().map(|&x| x < 10.5).collect();
    let end = |i: u32| body.reference.x[i as usize] > 20.5;
    let sides = cells.boundary_sides(&cells.incidence(body.count()));
    let loaded = sides.into_iter().filter(|&[a, b]| end(a) && end(b));
    let tractions = loaded.map(|side| Traction::uniform(side, [0.0, 50.0])).collect();
    let forces = Loads { tractions, ..Loads::default() }.on_particles(&cells, &body.reference).expect("fits");
    let found = equilibrium(&weights, &leads, &forces, &truth);
    let errors =
        [relative_l2(&found, &truth, |i| !leads[i]), von_mises_error(&cells, &elastic, &found, &truth)];
    println!("traction: displacement {:.4} %, von Mises {:.4} %", 100.0 * errors[0], 100.0 * errors[1]);
    assert!(errors[0] <= 0.02 && errors[1] <= 0.03, "{errors:?}");
}

#[test]
#[ignore = "needs ../shared/reference"]
fn the_barycentre_on_the_beam_has_the_errors_of_the_paper() {
    let (body, _, cells, truth) = beam(1);
    let first = Neighbourhood::First { keep: None };
    let (_, neighbours) =
        Body::build(body.lattice.clone(), &Cut::Count { columns: 12, rows: 12 }, &first, None)
            .expect("builds");
    let one = [[1.0, 0.0], [0.0, 1.0]];
    let scaled = |by: f64| one.map(|row| row.map(|x| by * x));
    let degree = |i: usize| neighbours.of(i).len() as f64;
    let weights = MaterialWeights {
        blocks: vec![one; neighbours.index.len()],
        diagonal: (0..body.count()).map(|i| scaled(degree(i))).collect(),
        inverse: (0..body.count()).map(|i| scaled(1.0 / degree(i))).collect(),
        neighbours,
    };
    let leads = end_columns(&body);
    let found = equilibrium(&weights, &leads, &Points::zeros(body.count()), &truth);
    let displacement = relative_l2(&found, &truth, |i| !leads[i]);
    let von_mises = von_mises_error(&cells, &sheet(1000.0, 0.33), &found, &truth);
    println!("Eq. 1: displacement {:.3} %, von Mises {:.3} %", 100.0 * displacement, 100.0 * von_mises);
    assert!((displacement - 0.262).abs() < 0.01 && (von_mises - 0.74).abs() < 0.01);
}
