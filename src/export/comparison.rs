//! A comparison's outputs: `compare.json`, the measures and what they were taken of; `compare.csv`, every
//! particle; `cells.csv`, the stress of every cell; the figures `overlay` and `von_mises`.

use std::path::PathBuf;

use serde::Serialize;

use super::OutputFolder;
use super::csv::{row, write};
use super::error::ExportError;
use super::figures::{self, Pair};
use super::summary::write_signed;
use crate::scene::Scene;
use crate::scene::raw::RawScene;
use crate::scene::units::Units;
use crate::study::compare::measures::Comparison;
use crate::study::compare::places::PlaceComparison;
use crate::study::compare::run::Compared;

/// The file of a comparison, in place of a summary.
const FILE: &str = "compare.json";

/// The contents of `compare.json`; lengths in the scene's unit, infinities as `null`.
#[derive(Clone, Debug, Serialize)]
pub struct ComparisonReport {
    /// Short name of the scene.
    pub name: String,
    /// Title of the scene.
    pub title: String,
    /// How far rule and truth are apart.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// How the rule's run ended.
    pub rule: RuleEnd,
    /// How fine the truth was solved.
    pub truth: ReferenceSize,
    /// At the scene's `record.places`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<PlaceComparison>,
    /// Warnings about the truth.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cautions: Vec<String>,
    /// The scene, its defaults and overrides included.
    pub scene: RawScene,
}

/// The end of the rule's run.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct RuleEnd {
    /// Steps taken.
    pub steps: usize,
    /// Why the run ended, by name.
    pub stop_reason: &'static str,
    /// Largest distance of a follower from its target, over the spacing.
    pub residual: Option<f64>,
    /// The solver that found the equilibrium, unless it was stepped to, and its iterations.
    pub solver: Option<&'static str>,
    /// Iterations of that solver.
    pub iterations: Option<usize>,
}

/// The mesh of the truth.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct ReferenceSize {
    /// Nodes of the finest of its meshes.
    pub nodes: usize,
    /// Number of meshes that it was solved on.
    pub levels: usize,
    /// Its stated error of displacement, relative L2, and of strain energy, relative; `null` where a body so
    /// full of corners was solved on one mesh alone \[1\].
    pub stated_error: Option<f64>,
    /// The same of the strain energy \[1\].
    pub stated_energy_error: Option<f64>,
    /// Of the finite elements themselves \[force length\].
    pub strain_energy: f64,
}

impl ComparisonReport {
    /// The contents for a comparison of this scene.
    pub fn new(scene: &Scene, compared: &Compared) -> Self {
        let (outcome, truth) = (&compared.outcome, &compared.reference.solution);
        Self {
            name: scene.name.clone(),
            title: scene.raw.title.clone(),
            comparison: compared.comparison,
            rule: RuleEnd {
                steps: outcome.engine.step(),
                stop_reason: outcome.reason.name(),
                residual: Some(outcome.residual).filter(|residual| residual.is_finite()),
                solver: outcome.solved.as_ref().map(|solved| solved.solver.name()),
                iterations: outcome.solved.as_ref().map(|solved| solved.iterations),
            },
            truth: ReferenceSize {
                nodes: truth.nodes(),
                levels: truth.levels().len(),
                stated_error: Some(truth.error().displacement).filter(|error| error.is_finite()),
                stated_energy_error: Some(truth.error().energy).filter(|error| error.is_finite()),
                strain_energy: truth.strain_energy(),
            },
            places: compared.places.clone(),
            cautions: compared.cautions.clone(),
            scene: scene.raw.clone(),
        }
    }
}

/// Writes tables, figures and, last, the report. Returns the paths within the folder under its temporary
/// name.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_comparison(
    folder: &OutputFolder,
    scene: &Scene,
    compared: &Compared,
    report: &ComparisonReport,
) -> Result<Vec<PathBuf>, ExportError> {
    let mut written = vec![write_particles(folder, compared)?, write_cells(folder, compared)?];
    let body = compared.outcome.engine.body();
    let stress_unit = Units::of(scene).stress;
    let pair = Pair {
        title: &scene.raw.title,
        unit: scene.unit(),
        stress_unit: &stress_unit,
        spacing: body.lattice.spacing(),
        cells: &compared.cells,
        roles: compared.outcome.engine.roles(),
        reference: &body.reference,
        rule: &compared.rule,
        truth: &compared.reference.solution.displacement,
    };
    let stresses = figures::von_mises(&pair, &compared.von_mises_rule, &compared.von_mises_truth);
    written.extend(figures::write(&figures::overlay(&pair), folder, "overlay")?);
    written.extend(figures::write(&stresses, folder, "von_mises")?);
    written.push(write_signed(folder, FILE, report)?);
    Ok(written)
}

/// Reference place and both displacements of every particle \[length\].
fn write_particles(folder: &OutputFolder, compared: &Compared) -> Result<PathBuf, ExportError> {
    let (engine, truth) = (&compared.outcome.engine, &compared.reference.solution);
    let reference = &engine.body().reference;
    let rows = (0..reference.len()).map(|i| {
        let known = |values: &[f64]| truth.knows(i).then(|| values[i]);
        row! {
            id: i + 1,
            x: reference.x[i],
            y: reference.y[i],
            role: engine.roles()[i].name(),
            ux_rule: compared.rule.x[i],
            uy_rule: compared.rule.y[i],
            // Empty for a particle outside the shape, which has no true value.
            ux_truth: known(&truth.displacement.x),
            uy_truth: known(&truth.displacement.y),
        }
    });
    write(folder, "compare.csv", rows)
}

/// Centre \[length\] and stress \[force / length^2\] of every cell.
fn write_cells(folder: &OutputFolder, compared: &Compared) -> Result<PathBuf, ExportError> {
    let centres = compared.cells.centres(&compared.outcome.engine.body().reference);
    let rows = (0..centres.len()).map(|cell| {
        let [rule, truth] = [&compared.von_mises_rule, &compared.von_mises_truth].map(|values| values[cell]);
        row! { x: centres.x[cell], y: centres.y[cell], von_mises_rule: rule, von_mises_truth: truth }
    });
    write(folder, "cells.csv", rows)
}
