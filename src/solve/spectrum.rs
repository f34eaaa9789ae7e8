//! The spectrum of a sweep: how fast a body relaxes, when feedback makes it grow, how far it may be damped.
//!
//! For a linear rule the displacements obey d' = A d with the leaders held; A is applied by the sweep
//! itself to displacements from a reference at zero, so no matrix is built. Frame points are part of `d`:
//! where they lag they are what the sweep remembers of the step before, and A is not symmetric.

use super::arnoldi::{Accuracy, Found, Wanted, eigenvalues};
use crate::flock::frame::Frame;
use crate::flock::law::Flock;
use crate::flock::role::Role;
use crate::flock::rules::{Mean, Rotation, Rule};
use crate::flock::splitmix;
use crate::flock::vectors::Vectors;
use crate::sweep::{Sweep, Update};

/// The largest modulus of an eigenvalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralRadius {
    /// The factor by which the slowest mode shrinks, or the fastest grows, per step \[1\].
    pub radius: f64,
    /// Sweeps made to find it.
    pub iterations: usize,
    /// Whether it is known to 1e-10 of itself (its residual; an error bound up to how far the sweep is from
    /// symmetric).
    pub converged: bool,
}

/// The ends of a spectrum on the real axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Least real part of an eigenvalue \[1\].
    pub lowest: f64,
    /// Greatest real part of an eigenvalue \[1\].
    pub highest: f64,
    /// Whether both are real to rounding; then, of a sweep that is symmetric in some scalar product, all are.
    pub are_real: bool,
    /// Sweeps made to find them.
    pub iterations: usize,
    /// Whether both are known to 1e-10 of themselves.
    pub converged: bool,
}

/// A linear sweep with these roles, on the displacements of the followers and the frame.
pub struct LinearSweep<'a> {
    flock: Flock,
    frame: Option<&'a Frame>,
    roles: Vec<Role>,
    sweep: Sweep,
    /// Sweeps in which an eigenvalue has to be found.
    most: usize,
}

impl<'a> LinearSweep<'a> {
    /// Eigenvalues of it are found in at most so many sweeps, `most`.
    ///
    /// `None` where the sweep is not linear (weights that depend on distance, power means, corotation), where a material has a
    /// Poisson term besides, or where no particle follows.
    ///
    /// # Panics
    /// If particles and roles are not as many.
    pub fn new(
        flock: &Flock,
        frame: Option<&'a Frame>,
        roles: &[Role],
        update: Update,
        most: usize,
    ) -> Option<Self> {
        assert_eq!(roles.len(), flock.reference.len(), "roles, for so many particles");
        let linear =
            matches!(flock.rule.mean, Mean::Barycentre | Mean::Material { rotation: Rotation::Small });
        let couples = flock.rule.mean != Mean::Barycentre && flock.rule.poisson.is_some();
        if !linear || couples || !roles.contains(&Role::Follower) {
            return None;
        }
        // Without what only shifts the place of rest: loads, rest offsets, the reference itself. Nor does the Poisson term change an
        // eigenvalue: one axis drives the other, which never drives it back, and a block triangular matrix has the eigenvalues of its
        // blocks. With it each would be there twice with one eigenvector, and known to half its digits.
        let rule = Rule { poisson: None, ..flock.rule };
        let reference = Vectors::zeros(roles.len()).into();
        let flock = Flock { rule, reference, rest: None, forces: None, ..flock.clone() };
        let sweep = Sweep::compile(update, &flock, roles);
        Some(Self { flock, frame, roles: roles.to_vec(), sweep, most })
    }

    /// The spectral radius.
    pub fn radius(&self) -> SpectralRadius {
        self.radius_to(Accuracy::Full)
    }

    /// The spectral radius as well as it takes to decide on which side of 1 it is, and about how far: to a
    /// hundredth of that, which far from 1 takes a fraction of the sweeps.
    pub fn radius_from_one(&self) -> SpectralRadius {
        self.radius_to(Accuracy::FromOne(0.01))
    }

    /// Ends of the spectrum.
    pub fn ends(&self) -> Ends {
        let wanted = (Wanted::Ends, Accuracy::Full);
        let Found { eigenvalues: found, applications: iterations, converged } =
            self.eigenvalues(1, 0, wanted, self.most);
        // One of them only where nothing could be found at all.
        let (low, high) = (found[0].value, found[found.len() - 1].value);
        let are_real = [low, high].iter().all(|v| v.im.abs() <= 1e-9 * low.norm().max(high.norm()));
        Ends { lowest: low.re, highest: high.re, are_real, iterations, converged }
    }

    /// The spectral radius of a period of these sweeps that takes the followers to be where they were `delay` periods before, while the
    /// frame remembers its last sweep: to 1e-4 of how far it is from 1. `None` where finding it would take long.
    pub fn delayed_radius(&self, sweeps: usize, delay: usize) -> Option<f64> {
        /// Most particles swept and numbers made orthogonal, these at 50 of the others each, in all: more would take seconds.
        const MOST_WORK: usize = 100_000_000;
        let count = self.roles.len();
        let most = self.most.min(
            MOST_WORK
                / count.saturating_mul(delay.saturating_add(1).saturating_mul(50).saturating_add(sweeps)),
        );
        let found = self.eigenvalues(sweeps, delay, (Wanted::Modulus, Accuracy::FromOne(1e-4)), most);
        found.converged.then(|| found.eigenvalues[0].value.norm())
    }

    fn radius_to(&self, accuracy: Accuracy) -> SpectralRadius {
        let Found { eigenvalues, applications: iterations, converged } =
            self.eigenvalues(1, 0, (Wanted::Modulus, accuracy), self.most);
        SpectralRadius { radius: eigenvalues[0].value.norm(), iterations, converged }
    }

    /// Those of a period of so many sweeps, as [`LinearSweep::delayed_radius`] has it.
    fn eigenvalues(&self, sweeps: usize, delay: usize, wanted: (Wanted, Accuracy), most: usize) -> Found {
        let count = self.roles.len();
        let (mut present, mut next) = (Vectors::zeros(count), Vectors::zeros(count));
        // A block of them for now and for each period back.
        let mut apply = |from: &[f64], to: &mut [f64]| {
            for i in 0..count {
                let block = if self.roles[i] == Role::Frame { 0 } else { delay * count };
                present.set(i, [from[2 * (block + i)], from[2 * (block + i) + 1]]);
            }
            for _ in 0..sweeps {
                next.clone_from(&present);
                self.sweep.step(&self.flock, self.frame, &present, &mut next);
                std::mem::swap(&mut present, &mut next);
            }
            to[2 * count..].copy_from_slice(&from[..2 * delay * count]);
            for i in 0..count {
                [to[2 * i], to[2 * i + 1]] = present.get(i);
            }
        };
        let mut start = self.start();
        start.resize(2 * count * (delay + 1), 0.0);
        eigenvalues(&mut apply, start, wanted, most)
    }

    /// A start with a share in every mode: of no symmetry that could hide one.
    fn start(&self) -> Vec<f64> {
        let moves = |role: Role| matches!(role, Role::Follower | Role::Frame);
        let share = |k: usize| if moves(self.roles[k / 2]) { scatter(k as u64) } else { 0.0 };
        (0..2 * self.roles.len()).map(share).collect()
    }
}

/// A number between -1 and 1 for each index, the same on every machine (splitmix64).
pub fn scatter(index: u64) -> f64 {
    let drawn = splitmix::mixed(index.wrapping_add(1).wrapping_mul(splitmix::STEP));
    (drawn >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
