//! The places at which participants on Fast DDS take packets, as they announce them: for what is sent beside RustDDS.

use std::collections::BTreeMap;
use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ros2_client::dds::rustdds::GUID;
use socket2::{Domain, Protocol, Socket, Type};

use super::graph::prefix;
use super::packet::{Announcement, MULTICAST, PARTICIPANTS, announced, discovery_port, participant_port};

/// How prefixes of Fast DDS begin: the number of its vendor.
const FAST_DDS: [u8; 2] = [0x01, 0x0f];

/// Participants whose places are kept, and announcements read in one look.
const MOST_KNOWN: usize = 1024;
const MOST_AT_ONCE: usize = 256;

/// Places of a participant that are used.
const MOST_PLACES: usize = 8;

/// Whether this is the prefix of a participant on Fast DDS.
pub fn is_fast_dds(prefix: [u8; 12]) -> bool {
    prefix[..2] == FAST_DDS
}

pub struct Places {
    own: [u8; 12],
    domain: u16,
    out: UdpSocket,
    /// Where participants announce themselves; none where packets stay on this computer.
    announcements: Option<Socket>,
    known: Mutex<BTreeMap<[u8; 12], Announcement>>,
}

impl Places {
    pub fn open(own: GUID, domain: u16, loopback_only: bool) -> io::Result<Self> {
        let device = if loopback_only { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
        let out = UdpSocket::bind((device, 0))?;
        out.set_nonblocking(true)?;
        let announcements = if loopback_only { None } else { Some(listen(domain)?) };
        Ok(Self { own: prefix(own), domain, out, announcements, known: Mutex::default() })
    }

    /// Prefix of the own participant.
    pub fn own(&self) -> [u8; 12] {
        self.own
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<[u8; 12], Announcement>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the announcements that have come.
    pub fn listen(&self) {
        let Some(socket) = &self.announcements else { return };
        let mut buffer = [0; 4096];
        for _ in 0..MOST_AT_ONCE {
            let Ok(length) = io::Read::read(&mut &*socket, &mut buffer) else { return };
            let Some(mut announced) = announced(&buffer[..length]) else { continue };
            announced.samples.truncate(MOST_PLACES);
            announced.discovery.truncate(MOST_PLACES);
            if announced.samples.is_empty() || !is_fast_dds(announced.from) {
                continue;
            }
            let mut known = self.known();
            if known.len() >= MOST_KNOWN {
                known.clear();
            }
            known.insert(announced.from, announced);
        }
    }

    /// Sends a packet to where a participant takes samples: to the usual ports of this computer where no announcement of
    /// it came.
    pub fn send(&self, to: [u8; 12], packet: &[u8]) {
        let send = |place: SocketAddrV4| _ = self.out.send_to(packet, place);
        let known = self.known().get(&to).map(|announced| announced.samples.clone());
        match known {
            Some(places) => places.into_iter().for_each(send),
            None => {
                let ports = (0..PARTICIPANTS).filter_map(|one| participant_port(self.domain, one));
                ports.map(|port| SocketAddrV4::new(Ipv4Addr::LOCALHOST, port)).for_each(send);
            }
        }
    }

    /// The places at which known participants take announcements.
    pub fn discovery(&self) -> Vec<SocketAddrV4> {
        self.known().values().flat_map(|announced| announced.discovery.clone()).collect()
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
    // Without a device that carries multicast those of this computer are asked at their usual ports.
    for device in [Ipv4Addr::UNSPECIFIED, Ipv4Addr::LOCALHOST] {
        let _ = socket.join_multicast_v4(&MULTICAST, &device);
    }
    Ok(socket)
}
