//! `--film FILE`: a film of what a command runs or flies.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use flockform::export::film::{Film, FilmColour, FilmError, FilmFile, FilmFormat, Finished};

use super::interrupt;
use super::output::OutputArguments;
use super::progress::Drawn;

#[derive(Debug, Args)]
pub struct FilmArguments {
    /// Make a film of it as FILE.gif, FILE.mp4 or FILE.webm; the last two take the program ffmpeg
    #[arg(long, value_name = "FILE", value_parser = film_path)]
    film: Option<PathBuf>,
    /// Quantity that colours the film's particles or robots [default: displacement of a body, role in a swarm]
    #[arg(long, value_name = "QUANTITY", value_parser = film_colour(), requires = "film")]
    film_colour: Option<FilmColour>,
}

fn film_colour() -> impl TypedValueParser<Value = FilmColour> {
    let named = |name: String| FilmColour::ALL.into_iter().find(|colour| colour.name() == name);
    PossibleValuesParser::new(FilmColour::ALL.map(FilmColour::name))
        .try_map(move |name| named(name).ok_or("no quantity has this name"))
}

fn film_path(text: &str) -> Result<PathBuf, FilmError> {
    let path = PathBuf::from(text);
    FilmFormat::of(&path).map(|_| path)
}

/// A film that will be made.
pub struct AskedFilm {
    file: FilmFile,
    pub colour: FilmColour,
}

impl FilmArguments {
    /// The film, if one is asked for; its file stands beside its place until it is made, and an interrupt removes it.
    pub fn open(
        &self,
        output: &OutputArguments,
        default: FilmColour,
        require: impl FnOnce(FilmColour) -> Result<(), FilmError>,
    ) -> Result<Option<AskedFilm>, FilmError> {
        let Some(path) = &self.film else { return Ok(None) };
        let colour = self.film_colour.unwrap_or(default);
        require(colour)?;
        let file = FilmFile::create(path, output.out(), output.force)?;
        interrupt::removes([file.part().to_owned()]);
        Ok(Some(AskedFilm { file, colour }))
    }
}

impl AskedFilm {
    /// Makes the film once the results stand in `kept`; `None` if an interrupt ended it.
    pub fn make(self, film: &Film<'_>, kept: &Path, quiet: bool) -> Result<Option<Finished>, FilmError> {
        interrupt::removes([self.file.part().to_owned()]);
        interrupt::says(format!("interrupted: there is no film, the results are in {}", kept.display()));
        let drawn = Drawn::new(quiet, "frame");
        let show = |done: usize, of: usize| {
            drawn.show(done, of);
            if interrupt::is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let made = film.write(self.file, &show);
        drawn.finish();
        made
    }
}

/// A film in words.
pub fn words(film: &Finished) -> String {
    let Finished { path, frames, size: [width, height], encoder } = film;
    format!("film of {frames} frames, {width} x {height} pixels ({encoder}), in {}\n", path.display())
}
