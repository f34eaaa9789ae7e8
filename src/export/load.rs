//! `load.csv` and the figure `load`: what a body under a load that changes does, row by row.
//!
//! | column | what |
//! |---|---|
//! | `increment` or `step` | 0 is the body before its first |
//! | `factor` | part of the loads that is on the body \[1\] |
//! | `load.fx`, `load.fy`, `load.moment` | resultant of the loads, and its moment about the origin |
//! | `load.displacement` | mean displacement along the resultant, weighted by the loads; empty where they cancel |
//! | `loads[k].fx`, ... | the same of each load by itself, where there are several; an action that sets `loads` counts anew |
//! | `roles[k].ux`, `.uy` | mean displacement of what the entry of `roles` holds |
//! | `roles[k].fx`, `.fy`, `.moment` | its reaction, and the moment of that about the region's middle at rest |
//! | `work.loads`, `work.supports` | done since the unloaded body, by the trapezoid rule; empty where steps are swept |
//! | `strain_energy`, `von_mises` | in all, and the largest of any cell |
//!
//! Columns of loads and reactions are there where any row has such. Units are those of `summary.json`.

use std::path::PathBuf;

use super::OutputFolder;
use super::csv::write_below;
use super::error::ExportError;
use super::figures::SERIES;
use super::figures::chart::{Axis, Chart, Series, Style};
use crate::continuum::record::LoadStep;
use crate::engine::forces::Reaction;
use crate::engine::path::Work;
use crate::scene::Scene;
use crate::scene::units::Units;

/// Writes a row for each step that was kept.
pub(crate) fn write_load(
    folder: &OutputFolder,
    scene: &Scene,
    steps: &[LoadStep],
) -> Result<PathBuf, ExportError> {
    let (loads, keys) = (loads(steps), keys(steps));
    let rows = steps.iter().map(|step| (step.step, row(step, &loads, &keys)));
    write_below(&header(scene, &loads, &keys), folder, "load.csv", rows)
}

/// The entries of `roles` that hold particles in any row, in their order.
fn keys(steps: &[LoadStep]) -> Vec<&str> {
    let mut keys: Vec<&str> = Vec::new();
    for reaction in steps.iter().flat_map(|step| &step.mechanics.reactions) {
        if !keys.contains(&reaction.key.as_str()) {
            keys.push(&reaction.key);
        }
    }
    let number =
        |key: &str| key.chars().filter(char::is_ascii_digit).collect::<String>().parse::<usize>().ok();
    keys.sort_by_key(|key| number(key));
    keys
}

/// Loads that have columns: all together (`None`) and, of several, each.
fn loads(steps: &[LoadStep]) -> Vec<Option<usize>> {
    let all = steps.iter().any(|step| step.mechanics.load.is_some()).then_some(None);
    let most = steps.iter().map(|step| step.mechanics.loads.len()).max().unwrap_or(0);
    let each = (0..most).filter(|_| most > 1).map(Some);
    all.into_iter().chain(each).collect()
}

fn header(scene: &Scene, loads: &[Option<usize>], keys: &[&str]) -> Vec<String> {
    let mut names = vec![scene.counts().to_owned(), "factor".to_owned()];
    for load in loads {
        let key = load.map_or_else(|| "load".to_owned(), |k| format!("loads[{k}]"));
        names.extend(["fx", "fy", "moment", "displacement"].map(|name| format!("{key}.{name}")));
    }
    for key in keys {
        names.extend(["ux", "uy", "fx", "fy", "moment"].map(|name| format!("{key}.{name}")));
    }
    names.extend(["work.loads", "work.supports", "strain_energy", "von_mises"].map(str::to_owned));
    names
}

fn row(step: &LoadStep, loads: &[Option<usize>], keys: &[&str]) -> Vec<Option<f64>> {
    let mechanics = &step.mechanics;
    let mut numbers: Vec<Option<f64>> = vec![Some(step.factor)];
    for load in loads {
        let load = load.map_or(mechanics.load.as_ref(), |k| mechanics.loads.get(k));
        let [fx, fy] = [0, 1].map(|k| load.map(|load| load.force[k]));
        let moment = load.map(|load| load.moment_about_origin);
        numbers.extend([fx, fy, moment, load.and_then(|load| load.displacement)]);
    }
    for key in keys {
        let found = mechanics.reactions.iter().find(|reaction| reaction.key == *key);
        let of = |number: fn(&Reaction) -> f64| found.map(number);
        numbers.extend([
            of(|r| r.displacement[0]),
            of(|r| r.displacement[1]),
            of(|r| r.force[0]),
            of(|r| r.force[1]),
            of(|r| r.moment),
        ]);
    }
    let peak = mechanics.largest_von_mises.as_ref().map(|peak| peak.von_mises);
    // The row of the unloaded body comes before any work.
    let done = mechanics.work_done.or((step.step == 0).then(Work::default));
    let [by_loads, by_supports] = [done.map(|work| work.loads), done.map(|work| work.supports)];
    numbers.extend([by_loads, by_supports, Some(mechanics.strain_energy), peak]);
    // Without the sign of a zero.
    numbers.into_iter().map(|number| number.map(|number| 0.0 + number)).collect()
}

/// Load over displacement: of the loads along their resultant, and of each region that is moved along the way that it
/// goes; `None` where neither is there.
pub fn chart(scene: &Scene, units: &Units, steps: &[LoadStep]) -> Option<Chart> {
    let loads = of_loads(steps).map(|points| ("loads".to_owned(), points));
    let moved = keys(steps)
        .into_iter()
        .filter_map(|key| of_region(steps, key).map(|points| (key.to_owned(), points)));
    let series = loads.into_iter().chain(moved).zip(SERIES.iter().cycle());
    let series: Vec<Series> =
        series.map(|((name, points), colour)| Series::new(name, colour, Style::Front, points)).collect();
    let note = "force over mean displacement, both along the load or the motion; a ring is a row of load.csv";
    let axes = [Axis::new("displacement", &units.length), Axis::new("force", &units.force)];
    (!series.is_empty()).then(|| Chart::new(&scene.raw.title, note, axes, series))
}

/// Displacement and size of the resultant; `None` without loads, and where they cancel.
fn of_loads(steps: &[LoadStep]) -> Option<Vec<[f64; 2]>> {
    let load = |step: &LoadStep| {
        let load = step.mechanics.load.as_ref()?;
        let [x, y] = load.force;
        Some([load.displacement?, x.hypot(y)])
    };
    let points: Vec<[f64; 2]> = steps.iter().filter_map(load).collect();
    points.iter().any(|[_, force]| *force > 0.0).then_some(points)
}

/// Mean displacement of a region and its reaction, both along the way that takes it farthest; `None` if it stays.
fn of_region(steps: &[LoadStep], key: &str) -> Option<Vec<[f64; 2]>> {
    let rows =
        || steps.iter().filter_map(|s| s.mechanics.reactions.iter().find(|reaction| reaction.key == key));
    let size = |[x, y]: [f64; 2]| x.hypot(y);
    let farthest = rows().map(|row| row.displacement).max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
    let far = size(farthest);
    if far == 0.0 {
        return None;
    }
    let along = |v: [f64; 2]| (v[0] * farthest[0] + v[1] * farthest[1]) / far;
    Some(rows().map(|row| [along(row.displacement), along(row.force)]).collect())
}
