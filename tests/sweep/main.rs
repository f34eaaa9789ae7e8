//! Sweeps: the same bits by every way of taking steps, and what the rules keep.

mod bits;
mod golden;
mod properties;
#[path = "../common/scenes.rs"]
mod scenes;
mod strides;
mod waves;
