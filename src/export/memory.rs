//! The memory that a run takes at its largest, before it does, with its outputs ([`crate::continuum::memory`] has what the
//! run itself takes); within a tenth (`tests/cli/memory.rs`). Films and recordings come on top, and what was
//! taken and given back before the plan was made, by the finite elements of a truth that leads or a setting that was chosen.

use super::figures::axes::Axes;
use super::figures::page::Bounds;
use super::figures::{Formats, PNG_ZOOM, components, is_raster, page, panels};
use super::report::recorder::{Packed, packed};
use super::vtk;
use crate::continuum::memory::{measured, on_the_way, solving, stepped};
use crate::continuum::plan::Plan;
use crate::engine::setup::RoleChange;
use crate::flock::role::Role;
use crate::geometry::point::plus;
use crate::material::cells::Cells;
use crate::material::stress::StressState;
use crate::scene::Scene;

/// Bytes of what a program adds to its own once it runs a body: code that has not run yet, stacks, tables.
const RUNNING: usize = 15 << 18;

/// Bytes of a particle in a [`Snapshot`](crate::continuum::record::Snapshot): position, role and energies.
const SNAPSHOT: usize = 16 + 1 + 2 * 8;

/// Bytes of the figures of a step that are drawn when it comes: measured, a tenth of a MB for each at most.
const DRAWN: usize = 1 << 18;

/// Bytes of what a figure shows of a cell: three components, or the von Mises stress and where the corners stand.
const SHOWN: usize = 3 * 8;

/// Outputs that a run is to write.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// The files of each figure.
    pub figures: Formats,
    /// Whether there shall be a `report.html`.
    pub report: bool,
    /// Whether there shall be a film.
    pub film: bool,
}

impl Outputs {
    /// Tables and the summary alone.
    pub const TABLES: Self = Self { figures: Formats::None, report: false, film: false };
    /// All that a run writes when nothing else is asked for.
    pub const ALL: Self = Self { figures: Formats::All, report: true, film: false };

    /// Whether there shall be figures.
    pub fn draws(self) -> bool {
        self.figures != Formats::None
    }

    /// Whether frames are kept on the way.
    pub fn keeps_frames(self) -> bool {
        self.report || self.film
    }
}

/// Bytes that a run takes at its largest by a program whose own code takes so many until its plan is made.
pub fn predicted(scene: &Scene, plan: &Plan, outputs: Outputs, program: usize) -> usize {
    let is_solved_at_once = scene.is_solved_at_once();
    let draws = outputs.draws();
    let before = |figure: &&usize| !is_solved_at_once && **figure < plan.stop.steps;
    let drawn_before = if draws { scene.record.figures.iter().filter(before).count() } else { 0 };
    // Where bodies are so large that they are drawn as squares, configurations are drawn when their steps come.
    let is_drawn_at_once = draws && is_raster(plan.count());
    let kept = if is_drawn_at_once { [0; 2] } else { [drawn_before, usize::from(draws)] };
    let [snapshots, last] = kept.map(|each| each * SNAPSHOT * plan.count());
    let drawn = if is_drawn_at_once { DRAWN * (drawn_before + 1) } else { 0 };
    let Packed { values, frames, packing, text } =
        if outputs.report { packed(scene, plan, false) } else { Packed::default() };
    let drawing_at_once = if is_drawn_at_once { drawing_at_once(plan) } else { 0 };
    let while_stepping = drawing_at_once.max(frame(scene, plan));
    let stepping = match is_solved_at_once {
        true => solving(scene, plan).max(while_stepping),
        false => values + frames[0] + taken_back(scene, plan) + solving(scene, plan).max(while_stepping),
    };
    let packing = last + values.max(packing) + frames[1];
    let tables = last + text + measured(plan);
    // There are two figures of stresses.
    let painters = if is_drawn_at_once { 0 } else { rayon::current_num_threads().min(2) };
    let stresses = painters * stresses(plan);
    let drawing = match draws {
        true => last + text + pictures(scene, plan, drawn_before + 1) + stresses,
        false => 0,
    };
    // Each increment is measured while there is more of it than at the end.
    let increments = match on_the_way(scene, plan) {
        0 => 0,
        beside => beside + solving(scene, plan).max(measured(plan)) + values + frames[0],
    };
    let most = [stepping, increments, packing, tables, drawing].into_iter().max().unwrap_or(0);
    program + RUNNING + stepped(plan) + snapshots + drawn + most
}

/// Bytes of what a figure needs of stresses: those of the cells, and what it shows of them.
fn stresses(plan: &Plan) -> usize {
    (size_of::<StressState>() + SHOWN) * plan.setup.cells.as_ref().map_or(0, Cells::count)
}

/// Bytes of a configuration that is drawn when its step comes; figures of stresses need displacements and places as well.
fn drawing_at_once(plan: &Plan) -> usize {
    let shown = if plan.setup.cells.is_some() { 2 * 16 } else { 0 };
    (SNAPSHOT + shown) * plan.count() + stresses(plan)
}

/// Bytes of a frame for ParaView while it is written.
fn frame(scene: &Scene, plan: &Plan) -> usize {
    if scene.record.vtk_every == 0 { 0 } else { measured(plan) + vtk::bytes(plan) }
}

/// Bytes of the places to which a body is taken back whose step diverges, or whose steps at once came to rest on the way.
fn taken_back(scene: &Scene, plan: &Plan) -> usize {
    if scene.is_solved_at_once() { 0 } else { 16 * plan.count() }
}

/// Bytes that one of so many ranks with a part of a body takes at its largest, by a program whose own code takes so many: tables
/// are written row by row. The first rank, which `writes`, keeps what a report shows, and turns figures into pixels.
pub fn of_part(
    scene: &Scene,
    plan: &Plan,
    (ranks, outputs, writes): (usize, Outputs, bool),
    program: usize,
) -> usize {
    /// Memory of MPI, and what it shares with each rank on a machine; measured with Open MPI 4.1.
    const MPI: [usize; 2] = [4 << 20, 3 << 19];
    /// Ranks that share a machine's memory, as far as it is known beforehand.
    const ON_A_MACHINE: usize = 16;
    /// A particle of others, or for others, before and after a step, on its way.
    const ON_THE_WAY: usize = 2 * 2 * 16;
    let [each, of_rank] = MPI;
    let halo = plan.setup.body.part.as_ref().map_or(0, |part| part.exact.len() - part.owned.len());
    let Packed { values, frames, packing, .. } =
        if outputs.keeps_frames() && writes { packed(scene, plan, outputs.film) } else { Packed::default() };
    let stepping = ON_THE_WAY * halo + taken_back(scene, plan);
    let moments = scene.record.figures.len() + 1;
    let drawing_at_once = if outputs.draws() { drawing_at_once(plan) } else { 0 };
    let while_stepping = drawing_at_once.max(frame(scene, plan));
    let drawing = match outputs.draws() && writes {
        true => DRAWN * moments + pictures(scene, plan, moments),
        false => 0,
    };
    let most = measured(plan).max(stepping).max(solving(scene, plan)).max(while_stepping);
    let shown = values.max(packing).max(drawing) + frames[0];
    program
        + RUNNING
        + stepped(plan)
        + on_the_way(scene, plan)
        + each
        + of_rank * ranks.min(ON_A_MACHINE)
        + most
        + shown
}

/// Corners of the whole body before it is deformed \[length\].
fn undeformed(plan: &Plan) -> Bounds {
    let body = &plan.setup.body;
    let (low, high) = match &body.part {
        Some(_) => body.bounds(),
        None => body.reference.bounds(0..plan.count()).unwrap_or_default(),
    };
    [low, high]
}

/// Corners of where leaders are when figures are drawn, as far as their first programs say \[length\]; where followers go, the run
/// alone shows.
fn led(scene: &Scene, plan: &Plan) -> Option<Bounds> {
    let drawn = scene.record.figures.iter().copied().chain([plan.stop.steps]);
    let steps: &Vec<usize> = &drawn.filter(|&step| step <= plan.stop.steps).collect();
    let changes = plan.setup.changes.iter().filter(|change| change.role == Role::Leader);
    let motions = changes.filter_map(|change| Some((change, change.motion.as_ref()?)));
    let places = motions.flat_map(|(RoleChange { particles, from, .. }, motion)| {
        let led = particles.iter().map(|&particle| plan.setup.body.reference.get(particle)).enumerate();
        led.flat_map(move |(which, base)| {
            let since = from.saturating_sub(1);
            let begun = steps.iter().filter(move |&&step| step > since);
            begun.map(move |step| plus(base, motion.displacement((step - since) as f64, which, base)))
        })
    });
    places.map(|place| [place; 2]).fold(None, |all, one| page::around_both(all, Some(one)))
}

/// Bytes of what the figures of so many steps are while they are drawn, as many at once as there are threads.
fn pictures(scene: &Scene, plan: &Plan, moments: usize) -> usize {
    /// Memory of the renderer with its fonts; that of one more at the same time.
    const PAINTER: usize = 3 << 20;
    const FONTS: usize = 1 << 20;
    /// A particle as a shape.
    const DOT: usize = 950;
    /// The dashes of bonds that break.
    const DASHES: usize = 2 << 20;
    /// Heading and axes beside a body, and the bar of its colours \[px\].
    const ABOVE: f64 = 60.0;
    const BAR: f64 = 100.0;
    /// Height of the panels of probes, three of the four, and of a chart \[px\].
    const PROBES: f64 = 740.0;
    const CHART: f64 = 560.0;
    let bytes = |[width, height]: [f64; 2]| 4 * (f64::from(PNG_ZOOM).powi(2) * width * height) as usize;
    let body = &plan.setup.body;
    let (bounds, spacing) =
        (page::around_both(Some(undeformed(plan)), led(scene, plan)), body.lattice.spacing());
    let axes = page::around(bounds, spacing);
    let sheet = bytes([page::width_of(&axes, BAR), ABOVE + axes.size[1] + Axes::BELOW]);
    let has_cells = plan.setup.cells.is_some();
    let of_each = if has_cells { 3 } else { 2 };
    let mut sheets = vec![sheet; of_each * moments];
    if has_cells {
        let (axes, is_row) = components::window(bounds, spacing);
        sheets.extend(vec![bytes(panels::sheet_size(&axes, is_row, [BAR, ABOVE])); moments]);
    }
    let charts = [
        (!plan.probes.is_empty(), PROBES),
        (scene.equilibrium.is_some(), CHART),
        (scene.load_steps.is_some(), CHART),
    ];
    sheets.extend(charts.iter().filter(|(is, _)| *is).map(|(_, height)| bytes([page::WIDTH, *height])));
    sheets.sort_unstable_by(|a, b| b.cmp(a));
    let at_once = rayon::current_num_threads();
    // Of a lattice contours are drawn of energies, of points each as a dot as well.
    let of_dots = if body.numbering.is_some() { of_each * moments } else { moments };
    let dots = if is_raster(body.total()) { 0 } else { DOT * plan.count() * at_once.min(of_dots) };
    let dashes = if plan.setup.flock.bonds.is_some() { DASHES } else { 0 };
    PAINTER + dots + dashes + sheets.iter().take(at_once).map(|one| one + FONTS).sum::<usize>()
}
