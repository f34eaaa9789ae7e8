//! A swarm file becomes a validated [`Swarm`]: the same reading, checks and messages as a scene's.
//!
//! Checks that need the robots' places (whether a name exists, say) are made where the formation is
//! laid out, which reports through [`Swarm::refuse`] in the same form.

mod leaders;
pub mod raw;
mod recording;
mod validate;

use super::document::Document;
use super::document::problem::SceneError;
use super::{Scene, SceneRegion};
use crate::flock::manoeuvre::Leg;
use crate::flock::motion::Motion;
use crate::flock::rules::Rule;
use raw::RawSwarm;

pub use validate::schema;

/// A swarm, ready to be laid out. SI units, angles in radians, except in `raw`, which is as written.
#[derive(Clone, Debug)]
pub struct Swarm {
    /// Short name: the bundled swarm's, or the file's without its ending.
    pub name: String,
    /// The swarm as written, overrides and defaults included.
    pub raw: RawSwarm,
    /// Where the robots' places come from.
    pub shape: Shape,
    /// Leaders in the order in which they are written.
    pub leaders: Vec<Leaders>,
    /// Motions of all leaders together, in the order in which they are written.
    pub manoeuvres: Vec<NamedManoeuvre>,
    document: Document,
}

/// A motion of all leaders together.
#[derive(Clone, Debug)]
pub struct NamedManoeuvre {
    /// The name by which a leader's program or a service calls it.
    pub name: String,
    /// The point that is turned about \[m\]; the middle of the formation's places where `None`.
    pub about: Option<[f64; 2]>,
    /// Legs in the order in which they are flown.
    pub legs: Vec<Leg>,
}

/// The source of the robots' places.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The file names each, and they follow by this rule.
    Places(Rule),
    /// They are the particles of a body.
    Body(Box<Scene>),
    /// They are the particles of a scene's body, and its leaders lead.
    Scene(Box<Scene>),
    /// Each has a place inside a scene's body, which carries it along.
    Inside(Box<Scene>),
    /// They are particles of a scene's body, and go where a run of it went.
    Recorded(Box<Scene>, Recording),
}

/// Places of particles, step by step.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Ids, counted from 1, ascending.
    pub ids: Vec<usize>,
    /// Places \[length\], shape \[steps, ids\].
    pub places: Vec<Vec<[f64; 2]>>,
}

/// Robots that lead.
#[derive(Clone, Debug)]
pub struct Leaders {
    /// Which robots.
    pub robots: Picked,
    /// How they move.
    pub program: Program,
}

/// Robots by name or by place.
#[derive(Clone, Debug)]
pub enum Picked {
    /// Robots with these names.
    Names(Vec<String>),
    /// Robots whose places in the formation lie in a region of the lattice.
    Region(SceneRegion),
}

/// The motion of leaders; times in seconds.
#[derive(Clone, Debug)]
pub enum Program {
    /// From outside.
    External,
    /// All alike.
    Motion(Motion),
    /// Each by its own.
    Individual(Vec<Track>),
    /// By number among the swarm's manoeuvres.
    Manoeuvre(usize),
}

/// The motion of one leader, from a file.
#[derive(Clone, Debug)]
pub struct Track {
    /// The leader.
    pub name: String,
    /// The line of its first row, counted from 1.
    pub line: u64,
    /// Its displacements; times in seconds.
    pub motion: Motion,
}

impl Swarm {
    /// The error that refuses this swarm for what stands at `key`.
    pub fn refuse(&self, key: &str, message: impl Into<String>, help: impl Into<String>) -> SceneError {
        SceneError::from(self.document.problem(key, message, Some(help.into())))
    }
}
