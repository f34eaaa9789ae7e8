//! The ways that take turns: a channel, iceoryx2 as it comes, our transport, a Unix socket. A message's mark travels in the
//! first pose's stamp, to the bit.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{AllocationStrategy, Node, ipc};
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut::SampleMut;

use super::measure::{End, Ends};
use super::pose;
use crate::shm::channel::{Filled, Slice};
use crate::shm::payload::Pose;
use crate::shm::{Capacity, Domain, Peer, Reader, Writer};

pub const RAW: &str = "iceoryx2";
pub const OURS: &str = "ours";

/// A way, by name.
pub struct Way {
    pub name: &'static str,
    /// Both ends, for messages of so many poses.
    pub open: fn(usize) -> Result<Ends, String>,
}

pub fn all() -> [Way; 4] {
    [
        Way { name: "in-process channel", open: open_channel },
        Way { name: RAW, open: open_raw },
        Way { name: OURS, open: open_ours },
        Way { name: "Unix socket", open: open_socket },
    ]
}

fn sum(poses: &[Pose]) -> f64 {
    poses.iter().map(|pose| pose.position[0] + pose.position[1] + pose.yaw).sum()
}

pub fn words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// A vector changes hands.
struct Channel {
    to: Sender<Vec<Pose>>,
    from: Receiver<Vec<Pose>>,
    own: Vec<Pose>,
    arrived: Vec<Pose>,
    poses: usize,
}

fn open_channel(poses: usize) -> Result<Ends, String> {
    let (to_far, from_near) = channel();
    let (to_near, from_far) = channel();
    let end = move |to, from| Channel { to, from, own: Vec::new(), arrived: Vec::new(), poses };
    let far = end(to_near, from_near);
    Ok((Box::new(end(to_far, from_far)), Box::new(move || Ok(Box::new(far) as Box<dyn End>))))
}

impl End for Channel {
    fn fill(&mut self) -> Result<(), String> {
        // The message that arrived is written over, so that nothing is allocated.
        if self.own.is_empty() {
            self.own = std::mem::take(&mut self.arrived);
        }
        self.own.clear();
        self.own.extend((0..self.poses).map(pose));
        Ok(())
    }

    fn send(&mut self, mark: u64) -> Result<(), String> {
        self.own[0].stamp = f64::from_bits(mark);
        self.to.send(std::mem::take(&mut self.own)).map_err(words)
    }

    fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String> {
        let Ok(arrived) = self.from.recv_timeout(patience) else { return Ok(None) };
        self.arrived = arrived;
        Ok(self.arrived.first().map(|pose| pose.stamp.to_bits()))
    }

    fn read(&mut self) -> f64 {
        sum(&self.arrived)
    }
}

/// A domain that no other run meets.
fn domain() -> Result<Domain, String> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    Domain::named(&format!("bench_{}_{number}", std::process::id())).map_err(words)
}

/// Our transport, in the capacity in which the node uses it.
struct Ours {
    writer: Writer<Pose>,
    reader: Reader<Pose>,
    own: Option<Filled<Pose>>,
    arrived: Option<Slice<Pose>>,
    poses: usize,
    // Dropped after all that was made from it.
    _peer: Peer,
}

impl Ours {
    fn open(domain: &Domain, poses: usize, [out, back]: [&str; 2]) -> Result<Self, String> {
        let peer = domain.join("flockform_bench").map_err(words)?;
        Ok(Self {
            writer: Writer::open(&peer, "bench", out, &Capacity::SWARM, poses).map_err(words)?,
            reader: Reader::open(&peer, "bench", back, &Capacity::SWARM).map_err(words)?,
            own: None,
            arrived: None,
            poses,
            _peer: peer,
        })
    }
}

fn open_ours(poses: usize) -> Result<Ends, String> {
    open_in_domain(poses, Ours::open)
}

/// Two ends of one kind in a domain of their own.
fn open_in_domain<E: End + 'static>(
    poses: usize,
    open: fn(&Domain, usize, [&str; 2]) -> Result<E, String>,
) -> Result<Ends, String> {
    let domain = domain()?;
    let near = open(&domain, poses, ["out", "back"])?;
    let far = move || Ok(Box::new(open(&domain, poses, ["back", "out"])?) as Box<dyn End>);
    Ok((Box::new(near), Box::new(far)))
}

impl End for Ours {
    fn fill(&mut self) -> Result<(), String> {
        // A slice that was not sent goes back first: one at a time.
        self.own = None;
        self.own = Some(self.writer.fill(self.poses, pose).map_err(words)?);
        Ok(())
    }

    fn send(&mut self, mark: u64) -> Result<(), String> {
        let Some(mut filled) = self.own.take() else { return Err("nothing filled".into()) };
        filled[0].stamp = f64::from_bits(mark);
        self.writer.hand_over(filled, 0.0, mark).map_err(words)
    }

    fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String> {
        let begun = Instant::now();
        self.arrived = None;
        self.arrived = self.reader.take();
        // The bell may still ring for a slice that was taken without it.
        while let (None, Some(rest)) = (&self.arrived, patience.checked_sub(begun.elapsed())) {
            self.reader.wait(rest);
            self.arrived = self.reader.take();
        }
        Ok(self.arrived.as_ref().and_then(|slice| slice.first()).map(|pose| pose.stamp.to_bits()))
    }

    fn read(&mut self) -> f64 {
        self.arrived.as_deref().map_or(0.0, sum)
    }
}

/// iceoryx2 by its own calls, in the capacity that two need.
struct Raw {
    publisher: Publisher<ipc::Service, [Pose], ()>,
    notifier: Notifier<ipc::Service>,
    subscriber: Subscriber<ipc::Service, [Pose], ()>,
    listener: Listener<ipc::Service>,
    own: Option<SampleMut<ipc::Service, [Pose], ()>>,
    arrived: Option<Sample<ipc::Service, [Pose], ()>>,
    poses: usize,
    // Dropped after all that was made from it.
    _peer: Peer,
}

impl Raw {
    fn open(domain: &Domain, poses: usize, [out, back]: [&str; 2]) -> Result<Self, String> {
        let peer = domain.join("flockform_bench").map_err(words)?;
        let (to, rings) = Self::service(peer.node(), out)?;
        let (from, rung) = Self::service(peer.node(), back)?;
        let publisher = to.publisher_builder().initial_max_slice_len(poses);
        Ok(Self {
            publisher: publisher.allocation_strategy(AllocationStrategy::Static).create().map_err(words)?,
            notifier: rings.notifier_builder().create().map_err(words)?,
            subscriber: from.subscriber_builder().create().map_err(words)?,
            listener: rung.listener_builder().create().map_err(words)?,
            own: None,
            arrived: None,
            poses,
            _peer: peer,
        })
    }

    #[expect(clippy::type_complexity, reason = "as iceoryx2 spells it")]
    fn service(
        node: &Node<ipc::Service>,
        name: &str,
    ) -> Result<
        (
            iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, [Pose], ()>,
            iceoryx2::service::port_factory::event::PortFactory<ipc::Service>,
        ),
        String,
    > {
        let name = name.try_into().map_err(words)?;
        let slices = node.service_builder(&name).publish_subscribe::<[Pose]>();
        let slices = slices.max_publishers(1).max_subscribers(1).open_or_create().map_err(words)?;
        Ok((slices, node.service_builder(&name).event().open_or_create().map_err(words)?))
    }
}

fn open_raw(poses: usize) -> Result<Ends, String> {
    open_in_domain(poses, Raw::open)
}

impl End for Raw {
    fn fill(&mut self) -> Result<(), String> {
        // A slice that was not sent goes back first: one at a time.
        self.own = None;
        self.own = Some(self.publisher.loan_slice_uninit(self.poses).map_err(words)?.write_from_fn(pose));
        Ok(())
    }

    fn send(&mut self, mark: u64) -> Result<(), String> {
        let Some(mut filled) = self.own.take() else { return Err("nothing filled".into()) };
        filled.payload_mut()[0].stamp = f64::from_bits(mark);
        filled.send().map_err(words)?;
        self.notifier.notify().map_err(words)?;
        Ok(())
    }

    fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String> {
        let begun = Instant::now();
        self.arrived = None;
        self.arrived = self.subscriber.receive().map_err(words)?;
        // The bell may still ring for a slice that was taken without it.
        while let (None, Some(rest)) = (&self.arrived, patience.checked_sub(begun.elapsed())) {
            self.listener.timed_wait(|_| (), rest).map_err(words)?;
            self.arrived = self.subscriber.receive().map_err(words)?;
        }
        let first = self.arrived.as_ref().and_then(|sample| sample.payload().first());
        Ok(first.map(|pose| pose.stamp.to_bits()))
    }

    fn read(&mut self) -> f64 {
        self.arrived.as_ref().map_or(0.0, |sample| sum(sample.payload()))
    }
}

/// Bytes of a pose on the socket.
const BYTES: usize = 40;

/// Plain bytes, written and read as a whole.
struct Socket {
    stream: UnixStream,
    own: Vec<u8>,
    arrived: Vec<u8>,
    poses: usize,
}

fn open_socket(poses: usize) -> Result<Ends, String> {
    let (near, far) = UnixStream::pair().map_err(words)?;
    let end = move |stream| Socket {
        stream,
        own: Vec::with_capacity(poses * BYTES),
        arrived: vec![0; poses * BYTES],
        poses,
    };
    let far = end(far);
    Ok((Box::new(end(near)), Box::new(move || Ok(Box::new(far) as Box<dyn End>))))
}

impl End for Socket {
    fn fill(&mut self) -> Result<(), String> {
        self.own.clear();
        for Pose { member, frame, position: [x, y], yaw, stamp } in (0..self.poses).map(pose) {
            let mut bytes = [0; BYTES];
            bytes[..4].copy_from_slice(&member.to_le_bytes());
            bytes[4..8].copy_from_slice(&frame.to_le_bytes());
            for (k, number) in [x, y, yaw, stamp].into_iter().enumerate() {
                bytes[8 + 8 * k..16 + 8 * k].copy_from_slice(&number.to_le_bytes());
            }
            self.own.extend_from_slice(&bytes);
        }
        Ok(())
    }

    fn send(&mut self, mark: u64) -> Result<(), String> {
        self.own[BYTES - 8..BYTES].copy_from_slice(&mark.to_le_bytes());
        self.stream.write_all(&self.own).map_err(words)
    }

    fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String> {
        use std::io::ErrorKind::{TimedOut, WouldBlock};
        self.stream.set_read_timeout(Some(patience)).map_err(words)?;
        // The rest of a message that has begun to come does come.
        match self.stream.read(&mut self.arrived) {
            Err(error) if matches!(error.kind(), TimedOut | WouldBlock) => return Ok(None),
            Err(error) => return Err(error.to_string()),
            Ok(0) => return Err("the other side is gone".into()),
            Ok(read) => self.stream.read_exact(&mut self.arrived[read..]).map_err(words)?,
        }
        Ok(Some(u64::from_le_bytes(eight(&self.arrived[BYTES - 8..BYTES]))))
    }

    fn read(&mut self) -> f64 {
        let number = |bytes: &[u8]| f64::from_le_bytes(eight(bytes));
        let poses = self.arrived.chunks_exact(BYTES);
        poses.map(|pose| number(&pose[8..16]) + number(&pose[16..24]) + number(&pose[24..32])).sum()
    }
}

fn eight(bytes: &[u8]) -> [u8; 8] {
    bytes.try_into().expect("eight bytes")
}
