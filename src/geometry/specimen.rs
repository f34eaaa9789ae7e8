//! The flat tensile specimens of ASTM E8/E8M (sheet-type) and ASTM D638 (Type I).
//!
//! Both are a straight gauge section between two wider grips, joined by circular fillets.
//! Lengths are the standards' own, in millimetres, times `scale`.

use std::f64::consts::TAU;

use super::Point;
use super::piece::{Arc, Piece, reversed};

/// A dog-bone whose axis runs along y, centred on x = 0, from y = 0 at the lower grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    /// Overall length \[length\].
    pub overall: f64,
    /// Width of the grips \[length\].
    pub grip_width: f64,
    /// Width of the gauge section \[length\].
    pub gauge_width: f64,
    /// Length of the straight, narrow section \[length\].
    pub gauge_length: f64,
    /// Radius of the fillets \[length\].
    pub fillet: f64,
    /// Whether the axis lies along x instead (the body is then centred on y = 0).
    pub lying: bool,
}

impl Specimen {
    /// ASTM E8/E8M sheet-type, 12.5 mm wide: overall 200, reduced section 57, grip width 20, fillet
    /// radius 12.5 (Fig. 1 of the standard), times `scale`.
    pub(crate) fn e8_sheet(scale: f64) -> Self {
        Self::scaled([200.0, 20.0, 12.5, 57.0, 12.5], scale)
    }

    /// ASTM D638 Type I: overall 165, narrow section 57 long and 13 wide, grip width 19, fillet
    /// radius 76 (Fig. 1 of the standard), times `scale`.
    pub(crate) fn d638_type_i(scale: f64) -> Self {
        Self::scaled([165.0, 19.0, 13.0, 57.0, 76.0], scale)
    }

    fn scaled(dimensions: [f64; 5], scale: f64) -> Self {
        let [overall, grip_width, gauge_width, gauge_length, fillet] = dimensions.map(|d| d * scale);
        Self { overall, grip_width, gauge_width, gauge_length, fillet, lying: false }
    }

    /// Half width at distance `along` from the lower end \[length\].
    pub fn half_width(&self, along: f64) -> f64 {
        let beyond_gauge = (along - self.overall / 2.0).abs() - self.gauge_length / 2.0;
        let (narrow, wide) = (self.gauge_width / 2.0, self.grip_width / 2.0);
        if beyond_gauge <= 0.0 {
            return narrow;
        }
        if beyond_gauge >= self.fillet {
            return wide;
        }
        // The fillet is tangent to the gauge section and runs out where it meets the grip.
        let rise = self.fillet - (self.fillet * self.fillet - beyond_gauge * beyond_gauge).sqrt();
        (narrow + rise).min(wide)
    }

    /// Whether `point` lies inside or within `tolerance` \[length\] of the boundary.
    pub fn contains(&self, point: [f64; 2], tolerance: f64) -> bool {
        let [across, along] = if self.lying { [point[1], point[0]] } else { point };
        let inside = along.clamp(0.0, self.overall);
        (along - inside).abs() <= tolerance.max(0.0) && across.abs() <= self.half_width(inside) + tolerance
    }

    /// Lowest and highest coordinate on each axis \[length\].
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let half = self.grip_width / 2.0;
        if self.lying { ([0.0, -half], [self.overall, half]) } else { ([-half, 0.0], [half, self.overall]) }
    }
}

/// Right side up, left side down: gauge, fillets and grips of a specimen.
pub(super) fn profile(specimen: &Specimen) -> Vec<Piece> {
    let Specimen { overall, grip_width, gauge_width, gauge_length, fillet, lying } = *specimen;
    let (wide, narrow) = (grip_width / 2.0, gauge_width / 2.0);
    let (low, high) = ((overall - gauge_length) / 2.0, (overall + gauge_length) / 2.0);
    // Where the fillet has risen to the grip: an angle from the axis of symmetry of its circle.
    let rise = wide - narrow;
    let angle = if rise < fillet { (1.0 - rise / fillet).acos() } else { TAU / 4.0 };
    let run = fillet * angle.sin();
    let middle = narrow + fillet;
    let mut right = vec![
        Piece::edge([wide, 0.0], [wide, low - run]),
        Piece::arc([middle, low], fillet, TAU / 2.0 + angle, -angle),
        Piece::edge([narrow, low], [narrow, high]),
        Piece::arc([middle, high], fillet, TAU / 2.0, -angle),
        Piece::edge([wide, high + run], [wide, overall]),
    ];
    // The fillets run out tangentially into the gauge; arcs end exactly where edges begin.
    right[1].from = right[0].to;
    right[1].to = right[2].from;
    right[3].from = right[2].to;
    right[3].to = right[4].from;
    (right[2].begins_at_corner, right[3].begins_at_corner) = (false, false);
    let left: Vec<Piece> = right.iter().map(|piece| reflected(piece, |[x, y]| [-x, y], TAU / 2.0)).collect();
    let mut ring = right;
    ring.push(Piece::edge([wide, overall], [-wide, overall]));
    // Down the left side: each piece begins at a corner if the one after it did on the way up.
    ring.extend(left.iter().enumerate().rev().map(|(k, piece)| {
        let begins_at_corner = left.get(k + 1).is_none_or(|next| next.begins_at_corner);
        Piece { begins_at_corner, ..piece.reversed() }
    }));
    ring.push(Piece::edge([-wide, 0.0], [wide, 0.0]));
    ring.iter_mut().enumerate().for_each(|(number, piece)| piece.number = number);
    if !lying {
        return ring;
    }
    let swapped = ring.iter().map(|piece| reflected(piece, |[x, y]| [y, x], TAU / 4.0));
    reversed(&swapped.collect::<Vec<_>>())
}

/// The mirror image of a piece, where a place becomes what `flip` makes of it and an angle what it lacks of `whole`.
fn reflected(piece: &Piece, flip: fn(Point) -> Point, whole: f64) -> Piece {
    let arc = piece.arc.map(|arc| Arc {
        centre: flip(arc.centre),
        start: whole - arc.start,
        sweep: -arc.sweep,
        ..arc
    });
    Piece { from: flip(piece.from), to: flip(piece.to), arc, ..*piece }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_e8_profile_has_the_widths_of_the_standard() {
        let e8 = Specimen::e8_sheet(1.0);
        assert_eq!(e8.half_width(100.0) * 2.0, 12.5);
        assert_eq!(e8.half_width(128.5) * 2.0, 12.5);
        assert_eq!(e8.half_width(10.0) * 2.0, 20.0);
        // 3.75 mm of rise on a 12.5 mm fillet are reached sqrt(12.5^2 - 8.75^2) = 8.93 mm from its start.
        assert!((e8.half_width(128.5 + 8.927) * 2.0 - 20.0).abs() < 1e-3);
        assert!(e8.half_width(128.5 + 8.0) < 10.0);
    }

    #[test]
    fn the_d638_profile_is_symmetric_and_scales() {
        let full = Specimen::d638_type_i(1.0);
        let tenth = Specimen::d638_type_i(0.1);
        for along in [5.0, 30.0, 60.0, 82.5] {
            assert!((full.half_width(along) - full.half_width(165.0 - along)).abs() < 1e-9);
            assert!((full.half_width(along) - 10.0 * tenth.half_width(along / 10.0)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_lying_specimen_is_the_standing_one_with_its_axes_swapped() {
        let standing = Specimen::e8_sheet(1.0);
        let lying = Specimen { lying: true, ..standing };
        for point in [[3.0, 100.0], [8.0, 100.0], [8.0, 20.0], [0.0, 201.0]] {
            assert_eq!(standing.contains(point, 1e-9), lying.contains([point[1], point[0]], 1e-9));
        }
    }
}
