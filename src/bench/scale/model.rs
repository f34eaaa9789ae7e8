//! The time of a step on so many ranks, from counts: what a rank computes, what it computes twice, what it is sent.

use serde::Serialize;

use crate::sweep::domain::steps_of;

/// Bytes of a position.
const PLACE: f64 = 16.0;

/// Cost of messages between ranks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Link {
    /// Time of a message with next to nothing in it \[s\].
    pub latency_seconds: f64,
    /// Rate of a long message \[B/s\].
    pub bytes_per_second: f64,
}

impl Link {
    /// A network of 100 Gbit/s as clusters have it. It is assumed; nothing here has measured it.
    pub const NETWORK: Self = Self { latency_seconds: 2e-6, bytes_per_second: 12e9 };
}

/// A body that is held all around, and the bands that it is parted into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Grid {
    /// Columns of particles.
    pub columns: usize,
    /// Particles in a column.
    pub rows: usize,
    /// Columns in a band.
    pub band: usize,
}

/// Work of the busiest rank in a step: its share of what happens once for several steps, on average.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Load {
    /// Steps taken together.
    pub together: usize,
    /// Followers of its own \[1/step\].
    pub updates: f64,
    /// Followers of others, which it computes as well \[1/step\].
    pub computed_twice: f64,
    /// Messages that it waits for \[1/step\].
    pub messages: f64,
    /// Bytes that it is sent \[1/step\].
    pub bytes: f64,
}

impl Grid {
    /// The load of the rank that has most.
    pub fn load(&self, ranks: usize) -> Load {
        let bands = self.columns.div_ceil(self.band);
        let column = self.rows.saturating_sub(2) as f64;
        let inner = self.columns.saturating_sub(2);
        let own = (bands.div_ceil(ranks) * self.band).min(inner);
        let together = steps_of(bands / ranks);
        let sides = ranks.min(3).saturating_sub(1) as f64;
        let halo = (together * self.band) as f64;
        // One band fewer in each step, until none is left.
        let twice = (together - 1) as f64 / 2.0 * self.band as f64;
        Load {
            together,
            updates: own as f64 * column,
            computed_twice: sides * twice * column,
            messages: sides / together as f64,
            bytes: sides * halo * self.rows as f64 * PLACE / together as f64,
        }
    }

    /// So many times as many columns.
    pub fn longer(&self, times: usize) -> Self {
        Self { columns: self.columns * times, ..*self }
    }
}

/// The time that loads take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Model {
    /// Of one follower, on a rank that has the computer to itself \[s\].
    pub update_seconds: f64,
    /// Between the ranks.
    pub link: Link,
}

impl Model {
    /// Time of a step \[s\].
    pub fn seconds(&self, load: &Load) -> f64 {
        let Link { latency_seconds, bytes_per_second } = self.link;
        let computed = self.update_seconds * (load.updates + load.computed_twice);
        computed + load.messages * latency_seconds + load.bytes / bytes_per_second
    }

    /// The same body on more ranks: how much of their time is work that one would do as well \[1\].
    pub fn strong_efficiency(&self, grid: &Grid, ranks: usize) -> f64 {
        self.seconds(&grid.load(1)) / (ranks as f64 * self.seconds(&grid.load(ranks)))
    }

    /// As much of a body for each rank as `grid` \[1\].
    pub fn weak_efficiency(&self, grid: &Grid, ranks: usize) -> f64 {
        self.seconds(&grid.load(1)) / self.seconds(&grid.longer(ranks).load(ranks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: Model =
        Model { update_seconds: 1e-9, link: Link { latency_seconds: 1e-6, bytes_per_second: 1e9 } };

    #[test]
    fn a_rank_alone_is_sent_nothing_and_computes_nothing_twice() {
        let load = Grid { columns: 102, rows: 52, band: 3 }.load(1);
        let expected = Load { together: 8, updates: 5000.0, computed_twice: 0.0, messages: 0.0, bytes: 0.0 };
        assert_eq!(load, expected);
        assert_eq!(MODEL.seconds(&load), 1e-9 * 5000.0);
    }

    #[test]
    fn steps_taken_together_share_messages_and_not_bytes() {
        // 1200 columns in 400 bands: on 4 ranks 100 bands each, 16 steps together.
        let load = Grid { columns: 1200, rows: 102, band: 3 }.load(4);
        assert_eq!((load.together, load.messages), (16, 2.0 / 16.0));
        assert_eq!(load.bytes, 2.0 * 3.0 * 102.0 * 16.0);
        // Of 16 steps the first computes 15 bands more on each side, the last none.
        assert_eq!(load.computed_twice, 2.0 * 7.5 * 3.0 * 100.0);
        let two = Grid { columns: 1200, rows: 102, band: 3 }.load(2);
        assert_eq!((two.messages, two.bytes), (1.0 / 16.0, load.bytes / 2.0));
    }

    #[test]
    fn what_is_sent_stays_the_same_with_more_ranks_of_as_much_each() {
        let grid = Grid { columns: 240, rows: 200, band: 3 };
        let loads: Vec<Load> = [4, 64, 4096].map(|ranks| grid.longer(ranks).load(ranks)).into();
        assert!(loads.windows(2).all(|pair| pair[0] == pair[1]), "{loads:?}");
        let weak: Vec<f64> = [1, 2, 64, 4096].map(|ranks| MODEL.weak_efficiency(&grid, ranks)).into();
        assert!(weak[0] == 1.0 && weak[1] > weak[2] && weak[2] == weak[3], "{weak:?}");
        let strong: Vec<f64> = [1, 4, 64, 4096].map(|ranks| MODEL.strong_efficiency(&grid, ranks)).into();
        assert!(strong.windows(2).all(|pair| pair[0] > pair[1]) && strong[3] < 0.01, "{strong:?}");
    }
}
