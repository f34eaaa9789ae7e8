//! Declared parameters and what may become of them. Pure.

use std::collections::BTreeMap;

use super::Value;
use super::declaration::{Declaration, Refusal};
use crate::messages::rcl_interfaces::ParameterDescriptor;
use crate::messages::said;

/// A parameter that changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub name: String,
    pub value: Value,
}

/// The parameters of a node, by name.
#[derive(Default)]
pub struct Store {
    declared: BTreeMap<String, Declaration>,
    changes: Vec<Change>,
}

impl Store {
    /// Declares a parameter; `start` (from the command line or a file) stands in for its default and is
    /// checked like any value, read-only parameters included.
    ///
    /// # Errors
    /// A name declared twice, or a start value that is refused.
    pub fn declare(&mut self, mut declaration: Declaration, start: Option<Value>) -> Result<(), Refusal> {
        let name = declaration.name().to_owned();
        if self.declared.contains_key(&name) {
            return Err(Refusal::Declared { name });
        }
        if let Some(start) = start {
            declaration.value = declaration.admit(start)?;
        }
        self.declared.insert(name, declaration);
        Ok(())
    }

    pub fn get(&self, name: &str) -> Option<&Value> {
        self.declared.get(name).map(|declaration| &declaration.value)
    }

    /// Names and values, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.declared.iter().map(|(name, declaration)| (name.as_str(), &declaration.value))
    }

    /// Sets one parameter.
    ///
    /// # Errors
    /// The reason; the value is as before.
    pub fn set(&mut self, name: &str, value: Option<Value>) -> Result<(), Refusal> {
        let value = self.admit(name, value)?;
        self.apply(name, value);
        Ok(())
    }

    /// Sets all or none.
    ///
    /// # Errors
    /// The first reason; every value is as before.
    pub(crate) fn set_atomically(&mut self, settings: Vec<(String, Option<Value>)>) -> Result<(), Refusal> {
        let admitted: Result<Vec<_>, _> = settings
            .into_iter()
            .map(|(name, value)| self.admit(&name, value).map(|value| (name, value)))
            .collect();
        for (name, value) in admitted? {
            self.apply(&name, value);
        }
        Ok(())
    }

    fn admit(&self, name: &str, value: Option<Value>) -> Result<Value, Refusal> {
        let declaration = self.declared.get(name).ok_or_else(|| Refusal::Undeclared { name: said(name) })?;
        let value = value.ok_or_else(|| Refusal::Unset { name: name.into() });
        // What it has already may be written again, whatever the node's state: `ros2 param load` does so with what
        // `ros2 param dump` wrote.
        let value = value.map(|value| value.widened(&declaration.value));
        match value {
            Ok(value) if value == declaration.value => Ok(value),
            _ if declaration.descriptor.read_only => Err(Refusal::ReadOnly { name: name.into() }),
            value => declaration.admit(value?),
        }
    }

    fn apply(&mut self, name: &str, value: Value) {
        if let Some(declaration) = self.declared.get_mut(name).filter(|one| !one.descriptor.read_only) {
            declaration.value = value.clone();
            self.changes.push(Change { name: name.into(), value });
        }
    }

    /// Changes since the last call, in order.
    pub(crate) fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// The descriptor of a parameter; of type 0 if it is not declared.
    pub fn descriptor(&self, name: &str) -> ParameterDescriptor {
        let undeclared = || ParameterDescriptor { name: name.into(), ..Default::default() };
        self.declared.get(name).map_or_else(undeclared, |declaration| declaration.descriptor.clone())
    }

    /// Names below any of the prefixes (none: all), at most `depth` dots deep (0: any), and the groups
    /// that they stand in.
    pub fn list(&self, prefixes: &[String], depth: u64) -> (Vec<String>, Vec<String>) {
        let shallow = |rest: &str| depth == 0 || (rest.matches('.').count() as u64) < depth;
        let listed = |name: &str| {
            let below = |prefix: &String| {
                name == prefix
                    || name
                        .strip_prefix(prefix.as_str())
                        .and_then(|rest| rest.strip_prefix('.'))
                        .is_some_and(shallow)
            };
            if prefixes.is_empty() { shallow(name) } else { prefixes.iter().any(below) }
        };
        let names: Vec<String> = self.declared.keys().filter(|name| listed(name)).cloned().collect();
        let mut groups: Vec<String> =
            names.iter().filter_map(|name| name.rsplit_once('.')).map(|(group, _)| group.into()).collect();
        groups.sort();
        groups.dedup();
        (names, groups)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::rcl_interfaces::FloatingPointRange;

    fn store() -> Store {
        let mut store = Store::default();
        let declarations = [
            Declaration::new("rate", 50.0).describe("ticks per second [Hz]").range(1.0..=500.0),
            Declaration::new("gains.p", 1.0).range(0.0..=2.0),
            Declaration::new("gains.inner.d", 0.0),
            Declaration::new("count", 4_i64).integer_range(0..=11),
            Declaration::new("frame", "map").checked("not empty", |_, value| {
                if value.as_str() == Some("") { Err("must not be empty".into()) } else { Ok(()) }
            }),
            Declaration::new("use_sim_time", false).read_only(),
        ];
        for declaration in declarations {
            store.declare(declaration, None).expect("declared once");
        }
        store
    }

    fn set(store: &mut Store, name: &str, value: impl Into<Value>) -> Result<(), Refusal> {
        store.set(name, Some(value.into()))
    }

    #[test]
    fn values_of_another_type_are_refused_and_whole_numbers_are_numbers() {
        let mut store = store();
        assert!(matches!(set(&mut store, "rate", "fast"), Err(Refusal::Type { .. })));
        assert!(matches!(set(&mut store, "count", 4.0), Err(Refusal::Type { .. })));
        assert_eq!(set(&mut store, "rate", 100_i64), Ok(()));
        assert_eq!(store.get("rate"), Some(&Value::Double(100.0)));
    }

    #[test]
    fn values_off_range_are_refused_and_leave_no_trace() {
        let mut store = store();
        for (name, value) in [
            ("rate", Value::Double(0.5)),
            ("rate", Value::Double(500.1)),
            ("rate", Value::Double(f64::INFINITY)),
            ("gains.p", Value::Double(-0.5)),
            ("count", Value::Integer(-1)),
            ("count", Value::Integer(12)),
        ] {
            assert!(
                matches!(store.set(name, Some(value.clone())), Err(Refusal::Range { .. })),
                "{name} {value}"
            );
        }
        assert!(matches!(set(&mut store, "rate", f64::NAN), Err(Refusal::NotANumber { .. })));
        assert_eq!(store.take_changes(), []);
        assert_eq!(set(&mut store, "gains.p", 0.7), Ok(()));
        assert_eq!(set(&mut store, "count", 11_i64), Ok(()));
    }

    #[test]
    fn read_only_undeclared_unset_and_vetoed_are_refused_with_the_reason() {
        let mut store = store();
        assert!(matches!(set(&mut store, "use_sim_time", true), Err(Refusal::ReadOnly { .. })));
        assert!(matches!(set(&mut store, "use_sim_time", 1.0), Err(Refusal::ReadOnly { .. })));
        assert!(matches!(store.set("use_sim_time", None), Err(Refusal::ReadOnly { .. })));
        assert_eq!(set(&mut store, "use_sim_time", false), Ok(()), "what it is already");
        assert_eq!(store.take_changes(), []);
        assert!(matches!(set(&mut store, "speed", 1.0), Err(Refusal::Undeclared { .. })));
        assert!(matches!(store.set("rate", None), Err(Refusal::Unset { .. })));
        let vetoed = set(&mut store, "frame", "").expect_err("vetoed");
        assert_eq!(vetoed.to_string(), "parameter frame: must not be empty");
    }

    #[test]
    fn all_or_none_are_set_atomically() {
        let mut store = store();
        let both = |rate: f64| {
            vec![("count".into(), Some(Value::Integer(0))), ("rate".into(), Some(Value::Double(rate)))]
        };
        assert!(store.set_atomically(both(0.0)).is_err());
        assert_eq!(store.get("count"), Some(&Value::Integer(4)));
        assert_eq!(store.set_atomically(both(2.0)), Ok(()));
        assert_eq!(store.get("count"), Some(&Value::Integer(0)));
        assert_eq!(store.take_changes().len(), 2);
        assert_eq!(store.take_changes().len(), 0);
    }

    #[test]
    fn start_values_are_checked_and_may_set_what_is_read_only() {
        let mut store = Store::default();
        let rate = || Declaration::new("rate", 50.0).range(1.0..=500.0).read_only();
        assert!(store.declare(rate(), Some(Value::Double(0.0))).is_err());
        assert_eq!(store.declare(rate(), Some(Value::Integer(5))), Ok(()));
        assert_eq!(store.get("rate"), Some(&Value::Double(5.0)));
        assert_eq!(store.take_changes(), []);
        assert_eq!(store.declare(rate(), None), Err(Refusal::Declared { name: "rate".into() }));
    }

    #[test]
    fn lists_go_by_prefix_and_depth() {
        let store = store();
        let names = |prefixes: &[&str], depth| {
            let prefixes: Vec<String> = prefixes.iter().map(|&prefix| prefix.into()).collect();
            store.list(&prefixes, depth).0
        };
        assert_eq!(names(&[], 0).len(), 6);
        assert_eq!(names(&[], 1), ["count", "frame", "rate", "use_sim_time"]);
        assert_eq!(names(&["gains"], 1), ["gains.p"]);
        assert_eq!(names(&["gains"], 0), ["gains.inner.d", "gains.p"]);
        assert_eq!(names(&["gain"], 0), [""; 0]);
        assert_eq!(store.list(&[], 0).1, ["gains", "gains.inner"]);
    }

    #[test]
    fn a_descriptor_says_all_that_was_declared() {
        let descriptor = store().descriptor("gains.p");
        assert_eq!(descriptor.kind, 3);
        let range = FloatingPointRange { from_value: 0.0, to_value: 2.0, step: 0.0 };
        assert_eq!(descriptor.floating_point_range, [range]);
        assert_eq!(store().descriptor("count").integer_range.len(), 1);
        assert!(store().descriptor("use_sim_time").read_only);
        assert_eq!(store().descriptor("frame").additional_constraints, "not empty");
        assert_eq!(store().descriptor("none").kind, 0);
    }
}
