//! The control loop's tick: poses in, safe targets out. The simulated flight and the nodes call the same one.
//!
//! A period has four parts: the members' poses; their targets by the rule ([`Formation::advance`]); new targets for
//! members with lost or faulty neighbours; safe targets ([`Filter`]). A member whose pose is not usable gets no target.

mod programs;
pub mod scope;
mod setup;
pub mod state;

use serde::{Deserialize, Serialize};

use programs::{Heard, Programs};

use super::formation::{Formation, LeadSnapshot, Measures, Seen};
use super::robots::{DoubleIntegrator, Robot};
use super::safety::{self, Filter, Flags, Limits, Place, SafetyError, Stray};
use super::transport::Received;
use super::watch::{Gains, Health, Pose, Range, Rejection, Track, Watch};
use crate::flock::manoeuvre::Manoeuvre;
use crate::flock::rounding::at_most;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;

/// The mode of the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Members get targets by the rule.
    #[default]
    Running,
    /// Every member comes to rest as soon as it can and holds that place, until the stop is lifted.
    EmergencyStopped,
    /// No member gets a target.
    Inactive,
}

impl Mode {
    /// The number in messages and in shared memory.
    pub const fn number(self) -> u8 {
        match self {
            Mode::Running => 0,
            Mode::EmergencyStopped => 2,
            Mode::Inactive => 3,
        }
    }
}

/// The part of a loop's state that outlasts its process.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct ControlSnapshot {
    is_stopped: bool,
    /// \[s\]
    program_time: f64,
    /// Periods that the programs have run.
    periods: u64,
    leads: Vec<Option<LeadSnapshot>>,
    /// Where members were last known to be \[m\].
    #[serde(default)]
    places: Vec<[f64; 2]>,
    /// Whether the programs had begun.
    #[serde(default)]
    has_begun: bool,
}

impl ControlSnapshot {
    /// Periods that the programs have run \[1\].
    pub fn periods(&self) -> u64 {
        self.periods
    }
}

/// The place that a member is taken to stand at before any pose of it is believed.
#[derive(Clone, Copy)]
struct Start {
    /// \[m, world frame\]
    place: [f64; 2],
    /// Time for which it may have left it unheard \[s\].
    age: f64,
}

/// The filter's input for members that take time to brake.
#[derive(Clone)]
struct Tracked {
    present: Vectors,
    velocity: Vectors,
    ages: Vec<f64>,
    strays: Vec<Stray>,
}

/// The loop's state. Members by number, positions in \[m\], world frame, times in \[s\].
#[derive(Clone)]
pub struct Control {
    formation: Formation,
    watch: Watch,
    filter: Filter,
    /// Where members are by the targets sent to them.
    tracks: Vec<Track>,
    /// Members whose targets this loop sends.
    serves: Vec<bool>,
    /// Liars tolerated among a member's neighbours.
    max_faulty: usize,
    sweeps: usize,
    period: f64,
    is_stopped: bool,
    is_active: bool,
    ticks: u64,
    programs: Programs,
    /// Members whose poses this loop receives.
    listens: Vec<bool>,
    starts: Vec<Start>,
    now: f64,
    present: Vectors,
    /// Velocities between the last two poses \[m/s\].
    velocity: Vectors,
    known: Vec<bool>,
    usable: Vec<bool>,
    ages: Vec<f64>,
    wanted: Vectors,
    safe: Vectors,
    /// Places that members hold in an emergency stop \[m\].
    held: Vec<Option<[f64; 2]>>,
    tracked: Tracked,
    filtered: Vec<Flags>,
    flags: Vec<u32>,
    rejected: Vec<bool>,
}

impl Control {
    /// # Errors
    /// Names the key of the swarm that cannot be laid out or kept safe.
    pub fn new(swarm: &Swarm) -> Result<Self, SceneError> {
        let formation = Formation::lay_out(swarm)?;
        let (period, count) = (swarm.raw.control.period, formation.count());
        setup::check_commands(swarm, &formation)?;
        let max_faulty = setup::max_faulty(swarm, &formation)?;
        let filter = setup::filter(swarm, &formation)?;
        let watch = setup::watch(swarm, &formation, filter.limits().speed);
        // A robot that gets no target stands.
        let starts = formation.starts(swarm)?.iter().map(|place| Start { place, age: 0.0 }).collect();
        Ok(Self {
            watch: Watch::new(count, watch),
            tracks: vec![Track::default(); count],
            serves: vec![true; count],
            filter,
            max_faulty,
            sweeps: swarm.raw.control.sweeps,
            period,
            is_stopped: false,
            is_active: true,
            ticks: 0,
            programs: Programs::default(),
            listens: vec![true; count],
            starts,
            now: 0.0,
            present: formation.places.clone(),
            velocity: Vectors::zeros(count),
            known: vec![false; count],
            usable: vec![false; count],
            ages: vec![0.0; count],
            wanted: formation.places.clone(),
            safe: formation.places.clone(),
            held: vec![None; count],
            tracked: Tracked {
                present: formation.places.clone(),
                velocity: Vectors::zeros(count),
                ages: vec![0.0; count],
                strays: vec![Stray::default(); count],
            },
            filtered: vec![Flags::default(); count],
            flags: vec![0; count],
            rejected: vec![false; count],
            formation,
        })
    }

    /// Expects poses of these members alone, as a robot's own node does.
    pub(crate) fn listen_to(&mut self, members: &[usize]) {
        self.listens.fill(false);
        members.iter().for_each(|&member| self.listens[member] = true);
    }

    /// Sends targets to these members alone: the targets of others are not known here.
    pub fn serve(&mut self, members: &[usize]) {
        self.serves.fill(false);
        members.iter().for_each(|&member| self.serves[member] = true);
    }

    /// Members, their places, leaders and the rule.
    pub fn formation(&self) -> &Formation {
        &self.formation
    }

    /// The poses accepted from every member.
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// Time from one tick to the next \[s\].
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The loop's way with targets.
    pub fn mode(&self) -> Mode {
        match (self.is_stopped, self.is_active) {
            (true, _) => Mode::EmergencyStopped,
            (false, true) => Mode::Running,
            (false, false) => Mode::Inactive,
        }
    }

    /// When the last tick was \[s\].
    pub(crate) fn now(&self) -> f64 {
        self.now
    }

    /// Ticks so far.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Time that the leaders' programs have run \[s\].
    pub fn program_time(&self) -> f64 {
        self.programs.time(self.period)
    }

    /// Changes the time between two ticks \[s\] from the next one on; false, and nothing changes, where it is not finite and above 0.
    pub fn set_period(&mut self, period: f64) -> bool {
        if !(period.is_finite() && period > 0.0) {
            return false;
        }
        self.programs.before_another(self.period);
        self.filter.stretch_period(period / self.period);
        self.period = period;
        true
    }

    /// The part of the way to its target that a follower goes in a sweep \[1\].
    pub fn damping(&self) -> f64 {
        self.formation.damping()
    }

    /// A pose of `member` that arrives at `now` \[s\].
    ///
    /// # Errors
    /// The reason for rejecting the pose, which then changes the counts alone.
    pub fn receive(&mut self, member: usize, pose: Pose, now: f64) -> Result<(), Rejection> {
        let before = self.watch.pose(member).filter(|before| self.watch.limits().goes_on(before, &pose));
        let verdict = self.watch.receive(member, pose, now);
        match (&verdict, before) {
            (Ok(()), Some(before)) => {
                let v = [0, 1].map(|k| (pose.position[k] - before.position[k]) / (pose.stamp - before.stamp));
                self.velocity.set(member, v);
            }
            // It did not go there from where it was last: in a stop it stays where it is by now.
            (Ok(()), None) => {
                self.velocity.set(member, [0.0; 2]);
                self.held[member] = None;
            }
            (Err(_), _) => self.rejected[member] = true,
        }
        let (dynamics, deviation) = (self.dynamics(), self.filter.limits().deviation);
        match (&verdict, &mut self.tracks[member]) {
            (Ok(()), track) if self.filter.limits().braking().is_some() => {
                track.correct(&pose, &dynamics, self.period, deviation)
            }
            (Ok(()), track) => track.note(&pose, self.period),
            (Err(_), _) => {}
        }
        verdict
    }

    /// All messages that arrive at `now` \[s\].
    ///
    /// # Errors
    /// As [`Control::receive`].
    pub fn take(&mut self, received: Received, now: f64) -> Result<(), Rejection> {
        match received {
            Received::Pose(member, pose) => return self.receive(member, pose, now),
            Received::Range(range) => drop(self.receive_range(range, now)),
            Received::Leader(member, place) => drop(self.place_leader(member, place)),
        }
        Ok(())
    }

    /// A range that arrives at `now` \[s\]; false if it is of no use. Counts where the swarm file has `[ranges]`.
    pub fn receive_range(&mut self, range: Range, now: f64) -> bool {
        self.watch.receive_range(range, now)
    }

    /// The model of members that take time to brake.
    fn dynamics(&self) -> DoubleIntegrator {
        DoubleIntegrator { speed: self.filter.own_speed(), acceleration: self.filter.limits().acceleration }
    }

    /// The velocity \[m/s\] with which a member that takes time to brake ends the next period on its way to a target \[m\];
    /// `None` of others.
    pub fn next_velocity(&self, member: usize, target: [f64; 2]) -> Option<[f64; 2]> {
        self.filter.limits().braking().is_some().then(|| {
            let [position, velocity] =
                [&self.tracked.present, &self.tracked.velocity].map(|of| of.get(member));
            let mut robot = Robot { position, velocity, yaw: 0.0 };
            self.dynamics().step(&mut robot, target, self.period);
            robot.velocity
        })
    }

    /// Gives a leader that is moved from outside its next place \[m\]; false if it is not one, a manoeuvre moves it, or the
    /// place lies where no pose would be believed.
    pub fn place_leader(&mut self, member: usize, place: [f64; 2]) -> bool {
        let now = self.program_time();
        self.is_believed(place) && self.formation.place_leader(member, place, now)
    }

    /// As [`Control::place_leader`], for any leader, whose own program ends with this.
    pub(crate) fn take_over(&mut self, member: usize, place: [f64; 2]) -> bool {
        let now = self.program_time();
        self.is_believed(place) && self.formation.take_over(member, place, now)
    }

    /// Whether a pose at a place \[m\] would be believed.
    pub(crate) fn is_believed(&self, place: [f64; 2]) -> bool {
        let watch = self.watch.limits();
        at_most(distance(place, watch.centre), watch.range)
    }

    /// Moves all leaders by a manoeuvre from the next tick on.
    pub fn begin(&mut self, manoeuvre: &Manoeuvre) {
        let now = self.program_time();
        self.formation.begin(manoeuvre, now);
    }

    /// Brings every member to rest from the next tick on, and holds it there until [`Control::resume`].
    pub fn emergency_stop(&mut self) {
        if !self.is_stopped {
            self.is_stopped = true;
            self.held.fill(None);
        }
    }

    /// Lifts an emergency stop; false if there is none.
    pub fn resume(&mut self) -> bool {
        std::mem::take(&mut self.is_stopped)
    }

    /// Switches the loop on or off; an emergency stop outlasts both. Others may have moved the members in the meantime: one that is
    /// switched on in a stop holds them where they are by then.
    pub fn set_active(&mut self, active: bool) {
        if active && !self.is_active {
            self.held.fill(None);
        }
        self.is_active = active;
    }

    /// The part of the state that outlasts the process, for [`Control::restore`].
    pub fn kept(&self) -> ControlSnapshot {
        ControlSnapshot {
            is_stopped: self.is_stopped,
            program_time: self.program_time(),
            periods: self.programs.periods(),
            leads: self.formation.kept_leads(),
            has_begun: self.programs.had_begun(),
            places: (0..self.formation.count())
                .map(|member| self.watch.place(member).unwrap_or(self.starts[member].place))
                .collect(),
        }
    }

    /// Continues from the state of an earlier loop of the same swarm; an emergency stop holds every member at its
    /// next accepted pose.
    pub fn restore(&mut self, kept: ControlSnapshot) {
        self.programs = Programs::continued(kept.program_time, kept.periods, kept.has_begun);
        self.formation.restore(kept.leads, kept.periods);
        for (member, place) in (0..self.starts.len()).zip(kept.places) {
            self.leave_at(member, place);
        }
        if kept.is_stopped {
            self.emergency_stop();
        }
    }

    /// Begins with a member at the place where an earlier loop left it; it may have gone on to its last target.
    fn leave_at(&mut self, member: usize, place: [f64; 2]) {
        self.starts[member] = Start { place, age: self.watch.limits().age_limit };
    }

    /// Begins anew as `fresh`, a loop of the same swarm before its first tick: what outlasts that is an emergency stop, and
    /// where members were last heard to be.
    pub fn begin_anew(&mut self, fresh: &Self) {
        let earlier = std::mem::replace(self, fresh.clone());
        for member in 0..earlier.starts.len() {
            self.starts[member] = earlier.starts[member];
            if let Some(place) = earlier.watch.place(member) {
                self.leave_at(member, place);
            }
        }
        if earlier.is_stopped {
            self.emergency_stop();
        }
    }

    /// Whether those that are waited for have been heard, so that the leaders' programs run.
    pub fn has_begun(&self) -> bool {
        self.programs.have_begun()
    }

    /// The limits that the filter enforces.
    pub fn limits(&self) -> &Limits {
        self.filter.limits()
    }

    /// # Errors
    /// Names a limit that is none, or by which members would begin, cease or otherwise than so far brake by themselves; the old ones
    /// then stay.
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), SafetyError> {
        if limits.braking() != self.filter.limits().braking() {
            let fault = " is what members brake by, or do not, from the start: give it in the swarm file, with their model";
            return Err(Place::Limit("acceleration").refused(fault));
        }
        self.filter.set_limits(limits)
    }

    /// Moves an obstacle so far from its place in the file \[m\] from the next tick on.
    ///
    /// # Errors
    /// A place where it would be none; it then stays.
    ///
    /// # Panics
    /// If there is no such obstacle.
    pub(crate) fn move_obstacle(&mut self, obstacle: usize, by: [f64; 2]) -> Result<(), SafetyError> {
        let moved = self.filter.obstacles().with_moved(obstacle, by)?;
        self.filter.set_obstacles(moved);
        Ok(())
    }

    /// Sets the part of the way to its target that a follower goes in a sweep \[1\]; false, and nothing changes, where it is not in
    /// 0 to 2.
    pub fn set_damping(&mut self, damping: f64) -> bool {
        let is_one = (0.0..=2.0).contains(&damping);
        if is_one {
            self.formation.set_damping(damping);
        }
        is_one
    }

    /// Applications of the rule in a period \[1\].
    pub fn sweeps(&self) -> usize {
        self.sweeps
    }

    /// Sets the applications of the rule in a period \[1\].
    pub fn set_sweeps(&mut self, sweeps: usize) {
        self.sweeps = sweeps;
    }

    /// One period, at `now` \[s\].
    pub fn tick(&mut self, now: f64) {
        self.ticks += 1;
        self.now = now;
        self.look(now);
        self.follow_tracks(now);
        if self.mode() == Mode::Running {
            self.follow();
        }
        let active = self.is_active;
        let Self { present, velocity, ages, usable: known, tracked, .. } = self;
        let places = &*present;
        let (present, velocity, ages) = match self.filter.limits().braking().is_some() {
            true => (&tracked.present, &tracked.velocity, &tracked.ages),
            false => (&*present, &*velocity, &*ages),
        };
        let seen =
            safety::Seen { present, known, ages, velocity: Some(velocity), strays: Some(&tracked.strays) };
        if !active {
            self.wanted.clone_from(places);
        } else if self.is_stopped {
            for member in (0..known.len()).filter(|&member| known[member]) {
                let stops = || self.filter.stopping_place(&seen, self.period, member);
                let place = *self.held[member].get_or_insert_with(stops);
                self.wanted.set(member, place);
            }
        }
        self.filter.apply(&seen, &self.wanted, self.period, &mut self.safe, &mut self.filtered);
        if !active {
            self.filter.forget();
        }
        for member in 0..self.tracks.len() {
            let target = self.target(member);
            // Others may move it while the loop sends it nothing.
            match active || self.filter.limits().braking().is_some() {
                true => self.tracks[member].send(now, target),
                false => self.tracks[member].forget(),
            }
        }
        for (member, flags) in self.flags.iter_mut().enumerate() {
            if active && self.usable[member] {
                *flags |= self.filtered[member].0;
            }
            if std::mem::take(&mut self.rejected[member]) {
                *flags |= Flags::POSE_REJECTED;
            }
        }
    }

    fn look(&mut self, now: f64) {
        self.watch.look(now);
        self.flags.fill(0);
        for member in 0..self.formation.count() {
            let known = self.watch.place(member);
            self.known[member] = known.is_some();
            self.usable[member] = self.watch.health(member).is_usable();
            // Where a lost member has gone is unknown: an age beyond the limit carries no more information.
            let oldest = self.watch.limits().age_limit;
            let (place, age) = match (known, self.starts[member]) {
                (Some(place), _) => {
                    (place, self.watch.age(member, now).map_or(oldest, |age| age.min(oldest)))
                }
                (None, _) if !self.listens[member] => ([f64::NAN; 2], 0.0),
                (None, Start { place, age }) => (place, if self.serves[member] { age } else { oldest }),
            };
            self.ages[member] = age;
            self.present.set(member, place);
        }
    }

    /// Finds where members may be. Those that take no time to brake are between the places to which they were sent, also where
    /// their poses are fresh: what counts once a pose is lost has to have counted before. Of those that do, estimates the present
    /// states, and where they may be if they do not follow their targets: a lost one is where it was left to itself, one that was
    /// never heard nor sent anything is where it starts. The targets of a member of another node are not known here, and none were
    /// sent to a place that is not of the member's own poses: there the last place counts, with its age, and velocities that are
    /// older still.
    fn follow_tracks(&mut self, now: f64) {
        let dynamics = self.dynamics();
        let gains = Gains::of(dynamics.acceleration, self.period, self.filter.limits().deviation);
        let Tracked { present, velocity, ages, strays } = &mut self.tracked;
        for (member, track) in self.tracks.iter().enumerate() {
            let stray = &mut strays[member];
            let follows = self.serves[member] && track.is_of(self.present.get(member));
            if self.filter.limits().braking().is_none() {
                stray.places.clear();
                // One that was found to lie was elsewhere when it was sent there.
                let is_doubted = self.watch.is_doubted(member);
                if follows && (self.usable[member] || !is_doubted) {
                    track.between(&mut stray.places);
                }
                // A lost one has gone on to its last target, which is not known here.
                let is_oldest = self.ages[member] >= self.watch.limits().age_limit;
                if is_oldest && stray.places.is_empty() && !is_doubted {
                    self.ages[member] += self.period;
                }
                continue;
            }
            if follows {
                let robot = track.at(now, &dynamics, self.period, &mut stray.places);
                present.set(member, robot.position);
                velocity.set(member, robot.velocity);
                ages[member] = 0.0;
                stray.error = track.stray(&robot, now, &dynamics, &gains, self.period);
            } else {
                present.set(member, self.present.get(member));
                velocity.set(member, self.velocity.get(member));
                let stands = !self.known[member] && self.ages[member] == 0.0;
                ages[member] = if stands { 0.0 } else { 2.0 * self.ages[member] + self.period };
                stray.error = 0.0;
                stray.places.clear();
            }
        }
    }

    fn follow(&mut self) {
        let Self { formation, listens, known, programs, .. } = self;
        let heard = || heard(formation, listens, known);
        if !programs.run(self.now, heard) {
            self.wanted.clone_from(&self.present);
            return;
        }
        let time = self.program_time();
        let seen = Seen { present: &self.present, known: &self.known };
        let mut among = Vec::new();
        let leaves_out = self.max_faulty > 0 || self.usable.contains(&false);
        let follows = |&m: &usize| leaves_out && self.usable[m] && !self.formation.leads(m);
        for member in (0..self.formation.count()).filter(follows) {
            if let Some(one) = self.formation.among(member, &self.usable, self.max_faulty) {
                self.flags[member] |= if one.is_one_lost { Flags::NEIGHBOUR_LOST } else { 0 };
                among.push(one);
            }
        }
        self.formation.advance(&seen, &mut among, time, self.sweeps, &mut self.wanted);
        for one in among.iter().filter(|one| one.is_trimmed) {
            self.flags[one.member] |= Flags::TRIMMED;
        }
    }

    /// The member's safe target \[m\]; `None` without a usable pose, and while the loop is inactive.
    pub fn target(&self, member: usize) -> Option<[f64; 2]> {
        (self.is_active && self.usable[member]).then(|| self.safe.get(member))
    }

    /// The member's target by the rule alone \[m\].
    pub fn wanted(&self, member: usize) -> [f64; 2] {
        self.wanted.get(member)
    }

    /// The member's last known position \[m\].
    pub fn position(&self, member: usize) -> Option<[f64; 2]> {
        self.known[member].then(|| self.present.get(member))
    }

    /// The member's heading \[rad\], while its pose is usable.
    pub fn yaw(&self, member: usize) -> Option<f64> {
        self.watch.pose(member).map(|pose| pose.yaw)
    }

    /// How young the member's pose is.
    pub fn health(&self, member: usize) -> Health {
        self.watch.health(member)
    }

    /// Bits of [`Flags`] and of this module, as of the last tick.
    pub fn flags(&self, member: usize) -> u32 {
        self.flags[member]
    }

    /// Age of the member's pose at the last tick \[s\].
    pub fn age(&self, member: usize) -> Option<f64> {
        self.watch.age(member, self.now)
    }

    /// Strain and PE1 from the poses of the last tick; members never seen count at their nominal places.
    pub fn measures(&self) -> Measures {
        self.formation.measures(&self.last_places())
    }

    /// Each member's place of rest with the leaders as they are \[m\]; `None` where the rule is not linear, and while a leader is lost,
    /// which its neighbours leave out.
    pub fn settled(&self) -> Option<Vectors> {
        self.settled_at(&self.last_places())
    }

    /// The same with the leaders at their places in `present` \[m\]. Members that leave out straying neighbours come to rest by no linear
    /// rule, but follow leaders that are all sent the same way.
    pub fn settled_at(&self, present: &Vectors) -> Option<Vectors> {
        if self.max_faulty > 0 {
            return self.formation.moved_together(self.program_time());
        }
        let is_lost = |m: usize| self.formation.leads(m) && self.known[m] && !self.usable[m];
        let any_lost = (0..self.formation.count()).any(is_lost);
        (!any_lost).then(|| self.formation.settled(present)).flatten()
    }

    /// Largest distance of a follower with a usable pose from where it comes to rest \[m\]; `None` also where no follower has one.
    pub fn formation_error(&self) -> Option<f64> {
        let settled = self.settled()?;
        let followers = || (0..self.formation.count()).filter(|&m| !self.formation.leads(m));
        let apart = |m: usize| distance(settled.get(m), self.present.get(m));
        let largest = followers().filter(|&m| self.usable[m]).map(apart).reduce(f64::max);
        largest.or_else(|| followers().next().is_none().then_some(0.0))
    }

    /// Free space around each member \[m\]: see [`Filter::clearance`].
    pub fn clearance(&self, nearest: &mut Vec<f64>) {
        self.filter.clearance(&self.present, nearest);
    }

    /// The filter's view of obstacles and radii, for measures on other places.
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// The members' last known places; those never known are nominal \[m\].
    pub(crate) fn last_places(&self) -> Vectors {
        let mut places = self.formation.places.clone();
        for member in (0..places.len()).filter(|&member| self.known[member]) {
            places.set(member, self.present.get(member));
        }
        places
    }
}

/// Those heard, of the members that this loop listens to.
fn heard(formation: &Formation, listens: &[bool], known: &[bool]) -> Heard {
    let (mut all, mut every_leader, mut a_leader) = (true, true, false);
    for (m, (&known, &listens)) in known.iter().zip(listens).enumerate() {
        let (awaited, leads) = (listens && !known, formation.leads(m));
        all &= !awaited;
        every_leader &= !(awaited && leads);
        a_leader |= known && leads;
    }
    Heard { all, every_leader, a_leader }
}
