//! The cells around the particles of a material, by class: what a rule that turns with them needs.

use super::rules::{CellAround, Element};

/// Cells by class of particles. Particles that have the same cells around them share a class, so this takes memory by
/// class and by kind of cell, not by particle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellsAround {
    /// What the kinds of cells resist, shape \[kinds\].
    pub elements: Vec<Element>,
    /// Where the cells of each class begin in `cells`, shape \[classes + 1\]; empty without classes.
    starts: Vec<u32>,
    cells: Vec<Cell>,
    /// Corners of all cells, one after the other: see [`CellAround::slots`].
    slots: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    element: u32,
    own: u32,
    /// Where its corners begin in `slots`.
    corners: u32,
    factor: f64,
}

impl CellsAround {
    /// No classes yet, of these kinds of cells.
    pub fn new(elements: Vec<Element>) -> Self {
        Self { elements, starts: vec![0], ..Self::default() }
    }

    /// Adds a cell to the class at hand: its kind, which of its corners the particle is, which neighbour each corner is
    /// ([`OWN`](super::rules::OWN) for the particle), and a factor on its stiffness.
    pub fn push(&mut self, element: u32, own: usize, slots: &[u32], factor: f64) {
        self.cells.push(Cell { element, own: own as u32, corners: self.slots.len() as u32, factor });
        self.slots.extend(slots);
    }

    /// Ends the class at hand.
    pub fn end_class(&mut self) {
        self.starts.push(self.cells.len() as u32);
    }

    /// Adds a class with the cells of another.
    pub fn copy_class(&mut self, class: usize) {
        self.cells.extend_from_within(self.starts[class] as usize..self.starts[class + 1] as usize);
        self.end_class();
    }

    /// The cells around a particle of a class, in the order in which they are summed.
    pub fn of(&self, class: usize) -> impl Iterator<Item = CellAround<'_>> + Clone {
        self.cells[self.starts[class] as usize..self.starts[class + 1] as usize].iter().map(|cell| {
            let element = &self.elements[cell.element as usize];
            CellAround {
                element,
                factor: cell.factor,
                own: cell.own as usize,
                slots: &self.slots[cell.corners as usize..][..element.corners()],
            }
        })
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        let elements: usize =
            self.elements.iter().map(|e| 32 * e.stiffness.len() + 16 * e.gradients.len()).sum();
        elements + 4 * (self.starts.len() + self.slots.len()) + size_of::<Cell>() * self.cells.len()
    }
}
