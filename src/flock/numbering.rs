//! Bodies whose particles are given in any order: in which order they lie in memory, and what their user calls them.

use super::vectors::Vectors;

/// Width of a column in spacings. Upright columns of a lattice are at least this far apart, so that its particles,
/// given in any order, get the lattice's own order back.
const WIDTH: f64 = 0.5;

/// The indices of the points column by column, each from its lower end: columns run along the shorter side of the
/// points' bounds and are half a `spacing` \[length\] wide. The order hangs on the places alone, not on the order
/// in which they are given.
///
/// A particle's neighbours then lie in a few streams that move on as it does, as on a lattice, and none lies farther
/// away than a few columns. That is what sweeps live on, with lists and without. It is no space-filling curve, along
/// which what is near in space is near in memory too: along Hilbert's a sweep of one to four million particles takes 1.3
/// to 1.7 times as long as in the columns of a hexagonal lattice, and 1.2 to 1.3 times as long as in these columns of a
/// jumbled cloud. There, columns two spacings wide would be another eighth faster; but they would lose the order of a
/// lattice, which is swept without lists, four times as fast.
pub fn order_in_columns(points: &Vectors, spacing: f64) -> Vec<u32> {
    let Some((low, high)) = points.bounds(0..points.len()) else { return Vec::new() };
    let across = usize::from(high[1] - low[1] > high[0] - low[0]);
    let width = WIDTH * spacing;
    // Half a width ahead, so that the columns of a lattice lie in the middle of their cells.
    let column = |place: [f64; 2]| ((place[across] - low[across]) / width + 0.5) as u64;
    let mut order: Vec<(u64, [f64; 2], u32)> =
        points.iter().zip(0..).map(|(p, i)| (column(p), [p[1 - across], p[across]], i)).collect();
    order.sort_unstable_by(|(c, p, _), (d, q, _)| {
        c.cmp(d).then_with(|| p[0].total_cmp(&q[0])).then_with(|| p[1].total_cmp(&q[1]))
    });
    order.into_iter().map(|(_, _, i)| i).collect()
}

/// How the user knows particles that lie in another order in memory than in the user's list.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbering {
    /// Id of each particle, shape \[count\].
    ids: Vec<u32>,
    /// Particle in each row of the user's list, shape \[count\].
    rows: Vec<u32>,
    /// The particles by ascending id, shape \[count\].
    by_id: Vec<u32>,
}

impl Numbering {
    /// `order` is the row of each particle in the user's list, `ids` the id in each row.
    pub fn new(order: &[u32], ids: &[u32]) -> Self {
        let mut rows = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&row, particle)| rows[row as usize] = particle);
        let ids: Vec<u32> = order.iter().map(|&row| ids[row as usize]).collect();
        let mut by_id: Vec<u32> = (0..ids.len() as u32).collect();
        by_id.sort_unstable_by_key(|&particle| ids[particle as usize]);
        Self { ids, rows, by_id }
    }

    /// The user's id of a particle.
    pub fn id(&self, particle: usize) -> u32 {
        self.ids[particle]
    }

    /// The particle with this id.
    pub fn particle(&self, id: usize) -> Option<usize> {
        let found = self.by_id.binary_search_by_key(&id, |&particle| self.ids[particle as usize] as usize);
        found.ok().map(|at| self.by_id[at] as usize)
    }

    /// The particle in a row of the user's list.
    pub fn in_row(&self, row: usize) -> usize {
        self.rows[row] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::{Body, Cut};
    use super::super::lattice::{Lattice, LatticeKind};
    use super::super::neighbourhood::Neighbourhood;
    use super::*;

    /// Every third point, then the others: 3 must not divide the count.
    fn mixed(points: &Vectors) -> Vectors {
        (0..points.len()).map(|i| points.get(i * 3 % points.len())).collect()
    }

    #[test]
    fn a_lattice_given_in_any_order_gets_its_own_order_back() {
        // An oblique lattice's columns lean; theirs is not the order of upright ones.
        let is_upright = |kind: &LatticeKind| !matches!(kind, LatticeKind::Oblique { .. });
        for kind in LatticeKind::SAMPLES.into_iter().filter(is_upright) {
            let (lattice, near) = (Lattice::new(kind, [0.3, -7.0], 0.0), Neighbourhood::First { keep: None });
            let (cut, spacing) = (Cut::Count { columns: 50, rows: 31 }, lattice.spacing());
            let (body, _) = Body::build(lattice, &cut, &near, None).expect("fits");
            // The longer side of a body has to lie along x, or its columns would run across those of the lattice.
            let (low, high) = body.bounds();
            assert!(
                high[0] - low[0] > high[1] - low[1] && body.count() % 3 != 0,
                "{kind:?}: {}",
                body.count()
            );
            let mixed = mixed(&body.reference);
            let ordered: Vectors =
                order_in_columns(&mixed, spacing).iter().map(|&i| mixed.get(i as usize)).collect();
            assert!(ordered == *body.reference, "{kind:?}");
        }
    }

    #[test]
    fn columns_run_along_the_shorter_side_and_one_place_or_none_is_no_trouble() {
        // Side by side in one column, whichever comes first.
        let level: Vectors = [[0.1, 0.0], [0.0, 0.0], [0.2, 0.0], [9.0, 0.0]].into_iter().collect();
        assert_eq!(order_in_columns(&level, 1.0), [1, 0, 2, 3]);
        let tall: Vectors = [[1.0, 0.0], [0.0, 9.0], [0.0, 0.0], [1.0, 9.0]].into_iter().collect();
        assert_eq!(order_in_columns(&tall, 1.0), [2, 0, 1, 3]);
        assert_eq!(order_in_columns(&[[2.0, 3.0]].into_iter().collect(), 1.0), [0]);
        assert!(order_in_columns(&Vectors::default(), 1.0).is_empty());
    }

    #[test]
    fn ids_rows_and_particles_lead_to_each_other() {
        // Particle 0 is the user's row 2, whose id is 40.
        let numbering = Numbering::new(&[2, 0, 1], &[7, 300, 40]);
        assert_eq!([0, 1, 2].map(|particle| numbering.id(particle)), [40, 7, 300]);
        assert_eq!([7, 40, 300, 1].map(|id| numbering.particle(id)), [Some(1), Some(0), Some(2), None]);
        assert_eq!([0, 1, 2].map(|row| numbering.in_row(row)), [1, 2, 0]);
    }
}
