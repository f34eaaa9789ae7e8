//! The cells around the particles of a material, by class: what a rule that turns with them needs.

use super::rules::{CellAround, Element, PatchCell};

/// Cells by class of particles. Particles that have the same cells around them share a class, so this takes memory by
/// class and by kind of cell, not by particle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellsAround {
    /// Stiffness and mean gradients of each kind of cell, shape \[kinds\].
    pub elements: Vec<Element>,
    /// Where the cells of each class begin in `cells`, shape \[classes + 1\]; empty without classes.
    starts: Vec<u32>,
    cells: Vec<Cell>,
    /// Corners of all cells, one after the other: see [`CellAround::slots`].
    slots: Vec<u32>,
    /// Where the patches of each class begin in `patches`, as `starts`.
    patch_starts: Vec<u32>,
    patches: Vec<Patch>,
    patch_cells: Vec<PatchPart>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Patch {
    stiffness: f64,
    weights: [f64; 3],
    /// Where its cells begin and end in `patch_cells`.
    cells: [u32; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct PatchPart {
    element: u32,
    /// Where its corners begin in `slots`.
    corners: u32,
    share: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    element: u32,
    own: u32,
    /// Where its corners begin in `slots`.
    corners: u32,
}

impl CellsAround {
    /// No classes yet, of these kinds of cells.
    pub fn new(elements: Vec<Element>) -> Self {
        Self { elements, starts: vec![0], patch_starts: vec![0], ..Self::default() }
    }

    /// Adds a cell to the class at hand: its kind, which of its corners the particle is, and which neighbour each corner is
    /// ([`OWN`](super::rules::OWN) for the particle).
    pub fn push(&mut self, element: u32, own: usize, slots: &[u32]) {
        self.cells.push(Cell { element, own: own as u32, corners: self.slots.len() as u32 });
        self.slots.extend(slots);
    }

    /// Adds a patch to the class at hand: its stiffness \[force / length^3\] and [`PatchCell::weights`], and its cells: kind, share of
    /// area \[length^2\] and corners.
    pub(crate) fn push_patch(
        &mut self,
        (stiffness, weights): (f64, [f64; 3]),
        cells: impl Iterator<Item = (u32, f64, Vec<u32>)>,
    ) {
        let begin = self.patch_cells.len() as u32;
        for (element, share, slots) in cells {
            self.patch_cells.push(PatchPart { element, corners: self.slots.len() as u32, share });
            self.slots.extend(slots);
        }
        self.patches.push(Patch { stiffness, weights, cells: [begin, self.patch_cells.len() as u32] });
    }

    /// Ends the class at hand.
    pub(crate) fn end_class(&mut self) {
        self.starts.push(self.cells.len() as u32);
        self.patch_starts.push(self.patches.len() as u32);
    }

    /// Adds a class with the cells and patches of another.
    pub(crate) fn copy_class(&mut self, class: usize) {
        self.cells.extend_from_within(range(&self.starts, class));
        self.patches.extend_from_within(range(&self.patch_starts, class));
        self.end_class();
    }

    /// The patches that a particle of a class feels: stiffness \[force / length^3\] and cells.
    pub(crate) fn patches_of(
        &self,
        class: usize,
    ) -> impl Iterator<Item = (f64, impl Iterator<Item = PatchCell<'_>> + Clone)> + Clone {
        self.patches[range(&self.patch_starts, class)].iter().map(move |patch| {
            let cells = &self.patch_cells[patch.cells[0] as usize..patch.cells[1] as usize];
            let cell = move |cell: &PatchPart| {
                let element = &self.elements[cell.element as usize];
                let slots = &self.slots[cell.corners as usize..][..element.corners()];
                PatchCell { element, share: cell.share, weights: patch.weights, slots }
            };
            (patch.stiffness, cells.iter().map(cell))
        })
    }

    /// The cells around a particle of a class, in the order in which they are summed.
    pub fn of(&self, class: usize) -> impl Iterator<Item = CellAround<'_>> + Clone {
        self.cells[range(&self.starts, class)].iter().map(|cell| {
            let element = &self.elements[cell.element as usize];
            CellAround {
                element,
                own: cell.own as usize,
                slots: &self.slots[cell.corners as usize..][..element.corners()],
            }
        })
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        let elements: usize =
            self.elements.iter().map(|e| 32 * e.stiffness.len() + 16 * e.gradients.len()).sum();
        elements
            + 4 * (self.starts.len() + self.slots.len() + self.patch_starts.len())
            + size_of::<Cell>() * self.cells.len()
            + size_of::<Patch>() * self.patches.len()
            + size_of::<PatchPart>() * self.patch_cells.len()
    }
}

fn range(starts: &[u32], class: usize) -> std::ops::Range<usize> {
    starts[class] as usize..starts[class + 1] as usize
}
