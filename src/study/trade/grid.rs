//! The settings that are tried.

use serde::Serialize;

use crate::scene::Scene;
use crate::scene::raw::{RawLattice, RawMean, RawShape};
use crate::solve::equilibrium::Solver;

/// How far the study goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Spacings tried, as parts of the scene's \[1\].
    pub spacings: Vec<f64>,
    /// Tolerances that every solver but a factorisation is tried with \[1\].
    pub tolerances: Vec<f64>,
    /// Solvers that are tried.
    pub solvers: Vec<Solver>,
    /// Larger bodies are left out.
    pub max_particles: usize,
    /// Sweeps (damped Jacobi, Gauss-Seidel) of larger bodies are left out: they take forever.
    pub most_particles_to_sweep: usize,
    /// Runs of each setting; the median time counts.
    pub repeats: usize,
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            spacings: vec![2.0, 1.0, 0.5, 0.25, 0.125],
            tolerances: vec![1e-2, 1e-4, 1e-6, 1e-8],
            solvers: Solver::ALL.to_vec(),
            max_particles: 20_000,
            most_particles_to_sweep: 2_000,
            repeats: 3,
        }
    }
}

impl Grid {
    /// Enough to see that the study works.
    pub fn quick() -> Self {
        Self {
            spacings: vec![1.0, 0.5],
            tolerances: vec![1e-2, 1e-6],
            solvers: vec![Solver::ConjugateGradients, Solver::Multigrid],
            max_particles: 3_000,
            repeats: 1,
            ..Self::default()
        }
    }
}

named! {
    /// The rule of a setting.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum RuleChoice {
        /// Eq. 1, with the scene's neighbours or the first ones.
        Paper => "paper",
        /// The matrix weights of the scene's material.
        Material => "material",
    }
}

/// One way to run the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// The rule that moves the followers.
    pub rule: RuleChoice,
    /// Distance of nearest particles over the scene's \[1\].
    pub spacing: f64,
    /// Name of the solver; empty where the scene was refused before one was tried.
    pub solver: &'static str,
    /// Relative residual that was asked for \[1\]; a factorisation does not look at it.
    pub tolerance: f64,
    /// Bits of a number: 32 or 64.
    pub bits: u32,
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (rule, spacing, bits) = (self.rule.name(), self.spacing, self.bits);
        write!(f, "{rule} rule, {spacing} x spacing, {}", self.solver)?;
        // A factorisation has no tolerance to choose.
        if self.solver != Solver::Direct.name() {
            write!(f, " to {:e}", self.tolerance)?;
        }
        write!(f, ", f{bits}")
    }
}

/// Whether a body of this part of the scene's spacing has the extent of the scene's own: a grid has a whole number of gaps.
pub fn divides(scene: &Scene, part: f64) -> bool {
    match scene.raw.body.shape {
        RawShape::Grid { columns, rows } => {
            [columns, rows].iter().all(|&count| (f64::from(count - 1) / part).fract() == 0.0)
        }
        _ => true,
    }
}

/// Overrides that give a scene this rule at this part of its spacing, which [`divides`] it.
pub fn body_overrides(scene: &Scene, rule: RuleChoice, part: f64) -> Vec<String> {
    let mut overrides = Vec::new();
    let mean = match (rule, &scene.raw.rule.mean) {
        (RuleChoice::Paper, _) => Some("barycentre"),
        (RuleChoice::Material, Some(RawMean::Material { .. })) => None,
        (RuleChoice::Material, _) => Some("material"),
    };
    overrides.extend(mean.map(|kind| format!("rule.mean={{kind=\"{kind}\"}}")));
    if part == 1.0 {
        return overrides;
    }
    match scene.raw.lattice {
        None => {}
        Some(
            RawLattice::Square { spacing, .. }
            | RawLattice::Hexagonal { spacing, .. }
            | RawLattice::Honeycomb { spacing, .. },
        ) => {
            overrides.push(format!("lattice.spacing={:?}", part * spacing));
        }
        Some(
            RawLattice::Rectangular { a, b, .. }
            | RawLattice::CentredRectangular { a, b, .. }
            | RawLattice::Oblique { a, b, .. },
        ) => {
            overrides.extend([("a", a), ("b", b)].map(|(key, v)| format!("lattice.{key}={:?}", part * v)));
        }
    }
    if let RawShape::Grid { columns, rows } = scene.raw.body.shape {
        // The same extent: one gap less than there are particles.
        let rescaled = |count: u32| (f64::from(count - 1) / part).round() as u32 + 1;
        let counts = [("columns", columns), ("rows", rows)];
        overrides.extend(counts.map(|(key, count)| format!("body.shape.{key}={}", rescaled(count))));
    }
    overrides
}

/// Overrides that have a scene solved in this way.
pub fn solver_overrides(setting: &Setting) -> Vec<String> {
    let Setting { solver, tolerance, bits, .. } = setting;
    vec![format!("equilibrium={{solver=\"{solver}\",tolerance={tolerance:?},precision=\"f{bits}\"}}")]
}

/// The settings of one rule and spacing, for a body of so many particles.
pub fn settings(grid: &Grid, rule: RuleChoice, spacing: f64, particles: usize) -> Vec<Setting> {
    let sweeps = |solver: &Solver| matches!(solver, Solver::Jacobi | Solver::GaussSeidel);
    let fits = |solver: &&Solver| !sweeps(solver) || particles <= grid.most_particles_to_sweep;
    let mut all = Vec::new();
    for solver in grid.solvers.iter().filter(fits) {
        let tolerances = if *solver == Solver::Direct { &grid.tolerances[..1] } else { &grid.tolerances[..] };
        for &tolerance in tolerances {
            let single = solver.has_single() && tolerance >= crate::solve::equilibrium::SINGLE_FLOOR;
            let bits: &[u32] = if single { &[32, 64] } else { &[64] };
            let one = |&bits: &u32| Setting { rule, spacing, solver: solver.name(), tolerance, bits };
            all.extend(bits.iter().map(one));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::bundled;

    #[test]
    fn a_grid_keeps_its_extent_at_any_spacing() {
        let scene = bundled("tension").expect("bundled").load(&[]).expect("loads");
        let overrides = body_overrides(&scene, RuleChoice::Paper, 0.5);
        let finer = bundled("tension").expect("bundled").load(&overrides).expect("loads");
        let RawShape::Grid { columns, rows } = finer.raw.body.shape else { panic!("a grid") };
        assert_eq!((columns, rows, finer.lattice.spacing()), (19, 19, 0.5));
    }

    #[test]
    fn sweeps_are_left_out_for_large_bodies_and_singles_for_tight_tolerances() {
        let grid = Grid::default();
        let small = settings(&grid, RuleChoice::Paper, 1.0, 100);
        let large = settings(&grid, RuleChoice::Paper, 1.0, 100_000);
        assert!(small.iter().any(|s| s.solver == "jacobi") && large.iter().all(|s| s.solver != "jacobi"));
        assert!(large.iter().any(|s| s.bits == 32));
        assert!(large.iter().all(|s| s.bits == 64 || s.tolerance >= 1e-5));
    }
}
