//! The report of a plan: what the scene models, what it leaves out, and why.

use std::fmt;

use super::active_share::active_share;
use super::bulk_response;
use super::cuts;
use super::deviation::{Deviation, pieces};
use super::doubts;
use super::edge_stress;
use super::equilibrium::select_solver;
use super::late;
use super::layout::regions::uneven_sides;
use super::memory::neighbour_entries;
use super::plan::Plan;
use crate::engine::setup::Setup;
use crate::flock::fracture::Threshold;
use crate::flock::law::Weights;
use crate::flock::role::Role;
use crate::flock::rules::{Mean, Rotation};
use crate::geometry::point::area;
use crate::material::outline_loads::Resultant;
use crate::scene::document::{find, split_assignment};
use crate::scene::raw::{RawAction, RawActionKind, RawLoad, RawShape};
use crate::scene::text::{counted, percent};
use crate::scene::{LoadSteps, Scene, SceneError, Weights as SceneWeights};
use crate::sweep::{Order, Sweep};

/// A plan in words and numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanReport {
    /// Name and title of the scene.
    pub title: String,
    /// Name and value of everything that was laid out, for the reader.
    pub facts: Vec<(String, String)>,
    /// Effects that are modelled, each with the key of the scene that asks for it.
    pub modelled: Vec<(String, String)>,
    /// Effects that are left out, each with the key that would ask for it.
    pub left_out: Vec<(String, String)>,
    /// Warnings before the run.
    pub cautions: Vec<String>,
}

impl PlanReport {
    /// # Errors
    /// Names what keeps the scene from having the equilibrium it asks for.
    pub fn new(scene: &Scene, plan: &Plan) -> Result<Self, SceneError> {
        let deviation = Deviation::of(plan);
        let mut report = Self {
            title: format!("{}: {}", scene.name, scene.raw.title),
            facts: facts(scene, plan, deviation.as_ref())?,
            modelled: Vec::new(),
            left_out: Vec::new(),
            cautions: cautions(scene, plan, deviation.as_ref()),
        };
        report.capabilities(scene, plan);
        // What an action asks for later is not left out.
        for (key, because) in std::mem::take(&mut report.left_out) {
            match set_later(scene, &key) {
                Some((k, at)) => report.models(format!("{key} from step {at} on"), &format!("actions[{k}]")),
                None => report.left_out.push((key, because)),
            }
        }
        Ok(report)
    }

    fn capabilities(&mut self, scene: &Scene, plan: &Plan) {
        let rule = plan.setup.flock.rule;
        self.models(rule.mean.to_string(), "rule.mean");
        let forces = plan.setup.flock.forces.as_ref().map(|_| match scene.loads.len() {
            1 => "1 load".to_owned(),
            many => format!("{many} loads"),
        });
        self.models_or_not(forces, "loads", "nothing pushes the body but its leaders");
        if scene.material.is_some() {
            self.models_or_not(inclusions(scene, plan), "body.inclusions", "the body is of one material");
            let parts = scene.load_steps.as_ref().map(load_steps);
            self.models_or_not(parts, "load_steps", "loads and motions are not measured on the way");
        }
        let frame = scene.frame.map(|frame| {
            let points = plan.setup.body.frame.as_ref().map_or(0, |frame| frame.len());
            format!("{} frame of {points} points", frame.name())
        });
        let free = match rule.mean {
            Mean::Material { .. } => "missing cells are the free edge",
            _ => "edge particles have fewer neighbours",
        };
        self.models_or_not(frame, "frame", free);
        let rest =
            plan.setup.flock.rest.as_ref().map(|_| "rest offsets for unbalanced neighbourhoods".to_owned());
        let no_rest = match plan.setup.present_radius {
            Some(_) => "neighbours that are found anew have no reference to keep",
            None => "every neighbourhood is balanced, or rule.rest is \"literal\"",
        };
        self.models_or_not(rest, "rule.rest", no_rest);
        let weights = match &plan.setup.flock.weights {
            Weights::Equal => None,
            Weights::Scalar(_) => Some(match scene.weights {
                Some(SceneWeights::Gradient { length }) => {
                    format!("second gradient of length {length} {}", scene.unit())
                }
                Some(SceneWeights::Solved) => "weights that reproduce each particle's place".to_owned(),
                _ => "fixed weights".to_owned(),
            }),
            Weights::Matrix(weights) => Some(format!(
                "2x2 weights from the material, {} kinds of neighbourhood",
                weights.compliance.len()
            )),
        };
        let key = if matches!(rule.mean, Mean::Material { .. }) { "material" } else { "rule.weights" };
        self.models_or_not(weights, key, "all neighbours count the same");
        let poisson = rule.poisson.map(|p| format!("Poisson term (Eq. 2), K = {}", p.k));
        self.models_or_not(poisson, "rule.poisson", "x and y do not act on each other");
        let feedback = rule.feedback.map(|f| format!("feedback (Eq. 4), fd = {}", f.factor));
        self.models_or_not(feedback, "rule.feedback", "targets are not overshot");
        let fracture = plan.setup.flock.bonds.as_ref().map(|bonds| match bonds.threshold {
            Some(Threshold::Distance(df)) => format!("fracture past df = {df} {}", scene.unit()),
            Some(Threshold::Stretch(ratio)) => format!("fracture past {ratio} times a bond's length"),
            None => match set_later(scene, "fracture") {
                Some((k, at)) => format!("broken bonds, by a threshold from step {at} on (actions[{k}])"),
                None => "broken bonds (no threshold: only cuts and ghosts break them)".to_owned(),
            },
        });
        self.models_or_not(fracture, "fracture", "no bond can break");
        let anew =
            plan.setup.present_radius.map(|r| format!("neighbours found anew at every step within {r}"));
        self.models_or_not(anew, "neighbours.kind = \"dynamic\"", "neighbours are those of the reference");
        let vtk = (scene.record.vtk_every > 0).then(|| match scene.is_solved_at_once() {
            true => "a ParaView file of the equilibrium".to_owned(),
            false => format!("ParaView files every {} {}s", scene.record.vtk_every, scene.counts()),
        });
        self.models_or_not(vtk, "record.vtk_every", "no ParaView files are written");
    }

    fn models(&mut self, what: String, key: &str) {
        self.modelled.push((what, key.to_owned()));
    }

    fn models_or_not(&mut self, what: Option<String>, key: &str, because: &str) {
        match what {
            Some(what) => self.models(what, key),
            None => self.left_out.push((key.to_owned(), because.to_owned())),
        }
    }
}

/// The first action that sets a key, something in it, or it within another: its number, and the step from which on it holds.
fn set_later(scene: &Scene, key: &str) -> Option<(usize, usize)> {
    let is_in_it = |rest: &str| rest.starts_with(['=', '.', '[']);
    let sets = |action: &RawAction| match &action.what {
        RawActionKind::Set { keys } => keys.iter().any(|set| {
            set.trim_start().strip_prefix(key).is_some_and(|rest| is_in_it(rest.trim_start()))
                || is_within(set, key)
        }),
        RawActionKind::Cut { .. } => false,
    };
    let found = scene.raw.actions.iter().enumerate().find(|(_, action)| sets(action));
    found.map(|(k, action)| (k, action.at))
}

/// Whether what is set is a table that has the key in it.
fn is_within(set: &str, key: &str) -> bool {
    let within = || {
        let (path, value) = split_assignment(set)?;
        let rest = key.strip_prefix(path)?.strip_prefix('.')?;
        let value = toml::from_str::<serde_json::Value>(&format!("value = {value}")).ok()?;
        find(&value, &format!("value.{rest}")).map(|_| ())
    };
    within().is_some()
}

/// What is done to the body while it is stepped.
fn actions(scene: &Scene) -> impl Iterator<Item = (String, String)> + '_ {
    scene.raw.actions.iter().enumerate().map(|(k, RawAction { at, what })| {
        let what = match what {
            RawActionKind::Set { keys } => format!("from step {at} on {}", keys.join(", ")),
            RawActionKind::Cut { from: [x, y], to: [to_x, to_y] } => {
                format!("at step {at} bonds break from ({x}, {y}) to ({to_x}, {to_y})")
            }
        };
        (format!("actions[{k}]"), what)
    })
}

/// How much of the body is of other materials.
fn inclusions(scene: &Scene, plan: &Plan) -> Option<String> {
    let cells = plan.setup.cells.as_ref().filter(|cells| !cells.inclusions.is_empty())?;
    let mut areas = vec![0.0; cells.inclusions.len() + 1];
    let of_kind: Vec<f64> = cells.shapes.iter().map(area).collect();
    cells.kind.iter().for_each(|&k| areas[cells.region[k as usize] as usize] += of_kind[k as usize]);
    let whole: f64 = areas.iter().sum();
    let shares: Vec<String> =
        areas[1..].iter().map(|area| format!("{:.4} %", 100.0 * area / whole)).collect();
    let edges = if scene.is_fitted { "fitted edges" } else { "edges along whole cells" };
    Some(format!("{} of the area of other materials, with {edges}", shares.join(", ")))
}

/// In which parts the load comes.
fn load_steps(steps: &LoadSteps) -> String {
    match steps {
        LoadSteps::Solved(parts) => {
            format!("{} increments of load and motion, each solved to equilibrium", parts.len())
        }
        LoadSteps::Stepped { ramp: Some(ramp), every } => {
            format!("loads that grow until step {ramp}, a row of load.csv every {every} steps")
        }
        LoadSteps::Stepped { ramp: None, every } => format!("a row of load.csv every {every} steps"),
    }
}

fn facts(
    scene: &Scene,
    plan: &Plan,
    deviation: Option<&Deviation>,
) -> Result<Vec<(String, String)>, SceneError> {
    let of = |role: Role| plan.setup.roles.iter().filter(|&&r| r == role).count();
    let roles: Vec<String> = Role::ALL
        .iter()
        .filter(|&&role| of(role) > 0)
        .map(|&role| format!("{} {}", of(role), role.name()))
        .collect();
    let sweep = Sweep::compile(plan.setup.update, &plan.setup.flock, &plan.setup.roles);
    let order = match plan.setup.update.order {
        Order::Synchronous => "synchronous",
        Order::Sequential => "sequential",
    };
    let stop = match (&scene.equilibrium, plan.stop.tolerance) {
        (Some(asked), _) => {
            let (solver, why) = select_solver(scene, &asked.request, plan)?;
            let how = match asked.accuracy {
                Some(part) => format!(
                    "for an accuracy of {} the run chooses spacing, solver, tolerance and precision, for which it solves for \
                     the truth as well",
                    percent(part)
                ),
                None => format!("found by {solver}: {why}"),
            };
            format!("in the equilibrium of step {}, {how}", plan.stop.steps)
        }
        (None, Some(tolerance)) => {
            format!("at residual {tolerance:e}, at the latest after {} steps", plan.stop.steps)
        }
        (None, None) => format!("after {}", counted(plan.stop.steps, "step")),
    };
    let bonds = neighbour_entries(plan);
    let about = if plan.setup.present_radius.is_some() { "about " } else { "" };
    let unit = scene.unit();
    let apart = plan.setup.body.lattice.spacing();
    let lattice = if scene.is_of_points() {
        format!("none: points, the nearest {apart:.6} {unit} apart in the median")
    } else {
        format!("{}, nearest sites {apart:.6} {unit} apart", plan.setup.body.lattice.name())
    };
    let swept = match scene.equilibrium {
        Some(_) => None,
        None => Some([
            ("update", format!("{order}, damping {:.4}", plan.setup.update.damping)),
            ("swept without lists", format!("{:.0} % of the followers", 100.0 * sweep.share_in_runs())),
        ]),
    };
    let first = [
        ("particles", format!("{} ({})", plan.count(), roles.join(", "))),
        ("lattice", lattice),
        (
            "neighbour entries",
            format!("{about}{bonds} ({:.2} a particle)", bonds as f64 / plan.count() as f64),
        ),
    ];
    let moving = active_share(plan, &sweep).filter(|_| scene.equilibrium.is_none()).map(|share| {
        (
            "computed",
            format!("about {:.0} % of the updates: motion spreads by one neighbour a step", 100.0 * share),
        )
    });
    let outline = outline_facts(scene, plan, deviation);
    let last = [("stops", stop)];
    let facts = first.into_iter().chain(swept.into_iter().flatten()).chain(moving).chain(last);
    let facts = facts.map(|(name, value)| (name.to_owned(), value));
    Ok(facts.chain(actions(scene)).chain(outline).collect())
}

/// Parts of the shape's area, and of its size, beyond which a body that differs from it is worth a caution.
pub(crate) const DEVIATES: f64 = 0.01;

/// Pieces of an outline that are listed.
const MOST_PIECES: usize = 16;

/// How near the body is to its shape, the outline's pieces, and what each load adds up to.
fn outline_facts(scene: &Scene, plan: &Plan, deviation: Option<&Deviation>) -> Vec<(String, String)> {
    let mut facts = Vec::new();
    if let Some(deviation) = deviation {
        let kind = if scene.is_fitted { "fitted" } else { "lattice" };
        let value = format!(
            "{kind}: area off by {:.1e} %, boundary at most {:.2e} {} from the shape's",
            100.0 * deviation.area,
            deviation.distance,
            scene.unit()
        );
        facts.push(("outline".to_owned(), value));
    }
    if let (Some(outline), true) = (&plan.outline, scene.is_fitted) {
        facts.extend(pieces(outline, MOST_PIECES).into_iter().map(|line| ("  piece".to_owned(), line)));
    }
    for (k, Resultant { force, moment }) in plan.resultants.iter().enumerate() {
        let value =
            format!("force ({:.6e}, {:.6e}), moment {moment:.6e} about the origin", force[0], force[1]);
        facts.push((format!("loads[{k}]"), value));
    }
    facts
}

fn cautions(scene: &Scene, plan: &Plan, deviation: Option<&Deviation>) -> Vec<String> {
    let mut cautions = Vec::new();
    if let Some(deviation) = deviation
        && (deviation.area.abs() > DEVIATES || deviation.distance_rel > DEVIATES)
    {
        cautions.push(format!(
            "the body is not the shape: its area is {:+.2} % off and its boundary lies up to {:.3} {} from the outline; \
             use {}",
            100.0 * deviation.area,
            deviation.distance,
            scene.unit(),
            if scene.is_fitted { "a smaller spacing" } else { "body.outline = \"fitted\" or a smaller spacing" }
        ));
    }
    let is_synchronous = plan.setup.update.order == Order::Synchronous;
    let of_waves = bulk_response::cautions(scene);
    let over = scene.over_relaxation();
    if of_waves.is_empty() && is_synchronous && over > 1.0 && plan.setup.update.damping * over > 1.0 {
        cautions.push("over-relaxation in a synchronous update makes the fastest mode grow".into());
    }
    cautions.extend(of_waves);
    cautions.extend(dead_pressure(scene));
    cautions.extend(whole_cells(scene));
    cautions.extend(uneven_sides(scene));
    cautions.extend(late::cautions(scene));
    cautions.extend(doubts::planned(scene, &plan.setup));
    cautions.extend(cuts::planned(scene, &plan.setup.body, &plan.setup.flock.neighbours));
    if let Setup { free_edge: Some(edge), cells: Some(cells), elastic: Some(elastic), body, .. } = &plan.setup
    {
        cautions.extend(edge_stress::cautions(edge.of(body, cells), (body, cells, elastic), |own| own));
    }
    let is_moved = scene.roles.iter().any(|entry| entry.motion.is_some());
    if !is_moved && plan.setup.flock.forces.is_none() && set_later(scene, "loads").is_none() {
        cautions.push(
            "no particle is moved and nothing pushes: the body relaxes by itself, or stays as it is".into(),
        );
    }
    if plan.setup.body.body_particles().nth(1).is_none() {
        cautions.push("the body is a single particle: the lattice is as coarse as the shape is wide".into());
    }
    cautions
}

/// The warning about a pressure on a body that turns, if there is one.
pub(crate) fn dead_pressure(scene: &Scene) -> Option<String> {
    let presses = scene.raw.loads.iter().any(|load| matches!(load, RawLoad::Pressure { .. }));
    (presses && scene.rotation() == Rotation::Corotated).then(|| {
        "pressure acts along the normals of the undeformed outline, on its undeformed length: it does not follow a body \
         that turns"
            .to_owned()
    })
}

/// Cells across a body up to which bending does not show, and a bit \[1\].
pub(super) const THIN: f64 = 2.6;

/// The warnings about stress in a body of whole cells, whose edges could follow an outline and do not.
pub(crate) fn whole_cells(scene: &Scene) -> Vec<String> {
    if !matches!(scene.mean, Mean::Material { .. }) || scene.is_fitted {
        return Vec::new();
    }
    let (remedy, across) = match scene.raw.body.shape {
        RawShape::Grid { columns, rows } => {
            ("give the shape as a rectangle, without body.outline", Some(f64::from(columns.min(rows)) - 1.0))
        }
        RawShape::Rectangle { min: [left, bottom], max: [right, top] } => {
            ("leave body.outline out", Some((right - left).min(top - bottom) / scene.lattice.spacing()))
        }
        _ => ("leave body.outline out", None),
    };
    let of_edges = format!(
        "stress is not recovered along the edges of a body of whole cells: there it is the mean of a particle's cells, half a \
         cell within the body; {remedy}"
    );
    let of_bending = across.filter(|&across| across <= THIN).map(|_| {
        "the body is one or two cells thick: a cell has one stress, so that of bending across the thickness does not show; use a \
         smaller spacing (four cells and more)"
            .to_owned()
    });
    [Some(of_edges), of_bending].into_iter().flatten().collect()
}

impl fmt::Display for PlanReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        let width = self.facts.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, value) in &self.facts {
            writeln!(f, "  {name:width$}  {value}")?;
        }
        let section = |f: &mut fmt::Formatter<'_>, head: &str, rows: &[(String, String)], link: &str| {
            writeln!(f, "{head}")?;
            let width = rows.iter().map(|(left, _)| left.chars().count()).max().unwrap_or(0);
            rows.iter().try_for_each(|(left, right)| writeln!(f, "  {left:width$}  {link}{right}"))
        };
        section(f, "models", &self.modelled, "because of ")?;
        section(f, "leaves out", &self.left_out, "")?;
        for caution in &self.cautions {
            writeln!(f, "caution: {caution}")?;
        }
        Ok(())
    }
}
