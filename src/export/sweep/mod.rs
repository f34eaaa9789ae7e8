//! A parameter sweep's outputs: `sweep.csv`, a row for each run; `sweep.json`, what was asked for; `runs.jsonl`, the
//! runs in the order in which they ended; the figure `sweep`.
//!
//! While a sweep goes on it stands in the open, as `NAME.unfinished`, and each run is in `runs.jsonl` before the next
//! begins ([`Journal`]): a sweep that is killed loses the runs under way and no other. The table is written from the
//! runs by their number, so that it does not depend on threads, shards and restarts.

mod journal;
mod outputs;

use std::collections::BTreeMap;
use std::path::PathBuf;

pub(super) use journal::REQUEST;
pub use journal::{
    Journal, JournalHeader, Row, StoredSweep, SweepError, SweepRequest, checksums, gather, read,
};
pub use outputs::{Output, Probed, Quantity, Values};

use super::OutputFolder;
use super::csv::write_below;
use super::error::ExportError;
use super::figures::sweep::{Column, Swept, draw};
use super::figures::{self, Formats};
use crate::continuum::run::StopReason;
use crate::study::design::{Design, Level};

/// The runs of a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// Title of the scene.
    pub title: &'a str,
    /// Values of the varied keys.
    pub design: &'a Design,
    /// Whether the runs are a grid's.
    pub is_grid: bool,
    /// Names of the outputs.
    pub outputs: &'a [String],
    /// The runs that ended, by their number.
    pub rows: &'a BTreeMap<usize, Row>,
}

impl Table<'_> {
    /// Names of the columns: the run, the varied keys, the outputs, how it ended, and what its summary cautions against.
    pub fn head(&self) -> Vec<&str> {
        let keys = self.design.factors.iter().map(|factor| factor.key.as_str());
        let outputs = self.outputs.iter().map(String::as_str);
        ["run"].into_iter().chain(keys).chain(outputs).chain(["stop_reason", "reason", "cautions"]).collect()
    }

    /// The cells of each run, in the order of their numbers.
    pub fn cells(&self) -> impl Iterator<Item = Vec<String>> {
        self.rows.values().map(|row| {
            let values = self.design.runs[row.run].iter().map(|level| level.text.clone());
            let ended = [row.stop_reason.clone(), row.reason.clone(), row.cautions.join("; ")];
            [row.run.to_string()].into_iter().chain(values).chain(row.outputs.clone()).chain(ended).collect()
        })
    }

    /// The table as JSON: an object for each run, numbers as numbers and outputs without a value as none.
    pub fn json(&self) -> serde_json::Value {
        let head = self.head();
        let first = 1 + self.design.factors.len();
        let outputs = first..first + self.outputs.len();
        let value = |(k, text): (usize, &String)| match text.is_empty() && outputs.contains(&k) {
            true => serde_json::Value::Null,
            false => cell(text),
        };
        let object = |cells: Vec<String>| -> serde_json::Value {
            head.iter().map(|&name| name.to_owned()).zip(cells.iter().enumerate().map(value)).collect()
        };
        self.cells().map(object).collect()
    }

    /// The figure, of this output or of those that vary.
    fn figure(&self, plotted: Option<&str>) -> Option<String> {
        let key = |k: usize| {
            let levels: Vec<&Level> = self.rows.keys().map(|&run| &self.design.runs[run][k]).collect();
            Column::of_levels(&self.design.factors[k], &levels)
        };
        let all: Vec<Column> =
            (0..self.outputs.len()).map(|n| self.column(n)).filter(Column::has_numbers).collect();
        let is_asked = |column: &&Column| match plotted {
            Some(name) => column.name == name,
            None => column.varies(),
        };
        let asked: Vec<Column> = all.iter().filter(is_asked).cloned().collect();
        draw(&Swept {
            title: self.title,
            is_grid: self.is_grid,
            keys: (0..self.design.factors.len()).map(key).collect(),
            // Outputs that are the same everywhere are shown where there are no others.
            outputs: if asked.is_empty() && plotted.is_none() { all } else { asked },
            diverged: self.diverged(),
        })
    }

    /// How many runs diverged.
    pub fn diverged(&self) -> usize {
        self.rows.values().filter(|row| has_diverged(row)).count()
    }

    /// The numbers of an output; of a run that diverged there is none, whatever it was last.
    fn column(&self, n: usize) -> Column {
        let value = |row: &Row| row.outputs.get(n).filter(|_| !has_diverged(row))?.parse::<f64>().ok();
        let values = self.rows.values().map(value).collect();
        Column { name: self.outputs[n].clone(), is_log: false, values, categories: Vec::new() }
    }

    /// Whether any run that did not diverge has a number for this output.
    pub fn has_numbers(&self, output: &str) -> bool {
        let at = self.outputs.iter().position(|name| name == output);
        at.is_some_and(|n| self.column(n).has_numbers())
    }
}

fn has_diverged(row: &Row) -> bool {
    row.stop_reason == StopReason::DIVERGED
}

/// A cell as JSON: a number where it is one, an integer to its last digit.
fn cell(text: &str) -> serde_json::Value {
    let integer = || text.parse::<i64>().map(Into::into).or_else(|_| text.parse::<u64>().map(Into::into));
    let number = || text.parse::<f64>().ok().filter(|number| number.is_finite()).map(Into::into);
    integer().ok().or_else(number).unwrap_or_else(|| text.into())
}

/// Writes the table and the figure.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_sweep(
    folder: &OutputFolder,
    table: &Table<'_>,
    formats: Formats,
    plotted: Option<&str>,
) -> Result<Vec<PathBuf>, ExportError> {
    let mut written = vec![write_below(&table.head(), folder, "sweep.csv", table.cells())?];
    if let Some(figure) = table.figure(plotted).filter(|_| formats != Formats::None) {
        written.extend(figures::write_as(&figure, folder, "sweep", formats)?);
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_diverged_is_in_the_table_and_counted_in_the_figure_but_has_no_colour() {
        let vary = ["a=0:1:2", "b=0:1:2"].map(|text| text.parse().expect("a factor"));
        let design = Design::grid(vary.to_vec()).expect("a grid");
        let outputs = ["strain".to_owned()];
        let row = |(run, (value, stop_reason)): (usize, (&str, &str))| {
            let [outputs, cautions] = [vec![value.to_owned()], Vec::new()];
            let (stop_reason, reason, files) = (stop_reason.into(), String::new(), BTreeMap::new());
            (run, Row { run, stop_reason, outputs, reason, cautions, files })
        };
        let ends = [("1.0", "steps"), ("2.0", "steps"), ("3.0", "equilibrium"), ("2600.0", "diverged")];
        let rows = ends.into_iter().enumerate().map(row).collect();
        let table = Table { title: "T", design: &design, is_grid: true, outputs: &outputs, rows: &rows };
        let figure = table.figure(None).expect("drawn");
        assert!(figure.contains("1 of 4 diverged: grey") && !figure.contains("2600"), "{figure}");
        assert_eq!(table.cells().last().expect("a row")[3], "2600.0");
        let [one, _] = vary;
        let design = Design::grid(vec![one]).expect("a grid");
        let rows = ends.into_iter().skip(2).enumerate().map(row).collect();
        let table = Table { design: &design, rows: &rows, ..table };
        let figure = table.figure(Some("strain")).expect("drawn");
        assert!(figure.contains("1 of 2 diverged: left out") && !figure.contains("2600"), "{figure}");
    }

    #[test]
    fn cells_keep_their_numbers_in_json() {
        let json = |text: &str| cell(text).to_string();
        for number in ["40", "-3", "9007199254740993", "18446744073709551615", "0.1", "-1e-300"] {
            assert_eq!(json(number), number);
        }
        for word in ["", "inf", "NaN", "lagged", "[0.1, 0]"] {
            assert_eq!(json(word), format!("\"{word}\""));
        }
    }
}
