//! Requests for what a client on Fast DDS sent before the middleware knew its writer.
//!
//! RustDDS drops samples of writers that it has not matched. Its own request after the match has Fast DDS wait for its
//! next heartbeat, and the first call of a service take 3 s (`.github/upstream.md`). Here the first sample is asked for by its
//! number, at the places that the client's participant announces.

use std::collections::BTreeMap;
use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};

use ros2_client::dds::rustdds::GUID;
use socket2::{Domain, Protocol, Socket, Type};

use super::graph::{entity, prefix};
use super::packet::{
    MULTICAST, PARTICIPANTS, announced_at, discovery_port, first_sample_wanted, participant_port,
};

/// How prefixes of Fast DDS begin: the number of its vendor.
const FAST_DDS: [u8; 2] = [0x01, 0x0f];

/// Participants whose places are kept, and announcements read in one look.
const MOST_KNOWN: usize = 1024;
const MOST_AT_ONCE: usize = 256;

/// Places of a participant that are used.
const MOST_PLACES: usize = 8;

pub(super) struct Nudge {
    own: [u8; 12],
    domain: u16,
    out: UdpSocket,
    /// Where participants announce themselves; none where this computer alone is asked.
    announcements: Option<Socket>,
    places: BTreeMap<[u8; 12], Vec<SocketAddrV4>>,
}

impl Nudge {
    pub fn open(own: GUID, domain: u16, loopback_only: bool) -> io::Result<Self> {
        let device = if loopback_only { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
        let out = UdpSocket::bind((device, 0))?;
        out.set_nonblocking(true)?;
        let announcements = if loopback_only { None } else { Some(listen(domain)?) };
        Ok(Self { own: prefix(own), domain, out, announcements, places: BTreeMap::new() })
    }

    /// Reads the announcements that have come.
    pub fn listen(&mut self) {
        let Some(socket) = &self.announcements else { return };
        let mut buffer = [0; 4096];
        for _ in 0..MOST_AT_ONCE {
            let Ok(length) = io::Read::read(&mut &*socket, &mut buffer) else { return };
            let Some((from, mut places)) = announced_at(&buffer[..length]) else { continue };
            places.truncate(MOST_PLACES);
            if places.is_empty() || from[..2] != FAST_DDS {
                continue;
            }
            if self.places.len() >= MOST_KNOWN {
                self.places.clear();
            }
            self.places.insert(from, places);
        }
    }

    /// Asks a writer that has just been matched for its first sample.
    pub fn ask(&self, reader: GUID, writer: GUID) {
        /// In the last byte of an entity: one of the middleware's own.
        const BUILT_IN: u8 = 0xc0;
        let to = prefix(writer);
        if to[..2] != FAST_DDS || entity(reader)[3] & BUILT_IN != 0 {
            return;
        }
        let packet = first_sample_wanted(self.own, entity(reader), to, entity(writer));
        match self.places.get(&to) {
            Some(places) => places.iter().for_each(|place| _ = self.out.send_to(&packet, place)),
            None => {
                let ports =
                    (0..PARTICIPANTS).filter_map(|participant| participant_port(self.domain, participant));
                ports.for_each(|port| _ = self.out.send_to(&packet, (Ipv4Addr::LOCALHOST, port)));
            }
        }
    }
}

/// A socket beside the middleware's own at the port where participants announce themselves.
fn listen(domain: u16) -> io::Result<Socket> {
    let port = discovery_port(domain, None).ok_or(io::ErrorKind::InvalidInput)?;
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    #[cfg(unix)]
    socket.set_reuse_port(true)?;
    socket.set_nonblocking(true)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port).into())?;
    socket.join_multicast_v4(&MULTICAST, &Ipv4Addr::UNSPECIFIED)?;
    // Without a device that carries multicast those of this computer are asked at their usual ports.
    let _ = socket.join_multicast_v4(&MULTICAST, &Ipv4Addr::LOCALHOST);
    Ok(socket)
}
