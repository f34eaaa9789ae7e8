//! Errors of opening a node.

use crate::ros::arguments::NameError;
use crate::ros::edge::EdgeError;
use crate::ros::edge::parameters::Refusal;
use crate::scene::SceneError;
use crate::swarm::control::scope::NodeScopeError;

/// An error of opening a node.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    #[error("{0}")]
    Swarm(#[from] SceneError),
    #[error("{0}")]
    Edge(#[from] EdgeError),
    #[error("{0}")]
    Name(#[from] NameError),
    #[error("{0}")]
    Parameter(#[from] Refusal),
    #[error("{0}")]
    NodeScope(#[from] NodeScopeError),
    #[error(
        "topic {topic} has two uses: {} and {}\n  help: give each use a name of its own, and write {{name}} in it \
         for the robot's name: {{name}}/pose",
        uses[0],
        uses[1]
    )]
    SharedTopic { topic: String, uses: [String; 2] },
}
