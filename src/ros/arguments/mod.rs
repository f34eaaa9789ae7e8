//! ROS 2 command line arguments: `--ros-args` and the environment, read into data.
//!
//! The grammar is that of the design articles "ROS Command Line Arguments" and "Remapping Names"
//! (design.ros2.org) as far as `rcl` (Jazzy) implements them. Features that `rcl` leaves out (wildcards and
//! `\1` in remap rules) are refused by name, and so is every unknown flag: a misspelt argument never
//! passes for an ordinary one. Deprecated rules outside `--ros-args` are ordinary arguments here.
//!
//! ```
//! use flockform::ros::arguments::RosArguments;
//!
//! let arguments = ["flockform", "node", "--ros-args", "-r", "__ns:=/team", "-p", "rate:=50.0", "--", "square.toml"];
//! let (rest, ros) = RosArguments::parse(arguments.map(String::from), &|_| None)?;
//! assert_eq!(rest, ["flockform", "node", "square.toml"]);
//!
//! let names = ros.names("flockform", "/")?;
//! assert_eq!(names.fully_qualified(), "/team/flockform");
//! assert_eq!(names.topic("~/state")?, "/team/flockform/state");
//! assert_eq!(ros.parameters_for(&names.fully_qualified())[0].name, "rate");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assignment;
#[cfg(feature = "security")]
mod enclave;
pub mod environment;
mod error;
mod grammar;
pub mod logging;
mod parameter_file;
mod remap;
mod security;
mod value;
mod yaml;

use std::ffi::OsStr;

pub use crate::messages::names::{NameError, Names};
pub use crate::messages::remap::RemapRule;
pub use crate::ros::edge::parameters::Value;
pub use assignment::{Assignment, NodePattern, Origin, Parameter};
pub use environment::{DiscoveryRange, Environment};
pub use error::RosArgumentError;
pub use logging::{Logging, Severity};
pub use security::{Security, SecurityRequest};

/// The ROS arguments of a process.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RosArguments {
    /// Remap rules (`-r`) in the order given; the first that matches wins.
    pub remaps: Vec<RemapRule>,
    /// Parameter assignments (`-p` and the contents of `--params-file`) in the order given; the last
    /// one that matches wins.
    pub assignments: Vec<Assignment>,
    /// Which messages are logged, and to where.
    pub logging: Logging,
    /// The environment variables.
    pub environment: Environment,
    /// The enclave that `--enclave` names, begun with a slash.
    pub enclave: Option<String>,
    /// How to take part, as enclave and environment say.
    pub security: Security,
}

impl RosArguments {
    /// Splits a process' arguments into ordinary ones, in their order, and what `--ros-args` and the
    /// environment say. `environment` looks up one variable (`&|name| std::env::var(name).ok()`).
    ///
    /// # Errors
    /// An unknown flag, a flag without its value, a rule that does not parse, a parameter file that
    /// cannot be read or understood, an environment variable out of its range, security that is enforced and
    /// cannot be had.
    pub fn parse<A: AsRef<OsStr>>(
        arguments: impl IntoIterator<Item = A>,
        environment: &dyn Fn(&str) -> Option<String>,
    ) -> Result<(Vec<A>, Self), RosArgumentError> {
        let environment = Environment::read(environment)?;
        let (rest, parsed) = grammar::parse(arguments)?;
        let security = environment.security.settle(parsed.enclave.as_deref())?;
        Ok((rest, Self { environment, security, ..parsed }))
    }

    /// The names of a node that calls itself `node` in `namespace`, with these rules applied.
    ///
    /// # Errors
    /// A name or namespace that ROS 2 does not allow, before or after remapping.
    pub fn names(&self, node: &str, namespace: &str) -> Result<Names, NameError> {
        Names::new(node, namespace, &self.remaps)
    }

    /// The parameters given to the node of this fully qualified name, each once with the value that
    /// was given last, in the order in which they were first named.
    ///
    /// `rclcpp` orders by *node key* first, so there a value given under a key that was already used
    /// (say `/**`) cannot override one under a key that appeared since. Here the last one given wins,
    /// always.
    pub fn parameters_for(&self, node: &str) -> Vec<Parameter> {
        let mut parameters: Vec<Parameter> = Vec::new();
        for assignment in self.assignments.iter().filter(|assignment| assignment.node.matches(node)) {
            let parameter = &assignment.parameter;
            match parameters.iter_mut().find(|earlier| earlier.name == parameter.name) {
                Some(earlier) => earlier.clone_from(parameter),
                None => parameters.push(parameter.clone()),
            }
        }
        parameters
    }
}
