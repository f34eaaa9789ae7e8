//! `--ros-args` and the environment, held against the rules of the ROS 2 design articles "ROS Command
//! Line Arguments" and "Remapping Names", and against what `rcl` implements of them.

#![cfg(feature = "ros")]

mod any_input;
mod environment;
mod grammar;
mod names;
mod parameters;

use flockform::ros::arguments::{RosArgumentError, RosArguments};

/// The arguments of a line, which quotes nothing.
pub fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(String::from).collect()
}

/// Other arguments and the ROS arguments, under an empty environment.
pub fn parse(arguments: &[String]) -> Result<(Vec<String>, RosArguments), RosArgumentError> {
    RosArguments::parse(arguments.iter().cloned(), &|_| None)
}

/// The ROS arguments of `--ros-args LINE`.
pub fn ros(line: &str) -> RosArguments {
    parse(&words(&format!("--ros-args {line}"))).unwrap_or_else(|error| panic!("{line}: {error}")).1
}

/// The message that refuses `--ros-args LINE`.
pub fn refusal(line: &str) -> String {
    match parse(&words(&format!("--ros-args {line}"))) {
        Ok(_) => panic!("{line} is accepted"),
        Err(error) => error.to_string(),
    }
}
