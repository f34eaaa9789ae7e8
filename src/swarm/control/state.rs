//! The state after the last tick, as every edge publishes it.

use super::{Control, Mode};
use crate::flock::vectors::distance;
use crate::swarm::safety::Flags;
use crate::swarm::watch::Health;

/// The state of the formation.
#[derive(Clone, Debug)]
pub struct FormationState {
    /// Ticks since the loop began.
    pub tick: u64,
    /// The loop's way with targets.
    pub mode: Mode,
    /// \[m\]; absent where the rule has no single place of rest.
    pub formation_error: Option<f64>,
    /// Smallest of the members' \[m\].
    pub clearance: f64,
    /// \[m^2\].
    pub pe1_sum: f64,
    /// Principal strain largest in size \[1\].
    pub strain_max: f64,
    /// By number, shape \[members\].
    pub members: Vec<MemberState>,
}

/// The state of one member. Positions in \[m, world frame\].
#[derive(Clone, Copy, Debug)]
pub struct MemberState {
    /// Whether it leads at present.
    pub leads: bool,
    /// How young its pose is.
    pub health: Health,
    /// Last known place; absent until a pose was believed.
    pub position: Option<[f64; 2]>,
    /// After the safety filter.
    pub target: Option<[f64; 2]>,
    /// Place of rest by the rule with the leaders as they are.
    pub settled: Option<[f64; 2]>,
    /// From the nominal place \[m\].
    pub displacement: Option<[f64; 2]>,
    /// \[m^2\].
    pub pe1: f64,
    /// xx, yy, xy \[1\]; absent for members with too few neighbours.
    pub strain: Option<[f64; 3]>,
    /// \[rad\].
    pub rotation: Option<f64>,
    /// Age of the pose \[s\].
    pub age: Option<f64>,
    /// To the nearest robot or obstacle, hull to hull \[m\].
    pub clearance: f64,
    /// Bits of [`published_flags`].
    pub flags: u32,
}

impl MemberState {
    /// From position to settled \[m\].
    pub fn to_settled(&self) -> Option<f64> {
        self.position.zip(self.settled).map(|(position, settled)| distance(position, settled))
    }
}

impl FormationState {
    /// The state after the loop's last tick.
    pub fn of(control: &Control) -> Self {
        let formation = control.formation();
        let measures = control.measures();
        let settled = control.settled();
        let mut clearances = Vec::new();
        control.clearance(&mut clearances);
        let member = |m: usize| {
            let position = control.position(m);
            let [px, py] = formation.places.get(m);
            let strain = measures.strain[m];
            MemberState {
                leads: formation.leads(m),
                health: control.health(m),
                position,
                target: control.target(m),
                settled: settled.as_ref().map(|rest| rest.get(m)),
                displacement: position.map(|[x, y]| [x - px, y - py]),
                pe1: measures.pe1[m],
                strain: strain.map(|strain| strain.components),
                rotation: strain.map(|strain| strain.rotation),
                age: control.age(m),
                clearance: clearances[m],
                flags: published_flags(control.flags(m)),
            }
        };
        Self {
            tick: control.ticks(),
            mode: control.mode(),
            formation_error: control.formation_error(),
            clearance: clearances.iter().copied().fold(f64::INFINITY, f64::min),
            pe1_sum: measures.pe1.iter().sum(),
            strain_max: measures.strain.iter().flatten().map(|strain| strain.largest()).fold(0.0, f64::max),
            members: (0..formation.count()).map(member).collect(),
        }
    }
}

/// The bits that `flockform_msgs/MemberState` and the shared memory have.
const PUBLISHED: u32 = Flags::SPEED_LIMITED
    | Flags::ACCELERATION_LIMITED
    | Flags::GEOFENCED
    | Flags::SEPARATED
    | Flags::OBSTRUCTED
    | Flags::RESOLVING_DEADLOCK
    | Flags::NEIGHBOUR_LOST
    | Flags::TRIMMED
    | Flags::POSE_REJECTED;

/// The loop's bits as they are published.
pub fn published_flags(bits: u32) -> u32 {
    bits & PUBLISHED
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::examples::bundled;
    use crate::swarm::safety::Limits;

    #[test]
    fn a_period_or_a_damping_that_is_none_changes_nothing() {
        let mut control = Control::new(&bundled("square", &[])).expect("laid out");
        let before = (control.period(), control.damping());
        for none in [f64::NAN, f64::INFINITY, -0.1] {
            assert!(!control.set_period(none) && !control.set_damping(none), "{none}");
        }
        assert!(!control.set_period(0.0) && !control.set_damping(2.1));
        assert_eq!((control.period(), control.damping()), before);
        assert!(!control.place_leader(99, [0.0; 2]), "no such member");
        assert!(control.set_period(0.2) && control.set_damping(0.5));
        assert_eq!((control.period(), control.damping()), (0.2, 0.5));
    }

    #[test]
    fn members_do_not_begin_to_brake_on_the_way() {
        let mut control = Control::new(&bundled("square", &[])).expect("laid out");
        let limits = Limits { brakes: true, acceleration: 0.5, ..control.limits().clone() };
        assert!(control.set_limits(limits.clone()).is_err());
        let slower = Limits { acceleration: 0.5, ..control.limits().clone() };
        assert!(control.set_limits(slower).is_ok(), "without braking by themselves");
        let file = ["flight.model={ kind = \"double-integrator\" }", "limits.acceleration=0.5"];
        let mut control = Control::new(&bundled("square", &file)).expect("laid out");
        for acceleration in [f64::INFINITY, 0.4] {
            let limits = Limits { acceleration, ..control.limits().clone() };
            assert!(control.set_limits(limits).is_err(), "{acceleration}");
        }
        let limits = Limits { speed: 0.1, ..control.limits().clone() };
        assert!(control.set_limits(limits).is_ok());
    }

    #[test]
    fn the_flags_of_the_filter_and_of_the_loop_are_published_in_one_order() {
        assert_eq!(published_flags(u32::MAX), 0b1_1111_1111, "nine flags, each a bit of its own");
        assert_eq!(published_flags(Flags::SPEED_LIMITED | Flags::POSE_REJECTED), 1 | 256);
        assert_eq!(published_flags(Flags::HELD), 0, "what is no bit of the messages is not published");
    }
}
