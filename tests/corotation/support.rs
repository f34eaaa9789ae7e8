//! Beams fitted to a rectangle, clamped at one end and loaded at the other.

use flockform::flock::body::Body;
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::law::{Flock, Weights};
use flockform::flock::rules::{Mean, Rotation, Rule};
use flockform::flock::vectors::Vectors;
use flockform::geometry::outline::Outline;
use flockform::geometry::shape::Shape;
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::fit::fit;
use flockform::material::weights::assemble;
use flockform::solve::corotated::{self, CorotatedError};
use flockform::solve::equilibrium::{Choice, Request, Solved, Solver};

use crate::tractions;

pub const KINDS: [fn(f64) -> LatticeKind; 6] = [
    |h| LatticeKind::Square { spacing: h },
    |h| LatticeKind::Rectangular { a: h, b: 0.8 * h },
    |h| LatticeKind::CentredRectangular { a: h, b: h },
    |h| LatticeKind::Hexagonal { spacing: h },
    |h| LatticeKind::Oblique { a: h, b: h, angle: 70f64.to_radians() },
    // By the distance of the centres of its hexagons.
    |h| LatticeKind::Honeycomb { spacing: h / 3f64.sqrt() },
];

pub fn sheet(young: f64, poisson: f64) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane: Plane::Stress }, 1.0).expect("admissible")
}

/// Plane strain: near nu = 1/2 its dilatations are averaged.
pub fn slice(young: f64, poisson: f64) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane: Plane::Strain }, 1.0).expect("admissible")
}

pub fn fibres() -> Elastic {
    let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
    Elastic::new(constants, 1.0).expect("admissible")
}

/// A beam from x = 0 to `length`, of depth 1, its left end clamped.
pub struct Beam {
    pub body: Body,
    pub flock: Flock,
    pub follows: Vec<bool>,
    pub held_axes: Vec<[bool; 2]>,
}

impl Beam {
    /// With a dead load on the right end, spread evenly over it.
    pub fn new(kind: LatticeKind, length: f64, elastic: &Elastic, load: [f64; 2]) -> Self {
        let shape = Shape::Rectangle { min: [0.0, -0.5], max: [length, 0.5] };
        let outline = Outline::of_shape(&shape).expect("a rectangle");
        let fitted = fit(&Lattice::new(kind, [0.0, -0.5], 0.0), &outline).expect("fits");
        let (body, cells) = (fitted.body, fitted.cells);
        let at = |x: f64, i: u32| (body.reference.x[i as usize] - x).abs() < 1e-9;
        let sides = cells.boundary_sides(&cells.incidence(body.count())).into_iter();
        let end = sides.filter(|&[a, b]| at(length, a) && at(length, b));
        let forces = tractions::forces(&body.reference, end.map(|side| (side, [load; 2])));
        let near = cells.neighbours(body.count(), elastic);
        let weights = assemble(&cells, &body, &near, elastic, Rotation::Corotated).expect("holds");
        let flock = Flock {
            rule: Rule { mean: Mean::Material { rotation: Rotation::Corotated }, ..Rule::BARYCENTRE },
            reference: body.reference.clone(),
            neighbours: near,
            weights: Weights::Matrix(weights),
            forces: Some(forces),
            rest: None,
            keeps_rest: false,
            bonds: None,
        };
        let follows = (0..body.count() as u32).map(|i| !at(0.0, i)).collect();
        Self { body, flock, follows, held_axes: Vec::new() }
    }

    /// The same held along x alone at its left end, and at its lowest particle altogether: as a plane of symmetry.
    pub fn on_rollers(mut self) -> Self {
        let places = &self.body.reference;
        let lowest = (0..self.body.count())
            .filter(|&i| !self.follows[i])
            .min_by(|&a, &b| places.y[a].total_cmp(&places.y[b]));
        self.held_axes = vec![[false; 2]; self.body.count()];
        for i in (0..self.body.count()).filter(|&i| Some(i) != lowest) {
            if !std::mem::replace(&mut self.follows[i], true) {
                self.held_axes[i] = [true, false];
                if let Weights::Matrix(weights) = &mut self.flock.weights {
                    weights.hold(i, [true, false]);
                }
            }
        }
        self.flock.keep_rest();
        self
    }

    pub fn solved_by(&self, solver: Solver) -> Solved {
        self.solve_by(solver).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn solve_by(&self, solver: Solver) -> Result<Solved, CorotatedError> {
        let way = |_: f64| Vectors::zeros(self.body.count());
        let request = Request { solver: Choice::This(solver), tolerance: 1e-12, ..Request::default() };
        corotated::solve(
            (&self.flock, &self.body),
            self.follows.clone(),
            self.held_axes.clone(),
            &corotated::Way::whole(&way),
            &request,
            None,
        )
    }

    pub fn load(&self, i: usize) -> [f64; 2] {
        self.flock.forces.as_ref().map_or([0.0; 2], |forces| forces.get(i))
    }

    pub fn moved(&self, displacement: &Vectors) -> Vectors {
        let places = self.body.reference.iter().zip(displacement.iter());
        places.map(|([x, y], [u, v])| [x + u, y + v]).collect()
    }

    /// Displacement of the loaded end: the mean by the shares of the load.
    pub fn of_the_end(&self, displacement: &Vectors) -> [f64; 2] {
        let (mut sum, mut all) = ([0.0; 2], 0.0);
        for (i, [u, v]) in displacement.iter().enumerate() {
            let [a, b] = self.load(i);
            let share = a.hypot(b);
            all += share;
            sum = [sum[0] + share * u, sum[1] + share * v];
        }
        sum.map(|s| s / all)
    }
}
