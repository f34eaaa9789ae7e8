//! What tells two scenes apart.

use serde_json::Value;

/// The first key with another value, and both values.
pub fn first_difference(then: &Value, now: &Value, key: String) -> Option<String> {
    if then == now {
        return None;
    }
    let at = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (then, now) {
        (Value::Object(a), Value::Object(b)) => {
            let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
            names.into_iter().find_map(|name| {
                let of = |map: &serde_json::Map<_, _>| map.get(name).cloned().unwrap_or_default();
                first_difference(&of(a), &of(b), at(name))
            })
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let pairs = a.iter().zip(b).enumerate();
            pairs.into_iter().find_map(|(n, (a, b))| first_difference(a, b, format!("{key}[{n}]")))
        }
        _ => Some(format!("`{key}` was {}, is {}", shortly(then), shortly(now))),
    }
}

fn shortly(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}
