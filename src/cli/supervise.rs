//! A process that outlives the one that does the work, and starts another when that one ends.
//!
//! A peer that reaches a node's ports can end its middleware (see `ros::edge::pulse`), and no thread of a process
//! survives exhausted memory. So `node` and `robots` are two processes. This one holds no socket and hardly any memory;
//! its child does the work and sends its state ten times a second, over the socket that is the child's standard input.
//! A child that ends without having been asked to, or falls silent, is followed by another at once, which gets that
//! state first, and with it the text of the swarm's file as it was at the start: what someone writes there meanwhile is for the
//! next flight. The alternative, a middleware in a process of its own under a loop that goes on, would be back no
//! sooner, because finding the peers again takes the time, and a loop without a middleware receives no poses.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use flockform::ros::arguments::Security;
use flockform::ros::edge::pulse::{MIDDLEWARE_GONE, longest_silence};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{BAD_INPUT, Refusal, interrupt};

/// Number of a child, from 1, in the environment.
const LIFE: &str = "FLOCKFORM_LIFE";
/// How often a child sends its state \[s\].
const SEND_PERIOD: Duration = Duration::from_millis(100);
/// How much longer than its own watchdog allows a child that has spoken may be silent \[s\].
const BEYOND_ITS_WATCHDOG: Duration = Duration::from_millis(800);
/// How often the child is looked at \[s\].
const LOOK: Duration = Duration::from_millis(10);
/// How long a child that was asked to end may take \[s\]: one that has spoken, and one that is still opening.
const LEAVING: Duration = Duration::from_secs(8);
const UNOPENED: Duration = Duration::from_millis(700);
/// How long a child that is not stopped may take until it speaks \[s\].
const OPENING: Duration = Duration::from_secs(30);
/// Children in a row that end without a word before we give up \[1\]: for a reason of their own; because they are refused what was
/// taken before, which may pass in half a minute; and as those do whose middleware strangers flood, one after the other while that
/// lasts.
const SPEECHLESS: u32 = 5;
const REFUSED: u32 = 30;
const ENDED: u32 = 300;
/// Longest wait before the next child, after several short lives \[s\].
const REST: Duration = Duration::from_secs(1);

/// A child's end of its socket.
pub struct Life {
    /// From 1.
    pub number: u32,
    socket: Option<UnixStream>,
    /// The text of the file when the first process began, where there is one.
    pub text: Option<String>,
    /// The last state that the previous process sent.
    left: Value,
    /// The part of the last state that has not been sent yet.
    unsent: Vec<u8>,
    sent: Option<Instant>,
}

/// Runs this program again as a child, and another whenever one ends for no reason of its own; returns in the child,
/// and in this process with the code of the last. All of them go by the `text` that is read here, if there is any.
pub fn supervise(
    security: &Security,
    text: impl FnOnce() -> Result<Option<String>, Refusal>,
) -> Result<Result<Life, ExitCode>, Refusal> {
    let led = match std::env::var(LIFE).ok().and_then(|number| number.parse().ok()) {
        Some(number) => Life::take_up(number).map(Ok),
        None => lead(longest_silence(security) + BEYOND_ITS_WATCHDOG, text()?).map(Err),
    };
    led.map_err(Refusal::Supervise)
}

fn lead(silence: Duration, text: Option<String>) -> std::io::Result<ExitCode> {
    let stop = interrupt::serves();
    let text = serde_json::to_vec(&text)?;
    let (mut state, mut speechless, mut rest) = (b"null".to_vec(), 0, Duration::ZERO);
    let (mut has_run, mut given_up_with) = (false, MIDDLEWARE_GONE);
    for number in 1_u32.. {
        let begun = Instant::now();
        let (mut child, lines) = start(number, [b"[", &text[..], b",", &state[..], b"]\n"].concat())?;
        let (code, last) = follow(&mut child, lines, silence, stop)?;
        speechless = if last.is_some() { 0 } else { speechless + 1 };
        has_run |= last.is_some();
        state = last.unwrap_or(state);
        match code {
            // Done, interrupted, or refused: another would do the same. What was taken before is refused for what may pass.
            Some(code @ 0..=2) if code != BAD_INPUT || !has_run => return Ok(ExitCode::from(code)),
            _ if stop.load(Ordering::Relaxed) => return Ok(ExitCode::SUCCESS),
            _ if speechless
                >= match code {
                    None | Some(MIDDLEWARE_GONE) => ENDED,
                    Some(BAD_INPUT) => REFUSED,
                    _ => SPEECHLESS,
                } =>
            {
                given_up_with = code.filter(|&code| code == BAD_INPUT).unwrap_or(MIDDLEWARE_GONE);
                break;
            }
            _ => {}
        }
        let why = code.map_or("was ended".to_owned(), |code| format!("ended with code {code}"));
        tracing::error!(
            "process {number} {why} after {:.1} s: another goes on",
            begun.elapsed().as_secs_f64()
        );
        // The first restart is immediate; a child that dies repeatedly is restarted after growing pauses.
        rest = if begun.elapsed() > Duration::from_secs(5) {
            Duration::ZERO
        } else {
            (2 * rest).clamp(LOOK, REST)
        };
        std::thread::sleep(rest);
        if stop.load(Ordering::Relaxed) {
            return Ok(ExitCode::SUCCESS);
        }
    }
    tracing::error!("{speechless} processes in a row ended before they had begun");
    Ok(ExitCode::from(given_up_with))
}

/// Starts a child and sends it what it begins with.
fn start(number: u32, begins_with: Vec<u8>) -> std::io::Result<(Child, Lines)> {
    let (ours, theirs) = UnixStream::pair()?;
    let child = Command::new(program()?)
        .args(std::env::args_os().skip(1))
        .env(LIFE, number.to_string())
        .stdin(Stdio::from(OwnedFd::from(theirs)))
        .spawn()?;
    let (say, lines) = channel();
    let (reader, mut writer) = (BufReader::new(ours.try_clone()?), ours.try_clone()?);
    std::thread::spawn(move || {
        // A child that is gone is noticed by its end.
        let _ = writer.write_all(&begins_with);
        drop(begins_with);
        for line in reader.split(b'\n').map_while(Result::ok) {
            if say.send(line).is_err() {
                return;
            }
        }
    });
    Ok((child, (ours, lines)))
}

/// This program; where its file was replaced or removed meanwhile, as by an update, the one that runs.
fn program() -> std::io::Result<PathBuf> {
    let path = std::env::current_exe()?;
    Ok(if path.exists() { path } else { "/proc/self/exe".into() })
}

type Lines = (UnixStream, Receiver<Vec<u8>>);

/// Waits for the end of a child, or ends one that is silent for longer than that: its exit code, if it gave one, and the last state it sent.
fn follow(
    child: &mut Child,
    (socket, lines): Lines,
    silence: Duration,
    stop: &AtomicBool,
) -> std::io::Result<(Option<u8>, Option<Vec<u8>>)> {
    let (mut last, mut heard, mut asked): (Option<Vec<u8>>, Instant, Option<Instant>) =
        (None, Instant::now(), None);
    let (mut before, mut is_ended) = (Instant::now(), false);
    loop {
        for line in lines.try_iter() {
            (last, heard) = (Some(line), Instant::now());
        }
        if let Some(status) = child.try_wait()? {
            // The states it sent just before its end.
            while let Ok(line) = lines.recv_timeout(LOOK) {
                last = Some(line);
            }
            return Ok((status.code().and_then(|code| u8::try_from(code).ok()), last));
        }
        // Our own absence is not the child's silence.
        heard += before.elapsed().saturating_sub(10 * LOOK);
        before = Instant::now();
        if asked.is_none() && stop.load(Ordering::Relaxed) {
            // It reads the end of its input.
            let _ = socket.shutdown(std::net::Shutdown::Write);
            asked = Some(Instant::now());
        }
        let is_late = || last.is_some() || heard.elapsed() > OPENING || is_stopped(child.id());
        let is_silent = asked.is_none() && heard.elapsed() > silence && is_late();
        // One that has not opened yet has no robots to stop.
        let leave = if last.is_some() { LEAVING } else { UNOPENED };
        if !is_ended && (is_silent || asked.is_some_and(|asked| asked.elapsed() > leave)) {
            tracing::error!("the process does not answer and is ended");
            child.kill()?;
            is_ended = true;
        }
        std::thread::sleep(LOOK);
    }
}

/// Whether a process has been stopped (SIGSTOP), so that it will never speak; false where the system does not say.
fn is_stopped(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // Behind its name, which may have anything in it.
    stat.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with('T'))
}

impl Life {
    fn take_up(number: u32) -> std::io::Result<Self> {
        use std::os::fd::AsFd;
        let socket = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned()?);
        socket.set_read_timeout(Some(Duration::from_secs(5)))?;
        let mut line = Vec::new();
        let read = BufReader::new(&socket).read_until(b'\n', &mut line);
        socket.set_nonblocking(true)?;
        let read = read.map_err(|error| error.to_string()).and_then(|_| parse(&line));
        let (text, left) = read.unwrap_or_else(|error| {
            tracing::warn!("what the processes before this one left cannot be read ({error}): starting anew");
            (None, Value::Null)
        });
        Ok(Self { number, socket: Some(socket), text, left, unsent: Vec::new(), sent: None })
    }

    /// The last state that the previous process sent.
    pub fn left<T: DeserializeOwned>(&mut self) -> Option<T> {
        serde_json::from_value(self.left.take()).unwrap_or_else(|error| {
            tracing::warn!(
                "what the process before this one left is none of its states ({error}): starting anew"
            );
            None
        })
    }

    /// Sends the state if it is due, or has changed by a command. Returns false if the socket is closed: the process should end.
    pub fn send<T: Serialize>(&mut self, has_changed: bool, state: impl FnOnce() -> T) -> bool {
        if has_changed {
            self.sent = None;
        }
        if self.sent.is_some_and(|sent| sent.elapsed() < SEND_PERIOD) {
            return true;
        }
        let Some(socket) = &mut self.socket else { return true };
        // What is left of the state before goes first.
        if self.unsent.is_empty()
            && let Ok(line) = serde_json::to_vec(&state())
        {
            (self.unsent, self.sent) = (line, Some(Instant::now()));
            self.unsent.push(b'\n');
        }
        let goes_on =
            |error: &std::io::Error| matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted);
        match socket.write(&self.unsent) {
            Ok(count) => drop(self.unsent.drain(..count)),
            Err(error) if goes_on(&error) => {}
            Err(_) => return false,
        }
        !matches!(socket.read(&mut [0]), Ok(0))
    }
}

fn parse(line: &[u8]) -> Result<(Option<String>, Value), String> {
    serde_json::from_slice(line).map_err(|error| error.to_string())
}
