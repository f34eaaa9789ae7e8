//! Names of nodes, namespaces, topics and services: what is allowed, expansion and remapping.
//!
//! The rules are those of the design article "Topic and Service name mapping to DDS"
//! (design.ros2.org) and of `rcl_validate_topic_name` and `rmw_validate_full_topic_name`.

use super::remap::{RemapRule, Scope};

/// Longest fully qualified topic or service name \[characters\]: 255 less the `rt/`-like prefix and suffix.
pub(crate) const LONGEST_NAME: usize = 247;
/// Longest node name \[characters\].
pub(crate) const LONGEST_NODE_NAME: usize = 255;

/// A name that ROS 2 does not allow.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} `{name}`: {reason}\n  help: {help}")]
pub struct NameError {
    /// The kind of name: "node name", "namespace", ...
    pub what: &'static str,
    /// The whole name.
    pub name: String,
    /// The fault, and where it is.
    pub reason: String,
    pub help: &'static str,
}

const LETTERS: &str =
    "write letters, digits and single underscores, and begin with a letter or an underscore: robot_1";
const SLASHES: &str = "write tokens with one `/` between them and none at the end: /team/pose";

/// A node's own name and namespace after remapping, and the rules for everything it names.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    node: String,
    namespace: String,
    /// Namespace that the node shares with its fleet: its own, or the one above it.
    fleet: String,
    rules: Vec<RemapRule>,
}

impl Names {
    /// The node that calls itself `node` in `namespace` (empty and `/` are the root; a missing leading
    /// slash is added). Its name is remapped first, then its namespace, each by the first rule that
    /// matches.
    ///
    /// # Errors
    /// A name or namespace that ROS 2 does not allow.
    pub fn new(node: &str, namespace: &str, rules: &[RemapRule]) -> Result<Self, NameError> {
        check_node_name(node)?;
        let node = rules.iter().find_map(|rule| rule.new_node_name(node)).unwrap_or(node).to_string();
        let given = rules.iter().find_map(|rule| rule.new_namespace(&node)).unwrap_or(namespace);
        let namespace = if given.starts_with('/') { given.to_string() } else { format!("/{given}") };
        check_node_name(&node)?;
        check_namespace(&namespace)?;
        Ok(Self { node, fleet: namespace.clone(), namespace, rules: rules.to_vec() })
    }

    /// The same for a node of one robot: it moves into the robot's namespace, below the fleet's, which is its namespace
    /// so far.
    ///
    /// # Errors
    /// A name that no namespace can have.
    pub fn of_robot(self, robot: &str) -> Result<Self, NameError> {
        let namespace = join(&self.fleet, robot);
        check_namespace(&namespace)?;
        Ok(Self { namespace, ..self })
    }

    /// The node's name, without its namespace.
    pub fn node_name(&self) -> &str {
        &self.node
    }

    /// The node's namespace: `/`, or `/a/b`.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The namespace of the node's fleet: `/`, or `/a`.
    pub fn fleet(&self) -> &str {
        &self.fleet
    }

    /// Namespace and name: `/a/b/node`.
    pub fn fully_qualified(&self) -> String {
        join(&self.namespace, &self.node)
    }

    /// Name of the node's logger, with dots as `rcl` has them: `a.b.node`.
    pub fn logger(&self) -> String {
        self.fully_qualified().trim_start_matches('/').replace('/', ".")
    }

    /// The fully qualified name of a topic: `name` expanded, then remapped by the first rule that
    /// matches. `name` is absolute (`/pose`), relative to the namespace (`pose`) or to the node
    /// (`~/pose`), and may contain `{node}` and `{ns}`.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow, as written or after remapping.
    pub fn topic(&self, name: &str) -> Result<String, NameError> {
        self.resolve("topic name", name, Scope::Topics)
    }

    /// As [`Names::topic`], where a relative `name` is relative to the fleet's namespace.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow, as written or after remapping.
    pub fn fleet_topic(&self, name: &str) -> Result<String, NameError> {
        let name = self.substitute("topic name", name)?;
        if name.starts_with(['/', '~']) { self.topic(&name) } else { self.topic(&join(&self.fleet, &name)) }
    }

    /// As [`Names::fleet_topic`] for a robot, whose name `{name}` stands for.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow, as written or after remapping.
    pub fn robot_topic(&self, pattern: &str, robot: &str) -> Result<String, NameError> {
        self.fleet_topic(&pattern.replace("{name}", robot))
    }

    /// As [`Names::topic`] for a service.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow, as written or after remapping.
    pub fn service(&self, name: &str) -> Result<String, NameError> {
        self.resolve("service name", name, Scope::Services)
    }

    fn resolve(&self, what: &'static str, name: &str, scope: Scope) -> Result<String, NameError> {
        let expanded = self.expand(what, name)?;
        for rule in &self.rules {
            let Some((from, to)) = rule.name_for(&self.node, scope) else { continue };
            if self.expand(what, from)? == expanded {
                return self.expand(what, to);
            }
        }
        Ok(expanded)
    }

    fn expand(&self, what: &'static str, name: &str) -> Result<String, NameError> {
        let substituted = self.substitute(what, name)?;
        let full = match substituted.strip_prefix('~') {
            Some("") => self.fully_qualified(),
            Some(below) if below.starts_with('/') => format!("{}{below}", self.fully_qualified()),
            Some(_) => {
                let reason = "`~` is not followed by `/`".into();
                return Err(error(what, name, reason, "write ~/NAME for a name below the node's own"));
            }
            None if substituted.starts_with('/') => substituted,
            None => join(&self.namespace, &substituted),
        };
        check_full_name(what, &full).map(|()| full)
    }

    /// Puts the node's name and namespace in the place of `{node}`, `{ns}` and `{namespace}`.
    fn substitute(&self, what: &'static str, name: &str) -> Result<String, NameError> {
        let mut substituted = String::new();
        let mut left = name;
        while let Some((before, after)) = left.split_once('{') {
            substituted += before;
            let Some((word, after)) = after.split_once('}') else {
                return Err(error(what, name, "a `{` is never closed".into(), "write {node} or {ns}"));
            };
            match word {
                "node" => substituted += &self.node,
                // The root ends in the slash that is to follow.
                "ns" | "namespace" => substituted += self.namespace.trim_end_matches('/'),
                _ => {
                    let reason = format!("`{{{word}}}` stands for nothing");
                    return Err(error(what, name, reason, "write {node}, {ns} or {namespace}"));
                }
            }
            left = after;
        }
        Ok(substituted + left)
    }
}

fn join(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

fn error(what: &'static str, name: &str, reason: String, help: &'static str) -> NameError {
    NameError { what, name: name.into(), reason, help }
}

/// Refuses what no node can be called.
///
/// # Errors
/// A name that is empty, too long or not one token.
pub(crate) fn check_node_name(name: &str) -> Result<(), NameError> {
    let refuse = |reason, help| error("node name", name, reason, help);
    if name.len() > LONGEST_NODE_NAME {
        let reason = format!("has {} characters, more than {LONGEST_NODE_NAME}", name.len());
        return Err(refuse(reason, "choose a shorter name"));
    }
    if name.contains('/') {
        return Err(refuse("contains `/`".into(), "give the namespace by `-r __ns:=/NAMESPACE`"));
    }
    check_token(name).map_err(|reason| refuse(reason, LETTERS))
}

/// Refuses what is neither `/` nor a fully qualified namespace.
///
/// # Errors
/// A namespace that is relative, too long, or has a token that is not allowed.
pub(crate) fn check_namespace(namespace: &str) -> Result<(), NameError> {
    if namespace == "/" { Ok(()) } else { check_full_name("namespace", namespace) }
}

/// Refuses what is no fully qualified name.
///
/// # Errors
/// A name that is relative, too long, or has a token that is not allowed.
pub(crate) fn check_full_name(what: &'static str, name: &str) -> Result<(), NameError> {
    let refuse = |reason, help| error(what, name, reason, help);
    if name.len() > LONGEST_NAME {
        let reason = format!("has {} characters, more than {LONGEST_NAME}", name.len());
        return Err(refuse(reason, "choose shorter names or fewer namespaces"));
    }
    let Some(tokens) = name.strip_prefix('/') else {
        return Err(refuse("does not begin with `/`".into(), "write it from the root: /team/pose"));
    };
    if tokens.is_empty() || tokens.ends_with('/') {
        return Err(refuse("ends in `/`".into(), SLASHES));
    }
    for token in tokens.split('/') {
        if token.is_empty() {
            return Err(refuse("has two `/` in a row".into(), SLASHES));
        }
        check_token(token).map_err(|reason| refuse(reason, LETTERS))?;
    }
    Ok(())
}

/// Checks one token of a name.
///
/// # Errors
/// A description of the fault.
pub(crate) fn check_token(token: &str) -> Result<(), String> {
    let is_allowed = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    if token.is_empty() {
        return Err("is empty".into());
    }
    if let Some(letter) = token.chars().find(|letter| !is_allowed(*letter)) {
        return Err(format!("`{token}` contains `{}`", letter.escape_default()));
    }
    if token.starts_with(|letter: char| letter.is_ascii_digit()) {
        return Err(format!("`{token}` begins with a digit"));
    }
    if token.contains("__") {
        return Err(format!("`{token}` contains two underscores in a row"));
    }
    Ok(())
}
