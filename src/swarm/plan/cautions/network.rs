//! Warnings of what becomes of poses and ranges on their way, and of robots that are not heard.

use super::super::{DEVIATIONS_KEPT, largest_noise};
use crate::flock::rounding::at_most;
use crate::flock::vectors::distance;
use crate::scene::swarm::raw::{RawCommandKind, RawFaultKind, RawSwarm};
use crate::scene::text::decimals;
use crate::swarm::channel::ChannelParams;
use crate::swarm::control::Control;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::flight::Flight;
use crate::swarm::formation::{Formation, Lead};
use crate::swarm::safety::Limits;

/// What becomes of poses on their way, from the start or from a command on.
struct Network {
    /// Key of the file that has it.
    key: String,
    params: ChannelParams,
}

fn networks(raw: &RawSwarm) -> Vec<Network> {
    let begun = ChannelParams::of(&raw.flight);
    let first = Network { key: "flight".into(), params: begun };
    let commanded = raw.flight.commands.iter().enumerate().filter_map(|(k, command)| match command.what {
        RawCommandKind::Channel { noise, delay, loss } => {
            let params = ChannelParams { noise, delay, loss, ..begun };
            Some(Network { key: format!("flight.commands[{k}].what"), params })
        }
        _ => None,
    });
    std::iter::once(first).chain(commanded).collect()
}

/// All of them.
pub fn of(raw: &RawSwarm, flight: &Flight) -> Vec<String> {
    let formation = flight.control().formation();
    let networks = networks(raw);
    let of_each = networks.iter().flat_map(|network| {
        [network.noise(raw, formation), network.delay(raw), network.loss(), network.ranges(raw)]
    });
    let others = [silent(raw, flight), never_heard(raw, flight), unmeasured(raw, formation)];
    of_each.chain(others).flatten().collect()
}

impl Network {
    fn noise(&self, raw: &RawSwarm, formation: &Formation) -> Option<String> {
        let largest = largest_noise(formation, raw.limits.clearance)?;
        (!at_most(self.params.noise, largest)).then(|| {
            format!(
                "the noise takes up the space between robots at their places: the filter will hold some of them; lower \
                 {}.noise or limits.clearance, or space the robots out",
                self.key
            )
        })
    }

    fn delay(&self, raw: &RawSwarm) -> Option<String> {
        let Self { key, params: ChannelParams { delay, jitter, .. } } = self;
        let is_too_old =
            |periods: u32| !at_most(f64::from(periods) * raw.control.period, raw.poses.age_limit);
        if is_too_old(*delay) {
            return Some(format!(
                "poses are older than poses.age_limit when they arrive: no robot will get a target; lower {key}.delay or \
                 raise the limit"
            ));
        }
        is_too_old(delay + jitter).then(|| {
            format!(
                "jitter makes some poses older than poses.age_limit: robots will be lost for periods at a time; lower \
                 flight.jitter{} or raise the limit",
                if *key == "flight" { String::new() } else { format!(" or {key}.delay") }
            )
        })
    }

    fn loss(&self) -> Option<String> {
        let key = &self.key;
        (self.params.loss >= 1.0)
            .then(|| format!("every pose is lost: no robot will get a target; lower {key}.loss"))
    }

    /// Ranges that contradict honest poses: their own noise along the way, and that of both poses.
    fn ranges(&self, raw: &RawSwarm) -> Option<String> {
        let ranges = raw.ranges.as_ref()?;
        let off = DEVIATIONS_KEPT * (ranges.noise.powi(2) + 2.0 * self.params.noise.powi(2)).sqrt();
        (!at_most(off, ranges.tolerance)).then(|| {
            format!(
                "ranges.noise and {}.noise together, at three deviations {} m, are above ranges.tolerance: honest \
                 robots will be taken for liars; lower them, or raise the tolerance",
                self.key,
                decimals(off, 3)
            )
        })
    }
}

/// Poses of real robots are always late, if only by their way through the network.
pub fn late_without_speed(limits: &Limits) -> Option<&'static str> {
    (limits.keeps_apart && limits.speed.is_infinite()).then_some(
        "limits.clearance without limits.speed holds for poses of now alone, and those of real robots are late: give \
         limits.speed",
    )
}

/// Cautions where a node flies robots, whose poses are late and inexact, or some of them.
pub fn of_real_robots(control: &Control, part: &NodeScope) -> impl Iterator<Item = &'static str> {
    let limits = control.limits();
    [late_without_speed(limits), exact_poses(limits), own_time(control.formation(), part)]
        .into_iter()
        .flatten()
}

/// The time of the leaders' programs, which a node keeps by itself.
fn own_time(formation: &Formation, part: &NodeScope) -> Option<&'static str> {
    let has_program =
        |&m: &usize| matches!(formation.lead(m), Some(Lead::Motion { .. } | Lead::Manoeuvre { .. }));
    (part.mine.len() < formation.count() && part.mine.iter().any(has_program)).then_some(
        "the time of this leader's program is its node's own: it begins when that hears the robots, anew whenever the node is \
         started again, and the nodes of other leaders have another; start all nodes before the robots, or let a program of \
         kind \"external\" lead",
    )
}

/// Caution where simulated robots are moved by nodes, which do nothing at a given time.
pub fn of_simulated_robots(raw: &RawSwarm) -> Option<&'static str> {
    (!raw.flight.commands.is_empty()).then_some(
        "flight.commands are done by `flockform swarm` and `flockform live` alone: here they have no effect",
    )
}

/// The velocity of a robot that takes time to brake follows from its poses.
fn exact_poses(limits: &Limits) -> Option<&'static str> {
    (limits.braking().is_some() && limits.deviation == 0.0).then_some(
        "flight.noise = 0 says that poses are exact, and those of real robots are not: where the model \"double-integrator\" \
         flies them, give flight.noise the standard deviation of their poses",
    )
}

/// Robots that move on unheard, at any speed.
fn silent(raw: &RawSwarm, flight: &Flight) -> Option<String> {
    use RawFaultKind::{NotANumber, Silent, WrongFrame};
    late_without_speed(flight.control().limits())?;
    let fault = raw.flight.faults.iter().find(|one| matches!(one.what, Silent | NotANumber | WrongFrame))?;
    Some(format!(
        "how far `{}` goes once it is not heard is unknown: no clearance from it is kept; give limits.speed",
        fault.robot
    ))
}

fn never_heard(raw: &RawSwarm, flight: &Flight) -> Option<String> {
    use RawFaultKind::{Dead, NotANumber, Silent, WrongFrame};
    let formation = flight.control().formation();
    let end = flight.periods() as f64 * raw.control.period;
    let is_mute = |member: usize| {
        raw.flight.faults.iter().any(|fault| {
            formation.number(&fault.robot) == Some(member)
                && matches!(fault.what, Dead | NotANumber | Silent | WrongFrame)
                && fault.at <= 0.0
                && fault.until.is_none_or(|until| at_most(end, until))
        })
    };
    let names = formation.named(|m| formation.leads(m) && is_mute(m))?;
    Some(format!(
        "the leaders' programs will not begin, for these leaders are never heard: {names}; let their faults begin later, or end"
    ))
}

/// Robots whose poses too few others measure to contradict them.
fn unmeasured(raw: &RawSwarm, formation: &Formation) -> Option<String> {
    let ranges = raw.ranges.as_ref()?;
    let near = |m: usize| {
        let apart = |other: &usize| distance(formation.places.get(m), formation.places.get(*other));
        (0..formation.count()).filter(|other| *other != m && apart(other) <= ranges.reach).count()
    };
    let names = formation.named(|m| near(m) <= ranges.max_faulty)?;
    Some(format!(
        "no more than ranges.max_faulty robots are within ranges.reach of {names}: lies of these robots are never found; \
         lower the one or raise the other"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::examples::bundled;

    #[test]
    fn the_node_of_one_leader_keeps_a_time_of_its_own_for_its_program() {
        let cautions = |overrides: &[&str], member: Option<usize>| {
            let swarm = bundled("square", overrides);
            let mut control = Control::new(&swarm).expect("laid out");
            let part = NodeScope::restrict(&swarm, &mut control, member);
            of_real_robots(&control, &part).collect::<Vec<_>>()
        };
        let alone = "control.sweeps=1";
        assert!(matches!(cautions(&[alone], Some(0))[..], [one] if one.contains("own")));
        let external = "leaders[0].program={ kind = \"external\" }";
        for (overrides, member) in [(&[alone][..], None), (&[alone], Some(6)), (&[alone, external], Some(0))]
        {
            assert_eq!(cautions(overrides, member), [""; 0], "{overrides:?}, {member:?}");
        }
    }
}
