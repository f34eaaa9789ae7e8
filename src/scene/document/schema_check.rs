//! One walk of a document against its schema, which finds everything wrong and says how to mend it.
//!
//! By hand, as validators of JSON walk values that do not know the line or override that they came from, and where no
//! branch of a union fits they do not say which was meant.

use serde_json::{Map, Number, Value};

use crate::scene::document::problem::{Problem, SceneError};
use crate::scene::document::schema_rule::{OtherKeys, Rule, Variants, any_of, listed, one_of};
use crate::scene::document::{Content, Document, Node, child_path, entry};
use crate::scene::text::{counted, nearest, renamed};

/// Branches of an untagged enum are tried out only this many enums deep, since the tries multiply.
const NESTED_TRIALS: usize = 2;

/// The value of `root`, a node of `document`, if it fits `schema`.
pub(crate) fn check(document: &Document, root: &Node, schema: &Value) -> Result<Value, SceneError> {
    let mut checker = Checker { document, refused: SceneError::default(), trials: 0 };
    let value = checker.value(root, Rule::new(schema, schema), "");
    checker.refused.into_result(value)
}

struct Checker<'d> {
    document: &'d Document,
    refused: SceneError,
    /// How many trials of union branches are under way, one within another.
    trials: usize,
}

impl Checker<'_> {
    /// The value as JSON; null where it was refused, which is never seen since the check then fails.
    fn value<'s>(&mut self, node: &Node, mut rule: Rule<'s>, key: &str) -> Value {
        if let Content::Unusable { why, .. } = node.content {
            return self.refuse(node, key, why, None);
        }
        loop {
            if let Some(choices) = rule.choices() {
                return self.choice(node, &choices, key);
            }
            let Some(branches) = rule.take_union() else { break };
            let Some(branch) = self.branch(node, &mut rule, branches, key) else { return Value::Null };
            rule.join(branch);
        }
        if !rule.admits(&node.content) {
            let message = format!("must be {}, not {}", rule.describe(), kind(&node.content));
            return self.refuse(node, key, message, conversion_help(node, &rule));
        }
        match &node.content {
            Content::Boolean(flag) => Value::Bool(*flag),
            Content::Integer(integer) => self.integer(node, *integer, &rule, key),
            Content::Float(number) => self.number(node, *number, &rule, key),
            Content::Text(text) => self.text(node, text, &rule, key),
            Content::List(items) => self.list(node, items, &rule, key),
            Content::Table(entries) => self.table(node, entries, &rule, key),
            Content::Unusable { .. } => Value::Null,
        }
    }

    fn refuse(&mut self, node: &Node, key: &str, message: impl Into<String>, help: Option<String>) -> Value {
        self.refused.push(Problem {
            place: self.document.place(node.origin),
            key: key.to_owned(),
            found: Some(node.shown()),
            message: message.into(),
            help,
        });
        Value::Null
    }

    fn choice(&mut self, node: &Node, choices: &[&str], key: &str) -> Value {
        let Content::Text(text) = &node.content else {
            let message = format!("must be {}, not {}", quoted_choices(choices), kind(&node.content));
            return self.refuse(node, key, message, None);
        };
        if choices.contains(&text.as_str()) {
            return Value::String(text.clone());
        }
        let help = match renamed(text, choices) {
            Some(choice) => Some(format!("{text:?} is called {choice:?} now")),
            None => nearest(text, choices).map(|choice| format!("did you mean {choice:?}?")),
        };
        self.refuse(node, key, format!("must be {}", quoted_choices(choices)), help)
    }

    fn integer(&mut self, node: &Node, integer: i128, rule: &Rule<'_>, key: &str) -> Value {
        // Limits are compared as floats; only the 64 bit formats need more than their 53 bits.
        let float = integer as f64;
        if !rule.keeps_integers() {
            return self.number(node, float, rule, key);
        }
        if !rule.limits().hold(float) {
            return self.out_of_range(node, rule, key);
        }
        match Number::from_i128(integer) {
            Some(number) if rule.fits_format(integer) => Value::Number(number),
            _ => self.refuse(node, key, format!("must be at most {}", i64::MAX), None),
        }
    }

    fn number(&mut self, node: &Node, number: f64, rule: &Rule<'_>, key: &str) -> Value {
        match Number::from_f64(number) {
            Some(value) if rule.limits().hold(number) => Value::Number(value),
            _ => self.out_of_range(node, rule, key),
        }
    }

    fn out_of_range(&mut self, node: &Node, rule: &Rule<'_>, key: &str) -> Value {
        self.refuse(node, key, format!("must be {}{}", rule.limits(), rule.unit_suffix()), None)
    }

    fn text(&mut self, node: &Node, text: &str, rule: &Rule<'_>, key: &str) -> Value {
        let bounds = [rule.count("minLength"), rule.count("maxLength")];
        match wrong_count(text.chars().count(), bounds, "character") {
            Some(message) => self.refuse(node, key, message, None),
            None => Value::String(text.to_owned()),
        }
    }

    fn list(&mut self, node: &Node, items: &[Node], rule: &Rule<'_>, key: &str) -> Value {
        let bounds = [rule.count("minItems"), rule.count("maxItems")];
        if let Some(message) = wrong_count(items.len(), bounds, "element") {
            return self.refuse(node, key, message, None);
        }
        let element = |(index, item): (usize, &Node)| {
            let schema = rule.element(index).unwrap_or(&Value::Bool(true));
            self.value(item, rule.of(schema), &format!("{key}[{index}]"))
        };
        Value::Array(items.iter().enumerate().map(element).collect())
    }

    fn table(&mut self, node: &Node, entries: &[(String, Node)], rule: &Rule<'_>, key: &str) -> Value {
        let mut values = Map::new();
        let mut meant = Vec::new();
        let mut free = None;
        for (name, child) in entries {
            let path = child_path(key, name);
            let schema = match (rule.property(name), rule.other_keys()) {
                (Some(schema), _) | (None, OtherKeys::Follow(schema)) => schema,
                (None, OtherKeys::Unchecked) => &Value::Bool(true),
                (None, OtherKeys::Refused) => {
                    let free = free.get_or_insert_with(|| free_keys(rule, entries));
                    meant.extend(self.unknown_key(child, name, free, rule, &path));
                    continue;
                }
            };
            values.insert(name.clone(), self.value(child, rule.of(schema), &path));
        }
        for name in rule.required() {
            // A misspelt key has been reported as such; that it is missing as well would be noise.
            if !values.contains_key(name) && !meant.contains(&name) {
                self.missing_key(node, name, rule, key);
            }
        }
        Value::Object(values)
    }

    /// Reports an unknown key and gives the key that was probably meant.
    fn unknown_key<'s>(
        &mut self,
        node: &Node,
        name: &str,
        free: &[&'s str],
        rule: &Rule<'s>,
        path: &str,
    ) -> Option<&'s str> {
        if self.refused.is_full() {
            // Only counted: a file of a million keys is refused as soon as any.
            self.refuse(node, path, "is not a known key", None);
            return None;
        }
        if let Some(message) = rule.variants.as_ref().and_then(|variants| other_variant(variants, name)) {
            self.refuse(node, path, message, Some(format!("known keys: {}", listed(&rule.property_names()))));
            return None;
        }
        let known = rule.property_names();
        let now = renamed(name, free);
        let meant = now.or_else(|| nearest(name, free));
        let help = match meant {
            Some(key) if now.is_some() => format!("it is called `{key}` now"),
            Some(key) => format!("did you mean `{key}`?"),
            None if known.is_empty() => "no keys are known here".to_owned(),
            None => {
                // One that is there already may be meant all the same: it is not to be among those left out.
                let near = nearest(name, &known);
                let others = known.iter().copied().filter(|&key| Some(key) != near);
                format!("known keys: {}", listed(&near.into_iter().chain(others).collect::<Vec<_>>()))
            }
        };
        self.refuse(node, path, "is not a known key", Some(help));
        meant
    }

    fn missing_key(&mut self, node: &Node, name: &str, rule: &Rule<'_>, key: &str) {
        let property = rule.property(name).map(|schema| rule.of(schema));
        let help = property.map(|property| {
            let summary = property.summary().map_or_else(String::new, |summary| format!(": {summary}"));
            format!("add `{name}`, which is {}{summary}", property.describe())
        });
        self.missing(node, &child_path(key, name), help);
    }

    fn missing(&mut self, node: &Node, key: &str, help: Option<String>) {
        self.refused.push(Problem {
            place: self.document.place(node.origin),
            key: key.to_owned(),
            found: None,
            message: "is missing".to_owned(),
            help,
        });
    }

    /// Chooses the branch of a union that the value is meant for, or reports that there is none.
    fn branch<'s>(
        &mut self,
        node: &Node,
        rule: &mut Rule<'s>,
        mut branches: Vec<Rule<'s>>,
        key: &str,
    ) -> Option<Rule<'s>> {
        if branches.len() == 1 {
            return branches.pop();
        }
        match shared_tag(&branches) {
            Some(tag) => self.tagged_branch(node, rule, branches, tag, key),
            None => self.fitting_branch(node, rule, branches, key),
        }
    }

    fn tagged_branch<'s>(
        &mut self,
        node: &Node,
        rule: &mut Rule<'s>,
        branches: Vec<Rule<'s>>,
        tag: &'s str,
        key: &str,
    ) -> Option<Rule<'s>> {
        let all: Vec<(&str, Rule)> =
            branches.into_iter().filter_map(|branch| Some((branch.constant(tag)?, branch))).collect();
        let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
        let Content::Table(entries) = &node.content else {
            let message = format!("must be a table with `{tag}`, not {}", kind(&node.content));
            self.refuse(node, key, message, Some(variant_help(node, tag, &names)));
            return None;
        };
        let path = child_path(key, tag);
        let Some(named) = entry(entries, tag) else {
            self.missing(node, &path, Some(format!("set `{tag}` to {}", quoted_choices(&names))));
            return None;
        };
        let chosen = self.choice(named, &names, &path);
        let (chosen, branch) = all.iter().find(|(name, _)| chosen == *name).cloned()?;
        rule.variants = Some(Variants { tag, chosen, all });
        Some(branch)
    }

    fn fitting_branch<'s>(
        &mut self,
        node: &Node,
        rule: &Rule<'s>,
        branches: Vec<Rule<'s>>,
        key: &str,
    ) -> Option<Rule<'s>> {
        let expected = || any_of(branches.iter().map(Rule::describe));
        let admitting: Vec<&Rule> = branches.iter().filter(|branch| branch.admits(&node.content)).collect();
        match admitting.as_slice() {
            [] => {
                let message = format!("must be {}, not {}", expected(), kind(&node.content));
                self.refuse(node, key, message, None);
                return None;
            }
            [only] => return Some((*only).clone()),
            _ => {}
        }
        if self.trials == NESTED_TRIALS {
            // Within a trial the benefit of the doubt is safe: the walk itself comes here again, on no trial.
            return None;
        }
        let costs: Vec<usize> = admitting.iter().map(|branch| self.cost(node, rule, branch, key)).collect();
        let least = costs.iter().copied().min()?;
        if least > 0 && costs.iter().filter(|cost| **cost == least).count() > 1 {
            self.refuse(node, key, format!("does not fit any accepted form: {}", expected()), None);
            return None;
        }
        let best = costs.iter().position(|cost| *cost == least)?;
        admitting.get(best).map(|branch| (*branch).clone())
    }

    /// How many problems there would be if the value were meant for `branch`.
    fn cost<'s>(&mut self, node: &Node, rule: &Rule<'s>, branch: &Rule<'s>, key: &str) -> usize {
        let mut joined = rule.clone();
        joined.join(branch.clone());
        let refused = std::mem::take(&mut self.refused);
        self.trials += 1;
        self.value(node, joined, key);
        self.trials -= 1;
        std::mem::replace(&mut self.refused, refused).count()
    }
}

/// The property that every branch sets to one fixed string of its own.
fn shared_tag<'s>(branches: &[Rule<'s>]) -> Option<&'s str> {
    let candidates = branches.first()?.property_names();
    candidates.into_iter().find(|name| branches.iter().all(|branch| branch.constant(name).is_some()))
}

/// Says that a key belongs to another variant, if it does.
fn other_variant(variants: &Variants<'_>, key: &str) -> Option<String> {
    let owners = variants.all.iter().filter(|(_, rule)| rule.property(key).is_some());
    let owners: Vec<String> = owners.map(|(name, _)| format!("{name:?}")).collect();
    let Variants { tag, chosen, .. } = variants;
    (!owners.is_empty()).then(|| format!("belongs to {tag} {}, not to {chosen:?}", owners.join(" or ")))
}

fn variant_help(node: &Node, tag: &str, names: &[&str]) -> String {
    match &node.content {
        Content::Text(text) if names.contains(&text.as_str()) => format!("write {{ {tag} = {text:?} }}"),
        _ => format!("`{tag}` is {}", quoted_choices(names)),
    }
}

/// How to write the value so that it has the type that is wanted, if it was nearly right.
fn conversion_help(node: &Node, rule: &Rule<'_>) -> Option<String> {
    let fits = |content: Content| rule.admits(&content);
    match &node.content {
        Content::Text(text) => {
            let number = text.parse::<f64>().ok().filter(|number| number.is_finite())?;
            fits(Content::Float(number)).then(|| format!("write {number:?}, without quotes"))
        }
        // Beyond that it would be refused again.
        Content::Float(number)
            if number.fract() == 0.0 && number.abs() < 1e18 && fits(Content::Integer(0)) =>
        {
            Some(format!("write {number}, without a decimal point"))
        }
        Content::Integer(_) | Content::Float(_) | Content::Boolean(_) => {
            let quoted = format!("put it in quotes: \"{}\"", node.shown());
            fits(Content::Text(String::new())).then_some(quoted)
        }
        _ => None,
    }
}

/// The error of a count outside its two bounds, if it is outside.
fn wrong_count(count: usize, bounds: [Option<usize>; 2], noun: &str) -> Option<String> {
    let plural = |count: usize| counted(count, noun);
    match bounds {
        [Some(least), Some(most)] if least == most && count != least => {
            Some(format!("must have {}, not {count}", plural(least)))
        }
        [Some(least), _] if count < least => {
            Some(format!("must have at least {}, not {count}", plural(least)))
        }
        [_, Some(most)] if count > most => Some(format!("must have at most {}, not {count}", plural(most))),
        _ => None,
    }
}

fn quoted_choices(choices: &[&str]) -> String {
    one_of(choices.iter().map(|choice| format!("{choice:?}")))
}

fn kind(content: &Content) -> &'static str {
    match content {
        Content::Boolean(_) => "a boolean",
        Content::Integer(_) => "an integer",
        Content::Float(_) => "a decimal number",
        Content::Text(_) => "a string",
        Content::List(_) => "a list",
        Content::Table(_) => "a table",
        Content::Unusable { .. } => "this",
    }
}

/// The keys that a table could still have.
fn free_keys<'s>(rule: &Rule<'s>, entries: &[(String, Node)]) -> Vec<&'s str> {
    rule.property_names().into_iter().filter(|key| entry(entries, key).is_none()).collect()
}

#[cfg(test)]
mod tests;
