//! Values of parameters.

use crate::messages::rcl_interfaces::ParameterValue;

/// A parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Bool(bool),
    Integer(i64),
    Double(f64),
    String(String),
    Bytes(Vec<u8>),
    Bools(Vec<bool>),
    Integers(Vec<i64>),
    Doubles(Vec<f64>),
    Strings(Vec<String>),
}

impl Value {
    /// Number in `rcl_interfaces/msg/ParameterType`.
    pub fn kind(&self) -> u8 {
        match self {
            Value::Bool(_) => 1,
            Value::Integer(_) => 2,
            Value::Double(_) => 3,
            Value::String(_) => 4,
            Value::Bytes(_) => 5,
            Value::Bools(_) => 6,
            Value::Integers(_) => 7,
            Value::Doubles(_) => 8,
            Value::Strings(_) => 9,
        }
    }

    /// Name of the type as ROS 2's tools print it.
    pub(crate) fn kind_name(&self) -> &'static str {
        match self {
            Value::Bool(_) => "bool",
            Value::Integer(_) => "integer",
            Value::Double(_) => "double",
            Value::String(_) => "string",
            Value::Bytes(_) => "byte_array",
            Value::Bools(_) => "bool_array",
            Value::Integers(_) => "integer_array",
            Value::Doubles(_) => "double_array",
            Value::Strings(_) => "string_array",
        }
    }

    pub fn as_bool(&self) -> Option<bool> {
        if let Value::Bool(value) = self { Some(*value) } else { None }
    }

    pub(crate) fn as_integer(&self) -> Option<i64> {
        if let Value::Integer(value) = self { Some(*value) } else { None }
    }

    pub(crate) fn as_double(&self) -> Option<f64> {
        if let Value::Double(value) = self { Some(*value) } else { None }
    }

    pub fn as_str(&self) -> Option<&str> {
        if let Value::String(value) = self { Some(value) } else { None }
    }

    /// Whole numbers where `like` is a number: `5` typed for `5.0`. Anything else as it is.
    pub fn widened(self, like: &Value) -> Value {
        match (self, like) {
            (Value::Integer(value), Value::Double(_)) => Value::Double(value as f64),
            (Value::Integers(values), Value::Doubles(_)) => {
                Value::Doubles(values.into_iter().map(|value| value as f64).collect())
            }
            // An empty list says nothing of its type.
            (value, Value::Doubles(_)) if value.is_empty_list() => Value::Doubles(Vec::new()),
            (value, _) => value,
        }
    }

    fn is_empty_list(&self) -> bool {
        match self {
            Value::Bytes(list) => list.is_empty(),
            Value::Bools(list) => list.is_empty(),
            Value::Integers(list) => list.is_empty(),
            Value::Strings(list) => list.is_empty(),
            _ => false,
        }
    }

    /// As it travels.
    pub fn to_wire(&self) -> ParameterValue {
        let mut wire = ParameterValue { kind: self.kind(), ..ParameterValue::default() };
        match self.clone() {
            Value::Bool(value) => wire.bool_value = value,
            Value::Integer(value) => wire.integer_value = value,
            Value::Double(value) => wire.double_value = value,
            Value::String(value) => wire.string_value = value,
            Value::Bytes(value) => wire.byte_array_value = value,
            Value::Bools(value) => wire.bool_array_value = value,
            Value::Integers(value) => wire.integer_array_value = value,
            Value::Doubles(value) => wire.double_array_value = value,
            Value::Strings(value) => wire.string_array_value = value,
        }
        wire
    }

    /// From the wire; `None` for "not set" and for types that do not exist.
    pub(crate) fn from_wire(wire: ParameterValue) -> Option<Value> {
        Some(match wire.kind {
            1 => Value::Bool(wire.bool_value),
            2 => Value::Integer(wire.integer_value),
            3 => Value::Double(wire.double_value),
            4 => Value::String(wire.string_value),
            5 => Value::Bytes(wire.byte_array_value),
            6 => Value::Bools(wire.bool_array_value),
            7 => Value::Integers(wire.integer_array_value),
            8 => Value::Doubles(wire.double_array_value),
            9 => Value::Strings(wire.string_array_value),
            _ => return None,
        })
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Bool(value) => write!(f, "{value}"),
            Value::Integer(value) => write!(f, "{value}"),
            Value::Double(value) => write!(f, "{value:?}"),
            Value::String(value) => write!(f, "{value:?}"),
            Value::Bytes(values) => write!(f, "{values:?}"),
            Value::Bools(values) => write!(f, "{values:?}"),
            Value::Integers(values) => write!(f, "{values:?}"),
            Value::Doubles(values) => write!(f, "{values:?}"),
            Value::Strings(values) => write!(f, "{values:?}"),
        }
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Value::Bool(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Value::Integer(value)
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Value::Double(value)
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Value::String(value.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_survives_the_wire() {
        let values = [
            Value::Bool(true),
            Value::Integer(-3),
            Value::Double(2.5),
            Value::String("a".into()),
            Value::Bytes(vec![1, 2]),
            Value::Bools(vec![true, false]),
            Value::Integers(vec![4, -5]),
            Value::Doubles(vec![0.5]),
            Value::Strings(vec!["b".into(), String::new()]),
        ];
        for value in values {
            assert_eq!(Value::from_wire(value.to_wire()), Some(value));
        }
        assert_eq!(Value::from_wire(ParameterValue::default()), None);
        assert_eq!(Value::from_wire(ParameterValue { kind: 10, ..ParameterValue::default() }), None);
    }

    #[test]
    fn whole_numbers_are_read_as_numbers_only_where_numbers_are_meant() {
        assert_eq!(Value::Integer(5).widened(&Value::Double(0.0)), Value::Double(5.0));
        assert_eq!(Value::Integers(vec![5]).widened(&Value::Doubles(vec![])), Value::Doubles(vec![5.0]));
        assert_eq!(Value::Strings(vec![]).widened(&Value::Doubles(vec![])), Value::Doubles(vec![]));
        assert_eq!(Value::Integer(5).widened(&Value::Bool(true)), Value::Integer(5));
        assert_eq!(Value::Double(5.0).widened(&Value::Integer(0)), Value::Double(5.0));
    }
}
