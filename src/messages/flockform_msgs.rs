//! `flockform_msgs`: our own messages; meaning, units and frames are in `msgs/flockform_msgs`.

use super::geometry_msgs::{Point, Vector3};
use super::std_msgs::Header;
use super::{messages, services, structs};
use crate::swarm::control::Mode;
use crate::swarm::safety::Flags;
use crate::swarm::watch::Health;

messages! { "flockform_msgs";
    /// The state of one member, as the formation's node knows it.
    MemberState {
        name: String,
        /// [`MemberState::LEADER`] or [`MemberState::FOLLOWER`].
        role: u8,
        /// [`MemberState::WAITING`] to [`MemberState::STOPPED`].
        health: u8,
        /// \[m\]; NaN while no pose has come.
        position: Point,
        /// After the safety filter \[m\]; NaN while it is sent nowhere.
        target: Point,
        /// Where the rule comes to rest with the leaders as they are \[m\]; NaN where not known.
        settled: Point,
        /// From the nominal place \[m\].
        displacement: Vector3,
        /// \[m^2\].
        pe1: f64,
        /// xx, yy, xy \[1\].
        strain: [f64; 3],
        /// \[rad\].
        rotation: f64,
        /// Of the pose \[s\].
        age: f64,
        /// To the nearest robot or obstacle, hull to hull \[m\].
        clearance: f64,
        /// From position to settled \[m\].
        to_settled: f64,
        /// Sum of [`MemberState::SPEED_LIMITED`] to [`MemberState::POSE_REJECTED`].
        flags: u32,
    }

    /// How a formation is, once a tick.
    FormationState {
        header: Header,
        formation: String,
        tick: u64,
        /// [`FormationState::RUNNING`] to [`FormationState::INACTIVE`].
        mode: u8,
        /// \[m\].
        formation_error: f64,
        /// Smallest of the members' \[m\].
        clearance: f64,
        /// \[m^2\].
        pe1_sum: f64,
        /// Principal strain largest in size \[1\].
        strain_max: f64,
        /// Time that computing the tick took \[s\].
        elapsed: f64,
        members: Vec<MemberState>,
    }

    /// The inputs of a formation's loop besides poses, and its ticks: for recordings.
    LoopEvent {
        header: Header,
        /// [`LoopEvent::TICK`] to [`LoopEvent::CONFIGURE`].
        kind: u8,
        text: String,
        values: Vec<f64>,
    }

    /// Distances that a robot measured of others at the header's stamp.
    Ranges {
        header: Header,
        /// Names of the others.
        robots: Vec<String>,
        /// \[m\], in the order of `robots`.
        distances: Vec<f64>,
    }
}

impl MemberState {
    pub const LEADER: u8 = 0;
    pub const FOLLOWER: u8 = 1;

    pub const WAITING: u8 = Health::Waiting.number();
    pub const FRESH: u8 = Health::Fresh.number();
    pub const HELD: u8 = Health::Held.number();
    pub const DEGRADED: u8 = Health::Degraded.number();
    pub const STOPPED: u8 = Health::Stopped.number();

    pub const SPEED_LIMITED: u32 = Flags::SPEED_LIMITED;
    pub const ACCELERATION_LIMITED: u32 = Flags::ACCELERATION_LIMITED;
    pub const GEOFENCED: u32 = Flags::GEOFENCED;
    pub const SEPARATED: u32 = Flags::SEPARATED;
    pub const OBSTRUCTED: u32 = Flags::OBSTRUCTED;
    pub const RESOLVING_DEADLOCK: u32 = Flags::RESOLVING_DEADLOCK;
    pub const NEIGHBOUR_LOST: u32 = Flags::NEIGHBOUR_LOST;
    pub const TRIMMED: u32 = Flags::TRIMMED;
    pub const POSE_REJECTED: u32 = Flags::POSE_REJECTED;
}

impl FormationState {
    pub const RUNNING: u8 = Mode::Running.number();
    pub const HOLDING: u8 = 1;
    pub const EMERGENCY_STOPPED: u8 = Mode::EmergencyStopped.number();
    pub const INACTIVE: u8 = Mode::Inactive.number();
}

impl LoopEvent {
    pub const TICK: u8 = 0;
    pub const ACTIVE: u8 = 1;
    pub const INACTIVE: u8 = 2;
    pub const EMERGENCY_STOP: u8 = 3;
    pub const RESUME: u8 = 4;
    pub const MANOEUVRE: u8 = 5;
    pub const POSTURE: u8 = 6;
    pub const PARAMETER: u8 = 7;
    pub const CONFIGURE: u8 = 8;
}

structs! {
    /// Request of the service `SetFormation`.
    SetFormationRequest {
        /// A manoeuvre of the swarm file; empty for the numbers below.
        name: String,
        /// From the nominal place \[m\].
        translate: [f64; 2],
        /// \[rad\].
        rotate: f64,
        /// \[1\].
        stretch: [f64; 2],
        /// \[1\].
        shear: [f64; 2],
        /// \[s\].
        duration: f64,
    }

    /// Response of the service `SetFormation`.
    SetFormationResponse { success: bool, message: String }
}

services! { "flockform_msgs";
    /// Moves the leaders.
    SetFormation: SetFormationRequest => SetFormationResponse;
}
