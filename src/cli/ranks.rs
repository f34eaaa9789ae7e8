//! Ranks: whether this program is one of several that a launcher has started, and how they begin a run together.

use std::fs::File;
use std::io::Read;
use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use flockform::continuum::digest::fnv1a;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::ranks::Team;
use flockform::ranks::launcher::{Place, place_here};

use super::Refusal;

/// The reason why ranks do not begin.
#[derive(Debug, thiserror::Error)]
pub enum RanksError {
    #[error(
        "{variable} says that this is one of {count} ranks, and this program is built without MPI: each would make the whole run\n  \
         help: build it with `--features mpi`, or start it without the launcher; if each is to be a run of its own, `env -u {variable} flockform ...`"
    )]
    #[cfg_attr(feature = "mpi", allow(dead_code, reason = "said by builds without it"))]
    NoMpi { variable: &'static str, count: usize },
    #[error(
        "{variable} says that this is one of {count} ranks, and `{command}` runs on one: each would write the same results\n  \
         help: start it without the launcher; if each is to be a run of its own, `env -u {variable} flockform ...`"
    )]
    Alone { variable: &'static str, count: usize, command: &'static str },
    #[error(
        "rank {rank} has another program than rank 0\n  help: start the same file on every machine: a folder that all of them see, or copies of one build"
    )]
    OtherProgram { rank: usize },
    #[error(
        "rank {rank} is to make another run than rank 0\n  help: give every rank the same scene, files and options, and the same checkpoint to resume from"
    )]
    OtherRun { rank: usize },
    #[error("{refusal}\n  (on rank {rank})")]
    OnRank { rank: usize, refusal: Box<Refusal> },
    #[error(
        "--ranks: ranks share the run of a scene; a swarm is parted by `flockform node --member`\n  help: leave it out"
    )]
    Swarm,
    /// Another rank says why.
    #[error("another rank refuses")]
    SaidElsewhere,
    #[cfg(feature = "mpi")]
    #[error("{0}")]
    Mpi(#[from] flockform::ranks::mpi::MpiError),
}

/// The place among several ranks, where there are several.
fn place() -> Option<Place> {
    place_here().filter(|place| place.count > 1)
}

/// One rank speaks for all of those that refuse the same.
fn said_once(place: Place, error: RanksError) -> RanksError {
    if place.rank == 0 { error } else { RanksError::SaidElsewhere }
}

/// Refuses to be one of several ranks.
pub fn require_alone(command: &'static str) -> Result<(), RanksError> {
    let Some(place) = place() else { return Ok(()) };
    let Place { variable, count, .. } = place;
    Err(said_once(place, RanksError::Alone { variable, count, command }))
}

/// The other ranks, if this is one of several.
#[cfg(feature = "mpi")]
pub fn team() -> Result<Option<Team>, RanksError> {
    let Some(place) = place() else { return Ok(None) };
    flockform::ranks::mpi::join(place).map(Some).map_err(|error| said_once(place, error.into()))
}

/// Refuses to be one of several ranks.
#[cfg(not(feature = "mpi"))]
pub fn team() -> Result<Option<Team>, RanksError> {
    let Some(place) = place() else { return Ok(None) };
    let Place { variable, count, .. } = place;
    Err(said_once(place, RanksError::NoMpi { variable, count }))
}

/// The beginning of a run on ranks: none steps before all are ready, and if one refuses, all end.
pub struct Start<'a> {
    team: Option<&'a Team>,
    is_over: bool,
}

/// What ranks say to each other before they begin: whether they are ready, their program and their run.
type Words = [u64; 3];

impl<'a> Start<'a> {
    pub fn new(team: Option<&'a Team>) -> Self {
        Self { team, is_over: team.is_none() }
    }

    /// Waits until all ranks have come this far, with the same run: `common` is the fingerprint of it.
    pub fn agree(&mut self, common: u64) -> Result<(), RanksError> {
        let Some(team) = self.team else { return Ok(()) };
        let all = team.each([1, program_hash(), common]);
        let wrong = first_wrong(&all);
        self.is_over = wrong.is_some();
        match wrong {
            None => Ok(()),
            // Ranks that refuse say so themselves, and the first one says what only a comparison shows.
            Some((rank, error)) if all[rank][0] == 1 && team.is_first() => Err(error),
            Some(_) => Err(RanksError::SaidElsewhere),
        }
    }

    /// The same, as the last thing before the run.
    pub fn begin(mut self, common: u64) -> Result<(), RanksError> {
        let agreed = self.agree(common);
        self.is_over = true;
        agreed
    }

    /// Ends the others, and returns what is to be said here.
    pub fn refused(mut self, refusal: Refusal) -> Refusal {
        let Some(team) = self.team else { return refusal };
        self.is_over = true;
        let first = team.each::<3>([0; 3]).iter().position(|words| words[0] == 0);
        let error = if first != Some(team.rank()) {
            RanksError::SaidElsewhere
        } else if team.is_first() {
            return refusal;
        } else {
            RanksError::OnRank { rank: team.rank(), refusal: Box::new(refusal) }
        };
        error.into()
    }
}

impl Drop for Start<'_> {
    fn drop(&mut self) {
        if let Some(team) = self.team.filter(|_| !self.is_over && !std::thread::panicking()) {
            let _ = team.each::<3>([0; 3]);
        }
    }
}

/// The first rank that is not ready for the same run as the first one.
fn first_wrong(all: &[Words]) -> Option<(usize, RanksError)> {
    let [_, program, common] = *all.first()?;
    let wrong = |(rank, words): (usize, &Words)| match *words {
        [0, ..] => Some((rank, RanksError::SaidElsewhere)),
        [_, other, _] if other != program => Some((rank, RanksError::OtherProgram { rank })),
        [_, _, other] if other != common => Some((rank, RanksError::OtherRun { rank })),
        _ => None,
    };
    // A refusal comes before a comparison with words that are none.
    let refused = all.iter().position(|words| words[0] == 0);
    refused.map_or_else(
        || all.iter().enumerate().find_map(wrong),
        |rank| Some((rank, RanksError::SaidElsewhere)),
    )
}

/// A fingerprint of this program's file; of its version where the file cannot be read.
fn program_hash() -> u64 {
    static HASH: OnceLock<u64> = OnceLock::new();
    let file = || hash_of(File::open(std::env::current_exe()?)?);
    *HASH.get_or_init(|| file().unwrap_or_else(|_| fnv1a(env!("CARGO_PKG_VERSION").as_bytes())))
}

/// Hashes what is too large to be held by every rank: piece by piece, each after the hash of those before it.
fn hash_of(mut file: impl Read) -> std::io::Result<u64> {
    let mut hash = 0u64;
    let mut piece = Vec::new();
    loop {
        piece.clear();
        piece.extend(hash.to_le_bytes());
        if file.by_ref().take(PIECE).read_to_end(&mut piece)? == 0 {
            return Ok(hash);
        }
        hash = fnv1a(&piece);
    }
}

/// Bytes of a file that are held at once.
const PIECE: u64 = 1 << 16;

/// The observer on all ranks but the first: an interrupt that reaches any of them ends the run on all, at the same step.
pub struct Interrupted(pub &'static AtomicBool);

impl Observer for Interrupted {
    fn next(&mut self, _: usize) -> usize {
        usize::MAX
    }

    fn see(&mut self, _: &Engine, _: f64) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_rank_that_differs_is_named() {
        let wrong = |all: &[Words]| first_wrong(all).map(|(rank, error)| (rank, error.to_string()));
        assert_eq!(wrong(&[[1, 2, 3], [1, 2, 3]]), None);
        let (rank, words) = wrong(&[[1, 2, 3], [1, 2, 3], [1, 2, 4]]).expect("another run");
        assert!(rank == 2 && words.contains("rank 2 is to make another run"), "{words}");
        let (rank, words) = wrong(&[[1, 2, 3], [1, 9, 4], [1, 2, 4]]).expect("another program");
        assert!(rank == 1 && words.contains("rank 1 has another program"), "{words}");
        assert_eq!(wrong(&[[1, 2, 3], [1, 9, 3], [0, 0, 0]]).map(|(rank, _)| rank), Some(2));
        assert_eq!(wrong(&[[0, 0, 0], [1, 9, 3]]).map(|(rank, _)| rank), Some(0));
    }

    #[test]
    fn every_piece_of_a_file_counts() {
        let hash = |bytes: &[u8]| hash_of(bytes).expect("readable");
        let mut bytes = vec![7; 3 * 65536 + 5];
        let whole = hash(&bytes);
        assert_eq!(whole, hash(&bytes));
        assert_ne!(whole, hash(&bytes[..3 * 65536]));
        for place in [0, 65536, 3 * 65536 + 4] {
            bytes[place] = 8;
            assert_ne!(whole, hash(&bytes), "{place}");
            bytes[place] = 7;
        }
    }
}
