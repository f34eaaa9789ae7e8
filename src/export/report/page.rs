//! The page: one file that needs no network and no server.
//!
//! Title, summary, tables and texts are in the page as they are and need no script; animations and
//! charts are data that the scripts draw. The scripts are modules of their own, in `web/`; a page holds them one after
//! another, without their imports, so no two may give a name of the top level to different things.

use std::io::{self, Write};
use std::path::PathBuf;

use serde::Serialize;
use serde_json::json;

use super::super::OutputFolder;
use super::super::error::ExportError;
use super::super::figures::chart::Chart;
pub(super) use super::super::figures::escaped;
use super::super::manifest::create_buffered;
use super::view::View;
use crate::scene::text::exponent_of;

/// Name of the file.
pub const FILE: &str = "report.html";

const PAGE: &str = include_str!("web/page.html");
pub(super) const STYLE: &str = include_str!("web/page.css");
macro_rules! scripts {
    ($($name:ident)*) => {[$(include_str!(concat!("web/", stringify!($name), ".js"))),*]};
}

/// In the order in which they build on each other.
const SCRIPTS: [&str; 19] = scripts! {
    unpack colour marks body shown painter painter2d view chart player scale camera compare numbers svg_pen
    picture controls address page
};

/// Those of a page whose data come from a session, after the others.
const LIVE_SCRIPTS: [&str; 4] = scripts! { live_frames live_tools live_design live };
const LIVE_TOOLS: &str = include_str!("web/live.html");

/// Everything that a report shows, from the top.
#[derive(Debug, Default)]
pub(crate) struct Page {
    pub title: String,
    /// The command and the name of what it was given, unless the folder has the command itself.
    pub command: String,
    /// The outcome, and whether it is a success.
    pub verdict: Option<(bool, String)>,
    /// Moments that a click takes the animation's clock to: the text, and the clock's value.
    pub moments: Vec<(String, f64)>,
    /// Bodies on the move; several stand beside each other and share one clock.
    pub stages: Vec<View>,
    /// The frames that are shown, and those that are left out.
    pub note: String,
    pub plots: Vec<Chart>,
    /// Names and values.
    pub facts: Vec<(&'static str, String)>,
    pub tables: Vec<Table>,
    /// Long texts under their titles, folded.
    pub texts: Vec<(String, String)>,
    /// The session that feeds the page, for a page that is no report.
    pub live: Option<serde_json::Value>,
}

#[derive(Debug, Default)]
pub(crate) struct Table {
    pub caption: String,
    pub head: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new(
        caption: &str,
        head: &[&'static str],
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        Self { caption: caption.to_owned(), head: head.to_vec(), rows: rows.into_iter().collect() }
    }
}

impl Page {
    /// Writes `report.html`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn write(&self, folder: &OutputFolder) -> Result<PathBuf, ExportError> {
        let path = folder.path(FILE);
        let write = || self.write_to(&mut create_buffered(&path)?, folder.command());
        write().map_err(ExportError::io("write", &path))?;
        Ok(path)
    }

    /// The whole file.
    #[cfg(any(test, feature = "live"))]
    pub(crate) fn html(&self) -> String {
        let mut bytes = Vec::new();
        self.write_to(&mut bytes, None).expect("memory takes everything");
        String::from_utf8(bytes).expect("all of it is text")
    }

    /// The arrays go from where they are, since those of a large body are most of the page.
    fn write_to(&self, out: &mut impl Write, command: Option<&str>) -> io::Result<()> {
        let (before, after) = PAGE.split_once("{{arrays}}").expect("the template has a place for them");
        let parts = self.parts(command.unwrap_or(&self.command));
        out.write_all(filled(before, &parts).as_bytes())?;
        for (number, stage) in self.stages.iter().enumerate() {
            for (name, text) in &stage.arrays {
                writeln!(out, "<script type=\"text/plain\" id=\"s{number}-{name}\">{text}</script>")?;
            }
        }
        out.write_all(filled(after, &parts).as_bytes())?;
        out.flush()
    }

    /// Texts for the template, by name.
    fn parts(&self, command: &str) -> [(&'static str, String); 14] {
        let stages: Vec<_> = self.stages.iter().map(|stage| &stage.animation).collect();
        let data = in_script(
            &json!({ "stages": stages, "plots": self.plots.iter().map(Chart::on_page).collect::<Vec<_>>(), "live": self.live }),
        );
        let live = if self.live.is_some() { &LIVE_SCRIPTS[..] } else { &[] };
        let script: String = SCRIPTS.iter().chain(live).map(|module| joined(module)).collect();
        [
            ("title", escaped(&self.title)),
            ("command", escaped(command)),
            ("verdict", self.verdict_html()),
            ("live", if self.live.is_some() { LIVE_TOOLS.into() } else { String::new() }),
            ("note", escaped(&self.note)),
            ("facts", self.facts_html()),
            ("tables", self.tables.iter().map(table_html).collect()),
            ("texts", self.texts_html()),
            ("program", format!("flockform {}", env!("CARGO_PKG_VERSION"))),
            ("stages", if self.stages.is_empty() { "hidden".into() } else { String::new() }),
            ("plots", if self.plots.is_empty() { "hidden".into() } else { String::new() }),
            ("style", STYLE.into()),
            ("data", data),
            ("script", script),
        ]
    }

    fn verdict_html(&self) -> String {
        let Some((holds, words)) = &self.verdict else { return String::new() };
        let class = if *holds { "good" } else { "bad" };
        let moment = |(words, time): &(String, f64)| {
            format!("<li><button type=\"button\" data-seek=\"{time}\">{}</button></li>", escaped(words))
        };
        let moments: String = self.moments.iter().map(moment).collect();
        let moments =
            if moments.is_empty() { moments } else { format!("<ul class=\"moments\">{moments}</ul>") };
        format!("<p class=\"verdict {class}\">{}</p>{moments}", escaped(words))
    }

    fn facts_html(&self) -> String {
        let fact = |(name, value): &(&str, String)| {
            let class = if value.contains('\n') { " class=\"wide\"" } else { "" };
            format!("<div{class}><dt>{}</dt><dd>{}</dd></div>", escaped(name), escaped(value))
        };
        self.facts.iter().map(fact).collect()
    }

    fn texts_html(&self) -> String {
        let text = |(title, text): &(String, String)| {
            let (title, text) = (escaped(title), escaped(text));
            format!(
                "<details class=\"card\"><summary>{title}</summary><pre tabindex=\"0\">{text}</pre></details>"
            )
        };
        self.texts.iter().map(text).collect()
    }
}

/// A value as JSON that a `script` element can hold.
fn in_script(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default().replace('<', "\\u003c")
}

/// A module for a page that holds all of them: nothing to import, nothing to export.
///
/// By hand, as a page that is opened from a disk can import nothing: browsers load no modules from `file:`, and those that
/// stand in a page have no name to be imported by. The tests hold the scripts to what this relies on.
fn joined(module: &str) -> String {
    let is_import = |line: &&str| line.starts_with("import ");
    let own = |line: &str| line.strip_prefix("export ").unwrap_or(line).to_owned() + "\n";
    module.lines().filter(|line| !is_import(line)).map(own).collect()
}

/// The template with `{{name}}` replaced; what is filled in is not looked at again.
pub(super) fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let mut page = String::with_capacity(parts.iter().map(|(_, text)| text.len()).sum::<usize>() + 8192);
    let mut pieces = template.split("{{");
    page += pieces.next().unwrap_or_default();
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        page += parts.iter().find(|(known, _)| *known == name).map_or("", |(_, text)| text);
        page += rest;
    }
    page
}

fn table_html(table: &Table) -> String {
    let heads: String =
        table.head.iter().map(|name| format!("<th scope=\"col\">{}</th>", escaped(name))).collect();
    // On a narrow screen every cell stands in a line of its own, behind the name of its column.
    let cell = |(name, text): (&&str, &String)| {
        let class = if text.parse::<f64>().is_ok() { " class=\"number\"" } else { "" };
        format!("<td data-name=\"{}\"{class}>{}</td>", escaped(name), escaped(text))
    };
    let row = |row: &Vec<String>| -> String {
        let cells: String = table.head.iter().zip(row).map(cell).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let rows: String = table.rows.iter().map(row).collect();
    format!(
        "<div class=\"card table\" tabindex=\"0\"><table><caption>{}</caption><thead><tr>{}</tr></thead><tbody>{rows}</tbody></table></div>",
        escaped(&table.caption),
        heads,
    )
}

/// Up to six digits, before the point up to seven, without zeros at the end; small and large ones with a power of ten.
pub fn number(value: f64) -> String {
    match exponent_of(value, 6) {
        None => value.to_string(),
        _ if value == 0.0 => "0".into(),
        Some(exponent @ -4..=6) => {
            let text = format!("{value:.*}", usize::try_from(5 - exponent).unwrap_or(0));
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
        }
        Some(_) => format!("{value:.4e}"),
    }
}

/// The notes of a scene or swarm and its file, under its name within and at the beginning of a title.
pub(super) fn file_texts(
    [within, first]: [&str; 2],
    notes: &str,
    raw: &impl Serialize,
) -> Vec<(String, String)> {
    let notes = (!notes.is_empty()).then(|| (format!("Notes of the {within}"), notes.trim().to_owned()));
    let file = (format!("{first}, with its defaults and overrides"), scene_text(raw));
    notes.into_iter().chain([file]).collect()
}

/// A scene or swarm as it was read, defaults and overrides included, without what it leaves out.
pub(super) fn scene_text(raw: &impl Serialize) -> String {
    let mut value = serde_json::to_value(raw).unwrap_or_default();
    drop_empty(&mut value);
    serde_json::to_string_pretty(&value).unwrap_or_default()
}

fn drop_empty(value: &mut serde_json::Value) {
    let is_empty = |value: &serde_json::Value| match value {
        serde_json::Value::Null => true,
        serde_json::Value::Array(list) => list.is_empty(),
        serde_json::Value::String(text) => text.is_empty(),
        _ => false,
    };
    if let serde_json::Value::Object(table) = value {
        table.retain(|_, value| !is_empty(value));
        table.values_mut().for_each(drop_empty);
    } else if let serde_json::Value::Array(list) = value {
        list.iter_mut().for_each(drop_empty);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::export::figures::chart::Axis;

    #[test]
    fn a_page_stays_valid_with_any_title() {
        let title = "</script><b>{{script}}\"&".to_owned();
        let page = Page { title: title.clone(), command: "run".into(), ..Page::default() };
        let plot = Chart::new(title, "", [Axis::new("x", ""), Axis::new("x", "")], Vec::new());
        let html = Page { plots: vec![plot], ..page }.html();
        assert!(!html.contains("<b>") && html.contains("&lt;/script&gt;&lt;b&gt;{{script}}"));
        assert_eq!(html.matches("</html>").count(), 1);
        assert!(html.contains("\\u003c/script>"), "data is escaped too");
    }

    #[test]
    fn a_page_asks_the_network_for_nothing() {
        let html = Page::default().html();
        for word in ["src=", "href=\"http", "@import", "url(http", "fetch(", "import "] {
            assert!(!html.contains(word), "{word}");
        }
        assert!(!html.contains("{{"), "every place of the template is filled");
    }

    #[test]
    fn the_scripts_may_stand_in_one_page() {
        let (mut defined, mut imported) = (BTreeSet::new(), BTreeSet::new());
        for line in SCRIPTS.into_iter().chain(LIVE_SCRIPTS).flat_map(str::lines) {
            if line.starts_with("import") {
                let names = line.strip_prefix("import { ").and_then(|line| line.split_once(" } from \"./"));
                let (names, _) =
                    names.filter(|(_, file)| file.ends_with(".js\";")).expect("one line, names alone");
                imported.extend(names.split(", "));
            }
            let own = line.strip_prefix("export ").unwrap_or(line);
            let own = own.strip_prefix("async ").unwrap_or(own);
            if let Some((kind @ ("const" | "let" | "var" | "function" | "class"), rest)) = own.split_once(' ')
            {
                let name = rest.split([' ', '(', '=', ';', '{']).next().unwrap_or_default();
                assert!(!name.is_empty() && defined.insert(name), "one name, one thing: {kind} {rest}");
            } else {
                assert_eq!(own, line, "only a definition is exported");
            }
        }
        assert!(imported.len() > 10 && imported.is_subset(&defined), "{imported:?}");
    }

    #[test]
    fn numbers_are_short() {
        let at_a_power = [999999.7, 9999999.7, 9.9999999e-5, -0.99999999, 0.0].map(number);
        assert_eq!(at_a_power, ["1000000", "1.0000e7", "0.0001", "-1", "0"]);
        let texts = [0.25, -1234.5678, 1e-7, 12345678.0, 3.0, f64::NAN].map(number);
        assert_eq!(texts, ["0.25", "-1234.57", "1.0000e-7", "1.2346e7", "3", "NaN"]);
    }
}
