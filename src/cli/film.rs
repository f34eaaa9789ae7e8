//! `--film FILE`: a film of what a command runs or flies.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PathBufValueParser, PossibleValuesParser, TypedValueParser};
use flockform::export::OutputFolder;
use flockform::export::film::{Film, FilmColour, FilmError, FilmFile, FilmFormat, Finished};
use flockform::scene::text::counted;

use super::output::{OutputArguments, ReportArguments};
use super::progress::Progress;
use super::{Refusal, interrupt, print, say};

/// A film of a body; of a swarm with [`of_swarms`].
#[derive(Debug, Args)]
pub struct FilmArguments {
    /// Make a film of it as FILE.gif, FILE.mp4 or FILE.webm; the last two take the program ffmpeg
    #[arg(long, value_name = "FILE", value_parser = film_path())]
    film: Option<PathBuf>,
    /// Quantity that colours the film's particles [default: displacement]
    #[arg(long, value_name = "QUANTITY", value_parser = one_of(FilmColour::OF_BODIES), requires = "film")]
    film_colour: Option<FilmColour>,
}

/// Makes the argument `film_colour` that of a swarm.
pub fn of_swarms(colour: clap::Arg) -> clap::Arg {
    colour
        .help("Quantity that colours the film's robots [default: role]")
        .value_parser(one_of(FilmColour::OF_SWARMS))
}

/// Reads the name of one of these colours.
fn one_of<const N: usize>(colours: [FilmColour; N]) -> impl TypedValueParser<Value = FilmColour> {
    let named = move |name: String| colours.into_iter().find(|colour| colour.name() == name);
    PossibleValuesParser::new(colours.map(FilmColour::name))
        .try_map(move |name| named(name).ok_or("no quantity has this name"))
}

fn film_path() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| FilmFormat::of(&path).map(|_| path))
}

/// A film that will be made.
pub struct AskedFilm {
    file: FilmFile,
    pub colour: FilmColour,
}

impl FilmArguments {
    /// Whether a film is asked for.
    pub fn is_asked(&self) -> bool {
        self.film.is_some()
    }

    /// The film, if one is asked for, in the colour asked for or the `usual` one, beside these results.
    pub fn open(
        &self,
        results: &OutputFolder,
        force: bool,
        usual: FilmColour,
        require: impl FnOnce(FilmColour) -> Result<(), FilmError>,
    ) -> Result<Option<AskedFilm>, Refusal> {
        let Some(path) = &self.film else { return Ok(None) };
        let colour = self.film_colour.unwrap_or(usual);
        require(colour)?;
        results.require_outside(path)?;
        // It stands beside its place until it is made, and an interrupt removes it.
        let file = FilmFile::create(path, force)?;
        interrupt::removes([file.part().to_owned()]);
        Ok(Some(AskedFilm { file, colour }))
    }
}

impl AskedFilm {
    /// Makes the film once the results stand in `kept`; `None` if an interrupt ended it.
    fn make(self, film: &Film<'_>, kept: &Path, quiet: bool) -> Result<Option<Finished>, FilmError> {
        interrupt::removes([self.file.part().to_owned()]);
        interrupt::says(format!("interrupted: there is no film, the results are in {}", kept.display()));
        let progress = Progress::of_drawing(quiet, "frame");
        let show = |done: usize, of: usize| {
            progress.drawn(done, of);
            if interrupt::is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let made = film.write(self.file, &show);
        progress.finish();
        made
    }
}

/// The end of a run or flight whose results stand in their folder.
pub struct Finish<'a> {
    pub kept: &'a Path,
    pub output: &'a OutputArguments,
    pub report: &'a ReportArguments,
    pub is_json: bool,
    /// Whether it was broken off.
    pub is_interrupted: bool,
    /// Whether an interrupt left figures out.
    pub is_cut_short: bool,
}

impl Finish<'_> {
    /// Makes the film that was asked for, where there are frames of it, prints JSON or words, says what is missing, and
    /// shows the report of a whole result. Whether it is whole.
    pub fn done(
        self,
        film: Option<AskedFilm>,
        drawn: Option<Film<'_>>,
        json: impl FnOnce() -> serde_json::Value,
        words: impl FnOnce() -> String,
    ) -> Result<bool, Refusal> {
        let is_asked = film.is_some();
        let make = |(film, drawn): (AskedFilm, Film<'_>)| film.make(&drawn, self.kept, self.output.quiet);
        let made = film.zip(drawn).map_or(Ok(None), make)?;
        if self.is_json {
            print(&format!("{:#}\n", json()))?;
        } else if !self.output.quiet {
            say(&(words() + &made.as_ref().map_or_else(String::new, in_words)))?;
        }
        let missing = match (self.is_cut_short, is_asked && made.is_none()) {
            (false, false) => None,
            (false, true) => Some("there is no film"),
            (true, false) => Some("figures are missing"),
            (true, true) => Some("figures and the film are missing"),
        };
        missing.iter().for_each(|missing| note!("interrupted: {missing}, the rest is written"));
        let is_whole = missing.is_none() && !self.is_interrupted;
        if is_whole {
            self.report.show(self.kept);
        }
        Ok(is_whole)
    }
}

fn in_words(film: &Finished) -> String {
    let Finished { path, frames, size: [width, height], encoder } = film;
    let frames = counted(*frames, "frame");
    format!("film of {frames}, {width} x {height} pixels ({encoder}), in {}\n", path.display())
}
