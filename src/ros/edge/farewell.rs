//! The leave of a participant, said so that Fast DDS takes it.
//!
//! RustDDS disposes its participant without the key hash that Fast DDS asks for, which then keeps it in its graph until the lease runs
//! out, 50 s later (`.github/upstream.md`). The same is sent here once more, with the hash: in a packet to those ports at which
//! participants take announcements.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};

use socket2::SockRef;

use super::packet::{ANNOUNCER, Content, MULTICAST, PARTICIPANTS, data, discovery_port};

/// Announces that the participant of this prefix has left: to all of this computer and, where multicast is not carried, to those
/// that are known by their places. What does not arrive is made up for by the lease.
pub fn send(prefix: [u8; 12], domain: u16, loopback_only: bool, places: &[SocketAddrV4]) {
    let packet = packet(prefix);
    let Some(common) = discovery_port(domain, None) else { return };
    let send = || -> io::Result<()> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        for participant in 0..PARTICIPANTS {
            if let Some(port) = discovery_port(domain, Some(participant)) {
                let _ = socket.send_to(&packet, (Ipv4Addr::LOCALHOST, port));
            }
        }
        places.iter().for_each(|place| _ = socket.send_to(&packet, place));
        // By the device that the system takes for others, and by that for itself.
        for device in [Ipv4Addr::UNSPECIFIED, Ipv4Addr::LOCALHOST] {
            if loopback_only && !device.is_loopback() {
                continue;
            }
            SockRef::from(&socket).set_multicast_if_v4(&device)?;
            let _ = socket.send_to(&packet, (MULTICAST, common));
        }
        Ok(())
    };
    if let Err(error) = send() {
        tracing::debug!("others hear of our leaving from the middleware alone: {error}");
    }
}

/// The participant is disposed and unregistered (RTPS 2.3, sections 9.6.3.8 and 9.6.3.9).
fn packet(prefix: [u8; 12]) -> Vec<u8> {
    const PARTICIPANT: [u8; 4] = [0, 0, 1, 0xc1];
    const ANNOUNCEMENTS: [u8; 4] = [0, 1, 0, 0xc7];
    // PID_KEY_HASH: of a participant its GUID.
    let mut parameters = vec![0x70, 0, 16, 0];
    parameters.extend(prefix);
    parameters.extend(PARTICIPANT);
    // PID_STATUS_INFO, and the end of the list.
    parameters.extend([0x71, 0, 4, 0, 0, 0, 0, 3]);
    parameters.extend([1, 0, 0, 0]);
    // Later than any announcement.
    let number = i32::MAX as u32;
    data(prefix, [ANNOUNCER, ANNOUNCEMENTS], number, &Content::InlineQos(&parameters))
}
