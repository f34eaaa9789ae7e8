//! Remap rules: `[NODE:]FROM:=TO`, `[NODE:]__node:=NAME`, `[NODE:]__ns:=/NAMESPACE`.

use super::error::{Reason, RosArgumentError};
use crate::messages::names::{NameError, check_namespace, check_node_name, check_token};
use crate::messages::remap::{Remap, RemapRule, Scope};

const SHAPE: &str = "write [NODE:]FROM:=TO, [NODE:]__node:=NAME or [NODE:]__ns:=/NAMESPACE";

impl RemapRule {
    /// Reads the rule that follows `flag`.
    ///
    /// # Errors
    /// A rule that `rcl` does not understand or implement; the message says which part.
    pub fn parse(flag: &str, rule: &str) -> Result<Self, RosArgumentError> {
        let refuse = |why: Reason| RosArgumentError::rule(flag, rule, why);
        let (node, body) = split_node(rule);
        if let Some(node) = node {
            check_token(node).map_err(|reason| refuse((format!("the node prefix {reason}"), SHAPE)))?;
        }
        let (from, to) = body.split_once(":=").ok_or_else(|| refuse(("has no `:=`".into(), SHAPE)))?;
        let remap = match from {
            "__node" | "__name" => {
                check_node_name(to).map_err(|error| refuse(error.into()))?;
                Remap::NodeName(to.into())
            }
            "__ns" => {
                check_namespace(to).map_err(|error| refuse(error.into()))?;
                Remap::Namespace(to.into())
            }
            _ => parse_name(from, to).map_err(refuse)?,
        };
        Ok(Self { node: node.map(String::from), remap })
    }
}

impl From<NameError> for Reason {
    fn from(error: NameError) -> Self {
        (format!("{} `{}`: {}", error.what, error.name, error.reason), error.help)
    }
}

/// Splits `NODE:` off, where there is one; the schemes and `:=` have colons of their own.
pub(super) fn split_node(rule: &str) -> (Option<&str>, &str) {
    match rule.split_once(':') {
        Some((_, after)) if after.starts_with('=') => (None, rule),
        Some(("rostopic" | "rosservice", after)) if after.starts_with("//") => (None, rule),
        Some((node, after)) => (Some(node), after),
        None => (None, rule),
    }
}

fn parse_name(from: &str, to: &str) -> Result<Remap, Reason> {
    let (scope, from) = match (from.strip_prefix("rostopic://"), from.strip_prefix("rosservice://")) {
        (Some(topic), _) => (Scope::Topics, topic),
        (_, Some(service)) => (Scope::Services, service),
        _ => (Scope::Both, from),
    };
    if to.starts_with("rostopic://") || to.starts_with("rosservice://") {
        let help = "write rostopic:// or rosservice:// on the left only";
        return Err(("the right side has a scheme".into(), help));
    }
    if scope != Scope::Both && ["__ns", "__node", "__name"].contains(&from) {
        return Err((format!("`{from}` has a scheme before it"), SHAPE));
    }
    check_side("left", from)?;
    check_side("right", to)?;
    Ok(Remap::Name { scope, from: from.into(), to: to.into() })
}

/// One side of a rule: tokens with `/` between them, absolute, private (`~/`) or relative.
fn check_side(side: &str, name: &str) -> Result<(), Reason> {
    let signs = [
        ('*', "has a wildcard, which ROS 2 does not implement for names"),
        ('\\', "refers to a wildcard, which ROS 2 does not implement"),
    ];
    if let Some((_, fault)) = signs.into_iter().find(|(sign, _)| name.contains(*sign)) {
        return Err((format!("the {side} side {fault}"), "write one rule for each name"));
    }
    let tokens = name.strip_prefix("~/").or_else(|| name.strip_prefix('/')).unwrap_or(name);
    for token in tokens.split('/') {
        check_token(token).map_err(|reason| {
            let reason = if token.is_empty() { format!("`{name}` has an empty token") } else { reason };
            (format!("the {side} side: {reason}"), "write names as /team/pose, pose or ~/pose")
        })?;
    }
    Ok(())
}
