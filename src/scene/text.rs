//! What people write: files that a scene, a swarm or a command line names, and words with slips in them.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Beyond any table of points that could be a body, and far below the memory of a computer.
const MOST_BYTES: u64 = 1 << 30;

/// No word is suggested for one longer than this.
const LONGEST_MISSPELLING: usize = 64;

/// So many of them, as `1 robot` and `2 robots`.
pub fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// From here on numbers are written with a power of ten: their digits would say nothing.
const LONG: f64 = 1e15;

/// So are those below this one, which begin with as many zeros.
const SHORT: f64 = 1e-15;

/// A number as it is, or with a power of ten if it would be hundreds of digits long.
pub fn number(value: f64) -> String {
    let is_plain = value == 0.0 || !value.is_finite() || (SHORT..LONG).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

/// The same to so many decimal places.
pub fn decimals(value: f64, places: usize) -> String {
    if value.abs() < LONG { format!("{value:.places$}") } else { format!("{value:.places$e}") }
}

/// The power of ten of a finite number after it is rounded to so many digits: of 99.999999 to five it is 2.
pub fn exponent_of(value: f64, digits: usize) -> Option<i32> {
    format!("{value:.*e}", digits - 1).split_once('e')?.1.parse().ok()
}

/// A part as so many percent, without the digits that only binary fractions give it.
pub fn percent(part: f64) -> String {
    format!("{} %", (100.0 * part) as f32)
}

/// "a", "a, b and c", "a, b, c and 4 more".
pub fn listed(names: &[impl AsRef<str>]) -> String {
    const MOST_NAMED: usize = 3;
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    let (named, others) = names.split_at(names.len().min(MOST_NAMED));
    match named {
        _ if !others.is_empty() => format!("{} and {} more", named.join(", "), others.len()),
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => named.concat(),
    }
}

/// The text of a file of at most one GiB, so that a device without end, or another program's data, is refused and
/// does not fill the memory.
///
/// # Errors
/// A file that cannot be read, is longer, or is not UTF-8.
pub(crate) fn read(path: &Path) -> Result<String> {
    read_at_most(path, MOST_BYTES)
}

/// The same of at most `most` bytes.
///
/// # Errors
/// As [`read`].
pub(super) fn read_at_most(path: &Path, most: u64) -> Result<String> {
    let mut bytes = Vec::new();
    let opened = File::open(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound if path.is_symlink() => {
            Error::new(ErrorKind::NotFound, "it is a link to a file that is not there")
        }
        _ => error,
    });
    let length = opened?.take(most + 1).read_to_end(&mut bytes)?;
    if length as u64 > most {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("longer than {} MiB", most >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|byte| **byte == b'\n').count();
        Error::new(ErrorKind::InvalidData, format!("line {line} is not UTF-8"))
    })
}

/// Whether a word is a path rather than a name: one that is there, if only as a link to nothing, or looks like one.
pub fn is_path(word: &str) -> bool {
    Path::new(word).symlink_metadata().is_ok() || word.contains(['/', '\\', '.'])
}

/// Keys, choices and bundled files that had another name once, with the one they have now.
const RENAMED: [(&str, &str); 10] = [
    ("growth", "divergence_ratio"),
    ("kept", "balanced"),
    ("liar", "faulty-robot"),
    ("liars", "max_faulty_neighbours"),
    ("max_liars", "max_faulty"),
    ("present", "dynamic"),
    ("pull", "axis"),
    ("ring", "chebyshev"),
    ("straight", "collinear"),
    ("truth", "reference"),
];

/// The candidate that was called `word` once.
pub fn renamed<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let (_, now) = RENAMED.into_iter().find(|(then, _)| *then == word)?;
    candidates.iter().copied().find(|candidate| *candidate == now)
}

/// The candidate that `word` most probably misspells or abbreviates, if any is near enough: a mere guess would mislead
/// more than none.
pub fn nearest<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    if word.len() > LONGEST_MISSPELLING {
        return None;
    }
    let folded = |text: &str| text.to_lowercase().replace('-', "_");
    let word = folded(word);
    let distance = |candidate: &&'a str| {
        let candidate = folded(candidate);
        let distance = strsim::osa_distance(&word, &candidate);
        let length = word.chars().count().max(candidate.chars().count());
        let shorter = word.chars().count().min(candidate.chars().count());
        let abbreviates = shorter >= 3 && (word.starts_with(&candidate) || candidate.starts_with(&word));
        // Beyond a third of the letters, a suggestion is a guess.
        (distance < length && (distance <= (length / 3).max(1) || abbreviates)).then_some(distance)
    };
    let scored = candidates.iter().filter_map(|candidate| Some((distance(candidate)?, *candidate)));
    scored.min_by_key(|(distance, _)| *distance).map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_hundreds_of_digits_have_a_power_of_ten() {
        assert_eq!([1.5, -3.0, 1e300, f64::INFINITY].map(number), ["1.5", "-3", "1e300", "inf"]);
        assert_eq!([1.5, -3.0, 1e300].map(|x| decimals(x, 3)), ["1.500", "-3.000", "1.000e300"]);
    }

    #[test]
    fn a_file_as_long_as_allowed_is_read_and_a_longer_one_refused() {
        let folder = std::env::temp_dir().join(format!("flockform-text-{}", std::process::id()));
        std::fs::write(&folder, "a".repeat(1 << 20)).expect("written");
        assert_eq!(read_at_most(&folder, 1 << 20).expect("just as long").len(), 1 << 20);
        let error = read_at_most(&folder, (1 << 20) - 1).expect_err("longer");
        std::fs::remove_file(&folder).expect("removed");
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
    }

    #[test]
    fn a_file_in_another_encoding_is_refused_by_its_line() {
        let file = std::env::temp_dir().join(format!("flockform-latin-{}", std::process::id()));
        std::fs::write(&file, b"a = 1\n\nb = \"\xe9\"\n").expect("written");
        let error = read(&file).expect_err("Latin-1");
        std::fs::remove_file(&file).expect("removed");
        assert_eq!(error.to_string(), "line 3 is not UTF-8");
    }

    #[cfg(unix)]
    #[test]
    fn a_device_without_end_is_refused() {
        let error = read_at_most(Path::new("/dev/zero"), 1 << 20).expect_err("no text of a scene");
        assert_eq!(error.to_string(), "longer than 1 MiB");
    }
}
