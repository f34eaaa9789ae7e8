//! The content of shared memory: plain structs in C's layout, the same for every language.
//!
//! A type's name ends in its version. Any change of a field's meaning, order or type is a new version: iceoryx2
//! distinguishes types by name, size and alignment alone.

use iceoryx2::prelude::ZeroCopySend;

use crate::swarm::control::Mode;

/// An element of a slice, known to peers by name.
pub trait Payload: ZeroCopySend + Copy + std::fmt::Debug + 'static {
    /// As peers name it.
    const NAME: &str;
}

macro_rules! payload {
    ($($(#[$doc:meta])* $name:ident as $wire:literal { $($(#[$field_doc:meta])* $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
            #[repr(C)]
            #[type_name($wire)]
            pub struct $name { $($(#[$field_doc])* pub $field: $kind,)* }

            impl Payload for $name {
                const NAME: &str = $wire;
            }
        )*
    };
}

payload! {
    /// Goes with every slice.
    Header as "FlockformHeader_v1" {
        /// Slices that this sender sent before this one \[1\].
        sequence: u64,
        /// Step of the body, or tick of the loop.
        step: u64,
        /// When it was sent \[s since the Unix epoch\].
        stamp: f64,
    }

    /// The pose of a robot.
    Pose as "FlockformPose_v1" {
        /// Number of the robot in the swarm file's order, from 0.
        member: u32,
        /// 0: in the swarm's frame; anything else is turned away.
        frame: u32,
        /// \[m, world frame\]
        position: [f64; 2],
        /// Heading from the x axis \[rad\].
        yaw: f64,
        /// When it was measured \[s since the Unix epoch\]; 0: when it arrives.
        stamp: f64,
    }

    /// A distance that one robot measured of another.
    Range as "FlockformRange_v1" {
        /// Number of the robot that measured, in the swarm file's order, from 0.
        observer: u32,
        /// Number of the robot that was measured.
        of: u32,
        /// Centre to centre \[m\].
        distance: f64,
        /// When it was measured \[s since the Unix epoch\]; 0: when it arrives.
        stamp: f64,
    }

    /// The next target of a robot.
    Target as "FlockformTarget_v1" {
        /// Number of the robot in the swarm file's order, from 0.
        member: u32,
        /// Padding to eight bytes: 0.
        reserved: u32,
        /// After the safety filter \[m, world frame\].
        position: [f64; 2],
        /// Heading to take \[rad\].
        yaw: f64,
    }

    /// The target of a leader that is moved from outside.
    Leader as "FlockformLeader_v1" {
        /// Number of the robot in the swarm file's order, from 0.
        member: u32,
        /// Padding to eight bytes: 0.
        reserved: u32,
        /// \[m, world frame\]
        position: [f64; 2],
    }

    /// A command to the node.
    Command as "FlockformCommand_v1" {
        /// [`Command::EMERGENCY_STOP`] or [`Command::RESUME`].
        kind: u32,
        /// Padding to eight bytes: 0.
        reserved: u32,
    }

    /// How a formation is; NaN for what is not known.
    Formation as "FlockformFormation_v1" {
        /// [`Formation::RUNNING`] to [`Formation::INACTIVE`], as in `flockform_msgs/FormationState`.
        mode: u32,
        /// Number of members.
        members: u32,
        /// \[m\]
        formation_error: f64,
        /// Smallest of the members' \[m\].
        clearance: f64,
        /// \[m^2\]
        pe1_sum: f64,
        /// Principal strain largest in size \[1\].
        strain_max: f64,
        /// Time that computing the tick took \[s\].
        elapsed: f64,
    }

    /// How one robot is; fields and codes as in `flockform_msgs/MemberState`, NaN for what is not known.
    Member as "FlockformMember_v1" {
        /// Number of the robot in the swarm file's order, from 0.
        member: u32,
        /// 0 leader, 1 follower.
        role: u32,
        /// 0 waiting, 1 fresh, 2 held, 3 degraded, 4 stopped.
        health: u32,
        /// Bits of `flockform_msgs/MemberState`.
        flags: u32,
        /// \[m, world frame\]
        position: [f64; 2],
        /// \[m, world frame\]
        target: [f64; 2],
        /// Where the rule comes to rest with the leaders as they are \[m, world frame\].
        settled: [f64; 2],
        /// From the nominal place \[m\].
        displacement: [f64; 2],
        /// \[m^2\]
        pe1: f64,
        /// xx, yy, xy \[1\].
        strain: [f64; 3],
        /// \[rad\]
        rotation: f64,
        /// Of the pose \[s\].
        age: f64,
        /// To the nearest robot or obstacle, hull to hull \[m\].
        clearance: f64,
        /// From position to settled \[m\].
        to_settled: f64,
        /// UTF-8, cut to fit, zeros behind it.
        name: [u8; 64],
    }

    /// One particle of a body.
    Particle as "FlockformParticle_v1" {
        /// Id in scenes and outputs, from 1.
        id: u32,
        /// 0 follower, 1 leader, 2 clamped, 3 frame, 4 ghost.
        role: u32,
        /// \[length unit of the scene, world frame\]
        position: [f64; 2],
    }
}

/// iceoryx2 asks for one; a slice's header always gets its values.
impl Default for Header {
    fn default() -> Self {
        Self { sequence: 0, step: 0, stamp: 0.0 }
    }
}

impl Command {
    /// Every robot is to hold its place until [`Command::RESUME`].
    pub const EMERGENCY_STOP: u32 = 1;
    /// The formation is to go on.
    pub const RESUME: u32 = 2;

    /// A command of this kind.
    pub fn new(kind: u32) -> Self {
        Self { kind, reserved: 0 }
    }
}

impl Formation {
    /// Members get targets by the rule.
    pub const RUNNING: u32 = Mode::Running.number() as u32;
    /// Every member holds its place.
    pub const EMERGENCY_STOPPED: u32 = Mode::EmergencyStopped.number() as u32;
    /// No member gets a target.
    pub const INACTIVE: u32 = Mode::Inactive.number() as u32;
}

impl Member {
    /// The name as text.
    pub fn name(&self) -> &str {
        let end = self.name.iter().position(|&byte| byte == 0).unwrap_or(self.name.len());
        std::str::from_utf8(&self.name[..end]).unwrap_or_default()
    }

    /// A name as it lies in memory.
    pub(crate) fn name_of(name: &str) -> [u8; 64] {
        let mut bytes = [0; 64];
        let cut = (0..=name.len().min(64)).rev().find(|&at| name.is_char_boundary(at)).unwrap_or(0);
        bytes[..cut].copy_from_slice(&name.as_bytes()[..cut]);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The layout that peers in other languages rely on.
    #[test]
    fn layouts_are_those_that_peers_were_written_for() {
        use std::mem::{offset_of, size_of};
        let sizes = [
            size_of::<Header>(),
            size_of::<Pose>(),
            size_of::<Range>(),
            size_of::<Target>(),
            size_of::<Leader>(),
            size_of::<Command>(),
            size_of::<Formation>(),
            size_of::<Member>(),
            size_of::<Particle>(),
        ];
        assert_eq!(sizes, [24, 40, 24, 32, 24, 8, 48, 208, 24]);
        assert_eq!((offset_of!(Pose, position), offset_of!(Pose, stamp)), (8, 32));
        assert_eq!((offset_of!(Member, position), offset_of!(Member, name)), (16, 144));
    }

    #[test]
    fn a_name_that_is_too_long_is_cut_between_characters() {
        let long = "ü".repeat(40);
        let member = Member::name_of(&format!("a{long}"));
        let text = std::str::from_utf8(&member).expect("whole characters");
        assert_eq!(text.trim_end_matches('\0'), format!("a{}", "ü".repeat(31)));
    }
}
