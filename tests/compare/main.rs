//! Rule and truth on the same body.

mod beam;
mod measured;
mod mesh;
mod support;
mod truth;
