//! Whether the middleware lives: a sample that must come back, its threads, its memory.
//!
//! Any peer that can send a packet can end RustDDS's threads, keep them busy for ever, or have them fill the memory:
//! one heartbeat that promises 2^62 samples is enough (0.15.1, the newest there is). Nothing in the process can repair
//! that. So the watchdog ends the process, and the supervisor starts another.
//!
//! The sample is a packet of our own, from a writer of ours to a reader of ours, sent to our own port: it passes the
//! socket, the receiver and the cache like any other, and needs no multicast, which a loopback device may not have.
//! A secured participant takes no such packet; there it is watched whether it empties its socket (`queue`), which takes
//! it longer.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::{DomainParticipant, RTPSEntity};

use super::graph::{entity, prefix};
use super::packet::{Content, data, discovery_port};
use super::participant::{Reader, Shared, Writer};
#[cfg(feature = "security")]
use super::queue::Queue;
use super::topic::{Taken, next};
use super::{EdgeError, Quality, threads};
use crate::ros::arguments::Security;

/// How often memory and threads are looked at \[s\]. A flood of promises fills 1 GB/s.
const LOOK: Duration = Duration::from_millis(10);
/// Looks between two samples \[1\].
const BEAT: u32 = 10;
/// Growth of the process since opening at which it is given up, and at which the kernel refuses memory \[kB\].
const GROWTH: u64 = 128 * 1024;
const MOST_GROWTH: u64 = 2 * GROWTH;
/// The same for a process that has not opened its topics yet, which takes some of it.
const MOST_OPENING: u64 = 3 * GROWTH;
/// How long the loop has to say its last word once the middleware is given up \[s\].
const LAST_WORD: Duration = Duration::from_millis(100);

/// How long the middleware may keep silent.
#[derive(Clone, Copy)]
struct Patience {
    /// How long no sample may come back, and how long the loop may be kept by the middleware \[s\].
    deaf: Duration,
    /// How long all peers that were heard before may be silent at once \[s\].
    lonely: Duration,
    /// How much of its threads' waiting for a processor, at most, is not counted as silence \[s\].
    starved: Duration,
}

const IN_THE_CLEAR: Patience =
    Patience { deaf: Duration::from_millis(700), lonely: Duration::from_secs(2), starved: Duration::ZERO };
/// With keys RustDDS is silent for longer (`.github/upstream.md`, 9). Its threads share one lock, at which the second to
/// come sleeps 0.1 s, again and again while keys of all endpoints are exchanged with each peer that appears: measured
/// was 0.9 s undisturbed (unoptimised). It decrypts all that has arrived before it looks at its socket again: up to 14 s
/// on a computer with more to do than processors. To end the process then makes all its peers exchange keys once more,
/// which keeps them silent in turn.
const WITH_KEYS: Patience = Patience {
    deaf: Duration::from_secs(3),
    lonely: Duration::from_secs(8),
    starved: Duration::from_secs(9),
};

impl Patience {
    fn of(is_secured: bool) -> Self {
        if is_secured { WITH_KEYS } else { IN_THE_CLEAR }
    }

    /// The longest that the loop may be kept by the middleware before the process ends itself \[s\].
    fn longest(&self) -> Duration {
        self.deaf + self.starved
    }

    /// How much of a silence is not counted in which the threads have waited so long for a processor \[s\].
    fn forgiven(&self, waited: Duration) -> Duration {
        waited.min(self.starved)
    }
}

/// How long the middleware may keep the loop of a process, with keys or in the clear, before its watchdog ends it \[s\].
pub fn longest_silence(security: &Security) -> Duration {
    Patience::of(security.enclave.is_some()).longest()
}

/// Exit code of a process whose middleware was given up: a new one will do (EX_SOFTWARE of sysexits.h).
pub const MIDDLEWARE_GONE: u8 = 70;

/// The state shared by the loop and its watchdog.
pub struct Pulse {
    begun: Instant,
    patience: Patience,
    given_up: AtomicBool,
    /// Whether the process leaves the network, which ends threads of the middleware.
    is_leaving: AtomicBool,
    /// When the loop went into the middleware \[ms since `begun`\]; 0 while it is out.
    inside_since: AtomicU64,
    /// How long the threads of the middleware had waited for a processor when last looked at \[ms\].
    waited: AtomicU64,
    /// When the loop last heard a peer, and how long the threads had waited by then.
    heard: Mutex<Option<(Instant, Duration)>>,
}

/// While it lives the loop is in the hands of the middleware.
pub struct Inside<'a>(&'a Pulse);

impl Drop for Inside<'_> {
    fn drop(&mut self) {
        self.0.inside_since.store(0, Ordering::Relaxed);
    }
}

impl Pulse {
    fn new(patience: Patience) -> Self {
        let [given_up, is_leaving] = [false; 2].map(AtomicBool::new);
        let [inside_since, waited] = [0; 2].map(AtomicU64::new);
        let (begun, heard) = (Instant::now(), Mutex::default());
        Self { begun, patience, given_up, is_leaving, inside_since, waited, heard }
    }

    fn look_at_waits(&self) -> Duration {
        self.waited.store(threads::waited().as_millis() as u64, Ordering::Relaxed);
        self.waited()
    }

    fn waited(&self) -> Duration {
        Duration::from_millis(self.waited.load(Ordering::Relaxed))
    }

    /// Whether it has been silent for too long since it was heard.
    fn is_lonely(&self, (at, waited): (Instant, Duration)) -> bool {
        let forgiven = self.patience.forgiven(self.waited().saturating_sub(waited));
        at.elapsed() > self.patience.lonely + forgiven
    }

    /// Whether the process is about to end.
    pub(crate) fn is_given_up(&self) -> bool {
        self.given_up.load(Ordering::Relaxed)
    }

    /// Ends the watch: from now on threads of the middleware end because they are to.
    pub fn leave(&self) {
        self.is_leaving.store(true, Ordering::Relaxed);
    }

    /// Records after each tick whether the loop hears any peer. Forged discovery can leave the middleware deaf to all
    /// its peers though otherwise sound; a new one finds them. A process that has never heard a peer, or whose peers have
    /// all taken leave, waits for one; `left` says so of each source of theirs, and nothing of one that never had any.
    pub(crate) fn note_peers(&self, any_peer: bool, left: impl FnOnce() -> Vec<Option<bool>>) {
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        if any_peer {
            *heard = Some((Instant::now(), self.waited()));
        } else if heard.is_some_and(|heard| self.is_lonely(heard)) {
            let left: Vec<bool> = left().into_iter().flatten().collect();
            if !left.is_empty() && left.iter().all(|left| *left) {
                *heard = None;
                tracing::info!("all peers have left: waiting for others");
            } else if !self.given_up.swap(true, Ordering::Relaxed) {
                tracing::error!(
                    "no peer that was heard before is heard: the middleware is given up, in case it is deaf to them; \
                     those that were switched off come back by themselves"
                );
            }
        }
    }

    /// Records that the loop listens to no peer for now: its silence then means nothing.
    pub(crate) fn listens_to_none(&self) {
        *self.heard.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    pub fn inside(&self) -> Inside<'_> {
        self.enter();
        Inside(self)
    }

    fn enter(&self) {
        let now = self.begun.elapsed().as_millis() as u64;
        self.inside_since.store(now.max(1), Ordering::Relaxed);
    }

    /// Does work of a loop that is inside, whose time is not counted: opening the topics of many robots takes long in a
    /// sound middleware too. A dead one is noticed by the sample that does not come back.
    pub(crate) fn untimed<T>(&self, work: impl FnOnce() -> T) -> T {
        self.inside_since.store(0, Ordering::Relaxed);
        let done = work();
        self.enter();
        done
    }

    fn kept_for(&self) -> Duration {
        match self.inside_since.load(Ordering::Relaxed) {
            0 => Duration::ZERO,
            since => self.begun.elapsed().saturating_sub(Duration::from_millis(since)),
        }
    }
}

/// Evidence that the middleware is receiving.
enum Proof {
    Sample(Box<Loop>),
    /// Of a secured participant, which takes no sample that it has not authenticated.
    #[cfg(feature = "security")]
    Queue(Queue),
}

impl Proof {
    fn open(shared: &Shared, participant: &DomainParticipant) -> Result<Self, EdgeError> {
        #[cfg(feature = "security")]
        if shared.is_secured {
            return Queue::open(participant).map(Self::Queue);
        }
        Loop::open(shared, participant).map(Box::new).map(Self::Sample)
    }

    fn send(&mut self, number: u32) {
        match self {
            Self::Sample(way) => way.send(number),
            #[cfg(feature = "security")]
            Self::Queue(queue) => queue.send(number),
        }
    }

    /// Whether something that was sent has been taken since this was last asked.
    fn is_taken(&mut self) -> bool {
        match self {
            Self::Sample(way) => way.receive().is_some(),
            #[cfg(feature = "security")]
            Self::Queue(queue) => queue.is_taken(),
        }
    }
}

/// The sample and its way.
struct Loop {
    socket: UdpSocket,
    to: SocketAddr,
    reader: Reader,
    // Never written through: its name stands in the packets.
    writer: Writer,
}

impl Loop {
    fn open(shared: &Shared, participant: &DomainParticipant) -> Result<Self, EdgeError> {
        let name = prefix(participant.guid())
            .iter()
            .fold("flockform_loop".to_owned(), |name, byte| format!("{name}_{byte:02x}"));
        // In this order: RustDDS announces the process's own writers to a new reader, and not the other way round.
        let writer = shared.writer(&name, "flockform::Loop_", Quality::BEST_EFFORT)?;
        let reader = shared.reader(&name, "flockform::Loop_", Quality::BEST_EFFORT)?;
        let refused =
            |error: std::io::Error| EdgeError::Endpoint { topic: name.clone(), reason: error.to_string() };
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).map_err(refused)?;
        let participant_id = participant.participant_id();
        let port = discovery_port(participant.domain_id(), Some(participant_id));
        let port = port.ok_or_else(|| refused(std::io::Error::other("no port is left for this domain")))?;
        Ok(Self { socket, to: (Ipv4Addr::LOCALHOST, port).into(), reader, writer })
    }

    fn send(&mut self, number: u32) {
        let (reader, writer) = (self.reader.guid(), self.writer.guid());
        let mut payload = [0, 1, 0, 0, 0, 0, 0, 0];
        payload[4..].copy_from_slice(&number.to_le_bytes());
        let ends = [entity(writer), entity(reader)];
        let packet = data(prefix(writer), ends, number, &Content::Payload(&payload));
        // One that is not sent does not come back.
        let _ = self.socket.send_to(&packet, self.to);
    }

    /// The newest that came back.
    fn receive(&self) -> Option<u32> {
        let mut newest = None;
        for _ in 0..64 {
            match next(&self.reader) {
                Taken::Nothing => break,
                Taken::Unreadable => {}
                Taken::Sample(sample) => {
                    newest =
                        sample.payload.bytes.first_chunk().map(|bytes| u32::from_le_bytes(*bytes)).or(newest);
                }
            }
        }
        newest
    }
}

/// Starts the thread that watches; it ends the process with [`MIDDLEWARE_GONE`].
pub(super) fn start(shared: &Shared, participant: &DomainParticipant) -> Result<Arc<Pulse>, EdgeError> {
    let mut proof = Proof::open(shared, participant)?;
    let pulse = Arc::new(Pulse::new(Patience::of(shared.is_secured)));
    let seen = pulse.clone();
    let watch = move || {
        let Some((reason, last_word)) = watch(&mut proof, &seen) else { return };
        seen.given_up.store(true, Ordering::Relaxed);
        tracing::error!("the middleware is given up: {reason}");
        std::thread::sleep(last_word);
        std::process::exit(i32::from(MIDDLEWARE_GONE));
    };
    let thread = std::thread::Builder::new().name("ros pulse".into()).spawn(watch);
    thread.map_err(|error| EdgeError::Endpoint { topic: "ros pulse".into(), reason: error.to_string() })?;
    Ok(pulse)
}

/// Watches until there is a reason to give up, and returns it with the time that the loop has for its last word; `None` once the
/// process leaves.
fn watch(proof: &mut Proof, pulse: &Pulse) -> Option<(String, Duration)> {
    let most = memory("VmRSS:").unwrap_or(0) + GROWTH;
    bound_memory(MOST_GROWTH);
    let (patience, threads) = (pulse.patience, threads::count());
    let (mut sent, mut last_look, mut silence) = (0_u32, Instant::now(), Duration::ZERO);
    let (mut look, mut waited) = (0_u32, pulse.look_at_waits());
    loop {
        look = look.wrapping_add(1);
        std::thread::sleep(LOOK);
        if pulse.is_leaving.load(Ordering::Relaxed) {
            return None;
        }
        // A suspended computer is not a deaf middleware: only time in which this thread ran counts.
        silence += last_look.elapsed().min(4 * LOOK);
        last_look = Instant::now();
        if let Some(size) = memory("VmRSS:").filter(|size| *size > most) {
            // It grows while we wait.
            return Some((format!("the process has grown to {} MB", size / 1024), Duration::ZERO));
        }
        if look.is_multiple_of(BEAT) {
            if threads::count() < threads {
                return Some(("one of its threads has ended".into(), LAST_WORD));
            }
            pulse.look_at_waits();
            sent = sent.wrapping_add(1);
            proof.send(sent);
        }
        if proof.is_taken() {
            (silence, waited) = (Duration::ZERO, pulse.waited());
        }
        let kept = pulse.kept_for();
        let limit = patience.deaf + patience.forgiven(pulse.waited().saturating_sub(waited));
        if silence > limit {
            let reason = format!("it has heard nothing for {:.1} s, not even us", silence.as_secs_f64());
            return Some((reason, LAST_WORD));
        }
        if kept > limit {
            return Some((format!("it has kept the loop for {:.1} s", kept.as_secs_f64()), LAST_WORD));
        }
    }
}

/// Has the kernel refuse what no opening needs: strangers reach the middleware before its watchdog is there.
pub fn bound_opening() {
    bound_memory(MOST_OPENING);
}

/// Has the kernel refuse what goes far beyond the memory that there is now, by `growth` \[kB\]: a thread that fills it
/// may not let us look in time. The process then ends at once.
fn bound_memory(growth: u64) {
    let Some(most) = memory("VmData:").map(|size| 1024 * (size + growth)) else { return };
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the call writes a struct that lives as long as it takes.
    let is_known = unsafe { libc::getrlimit(libc::RLIMIT_DATA, &raw mut limit) } == 0;
    // The largest that may be asked for stays, as the second bound may lie above the first.
    limit.rlim_cur = most.min(limit.rlim_max);
    // SAFETY: the call reads a struct that lives as long as it takes.
    if !is_known || unsafe { libc::setrlimit(libc::RLIMIT_DATA, &raw const limit) } != 0 {
        tracing::debug!("no bound on memory: {}", std::io::Error::last_os_error());
    }
}

/// Memory of this process by a key of its status \[kB\], where the system has one.
fn memory(key: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::edge::{Edge, Options};

    #[test]
    fn silence_of_a_middleware_without_a_processor_is_forgiven_for_a_while_and_in_the_clear_never() {
        let (moment, hour) = (Duration::from_millis(1), Duration::from_secs(3600));
        let is_lonely = |starved, waited: Duration| {
            let pulse = Pulse::new(Patience { deaf: hour, lonely: moment, starved });
            pulse.note_peers(true, Vec::new);
            pulse.waited.store(waited.as_millis() as u64, Ordering::Relaxed);
            std::thread::sleep(5 * moment);
            pulse.note_peers(false, Vec::new);
            pulse.is_given_up()
        };
        assert!(!is_lonely(hour, hour));
        assert!(is_lonely(hour, Duration::ZERO) && is_lonely(moment, hour));
        assert!(is_lonely(IN_THE_CLEAR.starved, hour));
    }

    #[test]
    fn peers_that_took_leave_are_not_silent() {
        let patience = Patience { lonely: Duration::from_millis(1), ..IN_THE_CLEAR };
        let is_given_up = |left: &[Option<bool>]| {
            let pulse = Pulse::new(patience);
            pulse.note_peers(true, Vec::new);
            std::thread::sleep(5 * patience.lonely);
            for _ in 0..2 {
                pulse.note_peers(false, || left.to_vec());
            }
            pulse.is_given_up()
        };
        assert!(!is_given_up(&[Some(true), None]) && !is_given_up(&[Some(true); 3]));
        assert!(is_given_up(&[Some(true), Some(false)]) && is_given_up(&[None]) && is_given_up(&[]));
    }

    #[test]
    fn time_of_untimed_work_is_not_counted() {
        let pulse = Pulse::new(IN_THE_CLEAR);
        let _inside = pulse.inside();
        let work = Duration::from_millis(50);
        pulse.untimed(|| {
            std::thread::sleep(work);
            assert_eq!(pulse.kept_for(), Duration::ZERO);
        });
        // In whole milliseconds.
        assert!(pulse.kept_for() + work <= pulse.begun.elapsed() + Duration::from_millis(2));
        std::thread::sleep(Duration::from_millis(5));
        assert!(pulse.kept_for() > Duration::ZERO, "the loop is inside again");
    }

    #[test]
    fn a_sample_comes_back_and_one_that_was_not_sent_does_not() {
        let domain = 100 + (std::process::id() % 101) as u16;
        let edge = Edge::open(Options { domain, loopback_only: true }).expect("sockets");
        let mut way = edge.with_participant(Loop::open).expect("a loop");
        let since = Instant::now();
        // RustDDS takes a moment to introduce them to each other.
        let first = (1..500).find(|&number| {
            way.send(number);
            std::thread::sleep(Duration::from_millis(10));
            way.receive() == Some(number)
        });
        let first = first.expect("none came back");
        assert!(since.elapsed() < Duration::from_secs(2), "the first that came back was {first}");
        for number in first + 1..first + 20 {
            way.send(number);
            let since = Instant::now();
            while way.receive() != Some(number) {
                assert!(since.elapsed() < Duration::from_secs(5), "sample {number} did not come back");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(way.receive(), None);
        assert!(threads::count() >= 2 && memory("VmRSS:").is_some_and(|size| size > 1000));
    }
}
