//! Lattices and a material to try things with.

use flockform::flock::lattice::LatticeKind;
use flockform::material::elastic::{Constants, Elastic};

/// The six lattices, of about unit size.
pub const KINDS: [LatticeKind; 6] = LatticeKind::SAMPLES;

/// A material stiff along fibres that are turned.
pub fn fibres() -> Elastic {
    let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
    Elastic::new(constants, 0.7).expect("admissible")
}
