//! Sweeps and spectra over the flock's interaction.

pub mod spectrum;
pub mod sweep;
