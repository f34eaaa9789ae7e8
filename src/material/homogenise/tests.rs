use super::*;
use crate::flock::lattice::LatticeKind;
use crate::flock::neighbourhood::Neighbourhood;
use crate::material::elastic::{Constants, Plane};
use crate::material::zone::Zone;

const KINDS: [LatticeKind; 6] = [
    LatticeKind::Square { spacing: 0.3 },
    LatticeKind::Rectangular { a: 1.0, b: 1.5 },
    LatticeKind::CentredRectangular { a: 1.0, b: 1.4 },
    LatticeKind::Hexagonal { spacing: 2.0 },
    LatticeKind::Oblique { a: 1.0, b: 1.2, angle: 1.2 },
    LatticeKind::Honeycomb { spacing: 1.0 },
];

fn lattice(kind: LatticeKind) -> Lattice {
    Lattice::new(kind, [0.0; 2], 0.3)
}

fn sheet(young: f64, poisson: f64, plane: Plane) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane }, 0.5).expect("admissible")
}

fn scalar(kind: LatticeKind, neighbourhood: Neighbourhood) -> Crystal {
    let lattice = Lattice::new(kind, [0.0; 2], 0.0);
    let offsets = neighbourhood.offsets(&lattice).expect("fits");
    Crystal::scalar(&lattice, &offsets, None).expect("fits")
}

const FIRST: Neighbourhood = Neighbourhood::First { keep: None };

#[test]
fn poisson_and_young_are_recovered_on_every_lattice() {
    for kind in KINDS {
        for step in 0..=100 {
            let poisson = -0.9 + 1.39 * f64::from(step) / 100.0;
            let elastic = sheet(1000.0, poisson, Plane::Stress);
            let material =
                Crystal::material(&lattice(kind), &elastic).expect("cells").effective().expect("symmetric");
            assert!((material.poisson_plane_stress() - poisson).abs() < 1e-9, "{kind:?} {poisson}");
            assert!((material.young_plane_stress() - 500.0).abs() < 1e-7, "{kind:?} {poisson}");
            let elastic = sheet(1000.0, poisson, Plane::Strain);
            let material =
                Crystal::material(&lattice(kind), &elastic).expect("cells").effective().expect("symmetric");
            let found = material.poisson_plane_strain().expect("a solid");
            assert!((found - poisson).abs() < 1e-9, "{kind:?} {poisson}: {found}");
            assert!((material.young_plane_strain().expect("a solid") - 500.0).abs() < 1e-6);
        }
    }
}

#[test]
fn the_whole_stiffness_of_an_anisotropic_sheet_is_recovered() {
    let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
    let elastic = Elastic::new(constants, 2.0).expect("admissible");
    for kind in KINDS {
        let material =
            Crystal::material(&lattice(kind), &elastic).expect("cells").effective().expect("symmetric");
        let error = (material.stiffness - elastic.stiffness()).norm() / elastic.stiffness().norm();
        assert!(error < 1e-12 && material.misfit < 1e-12, "{kind:?}: {error}, {}", material.misfit);
        assert!(material.anisotropy > 0.3, "{}", material.anisotropy);
    }
}

#[test]
fn eq_1_is_a_material_of_poisson_ratio_minus_one() {
    for kind in [KINDS[0], KINDS[3], KINDS[5]] {
        let material = scalar(kind, FIRST).effective().expect("symmetric");
        assert!((material.lambda + material.mu).abs() < 1e-12 * material.mu, "{kind:?}");
        assert!((material.poisson_plane_stress() + 1.0).abs() < 1e-12);
        assert!(material.anisotropy < 1e-12 && material.misfit < 1e-12);
        assert_eq!(material.poisson_plane_strain(), None);
        assert!(material.young_plane_stress().abs() < 1e-11 * material.mu);
    }
}

#[test]
fn a_sheet_below_minus_a_half_is_no_solid_in_plane_strain() {
    for (poisson, is_solid) in [(-0.4, true), (-0.499, true), (-0.501, false), (-0.95, false)] {
        let material =
            Crystal::material(&lattice(KINDS[0]), &sheet(1000.0, poisson, Plane::Stress)).expect("cells");
        let material = material.effective().expect("symmetric");
        assert_eq!(material.poisson_plane_strain().is_some(), is_solid, "{poisson}");
        assert!(material.young_plane_strain().is_none_or(|young| young > 0.0), "{poisson}");
    }
}

/// On a lattice of bonds 1 and 2, with equal weights, the misfit is `(2^2 - 1) / (sqrt(2) (2^2 + 1))`.
#[test]
fn a_misfit_does_not_turn_with_the_axes() {
    let kind = LatticeKind::Rectangular { a: 1.0, b: 2.0 };
    for degrees in [0.0_f64, 22.5, 45.0, 70.0] {
        let turned = Lattice::new(kind, [0.0; 2], degrees.to_radians());
        let offsets = FIRST.offsets(&turned).expect("neighbours");
        let material =
            Crystal::scalar(&turned, &offsets, None).expect("weights").effective().expect("symmetric");
        let expected = 3.0 / (2f64.sqrt() * 5.0);
        assert!((material.misfit - expected).abs() < 1e-12, "{degrees}: {}", material.misfit);
    }
}

#[test]
fn a_scalar_rule_on_a_rectangular_lattice_has_no_symmetric_stress() {
    let material = scalar(KINDS[1], FIRST).effective().expect("symmetric");
    assert!(material.misfit > 0.1, "{}", material.misfit);
}

#[test]
fn triangular_weights_have_the_closed_form() {
    for poisson in [-0.9, -0.3, 0.0, 1.0 / 3.0, 0.49] {
        let elastic = sheet(7.0, poisson, Plane::Stress);
        let crystal = Crystal::material(&lattice(KINDS[3]), &elastic).expect("cells");
        let r = (1.0 - 3.0 * poisson) / (5.0 + poisson);
        assert_eq!(crystal.bonds[0].len(), 6);
        for (k, bond) in crystal.bonds[0].iter().enumerate() {
            let [x, y] = bond.vector.map(|x| x / 2.0);
            let (n, t) = ([x, y], [-y, x]);
            let weight = crystal.weight(0, k).expect("regular");
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let closed = (n[a] * n[b] + r * t[a] * t[b]) / (3.0 * (1.0 + r));
                assert!((weight[a][b] - closed).abs() < 1e-12, "{poisson}: {} {closed}", weight[a][b]);
            }
        }
    }
}

#[test]
fn the_gradient_length_of_a_chain_has_its_closed_form_and_its_sign() {
    let square = Lattice::new(LatticeKind::Square { spacing: 0.5 }, [0.0; 2], 0.0);
    for (w1, w2) in [(1.0, 0.0), (1.0, 0.5), (1.0, -0.1), (1.0, -1.0 / 16.0)] {
        let near = [[1, 0], [-1, 0], [0, 1], [0, -1]];
        let offsets: Vec<Site> = near.iter().flat_map(|&[i, j]| [[i, j], [2 * i, 2 * j]]).collect();
        let weights: Vec<f64> = near.iter().flat_map(|_| [w1, w2]).collect();
        let chain = Crystal::scalar(&square, &[offsets], Some(&[weights])).expect("fits");
        let material = chain.effective().expect("symmetric");
        // Per area of the cell, a^2.
        assert!((material.mu - (w1 + 4.0 * w2)).abs() < 1e-14);
        let closed = -0.25 * (w1 + 16.0 * w2) / (12.0 * (w1 + 4.0 * w2));
        assert!((material.gradient.longitudinal_x - closed).abs() < 1e-14);
        assert!((material.gradient.transverse_x - closed).abs() < 1e-14);
        assert!(material.gradient.least <= closed + 1e-14 && closed - 1e-14 <= material.gradient.greatest);
        assert!(chain.zone().expect("symmetric").stable);
    }
}

/// Least eigenvalue, per area and for the mean of the sublattices, of a wave.
fn acoustic(crystal: &Crystal, k: [f64; 2]) -> f64 {
    let symbol = crystal.symbol(k);
    if crystal.bonds.len() == 1 {
        return symbol.symmetric_eigenvalues().min() / crystal.cell_area();
    }
    let change = mean_and_difference();
    let inverse = (change.transpose() * symbol * change).try_inverse().expect("regular");
    1.0 / inverse.view((0, 0), (2, 2)).into_owned().symmetric_eigenvalues().max() / crystal.cell_area()
}

/// A honeycomb of springs to first and second neighbours: under strain its two kinds of particle move
/// against each other.
fn spring_honeycomb() -> Crystal {
    let lattice = lattice(KINDS[5]);
    let offsets = Neighbourhood::Second.offsets(&lattice).expect("fits");
    let mut crystal = Crystal::scalar(&lattice, &offsets, None).expect("fits");
    for bond in crystal.bonds.iter_mut().flatten() {
        let [x, y] = bond.vector;
        let strength = (x * x + y * y).powi(-2);
        bond.block = [[x * x, x * y], [x * y, y * y]].map(|row| row.map(|entry| strength * entry));
    }
    crystal
}

#[test]
fn the_long_wave_terms_are_those_of_the_symbol() {
    // The rest of a wave's cost beyond the two terms is of the next order, k^4 of it.
    let material = |kind| Crystal::material(&lattice(kind), &sheet(3.0, 0.2, Plane::Stress)).expect("cells");
    for crystal in KINDS.into_iter().map(material).chain([spring_honeycomb()]) {
        let (second, fourth) = crystal.long_wave([0.6, 0.8]).expect("symmetric");
        let step = 0.2 / crystal.primitive[0][0].hypot(crystal.primitive[0][1]);
        let left = |k: f64| {
            let expected = (second + fourth * (k * k)).symmetric_eigenvalues().min();
            acoustic(&crystal, [0.6 * k, 0.8 * k]) / (k * k) - expected
        };
        let rate = (left(2.0 * step) / left(step)).log2();
        assert!((rate - 4.0).abs() < 0.2, "{crystal:?}: {rate}");
    }
}

#[test]
fn the_extremes_of_the_zone_do_not_change_when_the_lattice_is_turned() {
    let zone = |turn: f64| {
        let constants =
            Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 + turn };
        let elastic = Elastic::new(constants, 1.0).expect("admissible");
        Crystal::material(&Lattice::new(KINDS[4], [0.0; 2], turn), &elastic)
            .expect("cells")
            .zone()
            .expect("symmetric")
    };
    let (straight, turned) = (zone(0.0), zone(0.7));
    assert!((straight.largest - turned.largest).abs() < 1e-9, "{straight:?} {turned:?}");
    assert!((straight.least - turned.least).abs() < 1e-6, "{straight:?} {turned:?}");
}

#[test]
fn a_far_weight_below_minus_a_quarter_makes_a_chain_unstable_and_the_wave_is_named() {
    let square = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
    let near = [[1, 0], [-1, 0], [0, 1], [0, -1]];
    let offsets: Vec<Site> = near.iter().flat_map(|&[i, j]| [[i, j], [2 * i, 2 * j]]).collect();
    let zone = |w2: f64| -> Zone {
        let weights: Vec<f64> = near.iter().flat_map(|_| [1.0, w2]).collect();
        Crystal::scalar(&square, std::slice::from_ref(&offsets), Some(&[weights]))
            .expect("fits")
            .zone()
            .expect("symmetric")
    };
    assert!(zone(-0.24).stable && !zone(-0.26).stable);
    let repelled = Crystal::scalar(&square, &[near.to_vec()], Some(&[vec![-1.0; 4]])).expect("fits").zone();
    assert_eq!(repelled, Err(HomogeniseError::Singular { sublattice: 0 }));
    let free = zone(-0.26);
    assert!(free.least < 0.0 && free.worst[0].hypot(free.worst[1]) < 0.5, "a long wave: {free:?}");
}

#[test]
fn springs_along_two_axes_alone_are_a_mechanism() {
    // Springs that resist along their bonds only do not resist shear on the square lattice.
    let square = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
    let mut crystal =
        Crystal::scalar(&square, &[vec![[1, 0], [-1, 0], [0, 1], [0, -1]]], None).expect("fits");
    for bond in &mut crystal.bonds[0] {
        let [x, y] = bond.vector;
        bond.block = [[x * x, 0.0], [0.0, y * y]];
    }
    assert!(!crystal.zone().expect("symmetric").stable);
}

#[test]
fn the_largest_eigenvalue_is_that_of_the_rule() {
    let eq_1 = scalar(KINDS[0], FIRST).zone().expect("symmetric");
    assert!((eq_1.largest - 2.0).abs() < 1e-12 && eq_1.stable);
    // It is the springs that waves are measured by.
    assert!((eq_1.least - 1.0).abs() < 1e-9, "{}", eq_1.least);
    assert!((scalar(KINDS[3], FIRST).zone().expect("symmetric").largest - 1.5).abs() < 1e-9);
    // The two kinds of sites against each other, everywhere alike.
    let honeycomb = scalar(LatticeKind::Honeycomb { spacing: 1.0 }, FIRST).zone().expect("symmetric");
    assert!((honeycomb.largest - 2.0).abs() < 1e-12, "{honeycomb:?}");
    let calibrated =
        Crystal::material(&lattice(KINDS[0]), &sheet(1000.0, 0.33, Plane::Stress)).expect("cells");
    let zone = calibrated.zone().expect("symmetric");
    // Waves of two spacings along an axis: 3 C11 / (C11 + C33).
    assert!((zone.largest - 6.0 / (3.0 - 0.33)).abs() < 1e-9, "{}", zone.largest);
    assert!((zone.damping_limit - 2.0 / zone.largest).abs() < 1e-15);
    for kind in KINDS {
        let zone = Crystal::material(&lattice(kind), &sheet(1000.0, 0.33, Plane::Stress))
            .expect("cells")
            .zone()
            .expect("symmetric");
        assert!(zone.stable, "{kind:?}");
        // Cells bent in turn resist least: those of assumed stress without right angles 0.2, bilinear ones twice as much.
        assert!(zone.least > 0.18 && zone.largest < 3.0, "{kind:?} {zone:?}");
    }
}

#[test]
fn a_rule_that_is_not_seen_back_is_refused() {
    let square = Lattice::new(KINDS[0], [0.0; 2], 0.0);
    let offsets = Neighbourhood::First { keep: Some(3) }.offsets(&square).expect("fits");
    let crystal = Crystal::scalar(&square, &offsets, None).expect("fits");
    assert!(matches!(crystal.effective(), Err(HomogeniseError::NotSymmetric { sublattice: 0, .. })));
    assert_eq!(
        Crystal::scalar(&square, &offsets, Some(&[vec![1.0]])),
        Err(HomogeniseError::Weights { given: 1, needed: 1 })
    );
}
