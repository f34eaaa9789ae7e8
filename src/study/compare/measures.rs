//! How far a rule and the truth of one body are apart.
//!
//! Displacements are compared at the particles, stresses at the centres of the cells: the truth's own there, as a rule is wrong by what
//! its cells make of right displacements too.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::split::ErrorParts;
use crate::flock::rules::Rotation;
use crate::flock::vectors::{Vectors, distance};
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::stiffness::ShapeError;
use crate::material::stress::{self, energy_between, strain_energy};

/// A rule's displacements beside the true ones. Keys ending in `_rel` and `_rel_l2` are fractions \[1\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Relative L2 error of the displacement over the followers: sqrt(sum |u - t|^2 / sum |t|^2).
    pub displacement_rel_l2: f64,
    /// Its parts: cells, their outline, solver.
    pub parts: ErrorParts,
    /// Relative L2 error that the truth states of its own displacement; `None` where it was solved on one mesh alone.
    pub truth_stated_rel_l2: Option<f64>,
    /// Largest distance between where the rule and the truth have a follower \[length\].
    pub displacement_max: f64,
    /// The same over the largest true displacement of a follower.
    pub displacement_max_rel: f64,
    /// Relative L2 error of the von Mises stress over the centres of all cells.
    pub von_mises_rel_l2: f64,
    /// Energy norm of the difference over that of the truth, both in the cells with their corners where rule and truth
    /// have them: sqrt(a(u - t, u - t) / a(t, t)). The truth within a cell is not in it, so it is less than the
    /// error of the rule.
    pub energy_rel: f64,
    /// Energy norm of the error, sqrt(|E_truth - E_rule| / E_truth): by the orthogonality of B. G. Galerkin that is it
    /// where loads alone or moved supports alone drive, under small rotations, a body of one material whose triangles and
    /// rectangles have its shape. `None` under other conditions, cells cut by an outline among them.
    pub energy_norm_rel: Option<f64>,
    /// Strain energy of the cells at the rule's displacements \[force length\].
    pub strain_energy_rule: f64,
    /// Strain energy of the truth itself \[force length\]; `None` where it is not known.
    pub strain_energy_truth: Option<f64>,
    /// Strain energy of the cells with their corners where the truth has them \[force length\].
    pub strain_energy_truth_in_cells: f64,
    /// Particles that follow and are in a cell: those compared.
    pub followers: usize,
    /// Cells whose stress and energy are compared.
    pub cells: usize,
    /// Time to the rule's equilibrium \[s\]; zero where it was not measured.
    pub seconds_rule: f64,
    /// Time to the truth's \[s\]; zero likewise.
    pub seconds_truth: f64,
}

/// Two displacements of one body. Arrays follow the particles, shape \[particles\].
#[derive(Clone, Copy, Debug)]
pub struct Sides<'a> {
    /// Cells between the particles.
    pub cells: &'a Cells,
    /// Material of the cells.
    pub elastic: &'a Elastic,
    /// Which turns of a cell are no strain.
    pub rotation: Rotation,
    /// Displacements \[length\].
    pub rule: &'a Vectors,
    /// True displacements \[length\].
    pub truth: &'a Vectors,
    /// Von Mises stress of the rule and of the truth at the centres of cells \[force / length^2\], shape \[2\]\[cells\].
    pub von_mises: [&'a [f64]; 2],
    /// Particles free to depart from the truth: the followers that are in a cell.
    pub follows: &'a [bool],
}

impl Comparison {
    /// Measures the distance; its parts are left open and times at zero.
    ///
    /// # Errors
    /// A cell that has no stiffness; those of lattices all have one.
    pub fn of(sides: &Sides<'_>) -> Result<Self, ShapeError> {
        let Sides { cells, elastic, rotation, rule, truth, von_mises, follows } = *sides;
        let followers = || (0..follows.len()).filter(|&i| follows[i]);
        let zero = [0.0; 2];
        let apart =
            |a: &Vectors, b: &Vectors| followers().map(|i| distance(a.get(i), b.get(i))).collect::<Vec<_>>();
        let still: Vectors = std::iter::repeat_n(zero, truth.len()).collect();
        let (off, size) = (apart(rule, truth), apart(truth, &still));
        let stress_off: Vec<f64> =
            von_mises[0].iter().zip(von_mises[1]).map(|(rule, truth)| rule - truth).collect();
        let energy_truth = strain_energy(cells, elastic, truth, rotation)?;
        let energy_apart = energy_between(cells, elastic, [rule, truth], rotation)?;
        Ok(Self {
            displacement_rel_l2: ratio(norm(&off), norm(&size)),
            parts: ErrorParts::default(),
            truth_stated_rel_l2: None,
            displacement_max: largest(&off),
            displacement_max_rel: ratio(largest(&off), largest(&size)),
            von_mises_rel_l2: ratio(norm(&stress_off), norm(von_mises[1])),
            energy_rel: ratio(energy_apart, energy_truth).sqrt(),
            strain_energy_rule: strain_energy(cells, elastic, rule, rotation)?,
            energy_norm_rel: None,
            strain_energy_truth: None,
            strain_energy_truth_in_cells: energy_truth,
            followers: off.len(),
            cells: cells.count(),
            seconds_rule: 0.0,
            seconds_truth: 0.0,
        })
    }
}

/// Energy norm of an error by the energies of rule and truth, relative.
pub(super) fn energy_norm(rule: f64, truth: f64) -> f64 {
    ratio((truth - rule).abs(), truth).sqrt()
}

/// Von Mises stress at the centres of cells \[force / length^2\] whose corners are displaced by
/// `displacement` \[length\], shape \[cells\]: on a quadrilateral by the bilinear formula.
pub fn von_mises(cells: &Cells, elastic: &Elastic, displacement: &Vectors, rotation: Rotation) -> Vec<f64> {
    let of_cells = stress::of_cells(cells, elastic, displacement, rotation);
    of_cells.into_iter().map(|stress| stress.von_mises).collect()
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// No error is no error, whatever it is measured by.
fn ratio(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}

impl Comparison {
    /// The measures under their names; `percent` writes a part of one, `number` a length or an energy.
    pub fn rows(
        &self,
        percent: impl Fn(f64) -> String,
        number: impl Fn(f64) -> String,
    ) -> [(&'static str, String); 13] {
        let none = || "not known".to_owned();
        let part = |part: Option<f64>| part.map_or_else(none, &percent);
        let largest = percent(self.displacement_max_rel);
        let largest = format!("{} ({largest} of the largest)", number(self.displacement_max));
        let energy_truth = self.strain_energy_truth.map_or_else(none, &number);
        [
            ("displacement, relative L2", percent(self.displacement_rel_l2)),
            ("  of which discretisation", part(self.parts.discretisation)),
            ("  of which outline", part(self.parts.outline)),
            ("  of which solver", part(self.parts.solver)),
            ("truth's own error, stated", part(self.truth_stated_rel_l2)),
            ("displacement, largest error", largest),
            ("von Mises, relative L2", percent(self.von_mises_rel_l2)),
            ("energy norm of the error", part(self.energy_norm_rel)),
            ("  at the cells' corners", percent(self.energy_rel)),
            ("strain energy, rule", format!("{}, truth {energy_truth}", number(self.strain_energy_rule))),
            ("compared", format!("{} followers, {} cells", self.followers, self.cells)),
            ("time, rule", format!("{:.3} s", self.seconds_rule)),
            ("time, truth", format!("{:.3} s", self.seconds_truth)),
        ]
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |part: f64| match 100.0 * part {
            small if small > 0.0 && small < 1e-3 => format!("{small:.1e} %"),
            part => format!("{part:.3} %"),
        };
        let rows = self.rows(percent, |value| format!("{value:.5e}"));
        let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        rows.iter().try_for_each(|(name, value)| writeln!(f, "{name:width$}  {value}"))
    }
}
