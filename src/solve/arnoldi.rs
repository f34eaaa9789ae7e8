//! Eigenvalues at the rim of a spectrum, of an operator known only by what it makes of a vector.
//!
//! Arnoldi's method (W. E. Arnoldi 1951; Y. Saad, *Numerical Methods for Large Eigenvalue Problems*, ch. 6):
//! the vectors `v, A v, A^2 v, ...` are orthogonalised, and the eigenvalues of the small matrix that this
//! leaves approach those of `A` at the rim first. Power iteration keeps the last of these vectors only: it
//! takes the number of steps that separates the two largest moduli, and where they are those of a pair
//! (`+-lambda`, a two-cycle; or complex) it never settles. Here pairs are eigenvalues like any other, and
//! the residual of each says how far it is to be believed: faer's `partial_eigen` says how many have converged, and
//! knows the largest in size alone, which is why this is written here.

use nalgebra::{Complex, DMatrix, DVector};

/// An eigenvalue as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ritz {
    pub value: Complex<f64>,
    /// `|A y - value y|` for the unit vector `y` that goes with it: an error bound where `A` is symmetric
    /// in some scalar product, up to the condition of that product.
    pub residual: f64,
}

/// Which eigenvalues are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// One of the largest modulus.
    Modulus,
    /// Those of the least and of the greatest real part, in this order.
    Ends,
}

/// How well an eigenvalue has to be known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accuracy {
    /// To ten digits.
    Full,
    /// To this part of how far its modulus is from 1, or to ten digits: enough to distinguish growth from decay.
    FromOne(f64),
}

/// The eigenvalues that were found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// One or two, as wanted; zero for the zero operator.
    pub eigenvalues: Vec<Ritz>,
    /// How often the operator was applied.
    pub applications: usize,
    /// Whether every residual is within the tolerance.
    pub converged: bool,
}

/// Residual over the largest modulus at which an eigenvalue counts as found.
const TOLERANCE: f64 = 1e-10;

/// Most vectors kept before starting over from the best combination of them, and the numbers they may
/// hold in all.
const MOST_VECTORS: usize = 240;
const MOST_NUMBERS: usize = 1 << 25;

/// Starts in which the residual has to halve: where it does not, too many eigenvalues lie as far out (those of
/// an over-relaxed sweep stand on a circle), and no number of sweeps separates them.
const PATIENCE: usize = 8;

impl Accuracy {
    /// Largest residual of an eigenvalue of an operator of this size.
    fn of(self, ritz: &Ritz, scale: f64) -> f64 {
        match self {
            Accuracy::Full => TOLERANCE * scale,
            Accuracy::FromOne(part) => (part * (ritz.value.norm() - 1.0).abs()).max(TOLERANCE * scale),
        }
    }
}

/// Eigenvalues of `apply`, which writes `A v` for its first argument into its second, from `start`.
pub fn eigenvalues(
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    start: Vec<f64>,
    (wanted, accuracy): (Wanted, Accuracy),
    most_applications: usize,
) -> Found {
    let most = MOST_VECTORS.min((MOST_NUMBERS / start.len().max(1)).max(16));
    eigenvalues_keeping(most, apply, start, (wanted, accuracy), most_applications)
}

/// The same, starting over from the best combination of so many vectors.
fn eigenvalues_keeping(
    most: usize,
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    start: Vec<f64>,
    (wanted, accuracy): (Wanted, Accuracy),
    most_applications: usize,
) -> Found {
    let mut krylov = Krylov::new(start);
    let (mut applications, mut check_at) = (0, 6);
    let mut left: Vec<f64> = Vec::new();
    loop {
        let invariant = krylov.expand(apply);
        applications += 1;
        let size = krylov.columns.len();
        let over = applications >= most_applications;
        if !(invariant || over || size == most || size >= check_at) {
            continue;
        }
        check_at = size + size / 4 + 4;
        let Some((pairs, scale)) = krylov.ritz(wanted) else {
            let unknown = Ritz { value: Complex::new(f64::NAN, 0.0), residual: f64::INFINITY };
            return Found { eigenvalues: vec![unknown], applications, converged: false };
        };
        let converged = invariant || pairs.iter().all(|(ritz, _)| ritz.residual <= accuracy.of(ritz, scale));
        let stuck = size == most && {
            left.push(pairs.iter().map(|(ritz, _)| ritz.residual).fold(0.0, f64::max));
            left.len() > PATIENCE && left[left.len() - 1] > 0.5 * left[left.len() - 1 - PATIENCE]
        };
        if converged || over || stuck {
            let eigenvalues = pairs.into_iter().map(|(ritz, _)| ritz).collect();
            return Found { eigenvalues, applications, converged };
        }
        if size == most {
            let vectors: Vec<DVector<Complex<f64>>> = pairs.into_iter().map(|(_, vector)| vector).collect();
            krylov = Krylov::new(krylov.combined(&vectors));
            check_at = 6;
        }
    }
}

/// An eigenvalue and its vector in the basis of the vectors kept.
type Pair = (Ritz, DVector<Complex<f64>>);

/// Orthonormal vectors and what the operator makes of them.
struct Krylov {
    vectors: Vec<Vec<f64>>,
    /// Column `k` holds the parts of `A v_k` along the vectors up to `k + 1`.
    columns: Vec<Vec<f64>>,
}

impl Krylov {
    fn new(mut start: Vec<f64>) -> Self {
        let size = norm(&start);
        start.iter_mut().for_each(|v| *v /= size);
        Self { vectors: vec![start], columns: Vec::new() }
    }

    /// Adds a vector; says whether there is none to add, the space being invariant.
    fn expand(&mut self, apply: &mut dyn FnMut(&[f64], &mut [f64])) -> bool {
        let last = &self.vectors[self.vectors.len() - 1];
        let mut next = vec![0.0; last.len()];
        apply(last, &mut next);
        let before = norm(&next);
        let mut column = vec![0.0; self.vectors.len()];
        // Twice is enough (W. Kahan; L. Giraud et al. 2005).
        for _ in 0..2 {
            for (part, vector) in column.iter_mut().zip(&self.vectors) {
                let along: f64 = vector.iter().zip(&next).map(|(a, b)| a * b).sum();
                *part += along;
                next.iter_mut().zip(vector).for_each(|(n, v)| *n -= along * v);
            }
        }
        let rest = norm(&next);
        let invariant = rest <= 1e-14 * before;
        column.push(if invariant { 0.0 } else { rest });
        self.columns.push(column);
        if !invariant {
            next.iter_mut().for_each(|v| *v /= rest);
            self.vectors.push(next);
        }
        invariant || !rest.is_finite()
    }

    /// The wanted eigenvalues of the small matrix with their vectors, and the largest modulus of all;
    /// `None` where they are not to be had.
    fn ritz(&self, wanted: Wanted) -> Option<(Vec<Pair>, f64)> {
        let size = self.columns.len();
        let entry = |row: usize, column: usize| self.columns[column].get(row).copied().unwrap_or(0.0);
        let small = DMatrix::from_fn(size, size, entry);
        if !small.iter().all(|v| v.is_finite()) {
            return None;
        }
        // About their mean, which leaves the digits that differ between eigenvalues of a nearly idle operator.
        let mean = small.trace() / size as f64;
        let about_mean = &small - DMatrix::identity(size, size) * mean;
        let all = all_eigenvalues(&about_mean)?.into_iter().map(|value| value + Complex::from(mean));
        let all: Vec<Complex<f64>> = all.collect();
        let most = |key: &dyn Fn(&Complex<f64>) -> f64| {
            all.iter().copied().max_by(|a, b| key(a).total_cmp(&key(b))).unwrap_or_default()
        };
        let scale = most(&|v| v.norm()).norm();
        let values = match wanted {
            Wanted::Modulus => vec![most(&|v| v.norm())],
            Wanted::Ends => vec![most(&|v| -v.re), most(&|v| v.re)],
        };
        let beyond = self.columns[size - 1][size];
        let pair = |value: Complex<f64>| {
            let vector = eigenvector(&small, value, scale);
            let residual = beyond * vector[size - 1].norm();
            (Ritz { value, residual }, vector)
        };
        Some((values.into_iter().map(pair).collect(), scale))
    }

    /// The sum of these combinations of the vectors, real and imaginary parts alike.
    fn combined(&self, parts: &[DVector<Complex<f64>>]) -> Vec<f64> {
        let mut sum = vec![0.0; self.vectors[0].len()];
        for part in parts {
            for (weight, vector) in part.iter().zip(&self.vectors) {
                let weight = weight.re + weight.im;
                sum.iter_mut().zip(vector).for_each(|(s, v)| *s += weight * v);
            }
        }
        sum
    }
}

/// All eigenvalues of a small matrix. By faer: nalgebra's QR steps never end where eigenvalues lie alike on both sides of their
/// mean, as those of a nearly idle body and of its lagging frame do.
fn all_eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let size = matrix.nrows();
    faer::Mat::from_fn(size, size, |row, column| matrix[(row, column)]).eigenvalues().ok()
}

/// The unit eigenvector of an eigenvalue known to rounding, by inverse iteration.
fn eigenvector(matrix: &DMatrix<f64>, value: Complex<f64>, scale: f64) -> DVector<Complex<f64>> {
    let size = matrix.nrows();
    // Off the eigenvalue by little, so that there is something to invert.
    let shift = value + Complex::from(1e-13 * scale.max(f64::MIN_POSITIVE));
    let shifted = DMatrix::from_fn(size, size, |row, column| {
        let diagonal = if row == column { shift } else { Complex::default() };
        Complex::from(matrix[(row, column)]) - diagonal
    });
    let factors = shifted.lu();
    let mut vector = DVector::from_fn(size, |k, _| Complex::new(1.0, 0.1 * (k as f64).sin()));
    for _ in 0..3 {
        let Some(solved) = factors.solve(&vector) else { break };
        let size = solved.norm();
        if !(size.is_finite() && size > 0.0) {
            break;
        }
        vector = solved / Complex::from(size);
    }
    vector
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product(matrix: &DMatrix<f64>) -> impl FnMut(&[f64], &mut [f64]) {
        move |from, to| to.copy_from_slice((matrix * DVector::from_column_slice(from)).as_slice())
    }

    fn start(size: usize) -> Vec<f64> {
        (0..size).map(|k| 1.0 + (0.7391 * k as f64).sin()).collect()
    }

    fn of_matrix(matrix: &DMatrix<f64>, wanted: Wanted) -> Found {
        eigenvalues(&mut product(matrix), start(matrix.nrows()), (wanted, Accuracy::Full), 20_000)
    }

    /// Half the sum of the neighbours in a row.
    fn chain_of(size: usize) -> DMatrix<f64> {
        DMatrix::from_fn(size, size, |i, j| if i.abs_diff(j) == 1 { 0.5 } else { 0.0 })
    }

    #[test]
    fn a_two_cycle_is_two_eigenvalues_and_not_a_slow_one() {
        // Swaps two: +1 and -1; and a third that shrinks.
        let swap = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
        let ends = of_matrix(&swap, Wanted::Ends);
        assert!(ends.converged);
        assert!((ends.eigenvalues[0].value.re + 1.0).abs() < 1e-12, "{ends:?}");
        assert!((ends.eigenvalues[1].value.re - 1.0).abs() < 1e-12, "{ends:?}");
    }

    #[test]
    fn a_turn_has_a_complex_pair_whose_modulus_is_found() {
        let (c, s) = (0.9 * 0.3f64.cos(), 0.9 * 0.3f64.sin());
        let turn = DMatrix::from_row_slice(3, 3, &[c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 0.8]);
        let found = of_matrix(&turn, Wanted::Modulus);
        assert!(found.converged && (found.eigenvalues[0].value.norm() - 0.9).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_chain_longer_than_the_vectors_kept_is_found_after_starting_over() {
        let (size, wanted) = (120, (Wanted::Ends, Accuracy::Full));
        let found = eigenvalues_keeping(40, &mut product(&chain_of(size)), start(size), wanted, 20_000);
        assert!(found.applications > 2 * 40, "{found:?}");
        let expected = (std::f64::consts::PI / (size as f64 + 1.0)).cos();
        assert!(found.converged, "{found:?}");
        assert!((found.eigenvalues[1].value.re - expected).abs() < 1e-9, "{found:?}");
        assert!((found.eigenvalues[0].value.re + expected).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn what_is_not_settled_is_not_called_settled() {
        let wanted = (Wanted::Modulus, Accuracy::Full);
        assert!(!eigenvalues(&mut product(&chain_of(400)), start(400), wanted, 20).converged);
    }

    #[test]
    fn eigenvalues_on_a_circle_are_given_up_and_one_outside_it_is_found() {
        // A turn of 150 places shrunk to 0.95, whose eigenvalues all have that modulus; then one of 1.02 with it.
        let apply = |outside: f64| {
            move |from: &[f64], to: &mut [f64]| {
                (0..150).for_each(|k| to[k] = 0.95 * from[(k + 1) % 150]);
                to[150] = outside * from[150];
            }
        };
        let find = |outside: f64, accuracy| {
            let start = (0..151).map(|k| crate::solve::spectrum::scatter(k as u64)).collect();
            eigenvalues_keeping(40, &mut apply(outside), start, (Wanted::Modulus, accuracy), 200_000)
        };
        let circle = find(0.5, Accuracy::Full);
        assert!(!circle.converged && circle.applications < 20_000, "{}", circle.applications);
        let outside = find(1.02, Accuracy::FromOne(0.01));
        assert!(
            outside.converged && (outside.eigenvalues[0].value.norm() - 1.02).abs() < 2e-4,
            "{outside:?}"
        );
        assert!(outside.applications < find(1.02, Accuracy::Full).applications);
    }

    #[test]
    fn an_operator_near_the_identity_is_distinguished_from_it() {
        for power in 1..17 {
            let part = 10f64.powi(-power);
            let little = DMatrix::from_fn(120, 120, |i, j| match i.abs_diff(j) {
                0 => 1.0 - part,
                1 => 0.5 * part,
                _ => 0.0,
            });
            let found = of_matrix(&little, Wanted::Modulus);
            let expected = 1.0 - part * (1.0 - (std::f64::consts::PI / 121.0).cos());
            assert!(found.converged, "{power}: {found:?}");
            assert!((found.eigenvalues[0].value.norm() - expected).abs() < 1e-9, "{power}: {found:?}");
        }
    }

    #[test]
    fn a_nearly_idle_operator_and_a_copy_that_lags_have_their_eigenvalues() {
        let (size, idle) = (60, DMatrix::identity(60, 60));
        for power in 30..36 {
            for step in [1.0, -1.0].map(|sign| sign * 10f64.powf(-0.25 * f64::from(power))) {
                let relaxed = &idle + (chain_of(size) - &idle) * step;
                let mut operator = DMatrix::zeros(2 * size, 2 * size);
                operator.view_mut((0, 0), (size, size)).copy_from(&relaxed);
                operator.view_mut((size, 0), (size, size)).copy_from(&idle);
                let found = of_matrix(&operator, Wanted::Modulus);
                let expected = 1.0 + step * ((std::f64::consts::PI / 61.0).cos() * step.signum() - 1.0);
                assert!(found.converged, "{step}: {found:?}");
                assert!((found.eigenvalues[0].value.norm() - expected).abs() < 1e-9, "{step}: {found:?}");
            }
        }
    }

    #[test]
    fn an_operator_that_makes_nothing_has_the_eigenvalue_zero() {
        let found = of_matrix(&DMatrix::zeros(4, 4), Wanted::Modulus);
        assert_eq!((found.converged, found.eigenvalues[0].value.norm()), (true, 0.0));
    }
}
