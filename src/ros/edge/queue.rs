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
use super::packet::{discovery_port, empty};

/// Bytes of a packet by which it is told from the next \[B\].
const HEAD: usize = 256;

/// The queue and what was last seen of it.
pub struct Queue {
    socket: UdpSocket,
    to: SocketAddr,
    /// The middleware's socket; never read from.
    theirs: UdpSocket,
    packet: Vec<u8>,
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
        Self::of(port, empty(prefix(participant.guid()))).map_err(refused)
    }

    fn of(port: u16, packet: Vec<u8>) -> std::io::Result<Self> {
        let theirs = door::listener(port)?;
        theirs.set_nonblocking(true)?;
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        let to = (Ipv4Addr::LOCALHOST, port).into();
        Ok(Self { socket, to, theirs, packet, is_awaited: false, first: None })
    }

    pub fn send(&mut self) {
        // One that is not sent proves nothing.
        self.is_awaited |= self.socket.send_to(&self.packet, self.to).is_ok();
    }

    /// Whether a packet has been taken since the last one that was sent after the last proof.
    pub fn is_taken(&mut self) -> bool {
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
    use super::*;

    #[test]
    fn only_a_queue_that_is_worked_off_proves_that_somebody_listens() {
        let theirs = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        let port = theirs.local_addr().expect("bound").port();
        let mut queue = Queue::of(port, empty([7; 12])).expect("a socket of this process");
        assert!(!queue.is_taken(), "nothing was sent");
        let mut packet = [0; 100];
        let mut take = || theirs.recv(&mut packet).expect("a packet");
        queue.send();
        assert!(!queue.is_taken() && !queue.is_taken(), "it lies there");
        assert_eq!(take(), 20);
        assert!(queue.is_taken());
        assert!(!queue.is_taken(), "one packet, one proof");

        let stranger = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        (0..3).for_each(|k| drop(stranger.send_to(&[k; 30], (Ipv4Addr::LOCALHOST, port))));
        queue.send();
        assert!(!queue.is_taken() && !queue.is_taken(), "the stranger's lie there");
        take();
        assert!(queue.is_taken(), "the first is another");
    }
}
