//! `index.html` of a gallery: a picture, a title and a sentence for each report, and the way to it.

use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::json;

use super::super::error::{ExportError, write_file};
use super::super::figures::png;
use super::super::{OutputFolder, summary};
use super::page::{FILE, STYLE, escaped, filled};

/// The file of a gallery, in place of a summary.
const LIST: &str = "gallery.json";

const PAGE: &str = include_str!("web/gallery.html");
/// Width of a picture \[pixel\].
const WIDTH: f32 = 540.0;
/// Longest sentence \[character\].
const LONGEST: usize = 180;

/// One report.
#[derive(Clone, Debug, Serialize)]
pub struct Exhibit {
    /// `scenes` or `swarms`.
    pub kind: &'static str,
    /// Short name of the scene or swarm.
    pub name: String,
    /// Its title, as the file gives it.
    pub title: String,
    /// The first sentence of its notes.
    pub sentence: String,
}

impl Exhibit {
    /// `notes` are those of the scene or swarm: their first sentence is shown.
    pub fn new(kind: &'static str, name: &str, title: &str, notes: &str) -> Self {
        // A point before a number or a small letter belongs to an abbreviation.
        let is_end = |&(at, _): &(usize, &str)| notes[at + 2..].starts_with(char::is_uppercase);
        let end = notes.match_indices(". ").find(is_end).map_or(notes.len(), |(at, _)| at + 1);
        let mut sentence = notes[..end].trim().to_owned();
        if sentence.chars().count() > LONGEST {
            sentence = sentence.chars().take(LONGEST).collect::<String>();
            sentence.truncate(sentence.rfind(' ').unwrap_or(sentence.len()));
            sentence += " \u{2026}";
        }
        Self { kind, name: name.into(), title: title.into(), sentence }
    }

    /// The folder of its outputs within the gallery.
    pub fn folder(&self) -> String {
        format!("{}/{}", self.kind, self.name)
    }
}

/// Writes `index.html` and `gallery.json`, the list of what it shows; the exhibits' outputs stand in the folder already.
///
/// # Errors
/// An exhibit without a figure, a file that cannot be written.
pub fn write_gallery(folder: &OutputFolder, exhibits: &[Exhibit]) -> Result<Vec<PathBuf>, ExportError> {
    let mut sections = String::new();
    for (kind, heading) in [("scenes", "Bodies"), ("swarms", "Swarms")] {
        let cards: Result<String, ExportError> =
            exhibits.iter().filter(|one| one.kind == kind).map(|one| card(folder, one)).collect();
        let cards = cards?;
        if !cards.is_empty() {
            sections += &format!("<h2>{heading}</h2>\n<ul class=\"gallery\">\n{cards}</ul>\n");
        }
    }
    let program = format!("{} {}", summary::PROGRAM, summary::VERSION);
    let page = filled(PAGE, &[("program", program), ("style", STYLE.into()), ("sections", sections)]);
    let index = folder.path("index.html");
    write_file(&index, page)?;
    Ok(vec![index, summary::write_signed(folder, LIST, &json!({ "exhibits": exhibits }))?])
}

fn card(folder: &OutputFolder, exhibit: &Exhibit) -> Result<String, ExportError> {
    let path = picture(&folder.path(exhibit.folder()))?;
    let svg = std::fs::read_to_string(&path).map_err(ExportError::io("read", &path))?;
    let png = png::render(&svg, |sheet| WIDTH / sheet);
    let png = png.map_err(|reason| ExportError::Figure { path, reason })?;
    let (title, name, sentence) =
        (escaped(&exhibit.title), escaped(&exhibit.name), escaped(&exhibit.sentence));
    Ok(format!(
        "<li><a class=\"card\" href=\"{}/{FILE}\"><img alt=\"\" src=\"data:image/png;base64,{}\"><div><code>{name}</code><h3>{title}</h3><p>{sentence}</p></div></a></li>\n",
        escaped(&exhibit.folder()),
        STANDARD.encode(png)
    ))
}

/// The most informative figure: of a flight its map, of a torn body the end, of others the last one on the way.
fn picture(outputs: &Path) -> Result<PathBuf, ExportError> {
    let flight = outputs.join("flight.svg");
    if flight.is_file() {
        return Ok(flight);
    }
    let entries = std::fs::read_dir(outputs).map_err(ExportError::io("look into", outputs))?;
    let is_configuration = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("configuration_") && name.ends_with(".svg")
    };
    let mut drawn: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_configuration).collect();
    drawn.sort();
    let is_torn = outputs.join("breaks.csv").is_file();
    let number = if is_torn { drawn.len().wrapping_sub(1) } else { drawn.len().saturating_sub(2) };
    drawn.get(number).cloned().ok_or_else(|| ExportError::Figure {
        path: outputs.to_owned(),
        reason: "the run left no configuration".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exhibit_shows_the_first_sentence_and_cuts_a_long_one_between_words() {
        let of = |notes: &str| Exhibit::new("scenes", "a", "A", notes).sentence;
        assert_eq!(of("It is 1.5 wide (Eq. 1). And more. "), "It is 1.5 wide (Eq. 1).");
        let long = of(&"word ".repeat(100));
        assert!(long.ends_with("word \u{2026}") && long.chars().count() <= LONGEST + 2, "{long}");
    }
}
