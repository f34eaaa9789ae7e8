//! Which arguments are ROS ones, and what each flag takes.

use std::ffi::OsStr;
use std::path::PathBuf;

use super::logging::Logging;
use super::security::fault_of_name;
use super::{RosArgumentError, RosArguments, assignment, parameter_file};
use crate::messages::remap::RemapRule;
use crate::scene::text;

/// Every flag that may follow `--ros-args`.
#[rustfmt::skip]
pub const FLAGS: [&str; 17] = [
    "-r", "--remap", "-p", "--param", "--params-file", "--log-level", "--log-config-file", "--log-file-name",
    "-e", "--enclave", "--enable-rosout-logs", "--disable-rosout-logs", "--enable-stdout-logs",
    "--disable-stdout-logs", "--enable-external-lib-logs", "--disable-external-lib-logs", "--ros-args",
];

/// Splits arguments at `--ros-args ... [--]` (any number of times) and reads the ROS ones.
pub fn parse<A: AsRef<OsStr>>(
    arguments: impl IntoIterator<Item = A>,
) -> Result<(Vec<A>, RosArguments), RosArgumentError> {
    let mut arguments = arguments.into_iter();
    let (mut rest, mut ros, mut inside) = (Vec::new(), RosArguments::default(), false);
    while let Some(argument) = arguments.next() {
        match (inside, argument.as_ref().to_str()) {
            (_, Some("--ros-args")) => inside = true,
            (true, Some("--")) => inside = false,
            (true, _) => ros.take_flag(&argument.as_ref().to_string_lossy(), &mut arguments)?,
            (false, _) => rest.push(argument),
        }
    }
    Ok((rest, ros))
}

impl RosArguments {
    fn take_flag(
        &mut self,
        flag: &str,
        arguments: &mut impl Iterator<Item: AsRef<OsStr>>,
    ) -> Result<(), RosArgumentError> {
        // As in rcl, a flag takes whatever follows, even `--`.
        let mut value = |expects: &'static str| {
            let missing = || RosArgumentError::MissingValue { flag: flag.into(), expects };
            arguments.next().ok_or_else(missing)
        };
        let mut text = |expects: &'static str| read_text(flag, value(expects)?.as_ref());
        match flag {
            "-r" | "--remap" => self.remaps.push(RemapRule::parse(flag, &text("a rule FROM:=TO")?)?),
            "-p" | "--param" => {
                self.assignments.push(assignment::parse(flag, &text("an assignment NAME:=VALUE")?)?);
            }
            "--params-file" => self.read_parameters(value("the path of a YAML file")?.as_ref().into())?,
            "--log-level" => {
                let rule = text("a level or LOGGER:=LEVEL")?;
                self.logging.take_level(&rule)?;
            }
            "--log-config-file" => {
                return Err(no_log_library(flag, &text("the path of a configuration file")?));
            }
            "--log-file-name" => return Err(no_log_library(flag, &text("a file name prefix")?)),
            "-e" | "--enclave" => self.enclave = Some(enclave(flag, text("a security enclave /PATH")?)?),
            switch if switch_of(&mut self.logging, switch) => {}
            "--enable-external-lib-logs" => return Err(no_log_library(flag, "")),
            _ => return Err(unknown(flag.into())),
        }
        Ok(())
    }

    fn read_parameters(&mut self, path: PathBuf) -> Result<(), RosArgumentError> {
        let text =
            text::read(&path).map_err(|error| RosArgumentError::ReadFile { path: path.clone(), error })?;
        self.assignments.extend(parameter_file::parse(&path, &text)?);
        Ok(())
    }
}

/// A rule, which is text; a path alone may be any bytes.
fn read_text(flag: &str, value: &OsStr) -> Result<String, RosArgumentError> {
    let why = || ("it is not UTF-8".into(), "write it in UTF-8");
    let refuse = || RosArgumentError::rule(flag, &value.to_string_lossy(), why());
    value.to_str().map(str::to_owned).ok_or_else(refuse)
}

fn enclave(flag: &str, name: String) -> Result<String, RosArgumentError> {
    let Some(reason) = fault_of_name(&name) else { return Ok(name) };
    let help = "name it as in `ros2 security create_enclave`: /fleet/robot_7";
    Err(RosArgumentError::rule(flag, &name, (reason.into(), help)))
}

/// Sets the switch that `flag` names; false where it names none.
fn switch_of(logging: &mut Logging, flag: &str) -> bool {
    let (on, name) = match (flag.strip_prefix("--enable-"), flag.strip_prefix("--disable-")) {
        (Some(name), _) => (true, name),
        (_, Some(name)) => (false, name),
        _ => return false,
    };
    match name {
        "stdout-logs" => logging.stdout = on,
        "rosout-logs" => logging.rosout = on,
        // There are none.
        "external-lib-logs" => return !on,
        _ => return false,
    }
    true
}

fn no_log_library(flag: &str, rule: &str) -> RosArgumentError {
    let reason = "this node logs to the console and to /rosout alone".into();
    RosArgumentError::rule(flag, rule, (reason, "leave it out, and keep the console's output"))
}

fn unknown(flag: String) -> RosArgumentError {
    if !flag.starts_with('-') {
        let guess = if flag.contains(":=") { "--remap" } else { "--params-file" };
        return RosArgumentError::StrayWord { word: flag, guess };
    }
    let nearest = text::nearest(&flag, &FLAGS).filter(|_| flag.len() > 2);
    RosArgumentError::UnknownFlag { flag, nearest }
}
