//! The truth follows what is exact, on every lattice.

use flockform::compare::measures::von_mises;
use flockform::compare::truth::{Setting, Truth, TruthError};
use flockform::flock::lattice::Lattice;
use flockform::flock::points::Points;
use flockform::material::cells::Cells;
use flockform::material::elastic::{Elastic, Plane};
use flockform::material::loads::{LoadError, Loads, Traction};

use crate::support::*;

fn affine([x, y]: [f64; 2]) -> [f64; 2] {
    [0.2 + 0.03 * x - 0.01 * y, -0.1 + 0.04 * x + 0.02 * y]
}
const STRAIN: [f64; 3] = [0.03, 0.02, 0.03];

fn materials() -> [Elastic; 3] {
    [sheet(1000.0, 0.33, Plane::Stress), sheet(1.0, 0.4, Plane::Strain), fibres()]
}

fn setting<'a>(
    (cells, reference): (&'a Cells, &'a Points),
    elastic: &'a Elastic,
    held: &'a [Option<[f64; 2]>],
    loads: &'a Loads,
) -> Setting<'a> {
    Setting { cells, reference, elastic, held, loads }
}

/// Tractions of a uniform stress on every free side \[force / length\].
fn tractions(cells: &Cells, reference: &Points, elastic: &Elastic) -> Vec<Traction> {
    let [xx, yy, xy] = elastic.stress(STRAIN).map(|s| s * elastic.thickness());
    let pulled = |[a, b]: [u32; 2]| {
        let (p, q) = (reference.get(a as usize), reference.get(b as usize));
        let length = (q[0] - p[0]).hypot(q[1] - p[1]);
        let normal = [(q[1] - p[1]) / length, (p[0] - q[0]) / length];
        let t = [xx * normal[0] + xy * normal[1], xy * normal[0] + yy * normal[1]];
        Traction::uniform([b, a], t)
    };
    cells.boundary_sides(&cells.incidence(reference.len())).into_iter().map(pulled).collect()
}

fn assert_affine(truth: &Truth, cells: &Cells, reference: &Points, elastic: &Elastic, label: &str) {
    let exact: Points = reference.iter().map(affine).collect();
    let off = largest_difference(&truth.displacement, &exact);
    assert!(off < 1e-10, "{label}: off by {off:e}");
    let centres = cells.centres(reference);
    let between: Points = centres.iter().map(affine).collect();
    assert!(
        largest_difference(&truth.displacements_at(&centres).expect("inside"), &between) < 1e-10,
        "{label}"
    );
    let stress = elastic.von_mises(STRAIN);
    let recovered = truth.von_mises_at(&centres).expect("inside");
    for found in von_mises(cells, elastic, &truth.displacement).into_iter().chain(recovered) {
        assert!((found / stress - 1.0).abs() < 1e-9, "{label}: {found} for {stress}");
    }
    let area: f64 = (0..cells.count()).map(|c| flockform::material::stiffness::area(cells.shape(c))).sum();
    let work: f64 = elastic.stress(STRAIN).iter().zip(STRAIN).map(|(s, e)| s * e).sum();
    let energy = 0.5 * work * area * elastic.thickness();
    assert!((truth.strain_energy() / energy - 1.0).abs() < 1e-11, "{label}");
}

#[test]
fn an_affine_boundary_is_followed_exactly_on_every_lattice() {
    for kind in KINDS {
        for elastic in materials() {
            let (body, cells) = sample(kind);
            let leads = on_boundary(&cells, body.count());
            let led = |(i, p): (usize, [f64; 2])| leads[i].then(|| affine(p));
            let held: Vec<_> = body.reference.iter().enumerate().map(led).collect();
            let loads = Loads::default();
            let setting = setting((&cells, &body.reference), &elastic, &held, &loads);
            for refine in [1, 2, 3] {
                let truth = Truth::solve(&setting, refine).expect("solves");
                assert_affine(&truth, &cells, &body.reference, &elastic, &format!("{kind:?} {refine}"));
            }
        }
    }
}

#[test]
fn tractions_of_a_uniform_stress_all_around_give_the_affine_field_on_every_lattice() {
    for kind in KINDS {
        for elastic in materials() {
            let (body, cells) = sample(kind);
            // Two particles that share a side hold the body against rigid motion.
            let [a, b] = cells.sides(0).next().expect("a side");
            let mut held = vec![None; body.count()];
            for i in [a, b].map(|i| i as usize) {
                held[i] = Some(affine(body.reference.get(i)));
            }
            let tractions = tractions(&cells, &body.reference, &elastic);
            let loads = Loads { tractions, ..Loads::default() };
            let setting = setting((&cells, &body.reference), &elastic, &held, &loads);
            let truth = Truth::solve(&setting, 2).expect("solves");
            assert_affine(&truth, &cells, &body.reference, &elastic, &format!("{kind:?}"));
        }
    }
}

/// A strip of the square lattice with its left column clamped; a uniform downward load.
fn strip(loads: &Loads, refine: usize) -> Truth {
    let (body, cells) = build(Lattice::new(KINDS[0], [0.0; 2], 0.0), 9, 3);
    let held: Vec<_> = body.reference.x.iter().map(|&x| (x == 0.0).then_some([0.0; 2])).collect();
    let elastic = sheet(1000.0, 0.3, Plane::Stress);
    Truth::solve(&setting((&cells, &body.reference), &elastic, &held, loads), refine).expect("solves")
}

/// Forces at the wall that balance the load.
fn reaction(truth: &Truth) -> [f64; 2] {
    let (mesh, forces) = (truth.solution().mesh(), truth.solution().nodal_forces());
    let wall = (0..mesh.node_count()).filter(|&node| mesh.x()[node] == 0.0);
    wall.fold([0.0; 2], |sum, node| [0, 1].map(|k| sum[k] + forces[node][k]))
}

#[test]
fn every_kind_of_load_arrives_whole_in_the_units_of_the_sheet() {
    // The strip is 8 long and 2 deep, its sheet 0.5 thick; particles count column by column.
    let weight = Loads { body: [0.0, -3.0], ..Loads::default() };
    let point = Loads { forces: vec![(26, [2.0, 1.0]), (26, [0.0, 4.0])], ..Loads::default() };
    let growing = Traction { side: [24, 25], at_ends: [[0.0, 0.0], [0.0, 6.0]] };
    let shear = Loads { tractions: vec![growing], ..Loads::default() };
    for (loads, total) in [(weight, [0.0, -48.0]), (point, [2.0, 5.0]), (shear, [0.0, 3.0])] {
        for refine in [1, 3] {
            // What falls on the wall itself: a sixth of the elements there.
            let on_wall = loads.body[1] * 2.0 / (6 * refine) as f64;
            let [x, y] = reaction(&strip(&loads, refine));
            assert!((x + total[0]).abs() + (y + total[1] - on_wall).abs() < 1e-9, "{loads:?}: {x} {y}");
        }
    }
}

#[test]
fn a_traction_that_grows_along_its_side_turns_the_side_the_same_way_round_for_either_order_of_its_ends() {
    let push =
        |side: [u32; 2], at_ends| Loads { tractions: vec![Traction { side, at_ends }], ..Loads::default() };
    let one = strip(&push([24, 25], [[1.0, 0.0], [9.0, 0.0]]), 3);
    let other = strip(&push([25, 24], [[9.0, 0.0], [1.0, 0.0]]), 3);
    let turned = strip(&push([24, 25], [[9.0, 0.0], [1.0, 0.0]]), 3);
    assert!(largest_difference(&one.displacement, &other.displacement) < 1e-12);
    assert!(largest_difference(&one.displacement, &turned.displacement) > 1e-4);
}

#[test]
fn held_sides_follow_their_ends_in_a_line_and_held_cells_throughout() {
    for kind in KINDS {
        let (body, cells) = sample(kind);
        // All corners of two cells that share a side, led by a field that is not affine.
        let incidence = cells.incidence(body.count());
        let middle = cells.count() / 2;
        let next = cells.sides(middle).find_map(|side| cells.across(&incidence, side)).expect("a neighbour");
        let led = |i: usize| [0.1 * (1.7 * i as f64).sin(), 0.1 * (2.3 * i as f64).cos()];
        let mut held = vec![None; body.count()];
        for &i in cells.of(middle).iter().chain(cells.of(next)) {
            held[i as usize] = Some(led(i as usize));
        }
        let (elastic, loads) = (fibres(), Loads::default());
        let setting = setting((&cells, &body.reference), &elastic, &held, &loads);
        let truth = Truth::solve(&setting, 4).expect("solves");
        let [a, b] = cells.sides(middle).next().expect("a side").map(|i| i as usize);
        let (p, q) = (body.reference.get(a), body.reference.get(b));
        let blend = |t: f64, p: [f64; 2], q: [f64; 2]| [0, 1].map(|k| (1.0 - t) * p[k] + t * q[k]);
        let on_side: Points = [0.1, 0.5, 0.8].map(|t| blend(t, p, q)).into_iter().collect();
        let expected: Points = [0.1, 0.5, 0.8].map(|t| blend(t, led(a), led(b))).into_iter().collect();
        let found = truth.displacements_at(&on_side).expect("inside");
        assert!(largest_difference(&found, &expected) < 1e-9, "{kind:?}");
        let centre = cells.centres(&body.reference).get(middle);
        let at_centre = truth.displacements_at(&[centre].into_iter().collect()).expect("inside").get(0);
        let corners = cells.of(middle);
        let mean = corners
            .iter()
            .fold([0.0; 2], |sum, &i| [0, 1].map(|k| sum[k] + led(i as usize)[k] / corners.len() as f64));
        assert!((at_centre[0] - mean[0]).hypot(at_centre[1] - mean[1]) < 1e-9, "{kind:?}");
    }
}

#[test]
fn refinement_converges_towards_one_displacement() {
    let load = Loads { tractions: vec![Traction::uniform([24, 25], [0.0, 1.0])], ..Loads::default() };
    let finest = strip(&load, 12).displacement;
    let off = [1, 2, 4].map(|refine| largest_difference(&strip(&load, refine).displacement, &finest));
    assert!(off[0] > 2.0 * off[1] && off[1] > 2.0 * off[2] && off[2] > 0.0, "{off:?}");
}

#[test]
fn what_has_no_truth_is_refused_and_particles_are_named() {
    let (body, cells) = sample(KINDS[0]);
    let (elastic, loads, count) = (fibres(), Loads::default(), body.count());
    let refused = |held: &[Option<[f64; 2]>], loads: &Loads| {
        Truth::solve(&setting((&cells, &body.reference), &elastic, held, loads), 2).expect_err("refused")
    };
    let free = vec![None; count];
    let error = refused(&free, &loads);
    assert_eq!(error, TruthError::Mechanism { particle: 1, motion: "translate along x" });
    assert!(error.to_string().contains("particle 1 is not held and free to translate along x"), "{error}");
    let mut pinned = free.clone();
    pinned[10] = Some([0.0; 2]);
    assert_eq!(refused(&pinned, &loads), TruthError::Mechanism { particle: 1, motion: "rotate" });
    assert_eq!(refused(&free[1..], &loads), TruthError::HeldCount { given: count - 1, particles: count });
    let inside = Loads { tractions: vec![Traction::uniform([8, 9], [1.0, 0.0])], ..Loads::default() };
    let expected = LoadError::NotBoundary { ends: [9, 10], inside: true };
    assert_eq!(refused(&free, &inside), TruthError::Load(expected));
}
