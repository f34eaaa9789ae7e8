//! Parameters: what may be changed while the node runs, within declared types and ranges.

mod declaration;
mod served;
mod store;
mod value;

pub use declaration::{Check, Declaration, Refusal};
pub use served::Parameters;
pub use store::{Change, Store};
pub use value::Value;
