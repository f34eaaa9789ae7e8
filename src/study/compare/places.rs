//! Rule and truth at the places that a scene names.

use std::fmt;

use serde::Serialize;

use super::reference::Reference;
use crate::continuum::places::AtPlace;
use crate::fem::FemError;
use crate::flock::vectors::Vectors;

/// Displacement and stress at one place of the body, by the rule and by the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlaceComparison {
    /// Where the rule puts the place, and its stress.
    pub rule: AtPlace,
    /// Where the truth puts the place, and its stress.
    pub truth: AtPlace,
}

/// Both at the places of the rule.
///
/// # Errors
/// Names a place outside the shape.
pub(crate) fn compare_places(
    rule: Vec<AtPlace>,
    truth: &Reference,
) -> Result<Vec<PlaceComparison>, FemError> {
    let places: Vectors = rule.iter().map(|at| at.place).collect();
    let (moved, stress) = (truth.displacements_at(&places)?, truth.stress_at(&places)?);
    let of = |((rule, displacement), stress): ((AtPlace, [f64; 2]), crate::fem::Stress)| {
        let in_plane = [stress.xx, stress.yy, stress.xy];
        let place = rule.place;
        PlaceComparison {
            rule,
            truth: AtPlace { place, displacement, stress: in_plane, von_mises: stress.von_mises() },
        }
    };
    Ok(rule.into_iter().zip(moved.iter()).zip(stress).map(of).collect())
}

impl fmt::Display for PlaceComparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.rule.place;
        writeln!(f, "at ({x}, {y}): rule, truth")?;
        let row = |f: &mut fmt::Formatter<'_>, name: &str, of: &dyn Fn(&AtPlace) -> f64| {
            writeln!(f, "  {name:22}  {:.6e}  {:.6e}", of(&self.rule), of(&self.truth))
        };
        for (k, axis) in ["x", "y"].into_iter().enumerate() {
            row(f, &format!("displacement along {axis}"), &|at| at.displacement[k])?;
        }
        for (k, component) in ["xx", "yy", "xy"].into_iter().enumerate() {
            row(f, &format!("stress {component}"), &|at| at.stress[k])?;
        }
        row(f, "von Mises", &|at| at.von_mises)
    }
}
