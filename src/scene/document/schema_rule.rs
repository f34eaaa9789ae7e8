//! The rule for one value in a JSON Schema as schemars derives it.

use std::fmt;

use serde_json::{Map, Value};

use crate::scene::document::Content;

type SchemaObject = Map<String, Value>;

/// How deep questions about the branches of a union follow unions within them.
const UNION_DEPTH: usize = 4;

/// Names are listed up to this many.
const LISTED_NAMES: usize = 12;

/// Everything that applies to one value: a schema, what it refers to, and the union branches chosen so far.
#[derive(Debug, Clone)]
pub(crate) struct Rule<'s> {
    root: &'s Value,
    layers: Vec<&'s SchemaObject>,
    unions: Vec<&'s Vec<Value>>,
    taken: Vec<&'s Vec<Value>>,
    /// Set once the rule has been settled on one variant of a tagged enum.
    pub(crate) variants: Option<Variants<'s>>,
}

/// The variants of a tagged enum and the one that was chosen.
#[derive(Debug, Clone)]
pub(crate) struct Variants<'s> {
    pub(crate) tag: &'s str,
    pub(crate) chosen: &'s str,
    pub(crate) all: Vec<(&'s str, Rule<'s>)>,
}

/// How keys that are not among the properties are treated.
pub(crate) enum OtherKeys<'s> {
    Refused,
    Unchecked,
    Follow(&'s Value),
}

impl<'s> Rule<'s> {
    pub(crate) fn new(root: &'s Value, schema: &'s Value) -> Self {
        let mut rule =
            Rule { root, layers: Vec::new(), unions: Vec::new(), taken: Vec::new(), variants: None };
        rule.absorb(schema);
        rule
    }

    /// The rule for a schema within this one.
    pub(crate) fn of(&self, schema: &'s Value) -> Self {
        Rule::new(self.root, schema)
    }

    fn absorb(&mut self, schema: &'s Value) {
        let mut waiting = vec![schema];
        while let Some(schema) = waiting.pop() {
            let Some(layer) = schema.as_object() else { continue };
            // A schema that leads back to itself adds nothing new.
            if self.layers.iter().any(|known| std::ptr::eq(*known, layer)) {
                continue;
            }
            self.layers.push(layer);
            self.unions.extend(["oneOf", "anyOf"].iter().filter_map(|word| layer.get(*word)?.as_array()));
            waiting.extend(layer.get("allOf").and_then(Value::as_array).into_iter().flatten());
            let reference = layer.get("$ref").and_then(Value::as_str);
            waiting.extend(reference.and_then(|to| self.root.pointer(to.strip_prefix('#')?)));
        }
    }

    /// Adds what the chosen branch of a union says.
    pub(crate) fn join(&mut self, branch: Rule<'s>) {
        self.layers.extend(branch.layers);
        self.unions.extend(branch.unions);
    }

    /// Takes a union that is still to be settled, as its branches; null, which TOML cannot say, is left out.
    pub(crate) fn take_union(&mut self) -> Option<Vec<Rule<'s>>> {
        let union = self.unions.pop()?;
        self.taken.push(union);
        let mut branches = self.branches(union);
        // A branch that leads back to a union already taken offers nothing else, and would be taken for ever.
        let is_taken = |union: &&Vec<Value>| self.taken.iter().any(|taken| std::ptr::eq(*taken, *union));
        branches.retain(|branch| !branch.unions.iter().any(is_taken));
        Some(branches)
    }

    fn branches(&self, union: &'s [Value]) -> Vec<Rule<'s>> {
        let is_null = |schema: &Value| schema.get("type").is_some_and(|kind| kind == "null");
        union.iter().filter(|schema| !is_null(schema)).map(|schema| self.of(schema)).collect()
    }

    fn all(&self, keyword: &'static str) -> impl Iterator<Item = &'s Value> {
        self.layers.iter().filter_map(move |layer| layer.get(keyword))
    }

    fn text(&self, keyword: &'static str) -> Option<&'s str> {
        self.all(keyword).find_map(Value::as_str)
    }

    /// The JSON types that are accepted, or `None` if the schema does not say.
    fn types(&self) -> Option<Vec<&'s str>> {
        let types = match self.all("type").next() {
            Some(Value::String(name)) => vec![name.as_str()],
            Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).collect(),
            _ => return self.all("properties").next().map(|_| vec!["object"]),
        };
        Some(types.into_iter().filter(|name| *name != "null").collect())
    }

    /// Whether a value of this kind can be accepted at all.
    pub(crate) fn admits(&self, content: &Content) -> bool {
        self.admits_within(content, UNION_DEPTH)
    }

    fn admits_within(&self, content: &Content, depth: usize) -> bool {
        let own = self.types().is_none_or(|types| match content {
            Content::Integer(_) => types.contains(&"integer") || types.contains(&"number"),
            other => types.contains(&json_type(other)),
        });
        let in_some_branch = |union: &&'s Vec<Value>| {
            depth == 0 || self.branches(union).iter().any(|branch| branch.admits_within(content, depth - 1))
        };
        own && self.unions.iter().all(in_some_branch)
    }

    /// Whether an integer stays one, rather than becoming a float.
    pub(crate) fn keeps_integers(&self) -> bool {
        self.types().is_none_or(|types| types.contains(&"integer"))
    }

    /// The strings to choose from, if only those are accepted.
    pub(crate) fn choices(&self) -> Option<Vec<&'s str>> {
        self.choices_within(UNION_DEPTH)
    }

    fn choices_within(&self, depth: usize) -> Option<Vec<&'s str>> {
        if let Some(only) = self.text("const") {
            return Some(vec![only]);
        }
        if let Some(choices) = self.all("enum").find_map(Value::as_array) {
            let choices: Vec<&str> = choices.iter().filter_map(Value::as_str).collect();
            return (!choices.is_empty()).then_some(choices);
        }
        let [union] = self.unions.as_slice() else { return None };
        let branches = if depth == 0 { return None } else { self.branches(union) };
        let choices: Option<Vec<_>> =
            branches.iter().map(|branch| branch.choices_within(depth - 1)).collect();
        Some(choices?.concat()).filter(|choices| !choices.is_empty())
    }

    pub(crate) fn property(&self, key: &str) -> Option<&'s Value> {
        self.all("properties").find_map(|properties| properties.get(key))
    }

    pub(crate) fn property_names(&self) -> Vec<&'s str> {
        let tables = self.all("properties").filter_map(Value::as_object);
        tables.flat_map(|properties| properties.keys().map(String::as_str)).collect()
    }

    pub(crate) fn required(&self) -> Vec<&'s str> {
        let lists = self.all("required").filter_map(Value::as_array);
        lists.flatten().filter_map(Value::as_str).collect()
    }

    pub(crate) fn other_keys(&self) -> OtherKeys<'s> {
        let others: Vec<&Value> =
            self.all("additionalProperties").chain(self.all("unevaluatedProperties")).collect();
        match others.iter().find(|schema| schema.is_object()) {
            Some(schema) => OtherKeys::Follow(schema),
            None if others.iter().any(|schema| **schema == Value::Bool(false)) => OtherKeys::Refused,
            None => OtherKeys::Unchecked,
        }
    }

    /// The string that `key` must hold, if it can hold only one.
    pub(crate) fn constant(&self, key: &str) -> Option<&'s str> {
        self.property(key)?.get("const")?.as_str()
    }

    /// The schema of the list element at `index`.
    pub(crate) fn element(&self, index: usize) -> Option<&'s Value> {
        let positioned = self.all("prefixItems").find_map(|schemas| schemas.get(index));
        positioned.or_else(|| self.all("items").next())
    }

    /// A count that a keyword such as `minItems` sets.
    pub(crate) fn count(&self, keyword: &'static str) -> Option<usize> {
        self.all(keyword).find_map(Value::as_u64).and_then(|count| usize::try_from(count).ok())
    }

    /// The unit as a suffix to a message, such as ` \[length\]`.
    pub(crate) fn unit_suffix(&self) -> String {
        let described = || self.all("description").filter_map(Value::as_str).find_map(trailing_unit);
        let unit = self.text("x-unit").or_else(described);
        unit.map_or_else(String::new, |unit| format!(" [{unit}]"))
    }

    /// The first line of the description, without the unit that [`Rule::describe`] has.
    pub(crate) fn summary(&self) -> Option<String> {
        let line = self.text("description")?.lines().next()?.trim_end_matches('.');
        Some(line.strip_suffix(&self.unit_suffix()).unwrap_or(line).to_owned() + ".")
    }

    /// The range that numbers must lie in.
    pub(crate) fn limits(&self) -> Limits {
        let values = |keyword| self.all(keyword).filter_map(Value::as_f64);
        let mut limits = Limits::default();
        values("minimum").for_each(|bound| limits.raise(bound, false));
        values("exclusiveMinimum").for_each(|bound| limits.raise(bound, true));
        values("maximum").for_each(|bound| limits.lower(bound, false));
        values("exclusiveMaximum").for_each(|bound| limits.lower(bound, true));
        // schemars states the range of 8 and 16 bit integers, but leaves wider ones to the format.
        match self.text("format") {
            Some("int32") => limits.narrow_to(i32::MIN.into(), i32::MAX.into()),
            Some("uint32") => limits.lower(u32::MAX.into(), false),
            _ => {}
        }
        limits
    }

    /// Whether `value` fits the integer type that the format names.
    pub(crate) fn fits_format(&self, value: i128) -> bool {
        match self.text("format") {
            Some("int64" | "int") => i64::try_from(value).is_ok(),
            Some("uint64" | "uint") => u64::try_from(value).is_ok(),
            _ => true,
        }
    }

    /// The accepted values, as a noun phrase.
    pub(crate) fn describe(&self) -> String {
        self.describe_within(UNION_DEPTH)
    }

    fn describe_within(&self, depth: usize) -> String {
        if let Some(choices) = self.choices() {
            return one_of(choices.iter().map(|choice| format!("{choice:?}")));
        }
        if let (Some(union), true) = (self.unions.first(), depth > 0) {
            return any_of(self.branches(union).iter().map(|branch| branch.describe_within(depth - 1)));
        }
        match self.types() {
            Some(types) => any_of(types.into_iter().map(|name| self.describe_type(name))),
            None => "any value".to_owned(),
        }
    }

    fn describe_type(&self, name: &str) -> String {
        match name {
            "number" => format!("a number{}", self.unit_suffix()),
            "integer" => format!("a whole number{}", self.unit_suffix()),
            "string" => "a string".to_owned(),
            "boolean" => "true or false".to_owned(),
            "array" => self.describe_list(),
            _ => match self.required().as_slice() {
                [] => "a table".to_owned(),
                required => format!("a table with {}", listed(required)),
            },
        }
    }

    fn describe_list(&self) -> String {
        let element = self.all("items").next().map(|schema| self.of(schema));
        let elements = match element.and_then(|rule| rule.types()).as_deref() {
            Some(["number"]) => "numbers",
            Some(["integer"]) => "whole numbers",
            Some(["string"]) => "strings",
            Some(["object"]) => "tables",
            _ => "elements",
        };
        match (self.count("minItems"), self.count("maxItems")) {
            (Some(least), Some(most)) if least == most => {
                format!("a list of {least} {elements}{}", self.unit_suffix())
            }
            _ => format!("a list of {elements}{}", self.unit_suffix()),
        }
    }
}

/// The unit that ends a description in brackets, as opposed to an interval or a link.
fn trailing_unit(description: &str) -> Option<&str> {
    let (_, unit) = description.trim_end_matches(['.', ' ']).strip_suffix(']')?.rsplit_once('[')?;
    (!unit.is_empty() && !unit.contains([',', '`'])).then_some(unit)
}

/// The JSON Schema name for the kind of a value.
fn json_type(content: &Content) -> &'static str {
    match content {
        Content::Boolean(_) => "boolean",
        Content::Integer(_) => "integer",
        Content::Float(_) => "number",
        Content::Text(_) | Content::Unusable { .. } => "string",
        Content::List(_) => "array",
        Content::Table(_) => "object",
    }
}

/// `a or b or c`, each phrase once.
pub(crate) fn any_of(phrases: impl Iterator<Item = String>) -> String {
    let mut distinct: Vec<String> = Vec::new();
    phrases.for_each(|phrase| {
        if !distinct.contains(&phrase) {
            distinct.push(phrase);
        }
    });
    distinct.join(" or ")
}

/// `one of a, b, c`, or just `a`.
pub(crate) fn one_of(phrases: impl Iterator<Item = String>) -> String {
    match phrases.collect::<Vec<_>>().as_slice() {
        [only] => only.clone(),
        several => format!("one of {}", several.join(", ")),
    }
}

/// The names in backticks, the first of them if there are many.
pub(crate) fn listed(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(LISTED_NAMES).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > LISTED_NAMES { ", ..." } else { "" };
    shown.join(", ") + more
}

/// A range of numbers; each bound is a value and whether that value itself is left out.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Limits {
    lower: Option<(f64, bool)>,
    upper: Option<(f64, bool)>,
}

impl Limits {
    fn raise(&mut self, bound: f64, exclusive: bool) {
        if self.lower.is_none_or(|lower| (bound, exclusive) > lower) {
            self.lower = Some((bound, exclusive));
        }
    }

    fn lower(&mut self, bound: f64, exclusive: bool) {
        if self.upper.is_none_or(|upper| (bound, !exclusive) < (upper.0, !upper.1)) {
            self.upper = Some((bound, exclusive));
        }
    }

    fn narrow_to(&mut self, least: f64, most: f64) {
        self.raise(least, false);
        self.lower(most, false);
    }

    pub(crate) fn hold(&self, value: f64) -> bool {
        let above =
            self.lower.is_none_or(|(bound, exclusive)| value > bound || (!exclusive && value == bound));
        let below =
            self.upper.is_none_or(|(bound, exclusive)| value < bound || (!exclusive && value == bound));
        above && below
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let (Some((least, false)), Some((most, false))) = (self.lower, self.upper) {
            return write!(f, "between {} and {}", plain(least), plain(most));
        }
        let lower = self.lower.map(|(bound, exclusive)| {
            format!("{} {}", if exclusive { "greater than" } else { "at least" }, plain(bound))
        });
        let upper = self.upper.map(|(bound, exclusive)| {
            format!("{} {}", if exclusive { "less than" } else { "at most" }, plain(bound))
        });
        f.write_str(&lower.into_iter().chain(upper).collect::<Vec<_>>().join(" and "))
    }
}

/// A number without a needless `.0`.
fn plain(number: f64) -> String {
    let text = format!("{number:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}
