//! Builds a swarm from its file, with the checks that concern several keys at once.

use std::path::Path;

use super::leaders::leaders;
use super::raw::*;
use super::recording;
use super::{NamedManoeuvre, Shape, Swarm};
use crate::flock::manoeuvre::{Leg, Posture};
use crate::flock::rules::Rule;
use crate::geometry::point::area;
use crate::scene::document::problem::SceneError;
use crate::scene::document::{Document, schema_of};
use crate::scene::raw::{
    RawBody, RawFrame, RawLattice, RawMean, RawRecord, RawRest, RawScene, RawShape, RawStop, RawUpdate,
    RawWeights,
};
use crate::scene::validate::{self as scene_checks, File, Refuse};
use crate::scene::{Scene, bundled};

impl Swarm {
    /// Reads a swarm file from disk; `overrides` are `KEY.PATH=VALUE` texts applied on top.
    ///
    /// # Errors
    /// Every key that is unknown, missing, out of range or at odds with another, with its line.
    pub fn from_file(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        Self::from_text_of_file(path, Self::text_of_file(path)?, overrides)
    }

    /// The text of a swarm file.
    ///
    /// # Errors
    /// A file that cannot be read, or is no text.
    pub fn text_of_file(path: &Path) -> Result<String, SceneError> {
        let help = "give the path of a swarm file, or a name that `flockform list swarms` lists";
        Ok(File::read(path, help)?.text)
    }

    /// The same of a file whose text has been read.
    ///
    /// # Errors
    /// As [`Swarm::from_file`].
    pub fn from_text_of_file(path: &Path, text: String, overrides: &[String]) -> Result<Self, SceneError> {
        let File { name, file, text } = File::of(path, text);
        Self::parse(&name, &file, &text, overrides, path.parent())
    }

    /// Reads a swarm from text. `file` names it in messages; other files are looked up in `folder`.
    ///
    /// # Errors
    /// As [`Swarm::from_file`].
    pub fn parse(
        name: &str,
        file: &str,
        text: &str,
        overrides: &[String],
        folder: Option<&Path>,
    ) -> Result<Self, SceneError> {
        Self::build(name, Document::parse(file, text, overrides)?, folder)
    }

    /// The swarm with more keys set after those that it was read with, from the text that was read then. Files are
    /// looked up in `folder`.
    ///
    /// # Errors
    /// Keys that cannot be set so.
    pub fn with(&self, set: &[String], folder: Option<&Path>) -> Result<Self, SceneError> {
        Self::build(&self.name, self.document.with(set)?, folder)
    }

    fn build(name: &str, document: Document, folder: Option<&Path>) -> Result<Self, SceneError> {
        let mut raw: RawSwarm = document.read(&schema())?;
        raw.node.name_arrays();
        let refuse: Refuse<'_> =
            &|key, message, help| SceneError::from(document.problem(key, message, Some(help.to_owned())));
        check_robots(&raw, refuse)?;
        check_safety(&raw, refuse)?;
        check_flight(&raw, refuse)?;
        let shape = shape(name, &raw, &document, folder, refuse)?;
        let manoeuvres = manoeuvres(&raw, refuse)?;
        let leaders = leaders(&raw, &shape, folder, refuse)?;
        Ok(Self { name: name.to_owned(), shape, leaders, manoeuvres, raw, document })
    }
}

/// The JSON Schema of a swarm file.
pub fn schema() -> serde_json::Value {
    schema_of::<RawSwarm>()
}

fn shape(
    name: &str,
    raw: &RawSwarm,
    document: &Document,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<Shape, SceneError> {
    let help = "give one of: [[robots]] with a place each; [lattice] and [body]; [scene]";
    match (&raw.scene, &raw.lattice, &raw.body) {
        (None, None, None) if raw.robots.is_empty() => {
            Err(refuse("robots", "no robot is given".into(), help))
        }
        (None, None, None) => Ok(Shape::Places(rule_of_places(raw, refuse)?)),
        (None, _, Some(RawBody { shape: RawShape::Points { .. }, .. })) => {
            let message = "robots are no body of points".into();
            Err(refuse("body.shape", message, "give each robot's place in [[robots]]"))
        }
        (None, Some(lattice), Some(body)) if raw.robots.is_empty() => {
            let scene = body_scene(raw, lattice, body);
            if raw.links.is_some() {
                let message = "links are those of robots that are given one by one".into();
                return Err(refuse("links", message, "use [neighbours], which are the lattice's"));
            }
            Ok(Shape::Body(Box::new(scene_checks::validate(name, scene, document.clone(), folder)?)))
        }
        (Some(bridge), None, None) => bridged(raw, bridge, folder, refuse),
        (None, Some(_), None) => Err(refuse("body", "the lattice has no body cut from it".into(), help)),
        (None, None, Some(_)) => Err(refuse("lattice", "the body has no lattice".into(), help)),
        _ => {
            let key = if raw.scene.is_some() { "scene" } else { "robots" };
            Err(refuse(key, "the formation has two shapes".into(), help))
        }
    }
}

/// A lattice formation is laid out as the body of a continuum scene with the same keys would be.
fn body_scene(raw: &RawSwarm, lattice: &RawLattice, body: &RawBody) -> RawScene {
    RawScene {
        title: raw.title.clone(),
        notes: String::new(),
        unit: "m".into(),
        stress_unit: None,
        lattice: Some(lattice.clone()),
        body: body.clone(),
        frame: raw.frame,
        neighbours: raw.neighbours.clone(),
        rule: raw.rule.clone(),
        material: raw.material.clone(),
        loads: Vec::new(),
        update: RawUpdate::default(),
        roles: Vec::new(),
        fracture: None,
        cuts: Vec::new(),
        actions: Vec::new(),
        stop: RawStop::default(),
        equilibrium: None,
        load_steps: None,
        record: RawRecord::default(),
    }
}

fn bridged(
    raw: &RawSwarm,
    bridge: &RawBridge,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<Shape, SceneError> {
    let own = [
        ("rule", raw.rule.mean.is_some() || raw.rule.weights.is_some() || raw.rule.feedback.is_some()),
        ("rule", raw.rule.rest != RawRest::default() || raw.rule.poisson.is_some()),
        ("frame", raw.frame != RawFrame::None),
        ("neighbours", raw.neighbours.is_some()),
        ("links", raw.links.is_some()),
        ("material", raw.material.is_some()),
        ("leaders", !raw.leaders.is_empty()),
        ("control.sweeps", raw.control.sweeps != 1),
    ];
    if let Some((key, _)) = own.into_iter().find(|(_, given)| *given) {
        let message = "the formation is the body of a scene, which says this itself".into();
        return Err(refuse(
            key,
            message,
            "leave it out, or change the scene by scene.set = [\"KEY.PATH=VALUE\"]",
        ));
    }
    let scene = match bundled(&bridge.name) {
        Some(bundled) => bundled.load(&bridge.set)?,
        None => Scene::from_file(&folder.unwrap_or(Path::new("")).join(&bridge.name), &bridge.set)?,
    };
    let scene = Box::new(scene);
    if scene.equilibrium.is_some() {
        let message = format!("scene `{}` goes straight to rest: there is nothing to fly", scene.name);
        return Err(refuse("scene.name", message, "use a scene without [equilibrium], which is stepped"));
    }
    if scene.is_of_points() {
        let message = format!("scene `{}` has a body of points, which robots cannot be", scene.name);
        return Err(refuse("scene.name", message, "give each robot's place in [[robots]]"));
    }
    match &bridge.recording {
        Some(_) if !raw.robots.is_empty() => {
            let message = "robots of a recording are the particles that it holds".into();
            Err(refuse("robots", message, "leave [[robots]] out, or scene.recording"))
        }
        Some(file) => Ok(Shape::Recorded(scene, recording::read(file, folder, refuse)?)),
        None if raw.robots.is_empty() => Ok(Shape::Scene(scene)),
        None => Ok(Shape::Inside(scene)),
    }
}

/// The rule of robots that stand on no lattice.
fn rule_of_places(raw: &RawSwarm, refuse: Refuse<'_>) -> Result<Rule, SceneError> {
    let lattice_only = [
        ("frame", raw.frame != RawFrame::None, "a frame"),
        ("neighbours", raw.neighbours.is_some(), "a neighbourhood of lattice sites"),
        ("material", raw.material.is_some(), "a material"),
        ("rule.mean", matches!(raw.rule.mean, Some(RawMean::Material { .. })), "the mean of a material"),
        ("rule.poisson", raw.rule.poisson.is_some(), "the Poisson term"),
        (
            "rule.weights",
            matches!(raw.rule.weights, Some(RawWeights::Gradient { .. } | RawWeights::List { .. })),
            "a list of weights",
        ),
    ];
    if let Some((key, _, what)) = lattice_only.into_iter().find(|(_, given, _)| *given) {
        let message = format!("{what} needs a lattice, and the robots are given one by one");
        return Err(refuse(
            key,
            message,
            "use [lattice] and [body], or links and rule.weights of kind \"solved\"",
        ));
    }
    let nearest = raw.robots.iter().enumerate().flat_map(|(i, a)| {
        raw.robots[..i].iter().map(move |b| f64::hypot(a.place[0] - b.place[0], a.place[1] - b.place[1]))
    });
    let spacing = nearest.fold(f64::INFINITY, f64::min);
    let mean = scene_checks::mean(raw.rule.mean.as_ref().unwrap_or(&RawMean::Barycentre), spacing, refuse)?;
    let feedback = raw.rule.feedback.as_ref().map(scene_checks::feedback);
    Ok(Rule { mean, poisson: None, feedback })
}

/// Names that ROS can carry, each once, and places apart.
fn check_robots(raw: &RawSwarm, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let is_name = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            && !name.contains("__")
    };
    let help = "use letters, digits and single underscores, no digit first: r1, left_wing";
    if !is_name(&raw.prefix) {
        return Err(refuse("prefix", "no ROS name can begin so".into(), help));
    }
    for (k, robot) in raw.robots.iter().enumerate() {
        if !is_name(&robot.name) {
            return Err(refuse(&format!("robots[{k}].name"), "is no ROS name".into(), help));
        }
        if let Some(other) = raw.robots[..k].iter().find(|other| other.name == robot.name) {
            let message = format!("two robots are called `{}`", other.name);
            return Err(refuse(&format!("robots[{k}].name"), message, "give each a name of its own"));
        }
        if let Some(other) = raw.robots[..k].iter().find(|other| other.place == robot.place) {
            let message = format!("`{}` and `{}` have the same place", other.name, robot.name);
            return Err(refuse(&format!("robots[{k}].place"), message, "give each a place of its own"));
        }
        if let Some(n) = repeated(&robot.neighbours) {
            let message = format!("`{}` has this neighbour already", robot.name);
            return Err(refuse(&format!("robots[{k}].neighbours[{n}]"), message, "name each once"));
        }
    }
    Ok(())
}

fn check_safety(raw: &RawSwarm, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let poses = &raw.poses;
    if let Some(fresh) = poses.fresh.filter(|&fresh| fresh > poses.age_limit) {
        let message =
            format!("a pose would be fresh for {fresh} s, longer than it is held ({} s)", poses.age_limit);
        return Err(refuse("poses.fresh", message, "raise poses.age_limit, or lower this"));
    }
    if poses.stop_after < poses.age_limit {
        let message = format!("a robot would be stopped before its pose is too old ({} s)", poses.age_limit);
        return Err(refuse("poses.stop_after", message, "give at least poses.age_limit"));
    }
    if raw.ranges.is_some() && raw.limits.speed.or(poses.jump_speed).is_none() {
        let message = "robots may move any way between a range and a pose, which then contradict nothing";
        return Err(refuse("ranges", message.into(), "give limits.speed, or poses.jump_speed"));
    }
    if poses.age_limit < raw.control.period {
        let message = format!("poses would be too old before the next period ({} s)", raw.control.period);
        return Err(refuse("poses.age_limit", message, "give several periods"));
    }
    for (k, obstacle) in raw.obstacles.iter().enumerate() {
        if let RawObstacle::Polygon { vertices } = obstacle
            && area(vertices).abs() == 0.0
        {
            let message = "the polygon has no area".into();
            return Err(refuse(&format!("obstacles[{k}].vertices"), message, "give its corners in order"));
        }
    }
    if let Some(fence) = raw.limits.geofence.as_ref().filter(|fence| area(*fence).abs() == 0.0) {
        let message = format!("the fence of {} corners holds no area", fence.len());
        return Err(refuse("limits.geofence", message, "give its corners in order"));
    }
    Ok(())
}

/// The first of these that is the same as one before it.
fn repeated<T: PartialEq>(all: &[T]) -> Option<usize> {
    (1..all.len()).find(|&n| all[..n].contains(&all[n]))
}

fn check_flight(raw: &RawSwarm, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let RawLimits { speed, acceleration, .. } = raw.limits;
    let needs = match raw.flight.model {
        RawModel::Ideal => None,
        RawModel::Integrator | RawModel::Unicycle { .. } => speed.is_none().then_some("limits.speed"),
        RawModel::DoubleIntegrator if speed.is_none() => Some("limits.speed"),
        RawModel::DoubleIntegrator => acceleration.is_none().then_some("limits.acceleration"),
    };
    if let Some(key) = needs {
        let message = "this model of a robot needs a limit".into();
        return Err(refuse(key, message, "give it, or use flight.model = { kind = \"ideal\" }"));
    }
    if let Some(key) = late(&raw.flight).filter(|_| raw.limits.clearance.is_some() && speed.is_none()) {
        let message = format!(
            "cannot be kept: by {key} poses come late or not at all, and without limits.speed a robot may be anywhere by \
             then"
        );
        let help = format!("give limits.speed, above what the programs ask for, or leave out {key}");
        return Err(refuse("limits.clearance", message, &help));
    }
    let starts: Vec<&String> = raw.flight.start.iter().map(|start| &start.robot).collect();
    if let Some(n) = repeated(&starts) {
        let message = format!("`{}` has a place to start at already", starts[n]);
        return Err(refuse(&format!("flight.start[{n}].robot"), message, "give each robot one"));
    }
    for (k, fault) in raw.flight.faults.iter().enumerate() {
        if fault.until.is_some_and(|until| until <= fault.at) {
            let message = format!("ends before it begins, at {} s", fault.at);
            return Err(refuse(&format!("flight.faults[{k}].until"), message, "give a later time"));
        }
    }
    Ok(())
}

/// The key by which the others may have no present pose of a robot.
fn late(flight: &RawFlight) -> Option<String> {
    let channel = [("delay", flight.delay > 0), ("jitter", flight.jitter > 0), ("loss", flight.loss > 0.0)];
    let is_late = |what: &RawCommandKind| matches!(what, RawCommandKind::Channel { delay, loss, .. } if *delay > 0 || *loss > 0.0);
    let own = channel.iter().find(|(_, is_late)| *is_late).map(|(key, _)| format!("flight.{key}"));
    own.or_else(|| {
        let command = flight.commands.iter().position(|command| is_late(&command.what))?;
        Some(format!("flight.commands[{command}]"))
    })
}

fn manoeuvres(raw: &RawSwarm, refuse: Refuse<'_>) -> Result<Vec<NamedManoeuvre>, SceneError> {
    let named = |(k, raw_one): (usize, &RawManoeuvre)| {
        if raw.manoeuvres[..k].iter().any(|other| other.name == raw_one.name) {
            let message = format!("two manoeuvres are called `{}`", raw_one.name);
            return Err(refuse(&format!("manoeuvres[{k}].name"), message, "give each a name of its own"));
        }
        let legs = raw_one.legs.iter().map(|leg| Leg {
            seconds: leg.seconds,
            hold: leg.hold,
            posture: Posture {
                translate: leg.translate,
                rotate: leg.rotate.to_radians(),
                stretch: leg.stretch,
                shear: leg.shear,
            },
        });
        Ok(NamedManoeuvre { name: raw_one.name.clone(), about: raw_one.about, legs: legs.collect() })
    };
    raw.manoeuvres.iter().enumerate().map(named).collect()
}
