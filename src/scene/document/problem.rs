//! Problems of a scene: the fault, its place, and the remedy.

use std::fmt;

use super::overrides::split_assignment;

/// Problems kept in one report; a reader mends a handful at a time.
const KEPT_PROBLEMS: usize = 20;

/// Where a value, or the want of one, stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A line of the scene file, counted from one.
    Line {
        /// The file as the user named it.
        file: String,
        /// The line, counted from one.
        line: usize,
    },
    /// The scene file as a whole, such as a required top-level key that it lacks.
    File {
        /// The file as the user named it.
        file: String,
    },
    /// A `--set` override.
    Override {
        /// The text after `--set`.
        text: String,
    },
    /// A value that a study gives to a key.
    Varied {
        /// The key and the value, as an override has them.
        text: String,
    },
    /// A key of a dict, as Python gives them.
    Key {
        /// The key or its path.
        key: String,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line { file, line } => write!(f, "{file}:{line}"),
            Place::File { file } => f.write_str(file),
            Place::Override { text } => write!(f, "--set {text}"),
            Place::Varied { text } => write!(f, "--vary {text}"),
            Place::Key { key } => write!(f, "the key `{key}`"),
        }
    }
}

/// One thing wrong with a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Where it stands.
    pub place: Place,
    /// The key path, such as `roles\[1\].motion.per_step`; empty for the document as a whole.
    pub key: String,
    /// The value that was found there, abbreviated; `None` where there is none to show.
    pub found: Option<String>,
    /// The fault, including the allowed range or choices.
    pub message: String,
    /// The remedy.
    pub help: Option<String>,
}

impl Problem {
    /// A problem with a file as a whole.
    pub(crate) fn of_file(file: &str, message: String, help: Option<String>) -> Self {
        let place = Place::File { file: file.to_owned() };
        Self { place, key: String::new(), found: None, message, help }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place)?;
        match (self.key.as_str(), &self.found) {
            ("", _) => {}
            (key, None) => write!(f, "{key}: ")?,
            (key, Some(found)) => write!(f, "{key} = {found}: ")?,
        }
        f.write_str(&self.message)?;
        match &self.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

/// Everything found wrong with a scene in one pass, in the order of the file.
#[derive(Debug, Clone, Default, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    problems: Vec<Problem>,
    omitted: usize,
}

impl SceneError {
    /// Adds a problem; beyond the first twenty they are only counted.
    pub fn push(&mut self, problem: Problem) {
        match self.is_full() {
            false => self.problems.push(problem),
            true => self.omitted += 1,
        }
    }

    /// Whether further problems are only counted.
    pub(super) fn is_full(&self) -> bool {
        self.problems.len() >= KEPT_PROBLEMS
    }

    /// The same of a scene that a study has given these overrides.
    pub fn varied_by(mut self, overrides: &[String]) -> Self {
        for Problem { place, .. } in &mut self.problems {
            if let Place::Override { text } = place
                && overrides.contains(text)
            {
                *place = Place::Varied { text: std::mem::take(text) };
            }
        }
        self
    }

    /// The same where the overrides are keys of a dict.
    pub fn of_keys(mut self) -> Self {
        for Problem { place, .. } in &mut self.problems {
            if let Place::Override { text } = place {
                let key = split_assignment(text).map_or(text.as_str(), |(key, _)| key).to_owned();
                *place = Place::Key { key };
            }
        }
        self
    }

    /// The problems that were kept.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// How many problems were found, kept or not.
    pub fn count(&self) -> usize {
        self.problems.len() + self.omitted
    }

    /// `value` if nothing was found wrong, otherwise the problems, sorted by line with overrides last.
    pub(crate) fn into_result<T>(mut self, value: T) -> Result<T, SceneError> {
        if self.problems.is_empty() {
            return Ok(value);
        }
        self.problems.sort_by_key(|problem| match problem.place {
            Place::File { .. } => 0,
            Place::Line { line, .. } => line,
            Place::Override { .. } | Place::Varied { .. } | Place::Key { .. } => usize::MAX,
        });
        Err(self)
    }
}

impl From<Problem> for SceneError {
    fn from(problem: Problem) -> Self {
        SceneError { problems: vec![problem], omitted: 0 }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
        match self.omitted {
            0 => Ok(()),
            1 => write!(f, "\nand 1 more problem"),
            more => write!(f, "\nand {more} more problems"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem_at(line: usize) -> Problem {
        let place = Place::Line { file: "beam.toml".into(), line };
        Problem { place, key: "n".into(), found: None, message: "is missing".into(), help: None }
    }

    #[test]
    fn a_problem_prints_place_key_value_message_and_help() {
        let mut problem = problem_at(12);
        problem.found = Some("-1.0".into());
        problem.help = Some("try 1".into());
        assert_eq!(problem.to_string(), "beam.toml:12: n = -1.0: is missing\n  help: try 1");
    }

    #[test]
    fn problems_beyond_the_cap_are_counted_not_printed() {
        let mut error = SceneError::default();
        (0..KEPT_PROBLEMS + 3).for_each(|line| error.push(problem_at(line)));
        assert_eq!(error.count(), KEPT_PROBLEMS + 3);
        assert!(
            error.to_string().ends_with(&format!("beam.toml:{}: n: is missing\nand 3 more problems", 19))
        );
    }

    #[test]
    fn problems_come_in_the_order_of_the_file_with_overrides_last() {
        let mut error = SceneError::default();
        error.push(Problem { place: Place::Override { text: "n=1".into() }, ..problem_at(0) });
        error.push(problem_at(7));
        error.push(problem_at(3));
        let sorted = error.into_result(()).unwrap_err();
        let places: Vec<String> = sorted.problems().iter().map(|p| p.place.to_string()).collect();
        assert_eq!(places, ["beam.toml:3", "beam.toml:7", "--set n=1"]);
    }

    #[test]
    fn a_key_of_a_dict_is_named_as_one() {
        let mut error = SceneError::default();
        for text in ["lattice={\"spacing\"=-2.0}", "\"a=b\".c=1", "none", "n=1"] {
            error.push(Problem { place: Place::Override { text: text.into() }, ..problem_at(0) });
        }
        error.push(problem_at(3));
        let said = error.of_keys();
        let places: Vec<String> = said.problems().iter().map(|p| p.place.to_string()).collect();
        assert_eq!(
            places,
            ["the key `lattice`", "the key `\"a=b\".c`", "the key `none`", "the key `n`", "beam.toml:3"]
        );
    }

    #[test]
    fn no_problems_give_the_value() {
        assert_eq!(SceneError::default().into_result(5), Ok(5));
    }
}
