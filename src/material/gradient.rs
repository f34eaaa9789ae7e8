//! A second gradient of prescribed length: negative weights for the sites behind the neighbours.
//!
//! More positive weights further away are not a second gradient: on a chain with weights `w1`, `w2`
//! at `a`, `2a` they give `l^2 = -a^2 (w1 + 16 w2) / (12 (w1 + 4 w2))`, which is negative and softens
//! short waves. Here the energy of the rule is written down first, and the weights follow from it:
//!
//! ```text
//! 2 E = sum over bonds (u_j - u_i)^2  +  sum over straight triples q_d (u_h - 2 u_i + u_j)^2
//! ```
//!
//! a triple being a particle `i` with two opposite first neighbours `h`, `j` in the bond direction `d`.
//! With all triples there, a neighbour in direction `d` has the weight `1 + 4 q_d` and the site behind
//! it `-q_d`. It follows:
//!
//! * Long waves have the material of Eq. 1, up to the same scale: `w1 + 4 w2 = 1`.
//! * Where a particle lacks a neighbour, its triples are missing, and the weights of the bonds that
//!   remain shrink with them (`1 + 2 q_d` for a bond of one triple). The weights stay symmetric, the
//!   energy a sum of squares, a particle's total weight positive, on a body of any shape; and the edge
//!   is free of double traction. Leaving out the weights of missing neighbours alone would make the
//!   last bond `2 q_d` stiffer than the others, an edge that acts as if it were clamped.
//! * Every term alone is overshot by a synchronous update by a factor of 3 at most, so damping below
//!   2/3 ([`SAFE_DAMPING`]) is stable on any body.
//! * On nearly right-angled cells the diagonal's `q_d` comes out negative, but never below -1/12: its
//!   bonds' squares keep 2/3 of themselves, and all that is said above holds (the factor is then
//!   `2 / (1 - 3/12)`, still below 3).
//!
//! **Which length.** A layer that varies across rows of bonds, `h` apart, has displacements
//! `u ~ exp(-x / l)` with `4 sinh^2(h / 2l) = 1 / Q`, `Q` the mean of `q_d` over the directions that
//! cross the rows (both of them cross one row; the direction of the rows themselves sees nothing).
//! The prescribed length is that decay length, to the last digit, for layers along every row of bonds:
//! along both axes of a square or rectangular lattice, along all three directions of the others, whose
//! `q_1 = Q_2 + Q_3 - Q_1`. The coefficient of long waves in the same direction is
//! `l_wave^2 = h^2 (Q - 1/12) = l^2 - h^2 / 6 + h^4 / (240 l^2) - ...`: the same up to the lattice.
//! Between the rows a square lattice has less, about `l^2 / 2` at 45 degrees; the hexagonal lattice is
//! isotropic in this too, to the order of the lattice; the others lie between, or a few per cent above.
//!
//! A length so short that the lattice's own dispersion outweighs the gradient, `l_wave^2 < 0` in some
//! direction, is refused: below 0.38 `h` on a square lattice (`cosh(h / l) = 7`), below up to about
//! 0.9 of the widest `h` on nearly right-angled oblique ones. The refusal names the least length.

use super::homogenise::{Crystal, HomogeniseError};
use crate::flock::body::Body;
use crate::flock::lattice::{Lattice, Site};
use crate::flock::neighbourhood::{Neighbourhood, NeighbourhoodError, Neighbours};

/// A synchronous update of a gradient rule damped below this is stable on any body \[1\]: of a triple,
/// `(1, -2, 1)`, the diagonal is `(1, 4, 1)`, and the largest eigenvalue of one over the other is 3.
pub const SAFE_DAMPING: f64 = 2.0 / 3.0;

/// Longest length in row spacings: the long-wave stiffness is what is left of weights that are the
/// square of this times larger.
const LONGEST: f64 = 1e4;

/// Weights of a second gradient on a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientWeights {
    /// Decay length of a layer along a row of bonds \[length\].
    pub length: f64,
    /// Offset to one of the two neighbours in each bond direction, and its `q_d` \[1\].
    pub directions: Vec<(Site, f64)>,
}

/// Why a lattice has no second gradient of this length.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GradientError {
    /// The lattice has no sites straight behind the neighbours.
    #[error(transparent)]
    Neighbours(#[from] NeighbourhoodError),
    /// A length that the lattice's own dispersion outweighs.
    #[error(
        "the length {length} is too short for this lattice: l^2 of long waves comes out as {found:.6}, so short waves would soften; it carries {shortest:.4} and more"
    )]
    TooShort {
        /// The given value \[length\].
        length: f64,
        /// Least gradient length squared of long waves with it \[length^2\].
        found: f64,
        /// Least length that the lattice carries \[length\].
        shortest: f64,
    },
    /// A length too many times the distance of rows for the digits of a double.
    #[error("the length {length} is more than {LONGEST:.0} times the distance of rows, {rows}")]
    TooLong {
        /// The given value \[length\].
        length: f64,
        /// Greatest distance of two neighbouring rows of bonds \[length\].
        rows: f64,
    },
    /// A length that is not positive and finite.
    #[error("the length must be positive and finite, but it is {length}")]
    NotPositive {
        /// The given value \[length\].
        length: f64,
    },
    /// A length with which some wave but a translation costs no energy.
    #[error("some wave costs nothing or gives energy with the length {length}")]
    Unstable {
        /// The given value \[length\].
        length: f64,
    },
    /// The weights have no long-wave limit.
    #[error(transparent)]
    Wave(#[from] HomogeniseError),
}

impl GradientWeights {
    /// Weights whose boundary layers decay with `length` \[length\]; refuses lengths that the lattice
    /// cannot carry.
    pub fn new(lattice: &Lattice, length: f64) -> Result<Self, GradientError> {
        let fits = length > 0.0 && length.is_finite();
        if !fits {
            return Err(GradientError::NotPositive { length });
        }
        Neighbourhood::Collinear.offsets(lattice)?;
        // In a unit near the spacing, or the fourth powers of lengths in what follows would vanish or
        // overflow; a power of two, which changes no digit.
        let unit = lattice.spacing().log2().floor().exp2();
        let (own, lattice) = (length / unit, &lattice.scaled(1.0 / unit));
        let rows = rows(lattice);
        let widest = rows.iter().fold(0.0, |most, &(_, row)| f64::max(most, row));
        if rows.iter().any(|&(_, row)| own > LONGEST * row) {
            return Err(GradientError::TooLong { length, rows: widest * unit });
        }
        let weights = Self { length, ..Self::unchecked(&rows, own) };
        let found = weights.least_of_long_waves(lattice)?;
        let stiffens = found > 0.0;
        if !stiffens {
            let shortest = shortest(lattice, &rows, widest)? * unit;
            return Err(GradientError::TooShort { length, found: found * unit * unit, shortest });
        }
        if !weights.crystal(lattice)?.zone()?.stable {
            return Err(GradientError::Unstable { length });
        }
        Ok(weights)
    }

    fn unchecked(rows: &[(Site, f64)], length: f64) -> Self {
        let crossed: Vec<f64> =
            rows.iter().map(|(_, row)| 0.25 / (0.5 * row / length).sinh().powi(2)).collect();
        let strength = |d: usize| match rows.len() {
            // The rows along one direction are crossed by the other alone.
            2 => crossed[1 - d],
            _ => crossed.iter().sum::<f64>() - 2.0 * crossed[d],
        };
        let directions = rows.iter().enumerate().map(|(d, &(bond, _))| (bond, strength(d))).collect();
        Self { length, directions }
    }

    /// The smallest `l^2` of long waves in any direction \[length^2\].
    fn least_of_long_waves(&self, lattice: &Lattice) -> Result<f64, GradientError> {
        Ok(self.crystal(lattice)?.effective()?.gradient.least)
    }

    /// The rule of an interior particle, neighbours in the order of [`Neighbourhood::Collinear`].
    pub fn crystal(&self, lattice: &Lattice) -> Result<Crystal, GradientError> {
        let offsets = Neighbourhood::Collinear.offsets(lattice)?;
        let weights = offsets[0].iter().map(|&offset| self.interior(offset)).collect();
        Ok(Crystal::scalar(lattice, &offsets, Some(&[weights]))?)
    }

    /// Weight of the neighbour at `offset` where no triple is missing \[1\].
    pub fn interior(&self, offset: Site) -> f64 {
        match self.find(offset) {
            Some((near, q)) if near == offset => 1.0 + 4.0 * q,
            Some((_, q)) => -q,
            None => 0.0,
        }
    }

    /// Weights of a body's neighbours \[1\], parallel to their index list, shape \[bonds\]: the same both
    /// ways, and those of missing triples missing.
    pub fn of_body(&self, body: &Body, neighbours: &Neighbours) -> Vec<f64> {
        // Particles are numbered in the lexicographic order of their sites.
        let there = |[i, j]: Site, [di, dj]: Site, steps: i32| {
            body.sites.binary_search(&[i + steps * di, j + steps * dj]).is_ok()
        };
        let weight = |own: Site, other: Site| {
            let offset = [other[0] - own[0], other[1] - own[1]];
            match self.find(offset) {
                Some((near, q)) if near == offset => {
                    // Triples around the particle and around the neighbour.
                    let triples = u8::from(there(own, near, -1)) + u8::from(there(own, near, 2));
                    1.0 + 2.0 * q * f64::from(triples)
                }
                Some((near, q)) if there(own, near, 1) => -q,
                _ => 0.0,
            }
        };
        let of_particle =
            |i: usize| neighbours.of(i).iter().map(move |&j| weight(body.sites[i], body.sites[j as usize]));
        (0..neighbours.count()).flat_map(of_particle).collect()
    }

    /// The first neighbour in the direction of an offset that leads to it or behind it, and its `q_d`.
    fn find(&self, offset: Site) -> Option<(Site, f64)> {
        self.directions.iter().find_map(|&([i, j], q)| {
            let near =
                [[i, j], [-i, -j]].into_iter().find(|&[i, j]| offset == [i, j] || offset == [2 * i, 2 * j]);
            near.map(|near| (near, q))
        })
    }
}

/// A note on the prescribed length, beside the `l^2` of long waves that a report gives.
pub fn layer_note(length: f64) -> String {
    format!(
        "a boundary layer along a row of bonds decays as exp(-distance / {length}): that is the prescribed length; \
         l^2 above is that of long waves, smaller by about a sixth of the rows' distance squared along the same direction"
    )
}

/// One bond of each direction and the distance of the lattice's rows along it \[length\].
fn rows(lattice: &Lattice) -> Vec<(Site, f64)> {
    let bonds = lattice.first_neighbours(0).into_iter().filter(|&[i, j]| (i, j) > (0, 0));
    let distance = |bond: Site| {
        let [x, y] = lattice.vector(bond);
        lattice.cell_area() / x.hypot(y)
    };
    bonds.map(|bond| (bond, distance(bond))).collect()
}

/// The shortest length that stiffens short waves in all directions, by bisection and rounded up a
/// little \[length\].
fn shortest(lattice: &Lattice, rows: &[(Site, f64)], widest: f64) -> Result<f64, GradientError> {
    let (mut low, mut high) = (0.0, 2.0 * widest);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        let stiffens = GradientWeights::unchecked(rows, middle).least_of_long_waves(lattice)? > 0.0;
        if stiffens { high = middle } else { low = middle }
    }
    Ok(1.001 * high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::Cut;
    use crate::flock::lattice::LatticeKind;

    fn lattices() -> Vec<Lattice> {
        let bravais =
            LatticeKind::SAMPLES.into_iter().filter(|kind| !matches!(kind, LatticeKind::Honeycomb { .. }));
        bravais.map(|kind| Lattice::new(kind, [0.0; 2], 0.3)).collect()
    }

    fn widest(lattice: &Lattice) -> f64 {
        rows(lattice).into_iter().map(|(_, row)| row).fold(0.0, f64::max)
    }

    #[test]
    fn a_layer_along_any_row_of_bonds_decays_with_the_prescribed_length() {
        for lattice in lattices() {
            for length in [0.6, 1.0, 2.5, 30.0].map(|l| l * widest(&lattice)) {
                let weights = GradientWeights::new(&lattice, length).expect("long enough");
                let crystal = weights.crystal(&lattice).expect("fits");
                for &(bond, _) in &weights.directions {
                    let [x, y] = lattice.vector(bond);
                    let n = [-y / x.hypot(y), x / x.hypot(y)];
                    // The rule leaves the layer exp(-n.x / l) as it is.
                    let (mut sum, mut size) = (0.0, 0.0);
                    for bond in &crystal.bonds[0] {
                        let across = n[0] * bond.vector[0] + n[1] * bond.vector[1];
                        let term = bond.block[0][0] * (-across / length).exp_m1();
                        (sum, size) = (sum + term, size + f64::abs(term));
                    }
                    assert!(f64::abs(sum) < 1e-12 * size, "{} {length}: {sum} of {size}", lattice.name());
                }
            }
        }
    }

    #[test]
    fn long_waves_have_the_material_of_eq_1_and_nearly_the_length() {
        for lattice in lattices() {
            let length = 5.0 * widest(&lattice);
            let crystal =
                GradientWeights::new(&lattice, length).and_then(|w| w.crystal(&lattice)).expect("fits");
            let first = Neighbourhood::First { keep: None }.offsets(&lattice).expect("fits");
            let eq_1 = Crystal::scalar(&lattice, &first, None).expect("fits").effective().expect("symmetric");
            let found = crystal.effective().expect("symmetric");
            assert!((found.stiffness - eq_1.stiffness).norm() < 1e-11 * eq_1.stiffness.norm());
            // Along rows it is the length to the order of the lattice; between them it may be less or more.
            let [least, greatest] =
                [found.gradient.least, found.gradient.greatest].map(|l2| l2 / (length * length));
            assert!((0.98..1.2).contains(&greatest), "{}: {greatest}", lattice.name());
            assert!((0.45..1.0).contains(&least), "{}: {least}", lattice.name());
        }
    }

    #[test]
    fn the_hexagonal_lattice_has_one_length_in_all_directions() {
        let lattice = Lattice::new(LatticeKind::Hexagonal { spacing: 2.0 }, [0.0; 2], 0.1);
        let crystal = GradientWeights::new(&lattice, 4.0).and_then(|w| w.crystal(&lattice)).expect("fits");
        let gradient = crystal.effective().expect("symmetric").gradient;
        let expected = 3.0 * (0.25 / (0.25 * 0.75f64.sqrt()).sinh().powi(2) - 1.0 / 12.0);
        assert!((gradient.least - expected).abs() < 1e-9 && (gradient.greatest - expected).abs() < 1e-9);
    }

    #[test]
    fn no_cell_makes_a_term_of_the_energy_outweigh_its_bonds() {
        for b in [0.6, 1.0, 1.7, 3.0] {
            for degrees in (40..=140).step_by(5).chain([89, 91]) {
                let kind = LatticeKind::Oblique { a: 1.0, b, angle: f64::from(degrees).to_radians() };
                let lattice = Lattice::new(kind, [0.0; 2], 0.0);
                for length in [1.0, 2.0, 10.0].map(|l| l * widest(&lattice)) {
                    let weights = GradientWeights::new(&lattice, length).expect("long enough");
                    for (_, q) in &weights.directions {
                        assert!(*q > -1.0 / 12.0 - 1e-9, "{b} {degrees} {length}: {q}");
                    }
                    let zone = weights.crystal(&lattice).expect("fits").zone().expect("symmetric");
                    assert!(zone.damping_limit > SAFE_DAMPING, "{b} {degrees} {length}: {zone:?}");
                }
            }
        }
    }

    #[test]
    fn lengths_that_would_soften_short_waves_are_refused() {
        let square = Lattice::new(LatticeKind::Square { spacing: 2.0 }, [0.0; 2], 0.0);
        let limit = 2.0 / 7f64.acosh();
        assert!(GradientWeights::new(&square, 1.001 * limit).is_ok());
        let refused = GradientWeights::new(&square, 0.999 * limit).expect_err("refused");
        assert!(matches!(refused, GradientError::TooShort { .. }), "{refused}");
        for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(GradientWeights::new(&square, length), Err(GradientError::NotPositive { .. })));
        }
        assert!(matches!(GradientWeights::new(&square, 3e4), Err(GradientError::TooLong { .. })));
        assert!(GradientWeights::new(&square, 1.9e4).is_ok());
        // The remedy that is named is one.
        for lattice in lattices() {
            let Err(GradientError::TooShort { shortest, .. }) = GradientWeights::new(&lattice, 0.1) else {
                panic!("{} carries everything", lattice.name());
            };
            assert!(GradientWeights::new(&lattice, shortest).is_ok(), "{}", lattice.name());
            assert!(GradientWeights::new(&lattice, 0.99 * shortest).is_err(), "{}", lattice.name());
            assert!(GradientWeights::new(&lattice, 0.5 * widest(&lattice)).is_ok(), "{}", lattice.name());
        }
        let honeycomb = Lattice::new(LatticeKind::Honeycomb { spacing: 1.0 }, [0.0; 2], 0.0);
        assert!(matches!(GradientWeights::new(&honeycomb, 2.0), Err(GradientError::Neighbours(_))));
    }

    #[test]
    fn weights_are_the_same_both_ways_and_every_particle_has_a_positive_total_on_any_body() {
        use crate::geometry::shape::Shape;
        for lattice in lattices() {
            let weights = GradientWeights::new(&lattice, 3.0 * widest(&lattice)).expect("fits");
            let disc = |radius: f64, x: f64| Shape::Disc { centre: [x, 0.3], radius };
            let shape = Shape::WithHoles { body: Box::new(disc(6.0, 0.0)), holes: vec![disc(1.5, 2.0)] };
            let (body, neighbours) =
                Body::build(lattice, &Cut::Shape(shape), &Neighbourhood::Collinear, None).expect("builds");
            let all = weights.of_body(&body, &neighbours);
            for i in 0..body.count() {
                let total: f64 = neighbours.bonds(i).map(|bond| all[bond]).sum();
                assert!(total > 0.9, "{}: particle {i} has {total}", body.lattice.name());
                for bond in neighbours.bonds(i) {
                    let j = neighbours.index[bond] as usize;
                    let back =
                        neighbours.bonds(j).find(|&b| neighbours.index[b] as usize == i).expect("mutual");
                    assert_eq!(all[bond], all[back]);
                }
            }
        }
    }

    #[test]
    fn a_chain_of_three_has_the_energy_of_its_two_bonds_and_its_one_triple() {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let weights = GradientWeights::new(&lattice, 2.0).expect("fits");
        let cut = Cut::Count { columns: 3, rows: 1 };
        let (body, neighbours) = Body::build(lattice, &cut, &Neighbourhood::Collinear, None).expect("builds");
        let q = weights.directions[0].1;
        let expected = [1.0 + 2.0 * q, -q, 1.0 + 2.0 * q, 1.0 + 2.0 * q, 1.0 + 2.0 * q, -q];
        assert_eq!(weights.of_body(&body, &neighbours), expected);
    }
}
