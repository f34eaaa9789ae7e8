//! Values of parameters.

use crate::messages::rcl_interfaces::ParameterValue;

/// The types of parameters: name of each here, its content, its number in `rcl_interfaces/msg/ParameterType`, its name as
/// ROS 2's tools print it, and the field of [`ParameterValue`] that it travels in.
macro_rules! types {
    ($($kind:ident($content:ty) = $number:literal, $name:literal, $field:ident;)+) => {
        /// A parameter's value.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Value {
            $($kind($content),)+
        }

        impl Value {
            /// Number in `rcl_interfaces/msg/ParameterType`.
            pub fn kind(&self) -> u8 {
                match self {
                    $(Value::$kind(_) => $number,)+
                }
            }

            /// Name of the type as ROS 2's tools print it.
            pub(crate) fn kind_name(&self) -> &'static str {
                match self {
                    $(Value::$kind(_) => $name,)+
                }
            }

            /// As it travels.
            pub fn to_wire(&self) -> ParameterValue {
                let mut wire = ParameterValue { kind: self.kind(), ..ParameterValue::default() };
                match self.clone() {
                    $(Value::$kind(value) => wire.$field = value,)+
                }
                wire
            }

            /// From the wire; `None` for "not set" and for types that do not exist.
            pub(crate) fn from_wire(wire: ParameterValue) -> Option<Value> {
                match wire.kind {
                    $($number => Some(Value::$kind(wire.$field)),)+
                    _ => None,
                }
            }
        }

        impl std::fmt::Display for Value {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Value::$kind(value) => write!(f, "{value:?}"),)+
                }
            }
        }
    };
}

types! {
    Bool(bool) = 1, "bool", bool_value;
    Integer(i64) = 2, "integer", integer_value;
    Double(f64) = 3, "double", double_value;
    String(String) = 4, "string", string_value;
    Bytes(Vec<u8>) = 5, "byte_array", byte_array_value;
    Bools(Vec<bool>) = 6, "bool_array", bool_array_value;
    Integers(Vec<i64>) = 7, "integer_array", integer_array_value;
    Doubles(Vec<f64>) = 8, "double_array", double_array_value;
    Strings(Vec<String>) = 9, "string_array", string_array_value;
}

impl Value {
    pub fn as_bool(&self) -> Option<bool> {
        if let Value::Bool(value) = self { Some(*value) } else { None }
    }

    pub(crate) fn as_integer(&self) -> Option<i64> {
        if let Value::Integer(value) = self { Some(*value) } else { None }
    }

    pub(crate) fn as_double(&self) -> Option<f64> {
        if let Value::Double(value) = self { Some(*value) } else { None }
    }

    /// Of a number, whole or not.
    pub(crate) fn as_number(&self) -> Option<f64> {
        self.as_double().or(self.as_integer().map(|number| number as f64))
    }

    pub fn as_str(&self) -> Option<&str> {
        if let Value::String(value) = self { Some(value) } else { None }
    }

    /// Whole numbers where `like` is a number: `5` typed for `5.0`. Anything else as it is.
    pub fn widened(self, like: &Value) -> Value {
        match (self, like) {
            (Value::Integer(value), Value::Double(_)) => Value::Double(value as f64),
            (value, _) => value,
        }
    }
}

macro_rules! from {
    ($($content:ty => $kind:ident),+) => {$(
        impl From<$content> for Value {
            fn from(value: $content) -> Self {
                Value::$kind(value.into())
            }
        }
    )+};
}

from!(bool => Bool, i64 => Integer, f64 => Double, &str => String);

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
        assert_eq!(Value::Integer(5).widened(&Value::Bool(true)), Value::Integer(5));
        assert_eq!(Value::Double(5.0).widened(&Value::Integer(0)), Value::Double(5.0));
    }
}
