//! Where a command is on its way: a bar or a changing line on a terminal, a line every few seconds in a pipe.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between two plain lines, so that a log of a long run stays short.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// Shown from any thread.
pub struct Progress {
    way: Way,
    /// Steps in all.
    steps: usize,
    /// What is drawn, in the singular.
    what: &'static str,
}

enum Way {
    Silent,
    Bar(ProgressBar),
    /// When the last line was; where there was none, the next comes at once.
    Lines(Mutex<Option<Instant>>),
}

impl Progress {
    /// Steps, each with its residual.
    pub fn of_steps(quiet: bool, steps: usize) -> Self {
        let bar = ProgressBar::new(steps as u64);
        let way = Way::new(quiet, bar, "{bar:32} step {pos}/{len}  {msg}  {eta} left", Some(Instant::now()));
        Self { way, steps, what: "" }
    }

    /// Figures or frames, `what` in the singular.
    pub fn of_drawing(quiet: bool, what: &'static str) -> Self {
        let template = format!("{{bar:32}} drawing {what} {{pos}}/{{len}}");
        let way = Way::new(quiet, ProgressBar::new(0), &template, Some(Instant::now()));
        Self { way, steps: 0, what }
    }

    /// Stages of a study, each with a name.
    pub fn of_stages(quiet: bool) -> Self {
        let way = Way::new(quiet, ProgressBar::new_spinner(), "{spinner} {msg}", None);
        if let Way::Bar(spinner) = &way {
            spinner.enable_steady_tick(Duration::from_millis(100));
        }
        Self { way, steps: 0, what: "" }
    }

    pub fn step(&self, step: usize, residual: f64) {
        let residual = || format!("residual {residual:.2e}");
        let on_bar = |bar: &ProgressBar| {
            bar.set_position(step as u64);
            bar.set_message(residual());
        };
        self.way.show(on_bar, || format!("step {step}/{}  {}", self.steps, residual()));
    }

    pub fn drawn(&self, done: usize, of: usize) {
        let on_bar = |bar: &ProgressBar| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        };
        self.way.show(on_bar, || format!("drawing: {done} of {of} {}s", self.what));
    }

    pub fn stage(&self, what: &str) {
        tracing::debug!("{what}");
        self.way.show(|spinner| spinner.set_message(what.to_owned()), || what.to_owned());
    }

    pub fn finish(self) {
        if let Way::Bar(bar) = self.way {
            bar.finish_and_clear();
        }
    }
}

impl Way {
    fn new(quiet: bool, bar: ProgressBar, template: &str, last: Option<Instant>) -> Self {
        if quiet {
            return Way::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Way::Lines(Mutex::new(last));
        }
        let style = ProgressStyle::with_template(template);
        Way::Bar(bar.with_style(style.expect("the template is fixed and right")))
    }

    fn show(&self, on_bar: impl FnOnce(&ProgressBar), line: impl FnOnce() -> String) {
        match self {
            Way::Silent => {}
            Way::Bar(bar) => on_bar(bar),
            Way::Lines(last) => {
                if let Ok(mut last) = last.lock()
                    && last.is_none_or(|last| last.elapsed() >= BETWEEN_LINES)
                {
                    note!("{}", line());
                    *last = Some(Instant::now());
                }
            }
        }
    }
}
