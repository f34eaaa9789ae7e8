//! A formation: its members, their places, the leaders, and the followers' targets by the rule.
//!
//! Its particles are the members and, around a lattice formation with a frame, the frame's virtual points. They
//! are moved by the engine that moves bodies: a period of a swarm is a step of a continuum whose particles
//! have been put where the robots were seen.

mod checks;
mod inside;
mod kept;
mod layout;
mod leading;
mod links;
mod settling;

use std::sync::Arc;

use crate::engine::Engine;
use crate::flock::law::Weights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::pseudo_energy::pe1;
use crate::flock::role::Role;
use crate::flock::rules::Mean;
use crate::flock::strain::{Strain, strain};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::{minus, plus};
use crate::scene::swarm::NamedManoeuvre;
use crate::solve::affine_weights;
use crate::swarm::resilience::{Trim, supported, trim};
use crate::sweep::Order;
pub(in crate::swarm) use checks::first_few;
pub use kept::LeadSnapshot;
pub use leading::Lead;
pub(in crate::swarm) use settling::NoRest;
use settling::Settling;

/// Members are named by their number, from 0; positions in \[m\], world frame.
#[derive(Clone, Debug)]
pub struct Formation {
    /// Names of the members, shape \[members\].
    pub names: Vec<String>,
    /// \[m\], shape \[members\].
    pub radii: Vec<f64>,
    /// Nominal places \[m\], shape \[members\].
    pub places: Vectors,
    /// Manoeuvres that can be flown, as the file gives them.
    pub manoeuvres: Vec<NamedManoeuvre>,
    leads: Vec<Option<Lead>>,
    /// Leaders that the file has moved from outside, whatever moves them at present.
    is_moved: Vec<bool>,
    /// The entry of the file that leads each member.
    entries: Vec<Option<usize>>,
    course: TargetSource,
    spacing: f64,
    /// Shared by copies: it is large, and never changed; or why there is none.
    settling: Result<Arc<Settling>, NoRest>,
    /// Roles for which `settling` was computed.
    settled_roles: Vec<Role>,
    /// Whether a scene's own program leads.
    is_scene: bool,
    /// When a leader was last sent to a place in place of its program \[s\].
    taken_over: f64,
}

/// The source of targets.
#[derive(Clone, Debug)]
enum TargetSource {
    /// The rule, over where the members were seen: member `m` is particle `particles[m]`.
    Rule { engine: Box<Engine>, particles: Vec<usize> },
    /// A body that moves by itself carries the members along: shares of its particles in each place.
    Inside { engine: Box<Engine>, shares: Vec<Vec<(u32, f64)>> },
    /// Places step by step, shape \[steps, members\].
    Recorded { steps: Vec<Vec<[f64; 2]>>, step: usize },
}

/// The members' poses as a period begins.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Last known places \[m\], shape \[members\]; those of members never seen are not used.
    pub present: &'a Vectors,
    /// Members that have been seen at least once, shape \[members\].
    pub known: &'a [bool],
}

impl Formation {
    /// Number of members.
    pub fn count(&self) -> usize {
        self.names.len()
    }

    /// Smallest distance between two places \[m\].
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Pairs of members, each once.
    pub(in crate::swarm) fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        (0..self.count()).flat_map(|i| (0..i).map(move |j| (i, j)))
    }

    /// Free space between the rims of two members at these places \[m\], negative where they overlap.
    pub(in crate::swarm) fn gap(&self, places: &Vectors, a: usize, b: usize) -> f64 {
        distance(places.get(a), places.get(b)) - self.radii[a] - self.radii[b]
    }

    /// The member of this name.
    pub fn number(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// Middle of the nominal places \[m\].
    pub fn middle(&self) -> [f64; 2] {
        self.places.middle()
    }

    /// Whether a member leads at present.
    pub fn leads(&self, member: usize) -> bool {
        match &self.course {
            TargetSource::Rule { engine, particles } => engine.roles()[particles[member]] != Role::Follower,
            TargetSource::Inside { .. } | TargetSource::Recorded { .. } => false,
        }
    }

    /// Whether leaders are moved by programs of the swarm, not by those of a scene.
    pub(crate) fn is_led_here(&self) -> bool {
        !self.is_scene
    }

    /// Whether a member's target follows from its neighbours' last known places alone.
    pub(crate) fn can_be_followed_alone(&self) -> bool {
        matches!(&self.course, TargetSource::Rule { engine, .. } if engine.update().order == Order::Synchronous)
    }

    /// Whether a follower whose neighbours reproduce its place has it by those alone that are heard.
    pub(in crate::swarm) fn keeps_place(&self, member: usize, is_heard: &[bool]) -> bool {
        self.among(member, is_heard, 0).is_none_or(|among| among.weights.is_some())
    }

    /// What a follower goes by where it leaves some of its neighbours out; `None` if it goes by all that it looks at.
    pub(in crate::swarm) fn among(&self, member: usize, is_heard: &[bool], liars: usize) -> Option<Among> {
        let TargetSource::Rule { engine, particles } = &self.course else { return None };
        let near = engine.flock().neighbours.of(particles[member]);
        let is_seen = |k: &u32| shown_by(engine, particles, k).all(|m| is_heard[m]);
        let is_one_lost = !near.iter().all(is_seen);
        if !is_one_lost && liars == 0 {
            return None;
        }
        let member_of = |k: u32| particles.binary_search(&(k as usize)).ok();
        let seen = || near.iter().filter(|k| is_seen(k)).copied();
        let heard = seen().filter_map(member_of).collect();
        let points = seen().filter(|&k| liars == 0 && member_of(k).is_none()).collect();
        let is_left = |k: usize| is_seen(&(k as u32));
        let weights = (liars == 0)
            .then(|| affine_weights::of_those_left(engine.flock(), particles[member], is_left))
            .flatten();
        Some(Among { member, is_one_lost, is_trimmed: false, heard, points, liars, weights })
    }

    /// Members whose positions the member's target depends on.
    pub fn depends_on(&self, member: usize) -> Vec<usize> {
        let TargetSource::Rule { engine, particles } = &self.course else { return Vec::new() };
        let near = engine.flock().neighbours.of(particles[member]);
        let mut seen: Vec<usize> = near.iter().flat_map(|k| shown_by(engine, particles, k)).collect();
        seen.sort_unstable();
        seen.dedup();
        seen.retain(|&other| other != member);
        seen
    }

    /// Number of steps after which a scene's or a recording's program is over.
    pub fn steps(&self) -> Option<usize> {
        match &self.course {
            TargetSource::Recorded { steps, .. } => Some(steps.len().saturating_sub(1)),
            _ => None,
        }
    }

    /// The engine that moves the body, where there is one.
    pub fn engine(&self) -> Option<&Engine> {
        match &self.course {
            TargetSource::Rule { engine, .. } | TargetSource::Inside { engine, .. } => Some(engine),
            TargetSource::Recorded { .. } => None,
        }
    }

    /// Whether all programs that lead the formation have ended by `now` \[s\].
    pub(in crate::swarm) fn programs_are_over(&self, now: f64) -> bool {
        let is_scene_over = match &self.course {
            TargetSource::Recorded { steps, step } => step + 1 >= steps.len(),
            TargetSource::Rule { engine, .. } | TargetSource::Inside { engine, .. } => {
                self.is_led_here() || !engine.is_scheduled()
            }
        };
        is_scene_over && now >= self.programs_end()
    }

    /// Moves the formation on by a period that ends at `time` \[s\]: `targets` are set to the places to which the
    /// leaders' programs and the rule send the members. With more than one sweep the followers' targets come nearer
    /// to where they would rest behind the leaders. The followers of `among` go by some neighbours alone, in every sweep.
    pub fn advance(
        &mut self,
        seen: &Seen<'_>,
        among: &mut [Among],
        time: f64,
        sweeps: usize,
        targets: &mut Vectors,
    ) {
        let leads: Vec<(usize, [f64; 2])> =
            (0..self.count()).filter_map(|m| Some((m, self.led_to(m, time)?))).collect();
        let (how, spacing) = (self.trim(), self.spacing);
        match &mut self.course {
            TargetSource::Recorded { steps, step } => {
                *step = (*step + 1).min(steps.len() - 1);
                steps[*step].iter().enumerate().for_each(|(m, &place)| targets.set(m, place));
            }
            TargetSource::Inside { engine, shares } => {
                engine.advance();
                for (m, shares) in shares.iter().enumerate() {
                    targets.set(m, inside::place(shares, engine.present()));
                }
            }
            TargetSource::Rule { engine, particles } => {
                let members = 0..particles.len();
                engine
                    .observe(members.filter(|&m| seen.known[m]).map(|m| (particles[m], seen.present.get(m))));
                for sweep in 0..sweeps {
                    leads.iter().for_each(|&(m, place)| engine.lead(particles[m], place));
                    engine.advance();
                    if !among.is_empty() {
                        let target = |one: &mut Among| {
                            let (target, is_trimmed) = one.target(engine, particles, how);
                            one.is_trimmed |= sweep == 0 && is_trimmed;
                            (particles[one.member], target)
                        };
                        let places: Vec<(usize, [f64; 2])> = among.iter_mut().map(target).collect();
                        engine.observe(places);
                    }
                    let largest_move = || match among.is_empty() {
                        true => engine.movement().largest_move,
                        false => {
                            let moves = engine.present().iter().zip(engine.previous().iter());
                            moves.map(|(to, from)| distance(to, from)).fold(0.0, f64::max) / spacing
                        }
                    };
                    // After the first sweep the leaders' move has reached their neighbours alone.
                    if sweep > 0 && largest_move() <= SETTLED {
                        break;
                    }
                }
                particles.iter().enumerate().for_each(|(m, &i)| targets.set(m, engine.present().get(i)));
            }
        }
        self.look_at_roles();
    }

    /// The coordinates that are left out together of faulty neighbours: matrix weights mix the axes.
    fn trim(&self) -> Trim {
        match self.engine().map(|engine| engine.flock().rule.mean) {
            Some(Mean::Material { .. }) => Trim::Whole,
            _ => Trim::PerAxis,
        }
    }

    /// Refuses more liars among the neighbours of a member than the formation tolerates.
    ///
    /// # Errors
    /// A sentence that names the robot and what it lacks.
    pub(crate) fn require_support(&self, liars: usize) -> Result<(), String> {
        // A target beyond its neighbours leaves the hull that bounds what liars can do.
        let rule = self.engine().map(|engine| engine.flock().rule);
        if rule.is_some_and(|rule| rule.feedback.is_some() || rule.poisson.is_some()) {
            return Err(
                "needs targets among the neighbours, and `rule.feedback` and `rule.poisson` lead beyond them"
                    .to_owned(),
            );
        }
        // What is left of weights of both signs may add up to nothing, by which it is divided.
        if let Some(Weights::Scalar(weights)) = self.engine().map(|engine| &engine.flock().weights)
            && weights.iter().any(|&weight| weight < 0.0)
        {
            return Err("needs weights of one sign, and some of `rule.weights` are below 0".to_owned());
        }
        let lists = (0..self.count()).map(|m| self.neighbours(m).map(|k| k as u32).collect::<Vec<_>>());
        let leaders: Vec<bool> = (0..self.count()).map(|m| self.leads(m)).collect();
        supported(&Neighbours::from_lists(lists), &leaders, liars, self.trim())
            .map_err(|unsupported| format!("`{}` {unsupported}", self.names[unsupported.member]))
    }

    /// The neighbours of a member among the members.
    pub fn neighbours(&self, member: usize) -> impl Iterator<Item = usize> + '_ {
        let (engine, particles) = match &self.course {
            TargetSource::Rule { engine, particles } => (Some(engine), &particles[..]),
            _ => (None, &[][..]),
        };
        let of = engine.map_or(&[][..], |engine| engine.flock().neighbours.of(particles[member]));
        of.iter().filter_map(|&i| particles.binary_search(&(i as usize)).ok())
    }

    /// Why no place of rest behind the leaders is known.
    pub(in crate::swarm) fn no_rest(&self) -> Option<&NoRest> {
        self.settling.as_ref().err()
    }

    /// Each member's place of rest with the leaders at their places in `present` \[m\]; `None` where it is not
    /// known: the rule is not linear, the leaders do not decide it alone, or it would take long to find.
    pub fn settled(&self, present: &Vectors) -> Option<Vectors> {
        let TargetSource::Rule { particles, .. } = &self.course else { return None };
        let settling = self.settling.as_ref().ok()?;
        let of_particle = |i: usize| {
            let m = particles.binary_search(&i).ok()?;
            Some(minus(present.get(m), self.places.get(m)))
        };
        let displaced = settling.displacements(of_particle);
        let mut rest: Vectors = self.places.clone();
        for (m, &i) in particles.iter().enumerate() {
            rest.set(m, displaced[i].map_or_else(|| present.get(m), |by| plus(self.places.get(m), by)));
        }
        Some(rest)
    }

    /// Part of the way to its target that a follower goes in a sweep \[1\].
    pub fn damping(&self) -> f64 {
        self.engine().map_or(1.0, |engine| engine.update().damping)
    }

    /// Sets the part of the way to each target that a follower goes from the next period on \[1\].
    pub fn set_damping(&mut self, damping: f64) {
        if let TargetSource::Rule { engine, .. } = &mut self.course {
            engine.set_damping(damping);
        }
    }

    /// Strain and PE1 of the members at the places `present`.
    pub fn measures(&self, present: &Vectors) -> Measures {
        let TargetSource::Rule { engine, particles } = &self.course else {
            return Measures { pe1: vec![0.0; self.count()], strain: vec![None; self.count()] };
        };
        let mut body = engine.present().clone();
        particles.iter().enumerate().for_each(|(m, &i)| body.set(i, present.get(m)));
        if let Some(frame) = &engine.body().frame {
            let seen = body.clone();
            frame.follow(&engine.body().reference, &seen, &mut body);
        }
        let flock = engine.flock();
        Measures {
            pe1: particles.iter().map(|&i| pe1(flock, i, &body)).collect(),
            strain: particles.iter().map(|&i| strain(flock, i, &body)).collect(),
        }
    }

    fn look_at_roles(&mut self) {
        let TargetSource::Rule { engine, .. } = &self.course else { return };
        if self.settled_roles != engine.roles() {
            self.settled_roles = engine.roles().to_vec();
            self.settling = Settling::of(engine).map(Arc::new);
        }
    }
}

/// The members whose places a particle shows: its own, or those that a point of the frame copies.
fn shown_by<'a>(engine: &'a Engine, particles: &'a [usize], k: &'a u32) -> impl Iterator<Item = usize> + 'a {
    let frame = engine.body().frame.as_ref();
    let copied = frame.and_then(|frame| Some(frame.served_by(frame.points.binary_search(k).ok()?)));
    let shown = copied.unwrap_or(std::slice::from_ref(k));
    shown.iter().filter_map(|&i| particles.binary_search(&(i as usize)).ok())
}

/// A follower that goes by some of its neighbours alone: the others are lost, or not believed.
#[derive(Clone, Debug)]
pub struct Among {
    /// Its number.
    pub member: usize,
    /// Whether any of those that it looks at is lost.
    pub is_one_lost: bool,
    /// Whether it left out any by where they are seen.
    pub is_trimmed: bool,
    heard: Vec<usize>,
    /// The points of the frame that it looks at, of those that are heard alone. A liar would have a vote more with each point that
    /// copies it: where liars are tolerated there are none.
    points: Vec<u32>,
    /// Of all its neighbours, where those heard can go on to keep its place in the formation.
    weights: Option<Vec<f64>>,
    /// Of the neighbours heard, the liars tolerated: it leaves out as many of those that stray farthest from it.
    liars: usize,
}

impl Among {
    /// Where its neighbours send it in the sweep that the engine has just taken \[m\], and whether it left out any of those heard. It
    /// stays along an axis on which there are too few.
    fn target(&self, engine: &Engine, particles: &[usize], how: Trim) -> ([f64; 2], bool) {
        let (flock, before, reference) = (engine.flock(), engine.previous(), &engine.body().reference);
        let particle = particles[self.member];
        let displacement = |m: usize| minus(before.get(particles[m]), reference.get(particles[m]));
        let mut keep = vec![[true; 2]; self.heard.len()];
        if self.liars > 0 {
            let all: Vec<[f64; 2]> = self.heard.iter().map(|&m| displacement(m)).collect();
            trim(how, displacement(self.member), &all, self.liars, &mut keep);
        }
        let here = before.get(particle);
        let target = [0, 1].map(|axis| {
            let counts = |i: usize| match particles.binary_search(&i) {
                Ok(m) => self.heard.iter().zip(&keep).any(|(&heard, keep)| heard == m && keep[axis]),
                Err(_) => self.points.contains(&(i as u32)),
            };
            let target = flock.target_among(particle, before, counts, self.weights.as_deref());
            target.map_or(here[axis], |to| here[axis] + engine.update().damping * (to[axis] - here[axis]))
        });
        (target, keep.iter().any(|keep| *keep != [true; 2]))
    }
}

/// Strain and PE1 of the members.
#[derive(Clone, Debug, PartialEq)]
pub struct Measures {
    /// \[m^2\], shape \[members\].
    pub pe1: Vec<f64>,
    /// Shape \[members\]; `None` where the neighbours lie on a line.
    pub strain: Vec<Option<Strain>>,
}

/// Largest move over the spacing at which a formation that is swept to rest is at rest.
const SETTLED: f64 = 1e-14;

fn spacing_of(places: &Vectors) -> f64 {
    let pairs = (0..places.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let nearest = pairs.map(|(i, j)| distance(places.get(i), places.get(j))).fold(f64::INFINITY, f64::min);
    if nearest.is_finite() { nearest } else { 1.0 }
}
