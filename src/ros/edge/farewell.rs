//! The leave of a participant, said so that Fast DDS takes it.
//!
//! RustDDS disposes its participant without the key hash that Fast DDS asks for, which then keeps it in its graph until the lease runs
//! out, 50 s later (`.github/upstream.md`). The same is said here once more, with the hash: in a packet to those ports at which
//! participants hear of others.

use std::io;
use std::net::{Ipv4Addr, UdpSocket};

use socket2::SockRef;

/// Where participants listen for others (RTPS 2.3, section 9.6.1).
const MULTICAST: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// Participants of this computer that get a packet each: RustDDS takes as many ports.
const PARTICIPANTS: u16 = 120;

/// Says that the participant of this prefix has left. What is not sent is not missed: leases run out.
pub fn say(prefix: [u8; 12], domain: u16, loopback_only: bool) {
    let packet = packet(prefix);
    let Some(port) = 250_u16.checked_mul(domain).and_then(|first| first.checked_add(7400)) else { return };
    let send = || -> io::Result<()> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        for participant in 0..PARTICIPANTS {
            if let Some(port) = port.checked_add(10 + 2 * participant) {
                let _ = socket.send_to(&packet, (Ipv4Addr::LOCALHOST, port));
            }
        }
        // By the device that the system takes for others, and by that for itself.
        for device in [Ipv4Addr::UNSPECIFIED, Ipv4Addr::LOCALHOST] {
            if loopback_only && !device.is_loopback() {
                continue;
            }
            SockRef::from(&socket).set_multicast_if_v4(&device)?;
            let _ = socket.send_to(&packet, (MULTICAST, port));
        }
        Ok(())
    };
    if let Err(error) = send() {
        tracing::debug!("others hear of our leaving from the middleware alone: {error}");
    }
}

/// An RTPS message of one DATA submessage without payload: the participant is disposed and unregistered (RTPS 2.3, sections
/// 9.4.5.3, 9.6.3.8 and 9.6.3.9).
fn packet(prefix: [u8; 12]) -> Vec<u8> {
    const PARTICIPANT: [u8; 4] = [0, 0, 1, 0xc1];
    const ANNOUNCER: [u8; 4] = [0, 1, 0, 0xc2];
    const ANNOUNCEMENTS: [u8; 4] = [0, 1, 0, 0xc7];
    let mut packet = Vec::from(*b"RTPS\x02\x03\x01\x12");
    packet.extend(prefix);
    // DATA, little endian, with inline QoS 16 bytes on; its length.
    packet.extend([0x15, 0x03, 52, 0, 0, 0, 16, 0]);
    packet.extend(ANNOUNCEMENTS);
    packet.extend(ANNOUNCER);
    // Later than any announcement.
    packet.extend(0_i32.to_le_bytes());
    packet.extend(i32::MAX.to_le_bytes());
    // PID_KEY_HASH: of a participant its GUID.
    packet.extend([0x70, 0, 16, 0]);
    packet.extend(prefix);
    packet.extend(PARTICIPANT);
    // PID_STATUS_INFO, and the end of the list.
    packet.extend([0x71, 0, 4, 0, 0, 0, 0, 3]);
    packet.extend([1, 0, 0, 0]);
    packet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_length_of_the_submessage_is_that_of_what_follows_it() {
        let packet = packet([7; 12]);
        let length = u16::from_le_bytes([packet[22], packet[23]]);
        assert_eq!(usize::from(length), packet.len() - 24);
        assert_eq!(packet.len() % 4, 0);
    }
}
