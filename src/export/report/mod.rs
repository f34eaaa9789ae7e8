//! `report.html`: the results of a run, a flight, a comparison or a study as one page that opens by double
//! click, without network or server.
//!
//! A page shows bodies in motion ([`view::View`]), charts and tables. The frames of an animation are kept
//! while the run goes on (`recorder`, `frames`; those of a body in parts show a `sample` of it), at an interval that doubles
//! when there are too many, as displacements in whole multiples of a power of two (`quantized_channel`), and written as differences, deflated (`encode`). The page
//! computes PE1 and strain from displacements, and stress where frames have none; the values at the end are written to the last bit, as in
//! `final.csv`.
//!
//! [`RunRecorder`] watches a run, `FlightRecorder` a flight.

#[cfg(feature = "fem")]
pub mod comparison;
pub(crate) mod encode;
#[cfg(feature = "swarm")]
pub mod flight;
pub(crate) mod frames;
pub mod gallery;
pub mod page;
pub(crate) mod quantized_channel;
pub(in crate::export) mod recorder;
pub mod run;
mod sample;
pub mod stability;
#[cfg(feature = "fem")]
pub mod trade;
pub mod view;

#[cfg(feature = "swarm")]
pub use flight::FlightRecorder;
pub use recorder::{AnimationState, RunRecorder};
pub(in crate::export) use sample::Sample;

use encode::EncodedFrames;
use frames::Frames;

/// Text of a page's films at most \[byte\]: with everything else a page stays under 30 MB.
const MOST_TEXT: usize = 28 << 20;

/// Compresses the frames, as many of them as fit a page beside `others` bytes of text.
fn encoded(frames: &mut Frames, others: usize) -> EncodedFrames {
    let mut encoded = EncodedFrames::of(frames);
    while encoded.size() + others > MOST_TEXT && frames.kept.len() > 3 {
        frames.halve();
        encoded = EncodedFrames::of(frames);
    }
    encoded
}

/// A page that a session feeds.
#[cfg(feature = "live")]
pub(crate) fn live_page(command: String, title: String, view: view::View, live: serde_json::Value) -> String {
    let page = page::Page { title, command, stages: vec![view], live: Some(live), ..page::Page::default() };
    page.html()
}
