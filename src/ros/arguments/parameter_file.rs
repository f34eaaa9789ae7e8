//! Parameter files: node names, then `ros__parameters`, then parameters, nested as one likes.
//!
//! ```yaml
//! /team:                     # a namespace
//!   flockform:               # a node
//!     ros__parameters:
//!       rate: 50.0
//!       limits: {speed: 1.5} # the parameter limits.speed
//! /**:                       # every node
//!   ros__parameters:
//!     use_sim_time: true
//! ```

use std::path::Path;

use super::yaml::{self, Entry, Node, YamlError};
use super::{NodePattern, RosArgumentError, Value, value};

const PARAMETERS: &str = "ros__parameters";
const SHAPE: &str = "write NODE, then ros__parameters below it, then NAME: VALUE lines";

/// One parameter of a file.
#[derive(Debug)]
pub struct FileEntry {
    pub node: NodePattern,
    pub name: String,
    pub value: Value,
    /// Line of the parameter's name, from 1.
    pub line: usize,
}

/// The parameters of the file that holds `text`, in its order.
pub fn parse(text: &str) -> Result<Vec<FileEntry>, YamlError> {
    let mut parameters = Vec::new();
    match yaml::parse(text)? {
        None => {}
        Some(Node::Mapping(entries)) => read_nodes("", &entries, &mut parameters)?,
        Some(_) => return Err(error(1, "is no mapping of node names".into(), SHAPE)),
    }
    Ok(parameters)
}

fn read_nodes(above: &str, entries: &[Entry], parameters: &mut Vec<FileEntry>) -> Result<(), YamlError> {
    for Entry { key, line, node } in entries {
        let children = match node {
            Node::Mapping(children) => children,
            _ if key == PARAMETERS => {
                return Err(error(*line, format!("`{PARAMETERS}` holds no NAME: VALUE lines"), SHAPE));
            }
            _ => return Err(error(*line, format!("`{key}` has a value before `{PARAMETERS}`"), SHAPE)),
        };
        if key == PARAMETERS {
            if above.is_empty() {
                return Err(error(*line, format!("`{PARAMETERS}` has no node above it"), SHAPE));
            }
            let pattern = NodePattern::parse(above).map_err(|reason| {
                error(*line, format!("node `{above}`: {reason}"), "write /team/flockform, /team/* or /**")
            })?;
            read_parameters(&pattern, "", children, parameters)?;
        } else {
            let below = match above {
                "" => key.clone(),
                _ => format!("{}/{}", above.trim_end_matches('/'), key.trim_start_matches('/')),
            };
            read_nodes(&below, children, parameters)?;
        }
    }
    Ok(())
}

fn read_parameters(
    pattern: &NodePattern,
    above: &str,
    entries: &[Entry],
    parameters: &mut Vec<FileEntry>,
) -> Result<(), YamlError> {
    for Entry { key, line, node } in entries {
        let name = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        if let Node::Mapping(children) = node {
            read_parameters(pattern, &name, children, parameters)?;
            continue;
        }
        let value = value::from_node(node)
            .map_err(|(reason, help)| error(*line, format!("parameter `{name}` {reason}"), help))?;
        parameters.push(FileEntry { node: pattern.clone(), name, value, line: *line });
    }
    Ok(())
}

fn error(line: usize, reason: String, help: &'static str) -> YamlError {
    YamlError { line, reason, help }
}

impl YamlError {
    pub(super) fn in_file(self, path: &Path) -> RosArgumentError {
        let Self { line, reason, help } = self;
        RosArgumentError::ParameterFile { path: path.into(), line, reason, help }
    }
}
