//! What is measured of a flight, from where the robots are, not from where they say they are. Errors are those of
//! the robots with which nothing is wrong at the time.

use super::Flight;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::swarm::Swarm;

/// One period of a flight; distances in \[m\].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Sample {
    /// At the end of the period \[s\].
    pub time: f64,
    /// Largest distance of a robot, leaders included, from its place under the leaders' affine motion.
    pub affine_error: Option<f64>,
    /// Largest distance of a follower from where the rule comes to rest behind the leaders as they are.
    pub formation_error: Option<f64>,
    /// Smallest free space between two rims, or a rim and an obstacle, during the period.
    pub clearance: f64,
    /// Largest distance from the continuum run of the same scene.
    pub continuum_error: Option<f64>,
    /// Sum of PE1 over the members \[m^2\].
    pub pe1: f64,
    /// Largest strain of a member's surroundings \[1\].
    pub strain: f64,
    /// Members whose pose is too old to be used.
    pub lost: usize,
}

/// A flight as it went.
#[derive(Clone, Debug)]
pub struct Record {
    pub samples: Vec<Sample>,
    /// Times of `tracks` \[s\].
    pub times: Vec<f64>,
    /// Places at every recorded period \[m\], shape \[recorded, members\].
    pub tracks: Vec<Vectors>,
    /// Length of each robot's way \[m\].
    pub ways: Vec<f64>,
    /// Least free space around each robot \[m\], shape \[members\].
    pub clearances: Vec<f64>,
    every: usize,
    around: Vec<f64>,
}

impl Record {
    pub fn new(swarm: &Swarm, flight: &Flight) -> Self {
        let count = flight.fleet().robots().len();
        Self {
            samples: Vec::new(),
            times: vec![0.0],
            tracks: vec![flight.fleet().places()],
            ways: vec![0.0; count],
            clearances: vec![f64::INFINITY; count],
            every: swarm.raw.flight.record_every,
            around: Vec::new(),
        }
    }

    /// Measures the period just flown; `before` is where the robots were as it began.
    pub fn take(&mut self, flight: &Flight, before: &Vectors) -> Sample {
        let control = flight.control();
        let formation = control.formation();
        let present = flight.fleet().places();
        for (m, way) in self.ways.iter_mut().enumerate() {
            *way += distance(before.get(m), present.get(m));
        }
        control.filter().clearance_on_the_way(before, &present, &mut self.around);
        for (least, &now) in self.clearances.iter_mut().zip(&self.around) {
            *least = least.min(now);
        }
        let worst = |place: &dyn Fn(usize) -> [f64; 2]| {
            let apart = |m: usize| distance(place(m), present.get(m));
            (0..formation.count()).filter(|&m| flight.fleet().is_sound(m)).map(apart).fold(0.0, f64::max)
        };
        let affine = formation.affine(control.program_time());
        let measures = formation.measures(&present);
        let sample = Sample {
            time: flight.fleet().time(),
            affine_error: affine.map(|map| worst(&|m| map.apply(formation.places.get(m)))),
            formation_error: formation.settled(&present).map(|rest| worst(&|m| rest.get(m))),
            clearance: self.around.iter().copied().fold(f64::INFINITY, f64::min),
            continuum_error: flight.continuum_error(),
            pe1: measures.pe1.iter().sum(),
            strain: measures.strain.iter().flatten().map(|s| s.largest()).fold(0.0, f64::max),
            lost: (0..formation.count()).filter(|&m| !control.health(m).is_usable()).count(),
        };
        self.samples.push(sample);
        if (flight.fleet().period() as usize).is_multiple_of(self.every)
            || flight.fleet().period() == flight.periods()
        {
            self.times.push(flight.fleet().time());
            self.tracks.push(present);
        }
        sample
    }
}
