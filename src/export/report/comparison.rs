//! The report of a comparison: the rule's body beside the true one.

use std::path::PathBuf;

use super::super::OutputFolder;
use super::super::comparison::ComparisonReport;
use super::super::error::ExportError;
use super::frames::{Channel, Frames};
use super::page::{Page, Table, number, scene_text};
use super::recorder::is_linear;
use super::view::{Animation, Clock, Quantity, View};
use crate::flock::vectors::Vectors;
use crate::scene::Scene;
use crate::scene::text::counted;
use crate::scene::units::Units;
use crate::study::compare::run::Compared;

/// Frames on the way from no displacement to all of it.
const FRAMES: usize = 20;
/// Bits of every quantity.
const BITS: u32 = 24;

/// Writes `report.html`.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    folder: &OutputFolder,
    scene: &Scene,
    compared: &Compared,
    report: &ComparisonReport,
) -> Result<PathBuf, ExportError> {
    let truth = &compared.reference.solution;
    let known = |i: usize| if truth.knows(i) { truth.displacement.get(i) } else { [f64::NAN; 2] };
    let truth: Vectors = (0..compared.rule.len()).map(known).collect();
    // The frame is scaffolding of the rule, of which the truth has none.
    let roles = compared.outcome.engine.roles();
    let matter = |i: usize| if roles[i].is_body() { compared.rule.get(i) } else { [f64::NAN; 2] };
    let rule: Vectors = (0..roles.len()).map(matter).collect();
    let sides = [
        ("rule", &rule, &compared.von_mises_rule),
        ("truth (finite elements)", &truth, &compared.von_mises_truth),
    ];
    let error: Vec<f64> =
        rule.iter().zip(truth.iter()).map(|(r, t)| (r[0] - t[0]).hypot(r[1] - t[1])).collect();
    let page = Page {
        title: scene.raw.title.clone(),
        command: format!("flockform compare {}", scene.name),
        verdict: None,
        stages: sides
            .map(|(name, moved, stress)| {
                stage(scene, compared, name, moved, &on_particles(compared, stress), &error)
            })
            .into(),
        note: format!(
            "{} Von Mises stresses are those at the centres of the cells, shared out to the corners; compare.csv and cells.csv have the numbers.",
            match is_linear(scene) {
                true => format!("{FRAMES} equal increments of both displacements."),
                false =>
                    "The reference and the end: displacements are not proportional to their cause.".into(),
            }
        ),
        facts: facts(scene, report),
        tables: vec![measures(report)],
        texts: vec![
            ("Measures in words".into(), report.comparison.to_string()),
            ("Scene, with its defaults and overrides".into(), scene_text(&scene.raw)),
        ],
        ..Page::default()
    };
    page.write(folder)
}

fn stage(
    scene: &Scene,
    compared: &Compared,
    name: &str,
    moved: &Vectors,
    stress: &[f64],
    error: &[f64],
) -> View {
    let engine = &compared.outcome.engine;
    let unit = scene.unit();
    let mut stage = View::new(Animation {
        name: name.into(),
        noun: "particle",
        unit: unit.into(),
        clock: Clock { quantity: "displacement", unit: "%" },
        spacing: engine.body().lattice.spacing(),
        quantities: vec![
            Quantity::new("von_mises", "von Mises stress", Units::of(scene).stress),
            Quantity::new("error", "error: distance of rule and truth", unit),
        ],
        linear: is_linear(scene),
        ..Animation::default()
    });
    stage.set_reference(&engine.body().reference);
    stage.set_roles(engine.roles(), &[]);
    stage.set_cells(&compared.cells);
    stage.add_exact(Quantity::new("ux", "x displacement", unit), moved.x.iter().copied());
    stage.add_exact(Quantity::new("uy", "y displacement", unit), moved.y.iter().copied());
    let channels = ["dx", "dy", "von_mises", "error"].map(|name| Channel { name, bits: BITS });
    let mut frames = Frames::new(moved.len(), channels.into());
    let last = if is_linear(scene) { FRAMES } else { 1 };
    for frame in 0..=last {
        let part = frame as f64 / last as f64;
        let scaled =
            [&moved.x[..], &moved.y, stress, error].map(|v| v.iter().map(|v| part * v).collect::<Vec<f64>>());
        let values = |k: usize, _: &Channel| (&scaled[k]).into();
        if frame == last { frames.keep_last(frame, values) } else { frames.keep(frame, values) }
    }
    stage.set_frames(&mut frames, |step| 100.0 * step as f64 / last as f64);
    stage
}

/// The mean of a particle's cells; NaN for particles in no cell.
fn on_particles(compared: &Compared, of_cells: &[f64]) -> Vec<f64> {
    let count = compared.rule.len();
    let incidence = compared.cells.incidence(count);
    let mean = |i: usize| {
        let cells = incidence.of(i);
        cells.iter().map(|&cell| of_cells[cell as usize]).sum::<f64>() / cells.len() as f64
    };
    (0..count).map(mean).collect()
}

fn facts(scene: &Scene, report: &ComparisonReport) -> Vec<(&'static str, String)> {
    let rule = &report.rule;
    let way = match (rule.solver, rule.iterations) {
        (Some(solver), Some(iterations)) => format!("{solver}, {}", counted(iterations, "iteration")),
        _ => counted(rule.steps, "step"),
    };
    vec![
        ("Rule", format!("by {way}: {}", rule.stop_reason)),
        (
            "Reference",
            match report.truth.stated_error {
                Some(error) => format!(
                    "finite elements on the shape, {} nodes, own error {} %",
                    report.truth.nodes,
                    number(100.0 * error)
                ),
                None => format!("finite elements on the shape, {} nodes", report.truth.nodes),
            },
        ),
        (
            "Compared",
            format!(
                "{} followers, {} cells, lengths in {}",
                report.comparison.followers,
                report.comparison.cells,
                scene.unit()
            ),
        ),
    ]
}

fn measures(report: &ComparisonReport) -> Table {
    let rows = report.comparison.rows(|part| format!("{} %", number(100.0 * part)), number);
    let rows = rows.map(|(name, value)| vec![name.replace("  ", "\u{2026} "), value]);
    Table::new("How far the rule is from the truth", &["measure", "value"], rows)
}
