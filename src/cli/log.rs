//! The program's log, on standard error: that of a ROS 2 node as ROS 2 nodes write it (`rcutils`), any other short. A node's
//! lines are for `/rosout` too.

use std::fmt::{self, Debug};
use std::io::IsTerminal;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use flockform::messages::builtin_interfaces::Time;
use flockform::messages::escaped;
use flockform::messages::rcl_interfaces::Log;
use flockform::ros::arguments::{RosArguments, Severity};
use flockform::ros::edge::loggers::LogLevel;
use flockform::ros::edge::rosout::MOST_WAITING;
use flockform::ros::{node, robots};
use tracing::field::Field;
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format::{self, Writer};
use tracing_subscriber::fmt::writer::BoxMakeWriter;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::reload;
use tracing_subscriber::util::SubscriberInitExt;

use super::log_writer::LogWriter;
use super::node::Transport;
use super::{Arguments, Command};

/// Format of a node's lines unless `RCUTILS_CONSOLE_OUTPUT_FORMAT` says otherwise.
const NODE_FORMAT: &str = "[{severity}] [{time}] [{name}]: {message}";

/// Longer than any line of our own.
const MOST_CHARACTERS: usize = 2000;

/// The log of a node while it runs.
struct NodeLog {
    severity: Mutex<Severity>,
    /// Severity and filter at the start, to which level 0 returns.
    first: (Severity, Targets),
    filter: Box<dyn Fn(Targets) -> Result<(), String> + Send + Sync>,
}

impl NodeLog {
    /// Severity and filter when this severity is asked for.
    fn of(&self, wanted: Severity) -> (Severity, Targets) {
        match wanted {
            Severity::Unset => self.first.clone(),
            _ => (wanted, only_ours(filter_of(wanted, 0))),
        }
    }
}

static NODE_LOG: OnceLock<NodeLog> = OnceLock::new();
/// The end of a node's lines at which they are taken.
static LINES: Mutex<Option<Receiver<Log>>> = Mutex::new(None);

/// The lines of a node's log, for its topic; none where they are not asked for, or taken already.
pub fn lines() -> Option<Receiver<Log>> {
    LINES.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// The level of a node's log; none where nothing is to be logged, or what is not a node.
pub fn level() -> Option<LogLevel> {
    let log = NODE_LOG.get()?;
    let severity = || log.severity.lock().unwrap_or_else(PoisonError::into_inner);
    Some(LogLevel {
        get: Box::new(move || *severity()),
        set: Box::new(move |wanted| {
            let (wanted, filter) = log.of(wanted);
            (log.filter)(filter)?;
            *severity() = wanted;
            Ok(())
        }),
    })
}

/// Starts the log. `RUST_LOG` wins over `--log-level`, and that over `-v`, until a level is set from outside
/// ([`level`]). By default a node logs from INFO on, any other command from WARN on.
pub fn start(arguments: &Arguments, ros: &RosArguments) {
    let logger = logger(&arguments.command, ros);
    let is_node = matches!(arguments.command, Command::Node(_) | Command::Robots(_));
    let verbosity = arguments.verbose + u8::from(is_node);
    let given = ros.logging.level_of(logger.as_deref().unwrap_or(node::NAME));
    let is_console = ros.logging.stdout;
    let is_topic = logger.is_some() && ros.logging.rosout;
    let level = if is_console || is_topic {
        only_ours(filter_of(given.unwrap_or(Severity::Unset), verbosity))
    } else {
        Targets::new()
    };
    let asked = std::env::var("RUST_LOG").ok().and_then(|asked| asked.replace(' ', "").parse().ok());
    let filter = asked.unwrap_or(level);
    let first = (given.unwrap_or(Severity::Unset), filter.clone());
    // A control loop must not wait for a reader; any other command may.
    let thread = (is_console && is_node).then(|| LogWriter::start(std::io::stderr()));
    let writer = match thread {
        Some(Ok(writer)) => BoxMakeWriter::new(move || writer.clone()),
        _ if is_console => BoxMakeWriter::new(std::io::stderr),
        _ => BoxMakeWriter::new(std::io::sink),
    };
    let (filter, handle) = reload::Layer::new(filter);
    let log = tracing_subscriber::registry().with(filter);
    let lines = tracing_subscriber::fmt::layer().with_writer(writer);
    let lines = lines.with_ansi(std::io::stderr().is_terminal()).fmt_fields(format::debug_fn(field));
    match logger {
        None => log.with(lines.without_time()).init(),
        Some(name) => {
            let asked = std::env::var("RCUTILS_CONSOLE_OUTPUT_FORMAT").ok();
            let format = asked.filter(|format| !format.is_empty()).unwrap_or_else(|| NODE_FORMAT.into());
            let topic = is_topic.then(|| {
                let (sender, lines) = sync_channel(MOST_WAITING);
                *LINES.lock().unwrap_or_else(PoisonError::into_inner) = Some(lines);
                sender
            });
            let lines = lines.event_format(NodeLines { name, format, topic });
            let severity = Mutex::new(first.0);
            let filter = Box::new(move |filter| handle.reload(filter).map_err(|error| error.to_string()));
            if is_console || is_topic {
                // Set once: a process starts one log.
                let _ = NODE_LOG.set(NodeLog { severity, first, filter });
            }
            log.with(lines).init();
        }
    }
}

/// The filter of a severity; of none, that of a verbosity.
fn filter_of(severity: Severity, verbosity: u8) -> &'static str {
    match severity {
        Severity::Unset => {
            ["warn", "flockform=info", "flockform=debug", "trace"][usize::from(verbosity.min(3))]
        }
        Severity::Debug => "flockform=debug",
        Severity::Info => "flockform=info",
        Severity::Warn => "flockform=warn",
        Severity::Error | Severity::Fatal => "flockform=error",
    }
}

/// Without the warnings of the middleware, which reports every peer that comes and goes.
fn only_ours(level: &str) -> Targets {
    format!("{level},rustdds=error,ros2_client=error").parse().expect("targets and their levels")
}

/// Name of the logger of the node that a command is, with dots as `rcl` has them; none of other commands.
fn logger(command: &Command, ros: &RosArguments) -> Option<String> {
    let names = match command {
        Command::Node(node) if node.transport == Transport::Ros2 => node::names(ros, node.member.as_deref()),
        Command::Robots(asked) if asked.transport == Transport::Ros2 => ros.names(robots::NAME, "/"),
        _ => return None,
    };
    Some(names.ok()?.logger())
}

/// A field of a log line, on its line whatever is in it: much of it comes from files and from the network.
fn field(line: &mut Writer<'_>, field: &Field, value: &dyn Debug) -> fmt::Result {
    if field.name() != "message" {
        write!(line, " {field}=")?;
    }
    write!(line, "{}", escaped(&format!("{value:?}"), MOST_CHARACTERS))
}

/// The lines of a ROS 2 node.
struct NodeLines {
    /// Name of the logger.
    name: String,
    /// With the placeholders of `RCUTILS_CONSOLE_OUTPUT_FORMAT`.
    format: String,
    /// To `/rosout`, if they go there.
    topic: Option<SyncSender<Log>>,
}

impl<S, N> FormatEvent<S, N> for NodeLines
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let mut message = String::new();
        context.format_fields(Writer::new(&mut message), event)?;
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let line =
            filled(&self.format, &|placeholder| self.value(placeholder, event.metadata(), since, &message));
        if let Some(topic) = &self.topic {
            // Where they are not taken the latest are lost: a log never waits.
            let _ = topic.try_send(self.record(event.metadata(), since, message));
        }
        writeln!(writer, "{line}")
    }
}

impl NodeLines {
    fn record(&self, of: &Metadata<'_>, since: std::time::Duration, message: String) -> Log {
        Log {
            stamp: Time {
                sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX),
                nanosec: since.subsec_nanos(),
            },
            level: severity(*of.level()).number() as u8,
            name: self.name.clone(),
            msg: message,
            file: of.file().unwrap_or_default().to_owned(),
            function: of.module_path().unwrap_or_default().to_owned(),
            line: of.line().unwrap_or_default(),
        }
    }

    fn value(
        &self,
        placeholder: &str,
        of: &Metadata<'_>,
        since: std::time::Duration,
        message: &str,
    ) -> Option<String> {
        Some(match placeholder {
            "severity" => severity(*of.level()).name().to_owned(),
            "name" => self.name.clone(),
            "message" => message.to_owned(),
            "time" => format!("{}.{:09}", since.as_secs(), since.subsec_nanos()),
            "time_as_nanoseconds" => since.as_nanos().to_string(),
            "file_name" => of.file().unwrap_or_default().to_owned(),
            "line_number" => of.line().unwrap_or_default().to_string(),
            "function_name" => of.module_path().unwrap_or_default().to_owned(),
            _ => return None,
        })
    }
}

fn severity(level: Level) -> Severity {
    match level {
        Level::ERROR => Severity::Error,
        Level::WARN => Severity::Warn,
        Level::INFO => Severity::Info,
        Level::DEBUG | Level::TRACE => Severity::Debug,
    }
}

/// A format with its placeholders filled in; those that are none stay as they are written.
fn filled(format: &str, value: &dyn Fn(&str) -> Option<String>) -> String {
    let mut line = String::new();
    let mut rest = format;
    while let Some((before, after)) = rest.split_once('{') {
        line += before;
        match after.split_once('}').and_then(|(name, after)| Some((value(name)?, after))) {
            Some((value, after)) => {
                line += &value;
                rest = after;
            }
            None => {
                line.push('{');
                rest = after;
            }
        }
    }
    line + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unset_level_returns_to_the_filter_of_the_start() {
        let targets = |filter: &str| filter.parse::<Targets>().expect("targets and their levels");
        let first = (Severity::Warn, targets("flockform=warn,rustdds=debug"));
        let log =
            NodeLog { severity: Mutex::new(first.0), first: first.clone(), filter: Box::new(|_| Ok(())) };
        assert_eq!(log.of(Severity::Unset), first);
        let debug = (Severity::Debug, targets("flockform=debug,rustdds=error,ros2_client=error"));
        assert_eq!(log.of(Severity::Debug), debug);
    }

    #[test]
    fn placeholders_are_filled_in_and_others_stay() {
        let value = |name: &str| (name == "name").then(|| "a.b{severity}".to_owned());
        assert_eq!(filled("[{name}] {other} {", &value), "[a.b{severity}] {other} {");
        assert_eq!(filled("{{name}}", &value), "{a.b{severity}}");
        assert_eq!(filled("no placeholder", &value), "no placeholder");
    }
}
