//! From a scene to the arrays that an engine steps, with the checks that need the body.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use super::among::{Among, followed, require_loaded};
use super::damping::along_edges;
use super::extrapolation;
use super::layout::Layout;
use super::layout::refusals::refuse_pieces;
use super::layout::regions::no_particle;
use super::layout::roles::{ReferenceMotion, held_components, require_free_components};
use super::parts::{Parting, agreed, averages_dilatations};
use super::pieces::require_connected;
use super::{places, weights};
use crate::engine::probes::ProbeSeries;
use crate::engine::setup::{Conduct, RoleChange, Setup, of_first_roles};
use crate::engine::shared::of_all_parts;
use crate::flock::action::{Action, ActionKind};
use crate::flock::body::Body;
use crate::flock::fracture::{Bonds, Break, Ghosts};
use crate::flock::law::{Flock, MatrixWeights, Weights};
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::outlay::MOST_ENTRIES;
use crate::flock::role::Role;
use crate::flock::rules::{Axis, Mean, Poisson, Rule};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::outline::Outline;
use crate::material::free_edge::FreeEdge;
use crate::material::mechanism::{self, Mechanism};
use crate::material::outline_loads::{Load, Resultant, sum};
use crate::material::weights::WeightsError;
use crate::ranks::Team;
use crate::scene::{LoadSteps, Scene, SceneError, Stop, Weights as FixedWeights};
use crate::solve::linear::HeldComponent;
use crate::sweep::{Order, Update};

/// A scene laid out; nothing of it refers to the scene file.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The start of the engine.
    pub setup: Setup,
    /// When a run ends.
    pub stop: Stop,
    /// Diagonal of the body's bounds \[length\].
    pub diagonal: f64,
    /// Indices, in the whole body, of the particles whose history is kept.
    pub probes: Vec<usize>,
    /// The outline of the body's shape, where it has one.
    pub outline: Option<Outline>,
    /// Of each load of the scene, in its order; of a part nothing.
    pub resultants: Vec<Resultant>,
}

impl Plan {
    /// # Errors
    /// Names the key of the scene that cannot be laid out: an empty or disconnected body, a region
    /// without particles, a neighbourhood that does not fit the lattice, an id that does not exist, a
    /// material that the cells cannot carry, leaders led by a reference solution, which [`Plan::of_layout`] takes.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        if let Some(k) = scene.led_by_reference() {
            let help = "build with the feature `fem`, or give the leaders a motion of their own";
            let message = "the truth is not known: it takes finite elements to compute";
            return Err(scene.refuse(&format!("roles[{k}].motion"), message, help));
        }
        Self::of_layout(scene, Layout::new(scene)?, None)
    }

    /// The plan of a body laid out; leaders that the scene leads by a reference solution are led by this one.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn of_layout(
        scene: &Scene,
        layout: Layout,
        reference: Option<ReferenceMotion<'_>>,
    ) -> Result<Self, SceneError> {
        Self::laid_out(scene, layout, reference, &Layout::new)
    }

    /// The plan of a body laid out by `lay_out`.
    fn laid_out(
        scene: &Scene,
        layout: Layout,
        reference: Option<ReferenceMotion<'_>>,
        lay_out: LayOut<'_>,
    ) -> Result<Self, SceneError> {
        if layout.body.part.is_none() {
            layout.require_inclusions(scene, |own| own)?;
        }
        let changes = layout.role_changes(scene, reference)?;
        let mut plan = Self::of_roles(scene, layout, changes, lay_out)?;
        make_cuts(&mut plan.setup, scene, |_, _, found| found);
        Ok(plan)
    }

    /// The part of this rank, planned by all ranks together; for scenes that [`laid_out_whole_for`](super::parts::laid_out_whole_for) has nothing against.
    ///
    /// # Errors
    /// As [`Plan::new`], on all ranks alike.
    pub fn of_part(scene: &Scene, team: &Team) -> Result<Self, SceneError> {
        Self::of_counted_part(scene, &Parting::among(scene, team)?, team)
    }

    /// The same where the ranks have counted the body already.
    ///
    /// # Errors
    /// As [`Plan::of_part`].
    pub fn of_counted_part(scene: &Scene, parting: &Parting, team: &Team) -> Result<Self, SceneError> {
        let layout = agreed(scene, team, parting.lay_out(scene, team.rank()))?;
        let connected = require_connected(&layout.body, &layout.neighbours, team);
        connected.map_err(|error| refuse_pieces(scene, &error))?;
        layout.require_inclusions(scene, |own| team.any(own))?;
        let changes = agreed(scene, team, layout.role_changes(scene, None))?;
        let owned = layout.body.owned();
        let is_anywhere = |own: bool, key: String| {
            if team.any(own) { Ok(()) } else { Err(layout.holds_none(scene, &format!("{key}.region"))) }
        };
        for (k, change) in changes.iter().enumerate() {
            is_anywhere(change.particles.iter().any(|i| owned.contains(i)), format!("roles[{k}]"))?;
        }
        require_free_components(scene, &changes, &layout.body, Some(team))?;
        require_loaded(scene, &layout, team)?;
        for (k, changed) in followed(scene) {
            require_loaded(changed, &layout, team).map_err(|error| refuse_keys(scene, k, &error))?;
        }
        let lay_out = |changed: &Scene| parting.lay_out(changed, team.rank());
        let mut plan = agreed(scene, team, Self::of_roles(scene, layout, changes, &lay_out))?;
        let setup = &mut plan.setup;
        let Setup { body, flock: Flock { neighbours, weights, rest, .. }, update, cells, .. } = setup;
        let among = Among { body, neighbours, changes: &setup.changes, team };
        let has_loads = setup.flock.forces.is_some();
        among.agree(scene, (weights, has_loads, cells.as_ref()), (update, rest))?;
        let conducts = setup.actions.iter_mut().filter_map(|action| match &mut action.what {
            ActionKind::Follow(conduct) => Some(Arc::make_mut(conduct)),
            ActionKind::Cut(_) => None,
        });
        let mut has_bonds = setup.flock.bonds.is_some();
        for ((k, changed), conduct) in followed(scene).zip(conducts) {
            let Conduct { weights, forces, rest, update, cells, fracture, .. } = conduct;
            has_bonds |= fracture.is_some();
            among
                .agree(changed, (weights, forces.is_some(), cells.as_ref()), (update, rest))
                .map_err(|error| refuse_keys(scene, k, &error))?;
        }
        places::around(scene, (body, cells.as_ref()), Some(team))?;
        if has_bonds && u32::try_from(body.total()).is_err() {
            let message = "broken bonds are known by particles up to number 4,294,967,295";
            return Err(scene.refuse("body.shape", message, "use a wider spacing or a smaller shape"));
        }
        make_cuts(setup, scene, |body, neighbours, found| of_all_parts(team, body, neighbours, found));
        Ok(plan)
    }

    /// The part of a rank, planned without the others: what needs them is not checked.
    ///
    /// # Errors
    /// As [`Plan::new`], but for that.
    pub(crate) fn of_part_alone(scene: &Scene, parting: &Parting, rank: usize) -> Result<Self, SceneError> {
        let lay_out = |scene: &Scene| parting.lay_out(scene, rank);
        Self::laid_out(scene, lay_out(scene)?, None, &lay_out)
    }

    fn of_roles(
        scene: &Scene,
        layout: Layout,
        changes: Vec<RoleChange>,
        lay_out: LayOut<'_>,
    ) -> Result<Self, SceneError> {
        let following = Following::new(scene, &layout, &changes)?;
        let probes = probes(scene, &layout.body)?;
        // For all parts to find out.
        if layout.body.part.is_none() {
            places::around(scene, (&layout.body, layout.cells.as_ref()), None)?;
        }
        require_listable(scene, &layout.body)?;
        let actions = actions(scene, (&layout, &changes), lay_out)?;
        let Layout { body, neighbours, cells, outline, .. } = layout;
        let Following { weights, forces, update, loads, free_edge } = following;
        let resultant = |load: &Vectors| Resultant::of(body.reference.iter().zip(load.iter()));
        let resultants = loads.iter().filter(|_| body.part.is_none()).map(resultant).collect();
        let flock = flock(scene, &body, neighbours, weights, forces);
        let roles = body.is_frame.iter().map(|&f| if f { Role::Frame } else { Role::Follower }).collect();
        let (low, high) = body.bounds();
        // A body of one particle has no extent; its spacing stands in.
        let diagonal = distance(low, high).max(body.lattice.spacing());
        let mut setup = Setup {
            changes,
            actions,
            cells,
            elastic: scene.material,
            loads,
            free_edge,
            present_radius: match scene.neighbourhood {
                Neighbourhood::Dynamic { radius } => Some(radius),
                _ => None,
            },
            // Matched to the end: of `ramp` alone rustc 1.95 makes a ramp of whatever lies where there is none.
            ramp: match scene.load_steps {
                Some(LoadSteps::Stepped { ramp: Some(ramp), .. }) => Some(ramp),
                _ => None,
            },
            ..Setup::new(body, flock, roles, update)
        };
        // One that is put to rest at once has no history.
        let is_parted = setup.body.part.is_some();
        if is_parted && !scene.is_solved_at_once() && !probes.is_empty() {
            setup.probes = Some(probes.iter().map(|&index| ProbeSeries::new(index)).collect());
        }
        take_first_roles(&mut setup);
        Ok(Self { setup, stop: scene.stop, diagonal, probes, outline, resultants })
    }

    /// How the particles follow by this plan, if they are those of `setup` and see the same neighbours.
    ///
    /// # Errors
    /// A sentence that says why not.
    pub fn conduct_of(self, setup: &Setup) -> Result<Conduct, &'static str> {
        let (Flock { neighbours, reference, .. }, then) = (&self.setup.flock, &setup.flock);
        let is_same = *reference == then.reference && *neighbours == then.neighbours;
        if is_same { Ok(Conduct::of(self.setup)) } else { Err(OTHER_BODY) }
    }

    /// Number of particles, those of the frame included.
    pub fn count(&self) -> usize {
        self.setup.body.count()
    }
}

/// How the particles of a body laid out follow.
struct Following {
    weights: Weights,
    /// Sum of the loads \[force\], shape \[count\].
    forces: Option<Vectors>,
    update: Update,
    loads: Vec<Vectors>,
    free_edge: Option<Arc<FreeEdge>>,
}

impl Following {
    fn new(scene: &Scene, layout: &Layout, changes: &[RoleChange]) -> Result<Self, SceneError> {
        let Layout { body, neighbours, cells, .. } = layout;
        let acting = if cells.is_some() { layout.loads(scene)? } else { Vec::new() };
        let loads = layout.forces_by_load(scene, &acting)?;
        let forces = sum(&loads);
        let leads = held_axes(body, changes);
        require_carried(scene, layout, &leads, forces.as_ref())?;
        let free_edge = free_edge(scene, layout, &acting, &leads).map(Arc::new);
        let follows = ever_follow(body, changes);
        let mut weights = weights::of_body(scene, body, neighbours, cells.as_ref(), &follows)?;
        if let Weights::Matrix(weights) = &mut weights {
            hold_components(weights, &held_components(changes, body, 0.0));
        }
        let update = update(scene, (body, changes), neighbours, &weights, None);
        Ok(Self { weights, forces, update, loads, free_edge })
    }

    /// The same as something that a body under way changes to.
    fn conduct(self, scene: &Scene, layout: &Layout) -> Conduct {
        let Self { weights, forces, update, loads, free_edge } = self;
        let flock = flock(scene, &layout.body, layout.neighbours.clone(), weights, forces);
        Conduct::new(flock, update, (layout.cells.clone(), scene.material), loads, free_edge)
    }
}

/// Lays the body, or the part of it, of a scene with other keys out.
type LayOut<'a> = &'a dyn Fn(&Scene) -> Result<Layout, SceneError>;

type Actions = Vec<Action<Arc<Conduct>>>;

fn actions(
    scene: &Scene,
    (layout, changes): (&Layout, &[RoleChange]),
    lay_out: LayOut<'_>,
) -> Result<Actions, SceneError> {
    let action = |(k, action): (usize, &Action<Box<Scene>>)| {
        let what = match &action.what {
            ActionKind::Cut(cut) => ActionKind::Cut(*cut),
            ActionKind::Follow(changed) => {
                let other = other_layout(scene, changed, layout, lay_out);
                let other = other.map_err(|message| refuse_keys(scene, k, &message))?;
                let layout = other.as_ref().unwrap_or(layout);
                let following = Following::new(changed, layout, changes);
                let following = following.map_err(|error| refuse_keys(scene, k, &error))?;
                ActionKind::Follow(Arc::new(following.conduct(changed, layout)))
            }
        };
        Ok(Action { at: action.at, what })
    };
    scene.actions.iter().enumerate().map(action).collect()
}

fn refuse_keys(scene: &Scene, action: usize, why: &impl ToString) -> SceneError {
    let key = format!("actions[{action}].what.keys");
    scene.refuse(&key, why.to_string(), "give these keys from the start instead")
}

/// The layout of a scene with other keys, where these concern cells and neighbours: the same particles and neighbours.
///
/// # Errors
/// A sentence that says why it cannot be.
fn other_layout(
    scene: &Scene,
    changed: &Scene,
    layout: &Layout,
    lay_out: LayOut<'_>,
) -> Result<Option<Layout>, String> {
    let is_material = |scene: &Scene| matches!(scene.mean, Mean::Material { .. });
    let is_alike = scene.material == changed.material
        && scene.inclusions == changed.inclusions
        && scene.neighbourhood == changed.neighbourhood
        && is_material(scene) == is_material(changed)
        && scene.is_fitted == changed.is_fitted;
    if is_alike {
        return Ok(None);
    }
    let other = lay_out(changed).map_err(|error| error.to_string())?;
    let is_same = other.body.reference == layout.body.reference && other.neighbours == layout.neighbours;
    if is_same {
        return Ok(Some(other));
    }
    let why = if averages_dilatations(scene) == averages_dilatations(changed) {
        ""
    } else {
        ": above a Poisson's ratio of 0.4 (2/3 in plane stress) dilatations are averaged over more of them, as is what an orthotropic \
         material resists far more than all else"
    };
    Err(format!("{OTHER_BODY}{why}"))
}

/// Why keys do not change on the way.
const OTHER_BODY: &str = "the body would have other particles or neighbours";

/// Makes the scene's cuts one after the other; `all` makes of the bonds that one breaks here those of the whole body.
fn make_cuts(setup: &mut Setup, scene: &Scene, all: impl Fn(&Body, &Neighbours, Vec<Break>) -> Vec<Break>) {
    let Setup { body, flock: Flock { bonds: Some(bonds), neighbours, .. }, cuts, .. } = setup else { return };
    for &ends in &scene.cuts {
        let mut found = Vec::new();
        bonds.cut(ends, neighbours, &body.reference, &mut found);
        cuts.extend(all(body, neighbours, found));
    }
}

/// Roles without a condition that hold from the first step are those the body starts with.
fn take_first_roles(setup: &mut Setup) {
    let at_once = |change: &&RoleChange| change.is_at_once() && change.axis.is_none();
    for change in setup.changes.iter().filter(at_once) {
        for &i in &change.particles {
            setup.roles[i] = change.role;
        }
    }
}

/// Neighbours that are found anew at every step take memory as others do.
fn require_listable(scene: &Scene, body: &Body) -> Result<(), SceneError> {
    let Neighbourhood::Dynamic { radius } = scene.neighbourhood else { return Ok(()) };
    let count = body.count() as f64;
    let within = std::f64::consts::PI * radius * radius / body.lattice.cell_area();
    let about = count * within.min(count);
    if about <= MOST_ENTRIES as f64 {
        return Ok(());
    }
    let message =
        format!("the particles have about {about:.1e} neighbours in all, at most {MOST_ENTRIES} are kept");
    Err(scene.refuse("neighbours.radius", message, "use a smaller radius"))
}

/// Which particles follow at any time: all but those led or clamped from the start and for good, shape \[count\].
fn ever_follow(body: &Body, changes: &[RoleChange]) -> Vec<bool> {
    let mut follows: Vec<bool> = body.is_frame.iter().map(|frame| !frame).collect();
    for change in changes.iter().filter(|change| change.axis.is_none()) {
        for &i in &change.particles {
            follows[i] = change.role == Role::Follower || (follows[i] && !change.is_at_once());
        }
    }
    follows
}

/// The tractions along the outline, where stress can be recovered from them.
fn free_edge(scene: &Scene, layout: &Layout, loads: &[Load], held: &[[bool; 2]]) -> Option<FreeEdge> {
    let (elastic, outline) = (scene.material.as_ref()?, layout.outline.as_ref()?);
    let is_ruled = matches!(scene.mean, Mean::Material { .. }) && layout.body.outline.is_some();
    let sides = layout.boundary.as_ref().map(|boundary| boundary.ends.len());
    is_ruled.then(|| {
        FreeEdge::new((outline.clone(), sides), (loads.to_vec(), elastic.thickness()), held.to_vec())
    })
}

/// Components that are led or clamped from the start, shape \[count\]\[x, y\].
pub(super) fn held_axes(body: &Body, changes: &[RoleChange]) -> Vec<[bool; 2]> {
    of_first_roles(changes, body.count(), |_, change| change.role.is_led())
}

/// Whether leaders move a body to an equilibrium: where it may slide or turn, solvers find it anywhere on that way.
pub(super) fn is_led_to_rest(scene: &Scene) -> bool {
    scene.equilibrium.is_some() && scene.roles.iter().any(|entry| entry.motion.is_some())
}

/// A load on a follower needs a rule with a stiffness, and a body that cannot get away; so does an equilibrium by leaders.
fn require_carried(
    scene: &Scene,
    layout: &Layout,
    leads: &[[bool; 2]],
    forces: Option<&Vectors>,
) -> Result<(), SceneError> {
    let Some(cells) = layout.cells.as_ref().filter(|_| forces.is_some() || is_led_to_rest(scene)) else {
        return Ok(());
    };
    if !matches!(scene.mean, Mean::Material { .. }) {
        let Some(forces) = forces else { return Ok(()) };
        let Some(i) = layout.body.owned().find(|&i| leads[i] != [true; 2] && forces.get(i) != [0.0; 2])
        else {
            return Ok(());
        };
        let message =
            format!("particle {} follows by a rule without a stiffness: no load moves it", layout.body.id(i));
        let help =
            "use rule.mean.kind = \"material\", or load leaders alone (which steers the truth they follow)";
        return Err(scene.refuse("loads", message, help));
    }
    // For all parts to find out.
    if layout.body.part.is_some() {
        return Ok(());
    }
    let incidence = cells.incidence(layout.body.count());
    let held = mechanism::require_held(cells, &incidence, &layout.body.reference, leads);
    held.map_err(|mechanism| refuse_loose(scene, mechanism))
}

pub(super) fn refuse_loose(scene: &Scene, mechanism: Mechanism) -> SceneError {
    // A body with a hinge is refused however it is held.
    if let Mechanism::Hinge { .. } = mechanism {
        return weights::refuse(scene, &WeightsError::Mechanism(mechanism));
    }
    let help = "clamp or lead at least two particles of every part, or components that keep it from moving";
    scene.refuse("roles", mechanism.to_string(), help)
}

/// Takes held components out of the rule: the particles keep them, and what is left of their weights moves the other
/// component alone. Solvers take them separately ([`crate::solve::linear::system`]).
fn hold_components(weights: &mut MatrixWeights, held: &[HeldComponent]) {
    let mut axes: BTreeMap<usize, [bool; 2]> = BTreeMap::new();
    for component in held {
        axes.entry(component.particle).or_default()[component.axis as usize] = true;
    }
    axes.into_iter().for_each(|(particle, held)| weights.hold(particle, held));
}

/// Part of the damping for small strains that suits cells which turn: those that are strained by some ten percent resist
/// more than they do at rest. Measured on lattices bent by 50 degrees while loads push them, the worst an oblique one:
/// undiminished it does not settle, 0.95 settles after growing tenfold, 0.75 at once.
const OF_TURNED_CELLS: f64 = 0.75;

/// The update as written; unless its damping is, a material's is what the edges of the body allow, and less where cells turn, and that of
/// weights that are solved for what those with negative ones allow. Of a part all ranks find it together.
pub(super) fn update(
    scene: &Scene,
    (body, changes): (&Body, &[RoleChange]),
    neighbours: &Neighbours,
    weights: &Weights,
    team: Option<&Team>,
) -> Update {
    let Update { order, damping } = scene.update;
    let is_open = scene.raw.update.damping.is_none() && order == Order::Synchronous;
    if !is_open {
        return scene.update;
    }
    if let (Weights::Scalar(weights), Some(FixedWeights::Solved)) = (weights, &scene.weights) {
        let follows = ever_follow(body, changes);
        let limit = extrapolation::damping(body, (neighbours, weights), &follows, team);
        let limit = limit.map_or(damping, |limit| limit / scene.over_relaxation().max(1.0));
        return Update { order, damping: damping.min(limit) };
    }
    let Weights::Matrix(weights) = weights else { return scene.update };
    // A neighbourhood that cannot be listed has been refused.
    let offsets = scene.neighbourhood.offsets(&body.lattice).unwrap_or_default();
    let all = offsets.iter().map(Vec::len).max().unwrap_or(0);
    let turned = if weights.cells.is_some() { OF_TURNED_CELLS } else { 1.0 };
    let over = scene.over_relaxation().max(1.0);
    let along = along_edges(body, neighbours, weights, (damping * over, all), team) / over;
    Update { order, damping: turned * along }
}

fn flock(
    scene: &Scene,
    body: &Body,
    neighbours: Neighbours,
    weights: Weights,
    forces: Option<Vectors>,
) -> Flock {
    let (low, high) = body.bounds();
    let poisson = scene.poisson.map(|term| {
        let across = match term.axis {
            Axis::X => 1,
            Axis::Y => 0,
        };
        let half_width = (high[across] - low[across]) / 2.0;
        Poisson {
            k: term.k,
            axis: term.axis,
            centre: term.centre.unwrap_or((low[across] + high[across]) / 2.0),
            half_width: if half_width > 0.0 { half_width } else { body.lattice.spacing() },
            exponent: term.exponent,
        }
    });
    let needs_bonds = scene.fracture.is_some()
        || !scene.cuts.is_empty()
        || scene.actions.iter().any(Action::is_cut)
        // Neighbours that are found anew leave ghosts out by themselves.
        || !matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. })
            && scene.roles.iter().any(|entry| entry.role == Role::Ghost);
    let bonds = needs_bonds.then(|| {
        let (threshold, ghosts) =
            scene.fracture.map_or((None, Ghosts::Lattice), |fracture| (fracture.threshold, fracture.ghosts));
        let mut bonds = Bonds::new(threshold, ghosts, &neighbours);
        bonds.owned = body.owned();
        bonds
    });
    let mut flock = Flock {
        rule: Rule { mean: scene.mean, poisson, feedback: scene.feedback },
        reference: body.reference.clone(),
        neighbours,
        weights,
        forces,
        rest: None,
        keeps_rest: false,
        bonds,
    };
    if scene.keeps_rest {
        flock.keep_rest();
    }
    flock
}

fn probes(scene: &Scene, body: &Body) -> Result<Vec<usize>, SceneError> {
    let probe = |(n, &id): (usize, &usize)| {
        body.index_of(id).ok_or_else(|| {
            let message = no_particle(id, body);
            scene.refuse(&format!("record.probes[{n}]"), message, "name a particle of the body")
        })
    };
    let all: Vec<usize> = scene.record.probes.iter().enumerate().map(probe).collect::<Result<_, _>>()?;
    let mut known = HashSet::new();
    Ok(all.into_iter().filter(|&index| known.insert(index)).collect())
}
