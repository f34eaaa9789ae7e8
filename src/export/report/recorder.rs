//! The frames of a run, kept while it goes on, and the view of the body that they make.

use std::borrow::Cow;
use std::cell::OnceCell;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::super::bonds::pairs;
use super::MOST_TEXT;
use super::encode::GROUP;
use super::frames::{Channel, Frame, Frames};
use super::sample::{self, Sample};
use super::view::{Animation, Clock, Quantity, Stress, View};
use crate::continuum::mechanics::Stresses;
use crate::continuum::memory::{measured, neighbour_entries};
use crate::continuum::plan::Plan;
use crate::continuum::run::Outcome;
use crate::engine::Engine;
use crate::engine::serde_impls;
use crate::export::figures::displaced;
use crate::flock::action::ActionKind;
use crate::flock::pseudo_energy::pe1;
use crate::flock::role::Role;
use crate::flock::rules::Rotation;
use crate::flock::strain::{Strain, strain};
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::elastic::{Constants, Plane};
use crate::material::stress::StressState;
use crate::scene::units::Units;
use crate::scene::{LoadSteps, Scene};

/// Strains are computed from displacements, which have as many bits as there are; the page says what that leaves of them.
const FINE_BITS: u32 = 24;
/// Of other quantities of more than so many particles, which are shown as a colour only.
const COLOUR_BITS: u32 = 12;
const MOST_FINE: usize = 100_000;
/// Most particles whose final values are written exactly: those of more would fill the page.
const MOST_EXACT: usize = 250_000;
/// Frames of a body whose equilibrium was solved for, on its way from no load to all of it.
pub(super) const LOAD_FRAMES: usize = 20;

pub(in crate::export) const PE1: &str = "pe1";
pub(in crate::export) const PE2: &str = "pe2";
pub(in crate::export) const STRAIN: &str = "strain";
pub(in crate::export) const VON_MISES: &str = "von_mises";

/// The state of a recorder, for a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnimationState<'a> {
    frames: Cow<'a, [Frame]>,
    interval: usize,
    #[serde(with = "serde_impls::roles")]
    first_roles: Vec<Role>,
    #[serde(with = "serde_impls::roles")]
    roles: Vec<Role>,
    changes: Vec<[u32; 3]>,
    /// Of so many particles along either axis of the lattice of a body in parts one was shown.
    stride: Option<usize>,
}

/// Values that frames hold of each particle, of a body of so many.
fn channels(scene: &Scene, total: usize, are_neighbours_known: bool, has_stresses: bool) -> Vec<Channel> {
    let others = if total <= MOST_FINE { FINE_BITS } else { COLOUR_BITS };
    let channel = |name, bits| Channel { name, bits };
    let mut channels = vec![channel("dx", FINE_BITS), channel("dy", FINE_BITS), channel(PE2, others)];
    // Neighbours that are found anew at every step, or are not in a sample, are known to the engine alone.
    if !are_neighbours_known {
        channels.extend([PE1, STRAIN].map(|name| channel(name, others)));
    }
    // An increment costs more than its stress, a step less: of steps the page computes it, where it can.
    let is_kept = !are_neighbours_known || scene.equilibrium.is_some() || stress(scene).is_none();
    channels.extend((has_stresses && is_kept).then(|| channel(VON_MISES, others)));
    channels
}

/// Bytes of the report of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::export) struct Packed {
    /// Of what a frame is taken from, until the last one is.
    pub values: usize,
    /// Of the frames at their most, and at the end.
    pub frames: [usize; 2],
    /// Of what they are packed in, with bonds and cells.
    pub packing: usize,
    /// Of the text, until it is written.
    pub text: usize,
}

/// Memory that the report of a run takes, before it begins; of a body in parts for a film too, if there shall be one.
pub(in crate::export) fn packed(scene: &Scene, plan: &Plan, films: bool) -> Packed {
    /// Bytes of a particle's place and neighbours as text: rows of a lattice are next to nothing.
    const TEXT: usize = 6;
    /// Bytes of its numbers at the end as text; where nothing has come yet, they are next to nothing too.
    const EXACT: usize = 20;
    const EXACT_WITH_STRESS: usize = 80;
    /// Bytes of frames that one of their text stands for: three of a body that moves everywhere, many of one mostly at rest.
    const COMPRESSED: usize = 6;
    let (total, is_sample) = (plan.setup.body.total(), plan.setup.body.part.is_some());
    let count = if is_sample { sample::size_of(total, films) } else { total };
    let are_neighbours_known = !is_sample && plan.setup.present_radius.is_none();
    let frames = Frames::new(count, channels(scene, total, are_neighbours_known, plan.setup.cells.is_some()));
    let steps = match (&scene.load_steps, scene.is_solved_at_once()) {
        (Some(LoadSteps::Solved(parts)), _) => parts.len(),
        (_, true) => LOAD_FRAMES,
        _ => plan.stop.steps,
    };
    let is_exact = !is_sample && count <= MOST_EXACT;
    let exact = if is_exact { (size_of::<Option<Strain>>() + 8) * count + measured(plan) } else { 0 };
    let text = match (is_exact, &plan.setup.cells) {
        (false, _) => TEXT,
        (true, None) => TEXT + EXACT,
        (true, Some(_)) => TEXT + EXACT_WITH_STRESS,
    };
    let bonds = if is_sample { 0 } else { 8 * neighbour_entries(plan) / 2 };
    let kept = frames.of_steps(steps);
    let at_once = rayon::current_num_threads().min(kept[1].div_ceil(GROUP));
    let of_frames = kept.map(|kept| kept * frames.bytes_of_one());
    let moving = (of_frames[1] / COMPRESSED).min(MOST_TEXT);
    let packing = exact.max(bonds).max((text + at_once * 4 * (2 * frames.channels.len() + 1)) * count);
    Packed { values: 8 * count, frames: of_frames, packing: packing + moving, text: text * count + moving }
}

/// Keeps the frames of a run while it goes on.
#[derive(Debug)]
pub struct RunRecorder {
    pub(in crate::export) frames: Frames,
    first_roles: Vec<Role>,
    roles: Vec<Role>,
    /// Step, particle and role.
    changes: Vec<[u32; 3]>,
    /// Whether the frames are parts of the way to a rest that was solved for.
    pub(in crate::export) is_solved: bool,
    /// Whether stress on the way is recovered along the outline, which takes longer than a step.
    is_recovered: bool,
    /// The particles that are shown of a body in parts.
    pub(in crate::export) sample: Option<Sample>,
}

impl RunRecorder {
    /// From the engine before its first step.
    fn new(scene: &Scene, engine: &Engine, films: bool) -> Self {
        let sample = Sample::of(engine, films);
        let count = sample.as_ref().map_or(engine.body().count(), Sample::count);
        let are_neighbours_known = sample.is_none() && engine.lasting_neighbours().is_some();
        let channels = channels(scene, engine.body().total(), are_neighbours_known, engine.cells().is_some());
        let roles = roles(engine, sample.as_ref()).into_owned();
        let frames = Frames::new(count, channels);
        let first_roles = roles.clone();
        // A film shows it as the last frame has it: from frames that keep it, or by itself.
        let is_film_of_kept = films && (sample.is_some() || stress(scene).is_none());
        let is_recovered = scene.equilibrium.is_some() || is_film_of_kept;
        let (changes, is_solved) = (Vec::new(), false);
        Self { frames, first_roles, roles, changes, is_solved, is_recovered, sample }
    }

    /// The recorder, made if there is none yet, for a film too if there shall be one; it goes on from the state of an earlier one
    /// that showed the same particles.
    pub fn open<'a>(
        recorder: &'a mut Option<Self>,
        earlier: &mut Option<AnimationState<'_>>,
        (scene, engine, films): (&Scene, &Engine, bool),
    ) -> &'a mut Self {
        let recorder = recorder.get_or_insert_with(|| Self::new(scene, engine, films));
        let are_of_these = |earlier: &AnimationState<'_>| {
            earlier.stride == recorder.stride() && recorder.frames.are_of_these(&earlier.frames)
        };
        let earlier = earlier.take().filter(are_of_these);
        if let Some(AnimationState { frames, interval, first_roles, roles, changes, .. }) = earlier {
            let mut frames = frames.into_owned();
            if recorder.sample.as_ref().is_some_and(|sample| !sample.is_received()) {
                frames.iter_mut().for_each(Frame::clear);
            } else {
                (recorder.first_roles, recorder.roles, recorder.changes) = (first_roles, roles, changes);
            }
            recorder.frames.resume(frames, interval);
        }
        recorder
    }

    /// Looks at a step.
    pub fn watch(&mut self, engine: &Engine) {
        if self.frames.wants(engine.step()) {
            let is_recovered = self.is_recovered;
            let stress = || match is_recovered {
                true => von_mises(Stresses::at_present(engine)),
                false => Stresses::von_mises_of_cells(engine),
            };
            let seen = Seen::now(engine, self.sample.as_ref(), &stress);
            self.frames.keep(engine.step(), |_, channel| seen.values(channel).into());
            self.take_roles(engine);
        }
    }

    /// The frames and rows so far.
    pub fn animation_state(&self) -> AnimationState<'_> {
        AnimationState {
            frames: Cow::Borrowed(&self.frames.kept),
            interval: self.frames.interval,
            first_roles: self.first_roles.clone(),
            roles: self.roles.clone(),
            changes: self.changes.clone(),
            stride: self.stride(),
        }
    }

    /// Of so many particles along either axis of the lattice of a body in parts one is shown.
    fn stride(&self) -> Option<usize> {
        self.sample.as_ref().map(|sample| sample.stride)
    }

    /// The next step after `step` of which a frame is kept.
    pub fn next(&self, step: usize) -> usize {
        self.frames.next(step)
    }

    /// The frame of the end, which is exact whatever its step; of a body that was solved for at once, the way there.
    fn finish(&mut self, scene: &Scene, engine: &Engine) {
        let at_end = || von_mises(Stresses::at_present(engine));
        if self.is_solved {
            let mut channels = self.frames.channels.clone();
            // Of an even load the page has as many parts of what it knows exactly.
            if is_linear(scene) && self.is_exact() {
                channels.retain(|channel| channel.name != VON_MISES);
            }
            self.frames = Frames::new(self.frames.count, channels);
            let whole = OnceCell::new();
            let displacements = self.sample.as_ref().map(|_| engine.displacements());
            for frame in 0..=LOAD_FRAMES {
                // Of a body of millions not all find room.
                if frame < LOAD_FRAMES && !self.frames.wants(frame) {
                    continue;
                }
                let part = frame as f64 / LOAD_FRAMES as f64;
                let of_sample = self.sample.as_ref();
                let under = displacements.as_ref().map(|u| displaced(&engine.body().reference, u, part));
                let places = under.as_ref().unwrap_or(engine.present());
                let stress = || match is_linear(scene) {
                    false => von_mises(Stresses::under_part(engine, part)),
                    true => whole.get_or_init(at_end).iter().map(|v| part * v).collect(),
                };
                let seen = Seen { engine, sample: of_sample, part, places, stress: &stress };
                let values = |_: usize, channel: &Channel| seen.values(channel).into();
                match frame {
                    LOAD_FRAMES => self.frames.keep_last(frame, values),
                    _ => self.frames.keep(frame, values),
                }
            }
        } else {
            let seen = Seen::now(engine, self.sample.as_ref(), &at_end);
            self.frames.keep_last(engine.step(), |_, channel| seen.values(channel).into());
        }
        self.take_roles(engine);
    }

    fn take_roles(&mut self, engine: &Engine) {
        let now = roles(engine, self.sample.as_ref());
        if self.roles == *now {
            return;
        }
        let both = self.roles.iter().zip(now.iter()).enumerate();
        let step = engine.step() as u32;
        self.changes.extend(
            both.filter(|(_, (was, is))| was != is).map(|(i, (_, &is))| [step, i as u32, is.number().into()]),
        );
        self.roles.copy_from_slice(&now);
    }

    /// Takes the frames of the end, after which there are no others.
    pub fn close(&mut self, scene: &Scene, outcome: &Outcome) {
        self.is_solved = is_solved_at_once(scene, outcome);
        self.finish(scene, &outcome.engine);
    }

    /// The animation of a run that is closed, for the rank that writes; of frames that are too many for a page half are let go.
    pub fn stage(&mut self, scene: &Scene, outcome: &Outcome) -> View {
        self.view(scene, &outcome.engine, self.is_exact())
    }

    /// Whether the page has the final values exactly.
    fn is_exact(&self) -> bool {
        self.sample.is_none() && self.frames.count <= MOST_EXACT
    }

    /// Whether frames hold a quantity of every particle.
    pub(in crate::export) fn keeps(&self, quantity: &str) -> bool {
        self.frames.channels.iter().any(|channel| channel.name == quantity)
    }

    /// The part of the load at a frame, if frames are parts of it.
    pub(in crate::export) fn part_of_load(&self, frame: usize) -> Option<f64> {
        self.is_solved.then_some(frame as f64 / LOAD_FRAMES as f64)
    }

    pub(in crate::export) fn roles_at(&self, step: usize) -> Vec<Role> {
        let mut roles = self.first_roles.clone();
        for &[_, particle, role] in
            self.changes.iter().filter(|[at, ..]| self.is_solved || *at as usize <= step)
        {
            roles[particle as usize] = Role::ALL[role as usize];
        }
        roles
    }

    /// A body as it is, in a single frame.
    #[cfg(feature = "live")]
    pub(crate) fn still(scene: &Scene, engine: &Engine) -> View {
        let mut recorder = Self::new(scene, engine, false);
        recorder.finish(scene, engine);
        recorder.view(scene, engine, false)
    }

    fn view(&mut self, scene: &Scene, engine: &Engine, is_exact: bool) -> View {
        let is_solved = self.is_solved;
        let mut stage = View::new(animation(scene, engine, is_solved));
        // Stress before the last frame is kept, a part of what is exact, or computed by the page.
        let is_even = is_solved && is_exact && is_linear(scene);
        let is_known = self.keeps(VON_MISES) || is_even;
        let Animation { stress, quantities, .. } = &mut stage.animation;
        if is_known {
            *stress = None;
        } else if stress.is_none() {
            quantities.retain(|quantity| quantity.key != VON_MISES);
        }
        let is_mean_of_frames = self.keeps(VON_MISES) && !self.is_recovered && !is_solved;
        stage.has_mean_stress = stage.animation.stress.is_some() || is_mean_of_frames;
        stage.set_roles(&self.first_roles, &self.changes);
        if let Some(sample) = &self.sample {
            stage.set_reference(&sample.reference);
            stage.set_ids(sample.ids.iter().copied());
            // A dot stands for those around it as well.
            stage.animation.spacing *= sample.stride as f64;
        } else {
            stage.set_reference(&engine.body().reference);
            if let Some(numbering) = &engine.body().numbering {
                stage.set_ids((0..engine.body().count()).map(|i| numbering.id(i)));
            }
        }
        // Where neighbours change, bonds and cells would be those of the start.
        if self.sample.is_none() && engine.lasting_neighbours().is_some() {
            set_bonds(&mut stage, engine, is_solved);
            let cells =
                engine.cells().map_or_else(|| Cow::Owned(Cells::of_body(engine.body())), Cow::Borrowed);
            if cells.count() > 0 {
                stage.set_cells(&cells);
            }
        }
        if is_exact {
            add_exact(&mut stage, scene, engine);
        }
        let percent = |step: usize| 100.0 * step as f64 / LOAD_FRAMES as f64;
        let clock = |step: usize| if is_solved { percent(step) } else { step as f64 };
        stage.set_frames(&mut self.frames, clock);
        stage
    }
}

/// What a frame is taken from.
struct Seen<'a> {
    engine: &'a Engine,
    sample: Option<&'a Sample>,
    /// The part of the displacements that is shown, and where particles are then.
    part: f64,
    places: &'a Vectors,
    stress: &'a dyn Fn() -> Vec<f64>,
}

impl<'a> Seen<'a> {
    /// The body as it is.
    fn now(engine: &'a Engine, sample: Option<&'a Sample>, stress: &'a dyn Fn() -> Vec<f64>) -> Self {
        Self { engine, sample, part: 1.0, places: engine.present(), stress }
    }

    /// Values of a channel, shape \[count\].
    fn values(&self, channel: &Channel) -> Vec<f64> {
        let Self { engine, part, places, .. } = *self;
        let (present, reference, flock) = (engine.present(), &engine.body().reference, engine.flock());
        match channel.name {
            "dx" => self.each(|i| part * (present.x[i] - reference.x[i])),
            "dy" => self.each(|i| part * (present.y[i] - reference.y[i])),
            PE1 => self.each(|i| pe1(flock, i, places)),
            PE2 => self.each(|i| engine.pe2(i)),
            STRAIN => self.each(|i| strain(flock, i, places).map_or(f64::NAN, |strain| strain.largest())),
            _ => {
                let stress = (self.stress)();
                self.each(|i| stress.get(i).copied().unwrap_or(f64::NAN))
            }
        }
    }

    fn each(&self, of: impl Fn(usize) -> f64 + Send + Sync) -> Vec<f64> {
        match self.sample {
            None => (0..self.engine.body().count()).into_par_iter().map(of).collect(),
            Some(sample) => sample.numbers(&of),
        }
    }
}

/// The roles of the particles that are shown.
fn roles<'a>(engine: &'a Engine, sample: Option<&Sample>) -> Cow<'a, [Role]> {
    let of_sample = |sample: &Sample| {
        let numbers = sample.words(|i| engine.roles()[i].number().into());
        numbers.into_iter().map(|number| Role::ALL[number as usize]).collect()
    };
    sample.map_or(Cow::Borrowed(engine.roles()), |sample| Cow::Owned(of_sample(sample)))
}

/// The von Mises stress around each particle \[force / length^2\], shape \[count\]; NaN where there is none, empty without a
/// material.
pub(in crate::export) fn von_mises(stresses: Option<Stresses>) -> Vec<f64> {
    let of = |stress: Option<StressState>| stress.map_or(f64::NAN, |stress| stress.von_mises);
    stresses.map_or_else(Vec::new, |stresses| stresses.particles.into_iter().map(of).collect())
}

/// Whether the equilibrium was found without intermediate states.
pub(super) fn is_solved_at_once(scene: &Scene, outcome: &Outcome) -> bool {
    outcome.solved.is_some() && scene.load_steps.is_none()
}

fn animation(scene: &Scene, engine: &Engine, is_solved: bool) -> Animation {
    let unit = scene.unit();
    let mut quantities = vec![Quantity::new(PE1, "PE1", format!("{unit}²")), Quantity::new(PE2, "PE2", unit)];
    // At rest nothing moves.
    quantities.retain(|quantity| quantity.key != PE2 || !is_solved);
    if engine.cells().is_some() {
        quantities.push(Quantity::new(VON_MISES, "von Mises stress", Units::of(scene).stress));
    }
    quantities.push(Quantity::new(STRAIN, "largest strain", ""));
    let clock = match is_solved {
        true => Clock { quantity: if is_linear(scene) { "load" } else { "displacement" }, unit: "%" },
        false => Clock { quantity: scene.counts(), unit: "" },
    };
    Animation {
        noun: "particle",
        unit: unit.into(),
        clock,
        spacing: engine.body().lattice.spacing(),
        quantities,
        linear: is_linear(scene),
        stress: engine.cells().and_then(|_| stress(scene)),
        ..Animation::default()
    }
}

/// Whether displacements and stresses are as many times as large as their cause.
pub(in crate::export) fn is_linear(scene: &Scene) -> bool {
    scene.material.is_some() && scene.mean.is_affine() && scene.fracture.is_none()
}

/// What the page computes stress of steps by; nothing where there are several materials, at a time or one after the other, or cells
/// do not have their stress by themselves.
fn stress(scene: &Scene) -> Option<Stress> {
    let elastic = scene.material?;
    let of = |scene: &Scene| (scene.material, scene.rotation());
    let stays = |then: &Scene| of(then) == of(scene) && then.inclusions == scene.inclusions;
    let mut actions = scene.actions.iter();
    let is_one = actions.all(|action| !matches!(&action.what, ActionKind::Follow(then) if !stays(then)));
    if !is_one || !scene.inclusions.is_empty() || elastic.averaged().is_some() {
        return None;
    }
    let unit = |k: usize| elastic.stress([0, 1, 2].map(|axis| f64::from(u8::from(axis == k))));
    let columns = [unit(0), unit(1), unit(2)];
    let across = match elastic.constants() {
        Constants::Isotropic { poisson, plane: Plane::Strain, .. } => poisson,
        _ => 0.0,
    };
    let stiffness = [0, 1, 2].map(|row| [0, 1, 2].map(|k| columns[k][row]));
    Some(Stress { stiffness, across, turns: scene.rotation() == Rotation::Corotated })
}

/// Every bond with the step at which it broke; a bond without one lives.
fn set_bonds(stage: &mut View, engine: &Engine, is_solved: bool) {
    let neighbours = &engine.flock().neighbours;
    let mut breaks: Vec<([u32; 2], u32)> =
        engine.breaks().iter().map(|one| (one.pair, one.step as u32 + 1)).collect();
    breaks.sort_unstable();
    let all: Vec<[u32; 2]> = pairs(neighbours).collect();
    let sees = all.iter().map(|&[a, b]| u32::from(!neighbours.of(b as usize).contains(&a)));
    let broken = all.iter().map(|&[a, b]| {
        let found = breaks.binary_search_by_key(&[a.min(b), a.max(b)], |one| one.0);
        // Bonds that are broken at rest were broken before the load.
        found.map_or(0, |n| if is_solved { 1 } else { breaks[n].1 })
    });
    stage.set_bonds(&all, sees, broken);
}

/// The columns of `final.csv`.
fn add_exact(stage: &mut View, scene: &Scene, engine: &Engine) {
    let strains: Vec<Option<Strain>> =
        (0..engine.body().count()).into_par_iter().map(|i| engine.strain(i)).collect();
    let unit = scene.unit();
    let mut add = |key: &str, label: &str, unit: &str, values: &mut dyn Iterator<Item = f64>| {
        stage.add_exact(Quantity::new(key, label, unit), values);
    };
    let all = || 0..engine.body().count();
    add("x", "x", unit, &mut engine.present().x.iter().copied());
    add("y", "y", unit, &mut engine.present().y.iter().copied());
    add(PE1, "PE1", &format!("{unit}²"), &mut all().map(|i| engine.pe1(i)));
    add(PE2, "PE2", unit, &mut all().map(|i| engine.pe2(i)));
    for (k, name) in ["xx", "yy", "xy"].into_iter().enumerate() {
        let component = |strain: &Option<Strain>| strain.map_or(f64::NAN, |strain| strain.components[k]);
        add(&format!("strain_{name}"), &format!("strain {name}"), "", &mut strains.iter().map(component));
    }
    let rotation = |strain: &Option<Strain>| strain.map_or(f64::NAN, |strain| strain.rotation);
    add("rotation", "rotation", "rad", &mut strains.iter().map(rotation));
    if let Some(Stresses { particles, .. }) = Stresses::at_present(engine) {
        let unit = Units::of(scene).stress;
        let of = |number: fn(&StressState) -> f64| {
            particles.iter().map(move |stress| stress.as_ref().map_or(f64::NAN, number))
        };
        add("stress_xx", "stress xx", &unit, &mut of(|stress| stress.components[0]));
        add("stress_yy", "stress yy", &unit, &mut of(|stress| stress.components[1]));
        add("stress_xy", "stress xy", &unit, &mut of(|stress| stress.components[2]));
        add(VON_MISES, "von Mises stress", &unit, &mut of(|stress| stress.von_mises));
    }
}
