//! Which messages are logged, and to where.

use super::RosArgumentError;

/// Severity of a log message, as `rcutils` names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The severity of the logger's parent.
    Unset,
    Debug,
    Info,
    Warn,
    Error,
    Fatal,
}

/// Which messages are logged, and to where; `Default` is the behaviour without arguments.
#[derive(Clone, Debug, PartialEq)]
pub struct Logging {
    /// Least severity logged, where the logger has none of its own \[default: none given\].
    pub level: Option<Severity>,
    /// Least severity of single loggers, in the order given; the last one of a name counts.
    pub loggers: Vec<(String, Severity)>,
    /// Logs go to the console \[default: true\].
    pub stdout: bool,
}

impl Default for Logging {
    fn default() -> Self {
        Self { level: None, loggers: Vec::new(), stdout: true }
    }
}

impl Logging {
    /// The least severity of the logger of this name, if any was given for it or for all.
    pub fn level_of(&self, logger: &str) -> Option<Severity> {
        let own = self.loggers.iter().rev().find(|(name, _)| name == logger).map(|(_, level)| *level);
        own.or(self.level)
    }

    /// Reads the value of `--log-level`: `LEVEL` or `LOGGER:=LEVEL`.
    pub(super) fn take_level(&mut self, rule: &str) -> Result<(), RosArgumentError> {
        let refuse = |reason: String| RosArgumentError::Rule {
            flag: "--log-level".into(),
            rule: rule.into(),
            reason,
            help: "write DEBUG, INFO, WARN, ERROR, FATAL or UNSET, or LOGGER:=LEVEL for one logger",
        };
        let severity =
            |word: &str| Severity::parse(word).ok_or_else(|| refuse(format!("`{word}` is no log level")));
        match rule.split_once(":=") {
            Some(("", _)) => return Err(refuse("the name of the logger is empty".into())),
            Some((logger, level)) => self.loggers.push((logger.into(), severity(level)?)),
            None => self.level = Some(severity(rule)?),
        }
        Ok(())
    }
}

impl Severity {
    /// Every severity with its number in `rcl_interfaces/msg/LoggerLevel`.
    const NUMBERS: [(Self, u32); 6] = [
        (Self::Unset, 0),
        (Self::Debug, 10),
        (Self::Info, 20),
        (Self::Warn, 30),
        (Self::Error, 40),
        (Self::Fatal, 50),
    ];

    /// The number in `rcl_interfaces/msg/LoggerLevel`.
    pub fn number(self) -> u32 {
        Self::NUMBERS.iter().find(|(severity, _)| *severity == self).map_or(0, |(_, number)| *number)
    }

    /// The severity of a number, if there is one.
    pub fn of_number(number: u32) -> Option<Self> {
        Self::NUMBERS.iter().find(|(_, one)| *one == number).map(|(severity, _)| *severity)
    }

    fn parse(word: &str) -> Option<Self> {
        Some(match word.to_ascii_uppercase().as_str() {
            "UNSET" => Self::Unset,
            "DEBUG" => Self::Debug,
            "INFO" => Self::Info,
            "WARN" => Self::Warn,
            "ERROR" => Self::Error,
            "FATAL" => Self::Fatal,
            _ => return None,
        })
    }
}
