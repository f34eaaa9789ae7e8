//! The solver that `auto` takes, and why.

use super::{Choice, Precision, Request, Solver, System};

/// Followers up to which a factorisation is taken: it needs no tolerance, finds hinges, and takes at most
/// a few milliseconds. Measured to a residual of 1e-10, direct and multigrid: 0.1 and 0.1 ms on 9 x 9
/// particles, 4.3 and 0.9 ms on 33 x 33, 17 and 2.3 ms on 65 x 65; on plates with holes 8.5 and 9.1 ms with
/// 3 221 particles, 65 and 42 ms with 17 601.
pub const DIRECT_UP_TO: usize = 1_000;

/// Followers up to which a factorisation is taken near incompressibility. Measured at a Poisson's ratio of 0.4999999 in
/// plane strain, with 3 000 followers: 0.2 s, and no equilibrium after 16 000 iterations of multigrid.
pub const INCOMPRESSIBLE_UP_TO: usize = 50_000;

/// Iterations after which a solver that was chosen is given up for a factorisation: multigrid takes some tens.
pub(super) const PATIENCE: usize = 2_000;

/// Followers up to which a factorisation is still the best answer to an operator without symmetry.
pub const UNSYMMETRIC_UP_TO: usize = 200_000;

/// Followers up to which a factorisation is tried where an iteration fails. Measured with 347 000: 33 s and 3.7 GiB.
pub const FACTORISED_UP_TO: usize = 400_000;

/// The solver that a request leads to, and why.
pub fn choose(system: &System, request: &Request) -> (Solver, String) {
    if let Choice::This(solver) = request.solver {
        return (solver, "asked for".into());
    }
    let followers = system.followers();
    if system.asymmetric_pair().is_some() {
        return choose_unsymmetric(followers, "neighbours do not feel each other alike");
    }
    if request.precision == Precision::F32 {
        return (Solver::Multigrid, "in single precision only iterations are offered".into());
    }
    if followers <= DIRECT_UP_TO {
        let why = format!("factorising {followers} followers takes less time than iterating");
        return (Solver::Direct, why);
    }
    if system.is_nearly_incompressible && followers <= INCOMPRESSIBLE_UP_TO {
        let why = format!(
            "near incompressibility iterations are many, and {followers} followers can be factorised"
        );
        return (Solver::Direct, why);
    }
    (Solver::Multigrid, format!("the number of its iterations does not grow with {followers} followers"))
}

/// Whether a factorisation is to be tried after this solver took a body for unstable or did not come to an end: an
/// iteration can be wrong there, its preconditioner being an approximation.
pub(super) fn falls_back(system: &System, request: &Request, from: Solver) -> bool {
    request.solver == Choice::Auto
        && request.precision == Precision::F64
        && from != Solver::Direct
        && system.followers() <= FACTORISED_UP_TO
}

/// The solver for so many followers whose operator has no symmetry, for the reason given.
fn choose_unsymmetric(followers: usize, because: &str) -> (Solver, String) {
    if followers <= UNSYMMETRIC_UP_TO {
        (Solver::Direct, format!("{because}, and {followers} followers are few enough to factorise"))
    } else {
        (Solver::GaussSeidel, format!("{because}, which rules out the faster iterations"))
    }
}
