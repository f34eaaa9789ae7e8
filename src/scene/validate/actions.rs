//! Actions: what is done to the body while it is stepped, each change checked as the file is.

use std::path::Path;

use super::{Refuse, validate};
use crate::flock::action::{Action, ActionKind};
use crate::scene::Scene;
use crate::scene::document::Document;
use crate::scene::document::problem::SceneError;
use crate::scene::raw::*;

/// Tables whose keys may change while the body is stepped: they leave particles, neighbours and roles as they are.
pub const CHANGEABLE: [&str; 5] = ["rule", "update", "material", "loads", "fracture"];

/// Most actions of a scene; each change of keys is a scene of its own.
pub const MOST_ACTIONS: usize = 4096;

/// The actions of a scene in the order of their steps.
///
/// # Errors
/// Names an action that cannot be done, or that belongs to a scene that is not stepped.
pub fn actions(
    raw: &RawScene,
    (name, document, folder): (&str, &Document, Option<&Path>),
    refuse: Refuse<'_>,
) -> Result<Vec<Action<Box<Scene>>>, SceneError> {
    if raw.actions.is_empty() {
        return Ok(Vec::new());
    }
    if raw.equilibrium.is_some() {
        let message = "the body goes straight to rest: there are no steps to act at".into();
        return Err(refuse("actions", message, "leave [equilibrium] out, or the actions"));
    }
    if raw.actions.len() > MOST_ACTIONS {
        let message = format!("there are {} actions, at most {MOST_ACTIONS} are taken", raw.actions.len());
        return Err(refuse("actions", message, "leave some out"));
    }
    let late = raw.actions.windows(2).position(|pair| pair[0].at > pair[1].at);
    if let Some(k) = late {
        let message = format!("step {} comes before step {}", raw.actions[k + 1].at, raw.actions[k].at);
        return Err(refuse(&format!("actions[{}].at", k + 1), message, "list actions by ascending step"));
    }
    let mut set: Vec<String> = Vec::new();
    let action = |(k, action): (usize, &RawAction)| {
        let key = format!("actions[{k}].what");
        let what = match &action.what {
            RawActionKind::Cut { from, to } if from == to => {
                let message = format!("from = to = [{}, {}]: the cut has no length", from[0], from[1]);
                return Err(refuse(&format!("{key}.to"), message, "give its other end"));
            }
            RawActionKind::Cut { from, to } => ActionKind::Cut((*from, *to)),
            RawActionKind::Set { keys } => {
                for (n, text) in keys.iter().enumerate() {
                    require_changeable(&format!("{key}.keys[{n}]"), text, refuse)?;
                }
                set.extend_from_slice(keys);
                let changed = changed(name, document, &set, folder).map_err(|error| {
                    let help = "each key is checked as on the command line, after those before it";
                    refuse(&format!("{key}.keys"), error.to_string(), help)
                })?;
                ActionKind::Follow(Box::new(changed))
            }
        };
        Ok(Action { at: action.at, what })
    };
    raw.actions.iter().enumerate().map(action).collect()
}

/// Whether bonds are cut on the way.
pub fn cuts(raw: &RawScene) -> bool {
    raw.actions.iter().any(is_cut)
}

fn is_cut(action: &RawAction) -> bool {
    matches!(action.what, RawActionKind::Cut { .. })
}

fn require_changeable(key: &str, text: &str, refuse: Refuse<'_>) -> Result<(), SceneError> {
    if is_changeable(text) {
        return Ok(());
    }
    let message = format!("only keys of {} change while a body is stepped", CHANGEABLE.join(", "));
    Err(refuse(key, message, "set other keys from the start"))
}

/// Whether an override concerns a key that may change while a body is stepped.
pub fn is_changeable(text: &str) -> bool {
    let table = text.split(['.', '[', '=']).next().unwrap_or_default().trim();
    CHANGEABLE.contains(&table)
}

/// The scene with these keys changed from the start. Keeps only its cut actions, which some rules do not support.
fn changed(
    name: &str,
    document: &Document,
    set: &[String],
    folder: Option<&Path>,
) -> Result<Scene, SceneError> {
    let document = document.with(set)?;
    let mut raw: RawScene = document.read(&super::schema())?;
    raw.actions.retain(is_cut);
    validate(name, raw, document, folder)
}
