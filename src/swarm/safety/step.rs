//! One member's part of a tick: its cell, and its step within it.

use super::cell::{HalfPlane, length, shortened};
use super::deadlock::Tick;
use super::filter::{Filter, Flags, Seen, places};
use super::ways::Border;
use crate::flock::vectors::distance;
use crate::geometry::point::{dot, minus, plus};

/// A member's wanted way at this tick, and its reach.
#[derive(Clone, Copy)]
struct MotionRequest {
    /// To the wanted place \[m\], relative to the member.
    way: [f64; 2],
    /// Its length \[m\].
    distance: f64,
    /// The way in one period by the limits of speed and acceleration \[m\], with that since its pose.
    step: f64,
    /// Radius within which the cell has to be complete \[m\]: the step, and the way it takes to brake after it.
    reach: f64,
}

/// Where a member's step begins, in the cell that is built around that place.
struct Outset {
    /// \[m, world frame\]
    here: [f64; 2],
    /// The velocity that a limit of acceleration holds it to \[m/s\]; `None` where none does, or the cell comes first.
    velocity: Option<[f64; 2]>,
    request: MotionRequest,
    origins: Origins,
}

/// The origins of a cell's planes, by their index: first members, then obstacles, then the fence.
#[derive(Clone, Copy)]
struct Origins {
    obstacles: usize,
    fence: usize,
}

/// Share of its size within which a member is as near as it gets to a goal that it cannot reach \[1\].
const ARRIVED: f64 = 0.5;

/// Share of the distance to keep that the shape cast leaves to rounding \[1\].
const CAST_TOLERANCE: f64 = 1e-7;

/// A violation of the distance to keep by less than this share of it is rounding \[1\].
pub(super) const TOUCHING: f64 = 1e-9;

impl Filter {
    /// The place from which a member is sent on and its target \[m, world frame\], with the reasons for changing that.
    pub(super) fn target(
        &mut self,
        seen: &Seen,
        wanted: [f64; 2],
        period: f64,
        member: usize,
    ) -> ([[f64; 2]; 2], Flags) {
        let pose = seen.present.get(member);
        if !seen.known[member] || !minus(wanted, pose).iter().all(|value| value.is_finite()) {
            self.detours[member].reset();
            self.cell.planes.clear();
            return ([pose; 2], Flags(Flags::HELD));
        }
        let brakes = self.crowd.brakes;
        let place = self.place(seen, period, member);
        let Outset { here, velocity, mut request, origins } =
            self.set_out(seen, wanted, place, period, member);
        let way = request.way;
        let open = shortened(way, request.reach);
        let mut flags = self.why(open, origins);
        if velocity.is_some() && !brakes {
            self.leave_room_to_brake(&mut request, period, &mut flags);
        }
        let hindered = flags != Flags::default() || velocity.is_some();
        let goal = if !hindered && self.detours[member].is_fresh() {
            open
        } else {
            self.around(seen, &request, here, member, &mut flags)
        };
        let step = match velocity {
            Some(velocity) if brakes => {
                let promised = self.promised(seen, member);
                self.brakable(velocity, promised, goal, period, &mut flags)
            }
            Some(velocity) => {
                shortened(self.steered(velocity, goal, period, (&request, origins), &mut flags), request.step)
            }
            None => shortened(goal, request.step),
        };
        let step = if brakes { step } else { self.unmoved_by_noise(here, step, &request, member) };
        let step = if here == place.0 { step } else { self.within_speed(step, minus(place.0, here), period) };
        let step = self.cast(here, step, origins, member);
        if request.distance > request.step {
            flags.0 |= Flags::SPEED_LIMITED;
        }
        // An unchanged way gives the wanted target to the last bit.
        let target = if step == way { wanted } else { plus(here, step) };
        ([here, target], flags)
    }

    /// What the member's step begins with, from a place \[m, world frame\] or, where that is not in its cell, into that: as far as it may
    /// be sent from there \[m\], or from its pose.
    fn set_out(
        &mut self,
        seen: &Seen,
        wanted: [f64; 2],
        (here, most): ([f64; 2], f64),
        period: f64,
        member: usize,
    ) -> Outset {
        let (pose, way) = (seen.present.get(member), minus(wanted, here));
        let velocity = self.motion(seen, period, member);
        let mut request = self.request(velocity, way, period, most);
        let origins = self.enclose(seen, &mut request, here, member);
        let lag = distance(pose, here);
        if lag == 0.0 || self.cell.excess([0.0; 2]) <= TOUCHING * lag {
            return Outset { here, velocity, request, origins };
        }
        // Where it was sent is no longer its own: it goes back into its cell, or is not waited for, at any acceleration.
        let whole = self.limits.speed * period;
        // No point that is nearest to the wanted one is farther, if its pose is in the cell.
        let reach = whole.min(2.0 * length(way) + lag);
        let mut request = MotionRequest { reach, ..self.request(None, way, period, whole) };
        let origins = self.enclose(seen, &mut request, here, member);
        if !self.cell.is_empty(request.reach) {
            return Outset { here, velocity: None, request, origins };
        }
        let most = self.most_from_pose(seen, period, member);
        let mut request = self.request(None, minus(wanted, pose), period, most);
        let origins = self.enclose(seen, &mut request, pose, member);
        Outset { here: pose, velocity: None, request, origins }
    }

    /// The place from which a member is sent on \[m, world frame\], and how far it may be sent from there \[m\]: that of its pose, or,
    /// where poses are late or noisy, the one to which it was last sent, if it is there or on its way there. The step from where it is
    /// seen is not the step it makes: each would lose what noise puts the pose back by, and gain nothing where it puts it forward,
    /// since the member goes no faster, and one that turns first would turn after the noise. One that lags is waited for.
    fn place(&self, seen: &Seen, period: f64, member: usize) -> ([f64; 2], f64) {
        let (pose, last) = (seen.present.get(member), self.sent.get(member));
        let (ahead, margin, most) =
            (self.ahead(seen, member), self.limits.margin(), self.limits.speed * period);
        let from_pose = (pose, self.most_from_pose(seen, period, member));
        if self.crowd.brakes || !last.iter().all(|x| x.is_finite()) {
            return from_pose;
        }
        let is_near = self.is_on_its_way(seen, period, member);
        if self.limits.arrives && seen.known[member] && self.is_inexact(seen, period, member) {
            let is_there = is_near || seen.ages[member] > (1.0 - TOUCHING) * period || margin > 0.0;
            return if is_there { (last, most) } else { from_pose };
        }
        // Two late poses give no velocity.
        let is_inexact =
            ahead > 0.0 || (self.velocity(seen, member).is_some() && self.is_inexact(seen, period, member));
        if !is_near || !(is_inexact || margin > 0.0) {
            return from_pose;
        }
        let room = self.longest_step(period, ahead) + 2.0 * margin - distance(last, pose);
        (last, room.clamp(0.0, most))
    }

    /// How far a member may be sent from its pose \[m\]: a period on, and the time since. Nothing says that one that is not on its way
    /// has gone on by a limit that was higher.
    fn most_from_pose(&self, seen: &Seen, period: f64, member: usize) -> f64 {
        let ahead = self.ahead(seen, member);
        self.limits.speed * period + if ahead > 0.0 { self.limits.speed * ahead } else { 0.0 }
    }

    fn request(&self, velocity: Option<[f64; 2]>, way: [f64; 2], period: f64, step: f64) -> MotionRequest {
        let distance = length(way);
        match velocity {
            None => MotionRequest { way, distance, step, reach: distance.min(step) },
            Some(velocity) => {
                let most = self.limits.acceleration;
                // One whose limit has been lowered slows down.
                let top = (length(velocity) + most * period).min(self.limits.speed.max(length(velocity)));
                let reach = if self.crowd.brakes {
                    // To the end of the longest step, and of the braking after it.
                    0.5 * period * length(velocity) + self.braking().covered([top, 0.0], period)[0]
                } else {
                    top * period + top * top / (2.0 * most)
                };
                MotionRequest { way, distance, step: step.min(top * period), reach }
            }
        }
    }

    /// The velocity at which the member is taken to go \[m/s\], where a limit asks for it. Late poses are of places that the
    /// member has left, and two noisy ones give no velocity: it is then taken to go from target to target. Those that
    /// brake have estimates.
    fn motion(&self, seen: &Seen, period: f64, member: usize) -> Option<[f64; 2]> {
        let velocity = self.velocity(seen, member)?;
        let [last, before] = [&self.sent, &self.sent_before].map(|sent| sent.get(member));
        let is_known = last.iter().chain(&before).all(|x| x.is_finite());
        if self.brakes(seen) || !self.is_inexact(seen, period, member) {
            return Some(velocity);
        }
        if !is_known {
            // What noise makes of two places may be any velocity: one that was sent nowhere yet is taken to stand.
            return Some(if self.limits.deviation > 0.0 { [0.0; 2] } else { velocity });
        }
        Some(shortened([0, 1].map(|k| (last[k] - before[k]) / period), self.limits.speed))
    }

    /// The place at which a member stands as soon as it can \[m, world frame\]: where its targets are known not behind it, as the place
    /// of a late pose is.
    pub(crate) fn stopping_place(&self, seen: &Seen, period: f64, member: usize) -> [f64; 2] {
        let (here, last) = (seen.present.get(member), self.sent.get(member));
        if self.brakes(seen) {
            // A velocity that is off moves the place where it seems to come to rest.
            let (rest, (_, error)) = (self.resting_place(seen, period, member), self.promised(seen, member));
            return if distance(last, rest) <= error { last } else { rest };
        }
        // One that was not sent anywhere near, as far as that is limited, or is seen where it is, stops there.
        let is_bounded = self.limits.speed.is_finite() || self.limits.acceleration.is_finite();
        let is_on_its_way = is_bounded && self.is_on_its_way(seen, period, member);
        let from = if is_on_its_way && self.is_inexact(seen, period, member) { last } else { here };
        // No faster than it was sent: one that is pushed, or carried away, has no way to brake.
        let before = self.sent_before.get(member);
        let sent = length(minus(last, before)) / period;
        let most = if is_on_its_way && sent.is_finite() { sent.min(self.limits.speed) } else { 0.0 };
        let way = self.motion(seen, period, member).map_or([0.0; 2], |velocity| {
            let velocity = shortened(velocity, most);
            velocity.map(|v| v * length(velocity) / (2.0 * self.limits.acceleration))
        });
        plus(from, way)
    }

    /// The member's velocity, where there is one and a limit that asks for it.
    pub(super) fn velocity(&self, seen: &Seen, member: usize) -> Option<[f64; 2]> {
        let velocity = seen.velocity.filter(|_| self.limits.acceleration.is_finite())?.get(member);
        velocity.iter().all(|value| value.is_finite()).then_some(velocity)
    }

    /// Builds the member's cell; with more reach where it stands too near to something, since it then moves away.
    fn enclose(
        &mut self,
        seen: &Seen,
        request: &mut MotionRequest,
        here: [f64; 2],
        member: usize,
    ) -> Origins {
        let origins = self.cell_around(seen, request.reach, here, member);
        let away = self.radii[member] + self.largest_radius + self.limits.clearance;
        if request.reach >= away || !self.cell.planes.iter().any(|plane| plane.offset < -TOUCHING * away) {
            return origins;
        }
        request.reach = away.min(request.step).max(request.reach);
        self.cell_around(seen, request.reach, here, member)
    }

    /// Builds the member's cell, which is that of its pose, relative to a place \[m, world frame\].
    fn cell_around(&mut self, seen: &Seen, reach: f64, here: [f64; 2], member: usize) -> Origins {
        let from = minus(here, seen.present.get(member));
        let origins = self.build_cell(seen, reach + length(from), member);
        for plane in &mut self.cell.planes {
            plane.offset -= dot(plane.normal, from);
        }
        origins
    }

    fn build_cell(&mut self, seen: &Seen, reach: f64, member: usize) -> Origins {
        self.cell.planes.clear();
        let noise = seen.strays.map_or(0.0, |strays| strays[member].error);
        // Borders that come within reach once the noise is taken off count too.
        let reach = reach + noise;
        self.find(seen, reach, member);
        let here = seen.present.get(member);
        let drift = self.drift(seen, member);
        let margin = self.limits.margin();
        let brakes = self.crowd.brakes;
        let last = self.sent.get(member);
        let was_sent = self.ahead(seen, member) > 0.0 && last.iter().all(|x| x.is_finite());
        let standing = if was_sent { last } else { here };
        for k in 0..self.crowd.found.len() {
            let other = self.crowd.found[k] as usize;
            let stray = drift + self.drift(seen, other);
            let keep = self.keep(member, other);
            // Two at the very same place part: the lower number to the left.
            let aside = if member < other { [1.0, 0.0] } else { [-1.0, 0.0] };
            let there = seen.present.get(other);
            let border = || {
                let ways = [member, other].map(|m| &self.crowd.ways[m]);
                Border { ways, places: places(seen, other), keep, stray, reach }
            };
            let are_between = || [member, other].iter().all(|&m| !places(seen, m).is_empty());
            // Of those that stand where they are seen, but for rounding, all of this is the border between their poses.
            let goes_on = |m: usize| self.crowd.ways[m].extent > TOUCHING * keep;
            let go_on = stray > 0.0 || goes_on(member) || goes_on(other);
            let is_added = if brakes {
                let border = border();
                let takes_ways = !border.ways.iter().all(|ways| ways.is_point());
                if takes_ways {
                    border.add(&mut self.cell.planes);
                }
                takes_ways
            } else {
                are_between() && go_on && border().add_between(member < other, &mut self.cell.planes)
            };
            // A lost one need not do what it was sent to: then it is anywhere by its age, to which nothing more comes near.
            if !is_added || (!brakes && stray > 0.0 && !seen.known[other]) {
                let parts = (keep, !is_added);
                add_border(&mut self.cell.planes, [here, there, aside], standing, parts, stray, reach);
            }
        }
        let obstacles = self.cell.planes.len();
        let radius = self.radii[member] + margin;
        let ways = &self.crowd.ways[member];
        // Where it is, or comes to rest, and how far it may be from there. Its way back begins at the end of that on which it is.
        let (hull, drift, gone) = if brakes || places(seen, member).is_empty() {
            (&ways.way[..], drift, 0.0)
        } else {
            (&ways.corners[..], 0.0, ways.extent)
        };
        let reach = reach + drift + gone;
        self.obstacles.planes_near(here, hull, radius + self.limits.clearance, reach, &mut self.cell.planes);
        let fence = self.cell.planes.len();
        self.fence.planes_near(here, hull, radius, reach, &mut self.cell.planes);
        for plane in &mut self.cell.planes[obstacles..] {
            plane.offset = aged(plane.offset - drift, plane.offset);
        }
        if noise > 0.0 {
            for plane in &mut self.cell.planes {
                plane.offset = aged(plane.offset - noise, plane.offset);
            }
        }
        Origins { obstacles, fence }
    }

    /// The step, or the way back to the place last sent where that is no farther out of an empty cell. There a member hardly goes
    /// anywhere from its pose, and would go after the noise of its poses, tick by tick, into whatever it is pressed against.
    fn unmoved_by_noise(
        &self,
        here: [f64; 2],
        step: [f64; 2],
        request: &MotionRequest,
        member: usize,
    ) -> [f64; 2] {
        let back = minus(self.sent.get(member), here);
        let is_noise = length(back) <= 2.0 * self.limits.margin();
        if !is_noise || !self.cell.is_empty(request.reach) {
            return step;
        }
        let back = shortened(back, request.step);
        if self.cell.excess(back) <= self.cell.excess(step) { back } else { step }
    }

    /// The step, or less of the way to its end from where the member was sent, relative to its pose \[m\]: that is the way that it makes.
    /// One that lags need not have the cell in which that place was.
    fn within_speed(&self, step: [f64; 2], from: [f64; 2], period: f64) -> [f64; 2] {
        let (way, most) = (minus(step, from), self.limits.speed * period);
        let on = shortened(way, most);
        if on == way {
            return step;
        }
        let end = plus(from, on);
        let leaves =
            |plane: &HalfPlane| dot(plane.normal, end) > plane.offset.max(0.0) + TOUCHING * length(end);
        if !self.limits.arrives && self.cell.planes.iter().any(leaves) { shortened(step, most) } else { end }
    }

    /// The origins of the planes between the member and the end of its way.
    fn why(&self, way: [f64; 2], origins: Origins) -> Flags {
        let mut flags = Flags::default();
        for (k, plane) in self.cell.planes.iter().enumerate() {
            if dot(plane.normal, way) > plane.offset {
                flags.0 |= match k {
                    k if k >= origins.fence => Flags::GEOFENCED,
                    k if k >= origins.obstacles => Flags::OBSTRUCTED,
                    _ => Flags::SEPARATED,
                };
            }
        }
        flags
    }

    /// The point of the cell to go to: the nearest to the wanted one or, of a detour, to its aim.
    fn around(
        &mut self,
        seen: &Seen,
        request: &MotionRequest,
        here: [f64; 2],
        member: usize,
        flags: &mut Flags,
    ) -> [f64; 2] {
        let MotionRequest { way, distance, step, reach } = *request;
        let place = plus(here, way);
        let direct = self.cell.nearest(way, reach);
        let size = self.radii[member] + self.limits.clearance;
        // Nearer to its goal than its own size, a member waits for the one that stands there; as near as solids and lost members
        // let it come to one that they hide, it has arrived.
        let is_hidden = || {
            let lost = self.nearest_to_lost(seen, (place, reach), member);
            let nearest = self.nearest_to_stand(place, member).max(lost);
            nearest > 0.0 && distance <= nearest + ARRIVED * size
        };
        if distance <= size || distance == 0.0 || is_hidden() {
            self.detours[member].reset();
            return direct;
        }
        let scale = if size > 0.0 { size.min(step) } else { step }.min(distance);
        let detour = &mut self.detours[member];
        let goal = if detour.is_active() {
            flags.0 |= Flags::RESOLVING_DEADLOCK;
            // Its room to brake is in the borders: that up to the goal, which may be none, is that of the straight way.
            self.cell.nearest(detour.aim(way), scale)
        } else {
            direct
        };
        let straight = self.cell.share(shortened(way, scale));
        let direct = shortened(direct, scale);
        let tick = Tick { size, scale, goal: place, wanted: way, distance, straight, direct, moved: goal };
        detour.update(self.limits.patience, &tick);
        goal
    }

    /// Distance from a place to the nearest one at which obstacles and the fence let the member stand \[m\], where one of them is
    /// in the way; negative where it can stand there.
    fn nearest_to_stand(&self, place: [f64; 2], member: usize) -> f64 {
        let radius = self.radii[member] + self.limits.margin();
        let obstacles = radius + self.limits.clearance - self.obstacles.distance(place);
        obstacles.max(radius - self.fence.distance(place))
    }

    /// Distance from a place to the nearest one at which the lost members around this one, which reaches so far \[m\], let it stand,
    /// as far from them as it is \[m\]; negative where it can stand there.
    fn nearest_to_lost(&self, seen: &Seen, (place, reach): ([f64; 2], f64), member: usize) -> f64 {
        let lost = self.crowd.found.iter().map(|&other| other as usize).filter(|&other| !seen.known[other]);
        let nearest = lost.map(|other| {
            let keep = self.keep(member, other);
            let stray =
                if self.crowd.brakes { 0.0 } else { self.drift(seen, member) + self.drift(seen, other) };
            let there = seen.present.get(other);
            // Where the border by age begins to leave it nothing, or as far as it is: inside it comes no nearer to the middle.
            let least = keep + stray;
            let border =
                if stray > 0.0 { f64::hypot(least + 2.0 * reach * stray / least, stray) } else { keep };
            let disc = border.min(distance(seen.present.get(member), there));
            (disc - distance(place, there)).max(keep - self.crowd.ways[other].distance(place))
        });
        nearest.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Distance that the places of two members have to keep \[m\].
    fn keep(&self, member: usize, other: usize) -> f64 {
        self.radii[member] + self.radii[other] + self.limits.clearance + 2.0 * self.limits.margin()
    }

    /// Brings the cell's borders and the end of the way as near as the member can go in a period and brake
    /// in time after it, `v T + v^2 / (2 a)` being the room from where it is: a member that kept to this at the last tick
    /// can do so at this one, as long as the borders stay.
    fn leave_room_to_brake(&mut self, request: &mut MotionRequest, period: f64, flags: &mut Flags) {
        let most = self.limits.acceleration;
        // The difference of two times would lose all its digits where the limit is large.
        let step = |room: f64| {
            let time = (period * period + 2.0 * room / most).sqrt();
            (2.0 * room * period / (time + period)).min(room)
        };
        let end = self.cell.nearest(request.way, request.reach);
        let brakable = step(length(end));
        // At the border or beyond it as it is, there is nothing to bring nearer.
        for plane in self.cell.planes.iter_mut().filter(|plane| plane.offset > 0.0) {
            plane.offset = step(plane.offset);
        }
        if brakable < request.step.min(request.distance) {
            flags.0 |= Flags::ACCELERATION_LIMITED;
        }
        request.reach = request.step.min(brakable);
    }

    /// The step nearest to a goal in the cell that changes the velocity no faster than allowed; the cell
    /// comes first where it leaves none.
    fn steered(
        &self,
        velocity: [f64; 2],
        goal: [f64; 2],
        period: f64,
        (request, origins): (&MotionRequest, Origins),
        flags: &mut Flags,
    ) -> [f64; 2] {
        let change = [0, 1].map(|k| goal[k] / period - velocity[k]);
        let held = shortened(change, self.limits.acceleration * period);
        if held == change {
            return goal;
        }
        flags.0 |= Flags::ACCELERATION_LIMITED;
        let next = [0, 1].map(|k| (velocity[k] + held[k]) * period);
        flags.0 |= self.why(next, origins).0;
        self.cell.nearest(next, request.step)
    }

    /// Cuts the step where a disc cast along it touches a solid. The cell prevents that already: this
    /// is a check by another algorithm. Members that start too near a solid are on their way out of it.
    fn cast(&self, here: [f64; 2], step: [f64; 2], origins: Origins, member: usize) -> [f64; 2] {
        let solids = &self.cell.planes[origins.obstacles..origins.fence];
        let disc = (self.radii[member] + self.limits.clearance) * (1.0 - CAST_TOLERANCE);
        // A member that brakes does not go straight.
        if self.crowd.brakes
            || solids.is_empty()
            || disc <= 0.0
            || solids.iter().any(|plane| plane.offset < 0.0)
        {
            return step;
        }
        let share = self.obstacles.free_way(here, plus(here, step), disc);
        [share * step[0], share * step[1]]
    }
}

/// Appends the half-planes that keep a member `here` on its own side of another, if they can matter
/// within `reach` \[m\]: the module's docs prove it. `aside` is the direction to it where both stand at
/// the very same place; `standing` is where the member stands if it goes nowhere. They keep a distance \[m\]; where they are
/// perhaps nearer the member goes away if it is to, and else comes no nearer.
#[inline]
fn add_border(
    planes: &mut Vec<HalfPlane>,
    [here, there, aside]: [[f64; 2]; 3],
    standing: [f64; 2],
    (keep, go_away): (f64, bool),
    stray: f64,
    reach: f64,
) {
    let way = minus(there, here);
    let distance = length(way);
    let normal = if distance > 0.0 { [way[0] / distance, way[1] / distance] } else { aside };
    let fresh = (distance - keep) / 2.0;
    if stray == 0.0 {
        if fresh < reach || fresh <= 0.0 {
            planes.push(HalfPlane { normal, offset: fresh });
        }
        return;
    }
    let sine = (stray / distance).min(1.0);
    let cosine = (1.0 - sine * sine).sqrt();
    let turned = (2.0 - 2.0 * cosine).sqrt() * reach;
    let offset = (distance * cosine - stray - keep) / 2.0 - turned;
    if offset >= 0.0 && sine < 1.0 {
        if offset < reach {
            planes.push(HalfPlane { normal, offset });
        }
        return;
    }
    // Perhaps too near already: away from every place where the other may be, or no move at all. A late pose is not where a
    // member stands that was sent on, and a noisy one is none to follow.
    let way = minus(there, standing);
    let distance = length(way);
    let normal = if distance > 0.0 { way.map(|x| x / distance) } else { aside };
    let away = if go_away { ((distance - keep) / 2.0).min(0.0) } else { 0.0 };
    let mut push = |normal: [f64; 2], offset: f64| {
        planes.push(HalfPlane { normal, offset: offset + dot(normal, minus(standing, here)) });
    };
    push(normal, away);
    // Inside the disc no direction leads away from all of it: a member that is parted otherwise may leave.
    if sine >= 1.0 && !go_away {
        return;
    }
    for sine in [sine, -sine] {
        push([cosine * normal[0] - sine * normal[1], sine * normal[0] + cosine * normal[1]], 0.0);
    }
    if sine >= 1.0 {
        push([-normal[0], -normal[1]], -away);
    }
}

/// Age alone pushes no member back: at most it keeps the member where it stands.
fn aged(offset: f64, fresh: f64) -> f64 {
    offset.max(fresh.min(0.0))
}
