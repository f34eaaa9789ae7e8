//! Bodies given as a list of points instead of cut from a lattice.

use std::sync::Arc;

use super::body::{Body, BodyError};
use super::grid::CellGrid;
use super::neighbourhood::Neighbours;
use super::numbering::{Numbering, order_in_columns};
use super::outlay::MOST_ENTRIES;
use super::vectors::{Vectors, distance};

/// Points in the order in which their user has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Reference positions \[length\], shape \[count\]; finite, and no two the same.
    pub points: Vectors,
    /// The user's ids of them, shape \[count\]; no two the same.
    pub ids: Vec<u32>,
    /// The median of the distances to the nearest other point \[length\].
    pub spacing: f64,
    /// How many others the points see within the radius, all together.
    pub entries: u64,
}

/// Neighbours within this part more than a radius count as within it, so that the places of a lattice, which are
/// rounded, have the neighbours that the lattice has.
const MARGIN: f64 = 1e-9;

/// Points that are asked how many others they see before all are.
const SAMPLES: usize = 1000;

impl Cloud {
    /// `radius` is that of the neighbourhood \[length\]: entries are those within it.
    ///
    /// # Errors
    /// A radius that holds too many.
    pub fn new(points: Vectors, ids: Vec<u32>, radius: f64) -> Result<Self, BodyError> {
        let (grid, reach) = sorted(&points, radius)?;
        let mut entries = 0;
        // Seen, and not listed: whether there is room for the lists is asked once it is known how long they are.
        let nearest = |i: usize| {
            let mut least = f64::INFINITY;
            grid.each_within(&points, i, reach, |k| {
                entries += 1;
                least = least.min(distance(points.get(i), points.get(k as usize)));
            });
            least
        };
        let mut apart: Vec<f64> = (0..points.len()).map(nearest).collect();
        if entries > MOST_ENTRIES {
            return Err(BodyError::TooManyNeighbours { radius, about: entries, limit: MOST_ENTRIES });
        }
        let widest = points
            .bounds(0..points.len())
            .map_or(0.0, |(low, high)| f64::max(high[0] - low[0], high[1] - low[1]));
        // The nearest of a point that sees none within the radius.
        let beyond = |i: usize| {
            let (mut radius, mut least) =
                (f64::max(reach, widest / (points.len() as f64).sqrt()), f64::INFINITY);
            while least.is_infinite() && radius < 4.0 * widest {
                radius *= 2.0;
                grid.each_within(&points, i, radius, |k| {
                    least = least.min(distance(points.get(i), points.get(k as usize)));
                });
            }
            least
        };
        let alone = apart.iter_mut().enumerate().filter(|(_, apart)| apart.is_infinite());
        alone.for_each(|(i, apart)| *apart = beyond(i));
        let middle = apart.len() / 2;
        let spacing = *apart.select_nth_unstable_by(middle, f64::total_cmp).1;
        // Of a single point the radius is all that is known.
        let spacing = if spacing.is_finite() { spacing } else { radius };
        Ok(Self { points, ids, spacing, entries })
    }
}

impl Body {
    /// The particles of a cloud, in an order that sweeps go through quickly; ids stay the user's. Their neighbours are
    /// those within `radius` \[length\] in the reference configuration, in order of index; none without one.
    ///
    /// # Errors
    /// A radius that holds too many, or none for some particle.
    pub(crate) fn of_cloud(cloud: &Cloud, radius: Option<f64>) -> Result<(Self, Neighbours), BodyError> {
        let Cloud { points, ids, spacing, entries } = cloud;
        let order = order_in_columns(points, *spacing);
        let places: Vectors = order.iter().map(|&row| points.get(row as usize)).collect();
        let neighbours = match radius {
            Some(radius) => within(&places, radius, *entries)?,
            None => Neighbours::from_lists(places.iter().map(|_| [])),
        };
        let body = Self {
            numbering: Some(Arc::new(Numbering::new(&order, ids))),
            ..Self::of_places(places, *spacing)
        };
        match radius.zip((0..body.count()).find(|&i| neighbours.of(i).is_empty())) {
            // The only particle of a body has no neighbour.
            Some((radius, i)) if body.count() > 1 => {
                Err(BodyError::Alone { id: body.id(i), place: body.reference.get(i), radius })
            }
            _ => Ok((body, neighbours)),
        }
    }
}

/// The neighbours of each point, as many as there are in all: the lists take no more memory than that.
fn within(points: &Vectors, radius: f64, entries: u64) -> Result<Neighbours, BodyError> {
    let (grid, reach) = sorted(points, radius)?;
    let mut neighbours = Neighbours { starts: vec![0], index: Vec::with_capacity(entries as usize) };
    for i in 0..points.len() {
        grid.within(points, i, reach, &mut neighbours.index);
        neighbours.starts.push(neighbours.index.len() as u32);
    }
    Ok(neighbours)
}

/// The points in cells in which those within a radius are found, and the radius that is looked in.
///
/// # Errors
/// A radius that holds too many.
fn sorted(points: &Vectors, radius: f64) -> Result<(CellGrid, f64), BodyError> {
    let (reach, all) = (radius * (1.0 + MARGIN), vec![true; points.len()]);
    let mut grid = CellGrid::default();
    grid.fill(points, &all, reach);
    let (mut seen, every) = (Vec::new(), points.len().div_ceil(SAMPLES).max(1));
    let sampled = (0..points.len()).step_by(every);
    sampled.clone().for_each(|i| grid.within(points, i, reach, &mut seen));
    let about = seen.len() as u64 * points.len() as u64 / sampled.len().max(1) as u64;
    if about > MOST_ENTRIES {
        return Err(BodyError::TooManyNeighbours { radius, about, limit: MOST_ENTRIES });
    }
    Ok((grid, reach))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: usize) -> Vectors {
        (0..side * side).map(|i| [0.1 * (i / side) as f64, 0.1 * (i % side) as f64]).collect()
    }

    #[test]
    fn the_places_of_a_lattice_see_its_first_neighbours_in_spite_of_rounding() {
        let points = square(12);
        let ids = (1..=144).rev().collect();
        let cloud = Cloud::new(points, ids, 0.1).expect("a cloud");
        assert!((cloud.spacing - 0.1).abs() < 1e-15);
        let (body, neighbours) = Body::of_cloud(&cloud, Some(0.1)).expect("a body");
        assert_eq!(neighbours.index.len(), 4 * 12 * 11);
        for i in 0..body.count() {
            assert!(neighbours.of(i).is_sorted(), "ascending, so that a sweep reads on");
            // The ids went backwards.
            let row = 144 - body.id(i);
            assert_eq!(body.reference.get(i), cloud.points.get(row));
            assert_eq!((body.particle(body.id(i)), body.in_row(row)), (Some(i), i));
        }
    }

    #[test]
    fn a_few_odd_points_do_not_change_the_spacing_and_one_alone_is_refused_as_a_particle() {
        let odd = [[0.05, 0.049], [0.05, 0.05], [9.0, 9.0]];
        let points: Vectors = square(5).iter().chain(odd).collect();
        let cloud = Cloud::new(points, (1..=28).collect(), 0.15).expect("a cloud");
        assert!((cloud.spacing - 0.1).abs() < 1e-15);
        let error = Body::of_cloud(&cloud, Some(0.15)).expect_err("alone");
        assert_eq!(error, BodyError::Alone { id: 28, place: [9.0, 9.0], radius: 0.15 });
        assert!(Body::of_cloud(&cloud, None).expect("found at every step").1.index.is_empty());
    }

    #[test]
    fn the_spacing_is_that_of_all_points_also_of_those_that_see_none() {
        let wide = (0..36).map(|i| [5.0 * f64::from(i / 6), 5.0 * f64::from(i % 6)]);
        let points: Vectors = wide.chain([[0.5, 0.0]]).collect();
        for radius in [1e-9, 1.0, 6.0] {
            let cloud = Cloud::new(points.clone(), (1..=37).collect(), radius).expect("a cloud");
            assert_eq!(cloud.spacing, 5.0, "{radius}");
        }
        let single = [[3.0, 4.0]].into_iter().collect();
        assert_eq!(Cloud::new(single, vec![1], 0.3).expect("a cloud").spacing, 0.3);
    }

    #[test]
    fn a_radius_that_holds_a_large_body_many_times_over_is_refused() {
        let points = square(200);
        let error = Cloud::new(points, (1..=40_000).collect(), 100.0).expect_err("too many");
        assert!(matches!(error, BodyError::TooManyNeighbours { about: 1_599_960_000, .. }), "{error}");
    }
}
