//! The way out of a deadlock: a member that is blocked for some ticks keeps to the right.
//!
//! Members that want to swap places stop each other: each stands at the point of its cell that is
//! nearest to its goal, and none moves. Zhou et al. (2017, section V) break the symmetry by the
//! right-hand rule. Here a blocked member aims to the right of its goal, a quarter turn first and
//! further back if that does not move it either, until the straight way is free again for as long as
//! it took to give it up. The aim is projected onto the cell like any other: a detour cannot do harm.
//! It finds the way round convex things, not out of a maze. A member that has gone once round its goal and not come to it, because
//! another stands on it, say, goes no way but the straight one until that has brought it nearer, the goal is another, or a thousand times as
//! long. So does one that went to and fro, some detours having begun where the one before them did: for longer after each more.

use std::f64::consts::TAU;

use super::cell::length;
use crate::geometry::point::{cross, dot, minus};

/// Share of the way a member could make in a tick (at most its own size) below which it is blocked \[1\].
const BLOCKED: f64 = 0.1;

/// The same, above which its way is free \[1\].
const FREE: f64 = 0.5;

/// Detours in a row after which a member waits that began at one place, to this share of its size \[1\].
const FRUITLESS: u8 = 4;
const THERE: f64 = 0.1;

/// Ticks for which a member waits at most, over those for which it is blocked before a detour \[1\].
const WAIT: u32 = 1024;

/// One member's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Detour {
    /// Consecutive ticks in favour of a change.
    ticks: u32,
    /// Eighths of a turn to the right; 0 is straight ahead.
    turn: u8,
    /// Distance from the goal where the detour, or the wait, began \[m\].
    begun: f64,
    /// The goal of the detours so far \[m, world frame\], its place relative to the member at the last tick, and the angle by which the
    /// member has gone round it since the first one \[rad\].
    goal: [f64; 2],
    last: [f64; 2],
    round: f64,
    /// Detours in a row that began at one place \[1\], and that place \[m, world frame\].
    begins: u8,
    place: [f64; 2],
    /// Ticks for which it waits yet \[1\].
    wait: u32,
}

/// A member's possible and actual motion at a tick; all relative to it.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// Radius and clearance \[m\].
    pub size: f64,
    /// Largest step in open space \[m\].
    pub scale: f64,
    /// Its goal \[m, world frame\].
    pub goal: [f64; 2],
    /// The same, relative to it \[m\].
    pub wanted: [f64; 2],
    /// Distance of the goal \[m\].
    pub distance: f64,
    /// The share of `scale` \[1\] that is free straight to the goal.
    pub straight: f64,
    /// The point of the cell nearest to the goal, as far as `scale` \[m\].
    pub direct: [f64; 2],
    /// Its step by its present aim \[m\].
    pub moved: [f64; 2],
}

/// A quarter turn, where detours begin, and the furthest, in eighths.
const FIRST: u8 = 2;
const LAST: u8 = 4;

impl Detour {
    pub fn is_active(self) -> bool {
        self.turn > 0
    }

    /// Goes no way but the straight one for so many times as long as it was blocked before a detour.
    fn wait(&mut self, patience: u32, times: u32, distance: f64) {
        (self.turn, self.ticks, self.begun, self.round) = (0, 0, distance, 0.0);
        self.wait = patience.saturating_mul(times);
    }

    /// The aim in place of `wanted` \[m\], relative to the member.
    pub fn aim(self, wanted: [f64; 2]) -> [f64; 2] {
        let angle = -std::f64::consts::FRAC_PI_4 * f64::from(self.turn);
        let (sin, cos) = angle.sin_cos();
        [cos * wanted[0] - sin * wanted[1], sin * wanted[0] + cos * wanted[1]]
    }

    /// Takes note of a tick; `patience` is that of [`Limits`](super::Limits).
    pub fn update(&mut self, patience: u32, tick: &Tick) {
        let Tick { size, scale, goal, wanted, distance, straight, direct, moved } = *tick;
        if self.wait > 0 {
            self.wait -= 1;
            self.last = wanted;
            if distance < self.begun - size || length(minus(goal, self.goal)) > size {
                self.reset();
            }
            return;
        }
        if length(minus(goal, self.goal)) > size {
            (self.goal, self.round, self.begins) = (goal, 0.0, 0);
        } else {
            self.round += cross(self.last, wanted).atan2(dot(self.last, wanted));
        }
        self.last = wanted;
        if self.round.abs() >= TAU {
            return self.wait(patience, WAIT, distance);
        }
        let progress = dot(direct, wanted) / (distance * scale);
        // Sliding back to where the detour began is no progress: the way is free that leads straight on,
        // or past something from a place nearer to the goal.
        let is_free = straight > FREE || (progress > FREE && distance < self.begun);
        let speaks_for_change = match self.turn {
            0 => progress < BLOCKED,
            _ => is_free || length(moved) < BLOCKED * scale,
        };
        self.ticks = if speaks_for_change { self.ticks + 1 } else { 0 };
        if patience == 0 || self.ticks < patience {
            return;
        }
        self.ticks = 0;
        self.turn = match self.turn {
            0 => {
                self.begun = distance;
                let place = minus(goal, wanted);
                let is_there = self.begins > 0 && length(minus(place, self.place)) <= THERE * size;
                self.begins = if is_there { self.begins.saturating_add(1) } else { 1 };
                self.place = place;
                if self.begins > FRUITLESS {
                    return self.wait(patience, WAIT.min(1 << self.begins.min(31)), distance);
                }
                FIRST
            }
            _ if is_free => 0,
            LAST => FIRST,
            turn => turn + 1,
        };
    }

    /// Whether the state is the initial one.
    pub fn is_fresh(self) -> bool {
        self.turn == 0 && self.ticks == 0 && self.wait == 0
    }

    pub fn reset(&mut self) {
        *self = Self::default();
    }
}
