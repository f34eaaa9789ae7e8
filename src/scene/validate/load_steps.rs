//! In which parts loads and motions come, and the checks that they do come.

use super::Refuse;
use crate::scene::LoadSteps;
use crate::scene::document::problem::SceneError;
use crate::scene::raw::*;

/// Rows of `load.csv` that a stepped scene has about, unless it says how many.
const ROWS: usize = 100;

pub fn load_steps(raw: &RawScene, refuse: Refuse<'_>) -> Result<Option<LoadSteps>, SceneError> {
    let Some(asked) = &raw.load_steps else { return Ok(None) };
    if raw.material.is_none() {
        let message = "forces and stresses are those of a material, and the scene has none".into();
        let help = "add [material] with kind = \"isotropic\", young and poisson, or leave [load_steps] out";
        return Err(refuse("load_steps", message, help));
    }
    let steps = if raw.equilibrium.is_some() { solved(asked, refuse) } else { stepped(raw, asked, refuse) };
    steps.map(Some)
}

/// Parts that are each solved to equilibrium.
fn solved(asked: &RawLoadSteps, refuse: Refuse<'_>) -> Result<LoadSteps, SceneError> {
    let swept = [("ramp", asked.ramp.is_some()), ("every", asked.every.is_some())];
    if let Some((key, _)) = swept.into_iter().find(|(_, is_there)| *is_there) {
        let message = "an equilibrium is not stepped to: there are no sweeps to follow".into();
        let help = "use load_steps.increments or load_steps.schedule, or leave [equilibrium] out to step";
        return Err(refuse(&format!("load_steps.{key}"), message, help));
    }
    match (asked.increments, &asked.schedule) {
        (Some(count), None) => Ok(LoadSteps::Solved((1..=count).map(|n| n as f64 / count as f64).collect())),
        (None, Some(parts)) => {
            if let Some(n) = parts.iter().position(|part| !(0.0..=1.0).contains(part)) {
                let message = format!("a part is from 0 to 1, and this one is {}", parts[n]);
                let help = "raise the loads and motions themselves, and give parts of them";
                return Err(refuse(&format!("load_steps.schedule[{n}]"), message, help));
            }
            Ok(LoadSteps::Solved(parts.clone()))
        }
        (given, _) => {
            let message =
                if given.is_some() { "gives both increments and a schedule" } else { "gives no parts" };
            let help = "give either increments = 10 or schedule = [0.5, 1.0, 0.5]";
            Err(refuse("load_steps", message.into(), help))
        }
    }
}

/// Loads that follow the steps of a sweep.
fn stepped(raw: &RawScene, asked: &RawLoadSteps, refuse: Refuse<'_>) -> Result<LoadSteps, SceneError> {
    let solved = [("increments", asked.increments.is_some()), ("schedule", asked.schedule.is_some())];
    if let Some((key, _)) = solved.into_iter().find(|(_, is_there)| *is_there) {
        let message = "only an equilibrium is solved part by part, and this scene is stepped".into();
        let help = "add [equilibrium], or use load_steps.ramp = { steps = 100 }";
        return Err(refuse(&format!("load_steps.{key}"), message, help));
    }
    if let Some(ramp) = asked.ramp {
        let key = "load_steps.ramp";
        if raw.loads.is_empty() {
            let help = "add [[loads]], or give load_steps.every alone to keep what the leaders do";
            return Err(refuse(key, "there is no load that could grow".into(), help));
        }
        if ramp.steps > raw.stop.steps {
            let message = format!(
                "the run ends at step {}, before the loads are all there at step {}",
                raw.stop.steps, ramp.steps
            );
            return Err(refuse(
                &format!("{key}.steps"),
                message,
                "raise stop.steps, or let the ramp end earlier",
            ));
        }
    } else if asked.every.is_none() {
        let help = "give ramp = { steps = 100 }, every = 10 or both";
        return Err(refuse("load_steps", "says nothing of a scene that is stepped".into(), help));
    }
    let every = asked.every.unwrap_or_else(|| (raw.stop.steps / ROWS).max(1));
    Ok(LoadSteps::Stepped { ramp: asked.ramp.map(|ramp| ramp.steps), every })
}
