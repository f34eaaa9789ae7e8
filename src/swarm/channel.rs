//! The channel between a robot and its observers: noise, delay, loss, and the false poses of a faulty robot.
//! Every member has a seeded random stream of its own, so that one channel's randomness depends neither on
//! the other members nor on the order of queries.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;

use super::watch::Pose;
use crate::flock::splitmix;
use crate::geometry::point::plus;
use crate::scene::swarm::raw::{RawFaultKind, RawFlight};

/// Parameters of a channel. The default one delivers every pose at once and unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChannelParams {
    /// Standard deviation of each coordinate \[m\], default 0.
    pub noise: f64,
    /// Periods that every pose takes \[1\], default 0.
    pub delay: u32,
    /// Up to so many periods more, all equally likely \[1\], default 0. Poses keep their order: one that
    /// takes long holds back those behind it.
    pub jitter: u32,
    /// Probability that a pose is lost \[1\], default 0.
    pub loss: f64,
    /// Probability that it comes once more, a period later \[1\], default 0.
    pub duplication: f64,
}

impl ChannelParams {
    /// Those with which a simulated flight begins.
    pub(super) fn of(flight: &RawFlight) -> Self {
        let RawFlight { noise, delay, jitter, loss, duplicates: duplication, .. } = *flight;
        Self { noise, delay, jitter, loss, duplication }
    }
}

/// The channel of one member. Time is counted in periods, so that no rounding decides when a pose arrives.
#[derive(Clone, Debug)]
pub struct Channel {
    params: ChannelParams,
    /// The fault of the robot that sends.
    fault: Option<RawFaultKind>,
    /// Where the robot began to lie \[m\].
    frozen_at: Option<[f64; 2]>,
    /// A stream for each cause: what is lost does not change the noise on what is not.
    noise: Pcg64Mcg,
    network: Pcg64Mcg,
    lies: Pcg64Mcg,
    /// In the order of arrival.
    on_the_way: Vec<Arrival>,
    /// Arrival of the last pose, duplicates left aside \[period\].
    last: u64,
}

#[derive(Clone, Copy, Debug)]
struct Arrival {
    period: u64,
    /// Behind all that arrive in the same period for the first time.
    is_again: bool,
    pose: Pose,
}

impl Channel {
    /// The same `seed` and `member` give the same channel, on every machine.
    pub fn new(params: ChannelParams, seed: u64, member: usize) -> Self {
        let stream = |cause: u64| stream(seed, member as u64, cause);
        Self {
            params,
            fault: None,
            frozen_at: None,
            noise: stream(0),
            network: stream(1),
            lies: stream(2),
            on_the_way: Vec::new(),
            last: 0,
        }
    }

    /// Sends as these say from the next pose on.
    pub(crate) fn set_params(&mut self, params: ChannelParams) {
        self.params = params;
    }

    /// The parameters by which it sends.
    pub fn params(&self) -> ChannelParams {
        self.params
    }

    /// From the next pose on.
    pub(crate) fn set_fault(&mut self, fault: Option<RawFaultKind>) {
        if fault != self.fault {
            (self.fault, self.frozen_at) = (fault, None);
        }
    }

    /// Sends the pose of the robot in this period, the true one but for its fault; periods must not go back. Of a silent robot poses
    /// already on their way still arrive.
    pub fn send(&mut self, period: u64, pose: Pose) {
        if matches!(self.fault, Some(RawFaultKind::Silent | RawFaultKind::Dead)) {
            return;
        }
        let pose = self.by_fault(pose);
        let pose = self.noisy(pose);
        // All drawn for every pose, so that one probability does not change what another decides; one more than are needed, as
        // recorded flights have it.
        let [lost, held_up, doubled, _] = [(); 4].map(|()| self.network.random::<f64>());
        let params = &self.params;
        if lost < params.loss {
            return;
        }
        let jitter = (held_up * (f64::from(params.jitter) + 1.0)) as u64;
        self.last = self.last.max(period + u64::from(params.delay) + jitter);
        let is_doubled = doubled < params.duplication;
        self.put(Arrival { period: self.last, is_again: false, pose });
        if is_doubled {
            self.put(Arrival { period: self.last + 1, is_again: true, pose });
        }
    }

    /// Hands over what has arrived up to this period, in the order of arrival.
    pub fn deliver(&mut self, period: u64) -> impl Iterator<Item = Pose> + '_ {
        let arrived = self.on_the_way.partition_point(|arrival| arrival.period <= period);
        self.on_the_way.drain(..arrived).map(|arrival| arrival.pose)
    }

    fn put(&mut self, arrival: Arrival) {
        let key = |a: &Arrival| (a.period, a.is_again);
        let place = self.on_the_way.partition_point(|other| key(other) <= key(&arrival));
        self.on_the_way.insert(place, arrival);
    }

    fn noisy(&mut self, pose: Pose) -> Pose {
        // One more than is needed, as recorded flights have it.
        let [x, y, _] = [(); 3].map(|()| self.noise.sample::<f64, _>(StandardNormal));
        let noise = self.params.noise;
        Pose { position: [pose.position[0] + noise * x, pose.position[1] + noise * y], ..pose }
    }

    /// The pose that the robot sends in place of the true one; its stamp stays true.
    fn by_fault(&mut self, pose: Pose) -> Pose {
        use RawFaultKind::{Dead, Frozen, NotANumber, Offset, Random, Silent, Stuck, WrongFrame};
        let moved = |by: [f64; 2]| plus(pose.position, by);
        let position = match &self.fault {
            None | Some(Silent | Dead | Stuck) => return pose,
            Some(WrongFrame) => return Pose { frame_is_right: false, ..pose },
            Some(Offset { by }) => moved(*by),
            Some(Frozen) => *self.frozen_at.get_or_insert(pose.position),
            Some(Random { within }) => {
                // The root spreads them evenly over the disc.
                let [far, turn] = [(); 2].map(|()| self.lies.random::<f64>());
                let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
                moved([cos, sin].map(|c| within * far.sqrt() * c))
            }
            Some(NotANumber) => [f64::NAN; 2],
        };
        Pose { position, ..pose }
    }
}

/// A random stream for each seed, member and cause, 0 to 3.
pub(super) fn stream(seed: u64, member: u64, cause: u64) -> Pcg64Mcg {
    let base = mixed(mixed(seed) ^ member.wrapping_mul(4).wrapping_add(cause));
    Pcg64Mcg::new(u128::from(base) << 64 | u128::from(mixed(base)))
}

/// Neighbouring seeds give streams that have nothing in common.
fn mixed(seed: u64) -> u64 {
    splitmix::mixed(seed.wrapping_add(splitmix::STEP))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(period: u64) -> Pose {
        Pose { position: [period as f64, 1.0], yaw: 0.5, stamp: period as f64, frame_is_right: true }
    }

    /// The poses that arrive in each period when the member sends in every one.
    fn heard(mut channel: Channel, periods: u64) -> Vec<Vec<Pose>> {
        let mut heard = Vec::new();
        for period in 0..periods {
            channel.send(period, pose(period));
            heard.push(channel.deliver(period).collect());
        }
        heard
    }

    fn stamps(params: ChannelParams, periods: u64) -> Vec<f64> {
        heard(Channel::new(params, 7, 3), periods).concat().iter().map(|pose| pose.stamp).collect()
    }

    #[test]
    fn the_default_channel_changes_nothing() {
        let expected: Vec<_> = (0..50).map(|period| vec![pose(period)]).collect();
        assert_eq!(heard(Channel::new(ChannelParams::default(), 1, 0), 50), expected);
    }

    #[test]
    fn a_delay_is_kept_to_the_period_and_jitter_within_its_bounds() {
        let delayed = heard(Channel::new(ChannelParams { delay: 3, ..Default::default() }, 1, 0), 50);
        for (period, poses) in delayed.iter().enumerate() {
            assert_eq!(*poses, if period < 3 { vec![] } else { vec![pose(period as u64 - 3)] });
        }
        let params = ChannelParams { delay: 2, jitter: 4, ..Default::default() };
        let jittered = heard(Channel::new(params, 1, 0), 2000);
        let mut seen = [0; 5];
        for (period, poses) in jittered.iter().enumerate() {
            poses.iter().for_each(|pose| seen[period - 2 - pose.stamp as usize] += 1);
        }
        assert!(seen.iter().all(|&count| count > 50), "{seen:?}");
        assert!(stamps(params, 2000).is_sorted(), "jitter keeps the order");
    }

    #[test]
    fn losses_and_duplicates_come_as_often_as_asked() {
        let periods = 20_000;
        let near = |count: usize, share: f64| (count as f64 / periods as f64 - share).abs() < 0.015;
        let lossy = |loss| stamps(ChannelParams { loss, ..Default::default() }, periods).len();
        assert!(near(lossy(0.3), 0.7) && near(lossy(0.8), 0.2));
        assert_eq!((lossy(1.0), lossy(0.0)), (0, 20_000));
        let doubled = stamps(ChannelParams { duplication: 0.25, ..Default::default() }, periods);
        assert!(near(doubled.len(), 1.25), "{}", doubled.len());
    }

    #[test]
    fn noise_has_the_deviation_asked_for_and_is_the_same_whatever_is_lost() {
        let noise = ChannelParams { noise: 0.3, ..Default::default() };
        let heard_through = |params| heard(Channel::new(params, 5, 9), 20_000).concat();
        let all = heard_through(noise);
        let deviation = |error: &dyn Fn(&Pose) -> f64| {
            (all.iter().map(|p| error(p).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
        };
        assert!((deviation(&|p| p.position[0] - p.stamp) - 0.3).abs() < 0.01);
        assert!((deviation(&|p| p.position[1] - 1.0) - 0.3).abs() < 0.01);
        let some = heard_through(ChannelParams { loss: 0.5, ..noise });
        assert!(some.len() < 11_000 && some.iter().all(|pose| *pose == all[pose.stamp as usize]));
    }

    #[test]
    fn a_channel_depends_on_its_seed_and_member_alone() {
        let params = ChannelParams { noise: 0.1, delay: 1, jitter: 3, loss: 0.3, duplication: 0.2 };
        let alone = heard(Channel::new(params, 11, 4), 300);
        // Beside another that sends at its own pace, and asked more than once.
        let (mut one, mut other) = (Channel::new(params, 11, 4), Channel::new(params, 11, 5));
        for period in 0..300 {
            (0..period % 3).for_each(|_| other.send(period, pose(period)));
            other.deliver(period).for_each(drop);
            one.send(period, pose(period));
            let poses: Vec<Pose> = one.deliver(period).collect();
            assert_eq!(poses, alone[period as usize]);
            assert_eq!(one.deliver(period).count(), 0);
        }
        assert_ne!(heard(Channel::new(params, 11, 5), 300), alone);
        assert_ne!(heard(Channel::new(params, 12, 4), 300), alone);
    }

    #[test]
    fn a_dead_robot_is_silent_once_what_was_on_its_way_has_arrived() {
        let mut channel = Channel::new(ChannelParams { delay: 2, ..Default::default() }, 1, 0);
        let counts: Vec<usize> = (0..10)
            .map(|period| {
                channel.set_fault((4..7).contains(&period).then_some(RawFaultKind::Dead));
                channel.send(period, pose(period));
                channel.deliver(period).count()
            })
            .collect();
        assert_eq!(counts, [0, 0, 1, 1, 1, 1, 0, 0, 0, 1]);
    }

    #[test]
    fn each_lie_sends_the_poses_that_it_describes() {
        let sent = |lie: RawFaultKind| {
            let mut channel = Channel::new(ChannelParams::default(), 1, 0);
            channel.send(0, pose(0));
            (1..9).for_each(|period| {
                channel.set_fault(Some(lie.clone()));
                channel.send(period, pose(period));
            });
            let poses: Vec<Pose> = channel.deliver(9).collect();
            assert_eq!(poses[0], pose(0), "honest so far");
            assert!(poses.iter().enumerate().all(|(k, pose)| pose.stamp == k as f64));
            poses[1..].iter().map(|pose| pose.position).collect::<Vec<_>>()
        };
        assert_eq!(sent(RawFaultKind::Offset { by: [10.0, -2.0] })[3], [14.0, -1.0]);
        assert_eq!(sent(RawFaultKind::Frozen), [[1.0, 1.0]; 8]);
        assert!(sent(RawFaultKind::NotANumber).iter().all(|p| p[0].is_nan() && p[1].is_nan()));
        let random = sent(RawFaultKind::Random { within: 0.5 });
        let away = |k: usize| (random[k][0] - (k + 1) as f64).hypot(random[k][1] - 1.0);
        assert!((0..8).all(|k| away(k) <= 0.5) && away(0) != away(1));
    }
}
