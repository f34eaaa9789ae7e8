//! A browser's request: its first lines alone, bounded in size and time.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Longest head of a request \[byte\].
const MOST_HEAD: usize = 8 << 10;
const MOST_HEADERS: usize = 64;
/// How long a browser may take to ask.
const PATIENCE: Duration = Duration::from_secs(5);

/// The request of a browser.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Asked {
    pub path: String,
    pub token: String,
    pub host: String,
    pub origin: Option<String>,
    /// Of a WebSocket.
    pub key: Option<String>,
}

/// Reads the head of a request.
///
/// # Errors
/// A request that is none, too long, or too slow.
pub(super) fn read(stream: &mut TcpStream) -> io::Result<Asked> {
    let end = Instant::now() + PATIENCE;
    let mut head = Vec::new();
    let mut part = [0; 1024];
    while !head.windows(4).any(|four| four == b"\r\n\r\n") {
        let left = end.saturating_duration_since(Instant::now());
        let room = part.len().min(MOST_HEAD - head.len());
        if left.is_zero() || room == 0 {
            return Err(io::ErrorKind::InvalidData.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut part[..room])? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => head.extend_from_slice(&part[..count]),
        }
    }
    parse(&head).ok_or_else(|| io::ErrorKind::InvalidData.into())
}

fn parse(head: &[u8]) -> Option<Asked> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    request.parse(head).ok().filter(httparse::Status::is_complete)?;
    let value = |name: &str| -> Option<Option<&str>> {
        let mut named = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
        let first = named.next().map(|header| std::str::from_utf8(header.value)).transpose().ok()?;
        // Two of one name are two answers to the same question.
        named.next().is_none().then_some(first)
    };
    if request.method != Some("GET") {
        return None;
    }
    let (path, query) = request.path?.split_once('?').unwrap_or((request.path?, ""));
    let token = query.split('&').find_map(|pair| pair.strip_prefix("token=")).unwrap_or_default();
    let is_socket = value("upgrade")?.is_some_and(|to| to.eq_ignore_ascii_case("websocket"));
    Some(Asked {
        path: path.to_owned(),
        token: token.to_owned(),
        host: value("host")??.to_owned(),
        origin: value("origin")?.map(str::to_owned),
        key: value("sec-websocket-key")?.filter(|_| is_socket).map(str::to_owned),
    })
}

/// Answers with a page or a refusal, and ends.
pub(super) fn answer(stream: &mut TcpStream, status: &str, body: &str, origin: &str) -> io::Result<()> {
    let kind = if status.starts_with("200") { "text/html" } else { "text/plain" };
    // The page needs its own scripts and this socket; nothing else may be asked for from it.
    let socket = origin.replace("http://", "ws://");
    let policy = format!(
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; \
         connect-src {socket}; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    );
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nContent-Security-Policy: {policy}\r\n\r\n",
        body.len()
    );
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.write_all(head.as_bytes())?;
    stream.write_all(body.as_bytes())?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_read_and_a_doubtful_one_is_none() {
        let head = b"GET /socket?token=abc HTTP/1.1\r\nHost: 127.0.0.1:1\r\nUpgrade: websocket\r\nSec-WebSocket-Key: k\r\nOrigin: o\r\n\r\n";
        let asked = parse(head).expect("a request");
        assert_eq!(
            (asked.path.as_str(), asked.token.as_str(), asked.host.as_str()),
            ("/socket", "abc", "127.0.0.1:1")
        );
        assert_eq!((asked.key.as_deref(), asked.origin.as_deref()), (Some("k"), Some("o")));
        let doubtful: [&[u8]; 5] = [
            b"POST / HTTP/1.1\r\nHost: a\r\n\r\n",
            b"GET / HTTP/1.1\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: \xff\r\n\r\n",
            b"\x16\x03\x01\r\n\r\n",
        ];
        assert!(doubtful.iter().all(|head| parse(head).is_none()));
    }
}
