//! `flockform swarm`: flies a swarm file without middleware.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Instant;

use clap::Args;
use flockform::export::film::{self, FilmColour};
use flockform::export::flight::{write_flight, write_flight_tables};
use flockform::export::report::page::number;
use flockform::export::report::{self, FlightRecorder};
use flockform::record::flight::FlightMessages;
use flockform::record::{About, Shared};
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::scene::text::counted;
use flockform::swarm::control::Control;
use flockform::swarm::flight::{Flight, FlightReport, Record, Sample, fly_with_observer};
use flockform::swarm::plan::cautions;

use super::film::{FilmArguments, Finish, of_swarms};
use super::names::{FileName, Kind, Overrides, folder_in_full};
use super::output::{OutputArguments, ReportArguments};
use super::recording::{RecordArguments, close};
use super::{Refusal, exit_code, interrupt, on_terminal};

/// A swarm and the changes to it.
#[derive(Debug, Args)]
pub struct SwarmFileArguments {
    /// Name of a bundled swarm (see `flockform list swarms`) or path of a swarm file
    #[arg(value_parser = FileName::SWARM, hide_possible_values = true)]
    pub swarm: String,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Text of the file, where it has been read.
    #[arg(skip)]
    text: Option<String>,
}

impl SwarmFileArguments {
    pub fn new(swarm: &str, set: &[String]) -> Self {
        Self { swarm: swarm.to_owned(), overrides: Overrides { set: set.to_vec() }, text: None }
    }

    /// The text of the file; none of a bundled swarm.
    ///
    /// # Errors
    /// Neither file nor name, or a file that cannot be read.
    pub fn read(&self) -> Result<Option<String>, Refusal> {
        if bundled_swarm(&self.swarm).is_some() {
            return Ok(None);
        }
        Ok(Some(Swarm::text_of_file(&Kind::Swarm.path(&self.swarm)?)?))
    }

    /// The same of a file that had this text when it was read.
    pub fn as_read(&self, text: Option<String>) -> Self {
        Self { text, ..Self::new(&self.swarm, &self.overrides.set) }
    }

    pub fn load(&self) -> Result<Swarm, Refusal> {
        if let Some(bundled) = bundled_swarm(&self.swarm) {
            return Ok(bundled.load_swarm(&self.overrides.set)?);
        }
        // Its file may be gone by now.
        let loaded = match self.text.clone() {
            Some(text) => Swarm::from_text_of_file(Path::new(&self.swarm), text, &self.overrides.set),
            None => Swarm::from_file(&Kind::Swarm.path(&self.swarm)?, &self.overrides.set),
        };
        loaded.map_err(|error| Kind::Swarm.refuse_other(&self.swarm).unwrap_or(error.into()))
    }

    /// The description of the swarm for a recording.
    pub fn about(&self, source: &'static str, swarm: &Swarm) -> About {
        let bundled = bundled_swarm(&self.swarm);
        let of_file = || self.text.clone().or_else(|| self.read().ok().flatten());
        let text = bundled.map_or_else(of_file, |one| Some(one.text.to_owned()));
        About {
            source,
            name: swarm.name.clone(),
            swarm: text,
            set: self.overrides.set.clone(),
            folder: folder_in_full(&self.swarm),
            ..About::default()
        }
    }
}

#[derive(Debug, Args)]
#[command(mut_arg("film_colour", of_swarms))]
pub struct SwarmArguments {
    #[command(flatten)]
    swarm: SwarmFileArguments,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    report: ReportArguments,
    #[command(flatten)]
    film: FilmArguments,
    #[command(flatten)]
    record: RecordArguments,
    /// Print the report as JSON
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

/// Flies a swarm and writes the results.
pub fn swarm(arguments: &SwarmArguments) -> Result<ExitCode, Refusal> {
    let swarm = arguments.swarm.load()?;
    let flight = Flight::new(&swarm)?;
    if !arguments.output.quiet {
        cautions::of(&swarm, &flight).iter().for_each(|caution| note!("caution: {}", on_terminal(caution)));
    }
    let (folder, force) = (arguments.output.folder(&swarm.name)?, arguments.output.force);
    let film = arguments.film.open(&folder, force, FilmColour::Role, |_| Ok(()))?;
    let about = arguments.swarm.about("swarm", &swarm);
    let recording = arguments.record.open_beside(&folder, &about, force)?;
    let reports = !arguments.report.no_report;
    let mut recorder = (reports || film.is_some()).then(|| FlightRecorder::new(&flight));
    let interrupted = interrupt::keeps();
    let start = Instant::now();
    let mut watch = |flight: &Flight, _: &Sample| {
        let is_last = interrupted.load(Ordering::Relaxed);
        recorder.iter_mut().for_each(|recorder| recorder.watch(flight, is_last));
        if is_last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let (record, report) = fly_recorded(&swarm, flight.control(), recording.as_ref(), &mut watch)?;
    let seconds = start.elapsed().as_secs_f64();
    let saving = interrupt::saving();
    // Figures take longer than an interrupt may.
    let is_drawn = !interrupt::is_raised();
    let write = if is_drawn { write_flight } else { write_flight_tables };
    write(&folder, &swarm, &record, &report)?;
    if let Some(recorder) = recorder.as_mut().filter(|_| reports) {
        let stage = recorder.stage(&swarm, &report);
        report::flight::write(&folder, &swarm, &record, &report, stage)?;
    }
    let kept = interrupt::commit(folder)?;
    let recorded = close(recording)?;
    drop(saving);
    let is_interrupted = interrupted.load(Ordering::Relaxed);
    let drawn = film.as_ref().filter(|_| !is_interrupted).zip(recorder.as_ref());
    let drawn =
        drawn.map(|(film, recorder)| film::flight::film(&swarm, &record, &report, recorder, film.colour));
    let finish = Finish {
        kept: &kept,
        output: &arguments.output,
        report: &arguments.report,
        is_json: arguments.json,
        is_interrupted,
        is_cut_short: !is_drawn,
    };
    let closing = || words(&report, seconds, &kept) + &recorded;
    let is_whole = finish.done(film, drawn, || serde_json::json!(report), closing)?;
    Ok(exit_code(report.holds() && is_whole))
}

/// Flies a swarm that this control is of, and records the messages of its loop.
pub fn fly_recorded(
    swarm: &Swarm,
    control: &Control,
    recording: Option<&Shared>,
    watch: &mut dyn FnMut(&Flight, &Sample) -> ControlFlow<()>,
) -> Result<(Record, FlightReport), Refusal> {
    let messages = recording.map(|one| FlightMessages::new(swarm, control, one.sink())).transpose()?;
    let messages = RefCell::new(messages);
    let mut hear = |received| {
        if let Some(messages) = &mut *messages.borrow_mut() {
            messages.receive(received);
        }
    };
    Ok(fly_with_observer(swarm, &mut hear, &mut |flight, sample| {
        if let Some(messages) = &mut *messages.borrow_mut() {
            // When the period began that has just been flown.
            messages.tick(flight.control(), (flight.fleet().period() - 1) as f64 * swarm.raw.control.period);
        }
        watch(flight, sample)
    })?)
}

fn words(report: &FlightReport, seconds: f64, kept: &Path) -> String {
    let FlightReport { leaders, leaders_at_start, .. } = *report;
    let at_end = if leaders == leaders_at_start { String::new() } else { format!(" ({leaders} at the end)") };
    let faster = report.seconds / seconds.max(1e-9);
    let mut words = format!(
        "{}: {} ({}), {}{at_end}, {:.2} s flown in {seconds:.2} s ({:.*} times real time)\n",
        report.name,
        counted(report.robots, "robot"),
        report.model,
        counted(leaders_at_start, "leader"),
        report.seconds,
        usize::from(faster < 10.0),
        faster,
    );
    let mut line = |name: &str, value: String| words += &format!("  {name:<33}  {value}\n");
    report.facts(number).into_iter().for_each(|(name, value)| line(name, value));
    line("PE1", format!("largest {:.4e} m^2, at the end {:.4e} m^2", report.pe1[0], report.pe1[1]));
    let strain = report.strain.map(|[largest, last]| format!("largest {largest:.4e}, at the end {last:.4e}"));
    line("Strain", strain.unwrap_or_else(|| "not defined: no robot has neighbours in two directions".into()));
    for verdict in &report.bounds {
        let found = verdict.found.map_or("not measured".into(), |found| format!("{found:.4e}"));
        let worst = verdict.worst.as_ref().filter(|_| !verdict.holds);
        let worst = worst.map_or(String::new(), |moment| format!(", by {moment}"));
        let word = if verdict.holds { "holds" } else { "BROKEN" };
        line(verdict.bound, format!("{word}: declared {}, found {found}{worst}", verdict.declared));
    }
    words + &format!("results in {}\n", kept.display())
}
