//! A varied key: its range or list, as it is written and as values.

use std::fmt;
use std::str::FromStr;

use super::{DesignError, MOST_RUNS};

/// A value of a key, as an override has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The value as it is written behind `KEY=`.
    pub text: String,
    /// The same as a number, where it is one.
    pub number: Option<f64>,
}

impl Level {
    fn written(text: &str) -> Self {
        Self { text: text.to_owned(), number: finite(text) }
    }

    /// The shortest text that reads back as the number; a whole one is written as an integer, which keys of both kinds
    /// take.
    fn of(number: f64) -> Self {
        const EXACT: f64 = 9_007_199_254_740_992.0;
        let is_whole = number.fract() == 0.0 && number.abs() < EXACT;
        let text = if is_whole { format!("{}", number as i64) } else { format!("{number:?}") };
        Self { text, number: Some(number) }
    }
}

/// A key and the values that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    /// Path of the key in the scene.
    pub key: String,
    /// Whether it is laid out, and drawn, by its logarithm.
    pub is_log: bool,
    /// Whether a range has whole numbers alone.
    is_whole: bool,
    values: Values,
}

#[derive(Clone, Debug, PartialEq)]
enum Values {
    List(Vec<Level>),
    /// From one end to the other; the number of values where it is given.
    Range {
        ends: [f64; 2],
        count: Option<usize>,
    },
}

impl FromStr for Factor {
    type Err = DesignError;

    /// Reads `KEY=a:b:n`, `KEY=a:b:n:log`, `KEY=a:b`, `KEY=a:b:log` or `KEY=[v1, v2, ...]`.
    fn from_str(text: &str) -> Result<Self, DesignError> {
        let refuse = |reason: &str| DesignError::Vary { text: text.to_owned(), reason: reason.to_owned() };
        let (key, values) = text.split_once('=').ok_or_else(|| refuse("there is no `=`"))?;
        let (key, values) = (key.trim().to_owned(), values.trim());
        if key.is_empty() {
            return Err(refuse("there is no key before the `=`"));
        }
        if let Some(list) = values.strip_prefix('[') {
            let list = list.strip_suffix(']').ok_or_else(|| refuse("the list is not closed by `]`"))?;
            let levels: Vec<Level> = elements(list).into_iter().map(Level::written).collect();
            if levels.is_empty() || levels.iter().any(|level| level.text.is_empty()) {
                return Err(refuse("a value of the list is missing"));
            }
            return Ok(Self { key, is_log: false, is_whole: false, values: Values::List(levels) });
        }
        let (ends, count, is_log) = range(values).map_err(|reason| refuse(&reason))?;
        Ok(Self { key, is_log, is_whole: false, values: Values::Range { ends, count } })
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Ends, number of values and scale of `a:b:n:log`, in which the last two may be missing.
fn range(text: &str) -> Result<([f64; 2], Option<usize>, bool), String> {
    let mut parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let is_log = parts.len() > 2 && parts.last() == Some(&"log");
    if is_log {
        parts.pop();
    }
    let number = |part: &str| finite(part).ok_or_else(|| format!("`{part}` is no number"));
    let (ends, count) = match parts[..] {
        [from, to] => ([number(from)?, number(to)?], None),
        [from, to, count] => {
            let given: Option<usize> = count.parse().ok().filter(|&count| count > 0);
            let count = given.ok_or_else(|| format!("`{count}` is no number of values"))?;
            ([number(from)?, number(to)?], Some(count))
        }
        _ => return Err("it is neither a range nor a list".to_owned()),
    };
    if is_log && ends.iter().any(|&end| end <= 0.0) {
        return Err("a logarithmic range has ends above 0".to_owned());
    }
    if count.is_some_and(|count| count > MOST_RUNS) {
        return Err(format!("it has more than {MOST_RUNS} values"));
    }
    Ok((ends, count, is_log))
}

/// The elements of a list, split at commas outside of brackets and quotes; the last may have a comma behind it, as in TOML.
fn elements(list: &str) -> Vec<&str> {
    let (mut depth, mut quote, mut start) = (0_i32, None, 0);
    let mut found = Vec::new();
    let mut characters = list.char_indices();
    while let Some((at, c)) = characters.next() {
        match (quote, c) {
            (Some('"'), '\\') => _ = characters.next(),
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => {
                found.push(list[start..at].trim());
                start = at + 1;
            }
            (None, _) => {}
        }
    }
    let last = list[start..].trim();
    if found.is_empty() || !last.is_empty() {
        found.push(last);
    }
    found
}

impl Factor {
    /// With whole numbers alone where the range goes from one to another and `is_whole` says of the key, and of where the range
    /// begins, that it takes no others.
    #[must_use]
    pub fn in_whole_numbers(mut self, is_whole: impl Fn(&str, f64) -> bool) -> Self {
        if let Values::Range { ends, .. } = self.values {
            self.is_whole = ends.iter().all(|end| end.fract() == 0.0) && is_whole(&self.key, ends[0]);
        }
        self
    }

    /// The value at `part` of the way through the range, or of the list \[1\].
    pub(super) fn at(&self, part: f64) -> Level {
        match &self.values {
            Values::List(levels) => {
                let n = (part * levels.len() as f64) as usize;
                levels[n.min(levels.len() - 1)].clone()
            }
            Values::Range { ends, .. } if self.is_whole => Level::of(whole_between(*ends, part, self.is_log)),
            Values::Range { ends, .. } => Level::of(between(*ends, part, self.is_log)),
        }
    }

    /// All values of a grid, of which there are as many as [`Factor::count`] says.
    ///
    /// # Errors
    /// A range in which two of them are the same: their runs would be too.
    pub(super) fn levels(&self, count: usize) -> Result<Vec<Level>, DesignError> {
        let ends = match &self.values {
            Values::List(levels) => return Ok(levels.clone()),
            Values::Range { ends, .. } => *ends,
        };
        let last = count.saturating_sub(1).max(1) as f64;
        let at = |n: usize| grid_point(ends, n as f64, last, self.is_log);
        let of = |n: usize| Level::of(if self.is_whole { at(n).round() } else { as_meant(at(n), ends) });
        let levels: Vec<Level> = (0..count).map(of).collect();
        match levels.windows(2).find(|pair| pair[0] == pair[1]) {
            None => Ok(levels),
            Some(pair) => {
                let same = &pair[0].text;
                self.refuse(format!("two of its {count} values are {same}: take fewer, or a wider range"))
            }
        }
    }

    /// Number of values in a grid.
    pub(super) fn count(&self) -> Result<usize, DesignError> {
        match &self.values {
            Values::List(levels) => Ok(levels.len()),
            Values::Range { count: Some(count), .. } => Ok(*count),
            Values::Range { .. } => self.refuse("the number of values is missing, or --samples".to_owned()),
        }
    }

    pub(super) fn require_open(&self) -> Result<(), DesignError> {
        match &self.values {
            Values::Range { count: Some(count), .. } => {
                self.refuse(format!("--samples gives the number of values: leave the {count} out"))
            }
            _ => Ok(()),
        }
    }

    fn refuse<T>(&self, reason: String) -> Result<T, DesignError> {
        Err(DesignError::Vary { text: self.to_string(), reason })
    }
}

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.values {
            Values::List(levels) => {
                let texts: Vec<&str> = levels.iter().map(|level| level.text.as_str()).collect();
                write!(f, "{}=[{}]", self.key, texts.join(", "))
            }
            Values::Range { ends: [from, to], count } => {
                let count = count.map_or(String::new(), |count| format!(":{count}"));
                let scale = if self.is_log { ":log" } else { "" };
                write!(f, "{}={from}:{to}{count}{scale}", self.key)
            }
        }
    }
}

fn between([from, to]: [f64; 2], part: f64, is_log: bool) -> f64 {
    match is_log {
        true => (from.ln() + part * (to.ln() - from.ln())).exp(),
        false => from + part * (to - from),
    }
}

/// The whole number at `part` of the way: all have as much of it, or, by the logarithm, as much as the step to the next has.
fn whole_between([from, to]: [f64; 2], part: f64, is_log: bool) -> f64 {
    let ends = if from <= to { [from, to + 1.0] } else { [from + 1.0, to] };
    between(ends, part, is_log).floor().clamp(from.min(to), from.max(to))
}

/// The `n`th of `last + 1` values; the ends are exact.
fn grid_point(ends @ [from, to]: [f64; 2], n: f64, last: f64, is_log: bool) -> f64 {
    match n {
        _ if n == 0.0 => from,
        _ if n == last => to,
        _ if is_log => between(ends, n / last, true),
        _ => (from * (last - n) + to * n) / last,
    }
}

/// A round number between these ends where rounding has left one by so little that its last digits alone say so: 0.3 between 0.1 and
/// 0.5, zero between -0.7 and 0.3, 1000 between 100 and 10000 by the logarithm.
fn as_meant(number: f64, [from, to]: [f64; 2]) -> f64 {
    if number == from || number == to {
        return number;
    }
    if number.abs() < 1e-14 * from.abs().max(to.abs()) && from.signum() != to.signum() {
        return 0.0;
    }
    let text = format!("{number:.13e}");
    if text.contains("000e") { text.parse().unwrap_or(number) } else { number }
}
