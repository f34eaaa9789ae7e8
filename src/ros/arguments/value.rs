//! Parameter values, typed as `rcl_yaml_param_parser` types them.

use super::error::Reason;
use super::yaml::{self, Node, Scalar};
use crate::ros::edge::parameters::Value;

const ONE_VALUE: &str = "write one value or a list of values of one type: 1.5, true, word, [1.0, 2.0]";

/// Reads the YAML text of one value.
pub(super) fn parse(text: &str) -> Result<Value, Reason> {
    match yaml::parse(text).map_err(|error| (error.reason, error.help))? {
        Some(node) => from_node(&node),
        None => Err(no_value()),
    }
}

pub(super) fn from_node(node: &Node) -> Result<Value, Reason> {
    match node {
        Node::Scalar(scalar) => from_scalar(scalar),
        Node::Sequence(items) => from_items(items),
        Node::Mapping(_) => Err(("is a mapping, not a value".into(), ONE_VALUE)),
    }
}

/// The type a scalar has by its look: truth, whole number, number, text, in this order; quoted or
/// tagged `!!str` it is text.
fn from_scalar(scalar: &Scalar) -> Result<Value, Reason> {
    let text = scalar.text.as_str();
    if scalar.is_text {
        return Ok(Value::String(text.into()));
    }
    if text.is_empty() {
        return Err(no_value());
    }
    let number = || integer(text).map(Value::Integer).or_else(|| double(text).map(Value::Double));
    let value = truth(text).map(Value::Bool).or_else(number);
    Ok(value.unwrap_or_else(|| Value::String(text.into())))
}

fn from_items(items: &[Node]) -> Result<Value, Reason> {
    let mut values = Vec::with_capacity(items.len());
    for item in items {
        match item {
            Node::Scalar(scalar) => values.push(from_scalar(scalar)?),
            _ => return Err(("has a list or a mapping inside a list".into(), ONE_VALUE)),
        }
    }
    let Some(first) = values.first() else {
        return Err(("is an empty list, which has no type".into(), "leave the parameter out"));
    };
    if let Some(other) = values.iter().find(|value| value.kind_name() != first.kind_name()) {
        let reason = format!("mixes {} and {} in one list", first.kind_name(), other.kind_name());
        return Err((reason, "give all values one type: [1.0, 2.5], not [1, 2.5]"));
    }
    // All have the type of the first.
    macro_rules! list {
        ($of:ident: $one:ident) => {{
            let content = |value| if let Value::$one(content) = value { Some(content) } else { None };
            Value::$of(values.into_iter().filter_map(content).collect())
        }};
    }
    Ok(match first {
        Value::Bool(_) => list!(Bools: Bool),
        Value::Integer(_) => list!(Integers: Integer),
        Value::Double(_) => list!(Doubles: Double),
        _ => list!(Strings: String),
    })
}

fn no_value() -> Reason {
    ("has no value".into(), "write a value, or '' for an empty text")
}

fn truth(text: &str) -> Option<bool> {
    match text {
        "y" | "Y" | "yes" | "Yes" | "YES" | "true" | "True" | "TRUE" | "on" | "On" | "ON" => Some(true),
        "n" | "N" | "no" | "No" | "NO" | "false" | "False" | "FALSE" | "off" | "Off" | "OFF" => Some(false),
        _ => None,
    }
}

/// A whole number as C's `strtoll` with base 0 reads it: decimal, `0x` hexadecimal, `0` octal.
pub(super) fn integer(text: &str) -> Option<i64> {
    let (negative, digits) = match text.as_bytes().first()? {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    let (base, digits) = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(digits) => (16, digits),
        None if digits.len() > 1 && digits.starts_with('0') => (8, &digits[1..]),
        None => (10, digits),
    };
    if !digits.starts_with(|digit: char| digit.is_digit(base)) {
        return None;
    }
    let size = i128::from_str_radix(digits, base).ok()?;
    i64::try_from(if negative { -size } else { size }).ok()
}

/// A number as C's `strtod` reads it (hexadecimal ones left out), or YAML's `.inf` and `.nan`.
/// One too large for 64 bits is no number.
fn double(text: &str) -> Option<f64> {
    match text {
        ".nan" | ".NaN" | ".NAN" => return Some(f64::NAN),
        ".inf" | ".Inf" | ".INF" | "+.inf" | "+.Inf" | "+.INF" => return Some(f64::INFINITY),
        "-.inf" | "-.Inf" | "-.INF" => return Some(f64::NEG_INFINITY),
        _ => {}
    }
    let number: f64 = text.parse().ok()?;
    let overflowed = number.is_infinite() && text.contains(|letter: char| letter.is_ascii_digit());
    (!overflowed).then_some(number)
}
