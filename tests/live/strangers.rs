//! What reaches the port without being asked: other pages, other names, floods, slow readers.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::folders::temporary;
use super::served::Served;
use super::waits::within;

/// Time for what a busy computer does in a moment.
pub const PATIENCE: Duration = Duration::from_secs(60);

pub fn answer(host: &str, request: &str) -> String {
    let mut stream = TcpStream::connect(host).expect("listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    // One that is sent away need not take all of it.
    let _ = stream.write_all(request.as_bytes());
    let mut bytes = vec![0; 1 << 16];
    let count = stream.read(&mut bytes).unwrap_or(0);
    String::from_utf8_lossy(&bytes[..count]).into_owned()
}

pub fn socket_request(token: &str, named: &str, origin: &str) -> String {
    format!(
        "GET /socket?token={token} HTTP/1.1\r\nHost: {named}\r\n{origin}Connection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
}

#[test]
fn without_its_token_its_host_or_its_origin_nothing_is_answered() {
    let folder = temporary();
    let served = Served::scene("tension", &[], folder.path());
    let (host, token) = served.parts();
    let page = |token: &str, named: &str, more: &str| {
        answer(&host, &format!("GET /?token={token} HTTP/1.1\r\nHost: {named}\r\n{more}\r\n"))
    };
    let whole = page(&token, &host, "");
    assert!(whole.starts_with("HTTP/1.1 200") && whole.contains("frame-ancestors 'none'"), "{whole:.300}");
    let wrong = "0".repeat(32);
    let refused = [
        page("", &host, ""),
        page(&wrong, &host, ""),
        page(&token[..31], &host, ""),
        page(&token, "evil.example:80", ""),
        page(&token, "127.0.0.1", ""),
        page(&token, &host, "Origin: http://evil.example\r\n"),
        answer(&host, &socket_request(&token, &host, "")),
        answer(&host, &socket_request(&token, &host, "Origin: http://evil.example\r\n")),
        answer(&host, &socket_request(&wrong, &host, &format!("Origin: http://{host}\r\n"))),
        answer(&host, &socket_request(&token, "evil.example", &format!("Origin: http://{host}\r\n"))),
    ];
    for (n, refusal) in refused.iter().enumerate() {
        assert!(refusal.starts_with("HTTP/1.1 403"), "{n}: {refusal:.200}");
        assert!(!refusal.contains(&token), "{n}");
    }
    let let_in = answer(&host, &socket_request(&token, &host, &format!("Origin: http://{host}\r\n")));
    assert!(
        let_in.starts_with("HTTP/1.1 101") && let_in.contains("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="),
        "{let_in:.200}"
    );
    assert!(page(&token, &host, "").starts_with("HTTP/1.1 200"), "served as before");
}

#[test]
fn floods_garbage_and_slow_readers_do_not_stop_the_session() {
    let folder = temporary();
    let served = Served::scene("tension", &[], folder.path());
    let (host, token) = served.parts();
    let connect = || TcpStream::connect(&host).expect("listens");
    let garbage: Vec<TcpStream> = (0..40)
        .map(|n| {
            let mut stream = connect();
            let _ = stream.write_all(if n % 2 == 0 { b"\x16\x03\x01\x02" } else { b"GET / HTTP/1.1\r\nX: " });
            stream
        })
        .collect();
    drop(garbage);
    let mut endless = connect();
    let begun = Instant::now();
    while endless.write_all(&[b'a'; 4096]).is_ok() && begun.elapsed() < PATIENCE {}
    assert!(begun.elapsed() < PATIENCE, "an endless head is cut off");
    // One that plays and never reads a byte of what it is sent.
    let asks = socket_request(&token, &host, &format!("Origin: http://{host}\r\n"));
    let mut deaf = let_in(&host, &asks);
    deaf.write_all(&masked(br#"{"do":"play"}"#)).expect("takes a request");
    // Longer than a request may be: this one is sent away.
    let mut long = let_in(&host, &asks);
    let _ = long.write_all(&masked(&[b'x'; 6000]));
    let mut rest = Vec::new();
    let ended = long.read_to_end(&mut rest);
    assert!(ended.is_ok() || ended.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset));
    let page = format!("GET /?token={token} HTTP/1.1\r\nHost: {host}\r\n\r\n");
    soon("pages are served as before", || answer(&host, &page).starts_with("HTTP/1.1 200"));
    // The session itself still does what it is asked.
    let mut other = let_in(&host, &asks);
    other.write_all(&masked(br#"{"do":"save"}"#)).expect("takes a request");
    let saved = folder.path().join("tension_live.toml");
    soon("the session saves", || saved.exists());
}

/// Waits until something holds.
pub fn soon(what: &str, holds: impl Fn() -> bool) {
    within(PATIENCE, what, || holds().then_some(()));
}

/// A socket that is let in, if need be once others have gone.
pub fn let_in(host: &str, asks: &str) -> TcpStream {
    within(PATIENCE, "a socket that is let in", || try_let_in(host, asks).ok())
}

fn try_let_in(host: &str, asks: &str) -> std::io::Result<TcpStream> {
    let mut stream = TcpStream::connect(host)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.write_all(asks.as_bytes())?;
    let mut head = [0; 12];
    stream.read_exact(&mut head)?;
    if head.ends_with(b"101") { Ok(stream) } else { Err(std::io::Error::other("sent away")) }
}

/// A text frame of a client.
pub fn masked(text: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x81];
    match text.len() {
        short @ ..126 => frame.push(0x80 | short as u8),
        long => {
            frame.push(0x80 | 126);
            frame.extend((long as u16).to_be_bytes());
        }
    }
    frame.extend([0; 4]);
    frame.extend(text);
    frame
}
