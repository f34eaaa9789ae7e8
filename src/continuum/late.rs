//! What a scene asks for after its last step, or of steps that it does not take.

use crate::scene::Scene;
use crate::scene::raw::RawOrder;

/// Keys that are named; of more there is their number.
const NAMED: usize = 4;

/// The warnings about keys whose step never comes. A run may end before its last step, so that this is no error.
pub(crate) fn cautions(scene: &Scene) -> Vec<String> {
    let roles = scene.raw.roles.iter().map(|role| role.from).enumerate();
    let roles = roles.map(|(k, at)| (format!("roles[{k}].from"), at));
    let actions = scene.actions.iter().map(|action| action.at).enumerate();
    let mut stepped: Vec<(String, usize)> =
        roles.chain(actions.map(|(k, at)| (format!("actions[{k}].at"), at))).collect();
    let figures = scene.record.figures.iter().copied().enumerate();
    let mut counted: Vec<(String, usize)> =
        figures.map(|(k, at)| (format!("record.figures[{k}]"), at)).collect();
    let (unit, most) = (scene.counts(), scene.most_steps());
    let unstepped = unstepped(scene, &counted);
    if unit == "step" {
        stepped.append(&mut counted);
    }
    let of = |unit: &str, last: usize, keys: Vec<(String, usize)>, bound| {
        let late = keys.into_iter().filter(|(_, at)| *at > last).map(|(key, at)| format!("{key} = {at}"));
        beyond(&format!("the last {unit}, {last}"), late, bound)
    };
    let steps = of("step", scene.stop.steps, stepped, "stop.steps");
    steps.into_iter().chain(of(unit, most, counted, "load_steps")).chain(unstepped).collect()
}

/// The warning about keys that say how a scene is stepped which is solved; `figures` are those of it by their keys.
fn unstepped(scene: &Scene, figures: &[(String, usize)]) -> Option<String> {
    scene.equilibrium?;
    let raw = &scene.raw;
    let of_update = [
        ("update.order", raw.update.order != RawOrder::Synchronous),
        ("update.damping", raw.update.damping.is_some()),
        ("stop.tolerance", raw.stop.tolerance.is_some()),
        ("record.probes", scene.is_solved_at_once() && !scene.record.probes.is_empty()),
    ];
    let of_update = of_update.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key.to_owned());
    let before = figures.iter().filter(|(_, at)| scene.is_solved_at_once() && *at < scene.stop.steps);
    let keys: Vec<String> = of_update.chain(before.map(|(key, at)| format!("{key} = {at}"))).collect();
    (!keys.is_empty()).then(|| {
        format!(
            "without effect on an equilibrium that is solved for: {}; leave [equilibrium] out to step",
            named(keys)
        )
    })
}

/// The first keys, and how many more there are.
fn named(mut keys: Vec<String>) -> String {
    let more = keys.len().saturating_sub(NAMED);
    keys.truncate(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", keys.join(", "))
}

/// The warning about keys that are beyond the last of something, which `bound` sets; none without keys.
pub(crate) fn beyond(last: &str, keys: impl Iterator<Item = String>, bound: &str) -> Option<String> {
    let keys: Vec<String> = keys.collect();
    (!keys.is_empty())
        .then(|| format!("beyond {last}, and without effect: {}; lower them, or raise {bound}", named(keys)))
}
