//! How the loop fares, for `/diagnostics`.

use std::fmt::Display;

use crate::messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::messages::std_msgs::Header;
use crate::swarm::control::{Control, Mode};

/// Index of a publication with its own rate.
pub const STATE: usize = 0;
pub const DIAGNOSTICS: usize = 1;

/// Counts since the beginning, and times since the last report.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    /// Ticks left out because one before took too long.
    pub missed: u64,
    reported_missed: u64,
    ticks: u64,
    since: Option<f64>,
    last: f64,
    longest: f64,
    unsent: u64,
    due: [Option<f64>; 2],
}

impl Statistics {
    /// A tick that took this long \[s\].
    pub fn tick(&mut self, seconds: f64) {
        self.ticks += 1;
        self.last = seconds;
        self.longest = self.longest.max(seconds);
    }

    /// How long the last tick took \[s\].
    pub fn last_tick(&self) -> f64 {
        self.last
    }

    /// Counts a message that could not be sent.
    pub fn sent<E: Display>(&mut self, outcome: Result<(), E>) {
        if let Err(error) = outcome {
            if self.unsent == 0 {
                tracing::warn!("{error} (only the first is reported)");
            }
            self.unsent += 1;
        }
    }

    /// Whether what goes out `rate` times a second is to go out now.
    pub fn is_due(&mut self, what: usize, now: f64, rate: f64) -> bool {
        // A clock that was set back starts anew.
        let due = self.due[what].is_none_or(|due| now >= due || due - now > 2.0 / rate);
        if due {
            let next = self.due[what].filter(|due| (0.0..1.0 / rate).contains(&(now - due))).unwrap_or(now);
            self.due[what] = Some(next + 1.0 / rate);
        }
        due
    }

    /// The report of a node and its swarm, by name, and a new beginning for the times in it; `refused` messages were none
    /// of their type, `troubles` are those of the network and the clock. A node that is not configured receives no poses.
    pub fn message(
        &mut self,
        control: &Control,
        [node, swarm]: [&str; 2],
        header: Header,
        refused: u64,
        is_configured: bool,
        troubles: &[String],
    ) -> DiagnosticArray {
        let formation = control.formation();
        let now = header.stamp.seconds();
        let lost: Vec<&str> = (0..formation.count())
            .filter(|&m| !control.health(m).is_usable())
            .map(|m| formation.names[m].as_str())
            .collect();
        let ages = (0..formation.count()).filter_map(|m| control.age(m));
        let counts = (0..formation.count()).map(|m| control.watch().counts(m));
        let (rejected, unheard) =
            counts.fold((0, 0), |(rejected, lost), one| (rejected + one.rejected(), lost + one.lost));
        let missed = self.missed - self.reported_missed;
        let rate = self.since.filter(|&since| now > since).map(|since| self.ticks as f64 / (now - since));
        let (level, message) = match (control.mode(), lost.len(), missed) {
            (Mode::EmergencyStopped, ..) => (DiagnosticStatus::ERROR, "emergency stop".to_owned()),
            _ if !troubles.is_empty() => (DiagnosticStatus::ERROR, troubles.join("; ")),
            _ if !is_configured => (DiagnosticStatus::OK, "not configured".into()),
            (_, all, _) if all == formation.count() => (DiagnosticStatus::ERROR, "no robot is heard".into()),
            (_, 1.., _) => {
                (DiagnosticStatus::WARN, format!("{} of {} robots lost", lost.len(), formation.count()))
            }
            (_, 0, 1..) => (DiagnosticStatus::WARN, format!("{missed} deadlines missed in the last second")),
            (Mode::Inactive, ..) => (DiagnosticStatus::OK, "inactive".into()),
            _ => (DiagnosticStatus::OK, "flying".into()),
        };
        let pair = |key: &str, value: String| KeyValue { key: key.into(), value };
        let values = vec![
            pair("rate [Hz]", rate.map_or("-".into(), |rate| format!("{rate:.2}"))),
            pair("deadlines missed", self.missed.to_string()),
            pair("longest tick [ms]", format!("{:.3}", 1e3 * self.longest)),
            pair("oldest pose [s]", format!("{:.3}", ages.fold(0.0, f64::max))),
            pair("poses rejected", rejected.to_string()),
            pair("poses lost", unheard.to_string()),
            pair("messages refused", refused.to_string()),
            pair("messages not sent", self.unsent.to_string()),
            pair("robots lost", lost.join(" ")),
        ];
        (self.ticks, self.since, self.longest, self.reported_missed) = (0, Some(now), 0.0, self.missed);
        let status = DiagnosticStatus {
            level,
            name: format!("{node}: formation"),
            message,
            hardware_id: swarm.to_owned(),
            values,
        };
        DiagnosticArray { header, status: vec![status] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_due_keeps_its_rate_and_starts_anew_with_the_clock() {
        let mut statistics = Statistics::default();
        let sent = |statistics: &mut Statistics, from: f64| {
            (0..100).filter(|k| statistics.is_due(STATE, from + 0.01 * f64::from(*k), 10.0)).count()
        };
        assert_eq!(sent(&mut statistics, 5.0), 10);
        assert_eq!(sent(&mut statistics, 0.0), 10, "the clock was set back");
        assert_eq!(sent(&mut statistics, 1000.0), 10, "and ran ahead");
    }
}
