//! PE1 as filled contours over the deformed body.

use super::Subject;
use super::axes::Axes;
use super::bands::{Bands, Sample, at_least, triangles};
use super::configuration::dot_radius;
use super::faces::faces;
use super::heading::Heading;
use super::page;
use super::svg::{Path, Svg};
use crate::continuum::record::Snapshot;

/// PE1 comes from differences of positions, whose last digits are rounding: what is below the
/// square of this many spacings is no deformation.
const NOISE_IN_SPACINGS: f64 = 1e-10;

/// Filled contours over the faces of the lattice; particles in no whole face, and bodies whose
/// neighbours are no function of the lattice, as dots in the colours of the same bands. Frame and
/// ghosts, which are no matter, are left out.
pub fn pe1(subject: &Subject<'_>, snapshot: &Snapshot) -> String {
    let spacing = subject.body.lattice.spacing();
    let is_somewhere = |i: &usize| snapshot.positions.get(*i).iter().all(|v| v.is_finite());
    let drawn = || subject.drawn(&snapshot.roles).filter(is_somewhere);
    let ends = drawn()
        .map(|i| snapshot.pe1[i])
        .fold([f64::NEG_INFINITY; 2], |[below, high], value| [below.max(-value), high.max(value)]);
    let [below, high] = subject.largest(ends);
    let bands = Bands::around(-below, high, (NOISE_IN_SPACINGS * spacing).powi(2));
    let bands = bands.named("PE1", format!("{}²", subject.unit));
    let axes = page::around(subject.bounds(page::bounds(&snapshot.positions, drawn())), spacing);
    let note = format!("first pseudo-energy, {}", page::note(subject, snapshot));
    let mut heading = Heading { title: subject.title.into(), note, ..Heading::default() };
    if subject.is_raster() {
        let count = subject.count(drawn().count());
        heading.note += &format!("; {count} particles drawn as squares of their largest value");
    }
    page::with_body(&heading, axes, subject.unit, bands.bar_room(), |svg, axes| {
        if subject.is_raster() {
            let value = |i: usize| (axes.place(snapshot.positions.get(i)), snapshot.pe1[i]);
            bands.draw_raster(svg, (axes, spacing), drawn().map(value), subject.team);
        } else {
            let mut is_drawn = vec![false; snapshot.roles.len()];
            drawn().for_each(|i| is_drawn[i] = true);
            draw_contours(svg, axes, subject, (snapshot, &snapshot.pe1), &is_drawn, &bands);
        }
        bands.draw_bar(svg, axes);
    })
}

/// Filled contours of these values of the particles that are drawn, shape \[count\] each.
pub(super) fn draw_contours(
    svg: &mut Svg,
    axes: &Axes,
    subject: &Subject<'_>,
    (snapshot, values): (&Snapshot, &[f64]),
    is_drawn: &[bool],
    bands: &Bands,
) {
    let mut is_alone = is_drawn.to_vec();
    let sample = |&i: &u32| (axes.place(snapshot.positions.get(i as usize)), values[i as usize]);
    let mut patches: Vec<Vec<Sample>> = Vec::new();
    // Where neighbours are found anew at every step the faces of the lattice mean nothing.
    let faces = match (subject.cells, subject.neighbours) {
        // Along an outline that was kept cells have other shapes.
        (Some(cells), _) if subject.body.outline.is_some() => cells.iter().map(<[u32]>::to_vec).collect(),
        (_, Some(_)) => faces(subject.body, is_drawn, &snapshot.broken),
        _ => Vec::new(),
    };
    for face in faces {
        face.iter().for_each(|&corner| is_alone[corner as usize] = false);
        patches.push(face.iter().map(sample).collect());
    }
    draw_bands(svg, &patches, bands);
    let radius = dot_radius(axes, subject.body.lattice.spacing());
    for i in (0..is_alone.len()).filter(|&i| is_alone[i]) {
        let attributes = format!("fill=\"{}\"", bands.colour(bands.of(values[i])));
        svg.group(attributes, |svg| svg.circle(axes.place(snapshot.positions.get(i)), radius));
    }
}

/// Filled contours over patches, each with the field at its corners.
pub(super) fn draw_bands(svg: &mut Svg, patches: &[Vec<Sample>], bands: &Bands) {
    // Every band is laid over all of what is at least as high, so that no seam shows between bands.
    for band in 0..bands.count() {
        let path = superlevel(patches, (band > 0).then(|| bands.level(band)));
        svg.path(&path, format_args!("class=\"band\" fill=\"{}\"", bands.colour(band)));
    }
}

/// The area in which the field is at least `level`; everywhere if there is none.
fn superlevel(patches: &[Vec<Sample>], level: Option<f64>) -> Path {
    let mut path = Path::default();
    for patch in patches {
        let is_above = |&(_, value): &Sample| level.is_none_or(|level| value >= level);
        match level {
            _ if patch.iter().all(is_above) => path.polygon(patch.iter().map(|&(point, _)| point)),
            Some(level) if patch.iter().any(is_above) => {
                for part in triangles(patch).into_iter().map(|triangle| at_least(level, triangle)) {
                    if part.len() > 2 {
                        path.polygon(part);
                    }
                }
            }
            _ => {}
        }
    }
    path
}
