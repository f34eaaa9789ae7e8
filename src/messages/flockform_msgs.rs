//! `flockform_msgs`: our own messages; meaning, units and frames are in `msgs/flockform_msgs`.

use serde::{Deserialize, Serialize};

use super::geometry_msgs::{Point, Vector3};
use super::std_msgs::Header;
use super::{messages, service};
use crate::swarm::control::Mode;
use crate::swarm::safety::Flags;
use crate::swarm::watch::Health;

/// The state of one member, as the formation's node knows it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MemberState {
    pub name: String,
    /// [`MemberState::LEADER`] or [`MemberState::FOLLOWER`].
    pub role: u8,
    /// [`MemberState::WAITING`] to [`MemberState::STOPPED`].
    pub health: u8,
    /// \[m\]; NaN while no pose has come.
    pub position: Point,
    /// After the safety filter \[m\]; NaN while it is sent nowhere.
    pub target: Point,
    /// Where the rule comes to rest with the leaders as they are \[m\]; NaN where not known.
    pub settled: Point,
    /// From the nominal place \[m\].
    pub displacement: Vector3,
    /// \[m^2\].
    pub pe1: f64,
    /// xx, yy, xy \[1\].
    pub strain: [f64; 3],
    /// \[rad\].
    pub rotation: f64,
    /// Of the pose \[s\].
    pub age: f64,
    /// To the nearest robot or obstacle, hull to hull \[m\].
    pub clearance: f64,
    /// From position to settled \[m\].
    pub to_settled: f64,
    /// Sum of [`MemberState::SPEED_LIMITED`] to [`MemberState::POSE_REJECTED`].
    pub flags: u32,
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

/// How a formation is, once a tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FormationState {
    pub header: Header,
    pub formation: String,
    pub tick: u64,
    /// [`FormationState::RUNNING`] to [`FormationState::INACTIVE`].
    pub mode: u8,
    /// \[m\].
    pub formation_error: f64,
    /// Smallest of the members' \[m\].
    pub clearance: f64,
    /// \[m^2\].
    pub pe1_sum: f64,
    /// Principal strain largest in size \[1\].
    pub strain_max: f64,
    /// Time that computing the tick took \[s\].
    pub elapsed: f64,
    pub members: Vec<MemberState>,
}

impl FormationState {
    pub const RUNNING: u8 = Mode::Running.number();
    pub const HOLDING: u8 = 1;
    pub const EMERGENCY_STOPPED: u8 = Mode::EmergencyStopped.number();
    pub const INACTIVE: u8 = Mode::Inactive.number();
}

/// The inputs of a formation's loop besides poses, and its ticks: for recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopEvent {
    pub header: Header,
    /// [`LoopEvent::TICK`] to [`LoopEvent::CONFIGURE`].
    pub kind: u8,
    pub text: String,
    pub values: Vec<f64>,
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

/// Distances that a robot measured of others at the header's stamp.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    pub header: Header,
    /// Names of the others.
    pub robots: Vec<String>,
    /// \[m\], in the order of `robots`.
    pub distances: Vec<f64>,
}

messages!("flockform_msgs": MemberState, FormationState, LoopEvent, Ranges);

/// Request of the service `SetFormation`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetFormationRequest {
    /// A manoeuvre of the swarm file; empty for the numbers below.
    pub name: String,
    /// From the nominal place \[m\].
    pub translate: [f64; 2],
    /// \[rad\].
    pub rotate: f64,
    /// \[1\].
    pub stretch: [f64; 2],
    /// \[1\].
    pub shear: [f64; 2],
    /// \[s\].
    pub duration: f64,
}

/// Response of the service `SetFormation`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetFormationResponse {
    pub success: bool,
    pub message: String,
}

service!(
    /// Moves the leaders.
    SetFormation, "flockform_msgs", SetFormationRequest => SetFormationResponse
);
