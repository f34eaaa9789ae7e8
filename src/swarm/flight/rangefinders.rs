//! Simulated robots that measure each other's distances.

use std::collections::VecDeque;

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;

use crate::flock::vectors::{Vectors, distance};
use crate::scene::swarm::raw::RawRanges;
use crate::swarm::channel::{ChannelParams, stream};
use crate::swarm::watch::Range;

/// The rangefinders of all robots.
#[derive(Clone)]
pub struct Rangefinders {
    reach: f64,
    noise: f64,
    /// Of each robot: its noise, and what the network loses.
    streams: Vec<Pcg64Mcg>,
    /// Places of the last periods with their stamps \[s\]; the newest is last.
    past: VecDeque<(f64, Vectors)>,
}

impl Rangefinders {
    pub fn new(raw: &RawRanges, seed: u64, count: usize) -> Self {
        let streams = (0..count).map(|m| stream(seed, m as u64, 3)).collect();
        Self { reach: raw.reach, noise: raw.noise, streams, past: VecDeque::new() }
    }

    /// Measures at these places, and passes on to `hear` what arrives now of the robots that send: all ranges of a robot
    /// or none, as late as its poses without jitter.
    pub fn measure(
        &mut self,
        (places, stamp): (Vectors, f64),
        network: &ChannelParams,
        sends: impl Fn(usize) -> bool,
        hear: &mut dyn FnMut(Range),
    ) {
        self.past.push_back((stamp, places));
        let waiting = network.delay as usize;
        while self.past.len() > waiting + 1 {
            self.past.pop_front();
        }
        let Some((stamp, places)) = self.past.front().filter(|_| self.past.len() == waiting + 1) else {
            return;
        };
        for (observer, noise) in self.streams.iter_mut().enumerate() {
            if !sends(observer) || noise.random::<f64>() < network.loss {
                continue;
            }
            let here = places.get(observer);
            for of in (0..places.len()).filter(|&of| of != observer) {
                let away = distance(here, places.get(of));
                if away <= self.reach {
                    let error = self.noise * noise.sample::<f64, _>(StandardNormal);
                    hear(Range { observer, of, distance: (away + error).max(0.0), stamp: *stamp });
                }
            }
        }
    }
}
