//! A viewer: one thread that sends it the latest state, one that hears what it asks for.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use serde_json::json;
use tungstenite::protocol::{Role, WebSocket, WebSocketConfig};
use tungstenite::{Error, Message};

use super::command::{Command, MOST_BYTES};
use super::conductor::{Request, broken};
use super::session::Viewer;
use super::state::{Board, News, Published};

/// Frames that a viewer has been sent and has not drawn: one on its way while it draws another.
const MOST_UNDRAWN: u32 = 2;
/// A viewer that takes nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(10);
/// A viewer that draws nothing for so long, as a page in the background, is sent a frame all the same.
const IDLE: Duration = Duration::from_secs(2);

/// The receiving end of a socket: what the protocol would answer by itself is left out, as another thread sends.
struct Receiving(TcpStream);

impl Read for Receiving {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.read(into)
    }
}

impl Write for Receiving {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        Ok(from.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Serves a viewer until it goes.
pub(super) fn serve(
    stream: TcpStream,
    viewer: Viewer,
    board: &Arc<Board>,
    requests: &SyncSender<Request>,
) -> io::Result<()> {
    stream.set_read_timeout(None)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let undrawn = Arc::new(AtomicU32::new(0));
    let receiving = stream.try_clone()?;
    let (heard, asks) = (Arc::clone(board), requests.clone());
    let drawn = Arc::clone(&undrawn);
    let reader = std::thread::Builder::new().name("live viewer".into()).spawn(move || {
        receive(receiving, viewer, &heard, &asks, &drawn);
        heard.leave(viewer);
        heard.wake();
    })?;
    let _ = requests.send(Request::Come);
    let sent = send(&stream, viewer, board, &undrawn);
    if let Err(error) = sent {
        tracing::debug!("viewer {viewer} is gone: {error}");
    }
    let _ = stream.shutdown(std::net::Shutdown::Both);
    let _ = reader.join();
    board.leave(viewer);
    let _ = requests.send(Request::Gone(viewer));
    Ok(())
}

fn config() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(MOST_BYTES)).max_frame_size(Some(MOST_BYTES))
}

fn receive(
    stream: TcpStream,
    viewer: Viewer,
    board: &Board,
    requests: &SyncSender<Request>,
    undrawn: &AtomicU32,
) {
    let mut socket = WebSocket::from_raw_socket(Receiving(stream), Role::Server, Some(config()));
    loop {
        let text = match socket.read() {
            Ok(Message::Text(text)) => text,
            Ok(Message::Ping(payload)) => {
                board.post(viewer, Message::Pong(payload));
                continue;
            }
            Ok(Message::Pong(_)) => continue,
            Ok(_) | Err(_) => return,
        };
        match Command::parse(&text) {
            Ok(Command::Drawn { .. }) => {
                // More than were sent cannot have been drawn.
                let _ = undrawn.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1));
                board.wake();
            }
            // One that asks faster than the session answers waits here.
            Ok(command) => {
                if requests.send(Request::Command(viewer, command)).is_err() {
                    return;
                }
            }
            Err(words) => board.send(viewer, &json!({ "event": "refused", "words": words })),
        }
    }
}

/// State that a viewer has been sent.
#[derive(Default)]
struct Sent {
    number: u64,
    lineage: u64,
    broken: usize,
    roles: tungstenite::Bytes,
}

fn send(stream: &TcpStream, viewer: Viewer, board: &Board, undrawn: &AtomicU32) -> Result<(), Error> {
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config()));
    let mut sent = Sent::default();
    loop {
        let is_ready = || undrawn.load(Ordering::Relaxed) < MOST_UNDRAWN;
        match board.wait(viewer, sent.number, is_ready, IDLE) {
            News::Closed => return socket.close(None),
            News::Notice(message) => socket.send(message)?,
            News::Nothing if !is_ready() => undrawn.store(MOST_UNDRAWN - 1, Ordering::Relaxed),
            News::Nothing => socket.send(Message::Ping(tungstenite::Bytes::new()))?,
            News::State(now) => {
                undrawn.fetch_add(1, Ordering::Relaxed);
                send_state(&mut socket, &now, &mut sent)?;
            }
        }
    }
}

fn send_state(socket: &mut WebSocket<&TcpStream>, now: &Published, sent: &mut Sent) -> Result<(), Error> {
    socket.write(Message::Text(now.status.clone()))?;
    if now.roles != sent.roles {
        socket.write(Message::Binary(now.roles.clone()))?;
        sent.roles = now.roles.clone();
    }
    let is_anew = now.lineage != sent.lineage || now.broken.len() < sent.broken;
    if is_anew || now.broken.len() > sent.broken {
        let from = if is_anew { 0 } else { sent.broken };
        socket.write(Message::Binary(broken(&now.broken[from..], is_anew)))?;
        (sent.broken, sent.lineage) = (now.broken.len(), now.lineage);
    }
    sent.number = now.number;
    socket.send(Message::Binary(now.frame.clone()))
}
