//! The formation's state as a message.

use crate::flock::points::distance;
use crate::ros::messages::flockform_msgs::{FormationState, MemberState};
use crate::ros::messages::geometry_msgs::{Point, Vector3};
use crate::ros::messages::std_msgs::Header;
use crate::swarm::control::{Control, Mode, NEIGHBOUR_LOST, POSE_REJECTED, TRIMMED};
use crate::swarm::safety::Flags;
use crate::swarm::watch::Health;

/// What the last tick left, which took `elapsed` \[s\].
pub fn message(control: &Control, name: &str, header: Header, elapsed: f64) -> FormationState {
    let formation = control.formation();
    let measures = control.measures();
    let settled = control.settled();
    let mut clearances = Vec::new();
    control.clearance(&mut clearances);
    let members: Vec<MemberState> = (0..formation.count())
        .map(|m| {
            let position = control.position(m);
            let rest = settled.as_ref().map(|rest| rest.get(m));
            let place = formation.places.get(m);
            let strain = measures.strain[m];
            MemberState {
                name: formation.names[m].clone(),
                role: if formation.leads(m) { MemberState::LEADER } else { MemberState::FOLLOWER },
                health: health(control.health(m)),
                position: point(position),
                target: point(control.target(m)),
                settled: point(rest),
                displacement: vector(position.map(|[x, y]| [x - place[0], y - place[1]])),
                pe1: measures.pe1[m],
                strain: strain.map_or([f64::NAN; 3], |strain| strain.components),
                rotation: strain.map_or(f64::NAN, |strain| strain.rotation),
                age: control.age(m).unwrap_or(f64::INFINITY),
                clearance: clearances[m],
                to_settled: position.zip(rest).map_or(f64::NAN, |(position, rest)| distance(position, rest)),
                flags: flags(control.flags(m)),
            }
        })
        .collect();
    FormationState {
        header,
        formation: name.to_owned(),
        tick: control.ticks(),
        mode: match control.mode() {
            Mode::Running => FormationState::RUNNING,
            Mode::EmergencyStopped => FormationState::EMERGENCY_STOPPED,
            Mode::Inactive => FormationState::INACTIVE,
        },
        formation_error: control.formation_error().unwrap_or(f64::NAN),
        clearance: clearances.iter().copied().fold(f64::INFINITY, f64::min),
        pe1_sum: measures.pe1.iter().sum(),
        strain_max: measures.strain.iter().flatten().map(|strain| strain.largest()).fold(0.0, f64::max),
        elapsed,
        members,
    }
}

fn point(place: Option<[f64; 2]>) -> Point {
    let [x, y] = place.unwrap_or([f64::NAN; 2]);
    Point { x, y, z: if place.is_some() { 0.0 } else { f64::NAN } }
}

fn vector(way: Option<[f64; 2]>) -> Vector3 {
    let Point { x, y, z } = point(way);
    Vector3 { x, y, z }
}

fn health(health: Health) -> u8 {
    match health {
        Health::Waiting => MemberState::WAITING,
        Health::Fresh => MemberState::FRESH,
        Health::Held => MemberState::HELD,
        Health::Degraded => MemberState::DEGRADED,
        Health::Stopped => MemberState::STOPPED,
    }
}

/// The bits of the loop as those of the message.
fn flags(bits: u32) -> u32 {
    let pairs = [
        (Flags::SPEED_LIMITED, MemberState::SPEED_LIMITED),
        (Flags::ACCELERATION_LIMITED, MemberState::ACCELERATION_LIMITED),
        (Flags::GEOFENCED, MemberState::GEOFENCED),
        (Flags::SEPARATED, MemberState::SEPARATED),
        (Flags::OBSTRUCTED, MemberState::OBSTRUCTED),
        (Flags::RESOLVING_DEADLOCK, MemberState::RESOLVING_DEADLOCK),
        (NEIGHBOUR_LOST, MemberState::NEIGHBOUR_LOST),
        (TRIMMED, MemberState::TRIMMED),
        (POSE_REJECTED, MemberState::POSE_REJECTED),
    ];
    pairs.iter().filter(|(own, _)| bits & own != 0).map(|(_, wire)| wire).sum()
}
