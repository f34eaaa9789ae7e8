//! The report of a run: the body step by step, its probes, its summary and its scene.

use std::path::PathBuf;

use super::super::error::ExportError;
use super::super::figures::{chart, probes};
use super::super::load;
use super::super::{OutputFolder, Results, Signed, Summary};
use super::frames::{Channel, MOST_FRAMES};
use super::page::{Page, file_texts, number};
use super::recorder::{STRAIN, is_solved_at_once};
use super::view::{Animation, View};
use crate::continuum::run::{Outcome, StopReason};
use crate::scene::Scene;
use crate::scene::text::counted;
use crate::scene::units::Units;

/// Writes `report.html`.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    folder: &OutputFolder,
    results: &Results<'_>,
    summary: &Summary,
    stage: View,
) -> Result<PathBuf, ExportError> {
    let (scene, outcome) = (results.scene, results.outcome);
    let mut plots =
        probes::charts(&results.records.probes, outcome.engine.body(), [scene.unit(), scene.counts()]);
    let units = Units::of(scene);
    plots.extend(load::chart(scene, &units, &results.records.load_steps));
    plots.extend(outcome.solved.as_ref().and_then(|solved| chart::residuals(&solved.residuals)));
    let page = Page {
        title: scene.raw.title.clone(),
        command: format!("flockform run {}", scene.name),
        verdict: Some(verdict(outcome, summary)),
        note: note(&stage, outcome, is_solved_at_once(scene, outcome)),
        stages: vec![stage],
        plots,
        facts: facts(scene, outcome, summary),
        texts: texts(scene, summary),
        ..Page::default()
    };
    page.write(folder)
}

fn verdict(outcome: &Outcome, summary: &Summary) -> (bool, String) {
    let (reason, step) = (&outcome.reason, outcome.engine.step());
    let words = match reason {
        StopReason::Equilibrium if outcome.solved.is_none() => {
            format!("{} at step {step}", summary.end(reason))
        }
        StopReason::Interrupted => format!("{reason} at step {step}"),
        StopReason::Steps => format!("all {step} steps done"),
        StopReason::Stuck(_) => format!("in equilibrium at increment {step}, but {reason}"),
        _ => reason.to_string(),
    };
    (reason.is_good(), words)
}

/// A sentence on the frames that are shown and those that are not.
fn note(stage: &View, outcome: &Outcome, is_solved: bool) -> String {
    let animation = &stage.animation;
    let frames = animation.times.len();
    let bits = animation.channels.first().map_or(0, |channel| channel.bits);
    let body = outcome.engine.body();
    let is_sample = body.part.is_some();
    let mut note = if is_solved {
        let meaning = match animation.linear {
            true => ", as under a load that grows evenly",
            false => "; the last alone is an equilibrium, and [load_steps] shows others",
        };
        format!(
            "Solved for its rest, not stepped: {frames} frames in equal increments of the displacement{meaning}."
        )
    } else {
        let (steps, counts) = (outcome.engine.step(), animation.clock.quantity);
        let frames = counted(frames, "frame");
        let between =
            animation.times.get(1).zip(animation.times.first()).map_or(1.0, |(second, first)| second - first);
        match between as usize {
            0 | 1 => format!("Every {counts} is shown: {frames}."),
            every => format!(
                "Of {steps} {counts}s one in {every} is shown, {frames} (a page keeps at most {MOST_FRAMES}, fewer of a body whose frames are large); bonds that broke in between show at the next."
            ),
        }
    };
    if let Some(first) = animation.times.first().filter(|&&first| first > 0.0 && !is_solved) {
        note += &format!(" This run was resumed at step {first}; earlier steps are not shown.");
    }
    let before_the_last = match stage.has_mean_stress && outcome.engine.free_edge().is_some() {
        true => {
            " Stress before the last frame is the mean of each particle's cells; at the last it is recovered along the outline too, \
             as in final.csv and films."
        }
        false => "",
    };
    if is_sample {
        note += &format!(
            " Ranks had a part of the body each: {} of its {} particles are shown, one of {} along either axis of the lattice, without bonds and cells. All values are kept to {bits} bits of each frame's range, or fewer.",
            animation.count,
            body.total(),
            (animation.spacing / body.lattice.spacing()).round(),
        );
        return note + before_the_last + " final.csv has all of them, to the last digit.";
    }
    note += &format!(" Displacements are kept to {bits} bits of each frame's range");
    note += &match animation.channels.iter().find(|channel| channel.name == STRAIN) {
        Some(Channel { bits, .. }) => format!(", other quantities to {bits}."),
        None => {
            let computed =
                if animation.stress.is_some() { "PE1, strain and stress" } else { "PE1 and strain" };
            let strain = largest_quantum(animation) / animation.spacing;
            let when = if animation.exact.is_empty() { "" } else { " before the last frame" };
            format!(
                "; {computed} are computed from them, which leaves strains{when} uncertain by about {}.",
                number(strain)
            )
        }
    };
    note += before_the_last;
    note += if animation.exact.is_empty() {
        " The body is too large for its last numbers to be kept exactly: final.csv has them."
    } else {
        " At the last frame the numbers are those of final.csv, as far as their digits are shown."
    };
    note
}

/// The coarsest step of a displacement in any frame \[length\].
fn largest_quantum(animation: &Animation) -> f64 {
    let channels = animation.channels.len().max(1);
    let is_displacement = |n: usize| animation.channels[n % channels].name.starts_with('d');
    let exponents = animation.exponents.iter().enumerate().filter(|(n, _)| is_displacement(*n));
    exponents.map(|(_, &exponent)| f64::from(exponent).exp2()).fold(0.0, f64::max)
}

fn facts(scene: &Scene, outcome: &Outcome, summary: &Summary) -> Vec<(&'static str, String)> {
    let (counts, unit) = (summary.counts, scene.unit());
    let mut facts = Vec::new();
    let mut fact = |name: &'static str, value: String| facts.push((name, value));
    let roles = [
        (counts.followers, "follower"),
        (counts.leaders, "leader"),
        (counts.clamped, "clamped"),
        (counts.frame, "frame"),
        (counts.ghosts, "ghost"),
    ];
    let roles: Vec<String> = roles
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|&(count, name)| match name {
            "frame" => format!("{count} in the frame"),
            "clamped" => format!("{count} clamped"),
            _ => counted(count, name),
        })
        .collect();
    fact("Particles", format!("{} ({})", counts.particles, roles.join(", ")));
    fact("Pairs of neighbours", counts.neighbour_pairs.to_string());
    if let Some(equilibrium) = &summary.equilibrium {
        fact("Solver", format!("{}: {}", equilibrium.solver, equilibrium.why));
        fact("Iterations", format!("{}, residual {}", equilibrium.iterations, number(equilibrium.residual)));
    } else {
        fact("Steps", summary.steps.to_string());
        fact("Largest last move", format!("{} of the spacing", number(outcome.residual)));
    }
    fact("PE1 in all", format!("{} {unit}²", number(summary.energies.pe1)));
    if let Some(strain) = summary.energies.largest_strain {
        fact("Largest strain", number(strain));
    }
    if let Some(measured) = &summary.mechanics {
        // As the program prints it at its end.
        let lines: Vec<String> =
            measured.to_string().lines().map(|line| line.trim_end().to_owned()).collect();
        fact("Mechanics", lines.join("\n"));
    }
    for caution in &summary.cautions {
        fact("Caution", caution.clone());
    }
    let broken = summary.broken_bonds;
    if broken.count > 0 {
        let first = broken.first.map_or_else(String::new, |first| {
            let [x, y] = first.place.map(number);
            format!(", the first at ({x}, {y}) {unit} in step {}", first.step)
        });
        fact("Broken bonds", format!("{}{first}", broken.count));
    }
    fact("Time", format!("{:.3} s for the steps", summary.timings.steps.as_secs_f64()));
    facts
}

fn texts(scene: &Scene, summary: &Summary) -> Vec<(String, String)> {
    let mut texts = file_texts(["scene", "Scene"], &scene.raw.notes, &scene.raw);
    let mut value = serde_json::to_value(Signed::new(summary)).unwrap_or_default();
    if let serde_json::Value::Object(table) = &mut value {
        table.remove("scene");
    }
    texts.push(("summary.json".into(), serde_json::to_string_pretty(&value).unwrap_or_default()));
    texts
}
