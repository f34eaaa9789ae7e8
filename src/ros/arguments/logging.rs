//! Which messages are logged, and to where.

use super::RosArgumentError;

named! {
    /// Severity of a log message, as `rcutils` names them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Severity {
        /// The severity of the logger's parent.
        Unset => "UNSET",
        Debug => "DEBUG",
        Info => "INFO",
        Warn => "WARN",
        Error => "ERROR",
        Fatal => "FATAL",
    }
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
    /// Logs go to the topic `/rosout` \[default: true\].
    pub rosout: bool,
}

impl Default for Logging {
    fn default() -> Self {
        Self { level: None, loggers: Vec::new(), stdout: true, rosout: true }
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
        let help = "write DEBUG, INFO, WARN, ERROR, FATAL or UNSET, or LOGGER:=LEVEL for one logger";
        let refuse = |reason| RosArgumentError::rule("--log-level", rule, (reason, help));
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
    /// The number in `rcl_interfaces/msg/LoggerLevel` and `rcl_interfaces/msg/Log`.
    pub fn number(self) -> u32 {
        10 * self as u32
    }

    /// The severity of a number, if there is one.
    pub(crate) fn of_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|severity| severity.number() == number)
    }

    fn parse(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|severity| severity.name().eq_ignore_ascii_case(word))
    }
}
