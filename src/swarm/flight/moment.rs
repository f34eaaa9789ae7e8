//! The time and place of an extreme value, with the robots that it concerns.

use std::fmt;

use serde::Serialize;

use crate::scene::text::decimals;

/// A moment of a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// By name: two that came close to each other, or one that did to an obstacle or that was away from its place.
    pub robots: Vec<String>,
    /// At the end of the period \[s\].
    pub time: f64,
    /// Between the two robots, or of the one \[m, world frame\].
    pub x: f64,
    /// Second coordinate of that place \[m, world frame\].
    pub y: f64,
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { robots, time, x, y } = self;
        let [x, y] = [*x, *y].map(|coordinate| decimals(coordinate, 2));
        write!(f, "{} at {time:.2} s near ({x}, {y}) m", robots.join(" and "))
    }
}

/// A moment by number, as it is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extreme {
    pub value: f64,
    pub member: usize,
    /// The other of a pair.
    pub other: Option<usize>,
    /// \[s\]
    pub time: f64,
    /// \[m\]
    pub place: [f64; 2],
}

impl Extreme {
    pub fn named(&self, names: &[String]) -> Moment {
        let [x, y] = self.place;
        let robots = [Some(self.member), self.other].into_iter().flatten().map(|m| names[m].clone());
        Moment { robots: robots.collect(), time: self.time, x, y }
    }
}
