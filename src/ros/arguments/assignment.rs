//! Parameter assignments: which node, which parameter, what value, and where that was said.

use std::path::PathBuf;

use super::remap::split_node;
use super::{RosArgumentError, Value, value};
use crate::messages::names::check_token;

/// Where a value was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The rule after `-p`, as typed.
    CommandLine(String),
    /// A line, from 1, of a parameter file.
    File { path: PathBuf, line: usize },
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::CommandLine(rule) => write!(f, "--ros-args -p {rule}"),
            Self::File { path, line } => write!(f, "{}, line {line}", path.display()),
        }
    }
}

/// A parameter and the value it was given.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name; nested ones have dots: `limits.speed`.
    pub name: String,
    pub value: Value,
    pub origin: Origin,
}

/// A parameter for every node that a pattern matches.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    pub node: NodePattern,
    pub parameter: Parameter,
}

impl Assignment {
    pub(super) fn new(node: NodePattern, name: String, value: Value, origin: Origin) -> Self {
        Self { node, parameter: Parameter { name, value, origin } }
    }
}

/// Fully qualified node names, with `*` for one token and `**` for any number of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodePattern {
    tokens: Vec<Token>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Token {
    Name(String),
    One,
    AnyNumber,
}

impl NodePattern {
    /// Reads a key of a parameter file; one without a leading slash counts from the root.
    pub(super) fn parse(key: &str) -> Result<Self, String> {
        let tokens = key.strip_prefix('/').unwrap_or(key).split('/').map(|token| match token {
            "**" => Ok(Token::AnyNumber),
            "*" => Ok(Token::One),
            _ => check_token(token).map(|()| Token::Name(token.into())),
        });
        Ok(Self { tokens: tokens.collect::<Result<_, _>>()? })
    }

    /// Every node of this name, whatever its namespace.
    fn any_namespace(node: &str) -> Self {
        Self { tokens: vec![Token::AnyNumber, Token::Name(node.into())] }
    }

    fn every_node() -> Self {
        Self { tokens: vec![Token::AnyNumber] }
    }

    /// Whether the node of this fully qualified name is meant.
    pub fn matches(&self, node: &str) -> bool {
        let names: Vec<&str> = node.split('/').filter(|name| !name.is_empty()).collect();
        // reached[n]: the tokens so far can stand for the first n names.
        let mut reached = vec![false; names.len() + 1];
        reached[0] = true;
        for token in &self.tokens {
            let before = reached.clone();
            for n in 0..=names.len() {
                reached[n] = match token {
                    Token::AnyNumber => before[n] || (n > 0 && reached[n - 1]),
                    Token::One => n > 0 && before[n - 1],
                    Token::Name(name) => n > 0 && before[n - 1] && names[n - 1] == name,
                };
            }
        }
        reached[names.len()]
    }
}

const SHAPE: &str = "write [NODE:]NAME:=VALUE, the value in YAML: rate:=50.0, names:=[a, b], label:='1'";

/// Reads the rule after `-p`. A node prefix means the node of that name in any namespace, as it does
/// for remap rules.
pub(super) fn parse(flag: &str, rule: &str) -> Result<Assignment, RosArgumentError> {
    let refuse = |reason: String, help| RosArgumentError::rule(flag, rule, (reason, help));
    // Values may have colons, so the node is looked for on the left of `:=` alone.
    let (left, value) = rule.split_once(":=").ok_or_else(|| refuse("has no `:=`".into(), SHAPE))?;
    let (node, name) = split_node(left);
    let node = match node {
        Some(node) => {
            check_token(node).map_err(|reason| refuse(format!("the node prefix {reason}"), SHAPE))?;
            NodePattern::any_namespace(node)
        }
        None => NodePattern::every_node(),
    };
    check_parameter_name(name).map_err(|reason| refuse(reason, SHAPE))?;
    let value = value::parse(value).map_err(|(reason, help)| refuse(reason, help))?;
    Ok(Assignment::new(node, name.into(), value, Origin::CommandLine(rule.into())))
}

/// Names on the command line: tokens with dots or slashes between them.
fn check_parameter_name(name: &str) -> Result<(), String> {
    let is_allowed = |letter: char| letter.is_ascii_alphanumeric() || "_./".contains(letter);
    if let Some(letter) = name.chars().find(|letter| !is_allowed(*letter)) {
        return Err(format!("the parameter name `{name}` contains `{}`", letter.escape_default()));
    }
    if name.split('.').any(str::is_empty) {
        return Err(format!("the parameter name `{name}` has an empty part"));
    }
    if name.split(['.', '/']).any(|token| token.starts_with(|letter: char| letter.is_ascii_digit())) {
        return Err(format!("a part of the parameter name `{name}` begins with a digit"));
    }
    Ok(())
}
