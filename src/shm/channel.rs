//! A service's two sides: a writer that fills slices of shared memory in place, a reader that borrows them.

use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};
use std::rc::Rc;
use std::time::Duration;

use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{
    AllocationStrategy, BackpressureStrategy, CallbackProgression, MessagingPattern, PortName, Service as _,
    ServiceName, ipc,
};
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::builder::event::{EventOpenError as EventRefusal, EventOpenOrCreateError};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeOpenError as Refusal, PublishSubscribeOpenOrCreateError as OpenError,
};
use iceoryx2::service::port_factory::{event, publish_subscribe};

use super::payload::{Header, Payload};
use super::wait::Bell;
use super::{Peer, ShmError, domain, folders};
use crate::scene::text::counted;

/// How many can share a service: fixed by the process that creates it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Processes that may write.
    pub writers: usize,
    /// Processes that may read.
    pub readers: usize,
    /// Slices that wait for a reader; of a full queue the oldest gives way.
    pub queue: usize,
    /// Slices that a reader may look at at once.
    pub borrowed: usize,
    /// Slices that a late reader still gets.
    pub history: usize,
}

impl Capacity {
    /// Of a swarm's services: each robot a process of its own, if need be.
    pub const SWARM: Self = Self { writers: 64, readers: 32, queue: 4, borrowed: 2, history: 1 };
    /// Of a body under way: large slices, of which only the newest matters.
    pub const BODY: Self = Self { writers: 1, readers: 8, queue: 1, borrowed: 2, history: 0 };

    /// Slices that a writer needs so that it never runs out of them, whatever its readers do.
    pub fn slices(&self) -> usize {
        self.slices_of(self.readers)
    }

    /// The same with so many readers.
    fn slices_of(&self, readers: usize) -> usize {
        readers * (self.queue + self.borrowed) + self.history + 1
    }

    fn nodes(&self) -> usize {
        self.writers + self.readers + 16
    }
}

/// Times that a service which comes or goes at this moment is asked for again, this far apart.
const ATTEMPTS: usize = 50;
const BETWEEN: Duration = Duration::from_millis(10);

type Slices<T> = publish_subscribe::PortFactory<ipc::Service, [T], Header>;

/// Both halves of a service.
struct Opened<T: Payload> {
    name: String,
    slices: Slices<T>,
    event: event::PortFactory<ipc::Service>,
}

/// `flockform/SPACE/LEAF`.
pub(crate) fn service_name(space: &str, leaf: &str) -> Result<String, ShmError> {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let fault = match space {
        _ if !(1..=64).contains(&space.len()) => "its length",
        _ if !space.chars().all(is_allowed) => "a character in it",
        _ => return Ok(format!("flockform/{space}/{leaf}")),
    };
    Err(ShmError::Refused(format!(
        "{space:?} is no name of a service: {fault}\n  help: give 1 to 64 letters, digits, `-`, `_` and `.`"
    )))
}

impl<T: Payload> Opened<T> {
    fn new(peer: &Peer, name: String, capacity: &Capacity) -> Result<Self, ShmError> {
        let wrong = |reason: String, help: &str| ShmError::Service {
            service: name.clone(),
            reason,
            help: help.to_owned(),
        };
        let service: ServiceName = name
            .as_str()
            .try_into()
            .map_err(|_| wrong("no name of a service".into(), "give another name"))?;
        peer.clear_unfinished()?;
        let slices = again(
            || open_slices::<T>(peer, &service, capacity),
            |error| {
                matches!(
                    error,
                    OpenError::SystemInFlux
                        | OpenError::PublishSubscribeOpenError(Refusal::IsMarkedForDestruction)
                )
            },
        )
        .map_err(|error| explain::<T>(peer, &service, &name, capacity, error))?;
        let event = again(
            || open_event(peer, &service, capacity),
            |error| matches!(error, EventOpenOrCreateError::SystemInFlux),
        )
        .map_err(|error| {
            use EventOpenOrCreateError::EventOpenError;
            let help = match error {
                EventOpenError(EventRefusal::HangsInCreation) => hangs(),
                _ => "another program made its event otherwise: start flockform first".into(),
            };
            wrong(error.to_string(), &help)
        })?;
        Ok(Self { name, slices, event })
    }

    fn port(&self, what: &str, error: impl std::fmt::Display, most: usize) -> ShmError {
        ShmError::Service {
            service: self.name.clone(),
            reason: format!("no {what} more: {error}"),
            help: format!(
                "at most {most} can share it; end others, or keep swarms apart by their names or by {}",
                domain::VARIABLE
            ),
        }
    }
}

fn again<T, E>(mut open: impl FnMut() -> Result<T, E>, passes: impl Fn(&E) -> bool) -> Result<T, E> {
    for _ in 1..ATTEMPTS {
        match open() {
            Err(error) if passes(&error) => std::thread::sleep(BETWEEN),
            done => return done,
        }
    }
    open()
}

fn open_slices<T: Payload>(
    peer: &Peer,
    service: &ServiceName,
    capacity: &Capacity,
) -> Result<Slices<T>, OpenError> {
    peer.node
        .service_builder(service)
        .publish_subscribe::<[T]>()
        .user_header::<Header>()
        .enable_safe_overflow(true)
        .max_publishers(capacity.writers)
        .max_subscribers(capacity.readers)
        .max_nodes(capacity.nodes())
        .subscriber_max_buffer_size(capacity.queue.max(capacity.history).max(1))
        .subscriber_max_borrowed_samples(capacity.borrowed)
        .history_size(capacity.history)
        .open_or_create()
}

fn open_event(
    peer: &Peer,
    service: &ServiceName,
    capacity: &Capacity,
) -> Result<event::PortFactory<ipc::Service>, EventOpenOrCreateError> {
    peer.node
        .service_builder(service)
        .event()
        .max_notifiers(capacity.writers)
        .max_listeners(capacity.readers)
        .max_nodes(capacity.nodes())
        .event_id_max_value(1)
        .open_or_create()
}

/// The remedy for a service that its maker has left in part while others of the domain live.
fn hangs() -> String {
    format!(
        "a process died while it made it: end all programs of this domain and start again, or take another {}",
        domain::VARIABLE
    )
}

/// The meaning of an error of iceoryx2 for a user.
fn explain<T: Payload>(
    peer: &Peer,
    service: &ServiceName,
    name: &str,
    capacity: &Capacity,
    error: OpenError,
) -> ShmError {
    let help = match error {
        OpenError::PublishSubscribeOpenError(Refusal::IncompatibleTypes) => {
            let expected = format!("[{}] with {}", T::NAME, Header::NAME);
            let found = found(peer, service).unwrap_or_else(|| "another type".into());
            return ShmError::Type { service: name.to_owned(), found, expected };
        }
        OpenError::PublishSubscribeOpenError(Refusal::ExceedsMaxNumberOfNodes) => {
            format!("at most {} processes can share it; end others", capacity.nodes())
        }
        OpenError::PublishSubscribeOpenError(Refusal::InsufficientPermissions) => {
            folders::closed(&peer.config).map_or_else(
                || format!("another user made it: keep apart by {}", domain::VARIABLE),
                |folder| format!("{} is its owner's alone: as that user, `chmod 1777` it", folder.display()),
            )
        }
        OpenError::PublishSubscribeOpenError(Refusal::VersionMismatch) => {
            "another version of iceoryx2 made it: peers need 0.10".into()
        }
        OpenError::PublishSubscribeOpenError(Refusal::ServiceInCorruptedState | Refusal::HangsInCreation) => {
            hangs()
        }
        _ => format!(
            "another program made it otherwise: start flockform first, or give it max_publishers({}), \
             max_subscribers({}), max_nodes({}), subscriber_max_buffer_size({}), \
             subscriber_max_borrowed_samples({}), history_size({}) and safe overflow",
            capacity.writers,
            capacity.readers,
            capacity.nodes(),
            capacity.queue.max(capacity.history).max(1),
            capacity.borrowed,
            capacity.history
        ),
    };
    ShmError::Service { service: name.to_owned(), reason: error.to_string(), help }
}

/// The type that the existing service carries.
fn found(peer: &Peer, service: &ServiceName) -> Option<String> {
    let details = ipc::Service::details(service, &peer.config, MessagingPattern::PublishSubscribe).ok()??;
    let types = details.static_details.publish_subscribe().message_type_details();
    Some(format!("[{}] with {}", types.payload.type_name(), types.user_header.type_name()))
}

/// Writes slices of `T`.
pub struct Writer<T: Payload> {
    service: String,
    publisher: Publisher<ipc::Service, [T], Header>,
    notifier: Notifier<ipc::Service>,
    factory: Slices<T>,
    sequence: u64,
    /// Name of the member that it writes for; empty for all of them.
    part: PortName,
    /// Other writers for the same members at the last look \[1\].
    others: usize,
}

impl<T: Payload> Writer<T> {
    /// Of `flockform/SPACE/LEAF`, of slices of at most `most` elements. Where there is room for it, the memory of those that
    /// one reader can keep it from using again is taken now: a `/dev/shm` that is full later does not end it then.
    ///
    /// # Errors
    /// A service of another type or of less capacity, no place left in it, or no memory.
    pub fn open(
        peer: &Peer,
        space: &str,
        leaf: &str,
        capacity: &Capacity,
        most: usize,
    ) -> Result<Self, ShmError> {
        Self::open_for(peer, space, leaf, capacity, most, None)
    }

    /// As [`Writer::open`]; of several that share a service, each for this one member alone, or for all.
    pub(super) fn open_for(
        peer: &Peer,
        space: &str,
        leaf: &str,
        capacity: &Capacity,
        most: usize,
        member: Option<usize>,
    ) -> Result<Self, ShmError> {
        let opened = Opened::<T>::new(peer, service_name(space, leaf)?, capacity)?;
        let part = member.map_or_else(String::new, |member| member.to_string());
        let part = PortName::new(&part).unwrap_or(PortName::new_empty());
        let slices = slices_that_fit::<T>(capacity, most);
        let publisher = opened
            .slices
            .publisher_builder()
            .name(&part)
            .initial_max_slice_len(most.max(1))
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(capacity.slices_of(1))
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .override_sample_preallocation(move |worst| worst.min(slices))
            .create()
            .map_err(|error| ShmError::Service {
                service: opened.name.clone(),
                reason: format!("no writer more: {error}"),
                help: match error {
                    PublisherCreateError::ExceedsMaxSupportedPublishers => format!(
                        "at most {} can write to it: end another, take another name, or keep apart by {}",
                        capacity.writers,
                        domain::VARIABLE
                    ),
                    _ => format!(
                        "it takes {:.0} MB of /dev/shm for slices of {most}",
                        1e-6 * (slices * most * size_of::<T>()) as f64
                    ),
                },
            })?;
        let notifier = opened.event.notifier_builder().create();
        let notifier = notifier.map_err(|error| opened.port("writer", error, capacity.writers))?;
        let Opened { name: service, slices: factory, .. } = opened;
        let writer = Self { service, publisher, notifier, factory, sequence: 0, part, others: 0 };
        writer.take_memory(capacity.slices_of(1).min(slices), most);
        Ok(writer)
    }

    /// Writes in so many slices of `most` elements, which are free again afterwards: only then has the system given them
    /// memory, and slices that were used are used again before others are.
    fn take_memory(&self, slices: usize, most: usize) {
        if folders::require_room((slices * most * size_of::<T>()) as u64).is_err() {
            return;
        }
        let loan = |_| self.publisher.loan_slice_uninit(most).ok();
        // All at once, or it would be one slice again and again.
        let mut loaned: Vec<_> = (0..slices).map_while(loan).collect();
        loaned.iter_mut().for_each(|slice| slice.payload_mut().fill_with(MaybeUninit::zeroed));
    }

    /// Borrows a slice of `count` elements, fills it in place with `element`, hands it to all readers and wakes them.
    /// Never waits: in a full queue the oldest slice gives way.
    ///
    /// # Errors
    /// More elements than the writer was opened for, or no slice free because readers hold more than they may.
    pub fn send(
        &mut self,
        stamp: f64,
        step: u64,
        count: usize,
        element: impl FnMut(usize) -> T,
    ) -> Result<(), ShmError> {
        let filled = self.fill(count, element)?;
        self.hand_over(filled, stamp, step)
    }

    /// The first half of [`Writer::send`]: a slice that is filled and still the writer's own. One at a time.
    ///
    /// # Errors
    /// As [`Writer::send`].
    pub fn fill(&self, count: usize, element: impl FnMut(usize) -> T) -> Result<Filled<T>, ShmError> {
        let slice = self.publisher.loan_slice_uninit(count).map_err(|error| self.refused(error))?;
        Ok(Filled(slice.write_from_fn(element)))
    }

    /// The second half: the slice becomes its readers'.
    ///
    /// # Errors
    /// As [`Writer::send`].
    pub(crate) fn hand_over(&mut self, filled: Filled<T>, stamp: f64, step: u64) -> Result<(), ShmError> {
        let Filled(mut slice) = filled;
        *slice.user_header_mut() = Header { sequence: self.sequence, step, stamp };
        slice.send().map_err(|error| self.refused(error))?;
        self.sequence += 1;
        self.notifier.notify().map_err(|error| self.refused(error))?;
        Ok(())
    }

    fn refused(&self, error: impl std::fmt::Display) -> ShmError {
        ShmError::Send { service: self.service.clone(), reason: error.to_string() }
    }

    /// Warns when other processes have come that write the same, with `what` that does.
    pub(super) fn warn_of_others(&mut self, what: &str) {
        use iceoryx2::prelude::PortFactory as _;
        let (own, is_all) = (self.publisher.id(), |part: &PortName| part.as_str().is_empty());
        let mut others = 0;
        self.factory.dynamic_config().list_publishers(|other| {
            let part = other.publisher_name;
            let is_same = part == self.part || is_all(&part) || is_all(&self.part);
            others += usize::from(is_same && other.publisher_id != own);
            CallbackProgression::Continue
        });
        if others > self.others {
            tracing::warn!(
                "{}: {}: {what}; end one, or keep them apart by {}",
                self.service,
                counted(others, "other writer"),
                domain::VARIABLE
            );
        }
        self.others = others;
    }

    /// Readers now \[1\].
    pub fn readers(&self) -> usize {
        use iceoryx2::prelude::PortFactory as _;
        self.factory.dynamic_config().number_of_subscribers()
    }

    /// Name of the service.
    pub fn service(&self) -> &str {
        &self.service
    }
}

/// A slice in shared memory that its writer has filled and not yet handed over.
#[derive(Debug)]
pub struct Filled<T: Payload>(SampleMut<ipc::Service, [T], Header>);

impl<T: Payload> Deref for Filled<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.0.payload()
    }
}

impl<T: Payload> DerefMut for Filled<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        self.0.payload_mut()
    }
}

/// Memory of one writer at most \[bytes\], unless three slices take more.
const MEMORY: usize = 1 << 30;

/// As many slices as the capacity asks for. Large ones are fewer, and a writer that finds them all held by readers leaves a
/// slice out rather than wait.
fn slices_that_fit<T>(capacity: &Capacity, most: usize) -> usize {
    let fit = MEMORY / (most * size_of::<T>()).max(1);
    capacity.slices().min(fit.max(3))
}

/// Reads slices of `T`.
pub struct Reader<T: Payload> {
    service: String,
    subscriber: Subscriber<ipc::Service, [T], Header>,
    bell: Bell,
    refused: std::cell::Cell<u64>,
}

impl<T: Payload> Reader<T> {
    /// Of `flockform/SPACE/LEAF`.
    ///
    /// # Errors
    /// A service of another type or of less capacity, or no place left in it.
    pub fn open(peer: &Peer, space: &str, leaf: &str, capacity: &Capacity) -> Result<Self, ShmError> {
        let opened = Opened::<T>::new(peer, service_name(space, leaf)?, capacity)?;
        let subscriber = opened.slices.subscriber_builder().create();
        let subscriber = subscriber.map_err(|error| opened.port("reader", error, capacity.readers))?;
        let listener = opened.event.listener_builder().create();
        let listener = listener.map_err(|error| opened.port("reader", error, capacity.readers))?;
        let Opened { name: service, .. } = opened;
        let refused = std::cell::Cell::new(0);
        Ok(Self { service, subscriber, bell: Rc::new(listener), refused })
    }

    /// The bell that rings when a slice arrives.
    pub fn bell(&self) -> Bell {
        Rc::clone(&self.bell)
    }

    /// Stills the bell and takes what has arrived, oldest first, up to as many slices as must not hold a loop.
    pub fn arrived(&self) -> impl Iterator<Item = Slice<T>> + '_ {
        // Before they are taken, so that none is slept through. An error would leave the bell ringing: they are taken all the same.
        let _ = self.bell.try_wait(|_| ());
        std::iter::from_fn(|| self.take()).take(MOST_AT_ONCE)
    }

    /// The oldest slice not yet taken, borrowed until it is dropped.
    pub fn take(&self) -> Option<Slice<T>> {
        match self.subscriber.receive() {
            Ok(sample) => sample.map(Slice),
            Err(error) => {
                if self.refused.replace(self.refused.get() + 1) == 0 {
                    tracing::warn!("{}: not received: {error} (only the first is reported)", self.service);
                }
                None
            }
        }
    }

    /// The newest slice not yet taken; older ones are given back unread.
    pub fn take_last(&self) -> Option<Slice<T>> {
        std::iter::from_fn(|| self.take()).take(MOST_AT_ONCE).last()
    }

    /// Sleeps until a slice arrives, for so long at most; whether one may have: the bell still rings for slices that
    /// were taken since without [`Reader::arrived`].
    pub fn wait(&self, longest: Duration) -> bool {
        self.bell.timed_wait(|_| (), longest).is_ok_and(|rings| rings > 0)
    }

    /// Slices that could not be received \[1\].
    pub fn refused(&self) -> u64 {
        self.refused.get()
    }

    /// Name of the service.
    pub fn service(&self) -> &str {
        &self.service
    }
}

/// Slices taken in one call at most: a flood must not hold a loop.
const MOST_AT_ONCE: usize = 1024;

/// A slice in shared memory, as its writer filled it. Its place is free again when it is dropped.
#[derive(Debug)]
pub struct Slice<T: Payload>(Sample<ipc::Service, [T], Header>);

impl<T: Payload> Slice<T> {
    /// Number, step and time that its sender gave it.
    pub fn header(&self) -> &Header {
        self.0.user_header()
    }
}

impl<T: Payload> Deref for Slice<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.0.payload()
    }
}
