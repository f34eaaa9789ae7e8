//! The level of a node's log, read and set from outside: `~/get_logger_levels` and `~/set_logger_levels`.

use crate::messages::rcl_interfaces::{
    GetLoggerLevels, GetLoggerLevelsResponse, LoggerLevel, SetLoggerLevels, SetLoggerLevelsResponse,
    SetParametersResult,
};
use crate::messages::said;
use crate::ros::arguments::Severity;
use crate::ros::edge::{EdgeError, Node, Service};

/// The least severity of the lines of a log that runs.
pub struct LogLevel {
    pub get: Box<dyn Fn() -> Severity + Send>,
    /// Says why where it cannot be set.
    pub set: Box<dyn Fn(Severity) -> Result<(), String> + Send>,
}

/// Levels taken of one request \[1\]: each sets the filter of the log anew, and a node has one logger.
const MOST_LEVELS: usize = 16;

/// A node's logger behind its services.
pub struct Loggers {
    /// Name of the logger: the node's, with dots.
    logger: String,
    level: LogLevel,
    get: Service<GetLoggerLevels>,
    set: Service<SetLoggerLevels>,
}

impl Loggers {
    /// Serves the log of this level as that of the node.
    ///
    /// # Errors
    /// As [`Node::service`].
    pub fn new(node: &Node, level: LogLevel) -> Result<Self, EdgeError> {
        Ok(Self {
            logger: node.logger(),
            level,
            get: node.service(&node.private("get_logger_levels")?)?,
            set: node.service(&node.private("set_logger_levels")?)?,
        })
    }

    /// Answers the requests since the last call. With a reason in `locked`, peers may set no level.
    pub fn serve(&self, locked: Option<&str>) {
        self.get.serve(|request| GetLoggerLevelsResponse {
            levels: request.names.into_iter().map(|name| self.level_of(name)).collect(),
        });
        self.set.serve(|request| {
            let count = request.levels.len();
            let many =
                (count > MOST_LEVELS).then(|| format!("{count} levels: at most {MOST_LEVELS} a request"));
            let refused = locked.or(many.as_deref());
            let results = request.levels.iter().map(|wanted| result(self.set_level(wanted, refused)));
            SetLoggerLevelsResponse { results: results.collect() }
        });
    }

    /// Of other loggers 0, which is none.
    fn level_of(&self, name: String) -> LoggerLevel {
        let level = if name == self.logger { (self.level.get)().number() } else { 0 };
        LoggerLevel { name, level }
    }

    fn set_level(&self, wanted: &LoggerLevel, refused: Option<&str>) -> Result<(), String> {
        if let Some(reason) = refused {
            return Err(reason.to_owned());
        }
        if wanted.name != self.logger {
            return Err(format!("the node's one logger is `{}`, not `{}`", self.logger, said(&wanted.name)));
        }
        let severity = Severity::of_number(wanted.level);
        let help = "give 10 (DEBUG), 20 (INFO), 30 (WARN), 40 (ERROR), 50 (FATAL) or 0 for the default";
        (self.level.set)(severity.ok_or_else(|| format!("{} is no log level: {help}", wanted.level))?)
    }
}

/// `msg/SetLoggerLevelsResult` has the fields of the result of setting a parameter.
fn result(set: Result<(), String>) -> SetParametersResult {
    SetParametersResult { successful: set.is_ok(), reason: set.err().unwrap_or_default() }
}
