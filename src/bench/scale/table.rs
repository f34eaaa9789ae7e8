//! The report in words.

use std::fmt;

use super::model::Link;
use super::{Case, Report};

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let processor = self.processor.as_deref().unwrap_or("a processor without name");
        writeln!(f, "{processor}, {} cores; ranks are {} with one thread each", self.cores, self.ranks_are)?;
        let Link { latency_seconds, bytes_per_second } = self.model.link;
        writeln!(
            f,
            "an update takes {:.3} ns, a message {:.1} us and a second for {:.1} GB",
            1e9 * self.model.update_seconds,
            1e6 * latency_seconds,
            1e-9 * bytes_per_second
        )?;
        cases(f, "strong: the same body", &self.strong)?;
        cases(f, "weak: as much for each rank", &self.weak)?;
        self.equilibria(f)?;
        self.counts(f)?;
        self.predicted(f)?;
        if self.strong.iter().any(|case| case.ranks > self.cores) && self.ranks_are == "threads" {
            writeln!(f, "\nThere were more ranks than cores: they waited for each other in turns.")?;
        }
        if self.quick {
            writeln!(f, "\nA quick run: it shows that the benchmark works, its times mean little.")?;
        }
        Ok(())
    }
}

fn cases(f: &mut fmt::Formatter<'_>, title: &str, cases: &[Case]) -> fmt::Result {
    writeln!(
        f,
        "\n{title:<28} {:>14} {:>12} {:>12} {:>10} {:>12} {:>12}",
        "body", "one rank", "a step", "efficiency", "in exchange", "predicted"
    )?;
    for case in cases {
        writeln!(
            f,
            "{:<28} {:>14} {:>12} {:>12} {:>8.0} % {:>10.0} % {:>12}",
            format!("{} ranks", case.ranks),
            format!("{} x {}", case.body[0], case.body[1]),
            milliseconds(case.alone_seconds_per_step),
            milliseconds(case.seconds_per_step),
            100.0 * case.efficiency,
            100.0 * case.share_in_exchange,
            milliseconds(case.predicted_seconds_per_step),
        )?;
    }
    Ok(())
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.4} ms", 1e3 * seconds)
}

impl Report {
    fn equilibria(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n{:<28} {:>14} {:>12} {:>12} {:>10} {:>12}",
            "at rest, by multigrid", "body", "one rank", "a solve", "times", "iterations"
        )?;
        for case in &self.at_rest {
            writeln!(
                f,
                "{:<28} {:>14} {:>12} {:>12} {:>10.2} {:>12}",
                format!("{} ranks", case.ranks),
                format!("{} x {}", case.body[0], case.body[1]),
                milliseconds(case.alone_seconds),
                milliseconds(case.seconds),
                case.speed_up,
                format!("{} ({})", case.iterations, case.alone_iterations),
            )?;
        }
        for case in &self.beside_threads {
            writeln!(
                f,
                "{} ranks beside as many threads, {} x {}, at most {} steps together: {} a step, threads {}, {:.2} times",
                case.ranks,
                case.body[0],
                case.body[1],
                case.steps_together,
                milliseconds(case.seconds_per_step),
                milliseconds(case.threads_seconds_per_step),
                case.ratio,
            )?;
        }
        Ok(())
    }

    fn counts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n{:<28} {:>14} {:>22} {:>22} {:>24}",
            "counted a step (predicted)", "body", "messages", "bytes", "updates"
        )?;
        for case in &self.counted {
            let beside = |counted: f64, predicted: f64| format!("{counted:.3} ({predicted:.3})");
            let (counted, predicted) = (&case.counted, &case.predicted);
            writeln!(
                f,
                "{:<28} {:>14} {:>22} {:>22} {:>24}",
                format!("{} ranks", case.ranks),
                format!("{} x {}", case.body[0], case.body[1]),
                beside(counted.messages, predicted.messages),
                beside(counted.bytes, predicted.bytes),
                beside(counted.updates, predicted.updates),
            )?;
        }
        Ok(())
    }

    fn predicted(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [[columns, rows], [each, high]] = [self.predicted_body, self.predicted_part];
        let Link { latency_seconds, bytes_per_second } = Link::NETWORK;
        writeln!(
            f,
            "\npredicted efficiency of {columns} x {rows} (strong) and of {each} x {high} for each rank (weak), with messages as \
             they were\nmeasured here, and with those of a network that is assumed: {:.0} us and {:.0} GB/s",
            1e6 * latency_seconds,
            1e-9 * bytes_per_second
        )?;
        writeln!(
            f,
            "{:<28} {:>14} {:>12} {:>16} {:>16}",
            "", "strong, here", "weak, here", "strong, network", "weak, network"
        )?;
        for one in &self.predicted {
            let percent = |share: f64| format!("{:.1} %", 100.0 * share);
            writeln!(
                f,
                "{:<28} {:>14} {:>12} {:>16} {:>16}",
                format!("{} ranks", one.ranks),
                percent(one.strong_efficiency),
                percent(one.weak_efficiency),
                percent(one.strong_efficiency_on_network),
                percent(one.weak_efficiency_on_network),
            )?;
        }
        Ok(())
    }
}
