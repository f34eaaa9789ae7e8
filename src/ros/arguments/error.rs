//! Why ROS arguments were refused.

use std::path::PathBuf;

/// The fault of a rule or value, and the remedy.
pub(super) type Reason = (String, &'static str);

/// Why `--ros-args` or the environment was refused.
#[derive(Debug, thiserror::Error)]
pub enum RosArgumentError {
    #[error("--ros-args: unknown flag `{flag}`\n  help: {}", nearest_flag(nearest))]
    UnknownFlag { flag: String, nearest: Option<&'static str> },
    #[error(
        "--ros-args: `{word}` belongs to no flag\n  help: end the ROS arguments with `--` before it, or write `{guess} {word}`"
    )]
    StrayWord { word: String, guess: &'static str },
    #[error("--ros-args: `{flag}` is the last argument and needs {expects} after it")]
    MissingValue { flag: String, expects: &'static str },
    #[error("--ros-args {flag} {rule}: {reason}\n  help: {help}")]
    Rule { flag: String, rule: String, reason: String, help: &'static str },
    #[error("--ros-args --params-file {}: {error}", path.display())]
    ReadFile { path: PathBuf, error: std::io::Error },
    #[error("parameter file {}, line {line}: {reason}\n  help: {help}", path.display())]
    ParameterFile { path: PathBuf, line: usize, reason: String, help: &'static str },
    #[error("environment variable {variable}={value}: {reason}\n  help: {help}")]
    Environment { variable: &'static str, value: String, reason: &'static str, help: &'static str },
    #[error("DDS security: {place}: {reason}\n  help: {help}")]
    Security { place: String, reason: String, help: &'static str },
}

impl RosArgumentError {
    pub(super) fn rule(flag: &str, rule: &str, (reason, help): Reason) -> Self {
        Self::Rule { flag: flag.into(), rule: rule.into(), reason, help }
    }
}

fn nearest_flag(nearest: &Option<&'static str>) -> String {
    let end = "arguments of the program itself go before `--ros-args` or after `--`";
    match nearest {
        Some(flag) => format!("did you mean `{flag}`? Otherwise: {end}"),
        None => format!("{end}; the ROS flags are {}", super::grammar::FLAGS.join(", ")),
    }
}
