//! Rules by which a user renames nodes and topics.

/// Which names a rule speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    Topics,
    Services,
    Both,
}

/// The change that a rule makes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Remap {
    /// The node's name becomes this.
    NodeName(String),
    /// The node's namespace becomes this, fully qualified.
    Namespace(String),
    /// The topic or service `from` becomes `to`; both are expanded like any name of the node.
    Name { scope: Scope, from: String, to: String },
}

/// One `-r` rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemapRule {
    /// The one node it is for, by name without namespace; every node if none.
    pub node: Option<String>,
    pub remap: Remap,
}

impl RemapRule {
    /// The new name of this node, if this rule renames it.
    pub(super) fn new_node_name(&self, node: &str) -> Option<&str> {
        match &self.remap {
            Remap::NodeName(name) if self.is_for(node) => Some(name),
            _ => None,
        }
    }

    /// Where this rule puts a node of this name, if it moves it.
    pub(super) fn new_namespace(&self, node: &str) -> Option<&str> {
        match &self.remap {
            Remap::Namespace(namespace) if self.is_for(node) => Some(namespace),
            _ => None,
        }
    }

    /// The two sides of the rule, if it is for names of this scope of a node of this name.
    pub(super) fn name_for(&self, node: &str, wanted: Scope) -> Option<(&str, &str)> {
        match &self.remap {
            Remap::Name { scope, from, to }
                if self.is_for(node) && (*scope == wanted || *scope == Scope::Both) =>
            {
                Some((from, to))
            }
            _ => None,
        }
    }

    fn is_for(&self, node: &str) -> bool {
        self.node.as_deref().is_none_or(|name| name == node)
    }
}
