//! The text of a file that a scene, a swarm or a command line names.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Beyond any table of points that could be a body, and far below the memory of a computer.
const MOST_BYTES: u64 = 1 << 30;

/// The text of a file of at most one GiB, so that a device without end, or another program's data, is refused and
/// does not fill the memory.
///
/// # Errors
/// A file that cannot be read, is longer, or is not UTF-8.
pub(crate) fn read(path: &Path) -> Result<String> {
    read_at_most(path, MOST_BYTES)
}

fn read_at_most(path: &Path, most: u64) -> Result<String> {
    let mut text = String::new();
    let length = File::open(path)?.take(most + 1).read_to_string(&mut text)?;
    if length as u64 > most {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("longer than {} MiB", most >> 20)));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_as_long_as_allowed_is_read_and_a_longer_one_refused() {
        let folder = std::env::temp_dir().join(format!("flockform-text-{}", std::process::id()));
        std::fs::write(&folder, "a".repeat(1 << 20)).expect("written");
        assert_eq!(read_at_most(&folder, 1 << 20).expect("just as long").len(), 1 << 20);
        let error = read_at_most(&folder, (1 << 20) - 1).expect_err("longer");
        std::fs::remove_file(&folder).expect("removed");
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_without_end_is_refused() {
        let error = read_at_most(Path::new("/dev/zero"), 1 << 20).expect_err("no text of a scene");
        assert_eq!(error.to_string(), "longer than 1 MiB");
    }
}
