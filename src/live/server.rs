//! Lets viewers in: browsers on this computer that show the token of the address.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;

use super::conductor::{Conductor, Request};
use super::request::{self, Asked};
use super::session::Session;
use super::state::Board;
use super::viewer;

/// Most viewers at a time, and most connections, those included that have not asked for anything yet.
const MOST_VIEWERS: usize = 8;
const MOST_CONNECTIONS: usize = 32;
/// Requests that wait for the session; viewers that ask for more wait with them.
const MOST_REQUESTS: usize = 256;
/// How long the session may take to end what it was asked last; it is left behind then.
const PATIENCE: Duration = Duration::from_millis(700);
/// Time between two looks for a new connection.
const LOOK: Duration = Duration::from_millis(10);

/// An address of this computer, at which no other computer can ask.
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: String,
}

struct Shared {
    token: String,
    port: u16,
    board: Arc<Board>,
    requests: SyncSender<Request>,
    connections: AtomicUsize,
    viewers: AtomicU64,
}

impl Server {
    /// At this port, or a free one.
    ///
    /// # Errors
    /// A port that is taken, or a system without random numbers.
    pub fn open(port: Option<u16>) -> io::Result<Self> {
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(io::Error::other)?;
        Self::reopen(port.unwrap_or(0), random.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// At the port of an earlier server and with its token, so that its pages find this one.
    ///
    /// # Errors
    /// A port that is taken.
    pub fn reopen(port: u16, token: String) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let port = listener.local_addr().map(|address: SocketAddr| address.port())?;
        Ok(Self { listener, port, token })
    }

    /// The port and the token, for [`Server::reopen`].
    pub fn place(&self) -> (u16, String) {
        (self.port, self.token.clone())
    }

    /// The address to open in a browser, with its token.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    /// Serves a session until `stop` is raised, and returns it; what viewers save is written in `folder`. `command` is
    /// that which began the session, as its page shows it.
    ///
    /// # Errors
    /// A listener that is gone, no threads, a session that has panicked, or one that is still busy with what it was asked
    /// last (`TimedOut`): its thread, which nothing interrupts, is left behind, and what the session has with it.
    pub fn serve(
        self,
        session: Box<dyn Session>,
        command: String,
        folder: PathBuf,
        stop: &AtomicBool,
    ) -> io::Result<Box<dyn Session>> {
        self.listener.set_nonblocking(true)?;
        let board = Arc::new(Board::default());
        let (requests, asked) = sync_channel(MOST_REQUESTS);
        let mut conductor = Conductor::new(session, Arc::clone(&board), command, folder);
        // No viewer is let in before there is a page.
        conductor.show();
        let shared = Arc::new(Shared {
            token: self.token,
            port: self.port,
            board,
            requests,
            connections: AtomicUsize::new(0),
            viewers: AtomicU64::new(0),
        });
        let ended = Arc::new(AtomicBool::new(false));
        let is_ended = Arc::clone(&ended);
        let run = move || conductor.run(&asked, &is_ended);
        let run = std::thread::Builder::new().name("live session".into()).spawn(run)?;
        while !stop.load(Ordering::Relaxed) && !shared.board.is_closed() {
            match self.listener.accept() {
                Ok((stream, _)) => admit(stream, &shared),
                Err(_) => std::thread::sleep(LOOK),
            }
        }
        ended.store(true, Ordering::Relaxed);
        let since = Instant::now();
        while !run.is_finished() {
            if since.elapsed() > PATIENCE {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the session is still busy"));
            }
            std::thread::sleep(LOOK);
        }
        run.join().map_err(|_| io::Error::other("the session has panicked"))
    }
}

/// Hands a connection to a thread of its own, unless there are too many.
fn admit(stream: TcpStream, shared: &Arc<Shared>) {
    if shared.connections.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
        shared.connections.fetch_sub(1, Ordering::SeqCst);
        return;
    }
    let own = Arc::clone(shared);
    let serve = move || {
        if let Err(error) = own.serve(stream) {
            tracing::debug!("a connection ended: {error}");
        }
        own.connections.fetch_sub(1, Ordering::SeqCst);
    };
    if std::thread::Builder::new().name("live connection".into()).spawn(serve).is_err() {
        shared.connections.fetch_sub(1, Ordering::SeqCst);
    }
}

impl Shared {
    fn serve(&self, mut stream: TcpStream) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        let asked = request::read(&mut stream)?;
        let origin = format!("http://127.0.0.1:{}", self.port);
        if let Some(words) = self.refusal(&asked, &origin) {
            return request::answer(&mut stream, "403 Forbidden", words, &origin);
        }
        match (asked.path.as_str(), asked.key) {
            ("/", None) => {
                let page = self.board.page();
                request::answer(&mut stream, "200 OK", &page, &origin)
            }
            ("/socket", Some(key)) => {
                let viewer = self.viewers.fetch_add(1, Ordering::SeqCst);
                if !self.board.enter(viewer, MOST_VIEWERS) {
                    let status = "503 Service Unavailable";
                    return request::answer(&mut stream, status, "too many viewers\n", &origin);
                }
                let accept = derive_accept_key(key.as_bytes());
                let head = format!(
                    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
                     Sec-WebSocket-Accept: {accept}\r\n\r\n"
                );
                let begun = io::Write::write_all(&mut stream, head.as_bytes());
                let served = begun.and_then(|()| viewer::serve(stream, viewer, &self.board, &self.requests));
                served.inspect_err(|_| self.board.leave(viewer))
            }
            _ => request::answer(&mut stream, "404 Not Found", "there is nothing here\n", &origin),
        }
    }

    /// Why a request is not answered. Pages of other sites can reach this address by a name of their own, and sockets
    /// from anywhere: the one shows in the host, the other in the origin.
    fn refusal(&self, asked: &Asked, origin: &str) -> Option<&'static str> {
        let is_own = |text: &str| text == origin.trim_start_matches("http://");
        let is_from_here = asked.origin.as_deref().map_or(asked.key.is_none(), |from| from == origin);
        if !is_own(&asked.host) {
            Some("this address is that of a single computer\n")
        } else if !is_from_here {
            Some("another page asks\n")
        } else if !is_same(asked.token.as_bytes(), self.token.as_bytes()) {
            Some("the address lacks its token: open the one that flockform prints\n")
        } else {
            None
        }
    }
}

/// Whether two texts are the same, in a time that does not show how far they are.
fn is_same(one: &[u8], other: &[u8]) -> bool {
    let differences = one.iter().zip(other).fold(0, |all, (a, b)| all | (a ^ b));
    one.len() == other.len() && differences == 0
}
