//! Loads, stiffnesses and lengths that squares or single precision cannot hold.

use super::{Case, End, MATERIAL, OWN, Outcome, small};
use crate::scene::SceneError;

/// A cantilever in numbers of its own.
#[derive(Clone, Copy)]
struct Numbers {
    spacing: f64,
    young: f64,
    traction: f64,
}

const ORDINARY: Numbers = Numbers { spacing: 1.0, young: 1000.0, traction: 1.0 };

pub fn cases() -> Vec<Case> {
    let asked = [
        ("loads and stiffness times 1e39", Numbers { young: 1e42, traction: 1e39, ..ORDINARY }),
        ("loads and stiffness times 1e-39", Numbers { young: 1e-36, traction: 1e-39, ..ORDINARY }),
        ("coordinates times 1e39", Numbers { spacing: 1e39, ..ORDINARY }),
        ("coordinates times 1e-50", Numbers { spacing: 1e-50, ..ORDINARY }),
        ("loads and stiffness times 1e200", Numbers { young: 1e203, traction: 1e200, ..ORDINARY }),
        ("loads and stiffness times 1e-200", Numbers { young: 1e-197, traction: 1e-200, ..ORDINARY }),
    ];
    let mut all = Vec::new();
    for (name, numbers) in asked {
        for (precision, within) in [("f32", 1e-2), ("f64", 1e-6)] {
            for solver in ["conjugate-gradients", "multigrid"] {
                let outcome = against_ordinary(numbers, precision, solver, within);
                all.push(Case::new(format!("{name}, {precision} {solver}"), OWN, outcome));
            }
        }
    }
    for precision in ["f32", "f64"] {
        let numbers = Numbers { young: 1e-300, traction: 1e300, ..ORDINARY };
        let name = format!("a load 1e600 times the stiffness, {precision}");
        all.push(Case::new(name, OWN, against_ordinary(numbers, precision, "multigrid", 1e-2)));
    }
    all
}

fn against_ordinary(
    numbers: Numbers,
    precision: &str,
    solver: &str,
    within: f64,
) -> Result<Outcome, SceneError> {
    let (base, end) = (rest(ORDINARY, "f64", "multigrid")?, rest(numbers, precision, solver)?);
    let factor = numbers.spacing / ORDINARY.spacing;
    let check = "the same body in ordinary numbers and double precision";
    Ok(Outcome::judged(base.apart_from(&end, factor), within, check))
}

fn rest(numbers: Numbers, precision: &str, solver: &str) -> Result<End, SceneError> {
    let Numbers { spacing, young, traction } = numbers;
    let tolerance = if precision == "f32" { 1e-4 } else { 1e-10 };
    let overrides = [
        format!("lattice.spacing={spacing:e}"),
        format!(r#"material={{kind="isotropic",young={young:e},poisson=0.3,thickness={spacing:e}}}"#),
        r#"roles=[{region={kind="edge",side="left"},role="clamped"}]"#.to_owned(),
        format!(
            r#"loads=[{{kind="traction",region={{kind="edge",side="right"}},traction=[0.0,{traction:e}]}}]"#
        ),
        format!("equilibrium={{solver=\"{solver}\",tolerance={tolerance:e},precision=\"{precision}\"}}"),
        MATERIAL.to_owned(),
    ];
    End::of(&small(&overrides)?)
}
