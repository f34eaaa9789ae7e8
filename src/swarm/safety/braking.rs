//! The step of a member that takes time to brake.
//!
//! Such a member is safe as long as there is room for the straight way on which it comes to rest. So the cells of
//! members that brake divide the space between these ways, not between the members: [the module's docs](super)
//! prove that a command then exists at every tick.

use super::cell::{length, shortened};
use super::filter::{Filter, Flags, Seen};
use crate::geometry::point::{dot, minus, plus};
use crate::swarm::robots::DoubleIntegrator;

/// Halvings of the interval between braking and the wanted velocity: a step is exact to one part in 2 to this power.
const HALVINGS: usize = 12;

impl Filter {
    /// The model of members that brake.
    pub(super) fn braking(&self) -> DoubleIntegrator {
        DoubleIntegrator { speed: self.limits.speed, acceleration: self.limits.acceleration }
    }

    /// Whether targets are made for members that brake.
    pub(super) fn brakes(&self, seen: &Seen) -> bool {
        self.limits.braking().is_some() && seen.velocity.is_some()
    }

    /// The place at which a member comes to rest if it brakes now \[m, world frame\].
    pub(super) fn resting_place(&self, seen: &Seen, period: f64, member: usize) -> [f64; 2] {
        let here = seen.present.get(member);
        let way = self.velocity(seen, member).map_or([0.0; 2], |v| self.braking().braking_way(v, period));
        plus(here, way)
    }

    /// The place at which the member was last sent to come to rest, relative to it \[m\], and how far noise may put the one at
    /// which it seems to come to rest from it \[m\].
    pub(super) fn promised(&self, seen: &Seen, member: usize) -> ([f64; 2], f64) {
        let (here, last) = (seen.present.get(member), self.sent.get(member));
        let error = seen.strays.map_or(0.0, |strays| strays[member].error);
        (minus(last, here), error)
    }

    /// The place to come to rest at \[m\], relative to the member, with the step towards `goal` after which it still
    /// can within its cell; one along which it brakes if there is none.
    pub(super) fn brakable(
        &self,
        velocity: [f64; 2],
        (promised, error): ([f64; 2], f64),
        goal: [f64; 2],
        period: f64,
        flags: &mut Flags,
    ) -> [f64; 2] {
        let dynamics = self.braking();
        let half = velocity.map(|v| 0.5 * period * v);
        let rest = |next: [f64; 2]| plus(half, dynamics.covered(next, period));
        let most = self.limits.acceleration * period;
        let steered = |next: [f64; 2]| plus(velocity, shortened(minus(next, velocity), most));
        let braked = steered([0.0; 2]);
        let wanted = dynamics.approach(minus(goal, half), period);
        let next = steered(wanted);
        let mut stop = rest(braked);
        // Noise that moves the place is no leave to go there: as often as it moves it on, it would go on.
        if length(minus(promised, stop)) <= error {
            stop = promised;
        }
        // A member outside its cell goes no further out than it has to.
        let holds = |place: [f64; 2]| {
            let inside = |plane: &super::cell::HalfPlane| {
                dot(plane.normal, place) <= plane.offset.max(dot(plane.normal, stop))
            };
            self.cell.planes.iter().all(inside)
        };
        if next != wanted {
            flags.0 |= Flags::ACCELERATION_LIMITED;
        }
        let end = rest(next);
        if holds(end) {
            // The goal to the last bit, where only the goal bounds the step.
            let arrives = next == wanted && length(minus(end, goal)) <= 1e-12 * length(goal);
            return if arrives && holds(goal) { goal } else { end };
        }
        flags.0 |= Flags::ACCELERATION_LIMITED;
        let (mut kept, mut low, mut high) = (stop, 0.0, 1.0);
        for _ in 0..HALVINGS {
            let share = 0.5 * (low + high);
            let between = [0, 1].map(|k| braked[k] + share * (next[k] - braked[k]));
            let place = rest(between);
            if holds(place) {
                (kept, low) = (place, share);
            } else {
                high = share;
            }
        }
        kept
    }
}
