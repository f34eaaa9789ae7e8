//! A square of ten by ten robots at unit spacing, led all around.

use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::law::{Flock, Weights};
use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::rules::Rule;
use flockform::flock::vectors::{Vectors, distance};
use flockform::solve::spectrum::scatter;

pub const COUNT: usize = 100;

pub fn square(neighbourhood: Neighbourhood) -> (Vectors, Neighbours) {
    let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0, 0.0], 0.0);
    let cut = Cut::Count { columns: 10, rows: 10 };
    let (body, neighbours) = Body::build(lattice, &cut, &neighbourhood, None).expect("fits");
    (Vectors::clone(&body.reference), neighbours)
}

/// Everybody at the edge leads.
pub fn leads(member: usize) -> bool {
    [member / 10, member % 10].iter().any(|&k| k == 0 || k == 9)
}

pub fn followers() -> impl Iterator<Item = usize> {
    (0..COUNT).filter(|&member| !leads(member))
}

pub fn barycentre(reference: &Vectors, neighbours: Neighbours) -> Flock {
    Flock::new(Rule::BARYCENTRE, reference.clone().into(), neighbours, Weights::Equal)
}

/// Leaders where an affine map takes them, followers scattered by up to a cell about their place in the
/// reference. With the map's image of the reference, where four neighbours bring them to rest.
pub fn stretched(reference: &Vectors) -> (Vectors, Vectors) {
    let image: Vectors =
        reference.iter().map(|[x, y]| [1.2 * x + 0.3 * y + 2.0, 0.9 * y - 0.1 * x]).collect();
    let mut start = image.clone();
    for member in followers() {
        let [x, y] = reference.get(member);
        start.set(member, [x + scatter(2 * member as u64), y + scatter(2 * member as u64 + 1)]);
    }
    (start, image)
}

/// Largest distance of a follower from where it should be \[length\].
pub fn error(present: &Vectors, wanted: &Vectors) -> f64 {
    followers().map(|j| distance(present.get(j), wanted.get(j))).fold(0.0, f64::max)
}
