//! Parameters: what may be changed while the node runs, within declared types and ranges.

mod served;
mod store;
mod value;

pub use served::Parameters;
pub use store::{Change, Declaration, Range, Refusal, Store};
pub use value::Value;
