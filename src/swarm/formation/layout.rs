//! Builds a formation from a swarm file, with the checks that need the places.

use super::{Formation, Lead, NoRest, TargetSource, checks, inside, links, spacing_of};
use crate::continuum::layout::Layout;
use crate::continuum::plan::Plan;
use crate::engine::Engine;
use crate::engine::setup::Setup;
use crate::flock::body::Body;
use crate::flock::law::{Flock, Weights};
use crate::flock::manoeuvre::{Manoeuvre, Posture};
use crate::flock::region::Region;
use crate::flock::role::Role;
use crate::flock::rules::Rule;
use crate::flock::vectors::{Vectors, distance};
use crate::material::cells::Cells;
use crate::scene::raw::{RawRest, RawWeights};
use crate::scene::swarm::raw::RawLinks;
use crate::scene::swarm::{Picked, Program, Recording, Shape, Swarm, Track};
use crate::scene::{RoleEntry, Scene, SceneError, SceneRegion};
use crate::solve::affine_weights;
use crate::sweep::Update;

impl Formation {
    /// # Errors
    /// Names the key of the swarm that cannot be laid out: a robot that does not exist, a place outside the
    /// body, a follower that no leader reaches, weights that do not exist for its neighbours.
    pub fn lay_out(swarm: &Swarm) -> Result<Self, SceneError> {
        let formation = match &swarm.shape {
            Shape::Places(rule) => of_places(swarm, *rule)?,
            Shape::Body(scene) => of_body(swarm, scene)?,
            Shape::Scene(scene) => of_particles(swarm, Plan::new(scene)?.setup, true),
            Shape::Inside(scene) => inside_of(swarm, scene)?,
            Shape::Recorded(scene, recording) => recorded(swarm, scene, recording)?,
        };
        checks::require_apart(swarm, &formation)?;
        checks::require_in_range(swarm, &formation)?;
        checks::require_witnesses(swarm, &formation)?;
        if matches!(swarm.raw.rule.weights, Some(RawWeights::Solved {})) {
            require_settling(swarm, &formation)?;
        }
        Ok(formation)
    }
}

fn of_places(swarm: &Swarm, rule: Rule) -> Result<Formation, SceneError> {
    let places: Vectors = swarm.raw.robots.iter().map(|robot| robot.place).collect();
    let names: Vec<String> = swarm.raw.robots.iter().map(|robot| robot.name.clone()).collect();
    let led = leads(swarm, &names, &places, &|_, _| Ok(Vec::new()))?;
    let follows: Vec<bool> = led.iter().map(Option::is_none).collect();
    let neighbours = links::neighbours(swarm, &places)?;
    let present_radius = match swarm.raw.links {
        Some(RawLinks::Present { radius }) => Some(radius),
        _ => None,
    };
    if present_radius.is_none()
        && let Some(i) = (0..places.len()).find(|&i| follows[i] && neighbours.of(i).is_empty())
    {
        let message = format!("`{}` follows and has no neighbours", names[i]);
        return Err(swarm.refuse("links", message, "widen the links, or make it a leader"));
    }
    let spacing = spacing_of(&places);
    let weights = match &swarm.raw.rule.weights {
        Some(RawWeights::Solved {}) => {
            let solved = affine_weights::solve(&places, &neighbours, &follows).map_err(|error| {
                let help = "give it more neighbours on all its sides, or make it a leader";
                swarm.refuse("rule.weights", error.described(|i| format!("`{}`", names[i])), help)
            })?;
            Weights::Scalar(solved.weights)
        }
        Some(RawWeights::Distance { power }) => {
            let weight =
                |i: usize, k: u32| (distance(places.get(i), places.get(k as usize)) / spacing).powf(*power);
            let all = (0..places.len()).flat_map(|i| neighbours.of(i).iter().map(move |&k| weight(i, k)));
            Weights::Scalar(all.collect())
        }
        _ => Weights::Equal,
    };
    let body = Body::of_places(places.clone(), spacing);
    let mut flock = Flock::new(rule, body.reference.clone(), neighbours, weights);
    if swarm.raw.rule.rest == RawRest::Balanced && present_radius.is_none() {
        flock.keep_rest();
    }
    let roles = led.iter().map(|lead| if lead.is_some() { Role::Leader } else { Role::Follower }).collect();
    let update = Update { damping: rule.mean.settling_damping(), ..Update::default() };
    let setup = Setup { present_radius, ..Setup::new(body, flock, roles, update) };
    let radius = |k: usize| swarm.raw.robots[k].radius.unwrap_or(swarm.raw.radius);
    let mut formation = of_particles(swarm, setup, false);
    formation.radii = (0..formation.count()).map(radius).collect();
    formation.names = names;
    formation.let_lead(led);
    Ok(formation)
}

fn of_body(swarm: &Swarm, scene: &Scene) -> Result<Formation, SceneError> {
    let layout = Layout::new(scene)?;
    let members: Vec<usize> = layout.body.body_particles().collect();
    let names = numbered(swarm, members.len());
    let places: Vectors = members.iter().map(|&i| layout.body.reference.get(i)).collect();
    let members_led = leads(swarm, &names, &places, &|k, region| {
        let picked = layout.pick(scene, &format!("leaders[{k}]"), region)?;
        Ok(picked.into_iter().filter_map(|i| members.binary_search(&i).ok()).collect())
    })?;
    let ids: Vec<usize> =
        (0..members.len()).filter(|&m| members_led[m].is_some()).map(|m| members[m] + 1).collect();
    let mut led = scene.clone();
    if !ids.is_empty() {
        let region = SceneRegion::Known(Region::Ids(ids));
        led.roles.push(RoleEntry {
            region,
            role: Role::Leader,
            axis: None,
            from: 1,
            when: None,
            motion: None,
        });
    }
    let mut setup = Plan::new(&led)?.setup;
    setup.update.damping = setup.update.damping.min(setup.flock.rule.mean.settling_damping());
    let mut formation = of_particles(swarm, setup, false);
    formation.names = names;
    formation.let_lead(members_led);
    Ok(formation)
}

/// The members are the particles of the body, its frame left out.
fn of_particles(swarm: &Swarm, setup: Setup, is_scene: bool) -> Formation {
    let particles: Vec<usize> = setup.body.body_particles().collect();
    let places: Vectors = particles.iter().map(|&i| setup.body.reference.get(i)).collect();
    let course = TargetSource::Rule { engine: Box::new(Engine::new(setup)), particles };
    formation(swarm, numbered(swarm, places.len()), places, course, is_scene)
}

fn inside_of(swarm: &Swarm, scene: &Scene) -> Result<Formation, SceneError> {
    let plan = Plan::new(scene)?;
    let cells = Cells::of_body(&plan.setup.body);
    let mut shares = Vec::new();
    for (k, robot) in swarm.raw.robots.iter().enumerate() {
        let inside = inside::shares(&cells, &plan.setup.body.reference, robot.place);
        shares.push(inside.ok_or_else(|| {
            let (low, high) = plan.setup.body.bounds();
            let message = format!(
                "lies in no cell of the body, which spans [{}, {}] to [{}, {}]",
                low[0], low[1], high[0], high[1]
            );
            swarm.refuse(&format!("robots[{k}].place"), message, "give a place inside the body")
        })?);
    }
    let places = swarm.raw.robots.iter().map(|robot| robot.place).collect();
    let names = swarm.raw.robots.iter().map(|robot| robot.name.clone()).collect();
    let course = TargetSource::Inside { engine: Box::new(Engine::new(plan.setup)), shares };
    let mut formation = formation(swarm, names, places, course, true);
    let radius = |k: usize| swarm.raw.robots[k].radius.unwrap_or(swarm.raw.radius);
    formation.radii = (0..formation.count()).map(radius).collect();
    Ok(formation)
}

fn recorded(swarm: &Swarm, scene: &Scene, recording: &Recording) -> Result<Formation, SceneError> {
    let body = Layout::new(scene)?.body;
    if let Some(id) = recording.ids.iter().find(|&&id| id == 0 || id > body.count()) {
        let message = format!("there is no particle {id} in scene `{}`", scene.name);
        return Err(swarm.refuse("scene.recording", message, "give the recording of a run of this scene"));
    }
    let places = recording.ids.iter().map(|id| body.reference.get(id - 1)).collect();
    let course = TargetSource::Recorded { steps: recording.places.clone(), step: 0 };
    Ok(formation(swarm, numbered(swarm, recording.ids.len()), places, course, true))
}

fn formation(
    swarm: &Swarm,
    names: Vec<String>,
    places: Vectors,
    course: TargetSource,
    is_scene: bool,
) -> Formation {
    let mut formation = Formation {
        radii: vec![swarm.raw.radius; names.len()],
        leads: vec![None; names.len()],
        is_moved: vec![false; names.len()],
        entries: vec![None; names.len()],
        spacing: spacing_of(&places),
        manoeuvres: swarm.manoeuvres.clone(),
        settling: Err(NoRest::NoRule),
        settled_roles: Vec::new(),
        names,
        places,
        course,
        is_scene,
        taken_over: 0.0,
    };
    formation.look_at_roles();
    formation
}

fn numbered(swarm: &Swarm, count: usize) -> Vec<String> {
    (1..=count).map(|n| format!("{}{n}", swarm.raw.prefix)).collect()
}

/// Members in a region, for the entry of leaders of this number.
type Pick<'a> = &'a dyn Fn(usize, &SceneRegion) -> Result<Vec<usize>, SceneError>;

/// The entry that each member which leads is led by, and its motion; later entries win.
fn leads(
    swarm: &Swarm,
    names: &[String],
    places: &Vectors,
    pick: Pick<'_>,
) -> Result<Vec<Option<(usize, Lead)>>, SceneError> {
    let mut leads = vec![None; names.len()];
    for (k, entry) in swarm.leaders.iter().enumerate() {
        let members = match &entry.robots {
            Picked::Region(region) => pick(k, region)?,
            Picked::Names(wanted) => {
                let number = |(n, name): (usize, &String)| {
                    names.iter().position(|known| known == name).ok_or_else(|| {
                        let key = format!("leaders[{k}].robots[{n}]");
                        let message = format!("there is no robot `{name}`; the first is `{}`", names[0]);
                        swarm.refuse(&key, message, "name a robot of this swarm")
                    })
                };
                wanted.iter().enumerate().map(number).collect::<Result<_, _>>()?
            }
        };
        for m in members {
            leads[m] = Some((k, lead(swarm, k, &entry.program, &names[m], m, places)?));
        }
    }
    require_led(swarm, names, &leads)?;
    Ok(leads)
}

/// Refuses files with rows of robots that no entry leads; one file may serve several entries.
fn require_led<L>(swarm: &Swarm, names: &[String], leads: &[Option<L>]) -> Result<(), SceneError> {
    for (k, entry) in swarm.leaders.iter().enumerate() {
        let Program::Individual(tracks) = &entry.program else { continue };
        for Track { name, line, .. } in tracks {
            let (fault, help) = match names.iter().position(|known| known == name) {
                None => ("and there is no such robot", "name robots of this swarm"),
                Some(m) if leads[m].is_none() => {
                    ("which no entry of `leaders` leads", "let it lead, or leave its rows out")
                }
                Some(_) => continue,
            };
            let message = format!("line {line}: the file has rows for `{name}`, {fault}");
            return Err(swarm.refuse(&format!("leaders[{k}].program.path"), message, help));
        }
    }
    Ok(())
}

fn lead(
    swarm: &Swarm,
    entry: usize,
    program: &Program,
    name: &str,
    member: usize,
    places: &Vectors,
) -> Result<Lead, SceneError> {
    Ok(match program {
        Program::External => Lead::External(places.get(member)),
        Program::Motion(motion) => Lead::Motion { motion: motion.clone(), since: 0.0 },
        Program::Individual(tracks) => {
            let track = tracks.iter().find(|track| track.name == name).ok_or_else(|| {
                let key = format!("leaders[{entry}].program.path");
                let message = format!("the file has no rows for `{name}`");
                swarm.refuse(&key, message, "give every leader rows of its own")
            })?;
            Lead::Motion { motion: track.motion.clone(), since: 0.0 }
        }
        Program::Manoeuvre(number) => {
            let named = &swarm.manoeuvres[*number];
            let about = named.about.unwrap_or_else(|| places.middle());
            let manoeuvre = Manoeuvre { about, from: Posture::NOMINAL, legs: named.legs.clone() };
            Lead::Manoeuvre { manoeuvre, since: 0.0 }
        }
    })
}

/// Refuses solved weights with which the followers would not come to rest. Those outside the hull of their
/// neighbours have negative ones, and several of them together may drive each other away.
fn require_settling(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let Some(engine) = formation.engine() else { return Ok(()) };
    let Weights::Scalar(weights) = &engine.flock().weights else { return Ok(()) };
    let neighbours = &engine.flock().neighbours;
    let follows: Vec<bool> = engine.roles().iter().map(|&role| role == Role::Follower).collect();
    affine_weights::settles(weights, neighbours, &follows).map(drop).map_err(|error| {
        let outside = |&m: &usize| {
            let TargetSource::Rule { particles, .. } = &formation.course else { return false };
            follows[particles[m]] && neighbours.bonds(particles[m]).any(|bond| weights[bond] < 0.0)
        };
        let names: Vec<&str> =
            (0..formation.count()).filter(outside).map(|m| formation.names[m].as_str()).collect();
        let help = match names[..] {
            [] => {
                "let robots lead that do not stand on one line, and that every robot is linked to".to_owned()
            }
            _ => format!(
                "let these lead, which lie outside the hull of their neighbours: {}",
                names.join(", ")
            ),
        };
        swarm.refuse("rule.weights", error.to_string(), help)
    })
}
