//! Packets that the kernel keeps from the middleware: a socket filter on each port that RustDDS listens to.
//!
//! RustDDS opens its sockets to all senders, whatever networks it is configured for, and trusts every number in a
//! packet: it lists one by one the samples that a heartbeat or a gap names, and allocates a fragmented sample as long
//! as its first fragment claims. These numbers are bounded here, before RustDDS reads them (classic BPF, which any
//! process may put on its own sockets: Linux, Documentation/networking/filter.rst). The filter is not complete: of a
//! packet's submessages only the first [`SLOTS`] are checked, and carefully forged numbers can still make RustDDS deaf
//! to a peer. [`pulse`](super::pulse) handles the rest.
//!
//! Where only this computer may be heard, the sockets are also bound to the loopback device, as `ss` shows: the kernel
//! does so for any process since Linux 5.7, and the filter holds on older ones.
//!
//! A secured participant loses messages of the handshake by which peers prove who they are: they go to everybody, and of
//! those that come at once RustDDS takes the last, which may be for another. Those for others are kept out too.

use std::collections::BTreeMap;
use std::io;
#[cfg(any(test, feature = "security"))]
use std::net::UdpSocket;
use std::os::fd::BorrowedFd;

use socket2::{SockFilter, SockRef, Type};

/// Submessages looked at in a packet \[1\]: as many as the filters of older kernels have room for.
const SLOTS: usize = 20;

/// Submessages among which a message of the handshake is looked for: it comes alone, behind a time stamp at most \[1\].
const HANDSHAKE_SLOTS: usize = 3;

/// Sockets of this process, by the kernel's names for them.
pub fn sockets() -> io::Result<BTreeMap<String, i32>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir("/proc/self/fd")?.flatten() {
        // One that is closed meanwhile is none.
        let Ok(name) = std::fs::read_link(entry.path()) else { continue };
        let name = name.to_string_lossy().into_owned();
        if let (true, Some(Ok(number))) =
            (name.starts_with("socket:"), entry.file_name().to_str().map(str::parse))
        {
            found.insert(name, number);
        }
    }
    Ok(found)
}

/// Filters what the UDP sockets hear that this process opened since it had those of `before`; says how many there are. A
/// secured participant, whose prefix is `secured`, hears no handshakes of others.
///
/// # Errors
/// A kernel that has no such filters.
pub fn guard(
    before: &BTreeMap<String, i32>,
    loopback_only: bool,
    secured: Option<[u8; 12]>,
) -> io::Result<usize> {
    let program = program(loopback_only, secured);
    let mut guarded = 0;
    for (_, number) in sockets()?.into_iter().filter(|(name, _)| !before.contains_key(name)) {
        let socket = borrowed(number);
        if port(socket).is_some() {
            let socket = SockRef::from(&socket);
            socket.attach_filter(&program)?;
            if loopback_only {
                // Refused by older kernels: the filter alone then keeps others out.
                let _ = socket.bind_device(Some(b"lo"));
            }
            guarded += 1;
        }
    }
    Ok(guarded)
}

/// The UDP socket of this process on a port, as another descriptor of it.
///
/// # Errors
/// A port that no socket of this process has.
#[cfg(any(test, feature = "security"))]
pub fn listener(on: u16) -> io::Result<UdpSocket> {
    let mut all = sockets()?.into_values().map(borrowed);
    let found = all.find(|socket| port(*socket) == Some(on)).ok_or(io::ErrorKind::NotFound)?;
    Ok(UdpSocket::from(found.try_clone_to_owned()?))
}

fn borrowed(number: i32) -> BorrowedFd<'static> {
    // SAFETY: the number was an open socket of this process a moment ago. One that was closed since, or handed out
    // anew, makes calls fail or names another socket, whose kind is looked at first.
    unsafe { BorrowedFd::borrow_raw(number) }
}

/// The port of a UDP socket over IPv4 that has one.
fn port(socket: BorrowedFd<'_>) -> Option<u16> {
    let socket = SockRef::from(&socket);
    let port = socket.local_addr().ok()?.as_socket_ipv4()?.port();
    let is_udp = socket.r#type().is_ok_and(|kind| kind == Type::DGRAM);
    (is_udp && port != 0).then_some(port)
}

/// Where a conditional jump goes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum To {
    Next,
    /// The label of this number in the slot.
    Label(u8),
}
use To::{Label, Next};

enum Line {
    Is(u8),
    Do(u16, u32),
    If(u16, u32, To, To),
}
use Line::{Do, If, Is};

// Opcodes of classic BPF, by their names in linux/bpf_common.h.
const LD_W: u16 = 0x20;
const LD_IMM: u16 = 0x00;
const LD_MEM: u16 = 0x60;
const LD_LEN: u16 = 0x80;
const LDX_W: u16 = 0x40;
const LDX_H: u16 = 0x48;
const LDX_B: u16 = 0x50;
const LDX_MEM: u16 = 0x61;
const LD_IMM_X: u16 = 0x01;
const ST: u16 = 0x02;
const STX: u16 = 0x03;
const ADD: u16 = 0x04;
const ADD_X: u16 = 0x0c;
const SUB_X: u16 = 0x1c;
const AND: u16 = 0x54;
const LSH: u16 = 0x64;
const TAX: u16 = 0x07;
const JA: u16 = 0x05;
const JEQ: u16 = 0x15;
const JEQ_X: u16 = 0x1d;
const JGT: u16 = 0x25;
const JGT_X: u16 = 0x2d;
const JSET: u16 = 0x45;
const RET: u16 = 0x06;

/// Adds lines to a program, with labels turned into distances. Always-jumps have their label in place of a distance.
fn assemble(lines: &[Line], program: &mut Vec<SockFilter>) {
    let mut place = 0_u32;
    let mut labels = [0_u32; 16];
    for line in lines {
        match line {
            Is(label) => labels[usize::from(*label)] = place,
            Do(..) | If(..) => place += 1,
        }
    }
    let mut place = 0_u32;
    for line in lines {
        place += u32::from(!matches!(line, Is(_)));
        // Jumps of a filter go ahead only, and a slot is shorter than the longest.
        let way = |to: &To| match to {
            Next => 0,
            Label(label) => (labels[usize::from(*label)] - place) as u8,
        };
        match line {
            Is(_) => {}
            Do(JA, label) => program.push(SockFilter::new(JA, 0, 0, labels[*label as usize] - place)),
            Do(code, value) => program.push(SockFilter::new(*code, 0, 0, *value)),
            If(code, value, yes, no) => program.push(SockFilter::new(*code, way(yes), way(no), *value)),
        }
    }
}

/// The whole packet, and nothing of it.
const PASS: u32 = u32::MAX;
const DROP: u32 = 0;

/// Bytes before the first submessage: UDP header, RTPS header.
const FIRST: u32 = 8 + 20;
/// Offset of the IP header in a filter (SKF_NET_OFF), and of the sender's address in that.
const SENDER: u32 = 0xfff0_0000 + 12;
/// Kinds of submessages (RTPS 2.3, table 9.13).
const PAD: u32 = 0x01;
const HEARTBEAT: u32 = 0x07;
const GAP: u32 = 0x08;
const INFO_TIMESTAMP: u32 = 0x09;
const DATA: u32 = 0x15;
const DATA_FRAGMENT: u32 = 0x16;
/// The writer of the handshake (DDS Security 1.1, table 7): its messages are not protected.
const HANDSHAKE_WRITER: u32 = 0x0002_01c3;
/// From the beginning of a DATA submessage without inline QoS to the participant that a message of the handshake is for:
/// headers and encapsulation, and the identities of this message and of the one that it answers (7.4.3).
const ADDRESSEE: u32 = 24 + 4 + 24 + 24;
/// Largest sample in fragments, in units of 64 KiB \[1\].
const LARGEST_SAMPLE: u32 = 64;

fn program(loopback_only: bool, secured: Option<[u8; 12]>) -> Vec<SockFilter> {
    let mut program = Vec::new();
    if loopback_only {
        let is_loopback = [
            Do(LD_W, SENDER),
            Do(AND, 0xff00_0000),
            If(JEQ, 0x7f00_0000, Label(0), Next),
            Do(RET, DROP),
            Is(0),
        ];
        assemble(&is_loopback, &mut program);
    }
    let is_rtps = [
        Do(LD_W, 8),
        If(JEQ, u32::from_be_bytes(*b"RTPS"), Label(0), Next),
        Do(RET, DROP),
        Is(0),
        Do(LD_IMM_X, FIRST),
    ];
    assemble(&is_rtps, &mut program);
    let (first, other) = (slot(secured), slot(None));
    // What the handshake takes is less than one slot.
    let slots = SLOTS - usize::from(secured.is_some());
    (0..slots).for_each(|n| assemble(if n < HANDSHAKE_SLOTS { &first } else { &other }, &mut program));
    program.push(SockFilter::new(RET, 0, 0, PASS));
    program
}

/// Drops a message of the handshake that is neither for the participant of this prefix nor for everybody; the kind of the
/// submessage is in A.
fn handshake(own: [u8; 12], skip: u8, dropped: u8, to_others: u8) -> [Line; 13] {
    let word = |n: usize| u32::from_be_bytes([own[n], own[n + 1], own[n + 2], own[n + 3]]);
    [
        If(JEQ, DATA, Next, Label(skip)),
        Do(LDX_B, 1),
        // Inline QoS have no fixed length, and nobody is known to send any here.
        If(JSET, 2, Label(skip), Next),
        Do(LDX_W, 12),
        If(JEQ, HANDSHAKE_WRITER, Next, Label(skip)),
        Do(LDX_W, ADDRESSEE),
        If(JEQ, word(0), Next, Label(to_others)),
        Do(LDX_W, ADDRESSEE + 4),
        If(JEQ, word(4), Next, Label(dropped)),
        Do(LDX_W, ADDRESSEE + 8),
        If(JEQ, word(8), Label(skip), Label(dropped)),
        Is(to_others),
        If(JEQ, 0, Label(skip), Label(dropped)),
    ]
}

/// Checks the submessage that begins at X and goes on to the next. A read beyond the packet drops it.
fn slot(secured: Option<[u8; 12]>) -> Vec<Line> {
    const NUMBERS: u8 = 0;
    const LITTLE: u8 = 1;
    const COMPARE: u8 = 2;
    const FRAGMENT: u8 = 3;
    const BIG_FRAGMENT: u8 = 4;
    const SIZE: u8 = 5;
    const SKIP: u8 = 6;
    const BIG: u8 = 7;
    const LENGTH: u8 = 8;
    const ADVANCE: u8 = 9;
    const DROPPED: u8 = 10;
    const PASSED: u8 = 11;
    const HERE: u8 = 12;
    const EMPTY: u8 = 13;
    const OTHER: u8 = 14;
    const TO_OTHERS: u8 = 15;
    let mut lines = vec![
        Do(LD_LEN, 0),
        If(JGT_X, 0, Label(HERE), Label(PASSED)),
        Is(HERE),
        Do(STX, 3),
        Do(LDX_B, 0),
        Do(ST, 0),
        If(JEQ, HEARTBEAT, Label(NUMBERS), Next),
        If(JEQ, DATA_FRAGMENT, Label(FRAGMENT), Next),
        If(JEQ, GAP, Next, Label(OTHER)),
        // A gap that starts at the first sample is normal for a late joiner and costs nothing.
        Do(LDX_W, 12),
        If(JEQ, 0, Next, Label(NUMBERS)),
        Do(LDX_W, 16),
        If(JEQ, 1, Label(SKIP), Next),
        If(JEQ, 1 << 24, Label(SKIP), Next),
        // First and last number: their high words are the same, and their low words' upper halves differ by one at most.
        Is(NUMBERS),
        Do(LDX_W, 12),
        Do(ST, 1),
        Do(LDX_W, 20),
        Do(LDX_MEM, 1),
        If(JEQ_X, 0, Next, Label(DROPPED)),
        Do(LDX_MEM, 3),
        Do(LDX_B, 1),
        If(JSET, 1, Label(LITTLE), Next),
        Do(LDX_H, 16),
        Do(ST, 4),
        Do(LDX_H, 24),
        Do(JA, u32::from(COMPARE)),
        Is(LITTLE),
        Do(LDX_B, 19),
        Do(LSH, 8),
        Do(ST, 1),
        Do(LDX_B, 18),
        Do(LDX_MEM, 1),
        Do(ADD_X, 0),
        Do(ST, 4),
        Do(LDX_MEM, 3),
        Do(LDX_B, 27),
        Do(LSH, 8),
        Do(ST, 1),
        Do(LDX_B, 26),
        Do(LDX_MEM, 1),
        Do(ADD_X, 0),
        Is(COMPARE),
        Do(ADD, 1),
        Do(LDX_MEM, 4),
        Do(SUB_X, 0),
        If(JGT, 2, Label(DROPPED), Label(SKIP)),
        // The upper half of the sample's size.
        Is(FRAGMENT),
        Do(LDX_B, 1),
        If(JSET, 1, Next, Label(BIG_FRAGMENT)),
        Do(LDX_B, 35),
        If(JEQ, 0, Next, Label(DROPPED)),
        Do(LDX_B, 34),
        Do(JA, u32::from(SIZE)),
        Is(BIG_FRAGMENT),
        Do(LDX_H, 32),
        Is(SIZE),
        If(JGT, LARGEST_SAMPLE - 1, Label(DROPPED), Label(SKIP)),
        Is(OTHER),
    ];
    lines.extend(secured.into_iter().flat_map(|own| handshake(own, SKIP, DROPPED, TO_OTHERS)));
    lines.extend([
        Is(SKIP),
        Do(LDX_MEM, 3),
        Do(LDX_B, 1),
        If(JSET, 1, Next, Label(BIG)),
        Do(LDX_B, 3),
        Do(LSH, 8),
        Do(ST, 1),
        Do(LDX_B, 2),
        Do(LDX_MEM, 1),
        Do(ADD_X, 0),
        Do(LDX_MEM, 3),
        Do(JA, u32::from(LENGTH)),
        Is(BIG),
        Do(LDX_H, 2),
        Is(LENGTH),
        If(JEQ, 0, Next, Label(ADVANCE)),
        // No length: to the end of the packet, but for those that may be empty.
        Do(LD_MEM, 0),
        If(JEQ, PAD, Label(EMPTY), Next),
        If(JEQ, INFO_TIMESTAMP, Label(EMPTY), Label(PASSED)),
        Is(DROPPED),
        Do(RET, DROP),
        Is(PASSED),
        Do(RET, PASS),
        Is(EMPTY),
        Do(LD_IMM, 0),
        Is(ADVANCE),
        Do(ADD, 4),
        Do(ADD_X, 0),
        Do(TAX, 0),
    ]);
    lines
}

#[cfg(test)]
mod tests {
    use std::sync::{Mutex, PoisonError};
    use std::time::Duration;

    use super::*;

    /// Submessage in either byte order: kind, and words of its body.
    fn submessage(kind: u8, words: &[u32], little: bool) -> Vec<u8> {
        let length = (4 * words.len()) as u16;
        let mut bytes = vec![kind, u8::from(little)];
        bytes.extend(if little { length.to_le_bytes() } else { length.to_be_bytes() });
        words
            .iter()
            .for_each(|word| bytes.extend(if little { word.to_le_bytes() } else { word.to_be_bytes() }));
        bytes
    }

    fn numbers(kind: u8, first: u64, last: u64, little: bool) -> Vec<u8> {
        let words = [0x3c7, 0x3c2, (first >> 32) as u32, first as u32, (last >> 32) as u32, last as u32, 9];
        submessage(kind, &words, little)
    }

    fn fragment(size: u32, little: bool) -> Vec<u8> {
        let mut bytes = submessage(0x16, &[0; 9], little);
        bytes[32..36].copy_from_slice(&if little { size.to_le_bytes() } else { size.to_be_bytes() });
        bytes
    }

    fn packet(submessages: &[Vec<u8>]) -> Vec<u8> {
        [b"RTPS\x02\x03\x01\x12 a stranger ".to_vec(), submessages.concat()].concat()
    }

    /// A socket behind a filter, and whether a packet comes in.
    fn door(secured: Option<[u8; 12]>) -> (UdpSocket, impl Fn(&[u8]) -> bool) {
        // One after the other: a door is set before every socket since, another test's too.
        static SETTING: Mutex<()> = Mutex::new(());
        let _setting = SETTING.lock().unwrap_or_else(PoisonError::into_inner);
        let before = sockets().expect("a process");
        let inside = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        inside.set_read_timeout(Some(Duration::from_millis(100))).expect("a socket");
        // Tests beside this one may have opened some too.
        assert!(guard(&before, true, secured).expect("Linux") >= 1);
        assert_eq!(SockRef::from(&inside).device().expect("Linux").as_deref(), Some(&b"lo"[..]));
        let outside = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        let to = inside.local_addr().expect("bound");
        let listener = inside.try_clone().expect("another descriptor");
        let comes_in = move |packet: &[u8]| {
            outside.send_to(packet, to).expect("sent");
            let mut heard = [0; 65_536];
            listener.recv(&mut heard).is_ok_and(|length| heard[..length] == *packet)
        };
        (inside, comes_in)
    }

    #[test]
    fn handshakes_of_others_stay_outside_of_a_secured_participant() {
        const OURS: [u8; 12] = *b"us on 2 keys";
        let message = |writer: u32, to: [u8; 12], little: bool| {
            let mut bytes = submessage(0x15, &[0; 40], little);
            bytes[12..16].copy_from_slice(&writer.to_be_bytes());
            bytes[76..88].copy_from_slice(&to);
            bytes
        };
        let time = submessage(9, &[1, 2], true);
        let (_inside, comes_in) = door(Some(OURS));
        for little in [true, false] {
            let to = |to| message(HANDSHAKE_WRITER, to, little);
            let inline_qos = {
                let mut bytes = to([7; 12]);
                bytes[1] |= 2;
                bytes
            };
            for one in [to(OURS), to([0; 12]), inline_qos, message(0x0000_00c2, [7; 12], little)] {
                assert!(comes_in(&packet(&[time.clone(), one.clone()])), "{little} {one:?}");
                assert!(comes_in(&packet(&[one])), "{little}");
            }
            let strangers = [0, 4, 8].map(|from| {
                let mut to = OURS;
                to[from] += 1;
                to
            });
            for stranger in strangers.into_iter().chain([[7; 12]]) {
                let one = to(stranger);
                assert!(!comes_in(&packet(&[time.clone(), one.clone()])), "{little} {stranger:?}");
                assert!(!comes_in(&packet(std::slice::from_ref(&one))), "{little} {stranger:?}");
            }
        }
        let heartbeats = [vec![time.clone(); 17], vec![numbers(7, 1, 1 << 62, true)]].concat();
        assert!(!comes_in(&packet(&heartbeats)), "the other bounds hold too");
        let (_inside, comes_in) = door(None);
        assert!(comes_in(&packet(&[message(HANDSHAKE_WRITER, [7; 12], true)])));
    }

    #[test]
    fn promises_that_no_memory_holds_stay_outside_and_everything_ordinary_comes_in() {
        let (inside, comes_in) = door(None);
        let to = inside.local_addr().expect("bound");
        let text = submessage(0x15, &[7; 40], true);
        let (pad, time) = (submessage(1, &[], true), submessage(9, &[], false));
        for little in [true, false] {
            let heartbeat = |first, last| numbers(7, first, last, little);
            let gap = |first, last| numbers(8, first, last, little);
            let ordinary = [
                vec![],
                vec![text.clone()],
                vec![heartbeat(1, 0)],
                vec![heartbeat(1, 60_000), text.clone()],
                vec![heartbeat(0xffff, 0x1_0000)],
                vec![text.clone(), pad.clone(), time.clone(), heartbeat(1 << 30, (1 << 30) + 200)],
                vec![gap(1, 5_000_000_000), text.clone()],
                vec![gap(70_000, 70_010), fragment(300_000, little)],
                vec![text.clone(); 40],
            ];
            for submessages in &ordinary {
                assert!(comes_in(&packet(submessages)), "{little} {submessages:?}");
            }
            let harmful = [
                heartbeat(1, 1 << 62),
                heartbeat(1, 300_000),
                heartbeat(5_000_000, 1_000_000_000),
                heartbeat(0, u64::from(u32::MAX)),
                gap(2, 1 << 40),
                gap(1 << 33, 1 << 34),
                gap(2, 1_000_000),
                fragment(u32::MAX, little),
                fragment(5_000_000, little),
            ];
            for one in harmful {
                for hidden in [
                    vec![one.clone()],
                    vec![text.clone(), pad.clone(), time.clone(), one.clone(), text.clone()],
                ] {
                    assert!(!comes_in(&packet(&hidden)), "{little} {hidden:?}");
                }
            }
        }
        // From an address of this computer that others see, where it has one.
        let own = UdpSocket::bind("0.0.0.0:0").and_then(|socket| {
            socket.connect("192.0.2.1:9")?;
            socket.local_addr()
        });
        if let Some(other) = own.ok().and_then(|own| UdpSocket::bind((own.ip(), 0)).ok())
            && !other.local_addr().is_ok_and(|at| at.ip().is_loopback())
            && other.send_to(&packet(std::slice::from_ref(&text)), to).is_ok()
        {
            assert!(inside.recv(&mut [0; 2048]).is_err(), "another address is heard");
        }
        for none in [&b"RTPX and something"[..], b"", b"RTP", &packet(&[vec![7, 1, 28, 0, 0, 0]])] {
            assert!(!comes_in(none), "{none:?}");
        }
    }
}
