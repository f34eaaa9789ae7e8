//! Ranks that are timed, and what they say to each other, counted.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use super::super::grid::stirred;
use super::super::machine::seconds_each;
use super::model::Link;
use crate::continuum::plan::Plan;
use crate::engine::Engine;
use crate::ranks::{Exchange, Team, in_process};
use crate::solve::stopwatch::median;
use crate::sweep::MOST_STEPS;

/// Words of the messages by which a link is measured: next to nothing, and a mebibyte.
const MESSAGES: [usize; 2] = [1, 1 << 17];

/// Data that other ranks had to send to one, and how long it waited for them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    pub messages: u64,
    pub bytes: u64,
    pub seconds: f64,
}

fn held(tally: &Mutex<Tally>) -> MutexGuard<'_, Tally> {
    tally.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A rank whose messages are counted.
struct Counted {
    team: Team,
    tally: Arc<Mutex<Tally>>,
}

impl Exchange for Counted {
    fn rank(&self) -> usize {
        self.team.rank()
    }

    fn count(&self) -> usize {
        self.team.count()
    }

    fn swap(
        &mut self,
        messages: &[(usize, Vec<u64>)],
        from: &[(usize, usize)],
        meanwhile: &mut dyn FnMut(),
    ) -> Vec<Vec<u64>> {
        let (begin, mut computed) = (Instant::now(), Duration::ZERO);
        let received = self.team.swap_while(messages, from, &mut || {
            let begin = Instant::now();
            meanwhile();
            computed = begin.elapsed();
        });
        let mut tally = held(&self.tally);
        tally.seconds += (begin.elapsed() - computed).as_secs_f64();
        tally.messages += from.len() as u64;
        tally.bytes += from.iter().map(|(_, words)| 8 * *words as u64).sum::<u64>();
        received
    }

    fn gather(&mut self, own: &[u64], counts: &[usize]) -> Vec<u64> {
        self.team.gather(own, counts)
    }
}

/// Steps on one rank and on all, taken in turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// Medians \[s\].
    pub alone: f64,
    pub shared: f64,
    /// Share of the time that the rank that waited longest was in exchanges \[1\].
    pub in_exchange: f64,
}

/// Does `work` on so many ranks, each a thread with one thread to sweep with; the first one's result.
pub fn on_threads<T: Send>(
    count: usize,
    work: impl Fn(&Team) -> T + Sync,
) -> Result<T, ThreadPoolBuildError> {
    let pools = (0..count).map(|_| single()).collect::<Result<Vec<_>, _>>()?;
    Ok(std::thread::scope(|scope| {
        let work = &work;
        let ranks = pools.into_iter().zip(in_process(count));
        let ranks: Vec<_> =
            ranks.map(|(pool, team)| scope.spawn(move || pool.install(|| work(&team)))).collect();
        let mut results = ranks.into_iter().map(|rank| rank.join().expect("no rank panics"));
        let first = results.next().expect("at least one rank");
        results.for_each(drop);
        first
    }))
}

/// One thread for a rank to sweep with.
pub fn single() -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new().num_threads(1).build()
}

/// Times a body on one rank and another one, or the same, on all of them.
pub fn time(team: &Team, [alone, shared]: [&Plan; 2], (repetitions, seconds): (usize, f64)) -> Times {
    let tally = Arc::new(Mutex::new(Tally::default()));
    let mut whole = team.is_first().then(|| engine(alone, None));
    let counted = Counted { team: team.clone(), tally: Arc::clone(&tally) };
    let mut parts = engine(shared, Some(Team::new(counted)));
    let steps = whole.as_mut().map_or(0, |whole| {
        step(whole, MOST_STEPS, MOST_STEPS);
        let one = timed(whole, MOST_STEPS);
        ((seconds / one).clamp(1.0, 1e5) as u64).next_multiple_of(MOST_STEPS as u64)
    });
    let [steps] = team.of_first([steps]);
    step(&mut parts, MOST_STEPS, MOST_STEPS);
    let (mut of_one, mut of_all, mut waited) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..repetitions {
        of_one.extend(whole.as_mut().map(|whole| timed(whole, steps as usize)));
        *held(&tally) = Tally::default();
        team.any(false);
        let begin = Instant::now();
        step(&mut parts, steps as usize, MOST_STEPS);
        let own = held(&tally).seconds / begin.elapsed().as_secs_f64();
        let [longest] = team.largest([own]);
        of_all.push(begin.elapsed().as_secs_f64() / steps as f64);
        waited.push(longest);
    }
    Times { alone: median(&mut of_one), shared: median(&mut of_all), in_exchange: median(&mut waited) }
}

/// Data that the rank with most messages receives in so many steps, and the followers of the busiest one.
pub fn count(team: &Team, plan: &Plan, steps: usize) -> (Tally, u64) {
    let tally = Arc::new(Mutex::new(Tally::default()));
    let counted = Counted { team: team.clone(), tally: Arc::clone(&tally) };
    let mut engine = engine(plan, Some(Team::new(counted)));
    // The first steps begin where every rank knows the whole body.
    step(&mut engine, MOST_STEPS, MOST_STEPS);
    let counted = |engine: &Engine| engine.activity().clone().take_counts()[0];
    let before = counted(&engine);
    *held(&tally) = Tally::default();
    step(&mut engine, steps, MOST_STEPS);
    let Tally { messages, bytes, .. } = *held(&tally);
    let updates = (counted(&engine) - before) / 2;
    let all = team.each([messages, bytes, updates]);
    let most = |k: usize| all.iter().map(|of| of[k]).max().unwrap_or_default();
    (Tally { messages: most(0), bytes: most(1), seconds: 0.0 }, most(2))
}

/// Cost of messages between the first two ranks.
pub fn link(team: &Team, rounds: usize) -> Link {
    let other = [1, 0].get(team.rank()).copied();
    let [latency, long] = MESSAGES.map(|words| {
        let Some(other) = other else { return 0.0 };
        let mut times: Vec<f64> = (0..rounds).map(|_| swapped(team, other, words)).collect();
        median(&mut times)
    });
    let [latency, long] = team.of_first([latency, long].map(f64::to_bits)).map(f64::from_bits);
    let bytes = 8.0 * (MESSAGES[1] - MESSAGES[0]) as f64;
    Link { latency_seconds: latency, bytes_per_second: bytes / (long - latency).max(1e-9) }
}

/// Seconds that two ranks take to swap so many words.
fn swapped(team: &Team, other: usize, words: usize) -> f64 {
    let message = [(other, vec![7; words])];
    let begin = Instant::now();
    let received = team.swap(&message, &[(other, words)]);
    std::hint::black_box(received);
    begin.elapsed().as_secs_f64()
}

/// A stirred body, or a rank's share of it.
pub fn engine(plan: &Plan, team: Option<Team>) -> Engine {
    let mut engine = Engine::new(plan.setup.clone());
    let reference = engine.body().reference.clone();
    engine.observe(stirred(&reference).enumerate());
    if let Some(team) = team {
        engine.join(team);
    }
    engine
}

/// Takes steps, as many together as pay and at most `most`.
pub fn step(engine: &mut Engine, steps: usize, most: usize) {
    let mut to_go = steps;
    while to_go > 0 {
        to_go -= engine.advance_at_most(to_go.min(most));
    }
}

fn timed(engine: &mut Engine, steps: usize) -> f64 {
    seconds_each(steps, || step(engine, steps, MOST_STEPS))
}
