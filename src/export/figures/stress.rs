//! The von Mises stress of a body: cell by cell, or as contours where it is known along the edges.

use super::Subject;
use super::axes::Axes;
use super::bands::{Bands, Sample};
use super::comparison::{displaced, enlargement, largest_of, scale_note};
use super::energy::draw_bands;
use super::heading::Heading;
use super::page::{self, Bounds};
use crate::continuum::mechanics::Stresses;
use crate::continuum::record::Snapshot;
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::stress::StressState;

/// More cells than this, or more particles than are drawn as dots, are drawn as a raster.
const MOST_SHOWN: usize = 60_000;
/// Stress below this part of the largest is rounding.
const NOISE: f64 = 1e-9;

/// Every whole cell in the colour of its von Mises stress, in its place or, where displacements could not be seen or
/// the body would be lost beside them, in the place of a displacement so many times as large, which the heading says.
/// Along a fitted outline stress is known at the particles: there contours reach the peak at the edge, which no cell has. Bodies of
/// very many cells or particles are drawn as squares of their cells' largest stress.
pub fn stress(
    subject: &Subject<'_>,
    snapshot: &Snapshot,
    cells: &Cells,
    stresses: &Stresses,
    unit: &str,
) -> String {
    let (places, factor) = enlarged(subject, snapshot);
    let shown: Vec<(&[u32], f64)> = subject
        .owned(cells)
        .filter_map(|cell| Some((cells.of(cell), stresses.cells.get(cell)?.von_mises)))
        .filter(|(cell, value)| {
            value.is_finite() && cell.iter().all(|&i| places.get(i as usize).iter().all(|v| v.is_finite()))
        })
        .collect();
    let count = subject.count(shown.len());
    let is_raster = subject.is_raster() || count > MOST_SHOWN;
    let corners = at_corners(cells, stresses).filter(|_| !is_raster);
    let values = shown.iter().map(|(_, value)| *value).chain(corners.iter().flatten().copied().flatten());
    let ends = values.fold([f64::NEG_INFINITY, 0.0], |[below, high], v| [f64::max(below, -v), high.max(v)]);
    let [below, high] = subject.largest(ends);
    let bands = Bands::fine(high.min(-below), high, NOISE * high).named("von Mises stress", unit);
    let spacing = subject.body.lattice.spacing();
    let axes = page::around(bounds(subject, snapshot, &places), spacing);
    let place = if corners.is_some() { "" } else { " in the cells" };
    let mut note =
        format!("von Mises stress{place}, {}{}", page::note(subject, snapshot), scale_note(factor));
    if is_raster {
        note += &format!("; {count} cells drawn as squares of their largest value");
    }
    let heading = Heading { title: subject.title.into(), note, ..Heading::default() };
    page::with_body(&heading, axes, subject.unit, bands.bar_room(), |svg, axes| {
        if is_raster {
            let middle =
                |cell: &[u32]| cell.iter().map(|&i| places.get(i as usize)).collect::<Vectors>().middle();
            let value = |(cell, value): &(&[u32], f64)| (axes.place(middle(cell)), *value);
            bands.draw_raster(svg, (axes, spacing), shown.iter().map(value), subject.team);
        } else if let Some(values) = &corners {
            draw_bands(svg, &patches(axes, &places, &shown, values), &bands);
        } else {
            let corners = |cell: &[u32]| cell.iter().map(|&i| axes.place(places.get(i as usize))).collect();
            let cells = shown.iter().map(|(cell, value)| (corners(cell), *value));
            svg.cells(cells, bands.count(), |value| bands.of(value), |band| bands.colour(band));
        }
        bands.draw_bar(svg, axes);
    })
}

/// The stress at every particle, where it is recovered along the edges and one material makes it continuous; shape
/// \[count\].
fn at_corners(cells: &Cells, stresses: &Stresses) -> Option<Vec<Option<f64>>> {
    let is_known = !stresses.recovered.is_empty() && cells.inclusions.is_empty();
    let of = |stress: &Option<StressState>| {
        stress.map(|stress| stress.von_mises).filter(|value| value.is_finite())
    };
    is_known.then(|| stresses.particles.iter().map(of).collect())
}

/// The cells with the stress at their corners.
fn patches(
    axes: &Axes,
    places: &Vectors,
    shown: &[(&[u32], f64)],
    values: &[Option<f64>],
) -> Vec<Vec<Sample>> {
    let patch = |(cell, own): &(&[u32], f64)| {
        let sample = |&i: &u32| (axes.place(places.get(i as usize)), values[i as usize].unwrap_or(*own));
        cell.iter().map(sample).collect()
    };
    shown.iter().map(patch).collect()
}

/// Lowest and highest of the places of what is matter, of all parts of a body.
pub(super) fn bounds(subject: &Subject<'_>, snapshot: &Snapshot, places: &Vectors) -> Option<Bounds> {
    subject.bounds(page::bounds(places, subject.drawn(&snapshot.roles)))
}

/// Where particles are drawn, and the factor by which their displacements are enlarged for that.
pub(super) fn enlarged(subject: &Subject<'_>, snapshot: &Snapshot) -> (Vectors, f64) {
    let (reference, displacement) =
        (&subject.body.reference, snapshot.positions.since(&subject.body.reference));
    // Large displacements are drawn as they are: a bent body is to look as bent as it is.
    let [largest] = subject.largest([largest_of(&displacement, subject.drawn(&snapshot.roles))]);
    let factor = enlargement(largest, bounds(subject, snapshot, reference)).max(1.0);
    (displaced(reference, &displacement, factor), factor)
}
