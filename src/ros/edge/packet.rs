//! RTPS packets that we write ourselves, for what the middleware leaves unsaid, and the ports that they go to.

use std::net::{Ipv4Addr, SocketAddrV4};

/// Where participants listen for others (RTPS 2.3, section 9.6.1).
pub const MULTICAST: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// Participants of this computer that are looked for: RustDDS takes as many ports.
pub const PARTICIPANTS: u16 = 120;

/// The end that announces a participant.
pub const ANNOUNCER: [u8; 4] = [0, 1, 0, 0xc2];

/// The part behind the head of a DATA submessage.
pub enum Content<'a> {
    /// Serialised, encapsulation included.
    Payload(&'a [u8]),
    /// A list of parameters with its end, and no payload.
    InlineQos(&'a [u8]),
    /// The one before the other.
    Both { inline_qos: &'a [u8], payload: &'a [u8] },
}

/// An RTPS message of one DATA submessage, little endian, from a writer to a reader of the participant of this prefix
/// (RTPS 2.3, sections 9.4.4 and 9.4.5.3).
pub fn data(prefix: [u8; 12], [writer, reader]: [[u8; 4]; 2], number: u32, content: &Content<'_>) -> Vec<u8> {
    let (flags, content) = match content {
        Content::Payload(content) => (0x05, [*content, &[]]),
        Content::InlineQos(content) => (0x03, [*content, &[]]),
        Content::Both { inline_qos, payload } => (0x07, [*inline_qos, *payload]),
    };
    let content = content.concat();
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

/// Inline QoS of a reply: the request of this reader or writer and number that it answers, under the two identifiers by which
/// DDS programs know it, as RustDDS writes them.
pub fn related_to(guid: [u8; 16], number: i64) -> Vec<u8> {
    const RELATED_SAMPLE_IDENTITY: [u16; 2] = [0x0083, 0x800f];
    const END: [u8; 4] = [1, 0, 0, 0];
    let number = number.cast_unsigned();
    let halves = [(number >> 32) as u32, number as u32].map(u32::to_le_bytes).concat();
    let one = |kind: u16| [&kind.to_le_bytes()[..], &[24, 0], &guid, &halves].concat();
    [&RELATED_SAMPLE_IDENTITY.map(one).concat()[..], &END].concat()
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

/// The port at which a participant takes samples by unicast (RTPS 2.3, section 9.6.1).
pub fn participant_port(domain: u16, participant: u16) -> Option<u16> {
    discovery_port(domain, Some(participant))?.checked_add(1)
}

/// An ACKNACK that asks a writer for its first sample, and for no heartbeat (RTPS 2.3, sections 9.4.5.2 and 9.4.5.8). A writer
/// takes one whose count is larger than that of the last: the middleware counts its own from 0.
pub fn first_sample_wanted(
    own: [u8; 12],
    reader: [u8; 4],
    to: [u8; 12],
    writer: [u8; 4],
    count: u32,
) -> Vec<u8> {
    let mut packet = head(own);
    packet.extend([0x0e, 0x01, 12, 0]);
    packet.extend(to);
    packet.extend([0x06, 0x03, 28, 0]);
    packet.extend(reader);
    packet.extend(writer);
    // One number from 1 on, and it is wanted.
    for word in [0, 1, 1, 1 << 31, count] {
        packet.extend(u32::to_le_bytes(word));
    }
    packet
}

/// A participant and the places at which it takes packets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Announcement {
    pub from: [u8; 12],
    pub samples: Vec<SocketAddrV4>,
    pub discovery: Vec<SocketAddrV4>,
}

/// The participant that a packet announces; `None` of every other packet (RTPS 2.3, sections 9.4.5.3 and 9.6.2.2).
pub fn announced(packet: &[u8]) -> Option<Announcement> {
    const METATRAFFIC_UNICAST_LOCATOR: u16 = 0x32;
    const DEFAULT_UNICAST_LOCATOR: u16 = 0x31;
    const DATA: u8 = 0x15;
    const WITH_INLINE_QOS: u8 = 0x02;
    const WITH_PAYLOAD: u8 = 0x04;
    let (head, mut rest) = packet.split_at_checked(20)?;
    let from: [u8; 12] = head.strip_prefix(b"RTPS")?.get(4..)?.try_into().ok()?;
    while let Some((&[kind, flags, a, b], after)) = rest.split_first_chunk::<4>() {
        let bytes = [a, b];
        let length = if flags & 1 == 1 { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) };
        // The last one may leave its length out.
        let length = if length == 0 { after.len() } else { usize::from(length) };
        let (body, next) = after.split_at_checked(length)?;
        if kind == DATA && flags & WITH_PAYLOAD != 0 && body.get(8..12)? == ANNOUNCER {
            let mut payload = body.get(20..)?;
            if flags & WITH_INLINE_QOS != 0 {
                while Parameter::take(&mut payload, flags & 1 == 1).is_some() {}
            }
            let [samples, discovery] =
                [DEFAULT_UNICAST_LOCATOR, METATRAFFIC_UNICAST_LOCATOR].map(|kind| places(payload, kind));
            return Some(Announcement { from, samples, discovery });
        }
        rest = next;
    }
    None
}

/// One of a list of parameters (RTPS 2.3, section 9.4.2.11).
struct Parameter<'a> {
    kind: u16,
    value: &'a [u8],
}

impl<'a> Parameter<'a> {
    /// Takes the next one; `None` after the last, whose end is taken too.
    fn take(list: &mut &'a [u8], is_little: bool) -> Option<Self> {
        const SENTINEL: u16 = 1;
        let half =
            |bytes: [u8; 2]| if is_little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) };
        let (&[a, b, c, d], after) = list.split_first_chunk::<4>()?;
        let (kind, length) = (half([a, b]), usize::from(half([c, d])));
        if kind == SENTINEL {
            *list = after;
            return None;
        }
        let (value, rest) = after.split_at_checked(length)?;
        *list = rest;
        Some(Self { kind, value })
    }
}

/// The places of UDP in a list of parameters of this kind.
fn places(payload: &[u8], kind: u16) -> Vec<SocketAddrV4> {
    const UDP: u32 = 1;
    let is_little = payload.get(1) == Some(&3);
    let word = |bytes: &[u8]| {
        let bytes = <[u8; 4]>::try_from(bytes).ok()?;
        Some(if is_little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    };
    let place = |value: &[u8]| {
        let port = u16::try_from(word(value.get(4..8)?)?).ok()?;
        let address = <[u8; 4]>::try_from(value.get(20..24)?).ok()?;
        (word(value.get(..4)?)? == UDP).then(|| SocketAddrV4::new(address.into(), port))
    };
    let mut list = payload.get(4..).unwrap_or_default();
    let all = std::iter::from_fn(|| Parameter::take(&mut list, is_little));
    all.filter(|one| one.kind == kind).filter_map(|one| place(one.value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An announcement with two places, and something that no place is between them, behind this inline QoS.
    fn announcement(inline_qos: &[u8]) -> Vec<u8> {
        let locator = |kind: u32, port: u32, address: [u8; 4]| {
            let use_of = if port == 7410 { 0x32 } else { 0x31 };
            let head = [&[use_of, 0, 24, 0][..], &kind.to_le_bytes(), &port.to_le_bytes()].concat();
            [&head[..], &[0; 12], &address].concat()
        };
        let payload = [
            &[0, 3, 0, 0][..],
            &locator(1, 7411, [10, 0, 0, 7]),
            &locator(1, 7410, [10, 0, 0, 7]),
            &[0x15, 0, 4, 0, 2, 3, 0, 0],
            &locator(16, 7, [0; 4]),
            &locator(1, 7413, [127, 0, 0, 1]),
            &[1, 0, 0, 0],
        ]
        .concat();
        let content = [inline_qos, &payload].concat();
        let mut packet = data([0x0f; 12], [ANNOUNCER, [0, 1, 0, 0xc7]], 1, &Content::Payload(&content));
        if !inline_qos.is_empty() {
            packet[21] |= 0x02;
        }
        packet
    }

    #[test]
    fn an_announcement_says_where_its_participant_is() {
        let place = |place: &str| place.parse().expect("an address");
        let expected = Announcement {
            from: [0x0f; 12],
            samples: vec![place("10.0.0.7:7411"), place("127.0.0.1:7413")],
            discovery: vec![place("10.0.0.7:7410")],
        };
        // As that of the second participant of a process on Fast DDS is.
        let inline_qos = [&[0x0f, 0x80, 24, 0][..], &[7; 24], &[1, 0, 0, 0]].concat();
        for inline_qos in [&[][..], &inline_qos] {
            assert_eq!(announced(&announcement(inline_qos)).as_ref(), Some(&expected));
        }
        assert_eq!(announced(&numbered([1; 12], 7)), None);
        let farewell = data([7; 12], [ANNOUNCER, [2; 4]], 9, &Content::InlineQos(&[5; 36]));
        assert_eq!(announced(&farewell), None);
    }

    #[test]
    fn damaged_announcements_are_read_without_a_panic() {
        let whole = announcement(&[0x0f, 0x80, 4, 0, 7, 7, 7, 7, 1, 0, 0, 0]);
        for cut in 0..whole.len() {
            let _ = announced(&whole[..cut]);
        }
        for at in 0..whole.len() {
            for value in [0, 1, 3, 0x7f, 0x80, 0xff] {
                let mut changed = whole.clone();
                changed[at] = value;
                let _ = announced(&changed);
            }
        }
    }

    #[test]
    fn the_wish_for_a_sample_has_the_length_that_it_says() {
        let packet = first_sample_wanted([1; 12], [2; 4], [3; 12], [4; 4], 1);
        assert_eq!((packet.len(), packet[38]), (20 + 16 + 4 + 28, 28));
        assert_eq!(packet[64..], 1_u32.to_le_bytes());
    }

    #[test]
    fn the_length_of_the_submessage_is_that_of_what_follows_it() {
        let packet = data([7; 12], [[1; 4], [2; 4]], 9, &Content::InlineQos(&[5; 36]));
        let length = u16::from_le_bytes([packet[22], packet[23]]);
        assert_eq!(usize::from(length), packet.len() - 24);
        assert_eq!((packet.len() % 4, packet[40]), (0, 9));
    }

    #[test]
    fn a_reply_names_its_request_twice_before_its_payload() {
        let qos = related_to([7; 16], (3 << 32) | 9);
        assert_eq!(qos.len(), 2 * 28 + 4);
        assert_eq!(qos[..4], [0x83, 0, 24, 0]);
        assert_eq!(qos[28..32], [0x0f, 0x80, 24, 0]);
        assert_eq!((&qos[20..28], &qos[56..]), (&[3, 0, 0, 0, 9, 0, 0, 0][..], &[1, 0, 0, 0][..]));
        let packet =
            data([7; 12], [[1; 4], [2; 4]], 9, &Content::Both { inline_qos: &qos, payload: &[5; 8] });
        let length = u16::from_le_bytes([packet[22], packet[23]]);
        assert_eq!((usize::from(length), packet[21]), (packet.len() - 24, 0x07));
        assert_eq!(packet[packet.len() - 12..], [1, 0, 0, 0, 5, 5, 5, 5, 5, 5, 5, 5]);
    }

    #[test]
    fn ports_are_those_of_the_standard_s_defaults() {
        assert_eq!(discovery_port(0, None), Some(7400));
        assert_eq!(discovery_port(1, Some(3)), Some(7666));
        assert_eq!(discovery_port(233, None), None);
        assert_eq!(participant_port(0, 0), Some(7411));
    }
}
