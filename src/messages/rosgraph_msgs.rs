//! `rosgraph_msgs`: simulated time.

use super::builtin_interfaces::Time;
use super::messages;

messages! { "rosgraph_msgs";
    /// The message of `/clock`.
    #[derive(Copy)] Clock { clock: Time }
}
