//! The message structs against their definitions: names, order and types of the fields, constants,
//! and the bytes on the wire.

#![cfg(feature = "messages")]

mod definition;
mod package;
mod payloads;
mod reference;
mod sample;
mod structs;
mod wire;
