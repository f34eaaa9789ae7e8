//! Queues of outgoing messages, between publishers and the middleware.
//!
//! RustDDS can block a writing thread: its send window is locked while it processes received packets. So a thread of
//! ours writes, and a publisher only appends its message to a queue of bounded length, in which the newest replaces
//! the oldest: a late target is worse than none.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::{GUID, RTPSEntity, WriteOptions};

use super::EdgeError;
use super::participant::Writer;
use super::payload::Payload;
use super::whole::{Reply, WholeReplies};

/// Messages that wait on any topic, however short its history \[1\]: a computer that is busy for some periods loses none.
const LEAST: usize = 4;

/// How long the middleware may take none of the messages that wait \[s\].
const STUCK: Duration = Duration::from_millis(500);

/// How long the last messages may take to go out when the edge closes \[s\].
const LEAVING: Duration = Duration::from_millis(200);

/// The thread's end of one topic.
pub(super) struct Outlet {
    topic: String,
    guid: GUID,
    writer: Mutex<Writer>,
    most: usize,
    queue: Mutex<Queue>,
    /// Of a service in the clear.
    replies: Option<Arc<WholeReplies>>,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<(Payload, WriteOptions)>,
    /// When the thread last took one, or found none.
    taken: Option<Instant>,
    /// Why the last message was not taken, until a publisher receives the error.
    refused: Option<String>,
}

impl Outlet {
    pub fn new(topic: &str, writer: Writer, depth: u16, replies: Option<Arc<WholeReplies>>) -> Arc<Self> {
        let most = usize::from(depth).max(LEAST);
        let (topic, guid) = (topic.to_owned(), writer.guid());
        Arc::new(Self { topic, guid, writer: Mutex::new(writer), most, queue: Mutex::default(), replies })
    }

    pub fn guid(&self) -> GUID {
        self.guid
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes the oldest message that waits.
    fn write_one(&self) {
        let mut queue = self.queue();
        queue.taken = Some(Instant::now());
        let Some((payload, options)) = queue.waiting.pop_front() else { return };
        drop(queue);
        let writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        let whole = self.replies.as_ref().and_then(|replies| Some((replies, Reply::of(&payload, &options)?)));
        match (writer.write_with_options(payload, options), whole) {
            (Ok(sample), Some((replies, reply))) => {
                replies.send(self.guid, i64::from(sample.sequence_number), &reply);
            }
            (Ok(_), None) => {}
            (Err(error), _) => self.queue().refused = Some(error.to_string()),
        }
    }
}

/// The outbox that the publishers of an edge share.
pub(super) struct Outbox {
    /// A token for each message that waits.
    tokens: Option<Sender<Arc<Outlet>>>,
    emptied: Mutex<Receiver<()>>,
}

impl Outbox {
    pub fn start() -> std::io::Result<Self> {
        let (tokens, to_write) = channel::<Arc<Outlet>>();
        let (done, emptied) = channel();
        std::thread::Builder::new().name("ros out".into()).spawn(move || {
            to_write.iter().for_each(|outlet| outlet.write_one());
            // The receiver may be gone.
            let _ = done.send(());
        })?;
        Ok(Self { tokens: Some(tokens), emptied: Mutex::new(emptied) })
    }

    /// Lays a message into its queue, without waiting.
    ///
    /// # Errors
    /// That the middleware takes nothing any more, or refused one since the last call. This one waits all the same.
    pub fn post(
        &self,
        outlet: &Arc<Outlet>,
        payload: Payload,
        options: WriteOptions,
    ) -> Result<(), EdgeError> {
        let mut queue = outlet.queue();
        let is_full = queue.waiting.len() >= outlet.most;
        if is_full {
            queue.waiting.pop_front();
        } else if queue.waiting.is_empty() {
            queue.taken = Some(Instant::now());
        }
        // That the newest replaces the oldest is the way of a queue; that nothing is taken at all is none.
        let is_stuck = is_full && queue.taken.is_some_and(|taken| taken.elapsed() > STUCK);
        queue.waiting.push_back((payload, options));
        let refused = queue.refused.take();
        drop(queue);
        let gone = match &self.tokens {
            Some(tokens) if !is_full => tokens.send(outlet.clone()).is_err(),
            _ => false,
        };
        let reason = match refused {
            _ if gone => "nothing is sent any more".into(),
            _ if is_stuck => format!("the middleware takes nothing, {} messages wait", outlet.most),
            Some(reason) => reason,
            None => return Ok(()),
        };
        Err(EdgeError::Send { topic: outlet.topic.clone(), reason })
    }

    /// Gives what waits a moment to go out, and takes nothing more.
    pub fn close(&mut self) {
        self.tokens.take();
        let emptied = self.emptied.get_mut().unwrap_or_else(PoisonError::into_inner);
        // A thread that hangs in the middleware keeps what it has.
        let _ = emptied.recv_timeout(LEAVING);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::wire::decode;
    use crate::ros::edge::{Edge, Options, Quality};

    #[test]
    fn a_middleware_that_hangs_blocks_no_publisher_and_the_newest_messages_wait() {
        let domain = 100 + (std::process::id() % 101) as u16;
        let edge = Edge::open(Options { domain, loopback_only: true }).expect("sockets");
        let writer = edge.with_participant(|shared, _| shared.writer("rt/hangs", "T_", Quality::BEST_EFFORT));
        let outlet = Outlet::new("/hangs", writer.expect("a writer"), 1, None);
        let hangs = outlet.writer.lock().expect("no thread panicked");
        let mut outbox = Outbox::start().expect("a thread");
        let post =
            |number: u32| outbox.post(&outlet, Payload::of(&number).expect("plain"), WriteOptions::default());
        assert_eq!(post(0), Ok(()));
        // A thread that begins late would take its message out of those below.
        for _ in 0..1000 {
            if outlet.queue().waiting.is_empty() {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(outlet.queue().waiting.is_empty(), "the thread of the outbox never began");
        let since = Instant::now();
        (1..1000).for_each(|number| assert_eq!(post(number), Ok(())));
        assert!(since.elapsed() < Duration::from_millis(400), "{:?}", since.elapsed());
        let waiting = |(payload, _): &(Payload, WriteOptions)| decode::<u32>(&payload.bytes, payload.order);
        let waiting: Vec<_> = outlet.queue().waiting.iter().map(waiting).collect();
        assert_eq!(waiting, [Ok(996), Ok(997), Ok(998), Ok(999)]);
        std::thread::sleep(2 * STUCK);
        let refused = post(1000).expect_err("nothing is taken").to_string();
        assert!(refused.contains("takes nothing, 4 messages wait"), "{refused}");
        let since = Instant::now();
        outbox.close();
        assert!(since.elapsed() < Duration::from_secs(2), "it waits for what hangs");
        drop(hangs);
    }
}
