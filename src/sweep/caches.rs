//! The caches of this computer, by which a body is cut into bands.

use std::fmt;
use std::sync::LazyLock;

use super::schedule::MOST_STEPS;

/// Smallest second cache \[bytes\] by which bands are cut. Where it is smaller, what was measured there holds: the third
/// cache does its work.
const LARGE: usize = 1 << 20;

/// Bytes of a particle, before and after a step, of one coordinate.
const BOTH: usize = 16;

/// How a body is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Caches {
    /// Most particles of a body that counts as within the caches. Its columns are swept one after the other, and gaps
    /// between them swept over; and it is swept step by step, which streams best.
    pub whole_body: usize,
    /// Most particles of a band of which as many as take several steps together stay in the second cache; none where it
    /// is too small for any.
    pub band: Option<usize>,
}

impl Caches {
    /// Those of this computer.
    pub fn here() -> Self {
        static HERE: LazyLock<Caches> = LazyLock::new(|| Caches::of(second_cache()));
        *HERE
    }

    /// With a second cache of so many bytes a core, or unknown. Measured on a Xeon with 2 MiB: a front of half of it is best,
    /// one of three quarters still 1.4 times as fast as what does not fit.
    fn of(second: Option<usize>) -> Self {
        match second.filter(|&bytes| bytes >= LARGE) {
            Some(bytes) => {
                Self { whole_body: bytes / BOTH, band: Some(bytes / 4 * 3 / (BOTH * (MOST_STEPS + 2))) }
            }
            None => Self { whole_body: 1 << 18, band: None },
        }
    }
}

impl fmt::Display for Caches {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { whole_body, band } = self;
        write!(f, "bodies of up to {whole_body} particles are swept whole, larger ones in bands of ")?;
        match band {
            Some(most) => write!(f, "up to {most} particles or three columns, for the second cache"),
            None => write!(f, "three columns"),
        }
    }
}

/// Bytes of one core's second cache, where the system says.
pub(crate) fn second_cache() -> Option<usize> {
    let caches = std::fs::read_dir("/sys/devices/system/cpu/cpu0/cache").ok()?;
    let of = |cache: std::fs::DirEntry| {
        let says = |what: &str| std::fs::read_to_string(cache.path().join(what)).ok();
        (says("level")?.trim() == "2").then(|| says("size"))?
    };
    bytes(caches.flatten().find_map(of)?.trim())
}

/// A size as Linux writes it: `2048K`.
fn bytes(size: &str) -> Option<usize> {
    let (number, unit) = match size.strip_suffix(['K', 'M']) {
        Some(number) if size.ends_with('K') => (number, 1 << 10),
        Some(number) => (number, 1 << 20),
        None => (size, 1),
    };
    number.parse::<usize>().ok()?.checked_mul(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_linux_writes_them() {
        assert_eq!(
            ["2048K", "1M", "512", "K", "x", ""].map(bytes),
            [Some(2 << 20), Some(1 << 20), Some(512), None, None, None]
        );
    }

    #[test]
    fn a_front_of_bands_fits_where_the_second_cache_is_large() {
        let large = Caches::of(Some(2 << 20));
        assert_eq!(large, Caches { whole_body: 131_072, band: Some(5461) });
        assert_eq!(Caches::of(Some(512 << 10)), Caches::of(None));
    }
}
