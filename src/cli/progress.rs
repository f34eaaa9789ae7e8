//! How a run shows where it is: a bar on a terminal, plain lines in a pipe.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between two plain lines, so that a log of a long run stays short.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// How many figures or frames are drawn: a bar on a terminal; in a pipe a line where it takes long.
pub enum Drawn {
    Silent,
    Bar(ProgressBar),
    Lines { what: &'static str, last: Mutex<Instant> },
}

impl Drawn {
    /// `what` in the singular.
    pub fn new(quiet: bool, what: &'static str) -> Self {
        if quiet {
            return Drawn::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Drawn::Lines { what, last: Mutex::new(Instant::now()) };
        }
        let style = ProgressStyle::with_template(&format!("{{bar:32}} drawing {what} {{pos}}/{{len}}"));
        let bar = ProgressBar::new(0);
        bar.set_style(style.expect("the template is fixed and right"));
        Drawn::Bar(bar)
    }

    /// Called from any thread.
    pub fn show(&self, done: usize, of: usize) {
        match self {
            Drawn::Silent => {}
            Drawn::Bar(bar) => {
                bar.set_length(of as u64);
                bar.set_position(done as u64);
            }
            Drawn::Lines { what, last } => {
                if let Ok(mut last) = last.lock()
                    && last.elapsed() >= BETWEEN_LINES
                {
                    eprintln!("drawing: {done} of {of} {what}s");
                    *last = Instant::now();
                }
            }
        }
    }

    pub fn finish(self) {
        if let Drawn::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

pub enum Progress {
    Silent,
    Bar(ProgressBar),
    Lines { steps: usize, last: Instant },
}

/// The next stage of a study: a line that changes on a terminal, one every few seconds in a pipe.
pub enum Stages {
    Silent,
    Spinner(ProgressBar),
    Lines { last: Option<Instant> },
}

impl Stages {
    pub fn new(quiet: bool) -> Self {
        if quiet {
            return Stages::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Stages::Lines { last: None };
        }
        let spinner = ProgressBar::new_spinner();
        spinner.enable_steady_tick(Duration::from_millis(100));
        Stages::Spinner(spinner)
    }

    pub fn next(&mut self, what: &str) {
        tracing::debug!("{what}");
        match self {
            Stages::Silent => {}
            Stages::Spinner(spinner) => spinner.set_message(what.to_owned()),
            Stages::Lines { last } => {
                if last.is_none_or(|last| last.elapsed() >= BETWEEN_LINES) {
                    eprintln!("{what}");
                    *last = Some(Instant::now());
                }
            }
        }
    }

    pub fn finish(self) {
        if let Stages::Spinner(spinner) = self {
            spinner.finish_and_clear();
        }
    }
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
