//! `flockform list`, `show` and `new`: the bundled files, and a file of one's own that begins as one of them.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use flockform::scene::Bundled;
use serde_json::{Value, json};

use super::names::{FileName, Kind, bundled_file};
use super::{Refusal, print, say};

#[derive(Debug, Args)]
pub struct ListArguments {
    /// Kind of file to list
    #[arg(value_parser = PossibleValuesParser::new(["scenes", "swarms"]).map(listed))]
    what: Kind,
    /// Print JSON: name and title of each
    #[arg(long)]
    json: bool,
}

fn listed(name: String) -> Kind {
    if name == "scenes" { Kind::Scene } else { Kind::Swarm }
}

/// Lists bundled files, one a line.
pub fn list(arguments: &ListArguments) -> Result<(), Refusal> {
    let kind = arguments.what;
    let all = kind.bundled();
    let title = |one: &Bundled| kind.described(one).map(|[title, _]| title);
    let titles: Vec<String> = all.iter().map(title).collect::<Result<_, _>>()?;
    if arguments.json {
        let entry = |(one, title): (&Bundled, &String)| json!({ "name": one.name, "title": title });
        let entries: Vec<Value> = all.iter().zip(&titles).map(entry).collect();
        return print(&format!("{:#}\n", Value::from(entries)));
    }
    let width = all.iter().map(|one| one.name.len()).max().unwrap_or(0);
    let line = |(one, title): (&Bundled, &String)| format!("{:width$}  {title}\n", one.name);
    print(&all.iter().zip(&titles).map(line).collect::<String>())
}

#[derive(Debug, Args)]
pub struct ShowArguments {
    /// Name of a bundled scene or swarm
    #[arg(value_parser = FileName::ANY, hide_possible_values = true)]
    name: String,
}

/// Prints a bundled file as it is.
pub fn show(arguments: &ShowArguments) -> Result<(), Refusal> {
    let (_, file) = bundled_file(&arguments.name)?;
    print(file.text)
}

#[derive(Debug, Args)]
pub struct NewArguments {
    /// Kind of file to write
    kind: Kind,
    /// Name of the file, which gets the ending .toml; may have a folder before it
    name: PathBuf,
    /// Bundled file to begin with [default: tension, or square for a swarm]
    #[arg(long, value_name = "NAME", value_parser = FileName::ANY, hide_possible_values = true)]
    from: Option<String>,
}

/// Writes a file to begin with, which is valid as it is; one that is there already stays.
pub fn new(arguments: &NewArguments) -> Result<(), Refusal> {
    let NewArguments { kind, name, from } = arguments;
    let usual = if *kind == Kind::Scene { "tension" } else { "square" };
    let (found, file) = bundled_file(from.as_deref().unwrap_or(usual))?;
    if found != *kind {
        return Err(Refusal::OtherKind {
            name: file.name.to_owned(),
            kind: found.name(),
            command: if found == Kind::Scene { "new scene NAME --from" } else { "new swarm NAME --from" },
        });
    }
    let path = toml_path(*kind, name)?;
    write_new(&path, &(heading(*kind, &file, &path) + file.text))?;
    say(&format!("{} begins as `{}`: edit it, then `{}`\n", path.display(), file.name, command(*kind, &path)))
}

/// The path of a new file: with the ending that the program reads, and no name that a bundled file hides.
fn toml_path(kind: Kind, name: &Path) -> Result<PathBuf, Refusal> {
    let refuse = || Refusal::NewName { name: name.display().to_string(), kind: kind.name() };
    let stem = name.file_name().and_then(|file| file.to_str()).ok_or_else(refuse)?;
    let stem = stem.strip_suffix(".toml").unwrap_or(stem);
    let is_plain = |c: char| c.is_alphanumeric() || "-_".contains(c);
    if stem.is_empty() || stem.starts_with('-') || !stem.chars().all(is_plain) {
        return Err(refuse());
    }
    Ok(name.with_file_name(format!("{stem}.toml")))
}

fn command(kind: Kind, path: &Path) -> String {
    format!("flockform {} {}", kind.command(), path.display())
}

/// Comments at the top of a new file: how to run it, and where its keys are described.
fn heading(kind: Kind, file: &Bundled, path: &Path) -> String {
    let schema = if kind == Kind::Scene { "schema" } else { "schema --swarm" };
    format!(
        "# A {} for flockform, begun as the bundled `{}`.\n\
         #   {}\n\
         #   flockform plan {}    shows beforehand what it models\n\
         #   flockform {schema}    prints every key with its unit and range\n\
         # Any key can be tried without an edit: --set KEY.PATH=VALUE.\n\n",
        kind.name(),
        file.name,
        command(kind, path),
        path.display()
    )
}

/// Writes a file that is not there yet.
fn write_new(path: &Path, text: &str) -> Result<(), Refusal> {
    flockform::export::write_new(path, text).map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => Refusal::Exists(path.to_owned()),
        _ => Refusal::NewFile { path: path.to_owned(), source },
    })
}
