//! The report in words.

use std::fmt;

use super::super::machine::Bandwidth;
use super::super::quick_note;
use super::Report;
use crate::scene::text::counted;

const GIGA: f64 = 1e-9;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}; {}", self.processor.as_deref().unwrap_or("a processor without name"), self.chosen)?;
        for triad in &self.triad {
            let Bandwidth { threads, counted_bytes_per_second, moved_bytes_per_second } = triad;
            let (sum, moved) = (GIGA * counted_bytes_per_second, GIGA * moved_bytes_per_second);
            writeln!(
                f,
                "triad, {}: {moved:.1} GB/s moved ({sum:.1} GB/s without write-allocate); \
                 at 48 bytes an update the roofline is {:.3} G updates/s",
                counted(*threads, "thread"),
                moved / 48.0,
            )?;
        }
        writeln!(
            f,
            "\n{:<34} {:>4} {:>12} {:>7} {:>8} {:>11} {:>12} {:>9} {:>12}",
            "swept", "", "body", "threads", "together", "a step", "G updates/s", "roofline", "M bonds/s"
        )?;
        for case in &self.cases {
            let bonds = match case.bonds_watched {
                0 => String::new(),
                bonds => format!("{:.0}", 1e-6 * bonds as f64 / case.seconds_per_step),
            };
            writeln!(
                f,
                "{:<34} {:>4} {:>12} {:>7} {:>8} {:>11} {:>12.3} {:>7.0} % {:>12}",
                case.subject,
                case.precision,
                format!("{0} x {0}", case.side),
                case.threads,
                case.steps_together,
                duration(case.seconds_per_step),
                GIGA * case.updates_per_second,
                100.0 * case.share_of_roofline,
                bonds,
            )?;
        }
        writeln!(f, "\n{:<34} {:>11} {:>20}", "a step of the engine", "", "over the bare loops")?;
        for capability in &self.capabilities {
            writeln!(
                f,
                "{:<34} {:>11} {:>20.2}",
                capability.name,
                duration(capability.seconds_per_step),
                capability.over_bare_loops
            )?;
        }
        if self.quick {
            writeln!(f)?;
        }
        quick_note(self.quick, f)
    }
}

/// Three figures and the unit that suits them.
fn duration(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-6 => (s * 1e9, "ns"),
        s if s < 1e-3 => (s * 1e6, "us"),
        s => (s * 1e3, "ms"),
    };
    format!("{value:.*} {unit}", if value < 10.0 { 2 } else { usize::from(value < 100.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_written_with_three_figures() {
        let written = [1.234e-9, 45.67e-9, 345.6e-6, 7.891e-3, 1.5].map(duration);
        assert_eq!(written, ["1.23 ns", "45.7 ns", "346 us", "7.89 ms", "1500 ms"]);
    }
}
