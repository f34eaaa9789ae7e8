//! `summary.json`: what was run, how it ended, in numbers.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Serialize, Serializer};

use super::error::{ExportError, write_file};
use super::{OutputFolder, bonds, largest_strain};
use crate::continuum::bulk_response;
use crate::continuum::cuts;
use crate::continuum::doubts;
use crate::continuum::late;
use crate::continuum::layout::regions::uneven_sides;
use crate::continuum::mechanics::{Mechanics, Peak, Stresses, growing, percent};
use crate::continuum::places::{AtPlace, at_places};
use crate::continuum::report::{DEVIATES, dead_pressure, whole_cells};
use crate::continuum::run::{Outcome, StopReason, still_moving};
use crate::engine::Engine;
use crate::engine::forces::Reaction;
use crate::flock::body::Cut;
use crate::flock::role::Role;
use crate::flock::rules::Rotation;
use crate::geometry::outline::Outline;
use crate::geometry::point::area;
use crate::scene::raw::RawScene;
use crate::scene::text::exponent_of;
use crate::scene::units::Units;
use crate::scene::{BodySource, Scene};
use crate::solve::equilibrium::Solved;

pub(super) const PROGRAM: &str = env!("CARGO_PKG_NAME");
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A report that says which program made it: the program's name and version come first in its JSON.
#[derive(Serialize)]
pub struct Signed<'a, T> {
    program: &'static str,
    version: &'static str,
    #[serde(flatten)]
    report: &'a T,
}

impl<'a, T> Signed<'a, T> {
    /// This report, signed.
    pub fn new(report: &'a T) -> Self {
        Self { program: PROGRAM, version: VERSION, report }
    }
}

/// Writes the JSON of a report, signed.
pub(super) fn write_signed<T: Serialize>(
    folder: &OutputFolder,
    file: &str,
    report: &T,
) -> Result<PathBuf, ExportError> {
    write_json(folder, file, &Signed::new(report))
}

/// Writes JSON for people to read as well.
pub(super) fn write_json(
    folder: &OutputFolder,
    file: &str,
    value: &impl Serialize,
) -> Result<PathBuf, ExportError> {
    let path = folder.path(file);
    let text = serde_json::to_string_pretty(value).map_err(ExportError::io("write", &path))? + "\n";
    write_file(&path, text)?;
    Ok(path)
}

const FILE: &str = "summary.json";

/// Part of the forces on a body that may be left on a follower of one at rest \[1\].
const AT_REST: f64 = 1e-6;

/// Ratio of the stiffnesses of a body's materials beyond which rounding may leave too little of the softest's \[1\].
const MOST_CONTRAST: f64 = 1e8;

/// Times of the parts of a run, as JSON in seconds.
#[derive(Clone, Copy, Debug, Default, Serialize, PartialEq, Eq)]
pub struct Timings {
    /// From the scene file to the engine.
    #[serde(rename = "setup_s", serialize_with = "as_seconds")]
    pub setup: Duration,
    /// All steps, or the solve of the equilibrium.
    #[serde(rename = "steps_s", serialize_with = "as_seconds")]
    pub steps: Duration,
    /// Outputs written while the run went on; writing the others is added to it.
    #[serde(rename = "output_s", serialize_with = "as_seconds")]
    pub output: Duration,
}

fn as_seconds<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.as_secs_f64())
}

/// The contents of `summary.json`; lengths in the scene's unit, infinities as `null`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Short name of the scene.
    pub name: String,
    /// Title of the scene.
    pub title: String,
    /// Particles by role, and pairs of neighbours.
    pub counts: Counts,
    /// Steps taken.
    pub steps: usize,
    /// Why the run ended, by name.
    pub stop_reason: &'static str,
    /// The place and probable cause of divergence, if the body diverged.
    pub divergence: Option<String>,
    /// Largest one-step motion over the spacing, at the last step.
    pub residual: Option<f64>,
    /// Share of the followers' updates that were computed \[1\]: regions at rest are skipped.
    pub share_swept: Option<f64>,
    /// The solution of the equilibrium, unless it was stepped to.
    pub equilibrium: Option<Equilibrium>,
    /// Pseudo-energies and strain at the end.
    pub energies: Energies,
    /// Reactions, loads, energy and stress, where the scene has a material.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mechanics: Option<Measured>,
    /// Cautions about the result.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cautions: Vec<String>,
    /// Whether the run ended since nothing moved farther than the tolerance, far from balance.
    #[serde(skip)]
    pub is_short_of_rest: bool,
    /// Bonds that are broken at the end.
    pub broken_bonds: BrokenBonds,
    /// How long the parts of the run took.
    pub timings: Timings,
    /// The scene, its defaults and overrides included.
    pub scene: RawScene,
}

/// Particles by their role at the end, and pairs of neighbours.
#[derive(Clone, Copy, Debug, Serialize, PartialEq, Eq)]
pub struct Counts {
    /// All of them, those of the frame included.
    pub particles: usize,
    /// Particles that take the rule's target.
    pub followers: usize,
    /// Particles that are moved from outside.
    pub leaders: usize,
    /// Particles that stay where they are.
    pub clamped: usize,
    /// Particles that have left the body.
    pub ghosts: usize,
    /// Points around the body.
    pub frame: usize,
    /// Pairs of which at least one sees the other, broken ones included.
    pub neighbour_pairs: usize,
}

/// Sums over the body at the end, and the worst of it.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct Energies {
    /// \[length^2\]
    pub pe1: f64,
    /// \[length\]
    pub pe2: f64,
    /// The strain largest in size of any particle's surroundings \[1\]; absent where every particle has too few neighbours.
    pub largest_strain: Option<f64>,
}

/// The effect of fracture on the body.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct BrokenBonds {
    /// Pairs of neighbours that are broken.
    pub count: usize,
    /// The number of them that were broken before the first step: cuts and ghosts of the scene.
    pub before_the_start: usize,
    /// The first to break in a step; among several, the one that is first in `breaks.csv`.
    pub first: Option<FirstBreak>,
}

/// Where a body began to break.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct FirstBreak {
    /// Step at which it broke.
    pub step: usize,
    /// Ids, counted from 1.
    pub pair: [usize; 2],
    /// Middle of the bond in the reference configuration \[length\].
    pub place: [f64; 2],
    /// The place along the longer side of the body's bounds, from 0 to 1.
    pub along: f64,
}

/// The readings of a testing machine, with their units.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Measured {
    /// Units of the numbers, by name.
    pub units: Units,
    /// Why forces may be left on followers.
    #[serde(skip)]
    pub why_unbalanced: &'static str,
    /// Whether stresses are in axes that turn with the material.
    #[serde(skip)]
    pub is_corotated: bool,
    /// The readings themselves.
    #[serde(flatten)]
    pub mechanics: Mechanics,
    /// At the scene's `record.places`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<AtPlace>,
}

/// The solver and its work.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Equilibrium {
    /// Name of the solver.
    pub solver: &'static str,
    /// The reason for this solver.
    pub why: String,
    /// Iterations made.
    pub iterations: usize,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// Residual force over the load's, at the end \[1\].
    pub residual: f64,
    /// Where rounding ended the solve short of its tolerance: estimated relative error of the displacements \[1\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub known_to: Option<f64>,
    /// Seconds by phase.
    pub phases: BTreeMap<&'static str, f64>,
}

impl Summary {
    /// The summary of a run that took this long, made by all ranks together where each has a part of the body; `measured` is what there is to measure at its end.
    pub fn new(scene: &Scene, outcome: &Outcome, measured: Option<Measured>, timings: Timings) -> Self {
        let engine = &outcome.engine;
        let [pe1, pe2] = engine.energies();
        let largest_strain = largest_strain(engine);
        let is_tied = ties_to_reference(scene);
        let may_grow = measured.is_none() && !matches!(outcome.reason, StopReason::Diverged(_));
        let may_be_short = outcome.reason == StopReason::Equilibrium && (outcome.solved.is_none() || is_tied);
        let settled = measured.as_ref().filter(|_| may_be_short);
        let left = settled.and_then(|settled| settled.mechanics.short_of_rest(engine));
        let balance = left.map(|left| {
            let of = if engine.whole_load().is_some() { "loads" } else { "reactions" };
            if is_tied {
                return format!(
                    "feedback from the initial place ties each particle to it: at rest, {} of the {of} are not in balance",
                    percent(left)
                );
            }
            format!(
                "nothing moves farther in a step than stop.tolerance, but {} of the {of} are not in balance yet: lower \
                 stop.tolerance",
                percent(left)
            )
        });
        let is_stepped = outcome.reason == StopReason::Equilibrium && outcome.solved.is_none();
        let tolerance = scene.stop.tolerance.filter(|_| is_stepped);
        let moving = tolerance.and_then(|tolerance| still_moving(engine, outcome.residual, tolerance));
        Self {
            name: scene.name.clone(),
            title: scene.raw.title.clone(),
            counts: counts(&outcome.engine),
            steps: outcome.engine.step(),
            stop_reason: outcome.reason.name(),
            divergence: match &outcome.reason {
                StopReason::Diverged(_) => outcome.reason.fault(),
                _ => None,
            },
            residual: Some(outcome.residual).filter(|residual| residual.is_finite()),
            share_swept: outcome.solved.is_none().then(|| outcome.engine.activity().share_computed()),
            equilibrium: outcome.solved.as_ref().map(Equilibrium::of),
            energies: Energies { pe1, pe2, largest_strain },
            is_short_of_rest: moving.is_some() || (balance.is_some() && !is_tied),
            cautions: [balance, moving, ended_short(scene, outcome)]
                .into_iter()
                .flatten()
                .chain(cautions(scene, outcome, measured.as_ref()))
                .chain(may_grow.then(|| growing(engine, largest_strain.unwrap_or(0.0))).flatten())
                .collect(),
            mechanics: measured,
            broken_bonds: broken_bonds(&outcome.engine),
            timings,
            scene: scene.raw.clone(),
        }
    }

    /// How the run ended, the end of a sentence.
    pub fn end(&self, reason: &StopReason) -> String {
        if self.is_short_of_rest { "no move beyond stop.tolerance".to_owned() } else { reason.to_string() }
    }

    /// Writes `summary.json`.
    pub fn write(&self, folder: &OutputFolder) -> Result<PathBuf, ExportError> {
        write_signed(folder, FILE, self)
    }
}

fn cautions(scene: &Scene, outcome: &Outcome, measured: Option<&Measured>) -> Vec<String> {
    let engine = &outcome.engine;
    let is_at_rest = outcome.reason == StopReason::Equilibrium;
    let of_forces = |measured: &Measured| {
        dead_pressure(scene)
            .into_iter()
            .chain(off_the_shape(scene, engine))
            .chain(whole_cells(scene))
            .chain(measured.mechanics.cautions(engine))
            .collect::<Vec<_>>()
    };
    uneven_sides(scene)
        .into_iter()
        .chain((!is_at_rest).then(|| bulk_response::cautions(scene)).into_iter().flatten())
        .chain(late::cautions(scene))
        .chain(doubts::seen(scene, engine))
        .chain(cuts::made(scene, engine))
        .chain(measured.map(of_forces).into_iter().flatten())
        .collect()
}

/// Names a body of whole cells whose area is not its shape's; found by all ranks together.
fn off_the_shape(scene: &Scene, engine: &Engine) -> Option<String> {
    let BodySource::Cut(Cut::Shape(shape)) = &scene.body else { return None };
    let cells = engine.cells().filter(|_| !scene.is_fitted)?;
    let whole = Outline::of_shape(shape).ok()?.area();
    let areas: Vec<f64> = cells.shapes.iter().map(area).collect();
    let (body, count) = (engine.body(), cells.count_whole());
    let own = cells
        .owned(body)
        .into_iter()
        .flatten()
        .map(|cell| (body.cell_after_all(cell, count), [areas[cells.kind[cell] as usize]]));
    let off = engine.sum_of_parts([-0.0], own)[0] / whole - 1.0;
    (off.abs() > DEVIATES).then(|| {
        format!(
            "the body is not the shape: its area is {:+.2} % off; use body.outline = \"fitted\" or a smaller spacing",
            100.0 * off
        )
    })
}

/// Whether feedback holds particles by more than their material.
fn ties_to_reference(scene: &Scene) -> bool {
    scene.feedback.is_some_and(|feedback| feedback.ties_to_reference())
}

/// The likely cause of a solve that ended short of its tolerance, where there is one.
fn ended_short(scene: &Scene, outcome: &Outcome) -> Option<String> {
    if outcome.reason != StopReason::Unsettled {
        return None;
    }
    let all = scene.material.iter().chain(scene.inclusions.iter().map(|part| &part.material));
    let stiffness = all.map(|elastic| elastic.stiffness()[(2, 2)]);
    let range = stiffness.fold([f64::INFINITY, 0.0], |[low, high], own| [own.min(low), own.max(high)]);
    let contrast = range[1] / range[0];
    if contrast > MOST_CONTRAST {
        return Some(format!(
            "the stiffest material is {contrast:.0e} times as stiff as the softest, which likely keeps the solver from \
             its tolerance: bring the stiffnesses closer together"
        ));
    }
    let is_rounding = scene.material.is_some() && outcome.solved.as_ref()?.known_to.is_some();
    let other = match scene.rotation() {
        Rotation::Small => "rule.mean.rotation = \"corotated\", which leaves turns out, ",
        Rotation::Corotated => "",
    };
    is_rounding.then(|| {
        format!(
            "what rounding leaves of the stiffness of so slender a body likely holds it as supports do: use {other}another \
             equilibrium.solver, or a wider spacing"
        )
    })
}

impl Measured {
    /// At the places where a run ended, and the stresses there; `None` without a material.
    pub fn of(scene: &Scene, outcome: &Outcome) -> Option<(Self, Stresses)> {
        let engine = &outcome.engine;
        let stresses = Stresses::at_present(engine)?;
        let mechanics = Mechanics::under(&stresses, engine)?;
        let places = at_places(scene, engine, &stresses);
        let why_unbalanced = match &outcome.solved {
            _ if ties_to_reference(scene) => "what feedback from the initial place holds",
            Some(solved) if solved.is_at_rest() => "what tolerance and rounding leave",
            _ => "not at rest",
        };
        let is_corotated = engine.flock().rule.mean.rotation() == Rotation::Corotated;
        Some((Self { units: Units::of(scene), why_unbalanced, is_corotated, mechanics, places }, stresses))
    }
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { units, why_unbalanced, is_corotated, mechanics, places } = self;
        let (force, moment, length) = (&units.force, &units.moment, &units.length);
        // Rounding of the larger component is no number of the smaller one.
        let shown = |value: f64, beside: f64| if value.abs() < 1e-9 * beside.abs() { 0.0 } else { value };
        let pair = |[x, y]: [f64; 2]| format!("({}, {})", short(shown(x, y)), short(shown(y, x)));
        if !mechanics.reactions.is_empty() {
            writeln!(f, "reactions, force [{force}] and moment [{moment}] on the body:")?;
        }
        for reaction in &mechanics.reactions {
            let Reaction { key, role, particles, centre, force, moment, moment_about_origin, .. } = reaction;
            let moments = format!(
                "{} about {} {length}, {} about the origin",
                short(shown(*moment, *moment_about_origin)),
                pair(*centre),
                short(*moment_about_origin)
            );
            writeln!(f, "  {key} ({role}, {particles} particles)  {}, moment {moments}", pair(*force))?;
        }
        let each = mechanics.loads.iter().enumerate().map(|(k, load)| (format!("loads[{k}]"), load));
        let all = mechanics.load.iter().filter(|_| mechanics.loads.len() != 1);
        for (name, load) in each.chain(all.map(|load| ("loads in all".to_owned(), load))) {
            let about = short(load.moment_about_origin);
            writeln!(f, "{name}  {} {force}, moment {about} {moment} about the origin", pair(load.force))?;
        }
        let work = mechanics.work.map_or_else(String::new, |work| {
            format!("; force times way, loads {}, supports {}", short(work.loads), short(work.supports))
        });
        let done = mechanics.work_done.map_or_else(String::new, |work| {
            format!(
                "; done on the way by the loads {}, by the supports {}",
                short(work.loads),
                short(work.supports)
            )
        });
        writeln!(f, "strain energy {} {moment}{work}{done}", short(mechanics.strain_energy))?;
        let sizes = mechanics.reactions.iter().map(|reaction| reaction.force);
        let sizes = sizes.chain(mechanics.load.map(|load| load.force)).map(|[x, y]| x.hypot(y));
        let largest = sizes.fold(0.0, f64::max);
        if let Some(left) = mechanics.unbalanced.filter(|left| *left > AT_REST * largest) {
            writeln!(
                f,
                "{why_unbalanced}: an unbalanced force of {} {force} acts on a follower",
                short(left)
            )?;
        }
        if let Some(Peak { von_mises, cell, place, particles }) = &mechanics.largest_von_mises {
            let stress = &units.stress;
            let in_what = match (cell, particles.first()) {
                (Some(cell), _) => format!("in cell {cell}"),
                (None, Some(id)) => format!("at the edge, particle {id},"),
                (None, None) => String::new(),
            };
            let value = short(*von_mises);
            writeln!(f, "largest von Mises stress {value} {stress}, {in_what} at {} {length}", pair(*place))?;
        }
        for AtPlace { place, displacement, stress: [xx, yy, xy], von_mises } in places {
            let ([xx, yy, xy, von_mises], unit) = ([*xx, *yy, *xy, *von_mises].map(short), &units.stress);
            let moved = format!("at {} {length}: moved by {} {length}", pair(*place), pair(*displacement));
            let axes = if *is_corotated { " in axes that turn with the material" } else { "" };
            writeln!(f, "{moved}, stress ({xx}, {yy}, {xy}) {unit}{axes}, von Mises {von_mises} {unit}")?;
        }
        Ok(())
    }
}

/// Five digits.
fn short(value: f64) -> String {
    match exponent_of(value, 5) {
        _ if value == 0.0 => "0".into(),
        Some(exponent @ -3..=4) => format!("{value:.*}", (4 - exponent) as usize),
        _ => format!("{value:.4e}"),
    }
}

impl Equilibrium {
    fn of(solved: &Solved) -> Self {
        Self {
            solver: solved.solver.name(),
            why: solved.why.clone(),
            iterations: solved.iterations,
            converged: solved.converged,
            residual: solved.residuals.last().copied().unwrap_or_default(),
            known_to: solved.known_to,
            phases: solved.phases.iter().map(|(name, time)| (*name, time.as_secs_f64())).collect(),
        }
    }
}

fn counts(engine: &Engine) -> Counts {
    let owned = engine.body().owned();
    let of = |role: Role| engine.roles()[owned.clone()].iter().filter(|&&r| r == role).count();
    let roles = [Role::Follower, Role::Leader, Role::Clamped, Role::Ghost, Role::Frame].map(of);
    let own = bonds::pairs(&engine.flock().neighbours).filter(|&[j, _]| owned.contains(&(j as usize)));
    let [followers, leaders, clamped, ghosts, frame] = roles;
    let own = [owned.len(), followers, leaders, clamped, ghosts, frame, own.count()];
    let all =
        engine.parted().map_or(own, |team| team.sum(own.map(|count| count as u64)).map(|sum| sum as usize));
    let [particles, followers, leaders, clamped, ghosts, frame, neighbour_pairs] = all;
    Counts { particles, followers, leaders, clamped, ghosts, frame, neighbour_pairs }
}

fn broken_bonds(engine: &Engine) -> BrokenBonds {
    let breaks = engine.breaks();
    let first = breaks.iter().find(|one| one.step > 0);
    BrokenBonds {
        count: breaks.len(),
        before_the_start: breaks.iter().filter(|one| one.step == 0).count(),
        first: first.map(|one| FirstBreak {
            step: one.step,
            pair: engine.body().ids(one.pair),
            place: one.place,
            along: engine.body().along()(one.place),
        }),
    }
}
