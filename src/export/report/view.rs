//! A body or a swarm on the move, as data for the page: frames, bonds, cells, roles, and the exact values
//! at the end.

use serde::Serialize;

use super::encode::{GROUP, doubles, integers};
use super::encoded;
use super::frames::{Channel, Frames};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;

/// The data of the scripts.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Animation {
    /// Said above the canvas where several stand beside each other.
    pub name: String,
    /// `particle` or `robot`.
    pub noun: &'static str,
    /// Unit of length.
    pub unit: String,
    pub clock: Clock,
    pub count: usize,
    /// Names of the particles where they have other names than their ids.
    pub names: Vec<String>,
    /// Distance of neighbours \[length\].
    pub spacing: f64,
    /// To be drawn \[length\], shape \[count\]; empty for points without extent.
    pub radii: Vec<f64>,
    /// The clock's value at every frame, shape \[frames\].
    pub times: Vec<f64>,
    pub channels: Vec<Channel>,
    /// Shapes \[frames * channels\].
    pub exponents: Vec<i32>,
    pub bases: Vec<i64>,
    pub modes: Vec<u8>,
    /// Frames in a group.
    pub group: usize,
    pub groups: usize,
    /// By number.
    pub role_names: Vec<&'static str>,
    /// Quantities to colour particles by, besides role and displacement.
    pub quantities: Vec<Quantity>,
    /// Columns known to the last bit at the last frame.
    pub exact: Vec<Quantity>,
    /// Corners of a cell; zero where there are no cells.
    pub corners: usize,
    /// For the von Mises stress where frames have none.
    pub stress: Option<Stress>,
    /// Whether displacements scale with their cause, so that drawing them at another size is correct.
    pub linear: bool,
    /// Closed outlines of obstacles and of fences.
    pub outlines: Vec<Outline>,
}

#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Clock {
    pub quantity: &'static str,
    pub unit: &'static str,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Quantity {
    /// As in the table that the program writes.
    pub key: String,
    pub label: String,
    pub unit: String,
}

impl Quantity {
    pub(crate) fn new(key: &str, label: &str, unit: impl Into<String>) -> Self {
        Self { key: key.into(), label: label.into(), unit: unit.into() }
    }
}

/// Plane stress or strain.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Stress {
    /// Strain (xx, yy, engineering xy) to stress \[force / length^2\], shape \[3, 3\].
    pub stiffness: [[f64; 3]; 3],
    /// Share of xx + yy that acts across the plane \[1\].
    pub across: f64,
    /// Whether cells are turned back before they are strained.
    pub turns: bool,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Outline {
    /// `obstacle` or `fence`.
    pub kind: &'static str,
    /// Where it stands at first \[length\].
    pub corners: Vec<[f64; 2]>,
    /// By ascending time, when it is moved and how far from there: time, x, y.
    pub moves: Vec<[f64; 3]>,
}

/// An animation with its arrays, each compressed text with a name.
#[derive(Debug)]
pub struct View {
    pub(crate) animation: Animation,
    pub(crate) arrays: Vec<(String, String)>,
    /// Whether stress before the last frame is the mean of each particle's cells along the outline too.
    pub(crate) has_mean_stress: bool,
}

impl View {
    pub(crate) fn new(animation: Animation) -> Self {
        let role_names = Role::ALL.map(Role::name).to_vec();
        let animation = Animation { group: GROUP, role_names, ..animation };
        Self { animation, arrays: Vec::new(), has_mean_stress: false }
    }

    /// The frames, as many as have room beside everything else, and the clock's value at the step of each.
    pub(crate) fn set_frames(&mut self, frames: &mut Frames, clock: impl Fn(usize) -> f64) {
        let encoded = encoded(frames, self.size());
        let tracks = || frames.kept.iter().flat_map(|frame| &frame.tracks);
        let animation = &mut self.animation;
        animation.count = frames.count;
        animation.times = frames.kept.iter().map(|frame| clock(frame.step)).collect();
        animation.channels = frames.channels.clone();
        animation.exponents = tracks().map(|track| track.exponent).collect();
        animation.bases = tracks().map(|track| track.base).collect();
        animation.modes = encoded.modes;
        animation.groups = encoded.groups.len();
        for (n, text) in encoded.groups.into_iter().enumerate() {
            self.put(&format!("group-{n}"), text);
        }
    }

    /// Places that displacements start from \[length\].
    pub(crate) fn set_reference(&mut self, reference: &Vectors) {
        self.put("X", doubles(&reference.x));
        self.put("Y", doubles(&reference.y));
    }

    /// Ids, where they are not the numbers from 1 on.
    pub(crate) fn set_ids(&mut self, ids: impl Iterator<Item = u32> + Clone) {
        self.put("ids", integers(ids, 1));
    }

    /// Roles at first, and `[step, particle, role]` of every change.
    pub(crate) fn set_roles(&mut self, first: &[Role], changes: &[[u32; 3]]) {
        self.put("roles", integers(first.iter().map(|&role| role.number().into()), 1));
        self.put("role-changes", integers(changes.iter().flatten().copied(), 3));
    }

    /// Pairs of neighbours; `sees` gives for each whether both ends see the other (0) or only the first (1), `broken`
    /// is one more than the step at which it broke, 0 for never.
    pub(crate) fn set_bonds(
        &mut self,
        pairs: &[[u32; 2]],
        sees: impl Iterator<Item = u32> + Clone,
        broken: impl Iterator<Item = u32> + Clone,
    ) {
        self.put("bonds", integers(pairs.iter().flatten().copied(), 2));
        self.put("bond-sees", integers(sees, 1));
        self.put("bond-broken", integers(broken, 1));
    }

    pub(crate) fn set_cells<'a>(&mut self, cells: &'a Cells) {
        // The page draws polygons of as many corners each: those with fewer repeat their last.
        let most = cells.most_corners();
        let filled = |cell: &'a [u32]| (0..most).map(move |k| cell[k.min(cell.len() - 1)]);
        self.animation.corners = most;
        self.put("cells", integers(cells.iter().flat_map(filled), most));
    }

    /// A column known to the last bit at the end; NaN where there is nothing.
    pub(crate) fn add_exact(&mut self, quantity: Quantity, values: impl Iterator<Item = f64>) {
        self.put(&format!("exact-{}", quantity.key), doubles(&values.collect::<Vec<f64>>()));
        self.animation.exact.push(quantity);
    }

    fn put(&mut self, name: &str, text: String) {
        self.arrays.push((name.into(), text));
    }

    /// \[byte\]
    fn size(&self) -> usize {
        self.arrays.iter().map(|(_, text)| text.len()).sum()
    }
}
