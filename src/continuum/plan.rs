//! From a scene to the arrays that an engine steps, with the checks that need the body.

use super::weights;
use crate::flock::body::{Body, BodyError};
use crate::flock::fracture::{Bonds, Break, Ghosts};
use crate::flock::interaction::Interaction;
use crate::flock::motion::Motion;
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::points::distance;
use crate::flock::region::{Region, Side};
use crate::flock::role::Role;
use crate::flock::rules::{Axis, Poisson, Rule};
use crate::scene::{Condition, LeaderMotion, RoleEntry, Scene, SceneError, SceneRegion, Stop};
use crate::solve::sweep::Update;

/// Everything an engine needs; nothing of it refers to the scene file.
#[derive(Clone, Debug)]
pub struct Plan {
    pub body: Body,
    pub interaction: Interaction,
    pub update: Update,
    /// Radius within which neighbours are found anew at every step \[length\].
    pub present_radius: Option<f64>,
    /// Roles before the first step, shape \[count\].
    pub roles: Vec<Role>,
    /// Role changes in the order they were written.
    pub changes: Vec<RoleChange>,
    /// Bonds cut before the first step.
    pub cuts: Vec<Break>,
    pub stop: Stop,
    /// Diagonal of the body's bounds \[length\].
    pub diagonal: f64,
    /// Indices of the particles kept at every step.
    pub probes: Vec<usize>,
}

/// A role that some particles take.
#[derive(Clone, Debug)]
pub struct RoleChange {
    pub particles: Vec<usize>,
    pub role: Role,
    /// First step at which it holds.
    pub from: usize,
    pub when: Option<Condition>,
    pub motion: Option<Motion>,
}

impl Plan {
    /// # Errors
    /// Names the key of the scene that cannot be laid out: an empty or disconnected body, a region
    /// without particles, a neighbourhood that does not fit the lattice, an id that does not exist.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let (body, neighbours) = build_body(scene)?;
        let changes = role_changes(scene, &body, &neighbours)?;
        let weights = weights::of_body(scene, &body, &neighbours)?;
        let interaction = interaction(scene, &body, neighbours, weights);
        let probes = probes(scene, &body)?;
        let roles = body.is_frame.iter().map(|&f| if f { Role::Frame } else { Role::Follower }).collect();
        let (low, high) = body.bounds();
        let mut plan = Self {
            update: scene.update,
            present_radius: match scene.neighbourhood {
                Neighbourhood::Present { radius } => Some(radius),
                _ => None,
            },
            roles,
            changes,
            cuts: Vec::new(),
            stop: scene.stop,
            // A body of one particle has no extent; its spacing stands in.
            diagonal: distance(low, high).max(body.lattice.spacing()),
            probes,
            body,
            interaction,
        };
        plan.make_cuts(scene);
        plan.take_first_roles();
        Ok(plan)
    }

    pub fn count(&self) -> usize {
        self.body.count()
    }

    fn make_cuts(&mut self, scene: &Scene) {
        if let Some(bonds) = &mut self.interaction.bonds {
            for &ends in &scene.cuts {
                bonds.cut(ends, &self.interaction.neighbours, &self.body.reference, &mut self.cuts);
            }
        }
    }

    /// Roles without a condition that hold from the first step are those the plan starts with.
    fn take_first_roles(&mut self) {
        for change in self.changes.iter().filter(|change| change.from <= 1 && change.when.is_none()) {
            for &i in &change.particles {
                self.roles[i] = change.role;
            }
        }
    }
}

fn build_body(scene: &Scene) -> Result<(Body, Neighbours), SceneError> {
    let (body, neighbours) =
        Body::build(scene.lattice.clone(), &scene.cut, &scene.neighbourhood, scene.frame).map_err(
            |error| {
                let (key, help) = match &error {
                    BodyError::Neighbourhood(_) => {
                        ("neighbours", "choose a neighbourhood that the lattice has")
                    }
                    BodyError::TooLarge { .. } => ("body.shape", "use a wider spacing or a smaller shape"),
                    _ => ("body.shape", "use a smaller spacing or a larger shape"),
                };
                scene.refuse(key, error.to_string(), help)
            },
        )?;
    if !matches!(scene.neighbourhood, Neighbourhood::Present { .. }) {
        body.require_connected(&neighbours).map_err(|error| {
            let help = "close the gap, use a wider neighbourhood, or run the parts as scenes of their own";
            scene.refuse("body.shape", error.to_string(), help)
        })?;
    }
    Ok((body, neighbours))
}

fn interaction(scene: &Scene, body: &Body, neighbours: Neighbours, weights: Option<Vec<f64>>) -> Interaction {
    let (low, high) = body.bounds();
    let poisson = scene.poisson.map(|term| {
        let across = match term.pull {
            Axis::X => 1,
            Axis::Y => 0,
        };
        let half_width = (high[across] - low[across]) / 2.0;
        Poisson {
            k: term.k,
            pull: term.pull,
            centre: term.centre.unwrap_or((low[across] + high[across]) / 2.0),
            half_width: if half_width > 0.0 { half_width } else { body.lattice.spacing() },
            exponent: term.exponent,
        }
    });
    let needs_bonds = scene.fracture.is_some()
        || !scene.cuts.is_empty()
        || scene.roles.iter().any(|entry| entry.role == Role::Ghost);
    let bonds = needs_bonds.then(|| {
        let (threshold, ghosts) =
            scene.fracture.map_or((None, Ghosts::Lattice), |fracture| (fracture.threshold, fracture.ghosts));
        Bonds::new(threshold, ghosts, &neighbours)
    });
    let mut interaction = Interaction {
        rule: Rule { mean: scene.mean, poisson, feedback: scene.feedback },
        reference: body.reference.clone(),
        neighbours,
        weights,
        rest: None,
        bonds,
    };
    if scene.keeps_rest {
        interaction.keep_rest();
    }
    interaction
}

fn role_changes(scene: &Scene, body: &Body, neighbours: &Neighbours) -> Result<Vec<RoleChange>, SceneError> {
    let mut changes = Vec::new();
    for (k, entry) in scene.roles.iter().enumerate() {
        let key = format!("roles[{k}].region");
        check_ids(scene, &key, &entry.region, body)?;
        let particles = region(&entry.region, body).pick(body, neighbours);
        if particles.is_empty() {
            let (low, high) = body.bounds();
            let message = format!(
                "no particle of the body lies in this region; the body spans [{}, {}] to [{}, {}]",
                low[0], low[1], high[0], high[1]
            );
            return Err(scene.refuse(&key, message, "move or widen the region"));
        }
        let motion = motion(scene, k, entry, &particles, body)?;
        changes.push(RoleChange { particles, role: entry.role, from: entry.from, when: entry.when, motion });
    }
    Ok(changes)
}

fn check_ids(scene: &Scene, key: &str, region: &SceneRegion, body: &Body) -> Result<(), SceneError> {
    let SceneRegion::Known(Region::Ids(ids)) = region else { return Ok(()) };
    for (n, &id) in ids.iter().enumerate() {
        let message = match body.is_frame.get(id.wrapping_sub(1)) {
            Some(false) => continue,
            Some(true) => format!("particle {id} belongs to the frame, whose role is fixed"),
            None => format!("there is no particle {id}: ids run from 1 to {}", body.count()),
        };
        return Err(scene.refuse(
            &format!("{key}.ids[{n}]"),
            message,
            "`flockform plan` prints the numbering",
        ));
    }
    Ok(())
}

fn region(region: &SceneRegion, body: &Body) -> Region {
    match region {
        SceneRegion::Known(region) => region.clone(),
        SceneRegion::Outermost(side) => Region::Edge { side: *side, depth: outermost_depth(*side, body) },
    }
}

/// Deep enough for a staggered edge: less than one period of the lattice's rows across the side.
fn outermost_depth(side: Side, body: &Body) -> f64 {
    let k = usize::from(matches!(side, Side::Bottom | Side::Top));
    let steps =
        body.lattice.first_neighbours(0).into_iter().map(|offset| body.lattice.vector(offset)[k].abs());
    let spacing = body.lattice.spacing();
    let shortest = steps.clone().filter(|&step| step > 1e-6 * spacing).fold(f64::INFINITY, f64::min);
    let longest = steps.fold(0.0, f64::max);
    // Rows that are staggered by part of a period count as one edge.
    if longest > 1.5 * shortest { 0.75 * longest } else { shortest / 2.0 }
}

fn motion(
    scene: &Scene,
    entry_number: usize,
    entry: &RoleEntry,
    particles: &[usize],
    body: &Body,
) -> Result<Option<Motion>, SceneError> {
    match &entry.motion {
        None => Ok(None),
        Some(LeaderMotion::Program(motion)) => Ok(Some(motion.clone())),
        Some(LeaderMotion::Table { rows, steps }) => {
            let displacements =
                rows.of(particles, &body.reference, body.lattice.spacing()).map_err(|message| {
                    let key = format!("roles[{entry_number}].motion.file");
                    scene.refuse(
                        &key,
                        message,
                        "give every particle of the region a row, or narrow the region",
                    )
                })?;
            Ok(Some(Motion::Table { displacements, steps: *steps as f64 }))
        }
    }
}

fn probes(scene: &Scene, body: &Body) -> Result<Vec<usize>, SceneError> {
    for (n, &id) in scene.record.probes.iter().enumerate() {
        if id == 0 || id > body.count() {
            let message = format!("there is no particle {id}: ids run from 1 to {}", body.count());
            return Err(scene.refuse(&format!("record.probes[{n}]"), message, "name a particle of the body"));
        }
    }
    Ok(scene.record.probes.iter().map(|id| id - 1).collect())
}
