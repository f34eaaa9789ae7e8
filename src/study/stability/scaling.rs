//! A scene in another unit of length: every length of it multiplied, everything else as it was.

use serde_json::{Map, Value};

use crate::scene::Scene;

/// Tables of a scene that hold lengths, or forces that go with them.
const TABLES: [&str; 10] =
    ["lattice", "body", "neighbours", "rule", "material", "loads", "roles", "fracture", "cuts", "record"];

/// In place of a number beyond the doubles, to be refused as such.
const BEYOND: &str = "1e999";

/// Keys of lengths, wherever they stand.
#[rustfmt::skip]
const LENGTHS: [&str; 21] = [
    "between", "spacing", "a", "b", "min", "max", "centre", "radius", "vertices", "anchor", "depth",
    "per_step", "displacement", "about", "amplitude", "length", "distance", "thickness", "scale", "to",
    "places",
];

/// Overrides that make the scene `factor` times as large: strains, stresses and angles stay, a force grows
/// with the square, a weight per volume shrinks.
pub fn overrides(scene: &Scene, factor: f64) -> Vec<String> {
    let raw = serde_json::to_value(&scene.raw).unwrap_or_default();
    let scaled = |key: &&str| {
        let value = scale(raw.get(*key)?, key, factor);
        (!value.is_null()).then(|| format!("{key}={}", toml(&value)))
    };
    TABLES.iter().filter_map(scaled).collect()
}

/// One table of a scene as an override.
pub fn table(scene: &Scene, key: &str) -> Option<String> {
    let raw = serde_json::to_value(&scene.raw).unwrap_or_default();
    raw.get(key).filter(|value| !value.is_null()).map(|value| format!("{key}={}", toml(value)))
}

fn scale(value: &Value, key: &str, factor: f64) -> Value {
    match value {
        Value::Object(entries) => {
            let child = |(name, value): (&String, &Value)| {
                let by = power(entries, name, key).map_or(1.0, |power| factor.powi(power));
                let changed = if by == 1.0 { scale(value, name, factor) } else { times(value, by) };
                (name.clone(), changed)
            };
            Value::Object(entries.iter().map(child).collect())
        }
        Value::Array(items) => items.iter().map(|item| scale(item, key, factor)).collect(),
        other => other.clone(),
    }
}

/// Power of a length that the number at `name` in a table goes with; `parent` is the key of the table.
fn power(table: &Map<String, Value>, name: &str, parent: &str) -> Option<i32> {
    let kind = table.get("kind").and_then(Value::as_str);
    match (name, kind, parent) {
        // A number of cells.
        ("radius", Some("chebyshev"), _) => None,
        ("force", Some("force"), _) => Some(2),
        ("force", Some("body"), _) => Some(-1),
        ("from", _, "cuts" | "profile") | ("from", Some("path"), _) => Some(1),
        ("above" | "below", ..) => {
            Some(if table.get("quantity").and_then(Value::as_str) == Some("pe1") { 2 } else { 1 })
        }
        (name, ..) => LENGTHS.contains(&name).then_some(1),
    }
}

fn times(value: &Value, by: f64) -> Value {
    match value {
        Value::Number(number) => {
            let product = number.as_f64().map(|number| by * number).filter(|product| product.is_finite());
            product.map_or_else(|| BEYOND.into(), Value::from)
        }
        Value::Array(items) => items.iter().map(|item| times(item, by)).collect(),
        other => other.clone(),
    }
}

/// A value as TOML in one line; what is null is left out.
pub fn toml(value: &Value) -> String {
    match value {
        Value::Object(entries) => {
            let given = entries.iter().filter(|(_, value)| !value.is_null());
            let all: Vec<String> = given.map(|(key, value)| format!("{key}={}", toml(value))).collect();
            format!("{{{}}}", all.join(","))
        }
        Value::Array(items) => {
            format!("[{}]", items.iter().map(toml).collect::<Vec<_>>().join(","))
        }
        // With an exponent, or TOML would take 1e300 written out for an integer.
        Value::Number(number) if number.is_f64() => format!("{:e}", number.as_f64().unwrap_or_default()),
        Value::String(text) if text == BEYOND => BEYOND.into(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BodySource, bundled};

    #[test]
    fn every_bundled_scene_is_the_same_scene_in_another_unit() {
        for one in crate::scene::bundled::SCENES {
            let scene = one.load(&[]).expect("loads");
            let scaled = one.load(&overrides(&scene, 4.0)).unwrap_or_else(|e| panic!("{}: {e}", one.name));
            assert_eq!(scaled.lattice.spacing(), 4.0 * scene.lattice.spacing(), "{}", one.name);
            let [here, there] = [&scene, &scaled].map(|s| {
                use crate::flock::body::Body;
                let BodySource::Cut(cut) = &s.body else { panic!("{}: a bundled body is cut", one.name) };
                let built = Body::build(s.lattice.clone(), cut, &s.neighbourhood, s.frame);
                built.expect("builds").0.reference.clone()
            });
            assert_eq!(here.len(), there.len(), "{}", one.name);
            for (p, q) in here.iter().zip(there.iter()) {
                assert_eq!(p.map(|v| 4.0 * v), q, "{}", one.name);
            }
        }
        let beam = bundled("beam-loaded").expect("bundled").load(&[]).expect("loads");
        let text = overrides(&beam, 0.5).join("\n");
        assert!(text.contains("thickness=5e-1") && text.contains("traction=[0e0,5e1]"), "{text}");
    }
}
