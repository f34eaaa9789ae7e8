//! Standard error behind a thread. A line is written before its sender goes on, as long as there is a reader: once a line
//! has waited for [`PATIENCE`], senders wait no more. A pipe that is full holds up no control loop, and no end.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long the sender of a line waits for it to be written.
const PATIENCE: Duration = Duration::from_millis(50);
/// Lines that wait for a reader; later ones are lost \[1\].
const MOST_WAITING: usize = 1000;

/// The sender's end of the thread.
#[derive(Clone)]
pub struct LogWriter(Arc<Shared>);

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    arrived: Condvar,
    written: Condvar,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<Vec<u8>>,
    /// Lines that were put in, and lines that are out, since the beginning.
    sent: u64,
    written: u64,
    /// Lines that found no place.
    lost: u64,
    /// Whether a line has waited in vain, and others wait still.
    is_stalled: bool,
}

impl LogWriter {
    /// Starts the thread that writes to `output`.
    ///
    /// # Errors
    /// No thread is to be had.
    pub fn start(mut output: impl Write + Send + 'static) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let ours = shared.clone();
        std::thread::Builder::new().name("log".into()).spawn(move || {
            loop {
                let line = ours.next();
                // A reader that is gone is no reason to end.
                let _ = output.write_all(&line);
                ours.note_written();
            }
        })?;
        Ok(Self(shared))
    }
}

impl Write for LogWriter {
    /// Takes a whole line.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let mut queue = self.0.queue();
        if queue.waiting.len() >= MOST_WAITING {
            queue.lost += 1;
            return Ok(line.len());
        }
        let number = queue.put(line.to_vec());
        self.0.arrived.notify_one();
        if !queue.is_stalled {
            let is_waiting = |queue: &mut Queue| queue.written < number;
            let waited = self.0.written.wait_timeout_while(queue, PATIENCE, is_waiting);
            let (mut queue, outcome) = waited.unwrap_or_else(PoisonError::into_inner);
            queue.is_stalled |= outcome.timed_out();
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Queue {
    /// Its number, from 1.
    fn put(&mut self, line: Vec<u8>) -> u64 {
        self.waiting.push_back(line);
        self.sent += 1;
        self.sent
    }
}

impl Shared {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn next(&self) -> Vec<u8> {
        let mut queue = self.queue();
        loop {
            match queue.waiting.pop_front() {
                Some(line) => return line,
                None => queue = self.arrived.wait(queue).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }

    fn note_written(&self) {
        let mut queue = self.queue();
        queue.written += 1;
        if queue.waiting.is_empty() {
            queue.is_stalled = false;
            let lost = std::mem::take(&mut queue.lost);
            if lost > 0 {
                queue.put(format!("{lost} lines of the log are lost: nothing read it\n").into_bytes());
            }
        }
        self.written.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
    use std::time::Instant;

    use super::*;

    /// Takes a line when it is let.
    struct Gate(Receiver<()>, SyncSender<Vec<u8>>);

    impl Write for Gate {
        fn write(&mut self, line: &[u8]) -> io::Result<usize> {
            self.0.recv().map_err(io::Error::other)?;
            self.1.send(line.to_vec()).map_err(io::Error::other)?;
            Ok(line.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_line_that_nothing_reads_holds_up_nobody_and_what_is_lost_is_counted() {
        let (open, gate) = sync_channel(2 * MOST_WAITING);
        let (out, lines) = sync_channel(2 * MOST_WAITING);
        let mut writer = LogWriter::start(Gate(gate, out)).expect("a thread");
        open.send(()).expect("held");
        writer.write_all(b"first").expect("taken");
        assert_eq!(lines.try_recv().expect("written before its sender goes on"), b"first");
        let since = Instant::now();
        for number in 0..MOST_WAITING + 11 {
            writer.write_all(number.to_string().as_bytes()).expect("taken");
        }
        assert!(since.elapsed() < 20 * PATIENCE, "{:?}", since.elapsed());
        (0..MOST_WAITING + 2).for_each(|_| open.send(()).expect("held"));
        // One was in the thread's hands, and so many waited.
        for number in 0..=MOST_WAITING {
            assert_eq!(lines.recv().expect("written"), number.to_string().as_bytes());
        }
        assert_eq!(lines.recv().expect("written"), b"10 lines of the log are lost: nothing read it\n");
        open.send(()).expect("held");
        writer.write_all(b"last").expect("taken");
        assert_eq!(lines.try_recv().expect("written before its sender goes on"), b"last");
    }
}
