//! What a scene asks for after its last step.

use crate::scene::Scene;

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
    if unit == "step" {
        stepped.append(&mut counted);
    }
    let of = |unit: &str, last: usize, keys: Vec<(String, usize)>, bound| {
        let late = keys.into_iter().filter(|(_, at)| *at > last).map(|(key, at)| format!("{key} = {at}"));
        beyond(&format!("the last {unit}, {last}"), late, bound)
    };
    let steps = of("step", scene.stop.steps, stepped, "stop.steps");
    steps.into_iter().chain(of(unit, most, counted, "load_steps")).collect()
}

/// The warning about keys that are beyond the last of something, which `bound` sets; none without keys.
pub(crate) fn beyond(last: &str, keys: impl Iterator<Item = String>, bound: &str) -> Option<String> {
    let mut keys: Vec<String> = keys.collect();
    let more = keys.len().saturating_sub(NAMED);
    keys.truncate(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!keys.is_empty()).then(|| {
        format!("beyond {last}, and without effect: {}{more}; lower them, or raise {bound}", keys.join(", "))
    })
}
