//! Makes targets safe: whatever the rule wants, nobody comes nearer to anything than declared.
//!
//! [`Filter::apply`] stands between the rule and whoever moves the robots. It takes present places,
//! wanted targets and the poses' ages and gives targets that keep the [`Limits`]:
//!
//! * **Other members** by buffered Voronoi cells (D. Zhou, Z. Wang, S. Bandyopadhyay, M. Schwager,
//!   "Fast, on-line collision avoidance for dynamic vehicles using buffered Voronoi cells", IEEE RA-L
//!   2017). Of the free gap `d - r_i - r_j - clearance` between two members each takes half. Positions
//!   alone decide, and a member's target takes only its own and its neighbours': a node that serves one
//!   member gives the same bits as one that serves all.
//! * **Obstacles and geofence** by the plane through the nearest point of every edge in reach
//!   ([`Obstacles`]), and a shape cast along the way as a second opinion.
//! * **Deadlock** by keeping to the right ([`Patience`]).
//!
//! # Why it is safe
//! Members `i` and `j` at distance `d`, unit vector `n` from `i` to `j`, `s = r_i + r_j + clearance`.
//! Both keep `n . (x_i - p_i) <= (d - s) / 2` and `-n . (x_j - p_j) <= (d - s) / 2`, so
//! `|x_j - x_i| >= n . (x_j - x_i) >= d - (d - s) = s`. Cells are convex and hold their member, so this
//! is true of any two points on the two straight ways: neither the order nor the pace of the moves
//! matters. A robot that leaves its straight way or its cell is not covered.
//!
//! # Why only those in reach matter
//! A member goes no further than `reach = min(speed * period, |wanted - p|)`: the projection onto a
//! convex cell that holds `p` is no further from `p` than what was projected. Whoever is further away
//! than `s + 2 reach` has its border at `(d - s) / 2 >= reach`, which no point of the way touches.
//!
//! # Old poses
//! Poses of ages `a_i`, `a_j` are off by at most `e = speed (a_i + a_j)` together. The direction `n` is then
//! off by an angle of sine `e / d` at most, and the border is at least `(sqrt(d^2 - e^2) - s - e) / 2` away;
//! turning it costs a further `2 sin(angle / 2) reach`. The cell takes all of that off, so it lies inside
//! every cell that the true places could have. Where that leaves nothing, the member moves only away from
//! all places where the other may be, or stays: age alone drives nobody apart. That takes poses
//! whose ages are true and a speed limit that others keep too. For obstacles the member's own age counts.
//!
//! # Acceleration
//! Given velocities, a member goes no faster than lets it brake before every border of its cell, as they
//! stand. Borders move, since neighbours do: where one comes too fast the cell is kept and the acceleration
//! exceeded, with [`Flags::ACCELERATION_LIMITED`] set. A robot that cannot follow is not covered.
//!
//! It is a filter, not a planner: it goes around what is convex and may wait or wander before what is not.
//! A member whose goal lies inside a solid circles it: keep targets out of solids.

mod braking;
mod cell;
mod clearance;
mod deadlock;
mod filter;
mod limits;
mod obstacles;
mod step;

pub use deadlock::Patience;
pub use filter::{Filter, Flags, Seen};
pub use limits::{Limits, Place, SafetyError};
pub use obstacles::{Obstacle, Obstacles};
