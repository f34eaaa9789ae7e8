//! One period of the loop as a linear map, taken from the loop itself, column by column.

use nalgebra::{DMatrix, DVector};

use crate::flock::vectors::{Vectors, distance};
use crate::swarm::formation::{Formation, Seen};

/// Most followers for the dense algebra of noise and lag: more would take seconds.
const MOST_FOLLOWERS: usize = 150;

/// Relative error of a lag found by leading \[1\].
const STEADY: f64 = 1e-6;

/// Most targets computed along one axis in that, one for each robot and sweep: more would take seconds.
const MOST_TARGETS: f64 = 3e7;

/// One period of the loop as a map of what is seen.
pub(super) struct PeriodMap {
    /// Next places of the followers for the seen ones, shape \[2 followers, 2 followers\].
    own: DMatrix<f64>,
    /// The same for those of the leaders, shape \[2 followers, 2 leaders\].
    led: DMatrix<f64>,
}

impl PeriodMap {
    /// `None` where the rule is not linear, a scene leads or a frame remembers, and for too many followers.
    pub(super) fn of(formation: &Formation, sweeps: usize) -> Option<Self> {
        let has_frame = formation.engine().is_none_or(|engine| engine.body().frame.is_some());
        let (leaders, followers): (Vec<usize>, Vec<usize>) =
            (0..formation.count()).partition(|&m| formation.leads(m));
        let is_small = !followers.is_empty() && followers.len() <= MOST_FOLLOWERS;
        formation.settled(&formation.places).filter(|_| formation.is_led_here() && !has_frame && is_small)?;
        let mut formation = formation.clone();
        let base = next(&mut formation, None, sweeps);
        let mut columns = |members: &[usize]| {
            let mut map = DMatrix::zeros(2 * followers.len(), 2 * members.len());
            for (n, (&m, axis)) in members.iter().flat_map(|m| [(m, 0), (m, 1)]).enumerate() {
                let moved = next(&mut formation, Some((m, axis)), sweeps);
                for (k, &follower) in followers.iter().enumerate() {
                    let (now, then) = (moved.get(follower), base.get(follower));
                    (map[(2 * k, n)], map[(2 * k + 1, n)]) = (now[0] - then[0], now[1] - then[1]);
                }
            }
            map
        };
        Some(Self { own: columns(&followers), led: columns(&leaders) })
    }

    /// `None` where noise adds up without bound.
    pub(super) fn noise_gain(&self) -> Option<f64> {
        /// Doublings of the time over which noise is summed: more than 10^9 periods.
        const DOUBLINGS: usize = 30;
        let mut power = self.own.clone();
        let mut covariance = &self.own * self.own.transpose() + &self.led * self.led.transpose();
        for _ in 0..DOUBLINGS {
            let added = &power * &covariance * power.transpose();
            let is_summed = added.amax() <= 1e-12 * covariance.amax();
            covariance += added;
            if is_summed {
                return Some(covariance.diagonal().max().max(0.0).sqrt());
            }
            power = &power * &power;
        }
        None
    }

    /// The largest lag of a follower behind leaders that move by 1 in a period along any of these axes \[period\].
    pub(super) fn lag(&self, axes: [bool; 2]) -> Option<f64> {
        let size = self.own.nrows();
        let along = |axis: usize| {
            let ones = |n: usize| DVector::from_fn(n, |k, _| if k % 2 == axis { 1.0 } else { 0.0 });
            let seen = &self.own * ones(size) + &self.led * ones(self.led.ncols());
            (DMatrix::identity(size, size) - &self.own).lu().solve(&seen).map(|lag| lag.amax())
        };
        largest(axes, along)
    }
}

/// The largest of the lags along these axes; `None` where one is not known.
fn largest(axes: [bool; 2], along: impl Fn(usize) -> Option<f64>) -> Option<f64> {
    let all: Option<Vec<f64>> = (0..2).filter(|&axis| axes[axis]).map(along).collect();
    all?.into_iter().reduce(f64::max).filter(|lag| lag.is_finite())
}

/// The largest lag of a follower behind leaders that move by 1 in a period along any of these axes \[period\], by leading the formation
/// until its lag is steady: it forgets all but `factor` of what it lacks of that in a period, behind poses that are late by `delay`
/// periods. `None` where that takes long.
pub(super) fn lag_when_led(
    (formation, sweeps): (&Formation, usize),
    axes: [bool; 2],
    factor: f64,
    delay: u32,
) -> Option<f64> {
    let late = delay as usize + 1;
    let forgotten = (STEADY.ln() / factor.max(f64::MIN_POSITIVE).ln()).ceil();
    let periods = forgotten + late as f64;
    if periods * (sweeps * formation.count()) as f64 > MOST_TARGETS {
        return None;
    }
    let pace = formation.spacing();
    let along = |axis: usize| {
        let (mut formation, places) = (formation.clone(), &formation.places);
        let moved = |m: usize, way: f64| {
            let mut place = places.get(m);
            place[axis] += way;
            place
        };
        let all = vec![true; formation.count()];
        // The last ones, of which the oldest are seen.
        let mut present = vec![places.clone(); late];
        let mut targets = places.clone();
        for period in 1..=periods as usize {
            for m in 0..formation.count() {
                // Of the leaders alone.
                formation.take_over(m, moved(m, pace * period as f64), 0.0);
            }
            let present = &mut present[period % late];
            formation.advance(&Seen { present, known: &all }, &mut [], 0.0, sweeps, &mut targets);
            present.clone_from(&targets);
        }
        let behind = |m: usize| distance(moved(m, pace * periods), targets.get(m)) / pace;
        Some((0..formation.count()).map(behind).fold(0.0, f64::max))
    };
    largest(axes, along)
}

/// The members' places after a period at whose start one of them is seen a metre off.
fn next(formation: &mut Formation, off: Option<(usize, usize)>, sweeps: usize) -> Vectors {
    let mut present = formation.places.clone();
    if let Some((m, axis)) = off {
        let mut place = present.get(m);
        place[axis] += 1.0;
        present.set(m, place);
    }
    let all = vec![true; formation.count()];
    let mut targets = present.clone();
    formation.advance(&Seen { present: &present, known: &all }, &mut [], 0.0, sweeps, &mut targets);
    targets
}
