//! Figures: each is drawn once, as SVG, and its PNG is rendered from that very SVG.
//!
//! [`configuration()`]: the body at a step, in the paper's colours. [`pe1`]: filled contours of the first
//! pseudo-energy over it. [`stress()`] and [`components()`]: the von Mises stress of its cells, and
//! the components of their stress. [`probes()`]: the history of a few particles. [`overlay`] and [`von_mises()`]: what a
//! rule makes of a body beside the truth. Axes of bodies are equal, and every axis carries its unit. SVG is
//! written directly: a figure here is circles, lines and paths, and what matters is where they go.

pub(super) mod axes;
pub(super) mod bands;
pub(crate) mod chart;
mod colour;
mod comparison;
pub(super) mod components;
pub(super) mod configuration;
mod energy;
mod faces;
#[cfg(feature = "swarm")]
pub(crate) mod flight_map;
pub(super) mod heading;
mod letters;
pub(super) mod page;
pub(super) mod panels;
pub(super) mod png;
pub(super) mod probes;
mod raster;
mod stress;
mod svg;
pub(crate) use svg::escaped;
pub(crate) mod sweep;
mod ticks;
mod von_mises;

use std::path::PathBuf;

use super::OutputFolder;
use super::error::{ExportError, write_file};
use crate::engine::Engine;
use crate::engine::setup::RoleChange;
use crate::flock::body::Body;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::role::Role;
use crate::material::cells::Cells;
use crate::ranks::Team;
use crate::scene::Scene;
pub use colour::SERIES;
pub(super) use comparison::displaced;
pub use comparison::{Pair, overlay};
pub use components::components;
pub use configuration::configuration;
pub use energy::pe1;
use page::Bounds;
pub use probes::probes;
pub use stress::stress;
pub use svg::INK;
pub use von_mises::von_mises;

/// The body that a figure shows.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The heading of the figure.
    pub title: &'a str,
    /// Name of the unit of length.
    pub unit: &'a str,
    /// The particles at rest.
    pub body: &'a Body,
    /// How many there are in all parts of the body, or in the one that these are a sample of.
    pub total: usize,
    /// The bonds of the body; `None` where neighbours are found anew at every step.
    pub neighbours: Option<&'a Neighbours>,
    /// Between the particles, where the scene has a material.
    pub cells: Option<&'a Cells>,
    /// Roles that particles take, single components among them.
    pub changes: &'a [RoleChange],
    /// The unit of the run's clock: `step` or `increment`.
    pub counts: &'static str,
    /// Whether the body was solved for its equilibrium: no steps lead there.
    pub is_solved_at_once: bool,
    /// The ranks that draw it together, if each has a part of the body; the first one has the figure in the end.
    pub team: Option<&'a Team>,
}

impl<'a> Subject<'a> {
    /// The body of a running or ended engine.
    pub fn of(scene: &'a Scene, engine: &'a Engine) -> Self {
        Self {
            title: &scene.raw.title,
            unit: scene.unit(),
            body: engine.body(),
            total: engine.body().total(),
            neighbours: engine.lasting_neighbours(),
            cells: engine.cells(),
            changes: engine.changes(),
            counts: scene.counts(),
            is_solved_at_once: scene.is_solved_at_once(),
            team: engine.parted(),
        }
    }

    /// Whether its particles are too many for each to be seen.
    fn is_raster(&self) -> bool {
        is_raster(self.total)
    }

    /// The particles of this part, of a whole body all, that are matter.
    fn drawn(&self, roles: &[Role]) -> impl Iterator<Item = usize> {
        self.body.owned().filter(|&i| roles[i].is_body())
    }

    /// The cells of this part, of a whole body all.
    fn owned(&self, cells: &Cells) -> impl Iterator<Item = usize> + use<> {
        cells.owned(self.body).into_iter().flatten()
    }

    /// The largest of numbers of all parts, none of which is NaN.
    fn largest<const N: usize>(&self, own: [f64; N]) -> [f64; N] {
        self.team.map_or(own, |team| team.largest(own))
    }

    /// How many there are in all parts.
    fn count(&self, own: usize) -> usize {
        self.team.map_or(own, |team| team.sum([own as u64])[0] as usize)
    }

    /// What lies within the bounds of any part.
    fn bounds(&self, own: Option<Bounds>) -> Option<Bounds> {
        let reach = own.map_or([f64::NEG_INFINITY; 4], |[low, high]| [-low[0], -low[1], high[0], high[1]]);
        let [left, down, right, up] = if self.team.is_some() { self.largest(reach) } else { return own };
        (left > f64::NEG_INFINITY).then_some([[-left, -down], [right, up]])
    }
}

/// Whether a body of so many particles is drawn as a raster, by ranks together that have a part of it each.
pub fn is_raster(count: usize) -> bool {
    count > MOST_DOTS
}

/// Pixels of a PNG for a \[px\] of the sheet: text is as large in all of them, and no sheet takes more than some 20 MB.
pub const PNG_ZOOM: f32 = 2.0;

/// More particles than this are drawn as a raster: an SVG of a million circles opens nowhere.
const MOST_DOTS: usize = 60_000;

/// The files of a figure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Formats {
    /// No figures at all.
    None,
    /// PNG alone.
    Png,
    /// SVG alone.
    Svg,
    /// Both.
    #[default]
    All,
}

/// Writes `NAME.svg` and `NAME.png`.
pub fn write(svg: &str, folder: &OutputFolder, name: &str) -> Result<Vec<PathBuf>, ExportError> {
    write_as(svg, folder, name, Formats::All)
}

/// The same as these files alone.
pub(crate) fn write_as(
    svg: &str,
    folder: &OutputFolder,
    name: &str,
    formats: Formats,
) -> Result<Vec<PathBuf>, ExportError> {
    let mut written = Vec::new();
    if matches!(formats, Formats::Svg | Formats::All) {
        let path = folder.path(format!("{name}.svg"));
        write_file(&path, svg)?;
        written.push(path);
    }
    if matches!(formats, Formats::Png | Formats::All) {
        let path = folder.path(format!("{name}.png"));
        let png = png::render(svg, |_| PNG_ZOOM)
            .map_err(|reason| ExportError::Figure { path: path.clone(), reason })?;
        write_file(&path, png)?;
        written.push(path);
    }
    Ok(written)
}
