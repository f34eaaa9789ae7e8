//! Ranks that are threads of one process.

use std::sync::mpsc::{Receiver, Sender, channel};

use super::{Exchange, Team};

/// A team of so many ranks, each for a thread of its own. They are the same to the bit as processes over MPI: one
/// computer can play many, and no MPI is needed.
///
/// A thread that waits for one that has ended panics.
pub fn in_process(count: usize) -> Vec<Team> {
    let mut ranks: Vec<Threads> = (0..count).map(|rank| Threads::new(rank, count)).collect();
    for from in 0..count {
        for to in 0..count {
            let (sender, receiver) = channel();
            ranks[from].to.push(sender);
            ranks[to].from.push(receiver);
        }
    }
    ranks.into_iter().map(Team::new).collect()
}

struct Threads {
    rank: usize,
    /// To and from each rank, itself included.
    to: Vec<Sender<Vec<u64>>>,
    from: Vec<Receiver<Vec<u64>>>,
}

impl Threads {
    fn new(rank: usize, count: usize) -> Self {
        Self { rank, to: Vec::with_capacity(count), from: Vec::with_capacity(count) }
    }

    fn send(&self, rank: usize, words: Vec<u64>) {
        assert!(self.to[rank].send(words).is_ok(), "rank {rank} has ended while rank {} goes on", self.rank);
    }

    fn receive(&self, rank: usize, count: usize) -> Vec<u64> {
        let Ok(words) = self.from[rank].recv() else {
            panic!("rank {rank} has ended while rank {} waits for it", self.rank)
        };
        assert_eq!(words.len(), count, "words from rank {rank} to rank {}", self.rank);
        words
    }
}

impl Exchange for Threads {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.to.len()
    }

    fn swap(
        &mut self,
        messages: &[(usize, Vec<u64>)],
        from: &[(usize, usize)],
        meanwhile: &mut dyn FnMut(),
    ) -> Vec<Vec<u64>> {
        messages.iter().for_each(|(rank, words)| self.send(*rank, words.clone()));
        meanwhile();
        from.iter().map(|&(rank, count)| self.receive(rank, count)).collect()
    }

    fn gather(&mut self, own: &[u64], counts: &[usize]) -> Vec<u64> {
        (0..counts.len()).for_each(|rank| self.send(rank, own.to_vec()));
        counts.iter().enumerate().flat_map(|(rank, &count)| self.receive(rank, count)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_ranks<T: Send>(count: usize, work: impl Fn(Team) -> T + Sync) -> Vec<T> {
        std::thread::scope(|scope| {
            let ranks: Vec<_> =
                in_process(count).into_iter().map(|team| scope.spawn(|| work(team))).collect();
            ranks.into_iter().map(|rank| rank.join().expect("no rank panics")).collect()
        })
    }

    #[test]
    fn every_rank_gets_what_all_have_in_the_order_of_the_ranks() {
        for count in 1..5 {
            let all = on_ranks(count, |team| {
                let own: Vec<u64> = (0..team.rank() as u64).collect();
                team.gather(&own, &(0..count).collect::<Vec<_>>())
            });
            let expected: Vec<u64> = (0..count as u64).flat_map(|rank| 0..rank).collect();
            assert!(all.iter().all(|one| *one == expected), "{all:?}");
        }
    }

    #[test]
    fn messages_go_to_the_rank_that_they_are_for() {
        let received = on_ranks(3, |team| {
            let others: Vec<usize> = (0..3).filter(|&rank| rank != team.rank()).collect();
            let messages: Vec<_> =
                others.iter().map(|&to| (to, vec![(10 * team.rank() + to) as u64; to])).collect();
            let from: Vec<_> = others.iter().map(|&from| (from, team.rank())).collect();
            team.swap(&messages, &from)
        });
        assert_eq!(received, [vec![vec![], vec![]], vec![vec![1], vec![21]], vec![vec![2, 2], vec![12, 12]]]);
    }

    #[test]
    fn ranks_agree_on_the_first_ones_words_the_largest_numbers_and_whether_any_says_so() {
        let agreed = on_ranks(3, |team| {
            let rank = team.rank();
            let largest = team.largest([rank as f64, -(rank as f64)]);
            (team.of_first([rank as u64 + 7]), largest, team.any(rank == 2), team.any(false))
        });
        assert!(agreed.iter().all(|one| *one == ([7], [2.0, 0.0], true, false)), "{agreed:?}");
    }
}
