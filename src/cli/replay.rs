//! `flockform replay`: a recorded flight through today's loop.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use flockform::record::Reader;
use flockform::record::replay::{Report, recorded_swarm, replay as fly_again};

use super::names::Overrides;
use super::swarm::SwarmFileArguments;
use super::{Refusal, exit_code, print, say};

#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// MCAP file written by --record or by `ros2 bag record -s mcap`
    recording: PathBuf,
    /// Bundled swarm or swarm file to use [default: the one in the recording, with the keys that it overrides]
    #[arg(long, value_name = "SWARM")]
    swarm: Option<String>,
    #[command(flatten)]
    overrides: Overrides,
    /// Largest distance in metres between a target and the recorded one that counts as none
    #[arg(long, value_name = "METRES", default_value = "1e-6", value_parser = tolerance)]
    tolerance: f64,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| "give a distance in metres, 0 or more".to_owned())
}

/// Replays a flight and lists where today's targets differ from the recorded ones.
pub fn replay(arguments: &ReplayArguments) -> Result<ExitCode, Refusal> {
    let reader = Reader::open(&arguments.recording)?;
    let swarm = match &arguments.swarm {
        Some(swarm) => SwarmFileArguments::new(swarm, &arguments.overrides.set).load()?,
        None => recorded_swarm(&reader, &arguments.overrides.set)?,
    };
    let report = fly_again(&reader, &swarm, arguments.tolerance)?;
    if arguments.json {
        print(&format!("{:#}\n", serde_json::json!(report)))?;
    } else {
        say(&words(&report))?;
    }
    Ok(exit_code(report.holds() && report.is_whole()))
}

fn words(report: &Report) -> String {
    let mut words = format!(
        "{}: {} ticks and {} poses of `{}` replayed\n",
        report.recording.display(),
        report.ticks,
        report.poses,
        report.swarm
    );
    if let Some(damage) = &report.damage {
        words += &format!("caution: the file breaks off: {damage}; what came after is not replayed\n");
    }
    let width = report.robots.iter().map(|robot| robot.name.len()).max().unwrap_or(0).max(5);
    words += &format!(
        "{:width$}  {:>8}  {:>7}  {:>7}  {:>12}  {:>12}  {:>12}\n",
        "robot", "targets", "differ", "missing", "largest [m]", "at [s]", "first at [s]"
    );
    let time = |time: Option<f64>| time.map_or("-".to_owned(), |time| format!("{time:.3}"));
    for robot in &report.robots {
        words += &format!(
            "{:width$}  {:>8}  {:>7}  {:>7}  {:>12.3e}  {:>12}  {:>12}\n",
            robot.name,
            robot.recorded,
            robot.differ,
            robot.only_recorded + robot.only_replayed,
            robot.largest,
            time(robot.largest_at),
            time(robot.first_at)
        );
    }
    let verdict = if report.holds() { "within" } else { "NOT within" };
    words + &format!("largest difference {:e} m, {verdict} {:e} m\n", report.largest(), report.tolerance)
}
