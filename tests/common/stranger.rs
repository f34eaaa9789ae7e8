//! A process without keys that sends what no participant would.

use std::net::{Ipv4Addr, UdpSocket};

/// The port where a participant hears of others, by its number on this computer.
pub fn port(domain: u16, participant: u16) -> u16 {
    7410 + 250 * domain + 2 * participant
}

/// A listener, in a place where participants look for others on this computer.
pub struct Stranger {
    pub socket: UdpSocket,
    pub prefixes: Vec<[u8; 12]>,
    /// Some that came.
    pub packets: Vec<Vec<u8>>,
    count: i32,
    /// Whose name it does not take: who is to judge has to hear.
    spared: Option<[u8; 12]>,
}

impl Stranger {
    pub fn come(domain: u16) -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, port(domain, 9))).expect("a free port");
        socket.set_nonblocking(true).expect("a socket");
        Self { socket, prefixes: Vec::new(), packets: Vec::new(), count: 1 << 20, spared: None }
    }

    /// Takes this name no more.
    pub fn spare(&mut self, prefix: [u8; 12]) {
        self.spared = Some(prefix);
        self.prefixes.retain(|one| *one != prefix);
        self.packets.retain(|packet| packet[8..20] != prefix);
    }

    /// The participants it has heard of.
    pub fn listen(&mut self) {
        let mut packet = [0; 65_536];
        while let Ok(length) = self.socket.recv(&mut packet) {
            let Some(prefix) = packet[..length].get(8..20).and_then(|bytes| bytes.try_into().ok()) else {
                continue;
            };
            if self.spared == Some(prefix) {
                continue;
            }
            if self.packets.len() < 16 {
                self.packets.push(packet[..length].to_vec());
            }
            if !self.prefixes.contains(&prefix) {
                self.prefixes.push(prefix);
            }
        }
    }

    /// A heartbeat in the name of a participant, which promises more than any memory holds.
    pub fn promise(&mut self, prefix: [u8; 12]) -> Vec<u8> {
        self.count += 1;
        let mut packet = Vec::from(*b"RTPS\x02\x03\x01\x12");
        packet.extend(prefix);
        packet.extend([0x07, 0x01, 28, 0]);
        packet.extend([0, 0, 3, 0xc7, 0, 0, 3, 0xc2]);
        // Numbers are a high word and a low one: 1, and 2^62.
        for word in [0, 1, 1 << 30, 0, self.count] {
            packet.extend(i32::to_le_bytes(word));
        }
        assert_eq!(packet.len(), 52);
        packet
    }

    pub fn send(&self, packet: &[u8], port: u16) {
        // A port that nobody has is as good as one that does not answer.
        let _ = self.socket.send_to(packet, (Ipv4Addr::LOCALHOST, port));
    }
}

/// A promise behind so many empty submessages that the socket filter does not look at it.
pub fn hidden(packet: &[u8]) -> Vec<u8> {
    [&packet[..20], &[1, 1, 0, 0].repeat(32), &packet[20..]].concat()
}
