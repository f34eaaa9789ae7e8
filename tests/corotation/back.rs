//! Leaders that come back to where they began.

use flockform::flock::vectors::{Vectors, distance};
use flockform::solve::corotated::{self, Way};
use flockform::solve::equilibrium::{Request, Solved};

use crate::balance::energy;
use crate::support::*;

const LENGTH: f64 = 4.0;

fn unloaded() -> Beam {
    Beam::new(KINDS[0](0.5), LENGTH, &sheet(100.0, 0.3), [0.0; 2])
}

fn on_the_right(beam: &Beam) -> Vec<usize> {
    (0..beam.body.count()).filter(|&i| (beam.body.reference.x[i] - LENGTH).abs() < 1e-9).collect()
}

/// The equilibria after each increment of the way.
fn in_increments(beam: &Beam, held: &(dyn Fn(f64) -> Vectors + Sync), count: u32) -> Vec<Solved> {
    let (mut all, mut last): (Vec<Solved>, f64) = (Vec::new(), 0.0);
    let request = Request { tolerance: 1e-12, ..Request::default() };
    for k in 1..=count {
        let end = f64::from(k) / f64::from(count);
        let way = Way { held, start: all.last().map(|solved| (&solved.displacement, last)), end };
        let (follows, axes) = (beam.follows.clone(), beam.held_axes.clone());
        let solved = corotated::solve((&beam.flock, &beam.body), follows, axes, &way, &request, None);
        let solved = solved.unwrap_or_else(|error| panic!("{k} of {count}: {error}"));
        all.push(solved);
        last = end;
    }
    all
}

#[test]
fn a_bar_pulled_and_let_back_is_stretched_half_way_and_at_rest_at_the_end() {
    let mut bar = unloaded().on_rollers();
    let right = on_the_right(&bar);
    right.iter().for_each(|&i| bar.held_axes[i] = [true, false]);
    let held = |part: f64| {
        let mut held = Vectors::zeros(bar.body.count());
        right.iter().for_each(|&i| held.set(i, [0.08 * (1.0 - (2.0 * part - 1.0).abs()), 0.0]));
        held
    };
    for (count, half, quarter) in [(4, Some(1), Some(2)), (2, Some(0), None), (1, None, None)] {
        let solved = in_increments(&bar, &held, count);
        // A force of E A / L on a unit of stretch.
        for (k, stretch) in half.map(|k| (k, 0.08)).into_iter().chain(quarter.map(|k| (k, 0.04))) {
            let at = bar.moved(&solved[k].displacement);
            let force: f64 = right.iter().map(|&i| bar.flock.force(i, &at)[0]).sum();
            let stored = energy(&bar, &at);
            assert!((force.abs() - 25.0 * stretch).abs() < 1e-9, "{count}, {k}: {force}");
            assert!((stored - 12.5 * stretch * stretch).abs() < 1e-9, "{count}, {k}: {stored}");
        }
        let last = &solved[solved.len() - 1].displacement;
        assert!(last.iter().all(|u| u[0].hypot(u[1]) < 1e-9), "{count}");
        assert!(energy(&bar, &bar.moved(last)) < 1e-12, "{count}");
    }
}

#[test]
fn a_bar_turned_once_around_at_both_ends_is_never_strained() {
    let mut bar = unloaded();
    on_the_right(&bar).into_iter().for_each(|i| bar.follows[i] = false);
    let turned = |part: f64, [x, y]: [f64; 2]| {
        let (sin, cos) = (part * std::f64::consts::TAU).sin_cos();
        [1.0 + cos * (x - 1.0) - sin * y, sin * (x - 1.0) + cos * y]
    };
    let held = |part: f64| -> Vectors {
        let by = |(i, p): (usize, [f64; 2])| {
            let [x, y] = turned(part, p);
            if bar.follows[i] { [0.0; 2] } else { [x - p[0], y - p[1]] }
        };
        bar.body.reference.iter().enumerate().map(by).collect()
    };
    for count in [1, 8, 12] {
        for (k, solved) in in_increments(&bar, &held, count).iter().enumerate() {
            let (at, part) = (bar.moved(&solved.displacement), (k + 1) as f64 / f64::from(count));
            let apart = bar.body.reference.iter().zip(at.iter()).map(|(p, q)| distance(turned(part, p), q));
            assert!(apart.fold(0.0, f64::max) < 1e-8, "{k} of {count}");
            assert!(energy(&bar, &at) < 1e-12, "{k} of {count}");
        }
    }
}

/// A whole turn of one end leaves it where it began, and the body is not.
#[test]
fn a_bar_turned_once_around_at_one_end_is_not_at_rest_where_it_began() {
    let mut bar = unloaded();
    on_the_right(&bar).into_iter().for_each(|i| bar.follows[i] = false);
    let middle = [0.5 * LENGTH, 0.0];
    let turned_by = |turns: f64, [x, y]: [f64; 2]| {
        let (sin, cos) = (turns * std::f64::consts::TAU).sin_cos();
        let [x, y] = [x - middle[0], y - middle[1]];
        [middle[0] + cos * x - sin * y, middle[1] + sin * x + cos * y]
    };
    let solved = |turns: f64| {
        let held = |part: f64| -> Vectors {
            let by = |p: [f64; 2]| {
                let [x, y] = turned_by(part * turns, p);
                if (p[0] - LENGTH).abs() < 1e-9 { [x - p[0], y - p[1]] } else { [0.0; 2] }
            };
            bar.body.reference.iter().map(by).collect()
        };
        let (follows, axes) = (bar.follows.clone(), bar.held_axes.clone());
        let way = Way::whole(&held);
        corotated::solve((&bar.flock, &bar.body), follows, axes, &way, &Request::default(), None)
    };
    for turns in [1.0, -2.0, 7.0, 11.0, 14.0 + 1.0 / 360.0, 350.0 / 360.0] {
        let reached = match solved(turns) {
            Err(corotated::CorotatedError::Unsettled { part, .. }) => turns.abs() * part,
            other => panic!("{turns} turns: {other:?}"),
        };
        assert!(reached > 0.3 && reached < 0.6, "{turns} turns: {reached} of one");
    }
    assert!(solved(-10.0 / 360.0).is_ok());
}
