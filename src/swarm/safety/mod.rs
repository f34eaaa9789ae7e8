//! The safety filter: with any targets of the rule, members keep the declared distance from each other and from solids.
//!
//! [`Filter::apply`] stands between the rule and the robots. It takes present places,
//! wanted targets and the poses' ages and returns targets that keep the [`Limits`]:
//!
//! * **Other members** by buffered Voronoi cells (D. Zhou, Z. Wang, S. Bandyopadhyay, M. Schwager,
//!   "Fast, on-line collision avoidance for dynamic vehicles using buffered Voronoi cells", IEEE RA-L
//!   2017). Of the free gap `d - r_i - r_j - clearance` between two members each takes half. Positions
//!   alone decide, and of those only the ones in reach: a node that serves one member and hears all
//!   ([`NodeScope`](super::control::scope::NodeScope)) gives the same bits as one that serves all, except for members
//!   that brake, lag behind their targets or are seen late, whose targets it would have to know.
//! * **Obstacles and geofence** by the plane through the nearest point of every edge in reach
//!   ([`Obstacles`]), and a shape cast along the way as a second opinion.
//! * **Deadlock** by keeping to the right (`deadlock`).
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
//! convex cell that holds `p` is no further from `p` than the projected point. A member further away
//! than `s + 2 reach` has its border at `(d - s) / 2 >= reach`, which no point of the way touches.
//!
//! # Old poses
//! Poses of ages `a_i`, `a_j` are off by at most `e = speed (a_i + a_j)` together. The direction `n` is then
//! off by an angle of sine `e / d` at most, and the border is at least `(sqrt(d^2 - e^2) - s - e) / 2` away;
//! turning it costs a further `2 sin(angle / 2) reach`. The cell takes all of that off, so it lies inside
//! every cell that the true places could have. Where that leaves nothing, the member moves only away from
//! all places where the other may be, or stays, where it was last sent if that is known: age alone moves no member, and a
//! late pose is not where it stands. This assumes
//! true ages and a speed limit that all members keep. For obstacles the member's own age counts.
//!
//! A loop that sends the targets of both members knows more: each goes straight to one target after the other, at whatever
//! pace, or stands, and so is in the convex hull `H` of its pose's place, the target of the last command that it surely had by then
//! ([`Stray::places`]), and those since. Where `H_i` and `H_j` are `s` apart, and farther than what the ages leave, the normal
//! through their nearest points parts them, each member takes half of what is left, and its way from anywhere in its hull to a target on
//! its side stays there. Discs of ages would have two robots that stand hold each other behind poses that are late enough; the hulls of
//! such are points. Since the target of a member that has gone on is ahead of its pose, it may be as far from that
//! as the member goes in the pose's age and a period, and from the last target as in a period: late poses slow no member.
//! Behind poses of now the hulls count too: one that lags is on its way to the target of a period ago, and where its next pose is lost
//! that target counts, which has to have counted before. Of members that are where they were sent they are points.
//!
//! One that gets no targets because its pose is too old is in its hull if it did what it was sent to, and by its age anywhere in a disc
//! if it did not. Others keep clear of the hull as before and do not enter the disc. Those inside it come no nearer to its middle, and
//! may leave: nothing drives them away from the middle, which may be towards the hull.
//!
//! # Members that take time to brake
//! A double integrator that stands in its cell now may be unable to stay there. The ways on which members come to rest
//! have to be kept apart: straight on, the whole acceleration `a` against the velocity `v`, over periods
//! `T` of constant acceleration `n (n + 1) T^2 a / 2 + r (n + 1) T^2 a - v T / 2` with `v = (n + r) a T`, which tends to
//! `v^2 / (2 a)`. So for such members ([`Limits::brakes`]) the cell's borders part these ways: the half-plane is that
//! between the nearest points of two ways `B_i`, `B_j`, and each takes half of `|B_i - B_j| - s`; obstacles and the
//! fence likewise. A command is the place to come to rest at; the member takes the step after which it can.
//!
//! *Claim*: while the ways of all members are `s` apart, each has a command, and whatever the others choose the ways
//! are `s` apart at the next tick. *Proof*: the nearest points of convex sets are parted by the normal through them,
//! so `B_i` lies in the cell of `i`. Braking leads along `B_i`: the next way is a part of it, hence a command exists.
//! Any command that is given has its next way's end `e` and the place `q` where it begins in the cell: `e` is tested,
//! and `q` lies between the member's path, which is a parabola inside the triangle of `p`, `p + v T / 2` (on `B_i`, for
//! the way to brake is no shorter) and `e`. The cell is convex, so all of the period's path and the next way lie in it.
//! Cells of two members are `s` apart, as shown above. At rest the ways are points, so a member that starts at rest and
//! clear stays safe.
//!
//! That is a barrier certificate (U. Borrmann, L. Wang, A. D. Ames, M. Egerstedt, "Control barrier certificates for
//! safe swarm behavior", IFAC-PapersOnLine 48(27), 2015) on each half-plane of a buffered Voronoi cell, in discrete time
//! and with the whole way in place of the distance, so that no rate has to be chosen. It takes places and velocities of
//! now: [`Control`](super::control::Control) has them from its members' model ([`Track`](super::watch::Track)), which is
//! exact, however late poses are, for members that follow their model.
//!
//! # Members that do not follow their targets
//! Between its last pose and now a member may have stopped following its targets: it stands, brakes, or goes on to the last
//! one it got. It is then at a place that it was taken to pass since ([`Stray::places`]), or comes to rest on the way from
//! there on which it was taken to be able to. So of a member whose last pose is not of now the convex hull of all these
//! ways stands for `B_i` in the claim above, whose proof stays as it is: the hull of the next tick is that of this one, `q`
//! and `e`, all of which lie in the cell, and a pose that agrees with the model only takes places away. A member that is
//! lost gets no target; its hull grows until it is at rest by its model, and stays.
//!
//! A pose that disagrees with the model moves the hull, perhaps to where others are. Then one more border parts a
//! member from each single place of the other's. The other's true place was in its hull before, so that the member is
//! clear of that, and stays clear of it. Its velocity is then known only up to what the model could have made of it
//! since the pose before, so that the ways of some such velocities count too. A pose that is farther off than any such member
//! can be is inexact: the velocity is then corrected by no more than the model allows, and up to four times as much counts. A member that does what its model cannot
//! is not covered, nor one that goes on, after a fault, from elsewhere than its targets were meant for, beyond its next
//! pose.
//!
//! Of members whose targets are not known (other nodes send them), the last pose counts, by its age: they may be anywhere
//! within what their limits allow, and a member that is perhaps too near goes on along its way or away from all of that.
//!
//! Members without that flag go no faster than lets them brake before every border of their cell, as it stands. Where a
//! border comes too fast the cell is kept and the acceleration exceeded, with [`Flags::ACCELERATION_LIMITED`] set and
//! the origin of the border; a flight reports how often. A late pose is of a place that its member has left, and two
//! noisy ones give no velocity: such a member is taken to go from target to target, whose changes are then what the
//! limit bounds.
//!
//! # Noise
//! With [`Limits::deviation`] everything is kept three deviations of each member farther away, and the ways on which
//! members come to rest by three deviations of their ends more. Where that leaves a member no room, the place at
//! which it was last sent to come to rest stands for the one at which it seems to come to rest by now: noise moves
//! the second as often on as back, and a member that is already too near would follow it on each time and back never.
//! One that does not brake is sent back to where it was last sent, where no place is far enough from all and that one
//! is no farther out of its cell: a step from each pose would go after the noise. That leaves the declared clearance
//! in all of the random flights that begin with it, late poses or not (`tests/swarm_safety`). One that is seen no farther from where it
//! was last sent than it goes in a period, and twelve deviations, is sent on from there, where it stays within reach: steps from its
//! poses would lose what noise puts them back by, and gain nothing where it puts them forward. Where that place is no longer in its
//! cell, as others come nearer than where it lags, its target is the place in the cell within a period of it, and, where there is none,
//! one by its pose. Two members whose hulls
//! noise brings nearer than allowed part, as two fresh ones do. One case is not
//! covered: in a gap between solids that is narrower than the widened distances the way out is undetermined, and
//! noise leads a member deeper.
//!
//! # Lying members
//! A pose that is farther from the last one than the speed limit allows, and half a metre of noise, is not accepted
//! before several agree ([`Watch`](super::watch::Watch)); until then the member's last accepted pose counts, by its
//! age. Physics excludes no more: poses that drift slowly from the true place are accepted, and others may collide
//! with the member where it truly is. No filter can do better with poses from the members themselves; it takes
//! ranges that others measure, against which the watch holds every pose
//! ([`RangeLimits`](super::watch::RangeLimits)). A liar cannot bring two honest members
//! near each other: their borders follow from their own poses alone.
//!
//! It is a filter, not a planner: it goes around what is convex and may wait or wander before what is not.
//! A member whose goal lies inside a solid, outside the fence, or where a lost member may be, stays where it is nearest to it.

mod braking;
mod cell;
mod clearance;
mod deadlock;
mod filter;
mod limits;
mod obstacles;
mod step;
mod ways;

pub(in crate::swarm) use cell::foot;
pub use filter::{Filter, Flags, Seen, Stray};
pub use limits::{Limits, Place, SafetyError};
pub use obstacles::{Obstacle, Obstacles};
