//! The memory that a run takes at its largest, before it does, with its outputs ([`crate::continuum::memory`] has what the
//! run itself takes). Films, recordings and ParaView files come on top, and the finite elements of a truth that leads. Within a
//! tenth from 90,000 particles on (`tests/cli/memory.rs`); of smaller bodies pictures take most.

use super::figures::Formats;
use super::report::run::{Packed, packed};
use crate::continuum::memory::{measured, solving, stepped};
use crate::continuum::plan::Plan;
use crate::scene::Scene;

/// Bytes of the program without a body.
const PROGRAM: usize = 19 << 20;

/// Bytes of a particle in a [`Snapshot`](crate::continuum::record::Snapshot): position, role and energies.
const SNAPSHOT: usize = 16 + 1 + 2 * 8;

/// Bytes of the picture that a figure is while it is drawn.
const PICTURE: usize = 18 << 20;

/// What a run shall write.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// The files of each figure.
    pub figures: Formats,
    /// Whether there shall be a `report.html`.
    pub report: bool,
}

impl Outputs {
    /// Tables and the summary alone.
    pub const TABLES: Self = Self { figures: Formats::None, report: false };
    /// All that a run writes when nothing else is asked for.
    pub const ALL: Self = Self { figures: Formats::All, report: true };
}

/// Bytes that a run takes at its largest, the program included.
pub fn predicted(scene: &Scene, plan: &Plan, outputs: Outputs) -> usize {
    let is_solved_at_once = scene.is_solved_at_once();
    let draws = outputs.figures != Formats::None;
    let before = |figure: &&usize| !is_solved_at_once && **figure < plan.stop.steps;
    let snapshots = if draws { scene.record.figures.iter().filter(before).count() } else { 0 };
    let [snapshots, last] = [snapshots, usize::from(draws)].map(|each| each * SNAPSHOT * plan.count());
    let Packed { values, frames, packing, text } =
        if outputs.report { packed(plan, is_solved_at_once) } else { Packed::default() };
    let stepping = match is_solved_at_once {
        true => solving(scene, plan),
        false => values + frames[0] + solving(scene, plan),
    };
    let packing = last + values.max(packing) + frames[1];
    let tables = last + text + measured(plan);
    let at_once = rayon::current_num_threads().min(3 * (scene.record.figures.len() + 1));
    // Of stresses a figure needs those of the cells.
    let drawing = if draws { last + text + at_once * PICTURE + measured(plan) / 2 } else { 0 };
    let most = [stepping, packing, tables, drawing].into_iter().max().unwrap_or(0);
    PROGRAM + stepped(plan) + snapshots + most
}
