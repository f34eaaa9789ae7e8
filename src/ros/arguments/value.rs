//! Parameter values, typed as `rcl_yaml_param_parser` types them.

use super::error::Reason;
use super::yaml::{self, Node, Scalar};

/// A parameter's value: the types of `rcl_interfaces/msg/ParameterValue` that text can have.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Bool(bool),
    Integer(i64),
    Double(f64),
    Text(String),
    Bools(Vec<bool>),
    Integers(Vec<i64>),
    Doubles(Vec<f64>),
    Texts(Vec<String>),
}

const ONE_VALUE: &str = "write one value or a list of values of one type: 1.5, true, word, [1.0, 2.0]";

impl Value {
    /// Reads the YAML text of one value.
    pub(super) fn parse(text: &str) -> Result<Self, Reason> {
        match yaml::parse(text).map_err(|error| (error.reason, error.help))? {
            Some(node) => Self::from_node(&node),
            None => Err(no_value()),
        }
    }

    pub(super) fn from_node(node: &Node) -> Result<Self, Reason> {
        match node {
            Node::Scalar(scalar) => Self::from_scalar(scalar),
            Node::Sequence(items) => Self::from_items(items),
            Node::Mapping(_) => Err(("is a mapping, not a value".into(), ONE_VALUE)),
        }
    }

    /// The type a scalar has by its look: truth, whole number, number, text, in this order; quoted or
    /// tagged `!!str` it is text.
    fn from_scalar(scalar: &Scalar) -> Result<Self, Reason> {
        let text = scalar.text.as_str();
        if scalar.is_text {
            return Ok(Self::Text(text.into()));
        }
        if text.is_empty() {
            return Err(no_value());
        }
        let number = || integer(text).map(Self::Integer).or_else(|| double(text).map(Self::Double));
        let value = truth(text).map(Self::Bool).or_else(number);
        Ok(value.unwrap_or_else(|| Self::Text(text.into())))
    }

    fn from_items(items: &[Node]) -> Result<Self, Reason> {
        let mut values = Vec::with_capacity(items.len());
        for item in items {
            match item {
                Node::Scalar(scalar) => values.push(Self::from_scalar(scalar)?),
                _ => return Err(("has a list or a mapping inside a list".into(), ONE_VALUE)),
            }
        }
        let Some(first) = values.first() else {
            return Err(("is an empty list, which has no type".into(), "leave the parameter out"));
        };
        if let Some(other) = values.iter().find(|value| value.type_name() != first.type_name()) {
            let reason = format!("mixes {} and {} in one list", first.type_name(), other.type_name());
            return Err((reason, "give all values one type: [1.0, 2.5], not [1, 2.5]"));
        }
        // All have the type of the first.
        macro_rules! list {
            ($of:ident: $one:ident) => {{
                let content = |value| if let Self::$one(content) = value { Some(content) } else { None };
                Self::$of(values.into_iter().filter_map(content).collect())
            }};
        }
        Ok(match first {
            Self::Bool(_) => list!(Bools: Bool),
            Self::Integer(_) => list!(Integers: Integer),
            Self::Double(_) => list!(Doubles: Double),
            _ => list!(Texts: Text),
        })
    }

    /// The name of this type in messages.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Integer(_) => "integer",
            Self::Double(_) => "double",
            Self::Text(_) => "string",
            Self::Bools(_) => "bool array",
            Self::Integers(_) => "integer array",
            Self::Doubles(_) => "double array",
            Self::Texts(_) => "string array",
        }
    }
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
