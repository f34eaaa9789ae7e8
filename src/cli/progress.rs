//! How a run shows where it is: a bar on a terminal, plain lines in a pipe.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between two plain lines, so that a log of a long run stays short.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

pub enum Progress {
    Silent,
    Bar(ProgressBar),
    Lines { steps: usize, last: Instant },
}

impl Progress {
    pub fn new(quiet: bool, steps: usize) -> Self {
        if quiet {
            return Progress::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Progress::Lines { steps, last: Instant::now() };
        }
        let style = ProgressStyle::with_template("{bar:32} step {pos}/{len}  {msg}  {eta} left");
        let bar = ProgressBar::new(steps as u64);
        bar.set_style(style.expect("the template is fixed and right"));
        Progress::Bar(bar)
    }

    pub fn step(&mut self, step: usize, residual: f64) {
        match self {
            Progress::Silent => {}
            Progress::Bar(bar) => {
                bar.set_position(step as u64);
                bar.set_message(format!("residual {residual:.2e}"));
            }
            Progress::Lines { steps, last } => {
                if last.elapsed() >= BETWEEN_LINES {
                    eprintln!("step {step}/{steps}  residual {residual:.2e}");
                    *last = Instant::now();
                }
            }
        }
    }

    pub fn finish(self) {
        if let Progress::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
