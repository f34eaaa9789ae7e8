//! Quality of service: what publisher and subscription promise each other.
//!
//! They match where the publisher promises at least what the subscription asks for: a best effort
//! publisher never matches a reliable subscription.

use ros2_client::dds::rustdds::policy::{Durability, History, Liveliness, Reliability};
use ros2_client::dds::rustdds::{Duration, QosPolicies, QosPolicyBuilder};

/// Quality of service of one endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quality {
    /// Lost samples are sent again.
    pub reliable: bool,
    /// A late joiner gets the last samples. Publish such topics rarely and small: RustDDS trims
    /// unread samples only every few seconds, and a late joiner may get more than `depth` samples.
    pub transient_local: bool,
    /// How many samples are kept \[1\].
    pub depth: u16,
}

impl Quality {
    /// The latest counts and a lost one is soon replaced: poses, the clock.
    pub const BEST_EFFORT: Self = Self { reliable: false, transient_local: false, depth: 1 };

    /// Every sample counts.
    pub const fn reliable(depth: u16) -> Self {
        Self { reliable: true, transient_local: false, depth }
    }

    /// Every sample counts, and a late joiner gets the last `depth`.
    pub const fn transient_local(depth: u16) -> Self {
        Self { reliable: true, transient_local: true, depth }
    }

    pub(super) fn policies(self) -> QosPolicies {
        let reliability = if self.reliable {
            // Full window: say so at once, the loop must not wait for a slow peer.
            Reliability::Reliable { max_blocking_time: Duration::ZERO }
        } else {
            Reliability::BestEffort
        };
        let durability = if self.transient_local { Durability::TransientLocal } else { Durability::Volatile };
        QosPolicyBuilder::new()
            .reliability(reliability)
            .durability(durability)
            .history(History::KeepLast { depth: i32::from(self.depth.max(1)) })
            .liveliness(Liveliness::Automatic { lease_duration: Duration::INFINITE })
            .build()
    }
}
