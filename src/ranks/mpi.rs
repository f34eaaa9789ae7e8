//! Ranks that are processes, over MPI: Open MPI or MPICH, whichever the program was built with.

use mpi::datatype::PartitionMut;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use mpi::{Count, Threading};

use super::launcher::Place;
use super::{Exchange, Team};

/// Exit code of ranks that are ended because one of them panicked.
const PANICKED: i32 = 101;

/// The reason why a rank cannot join the others.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MpiError {
    /// MPI has been started by this process already.
    #[error("MPI has been started in this process already")]
    Started,
    /// MPI does not allow threads beside the one that calls it.
    #[error("this MPI allows no threads in a rank (MPI_THREAD_SERIALIZED is not provided)")]
    NoThreads,
    /// The launcher belongs to another MPI.
    #[error(
        "{variable} says that this is one of {said} ranks, but the MPI that this program was built with knows {known}\n  \
         help: start it with the `mpirun` of {library}"
    )]
    OtherLauncher {
        /// The launcher's variable.
        variable: &'static str,
        /// How many ranks the launcher says there are.
        said: usize,
        /// How many MPI knows.
        known: usize,
        /// The name and version that MPI gives.
        library: String,
    },
}

/// Joins the ranks that a launcher has started. MPI ends when the last copy of the team is dropped, on all ranks together.
/// A rank that panics ends the others; one that is killed has them ended by the launcher.
///
/// # Errors
/// An MPI without threads, or another one than the launcher's.
pub fn join(place: Place) -> Result<Team, MpiError> {
    let (universe, provided) =
        mpi::initialize_with_threading(Threading::Serialized).ok_or(MpiError::Started)?;
    let ranks = Processes { _universe: universe };
    if provided < Threading::Serialized {
        return Err(MpiError::NoThreads);
    }
    let known = ranks.count();
    if known != place.count {
        let library = mpi::environment::library_version().unwrap_or_default();
        let library = library.lines().next().unwrap_or_default().trim_end_matches('\0').to_owned();
        return Err(MpiError::OtherLauncher { variable: place.variable, said: place.count, known, library });
    }
    Ok(Team::new(ranks))
}

struct Processes {
    _universe: mpi::environment::Universe,
}

impl Drop for Processes {
    fn drop(&mut self) {
        // The others wait for this rank, and would do so for ever.
        if std::thread::panicking() {
            SimpleCommunicator::world().abort(PANICKED);
        }
    }
}

/// MPI counts with 32 bits, which bodies of at most 2^28 particles do not exceed.
fn counted(words: usize) -> Count {
    Count::try_from(words).expect("bodies are bounded")
}

impl Exchange for Processes {
    fn rank(&self) -> usize {
        usize::try_from(SimpleCommunicator::world().rank()).unwrap_or_default()
    }

    fn count(&self) -> usize {
        usize::try_from(SimpleCommunicator::world().size()).unwrap_or(1)
    }

    fn swap(
        &mut self,
        messages: &[(usize, Vec<u64>)],
        from: &[(usize, usize)],
        meanwhile: &mut dyn FnMut(),
    ) -> Vec<Vec<u64>> {
        let world = SimpleCommunicator::world();
        let mut received: Vec<Vec<u64>> = from.iter().map(|&(_, words)| vec![0; words]).collect();
        mpi::request::scope(|scope| {
            let (mut receiving, mut sending) = (Vec::new(), Vec::new());
            // What is awaited is announced first: then nothing has to be copied on its way.
            for (&(rank, _), words) in from.iter().zip(&mut received) {
                let source = world.process_at_rank(counted(rank));
                receiving.push(source.immediate_receive_into(scope, &mut words[..]));
            }
            for (rank, words) in messages {
                sending.push(world.process_at_rank(counted(*rank)).immediate_send(scope, &words[..]));
            }
            meanwhile();
            receiving.into_iter().for_each(|one| {
                one.wait();
            });
            sending.into_iter().for_each(|one| {
                one.wait();
            });
        });
        received
    }

    fn gather(&mut self, own: &[u64], counts: &[usize]) -> Vec<u64> {
        let mut all = vec![0; counts.iter().sum()];
        let counts: Vec<Count> = counts.iter().map(|&count| counted(count)).collect();
        let begins = counts.iter().scan(0, |end, &count| {
            let begin = *end;
            *end += count;
            Some(begin)
        });
        let begins: Vec<Count> = begins.collect();
        let mut parts = PartitionMut::new(&mut all[..], counts, begins);
        SimpleCommunicator::world().all_gather_varcount_into(own, &mut parts);
        all
    }
}
