//! Faults of robots, each with its member and time span.

use crate::flock::rounding::at_most;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawFaultKind;
use crate::swarm::formation::Formation;

#[derive(Clone, Debug)]
pub struct Fault {
    pub member: usize,
    /// \[s\]
    from: f64,
    /// \[s\]
    until: f64,
    pub kind: RawFaultKind,
}

impl Fault {
    /// A fault that lasts.
    pub fn from_now(member: usize, now: f64, kind: RawFaultKind) -> Self {
        Self { member, from: now, until: f64::INFINITY, kind }
    }

    /// Ends it, if it has begun.
    pub fn end(&mut self, now: f64) {
        if self.holds(now) {
            self.until = now;
        }
    }

    pub fn has_begun(&self, now: f64) -> bool {
        at_most(self.from, now)
    }

    /// Its kind.
    pub fn name(&self) -> &'static str {
        match self.kind {
            RawFaultKind::Silent => "silent",
            RawFaultKind::Dead => "dead",
            RawFaultKind::Stuck => "stuck",
            RawFaultKind::Offset { .. } => "offset",
            RawFaultKind::Frozen => "frozen",
            RawFaultKind::Random { .. } => "random",
            RawFaultKind::NotANumber => "not-a-number",
            RawFaultKind::WrongFrame => "wrong-frame",
        }
    }

    pub fn holds(&self, now: f64) -> bool {
        lasts([self.from, self.until], now)
    }

    /// Whether the robot stands still.
    pub fn stands(&self) -> bool {
        matches!(self.kind, RawFaultKind::Dead | RawFaultKind::Stuck)
    }

    /// Whether the robot sends nothing.
    pub fn is_mute(&self) -> bool {
        matches!(self.kind, RawFaultKind::Silent | RawFaultKind::Dead)
    }
}

/// Whether a time is in a span, the end of which is not.
pub fn lasts([from, until]: [f64; 2], now: f64) -> bool {
    at_most(from, now) && !at_most(until, now)
}

/// The faults of a swarm, in the order of the file.
pub fn of(swarm: &Swarm, formation: &Formation) -> Result<Vec<Fault>, SceneError> {
    let fault = |(k, raw): (usize, &crate::scene::swarm::raw::RawFault)| {
        let member = formation.require(swarm, &format!("flight.faults[{k}].robot"), &raw.robot)?;
        let until = raw.until.unwrap_or(f64::INFINITY);
        Ok(Fault { member, from: raw.at, until, kind: raw.what.clone() })
    };
    swarm.raw.flight.faults.iter().enumerate().map(fault).collect()
}
