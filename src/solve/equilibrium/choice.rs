//! What `auto` takes, and why.

use super::{Choice, Precision, Request, Solver, System};

/// Followers up to which a direct solve is the quicker one.
const DIRECT_UP_TO: usize = 2_000;

/// Followers up to which a factorisation is still the best answer to an operator without symmetry.
const UNSYMMETRIC_UP_TO: usize = 200_000;

/// The solver that a request leads to, and why.
pub fn choose(system: &System, request: &Request) -> (Solver, String) {
    if let Choice::This(solver) = request.solver {
        return (solver, "asked for".into());
    }
    let followers = system.operator.followers();
    let has_direct = cfg!(feature = "fem");
    if system.asymmetric_pair().is_some() {
        let alike = "neighbours do not feel each other alike";
        return if has_direct && followers <= UNSYMMETRIC_UP_TO {
            (Solver::Direct, format!("{alike}, and {followers} followers are few enough to factorise"))
        } else {
            (Solver::GaussSeidel, format!("{alike}, which rules out the faster iterations"))
        };
    }
    if request.precision == Precision::F32 {
        return (Solver::Multigrid, "in single precision only iterations are offered".into());
    }
    if has_direct && followers <= DIRECT_UP_TO {
        let why = format!("{followers} followers are factorised before an iteration has begun");
        return (Solver::Direct, why);
    }
    (Solver::Multigrid, format!("the number of its iterations does not grow with {followers} followers"))
}
