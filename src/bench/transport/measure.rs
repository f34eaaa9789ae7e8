//! A round trip between two threads, and what it costs.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::bench::machine::quantile;

named! {
    /// The work that is timed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Work {
        /// A message that is ready is handed over.
        HandOff => "hand-off",
        /// Every pose is written and read as well.
        FilledAndRead => "filled-and-read",
    }
}

impl Work {
    /// A heading for tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::HandOff => "Hand-off of a message that is ready",
            Self::FilledAndRead => "Every pose written, and every pose read",
        }
    }
}

/// One side of a way. A message bears a mark, which distinguishes an answer from one that came late.
pub trait End {
    /// Writes every pose of the next message.
    fn fill(&mut self) -> Result<(), String>;

    /// Sends the message that was filled last, with this mark.
    fn send(&mut self, mark: u64) -> Result<(), String>;

    /// The mark of the next message that arrives, which is then kept to be read; none when patience ends.
    fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String>;

    /// Adds up what the message that arrived last holds.
    fn read(&mut self) -> f64;
}

/// Makes the side that answers, in its own thread.
pub type Open = Box<dyn FnOnce() -> Result<Box<dyn End>, String> + Send>;

/// Both ends of a way: ready, and to be made.
pub type Ends = (Box<dyn End>, Open);

/// For an answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Round trips before the first that counts.
const WARM_UP: u64 = 20;

/// Measurements of one way, over several turns.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    round_trips: Vec<f64>,
    /// Median round trip of each turn \[s\]; none of one that failed.
    turns: Vec<Option<f64>>,
    one_ways: Vec<f64>,
    lost: usize,
    cpu: Option<f64>,
    messages: usize,
}

/// One way, size and kind of work.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Name of the way.
    pub transport: &'static str,
    /// The work that is timed.
    pub work: Work,
    /// Poses in a message.
    pub poses: usize,
    /// Round trips measured.
    pub samples: usize,
    /// Messages that had not been answered after two seconds.
    pub lost: usize,
    /// From a message to its answer \[s\]; filling and reading count where they are timed.
    pub round_trip: Quantiles,
    /// From a message to its receipt \[s\]; filling and reading count where they are timed.
    pub one_way: Quantiles,
    /// Of the whole process \[s\]; none for a hand-off, and where the system does not say (Linux does).
    pub cpu_seconds_per_message: Option<f64>,
}

/// Times that so large a share does not exceed \[s\]; none without samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantiles {
    /// Half of them take no longer.
    pub p50_seconds: Option<f64>,
    /// Nine tenths of them take no longer.
    pub p90_seconds: Option<f64>,
    /// 99 % of them take no longer.
    pub p99_seconds: Option<f64>,
    /// 99.9 % of them take no longer.
    pub p999_seconds: Option<f64>,
}

impl Quantiles {
    fn of(mut times: Vec<f64>) -> Self {
        times.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| quantile(&times, share);
        Self { p50_seconds: at(0.5), p90_seconds: at(0.9), p99_seconds: at(0.99), p999_seconds: at(0.999) }
    }
}

impl Samples {
    /// The median over the turns of how this way's median round trip compares with another's of the same turn \[1\].
    /// Which cores the threads wake up on lasts for about a turn and makes a factor of three, for either way: a
    /// median over all round trips would say which way met more of such turns.
    pub fn over(&self, other: &Self) -> Option<f64> {
        let pairs = self.turns.iter().zip(&other.turns);
        Quantiles::of(pairs.filter_map(|(a, b)| Some((*a)? / (*b)?)).collect()).p50_seconds
    }

    pub(crate) fn case(self, transport: &'static str, work: Work, poses: usize) -> Case {
        let messages = self.messages.max(1) as f64;
        Case {
            transport,
            work,
            poses,
            samples: self.round_trips.len(),
            lost: self.lost,
            cpu_seconds_per_message: self.cpu.map(|seconds| seconds / messages),
            round_trip: Quantiles::of(self.round_trips),
            one_way: Quantiles::of(self.one_ways),
        }
    }
}

/// Round trips between two ends, so many at most and for so long \[s\], added to `samples`.
///
/// # Errors
/// The error of an end, or that the first message was not answered.
pub fn exchange(
    mut near: Box<dyn End>,
    far: Open,
    work: Work,
    rounds: usize,
    seconds: f64,
    samples: &mut Samples,
) -> Result<(), String> {
    let (origin, before) = (Instant::now(), samples.round_trips.len());
    samples.turns.push(None);
    let (stop, prepared) = (&AtomicBool::new(false), &AtomicUsize::new(0));
    std::thread::scope(|scope| {
        let (ready, is_ready) = std::sync::mpsc::channel();
        let answering = scope.spawn(move || {
            let opened = far();
            // The other side waits for it.
            let _ = ready.send(());
            answer(&mut *opened?, work, origin, stop, prepared)
        });
        let measured = is_ready
            .recv()
            .map_err(|error| error.to_string())
            .and_then(|()| ask(&mut *near, work, origin, prepared, rounds, seconds, samples));
        stop.store(true, Ordering::Relaxed);
        let answered = answering.join().map_err(|_| "the answering thread panicked".to_owned())?;
        let skipped = measured?;
        samples.one_ways.extend(answered?.into_iter().skip(skipped));
        let turn = Quantiles::of(samples.round_trips[before..].to_vec()).p50_seconds;
        samples.turns.last_mut().expect("pushed above").clone_from(&turn);
        Ok(())
    })
}

/// Sends and waits for answers; how many of the messages that arrived at the other side do not count.
fn ask(
    near: &mut dyn End,
    work: Work,
    origin: Instant,
    prepared: &AtomicUsize,
    rounds: usize,
    seconds: f64,
    samples: &mut Samples,
) -> Result<usize, String> {
    let mut begun = Instant::now();
    let mut cpu = cpu_seconds();
    let (mut counted, mut warm, mut answers) = (0, 0, 0);
    for round in 0..WARM_UP + rounds as u64 {
        if round == WARM_UP {
            (begun, cpu) = (Instant::now(), cpu_seconds());
        }
        if begun.elapsed().as_secs_f64() > seconds && round > WARM_UP {
            break;
        }
        if work == Work::HandOff {
            near.fill()?;
            // The answer lies ready too before the time is taken.
            let filled = Instant::now();
            while prepared.load(Ordering::Acquire) <= answers && filled.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_micros(20));
            }
        }
        let sent = origin.elapsed();
        if work == Work::FilledAndRead {
            near.fill()?;
        }
        let mark = sent.as_nanos() as u64;
        near.send(mark)?;
        let mut answered = false;
        while let Some(rest) = (sent + PATIENCE).checked_sub(origin.elapsed()) {
            match near.receive(rest)? {
                None => break,
                Some(echo) if echo == mark => {
                    answered = true;
                    break;
                }
                // An answer that came too late for its own round.
                Some(_) => {}
            }
        }
        if work == Work::FilledAndRead && answered {
            std::hint::black_box(near.read());
        }
        let took = (origin.elapsed() - sent).as_secs_f64();
        answers += usize::from(answered);
        match (answered, round < WARM_UP) {
            (false, true) if round == 0 => return Err(format!("no answer within {PATIENCE:?}")),
            (true, true) => warm += 1,
            (false, _) => samples.lost += 1,
            (true, false) => {
                samples.round_trips.push(took);
                counted += 1;
            }
        }
    }
    // A hand-off leaves out what filling takes, which the CPU cannot.
    if let (Work::FilledAndRead, Some(before), Some(after)) = (work, cpu, cpu_seconds()) {
        *samples.cpu.get_or_insert(0.0) += after - before;
    }
    samples.messages += 2 * counted;
    Ok(warm)
}

/// Answers until `stop` is set; returns how long each message was under way \[s\].
fn answer(
    far: &mut dyn End,
    work: Work,
    origin: Instant,
    stop: &AtomicBool,
    prepared: &AtomicUsize,
) -> Result<Vec<f64>, String> {
    let mut one_ways = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        if work == Work::HandOff {
            far.fill()?;
            prepared.fetch_add(1, Ordering::Release);
        }
        let mark = loop {
            match far.receive(Duration::from_millis(20))? {
                Some(mark) => break Some(mark),
                None if stop.load(Ordering::Relaxed) => break None,
                None => {}
            }
        };
        let Some(mark) = mark else { break };
        if work == Work::FilledAndRead {
            std::hint::black_box(far.read());
        }
        let took = origin.elapsed().saturating_sub(Duration::from_nanos(mark));
        one_ways.push(took.as_secs_f64());
        if work == Work::FilledAndRead {
            far.fill()?;
        }
        far.send(mark)?;
    }
    Ok(one_ways)
}

/// Time that all threads of this process have run so far \[s\].
fn cpu_seconds() -> Option<f64> {
    let mut nanoseconds = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    Some(1e-9 * nanoseconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousandth_of_the_times_may_exceed_the_last_quantile() {
        let times = Quantiles::of((1..=2000).rev().map(f64::from).collect());
        assert_eq!((times.p50_seconds, times.p90_seconds), (Some(1000.0), Some(1800.0)));
        assert_eq!((times.p99_seconds, times.p999_seconds), (Some(1980.0), Some(1998.0)));
        assert_eq!(Quantiles::of(vec![1.0]).p99_seconds, Some(1.0));
        assert_eq!(Quantiles::of(Vec::new()).p50_seconds, None);
    }

    /// Answers every third message with one of an earlier round first, and the twenty-fifth with nothing else.
    struct Muddled {
        to: std::sync::mpsc::Sender<u64>,
        from: std::sync::mpsc::Receiver<u64>,
        muddles: bool,
        sent: u64,
    }

    impl End for Muddled {
        fn fill(&mut self) -> Result<(), String> {
            Ok(())
        }

        fn send(&mut self, mark: u64) -> Result<(), String> {
            self.sent += 1;
            if self.muddles && (self.sent.is_multiple_of(3) || self.sent == 25) {
                self.to.send(mark - 1).map_err(|error| error.to_string())?;
            }
            if self.muddles && self.sent == 25 {
                return Ok(());
            }
            self.to.send(mark).map_err(|error| error.to_string())
        }

        fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String> {
            Ok(self.from.recv_timeout(patience).ok())
        }

        fn read(&mut self) -> f64 {
            0.0
        }
    }

    #[test]
    fn an_answer_of_another_round_is_no_answer() {
        let (to_far, from_near) = std::sync::mpsc::channel();
        let (to_near, from_far) = std::sync::mpsc::channel();
        let near = Box::new(Muddled { to: to_far, from: from_far, muddles: false, sent: 0 });
        let far: Open = Box::new(|| {
            Ok(Box::new(Muddled { to: to_near, from: from_near, muddles: true, sent: 0 }) as Box<dyn End>)
        });
        let mut samples = Samples::default();
        exchange(near, far, Work::HandOff, 30, 10.0, &mut samples).expect("measured");
        let case = samples.case("muddled", Work::HandOff, 1);
        assert_eq!((case.samples, case.lost), (29, 1));
    }
}
