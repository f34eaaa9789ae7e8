//! Everything that can be wrong with a problem, named by index, value and allowed range.

/// Errors of the finite-element room.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// A material constant outside the range that keeps the strain energy positive.
    #[error("material: {quantity} = {value} is outside the admissible range {range}")]
    Inadmissible {
        /// The constant, as written in the constructor.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The range it must lie in, as text.
        range: String,
    },
    /// A stiffness matrix that is not symmetric and positive definite.
    #[error(
        "material: the 3x3 stiffness must be finite, symmetric and positive definite; it is not {lacking}"
    )]
    BadStiffness {
        /// "finite", "symmetric" or "positive definite".
        lacking: &'static str,
    },
    /// A mesh that shall have no cells.
    #[error("cells: length 0, expected at least 1")]
    NoCells,
    /// A NaN or an infinity in the input.
    #[error("{what} {index} holds a value that is not finite")]
    NotFinite {
        /// Which list: "node", "fixed displacement", "traction", "point force", "body force".
        what: &'static str,
        /// Place in that list, from 0.
        index: usize,
    },
    /// A cell whose Jacobian determinant is not positive: nodes clockwise, folded, or of no area.
    #[error(
        "cell {cell} is inverted or flat: its Jacobian determinant falls to {determinant:e}; \
         list nodes counter-clockwise"
    )]
    InvertedCell {
        /// The cell, from 0.
        cell: usize,
        /// The smallest determinant found [m2 per reference area].
        determinant: f64,
    },
    /// Too few prescribed displacements: a part can move as a rigid body.
    #[error("the part of the body around ({:.6}, {:.6}) is not held and free to {motion}", .at[0], .at[1])]
    Mechanism {
        /// The lowest-numbered node of the part.
        node: usize,
        /// Where it lies \[m\].
        at: [f64; 2],
        /// "translate along x", "translate along y" or "rotate".
        motion: &'static str,
    },
    /// The stiffness matrix is singular to working precision though every part is held against
    /// rigid motion: usually parts that hang together by a single node, as by a hinge.
    #[error(
        "the body is soft beyond what a double resolves, most of all near ({:.6}, {:.6})", .at[0], .at[1]
    )]
    Singular {
        /// The node that moves most in the softest motion.
        node: usize,
        /// Where it lies \[m\].
        at: [f64; 2],
    },
    /// A support of a shape that lies beside the body.
    #[error("support {index} holds no point of the body")]
    EmptySupport {
        /// Place in the list of supports, from 0.
        index: usize,
    },
    /// A body that turns has no equilibrium, or none that is found on the way, beyond a part of its loads and motions.
    #[error(
        "no equilibrium is found beyond {:.1} % of the loads and motions: the body snaps, buckles or is torn there",
        100.0 * part
    )]
    Lost {
        /// The part up to which there is one \[1\].
        part: f64,
    },
    /// The sparse factorisation could not be carried out: the factor does not fit in memory.
    #[error("sparse factorisation of {unknowns} unknowns failed: {reason}")]
    Factorisation {
        /// Number of unknowns.
        unknowns: usize,
        /// The message of the linear-algebra library.
        reason: String,
    },
    /// Curves of an outline, or supports in the body, too close to each other for triangles between them.
    #[error("no triangles fit between the curves near ({x}, {y}): they come too close to each other")]
    Unmeshable {
        /// Abscissa \[m\].
        x: f64,
        /// Ordinate \[m\].
        y: f64,
    },
    /// A point at which a value was asked for lies in no cell.
    #[error("point {index} at ({x}, {y}) lies outside the mesh")]
    OutsideMesh {
        /// Place in the list of points, from 0.
        index: usize,
        /// Abscissa \[m\].
        x: f64,
        /// Ordinate \[m\].
        y: f64,
    },
}
