//! Lattices, bodies of whole cells and a material to try things with.

use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::outlay::Outlay;
use flockform::material::cells::{Cells, templates};
use flockform::material::elastic::{Constants, Elastic};

/// The six lattices, of about unit size.
pub const KINDS: [LatticeKind; 6] = LatticeKind::SAMPLES;

/// The body of a material on whole cells: of the sites that are at the corner of one.
pub fn of_whole_cells(
    lattice: &Lattice,
    cut: &Cut,
    neighbourhood: &Neighbourhood,
) -> (Body, Neighbours, Cells) {
    let outlay = Outlay { lattice, cut, neighbourhood, frame: None, cells: templates(lattice) };
    let (body, neighbours) = outlay.lay_out(None).expect("builds");
    let cells = Cells::of_body(&body);
    (body, neighbours, cells)
}

/// A material stiff along fibres that are turned.
pub fn fibres() -> Elastic {
    let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
    Elastic::new(constants, 0.7).expect("admissible")
}
