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

/// Ranks on this machine beside this one, as far as the launcher says.
pub fn others_here() -> usize {
    place().map_or(0, |place| place.here - 1)
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

/// Has one of the ranks say what all of them say before they know each other; one that stands alone says it itself.
pub fn said_by_one(refusal: Refusal) -> Refusal {
    match team() {
        Ok(team) => Start::new(team.as_ref()).refused(refusal),
        // The others have the same command line.
        Err(_) if place().is_some_and(|place| place.rank > 0) => RanksError::SaidElsewhere.into(),
        Err(_) => refusal,
    }
}

/// The beginning of a run on ranks: none steps before all are ready, and if one refuses, all end.
pub struct Start<'a> {
    team: Option<&'a Team>,
    is_over: bool,
}

/// The message of a rank to the others before they begin: whether it is ready, its program, its run.
type Word = [u64; 3];

const REFUSED: Word = [0; 3];

/// The verdict on all messages; the same on each rank.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Begin,
    /// The first one that refuses; it says why.
    Refused(usize),
    /// The first one that differs from the first rank.
    OtherProgram(usize),
    OtherRun(usize),
}

impl Verdict {
    fn of(all: &[Word]) -> Self {
        // A refusal comes before a comparison: the one that refuses has no run.
        if let Some(rank) = all.iter().position(|word| *word == REFUSED) {
            return Verdict::Refused(rank);
        }
        let [_, program, run] = all.first().copied().unwrap_or(REFUSED);
        let wrong = |(rank, word): (usize, &Word)| match *word {
            [_, other, _] if other != program => Some(Verdict::OtherProgram(rank)),
            [_, _, other] if other != run => Some(Verdict::OtherRun(rank)),
            _ => None,
        };
        all.iter().enumerate().find_map(wrong).unwrap_or(Verdict::Begin)
    }
}

impl<'a> Start<'a> {
    pub fn new(team: Option<&'a Team>) -> Self {
        Self { team, is_over: team.is_none() }
    }

    /// Says a word to the others and hears theirs; anything but a beginning ends all.
    fn exchange(&mut self, team: &Team, own: Word) -> Verdict {
        let verdict = Verdict::of(&team.each(own));
        self.is_over = verdict != Verdict::Begin;
        verdict
    }

    /// Waits until all ranks have come this far, with the same run: `run` is the fingerprint of it.
    pub fn agree(&mut self, run: u64) -> Result<(), RanksError> {
        let Some(team) = self.team else { return Ok(()) };
        let error = match self.exchange(team, [1, program_hash(), run]) {
            Verdict::Begin => return Ok(()),
            Verdict::Refused(_) => return Err(RanksError::SaidElsewhere),
            Verdict::OtherProgram(rank) => RanksError::OtherProgram { rank },
            Verdict::OtherRun(rank) => RanksError::OtherRun { rank },
        };
        // The first one says what only a comparison shows.
        Err(if team.is_first() { error } else { RanksError::SaidElsewhere })
    }

    /// The same, as the last thing before the run.
    pub fn begin(mut self, run: u64) -> Result<(), RanksError> {
        let agreed = self.agree(run);
        self.is_over = true;
        agreed
    }

    /// Ends the others, and returns what is to be said here.
    pub fn refused(mut self, refusal: Refusal) -> Refusal {
        let Some(team) = self.team.filter(|_| !self.is_over) else { return refusal };
        let rank = team.rank();
        match self.exchange(team, REFUSED) {
            Verdict::Refused(first) if first != rank => RanksError::SaidElsewhere.into(),
            _ if team.is_first() => refusal,
            _ => RanksError::OnRank { rank, refusal: Box::new(refusal) }.into(),
        }
    }
}

impl Drop for Start<'_> {
    fn drop(&mut self) {
        if let Some(team) = self.team.filter(|_| !self.is_over && !std::thread::panicking()) {
            self.exchange(team, REFUSED);
        }
    }
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
    fn the_first_rank_that_refuses_or_differs_is_named() {
        assert_eq!(Verdict::of(&[[1, 2, 3], [1, 2, 3]]), Verdict::Begin);
        assert_eq!(Verdict::of(&[[1, 2, 3], [1, 2, 3], [1, 2, 4]]), Verdict::OtherRun(2));
        assert_eq!(Verdict::of(&[[1, 2, 3], [1, 9, 4], [1, 2, 4]]), Verdict::OtherProgram(1));
        assert_eq!(Verdict::of(&[[1, 2, 3], [1, 9, 3], REFUSED]), Verdict::Refused(2));
        assert_eq!(Verdict::of(&[REFUSED, [1, 9, 3]]), Verdict::Refused(0));
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
