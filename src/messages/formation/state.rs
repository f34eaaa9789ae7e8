//! The formation's state as a message.

use crate::messages::flockform_msgs::{FormationState, MemberState};
use crate::messages::geometry_msgs::{Point, Vector3};
use crate::messages::std_msgs::Header;
use crate::swarm::control::Control;
use crate::swarm::control::state::FormationState as State;

/// The state after the last tick, which took `elapsed` \[s\].
pub fn message(control: &Control, name: &str, header: Header, elapsed: f64) -> FormationState {
    let state = State::of(control);
    let names = &control.formation().names;
    let members = state.members.iter().zip(names).map(|(member, name)| MemberState {
        name: name.clone(),
        role: if member.leads { MemberState::LEADER } else { MemberState::FOLLOWER },
        health: member.health.number(),
        position: point(member.position),
        target: point(member.target),
        settled: point(member.settled),
        displacement: vector(member.displacement),
        pe1: member.pe1,
        strain: member.strain.unwrap_or([f64::NAN; 3]),
        rotation: member.rotation.unwrap_or(f64::NAN),
        age: member.age.unwrap_or(f64::INFINITY),
        clearance: member.clearance,
        to_settled: member.to_settled().unwrap_or(f64::NAN),
        flags: member.flags,
    });
    FormationState {
        header,
        formation: name.to_owned(),
        tick: state.tick,
        mode: state.mode.number(),
        formation_error: state.formation_error.unwrap_or(f64::NAN),
        clearance: state.clearance,
        pe1_sum: state.pe1_sum,
        strain_max: state.strain_max,
        elapsed,
        members: members.collect(),
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
