//! The film of a flight: its map at one time after another, with the ways flown so far.

use super::{Film, FilmColour, chosen};
use crate::export::figures::bands::{Bands, Field};
use crate::export::figures::flight_map::{Map, Moment};
use crate::export::figures::page;
use crate::export::report::FlightRecorder;
use crate::flock::vectors::Vectors;
use crate::scene::swarm::Swarm;
use crate::scene::text::counted;
use crate::swarm::flight::{FlightReport, Record};

/// Differences below this are rounding \[m\], \[1\]; of squares its square.
const NOISE: f64 = 1e-9;

/// The film of a flight whose recorder has seen all of it.
pub fn film<'a>(
    swarm: &'a Swarm,
    record: &'a Record,
    report: &'a FlightReport,
    recorder: &'a FlightRecorder,
    colour: FilmColour,
) -> Film<'a> {
    let frames = chosen(recorder.frames.kept.len());
    let values = move |frame: usize| match colour {
        FilmColour::Role => None,
        FilmColour::Displacement => {
            let [dx, dy] = ["dx", "dy"].map(|name| recorder.frames.values(frame, name));
            Some(dx?.into_iter().zip(dy?).map(|(x, y)| x.hypot(y)).collect::<Vec<_>>())
        }
        _ => recorder.frames.values(frame, colour.name()),
    };
    let finite =
        |frame: &usize| values(*frame).unwrap_or_default().into_iter().filter(|value| value.is_finite());
    let range = frames.iter().flat_map(finite);
    let range = range.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [f64::min(l, v), f64::max(h, v)]);
    let bands = bands(colour, range);
    let places = move |frame: usize| -> Vectors {
        let [dx, dy] = ["dx", "dy"].map(|name| recorder.frames.values(frame, name).unwrap_or_default());
        let moved = dx.into_iter().zip(dy);
        recorder.start.iter().zip(moved).map(|([x, y], (dx, dy))| [x + dx, y + dy]).collect()
    };
    let map = Map::new(swarm, record, report, page::around_in_film);
    let count = frames.len();
    let draw = move |n: usize| {
        let (frame, values) = (frames[n], values(frames[n]));
        let field = bands.as_ref().zip(values.as_deref()).map(|(bands, values)| Field { bands, values });
        let time = recorder.time(frame);
        // The periods are whole, times are sums of them.
        let flown = record.times.partition_point(|&at| at <= time + 1e-9 * time.abs());
        let note = format!("{}, {time:.1} s", counted(report.robots, "robot"));
        map.draw(&Moment { flown, places: &places(frame), note, field })
    };
    Film { count, draw: Box::new(draw) }
}

/// Bands for values from the lowest to the highest of all frames.
fn bands(colour: FilmColour, [low, high]: [f64; 2]) -> Option<Bands> {
    let (quantity, unit) = match colour {
        FilmColour::Role => return None,
        FilmColour::Displacement => ("displacement", "m"),
        _ => FlightRecorder::label_and_unit(colour.name())?,
    };
    let noise = if colour == FilmColour::Pe1 { NOISE * NOISE } else { NOISE };
    Some(Bands::around(low, high, noise).named(quantity, unit))
}
