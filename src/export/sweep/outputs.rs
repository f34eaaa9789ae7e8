//! Outputs of a run by name: a key of its summary, or a particle at a step.

use std::str::FromStr;

use serde_json::Value;

use super::super::Summary;
use super::SweepError;
use crate::engine::Engine;
use crate::scene::Scene;

/// One value of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// At a key path of `summary.json`.
    Summary(String),
    /// Of a particle.
    Probe {
        /// The text that asks for it.
        name: String,
        /// Of the particle, as in `final.csv`.
        id: usize,
        /// The quantity that is read.
        quantity: Quantity,
        /// After so many steps; at the end where there is none.
        step: Option<usize>,
    },
}

/// The quantity read from a particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Place along an axis, 0 or 1 \[length\].
    Place(usize),
    /// Displacement along an axis, 0 or 1 \[length\].
    Displacement(usize),
    /// First pseudo-energy \[length^2\].
    Pe1,
    /// Second pseudo-energy \[length\].
    Pe2,
}

impl Quantity {
    fn of(self, engine: &Engine, particle: usize) -> f64 {
        match self {
            Quantity::Place(axis) => engine.present().get(particle)[axis],
            Quantity::Displacement(axis) => engine.displacement(particle)[axis],
            Quantity::Pe1 => engine.pe1(particle),
            Quantity::Pe2 => engine.pe2(particle),
        }
    }
}

impl FromStr for Output {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let Some(probe) = text.strip_prefix("probe.") else { return Ok(Output::Summary(text.to_owned())) };
        let refuse = || {
            let help = "give probe.ID.QUANTITY or probe.ID.QUANTITY@STEP, with x, y, ux, uy, pe1 or pe2";
            SweepError::of_output(&format!("{text} is no probe"), help)
        };
        let (place, step) = match probe.split_once('@') {
            Some((place, step)) => (place, Some(step.parse().map_err(|_| refuse())?)),
            None => (probe, None),
        };
        let (id, quantity) = place.split_once('.').ok_or_else(refuse)?;
        let quantity = match quantity {
            "x" => Quantity::Place(0),
            "y" => Quantity::Place(1),
            "ux" => Quantity::Displacement(0),
            "uy" => Quantity::Displacement(1),
            "pe1" => Quantity::Pe1,
            "pe2" => Quantity::Pe2,
            _ => return Err(refuse()),
        };
        Ok(Output::Probe { name: text.to_owned(), id: id.parse().map_err(|_| refuse())?, quantity, step })
    }
}

impl Output {
    /// The names of those that are taken where none are asked for.
    pub fn usual(scene: &Scene) -> Vec<String> {
        let always = ["energies.pe1", "energies.largest_strain", "residual", "steps"];
        let of_material = ["mechanics.strain_energy", "mechanics.largest_von_mises.von_mises"];
        let of_fracture = ["broken_bonds.count"];
        let material = of_material.into_iter().filter(|_| scene.material.is_some());
        let fracture = of_fracture.into_iter().filter(|_| scene.fracture.is_some());
        always.into_iter().chain(material).chain(fracture).map(str::to_owned).collect()
    }

    /// Refuses a step that a run of this scene cannot come to.
    ///
    /// # Errors
    /// Names the last step.
    pub fn require_within(&self, scene: &Scene) -> Result<(), SweepError> {
        let (last, unit) = (scene.most_steps(), scene.counts());
        match self {
            Output::Probe { name, step: Some(step), .. } if *step > last => {
                let bound = if unit == "step" { "stop.steps" } else { "load_steps" };
                let help = format!("give one up to it, or raise {bound}");
                Err(SweepError::of_output(&format!("{name}: the last {unit} is {last}"), help))
            }
            _ => Ok(()),
        }
    }
}

/// Readings of particles on the way, for the outputs that are asked for.
#[derive(Clone, Debug, Default)]
pub struct Probed(Vec<Option<f64>>);

impl Probed {
    /// The first step after `step` at which something is read; none before the end if there is none.
    pub fn next(outputs: &[Output], step: usize) -> usize {
        let steps = outputs.iter().filter_map(|output| match output {
            Output::Probe { step: at, .. } => *at,
            Output::Summary(_) => None,
        });
        steps.filter(|&at| at > step).min().unwrap_or(usize::MAX)
    }

    /// Reads what is asked for at the engine's step.
    pub fn see(&mut self, outputs: &[Output], engine: &Engine) {
        self.0.resize(outputs.len(), None);
        for (read, output) in self.0.iter_mut().zip(outputs) {
            if let Output::Probe { id, quantity, step: Some(step), .. } = output
                && *step == engine.step()
            {
                *read = engine.body().particle(*id).map(|particle| quantity.of(engine, particle));
            }
        }
    }
}

/// The values of a run.
#[derive(Clone, Copy, Debug)]
pub struct Values<'a> {
    /// The engine at the end.
    pub engine: &'a Engine,
    /// The summary of the run.
    pub summary: &'a Summary,
    /// Readings on the way.
    pub probed: &'a Probed,
}

impl Values<'_> {
    /// The outputs as text, empty where a value is absent: a number that is not finite, a step that was not reached.
    /// An error for each output that such a run does not have.
    pub fn texts(&self, outputs: &[Output]) -> Vec<Result<String, SweepError>> {
        // A summary holds what can be written.
        let summary = serde_json::to_value(self.summary).unwrap_or_default();
        let number = |value: f64| if value.is_finite() { format!("{value:?}") } else { String::new() };
        let of = |(n, output): (usize, &Output)| match output {
            Output::Summary(path) => at(&summary, path),
            Output::Probe { name, id, quantity, step } => {
                let fault = || format!("{name}: the body has no particle {id}");
                let missing = || SweepError::of_output(&fault(), "final.csv of a run lists the ids");
                let particle = self.engine.body().particle(*id).ok_or_else(missing)?;
                let end = || Some(quantity.of(self.engine, particle));
                let read = if step.is_some() { self.probed.0.get(n).copied().flatten() } else { end() };
                Ok(read.map_or_else(String::new, number))
            }
        };
        outputs.iter().enumerate().map(of).collect()
    }
}

/// The value at a key path such as `mechanics.reactions[0].force[1]`; below an absent one everything is absent.
fn at(summary: &Value, name: &str) -> Result<String, SweepError> {
    let path = name.replace('[', ".").replace(']', "");
    let (mut value, mut reached) = (summary, String::new());
    for key in path.split('.') {
        let below = match value {
            Value::Null => return Ok(String::new()),
            Value::Array(items) => key.parse().ok().and_then(|n: usize| items.get(n)),
            _ => value.get(key),
        };
        let place = if reached.is_empty() { "it" } else { &reached };
        let help = || format!("{place} has {}", keys(value).join(", "));
        let unknown = || SweepError::of_output(&format!("{name}: summary.json has no such key"), help());
        value = below.ok_or_else(unknown)?;
        reached += if reached.is_empty() { "" } else { "." };
        reached += key;
    }
    match value {
        Value::Null => Ok(String::new()),
        Value::String(text) => Ok(text.clone()),
        Value::Array(_) | Value::Object(_) => {
            let there: Vec<_> = keys(value).into_iter().map(|key| format!("{name}.{key}")).collect();
            let help = format!("give one of them: {}", there.join(", "));
            Err(SweepError::of_output(&format!("{name} has several values"), help))
        }
        other => Ok(other.to_string()),
    }
}

fn keys(value: &Value) -> Vec<String> {
    match value {
        Value::Object(entries) => entries.keys().cloned().collect(),
        Value::Array(items) => (0..items.len()).map(|n| n.to_string()).collect(),
        _ => vec!["no keys".to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_path_reaches_into_lists_and_says_what_is_there_instead() {
        let summary = serde_json::json!({ "a": { "b": [1.5, [2, 3]], "c": null }, "d": "word" });
        assert_eq!(at(&summary, "a.b[0]"), Ok("1.5".into()));
        assert_eq!(at(&summary, "a.b.1.1"), Ok("3".into()));
        assert_eq!(at(&summary, "d"), Ok("word".into()));
        // What is absent in this run may be there in another.
        assert_eq!(at(&summary, "a.c.deeper"), Ok(String::new()));
        let unknown = at(&summary, "a.x").expect_err("unknown").to_string();
        assert!(unknown.contains("--outputs a.x") && unknown.contains("a has b, c"), "{unknown}");
        assert!(at(&summary, "x").expect_err("unknown").to_string().contains("it has a, d"));
        let several = at(&summary, "a").expect_err("several").to_string();
        assert!(several.contains("a.b, a.c"), "{several}");
    }

    #[test]
    fn a_probe_is_a_particle_a_quantity_and_a_step() {
        let read = |text: &str| text.parse::<Output>();
        let probe =
            |id, quantity, step, name: &str| Output::Probe { name: name.to_owned(), id, quantity, step };
        let (at_step, at_end) = ("probe.67.ux@20", "probe.3.pe1");
        assert_eq!(read(at_step), Ok(probe(67, Quantity::Displacement(0), Some(20), at_step)));
        assert_eq!(read(at_end), Ok(probe(3, Quantity::Pe1, None, at_end)));
        for wrong in ["probe.67", "probe.67.z", "probe.x.ux", "probe.67.ux@end", "probe."] {
            let refused = read(wrong).expect_err(wrong).to_string();
            assert!(refused.starts_with(&format!("--outputs {wrong} is no probe\n")), "{refused}");
        }
        assert_eq!(Probed::next(&[read(at_step).unwrap(), read(at_end).unwrap()], 0), 20);
        assert_eq!(Probed::next(&[read(at_step).unwrap()], 20), usize::MAX);
    }
}
