//! Declarations of parameters: type, range, conditions. Pure.

use std::fmt::Debug;
use std::ops::RangeInclusive;

use super::Value;
use crate::messages::rcl_interfaces::{FloatingPointRange, IntegerRange, ParameterDescriptor};
use crate::messages::said;

/// A validator: `Err` with the reason refuses a value.
pub type Check = Box<dyn Fn(&str, &Value) -> Result<(), String> + Send>;

/// A parameter as the node declares it.
pub struct Declaration {
    /// As peers receive it.
    pub(super) descriptor: ParameterDescriptor,
    pub(super) value: Value,
    checks: Vec<Check>,
}

impl Declaration {
    /// A parameter with its default value, which fixes its type.
    pub fn new(name: &str, default: impl Into<Value>) -> Self {
        let value = default.into();
        let descriptor =
            ParameterDescriptor { name: name.into(), kind: value.kind(), ..ParameterDescriptor::default() };
        Self { descriptor, value, checks: Vec::new() }
    }

    pub fn name(&self) -> &str {
        &self.descriptor.name
    }

    /// Meaning and unit, for people.
    #[must_use]
    pub fn describe(mut self, description: &str) -> Self {
        self.descriptor.description = description.into();
        self
    }

    /// Smallest and largest number.
    #[must_use]
    pub fn range(mut self, range: RangeInclusive<f64>) -> Self {
        let (from_value, to_value) = range.into_inner();
        self.descriptor.floating_point_range = vec![FloatingPointRange { from_value, to_value, step: 0.0 }];
        self
    }

    /// Smallest and largest whole number.
    #[must_use]
    pub fn integer_range(mut self, range: RangeInclusive<i64>) -> Self {
        let (from_value, to_value) = range.into_inner();
        self.descriptor.integer_range = vec![IntegerRange { from_value, to_value, step: 0 }];
        self
    }

    /// Set at the start and never again.
    #[must_use]
    pub fn read_only(mut self) -> Self {
        self.descriptor.read_only = true;
        self
    }

    /// One more condition on new values, and in words for people.
    #[must_use]
    pub fn checked(
        mut self,
        constraints: &str,
        check: impl Fn(&str, &Value) -> Result<(), String> + Send + 'static,
    ) -> Self {
        let known = &mut self.descriptor.additional_constraints;
        let before = if known.is_empty() { "" } else { "; " };
        *known += &format!("{before}{constraints}");
        self.checks.push(Box::new(check));
        self
    }

    /// The value as it would be stored.
    pub(super) fn admit(&self, value: Value) -> Result<Value, Refusal> {
        let name = || self.name().to_owned();
        let value = value.widened(&self.value);
        if value.kind() != self.value.kind() {
            let (expected, found) = (self.value.kind_name(), value.kind_name());
            return Err(Refusal::Type { name: name(), expected, found, value: said(&value.to_string()) });
        }
        if matches!(&value, Value::Double(number) if number.is_nan()) {
            return Err(Refusal::NotANumber { name: name() });
        }
        let ParameterDescriptor { floating_point_range, integer_range, .. } = &self.descriptor;
        match (&floating_point_range[..], &integer_range[..], &value) {
            ([range], _, Value::Double(number)) => self.within(range.from_value, range.to_value, *number)?,
            (_, [range], Value::Integer(number)) => self.within(range.from_value, range.to_value, *number)?,
            _ => {}
        }
        for check in &self.checks {
            check(self.name(), &value).map_err(|reason| Refusal::Vetoed { name: name(), reason })?;
        }
        Ok(value)
    }

    fn within<T: PartialOrd + Debug>(&self, from: T, to: T, value: T) -> Result<(), Refusal> {
        if (&from..=&to).contains(&&value) {
            return Ok(());
        }
        let more = match &self.descriptor.additional_constraints {
            none if none.is_empty() => String::new(),
            words => format!(": {words}"),
        };
        let (value, allowed) = (format!("{value:?}"), format!("{from:?} to {to:?}{more}"));
        Err(Refusal::Range { name: self.name().to_owned(), value, allowed })
    }
}

/// Why a parameter was not set or declared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    #[error("parameter {name} has not been declared")]
    Undeclared { name: String },
    #[error("parameter {name} is declared already")]
    Declared { name: String },
    #[error("parameter {name} is read-only: give it at the start (-p {name}:=VALUE)")]
    ReadOnly { name: String },
    #[error("parameter {name} cannot be unset")]
    Unset { name: String },
    #[error("parameter {name} is a {expected}, {value} is a {found}")]
    Type { name: String, expected: &'static str, found: &'static str, value: String },
    #[error("parameter {name} must be a number")]
    NotANumber { name: String },
    #[error("parameter {name} = {value} is not within {allowed}")]
    Range { name: String, value: String, allowed: String },
    #[error("parameter {name}: {reason}")]
    Vetoed { name: String, reason: String },
}
