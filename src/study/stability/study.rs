//! Thresholds of a scene, predicted and measured, and its extremes.

use std::fmt;

use serde::Serialize;

use super::bisection::{Effort, Found, Growth, find, growth};
use super::extremes::{self, Case, Outcome};
use super::subject::{Parameter, Subject};
use super::thresholds::{Predicted, Radius, Side, curve, predict, start};
use crate::scene::SceneError;
use crate::study::Load;

/// A threshold from both sides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Threshold {
    /// The parameter that is varied.
    pub parameter: Parameter,
    /// Which end of the stable range it is.
    pub side: Side,
    /// From the spectrum; none where the body grows at no value of the parameter, or at every one.
    pub predicted: Option<Predicted>,
    /// From runs.
    pub found: Option<Found>,
    /// Whether the body grows where the search begins, where growth is least to be expected: then there is no threshold.
    pub grows_everywhere: bool,
    /// How far apart the two may be: a thousandth of what the sweep is from growing, or from not growing,
    /// at the parameter's neutral value (no feedback, no damping), and 1e-6 at least; where runs do not settle
    /// 4 over the number of their steps, which is what they can resolve; of values above 1, so much of them \[1\].
    pub tolerance: f64,
}

impl Threshold {
    /// Whether a prediction is known so well that runs may disagree with it.
    fn is_predicted_well(&self) -> bool {
        self.predicted.as_ref().is_none_or(|predicted| predicted.converged)
    }

    /// The parameter, and on which side.
    pub fn name(&self) -> String {
        format!("{} ({})", self.parameter.name(), self.side.name())
    }

    /// What stands for a value where there is none.
    pub fn without_value(&self) -> &'static str {
        if self.grows_everywhere { "everywhere" } else { "nowhere" }
    }

    /// What there is to say of how runs and spectrum agree; empty where they do.
    pub fn verdict(&self) -> String {
        let settled = self.found.as_ref().is_none_or(|found| found.settled);
        match (self.agrees(), settled) {
            _ if !self.is_predicted_well() => "a spectrum on the way did not settle".into(),
            (false, _) => format!("THEY DISAGREE by more than {:.1e}", self.tolerance),
            (true, false) => format!("too slow to settle: known to {:.1e}", self.tolerance),
            (true, true) => String::new(),
        }
    }

    /// Whether runs and spectrum say the same.
    pub fn agrees(&self) -> bool {
        match (&self.predicted, &self.found) {
            (Some(predicted), Some(found)) => (predicted.value - found.value).abs() <= self.tolerance,
            (None, None) => true,
            _ => false,
        }
    }
}

/// Spectrum and runs over the whole range of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sweep {
    /// The parameter that is varied.
    pub parameter: Parameter,
    /// The scene's own value.
    pub present: f64,
    /// Spectral radii at evenly spaced values over the whole range.
    pub spectrum: Vec<Radius>,
    /// Runs at evenly spaced values over the whole range.
    pub runs: Vec<Growth>,
}

/// The results of spectrum and runs for a linear rule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Linear {
    /// Particles of the body, those of the frame included.
    pub particles: usize,
    /// Particles that follow.
    pub followers: usize,
    /// Spectral radius of the scene's sweep as it is.
    pub radius: f64,
    /// Sweeps that it took to find the radius.
    pub iterations: usize,
    /// Whether the radius is known to its tolerance.
    pub converged: bool,
    /// Least and greatest eigenvalue of the sweep without feedback and damping, where they are real \[1\].
    pub ends: Option<[f64; 2]>,
    /// Whether the eigenvalues at the ends are real as far as they are known.
    pub are_real: bool,
    /// Thresholds at both ends of the range of each parameter.
    pub thresholds: Vec<Threshold>,
    /// The whole range of each parameter.
    pub sweeps: Vec<Sweep>,
}

/// Everything.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// Short name of the scene.
    pub name: String,
    /// Title of the scene.
    pub title: String,
    /// `None` where the rule is not linear or the body not held.
    pub linear: Option<Linear>,
    /// The reason why there are no thresholds.
    pub refused: Option<String>,
    /// Every extreme with its outcome; empty where they were left out.
    pub extremes: Vec<Case>,
}

/// How far the study goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// How long runs may become, and how many there are.
    pub effort: Effort,
    /// Leaves the extremes out.
    pub no_extremes: bool,
}

/// Predicts and measures the thresholds of a scene and runs its extremes. `progress` is called with what comes next.
///
/// # Errors
/// Whatever keeps the scene from being planned; a scene without thresholds is part of the study.
pub fn run(load: Load<'_>, options: Options, progress: &mut dyn FnMut(&str)) -> Result<Study, SceneError> {
    let scene = load(&[])?;
    let (linear, refused) = match Subject::of(&scene) {
        Ok(subject) => (Some(linear(&subject, options.effort, progress)), None),
        Err(error) if extremes::plan(&scene).is_ok() => (None, Some(error.to_string())),
        Err(error) => return Err(error),
    };
    let extremes = if options.no_extremes { Vec::new() } else { extremes::run(load, &scene, progress) };
    Ok(Study { name: scene.name.clone(), title: scene.raw.title.clone(), linear, refused, extremes })
}

fn linear(subject: &Subject, effort: Effort, progress: &mut dyn FnMut(&str)) -> Linear {
    let here = subject.sweep().radius();
    let bare = subject.with(Parameter::Feedback, 0.0).with(Parameter::Damping, 1.0).sweep().ends();
    let asked = [
        (Parameter::Feedback, Side::Lower),
        (Parameter::Feedback, Side::Upper),
        (Parameter::Damping, Side::Upper),
    ];
    let thresholds: Vec<Threshold> = asked
        .into_iter()
        .map(|(parameter, side)| threshold(subject, parameter, side, effort, progress))
        .collect();
    let sweeps = Parameter::ALL
        .into_iter()
        .map(|parameter| sweep(subject, parameter, &thresholds, effort, progress))
        .collect();
    Linear {
        particles: subject.particles(),
        followers: subject.followers(),
        radius: here.radius,
        iterations: here.iterations,
        converged: here.converged,
        are_real: bare.are_real,
        ends: (bare.are_real && bare.converged).then_some([bare.lowest, bare.highest]),
        thresholds,
        sweeps,
    }
}

fn threshold(
    subject: &Subject,
    parameter: Parameter,
    side: Side,
    effort: Effort,
    progress: &mut dyn FnMut(&str),
) -> Threshold {
    let what = format!("the {} threshold of the {}", side.name(), parameter.name());
    progress(&what);
    let neutral = match parameter {
        Parameter::Feedback => 0.0,
        Parameter::Damping => 1.0,
    };
    let margin = (subject.with(parameter, neutral).sweep().radius_from_one().radius - 1.0).abs();
    let tolerance = (1e-3 * margin).max(1e-6);
    let steps = effort.steps(subject.particles());
    let from = start(subject, parameter, side);
    let found = find(subject, parameter, from, (tolerance / 8.0, steps), &mut |value| {
        progress(&format!("{what}: a run at {value}"));
    });
    let settled = found.as_ref().is_none_or(|found| found.settled);
    let tolerance = if settled { tolerance } else { tolerance.max(4.0 / steps as f64) };
    let predicted =
        predict(subject, parameter, side, &mut |value| progress(&format!("{what}: the spectrum at {value}")));
    let size = predicted.as_ref().map_or(1.0, |predicted| predicted.value.abs().max(1.0));
    let grows_everywhere =
        predicted.is_none() && subject.with(parameter, from.0).sweep().radius_from_one().radius > 1.0;
    Threshold { parameter, side, predicted, found, grows_everywhere, tolerance: tolerance * size }
}

/// Runs and spectra from one threshold to the other and a little beyond.
fn sweep(
    subject: &Subject,
    parameter: Parameter,
    thresholds: &[Threshold],
    effort: Effort,
    progress: &mut dyn FnMut(&str),
) -> Sweep {
    let what = format!("growth over the {}", parameter.name());
    progress(&what);
    let mut known: Vec<f64> = thresholds
        .iter()
        .filter(|threshold| threshold.parameter == parameter)
        .flat_map(|t| [t.predicted.as_ref().map(|p| p.value), t.found.as_ref().map(|f| f.value)])
        .flatten()
        .collect();
    let (inside, _) = start(subject, parameter, Side::Upper);
    known.push(if parameter == Parameter::Damping { 0.0 } else { inside });
    let (low, high) =
        known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let beyond = 0.12 * (high - low);
    // Nothing moves without damping, so there is no growth to speak of.
    let low = if parameter == Parameter::Damping { 0.05 * high } else { low - beyond };
    let range = [low, high + beyond];
    let runs = (0..effort.samples)
        .map(|k| range[0] + (range[1] - range[0]) * k as f64 / (effort.samples.max(2) - 1) as f64)
        .map(|value| {
            progress(&format!("{what}: a run at {value}"));
            growth(subject, parameter, value, effort.steps(subject.particles()) / 4)
        })
        .collect();
    progress(&format!("{what}: spectra"));
    let spectrum = curve(subject, parameter, range, 6 * effort.samples + 1);
    Sweep { parameter, present: subject.present(parameter), spectrum, runs }
}

impl Study {
    /// Whether every prediction that settled agrees with its bisection and no extreme is wrong.
    pub fn holds(&self) -> bool {
        let agrees = |threshold: &Threshold| threshold.agrees() || !threshold.is_predicted_well();
        let agree = self.linear.as_ref().is_none_or(|l| l.thresholds.iter().all(agrees));
        agree && !self.extremes.iter().any(|case| matches!(case.outcome, Outcome::Wrong { .. }))
    }
}

impl fmt::Display for Study {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        if let Some(linear) = &self.linear {
            write!(f, "{linear}")?;
        }
        if let Some(reason) = &self.refused {
            writeln!(f, "no thresholds: {reason}")?;
        }
        if self.extremes.is_empty() {
            return Ok(());
        }
        let count = |which: fn(&Outcome) -> bool| self.extremes.iter().filter(|c| which(&c.outcome)).count();
        writeln!(
            f,
            "extremes: {} right, {} refused, {} wrong",
            count(|o| matches!(o, Outcome::Right { .. })),
            count(|o| matches!(o, Outcome::Refused { .. })),
            count(|o| matches!(o, Outcome::Wrong { .. }))
        )?;
        let width = self.extremes.iter().map(|case| case.name.chars().count()).max().unwrap_or(0);
        self.extremes.iter().try_for_each(|case| writeln!(f, "  {:width$}  {}", case.name, case.outcome))
    }
}

impl fmt::Display for Linear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} of {} particles follow; spectral radius of the sweep {:.9}, found in {} sweeps{}",
            self.followers,
            self.particles,
            self.radius,
            self.iterations,
            if self.converged { "" } else { " (not settled)" }
        )?;
        match self.ends {
            Some([low, high]) => {
                writeln!(f, "eigenvalues without feedback and damping from {low:.9} to {high:.9}")?;
            }
            None if self.are_real => writeln!(f, "its least and greatest eigenvalue did not settle")?,
            None => writeln!(
                f,
                "its eigenvalues seem not to be real: the sweep is not symmetric, and spectrum and runs are then less sure than they say"
            )?,
        }
        writeln!(f, "{:26} {:>14} {:>14} {:>10}", "grows beyond", "predicted", "found by runs", "apart")?;
        for threshold in &self.thresholds {
            let [predicted, found] = [
                threshold.predicted.as_ref().map(|p| p.value),
                threshold.found.as_ref().map(|found| found.value),
            ];
            let shown =
                |value: Option<f64>| value.map_or(threshold.without_value().into(), |v| format!("{v:.8}"));
            let apart = predicted.zip(found).map_or(String::new(), |(p, f)| format!("{:.1e}", (p - f).abs()));
            let (name, verdict) = (threshold.name(), threshold.verdict());
            let row =
                format!("{name:26} {:>14} {:>14} {apart:>10}  {verdict}", shown(predicted), shown(found));
            writeln!(f, "{}", row.trim_end())?;
        }
        writeln!(
            f,
            "delay: no threshold, since targets are places: poses d periods late take growth per step to the power 1/(d+1)"
        )
    }
}
