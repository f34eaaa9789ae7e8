//! The components of the stress of a body's cells, where the cells are.

use super::Subject;
use super::axes::Axes;
use super::comparison::scale_note;
use super::heading::Heading;
use super::page::{self, Bounds};
use super::panels::{MOST_CELLS, Panel, Scale, Sheet, arranged};
use super::stress::{bounds, enlarged};
use crate::continuum::record::Snapshot;
use crate::flock::rules::Rotation;
use crate::material::cells::Cells;
use crate::material::stress::StressState;

const NAMES: [&str; 3] = ["xx", "yy", "xy"];
/// Stress below this part of the largest is rounding.
const NOISE: f64 = 1e-9;

/// Every whole cell three times, in the colours of its stresses xx, yy and xy on one scale: red is tension, blue pressure.
/// Cells are in their places, or in those of displacements enlarged as the heading says.
pub fn components(
    subject: &Subject<'_>,
    snapshot: &Snapshot,
    (cells, rotation): (&Cells, Rotation),
    stresses: &[StressState],
    unit: &str,
) -> String {
    let (places, factor) = enlarged(subject, snapshot);
    let spacing = subject.body.lattice.spacing();
    let (axes, is_row) = window(bounds(subject, snapshot, &places), spacing);
    let own = || subject.owned(cells).filter_map(|cell| Some((cell, stresses.get(cell)?.components)));
    let finite = own().flat_map(|(_, components)| components).filter(|s| s.is_finite());
    let [largest] = subject.largest([finite.fold(0.0, |largest: f64, s| largest.max(s.abs()))]);
    let of = |k: usize| -> Vec<f64> {
        let mut values = vec![f64::NAN; cells.count()];
        // Rounding has no sign worth a colour.
        let value = |s: f64| if s.abs() < NOISE * largest { 0.0 } else { s };
        own().for_each(|(cell, components)| values[cell] = value(components[k]));
        values
    };
    let by_component = [0, 1, 2].map(of);
    let panels =
        [0, 1, 2].map(|k| Panel { name: NAMES[k], stress: &by_component[k], places: &places, scale: 0 });
    let mut note = format!(
        "stresses xx, yy and xy in the cells{}, {}{}",
        axes_note(rotation),
        page::note(subject, snapshot),
        scale_note(factor)
    );
    let count = subject.count(subject.owned(cells).count());
    let is_raster = subject.is_raster() || count > MOST_CELLS;
    if is_raster {
        note += &format!("; {count} cells drawn as squares of their largest value");
    }
    let heading = Heading { title: subject.title.into(), note, ..Heading::default() };
    let scales = vec![Scale::around_zero("stress", largest, 10.0)];
    let (team, stress_unit, unit) = (subject.team, unit, subject.unit);
    Sheet { axes, is_row, scales, heading, cells, is_raster, team, unit, stress_unit, spacing }.draw(&panels)
}

/// Words on the axes of stresses where they are not those of the plane.
fn axes_note(rotation: Rotation) -> &'static str {
    match rotation {
        Rotation::Small => "",
        Rotation::Corotated => ", in axes that turn with each cell",
    }
}

/// The plot of each component, and whether the three stand in a row.
pub(in crate::export) fn window(bounds: Option<Bounds>, spacing: f64) -> (Axes, bool) {
    arranged(|room| page::within(bounds, spacing, room))
}
