//! Cuts that miss the body.

#[cfg(feature = "export")]
use crate::engine::Engine;
use crate::flock::action::ActionKind;
use crate::flock::body::Body;
use crate::flock::neighbourhood::Neighbours;
use crate::geometry::shape::{Segment, segments_cross};
use crate::scene::Scene;

/// The warnings before a run. The body may have moved to where an action cuts by its step.
pub(crate) fn planned(scene: &Scene, body: &Body, neighbours: &Neighbours) -> Vec<String> {
    // A part does not see the bonds of the others.
    if body.part.is_some() {
        return Vec::new();
    }
    let at_once = scene.cuts.iter().enumerate().filter(|(_, cut)| !crosses(**cut, body, neighbours));
    let actions = scene.actions.iter().enumerate().filter_map(|(k, action)| match action.what {
        ActionKind::Cut(cut) if action.at <= scene.stop.steps => Some((k, action.at, cut)),
        _ => None,
    });
    let later = actions.filter(|(.., cut)| !crosses(*cut, body, neighbours)).map(|(k, at, _)| {
        format!(
            "no bond crosses the cut of actions[{k}] where the body begins: without effect unless the body has moved \
             there by step {at}"
        )
    });
    at_once.map(|(k, _)| idle(&format!("cuts[{k}]"))).chain(later).collect()
}

/// The warnings after a run, made by all ranks together where each has a part of the body.
#[cfg(feature = "export")]
pub(crate) fn made(scene: &Scene, engine: &Engine) -> Vec<String> {
    let neighbours = &engine.flock().neighbours;
    let is_made = |cut: &Segment| engine.any_of_parts(crosses(*cut, engine.body(), neighbours));
    let at_once = scene.cuts.iter().enumerate().filter(|(_, cut)| !is_made(cut));
    let at_once = at_once.map(|(k, _)| idle(&format!("cuts[{k}]")));
    // A bond that broke by itself at the same step counts too: it cannot be distinguished.
    let breaks_at = |step: usize| engine.breaks().iter().any(|one| one.step == step);
    let actions = scene.actions.iter().enumerate().filter(|(_, action)| action.is_cut());
    let later = actions.filter(|(_, action)| action.at <= engine.step() && !breaks_at(action.at));
    at_once.chain(later.map(|(k, _)| idle(&format!("the cut of actions[{k}]")))).collect()
}

fn idle(cut: &str) -> String {
    format!("no bond crosses {cut}, which is without effect: lay it through the body")
}

/// Whether a bond of the particles of this part crosses a cut, in the reference configuration.
fn crosses((from, to): Segment, body: &Body, neighbours: &Neighbours) -> bool {
    let at = |i: usize| body.reference.get(i);
    let is_cut = |j: usize| neighbours.of(j).iter().any(|&k| segments_cross(at(j), at(k as usize), from, to));
    body.owned().any(is_cut)
}
