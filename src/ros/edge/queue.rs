//! Whether the middleware takes packets from its socket, whatever becomes of them then.
//!
//! A packet of our own is sent to the port where a participant hears of others. Once the queue of that socket is empty,
//! or another packet is first in it, the thread that receives has come round; what it took before it has worked off.
//! No key is needed for that.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

use ros2_client::dds::rustdds::{DomainParticipant, RTPSEntity};

use super::EdgeError;
use super::door;
use super::graph::prefix;
use super::packet::{discovery_port, numbered};

/// Bytes of a packet that distinguish it from the next \[B\].
const HEAD: usize = 256;

/// The queue and what was last seen of it.
pub struct Queue {
    socket: UdpSocket,
    to: SocketAddr,
    /// The middleware's socket; never read from.
    theirs: UdpSocket,
    prefix: [u8; 12],
    /// Whether something was sent since the last proof.
    is_awaited: bool,
    first: Option<(SocketAddr, Vec<u8>)>,
}

impl Queue {
    pub fn open(participant: &DomainParticipant) -> Result<Self, EdgeError> {
        let refused = |error: std::io::Error| EdgeError::Endpoint {
            topic: "queue of packets".into(),
            reason: error.to_string(),
        };
        let port = discovery_port(participant.domain_id(), Some(participant.participant_id()));
        let port = port.ok_or_else(|| refused(std::io::Error::other("no port is left for this domain")))?;
        Self::of(port, prefix(participant.guid())).map_err(refused)
    }

    fn of(port: u16, prefix: [u8; 12]) -> std::io::Result<Self> {
        let theirs = door::listener(port)?;
        theirs.set_nonblocking(true)?;
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        let to = (Ipv4Addr::LOCALHOST, port).into();
        Ok(Self { socket, to, theirs, prefix, is_awaited: false, first: None })
    }

    /// Sends the packet of this number: with equal ones a queue of several would seem to stand still.
    pub fn send(&mut self, number: u32) {
        // One that is not sent proves nothing.
        self.is_awaited |= self.socket.send_to(&numbered(self.prefix, number), self.to).is_ok();
    }

    /// Whether a packet has been taken since the last one that was sent after the last proof.
    pub(crate) fn is_taken(&mut self) -> bool {
        let mut head = [0; HEAD];
        let now = match self.theirs.peek_from(&mut head) {
            Ok((length, from)) => Some((from, head[..length].to_vec())),
            Err(error) if error.kind() == ErrorKind::WouldBlock => None,
            // An error of an earlier packet, which the call takes away.
            Err(_) => return false,
        };
        let has_moved = now.is_none() || (self.first.is_some() && now != self.first);
        self.first = now;
        std::mem::take(&mut self.is_awaited) && {
            self.is_awaited = !has_moved;
            has_moved
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    /// Waits until this many bytes are first in the queue.
    fn wait_for(theirs: &UdpSocket, bytes: usize) {
        let since = Instant::now();
        while !theirs.peek(&mut [0; 100]).is_ok_and(|length| length == bytes) {
            assert!(since.elapsed() < Duration::from_secs(5), "no packet of {bytes} bytes has arrived");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn only_a_queue_that_is_worked_off_proves_that_somebody_listens() {
        let theirs = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        let port = theirs.local_addr().expect("bound").port();
        let mut queue = Queue::of(port, [7; 12]).expect("a socket of this process");
        let take = || {
            wait_for(&theirs, 28);
            assert_eq!(theirs.recv(&mut [0; 100]).expect("a packet"), 28);
        };
        assert!(!queue.is_taken(), "nothing was sent");
        queue.send(1);
        wait_for(&theirs, 28);
        assert!(!queue.is_taken() && !queue.is_taken(), "it lies there");
        take();
        assert!(queue.is_taken());
        assert!(!queue.is_taken(), "one packet, one proof");

        (2..5).for_each(|number| queue.send(number));
        wait_for(&theirs, 28);
        assert!(!queue.is_taken() && !queue.is_taken(), "the first of three lies there");
        take();
        assert!(queue.is_taken(), "the first is another");
        (0..2).for_each(|_| take());
        assert!(!queue.is_taken(), "nothing was sent since");

        let stranger = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        stranger.send_to(&[0; 30], (Ipv4Addr::LOCALHOST, port)).expect("sent");
        wait_for(&theirs, 30);
        queue.send(5);
        assert!(!queue.is_taken() && !queue.is_taken(), "the stranger's lies there");
        theirs.recv(&mut [0; 100]).expect("the stranger's");
        take();
        assert!(queue.is_taken());
    }
}
