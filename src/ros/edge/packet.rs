//! RTPS packets that we write ourselves, for what the middleware leaves unsaid, and the ports that they go to.

/// What follows the head of a DATA submessage.
pub enum Content<'a> {
    /// Serialised, encapsulation included.
    Payload(&'a [u8]),
    /// A list of parameters with its end, and no payload.
    InlineQos(&'a [u8]),
}

/// An RTPS message of one DATA submessage, little endian, from a writer to a reader of the participant of this prefix
/// (RTPS 2.3, sections 9.4.4 and 9.4.5.3).
pub fn data(prefix: [u8; 12], [writer, reader]: [[u8; 4]; 2], number: u32, content: &Content<'_>) -> Vec<u8> {
    let (flags, content) = match content {
        Content::Payload(content) => (0x05, *content),
        Content::InlineQos(content) => (0x03, *content),
    };
    let mut packet = head(prefix);
    packet.extend([0x15, flags]);
    packet.extend((20 + content.len() as u16).to_le_bytes());
    // No more flags; inline QoS or payload begin 16 bytes on.
    packet.extend([0, 0, 16, 0]);
    packet.extend(reader);
    packet.extend(writer);
    packet.extend([0; 4]);
    packet.extend(number.to_le_bytes());
    packet.extend(content);
    packet
}

/// An RTPS message of one PAD submessage, which means nothing, with a number in it (RTPS 2.3, section 8.3.7.11).
#[cfg(any(test, feature = "security"))]
pub fn numbered(prefix: [u8; 12], number: u32) -> Vec<u8> {
    [&head(prefix)[..], &[0x01, 0x01, 4, 0], &number.to_le_bytes()].concat()
}

fn head(prefix: [u8; 12]) -> Vec<u8> {
    [&b"RTPS\x02\x03\x01\x12"[..], &prefix].concat()
}

/// The port at which all participants of a domain hear of each other by multicast, or, of one participant, by unicast
/// (RTPS 2.3, section 9.6.1); none beyond the last port that there is.
pub fn discovery_port(domain: u16, participant: Option<u16>) -> Option<u16> {
    let first = 7400 + 250 * u32::from(domain);
    let port = participant.map_or(first, |participant| first + 10 + 2 * u32::from(participant));
    u16::try_from(port).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_length_of_the_submessage_is_that_of_what_follows_it() {
        let packet = data([7; 12], [[1; 4], [2; 4]], 9, &Content::InlineQos(&[5; 36]));
        let length = u16::from_le_bytes([packet[22], packet[23]]);
        assert_eq!(usize::from(length), packet.len() - 24);
        assert_eq!((packet.len() % 4, packet[40]), (0, 9));
    }

    #[test]
    fn ports_are_those_of_the_standard_s_defaults() {
        assert_eq!(discovery_port(0, None), Some(7400));
        assert_eq!(discovery_port(1, Some(3)), Some(7666));
        assert_eq!(discovery_port(233, None), None);
    }
}
