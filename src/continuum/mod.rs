//! The continuum host: a scene is planned, stepped, watched.
//!
//! [`plan::Plan`] lays the scene out as arrays and index lists and says what it makes the program
//! model; [`engine::Engine`] steps them; [`run::run`] is the loop around it, and everything that wants
//! to see the body on the way (recorders, progress bars, interrupts) is a [`run::Watch`].

pub mod engine;
pub mod plan;
pub mod record;
pub mod report;
pub mod run;
