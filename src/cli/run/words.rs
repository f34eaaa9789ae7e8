//! The closing messages of a run.

use std::path::Path;
use std::time::Duration;

use flockform::continuum::run::{Outcome, StopReason};
use flockform::export::report::page;
use flockform::export::{Measured, Summary};
use flockform::scene::Scene;
use flockform::scene::text::counted;

pub fn closing_words(scene: &Scene, outcome: &Outcome, summary: &Summary, elapsed: Duration) -> String {
    let engine = &outcome.engine;
    let how = &outcome.reason;
    let kept = match how {
        StopReason::Interrupted if outcome.solved.is_some() => ": what there was is written",
        StopReason::Interrupted => ": what there was is written, `flockform run --resume` goes on",
        StopReason::Diverged(_) => "; the last good state is written",
        _ => "",
    };
    let mut words = format!(
        "{}: {} {}, residual {:.2e}, {}{kept} ({:.2} s)\n",
        scene.name,
        scene.counts(),
        engine.step(),
        outcome.residual,
        summary.end(how),
        elapsed.as_secs_f64()
    );
    if let Some(solved) = &outcome.solved {
        let phases: Vec<String> =
            solved.phases.iter().map(|(name, time)| format!("{name} {:.3} s", time.as_secs_f64())).collect();
        let rounding = solved.known_to.map_or(String::new(), |error| {
            format!(" (what rounding leaves: displacements are known to about {error:.0e} of themselves)")
        });
        words += &format!(
            "{}, {}: {} to a residual force of {:.1e} of the load{rounding}, {}\n",
            solved.solver,
            solved.why,
            counted(solved.iterations, "iteration"),
            solved.residuals.last().copied().unwrap_or_default(),
            phases.join(", ")
        );
    }
    let strain = summary.energies.largest_strain.map(|strain| format!("largest strain {strain:.4e}"));
    words += &format!(
        "PE1 {:.4e} {}^2 in all, {}\n",
        summary.energies.pe1,
        scene.unit(),
        strain.unwrap_or_else(|| "strain not defined: no particle has neighbours in two directions".into()),
    );
    let broken: Vec<_> = engine.breaks().iter().filter(|b| b.step > 0).collect();
    if let (Some(first), Some(last)) = (broken.first(), broken.last()) {
        let [x, y] = first.place.map(page::number);
        words += &format!(
            "{} bonds broke, from step {} to {}, the first at ({x}, {y}) {}, {:.0} % along the body\n",
            broken.len(),
            first.step,
            last.step,
            scene.unit(),
            100.0 * engine.body().along()(first.place)
        );
    }
    words += &summary.mechanics.as_ref().map_or_else(String::new, Measured::to_string);
    words + &summary.cautions.iter().map(|caution| format!("caution: {caution}\n")).collect::<String>()
}

pub fn where_to_look(kept: &Path) -> String {
    let report = kept.join(page::FILE);
    let report = report.is_file().then(|| format!("open {}\n", report.display()));
    format!("results in {}\n{}", kept.display(), report.unwrap_or_default())
}
