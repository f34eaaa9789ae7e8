//! Builds the loop's parts from the swarm file: limits, obstacles, conditions on poses.

use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawFlight, RawLimits, RawModel, RawObstacle};
use crate::swarm::formation::Formation;
use crate::swarm::safety::{Filter, Limits, Obstacle, Obstacles, Place, SafetyError};
use crate::swarm::watch::{RangeLimits, WatchLimits};

/// The number of faulty robots to be tolerated among a member's neighbours.
///
/// # Errors
/// Names the member that does not have the neighbours for it.
pub fn max_faulty(swarm: &Swarm, formation: &Formation) -> Result<usize, SceneError> {
    let max_faulty = swarm.raw.resilience.as_ref().map_or(0, |resilience| resilience.max_faulty_neighbours);
    if max_faulty == 0 {
        return Ok(0);
    }
    formation.require_support(max_faulty).map_err(|unsupported| {
        let help =
            "lower it, or leave [resilience] out, widen the neighbourhood, or make more robots leaders";
        swarm.refuse("resilience.max_faulty_neighbours", unsupported, help)
    })?;
    if formation.affine(0.0).is_some() {
        tracing::warn!(
            "robots that leave out straying neighbours follow a common displacement exactly; a formation that is \
             turned, stretched or sheared loses its shape somewhat"
        );
    }
    Ok(max_faulty)
}

/// Refuses leaders that are moved from outside in a swarm that accepts no such commands.
///
/// # Errors
/// Names the key.
pub fn check_commands(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let commands = swarm.raw.node.commands;
    match formation.moved().next() {
        Some(leader) if !commands.may_do_all() => {
            let name = &formation.names[leader];
            let what =
                format!("\"{}\" forbids commands to `{name}`, whose program is external", commands.name());
            Err(swarm.refuse("node.commands", what, "give the leader a program of its own, or allow \"all\""))
        }
        _ => Ok(()),
    }
}

/// The conditions on poses; no robot is assumed faster than the speed limit unless the file states it.
pub fn watch(swarm: &Swarm, formation: &Formation, speed: f64) -> WatchLimits {
    let (poses, period) = (&swarm.raw.poses, swarm.raw.control.period);
    WatchLimits {
        fresh: poses.fresh.unwrap_or((3.0 * period).min(poses.age_limit)),
        age_limit: poses.age_limit,
        stop_after: poses.stop_after,
        centre: formation.middle(),
        range: poses.range,
        jump_speed: poses.jump_speed.unwrap_or(speed),
        recover: u32::try_from(poses.recover).unwrap_or(u32::MAX),
        period: Some(period),
        ranges: swarm
            .raw
            .ranges
            .as_ref()
            .map(|ranges| RangeLimits { tolerance: ranges.tolerance, max_faulty: ranges.max_faulty }),
        ..WatchLimits::default()
    }
}

fn limits(raw: &RawLimits, flight: &RawFlight) -> Limits {
    Limits {
        brakes: matches!(flight.model, RawModel::DoubleIntegrator),
        arrives: matches!(flight.model, RawModel::Ideal),
        deviation: flight.noise,
        speed: raw.speed.unwrap_or(f64::INFINITY),
        acceleration: raw.acceleration.unwrap_or(f64::INFINITY),
        keeps_apart: raw.clearance.is_some(),
        clearance: raw.clearance.unwrap_or(0.0),
        geofence: raw.geofence.clone(),
        ..Limits::default()
    }
}

pub fn filter(swarm: &Swarm, formation: &Formation) -> Result<Filter, SceneError> {
    let limits = limits(&swarm.raw.limits, &swarm.raw.flight);
    let obstacles: Vec<Obstacle> = swarm
        .raw
        .obstacles
        .iter()
        .map(|obstacle| match obstacle {
            RawObstacle::Polygon { vertices } => Obstacle::Polygon(vertices.clone()),
            RawObstacle::Disc { centre, radius } => Obstacle::Disc { centre: *centre, radius: *radius },
        })
        .collect();
    let refuse = |error: SafetyError| {
        let key = match error.place {
            Place::Limit(name) => format!("limits.{name}"),
            Place::Radius(_) => "radius".into(),
            Place::Geofence => "limits.geofence".into(),
            Place::Obstacle(k) => format!("obstacles[{k}]"),
        };
        swarm.refuse(&key, error.to_string(), "correct the swarm file")
    };
    let obstacles = Obstacles::new(&obstacles).map_err(refuse)?;
    Filter::new(limits, formation.radii.clone(), obstacles).map_err(refuse)
}
