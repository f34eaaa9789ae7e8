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
use super::{Assignment, NodePattern, Origin, RosArgumentError, Value, value};

const PARAMETERS: &str = "ros__parameters";
const SHAPE: &str = "write NODE, then ros__parameters below it, then NAME: VALUE lines";

/// Takes a parameter of a node: its name, its value and the line of its name, from 1.
type Take<'a> = &'a mut dyn FnMut(&NodePattern, String, Value, usize);

/// The parameters of the file that holds `text`, in its order.
pub fn parse(path: &Path, text: &str) -> Result<Vec<Assignment>, RosArgumentError> {
    let mut parameters = Vec::new();
    let mut take = |node: &NodePattern, name: String, value: Value, line: usize| {
        let origin = Origin::File { path: path.into(), line };
        parameters.push(Assignment::new(node.clone(), name, value, origin));
    };
    let read = yaml::parse(text).and_then(|document| match document {
        None => Ok(()),
        Some(Node::Mapping(entries)) => read_nodes("", &entries, &mut take),
        Some(_) => Err(error(1, "is no mapping of node names".into(), SHAPE)),
    });
    read.map(|()| parameters).map_err(|YamlError { line, reason, help }| RosArgumentError::ParameterFile {
        path: path.into(),
        line,
        reason,
        help,
    })
}

fn read_nodes(above: &str, entries: &[Entry], take: Take<'_>) -> Result<(), YamlError> {
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
            read_parameters(&pattern, "", children, take)?;
        } else {
            let below = match above {
                "" => key.clone(),
                _ => format!("{}/{}", above.trim_end_matches('/'), key.trim_start_matches('/')),
            };
            read_nodes(&below, children, take)?;
        }
    }
    Ok(())
}

fn read_parameters(
    pattern: &NodePattern,
    above: &str,
    entries: &[Entry],
    take: Take<'_>,
) -> Result<(), YamlError> {
    for Entry { key, line, node } in entries {
        let name = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        if let Node::Mapping(children) = node {
            read_parameters(pattern, &name, children, take)?;
            continue;
        }
        let value = value::from_node(node)
            .map_err(|(reason, help)| error(*line, format!("parameter `{name}` {reason}"), help))?;
        take(pattern, name, value, *line);
    }
    Ok(())
}

fn error(line: usize, reason: String, help: &'static str) -> YamlError {
    YamlError { line, reason, help }
}
