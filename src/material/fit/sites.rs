//! Which sites of a lattice are inside an outline, and which move onto it or onto the lines inside.

use super::near::stretches;
use super::{FitError, SNAP, STAYS, Scale, is_kept_corner};
use crate::flock::lattice::{Lattice, Site};
use crate::flock::vectors::distance;
use crate::flock::window::Window;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::partition::Partition;

/// More sites than this are refused before memory is asked for.
const MOST_SITES: u64 = 1 << 28;

/// Where a site is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    Inside,
    Outside,
    /// On the outline, where it was or where it has been moved.
    On {
        place: Place,
        moved: bool,
    },
}

/// A site near the outline.
#[derive(Clone, Copy, Debug)]
pub struct NearSite {
    pub site: Site,
    pub state: State,
    /// \[length\]
    pub point: [f64; 2],
}

/// The sites in the bounds of an outline.
#[derive(Debug)]
pub struct Sites {
    window: Window,
    /// Number of each site near the outline in `near`, or one of the marks below.
    marks: Vec<u32>,
    near: Vec<NearSite>,
    /// Region of each site, where the body has several; only of those far from any line it is exact.
    regions: Vec<u16>,
}

/// The data that decide on which side of the outline a site is.
#[derive(Clone, Copy)]
struct Bound {
    /// The place of the outline nearest to it, if within reach.
    place: Option<Place>,
    /// \[length\]
    apart: f64,
    /// Whether it is inside if not.
    was: bool,
}

const FAR_OUTSIDE: u32 = u32::MAX;
const FAR_INSIDE: u32 = u32::MAX - 1;
const UNKNOWN: u32 = u32::MAX - 2;

impl Sites {
    pub fn find(lattice: &Lattice, outline: &Partition, scale: &Scale) -> Result<Self, FitError> {
        let mut sites = Self::window(lattice, outline.outline())?;
        for cell in sites.inside(lattice, outline.outline(), scale) {
            sites.marks[cell] = FAR_INSIDE;
        }
        for (k, region) in outline.regions().iter().enumerate() {
            sites.regions.resize(sites.marks.len(), 0);
            for cell in sites.inside(lattice, region, scale) {
                sites.regions[cell] = k as u16 + 1;
            }
        }
        let bounds = sites.find_near(lattice, outline, scale);
        let corners: Vec<(Place, [f64; 2])> = outline
            .pieces()
            .filter(|&(ring, piece, _)| outline.named([ring, piece]) == [ring, piece])
            .filter(|&(ring, piece, _)| is_kept_corner(outline, scale, [ring, piece]))
            .map(|(ring, piece, at)| (Place { ring, piece, t: 0.0 }, at.from))
            .collect();
        sites.snap_to_corners(lattice, &corners, scale);
        sites.snap(lattice, outline, scale, &bounds);
        Ok(sites)
    }

    /// Sites near the outline, in the order in which they were found.
    pub fn near(&self) -> &[NearSite] {
        &self.near
    }

    /// Number of a site near the outline.
    pub fn number(&self, site: Site) -> Option<u32> {
        self.window.number(site).map(|cell| self.marks[cell]).filter(|&mark| mark < UNKNOWN)
    }

    /// Whether a site is inside and not on the outline.
    pub fn is_inside(&self, site: Site) -> bool {
        match self.window.number(site).map(|cell| self.marks[cell]) {
            None | Some(FAR_OUTSIDE | UNKNOWN) => false,
            Some(FAR_INSIDE) => true,
            Some(number) => self.near[number as usize].state == State::Inside,
        }
    }

    /// The region of a cell with these corners, of which one at least is far from any line.
    pub fn region(&self, mut corners: impl Iterator<Item = Site>) -> Option<usize> {
        if self.regions.is_empty() {
            return Some(0);
        }
        corners.find_map(|site| {
            let cell = self.window.number(site).filter(|&cell| self.marks[cell] == FAR_INSIDE)?;
            Some(self.regions[cell] as usize)
        })
    }

    /// Sites inside that are far from the outline, ascending.
    pub fn far_inside(&self) -> impl Iterator<Item = Site> + '_ {
        (0..self.marks.len())
            .filter(|&cell| self.marks[cell] == FAR_INSIDE)
            .map(|cell| self.window.site(cell))
    }

    fn window(lattice: &Lattice, outline: &Outline) -> Result<Self, FitError> {
        let (low, high) = outline.bounds();
        let corners =
            [low, [high[0], low[1]], high, [low[0], high[1]]].map(|corner| lattice.grid_coordinates(corner));
        let extreme = |k: usize, pick: fn(f64, f64) -> f64| corners.iter().map(|c| c[k]).reduce(pick);
        // Far enough for the cells around every site near the outline.
        let lows = [0, 1].map(|k| extreme(k, f64::min).unwrap_or(0.0).floor() - 8.0);
        let highs = [0, 1].map(|k| extreme(k, f64::max).unwrap_or(0.0).ceil() + 8.0);
        let size = (highs[0] - lows[0] + 1.0) * (highs[1] - lows[1] + 1.0);
        let fits = lows.iter().chain(&highs).all(|v| v.abs() < 1e9) && size <= MOST_SITES as f64;
        if !fits {
            return Err(FitError::TooLarge { limit: MOST_SITES });
        }
        let window = Window::new(lows.map(|v| v as i32), highs.map(|v| v as i32));
        let marks = vec![FAR_OUTSIDE; window.count() as usize];
        Ok(Self { window, marks, near: Vec::new(), regions: Vec::new() })
    }

    /// The sites inside an outline, column by column: between its crossings, where arcs may be taken for short chords, as
    /// sites near them are looked at again.
    fn inside(&self, lattice: &Lattice, outline: &Outline, scale: &Scale) -> Vec<usize> {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); self.window.columns as usize];
        let low = self.window.low.map(i64::from);
        for (.., piece) in outline.pieces() {
            let count = match &piece.arc {
                None => 1,
                Some(_) => (piece.length() / (0.5 * scale.altitude)).ceil().clamp(8.0, 1e8) as usize,
            };
            let at = |k: usize| lattice.grid_coordinates(piece.point(k as f64 / count as f64));
            let mut from = at(0);
            for k in 1..=count {
                let to = at(k);
                let (first, last) = (from[0].min(to[0]).ceil() as i64, from[0].max(to[0]).ceil() as i64);
                for column in first.max(low[0])..last.min(low[0] + self.window.columns) {
                    let share = (column as f64 - from[0]) / (to[0] - from[0]);
                    let row = from[1] + share * (to[1] - from[1]);
                    crossings[(column - low[0]) as usize].push(row);
                }
                from = to;
            }
        }
        let mut inside = Vec::new();
        for (column, mut rows) in crossings.into_iter().enumerate() {
            rows.sort_by(f64::total_cmp);
            for pair in rows.chunks_exact(2) {
                let last = (pair[1].floor() as i64).min(low[1] + self.window.rows - 1);
                for row in (pair[0].ceil() as i64).max(low[1])..=last {
                    let cell = (column as i64 * self.window.rows + row - low[1]) as usize;
                    inside.extend(Some(cell).filter(|&cell| lattice.is_site(self.window.site(cell))));
                }
            }
        }
        inside
    }

    /// Finds the sites within reach of the outline and of the lines inside, with their nearest places. Returns the
    /// data that decide the side of the outline that each is on.
    fn find_near(&mut self, lattice: &Lattice, outline: &Partition, scale: &Scale) -> Vec<Bound> {
        // Far enough for the whole cells that small parts of cut ones may join.
        let reach = 1.5 * scale.diameter + SNAP * scale.altitude;
        let mut distances: Vec<f64> = Vec::new();
        let mut bounds: Vec<Bound> = Vec::new();
        for (ring, number, piece) in outline.pieces() {
            for (low, high) in stretches(piece, scale.diameter) {
                let corners = [
                    [low[0] - reach, low[1] - reach],
                    [high[0] + reach, low[1] - reach],
                    [high[0] + reach, high[1] + reach],
                    [low[0] - reach, high[1] + reach],
                ]
                .map(|corner| lattice.grid_coordinates(corner));
                let range = |k: usize| {
                    let values = corners.map(|c| c[k]);
                    let least = values.into_iter().fold(f64::INFINITY, f64::min).ceil() as i32;
                    let most = values.into_iter().fold(f64::NEG_INFINITY, f64::max).floor() as i32;
                    least..=most
                };
                for site in range(0).flat_map(|i| range(1).map(move |j| [i, j])) {
                    let Some(cell) = self.window.number(site).filter(|_| lattice.is_site(site)) else {
                        continue;
                    };
                    let point = lattice.position(site);
                    let t = piece.nearest(point);
                    let apart = distance(piece.point(t), point);
                    if apart > reach {
                        continue;
                    }
                    let place = Place { ring, piece: number, t };
                    let state = State::On { place, moved: true };
                    let mark = self.marks[cell];
                    let known = if mark >= UNKNOWN { self.near.len() } else { mark as usize };
                    if mark >= UNKNOWN {
                        self.marks[cell] = known as u32;
                        self.near.push(NearSite { site, state, point });
                        distances.push(apart);
                        bounds.push(Bound { place: None, apart: f64::INFINITY, was: mark == FAR_INSIDE });
                    } else if apart < distances[known] {
                        (self.near[known].state, distances[known]) = (state, apart);
                    }
                    let bound = &mut bounds[known];
                    if outline.is_bounding(ring) && apart < bound.apart {
                        *bound = Bound { place: Some(place), apart, ..*bound };
                    }
                }
            }
        }
        bounds
    }

    fn snap_to_corners(&mut self, lattice: &Lattice, corners: &[(Place, [f64; 2])], scale: &Scale) {
        let snap = SNAP * scale.altitude;
        for &(place, corner) in corners {
            let around = lattice.grid_coordinates(corner);
            // Within the snapping distance, however oblique the lattice: a few columns and rows.
            let [i, j] = around.map(|v| v.round() as i32);
            let window = (i - 4..=i + 4).flat_map(|i| (j - 4..=j + 4).map(move |j| [i, j]));
            let near = window.filter_map(|site| self.number(site));
            let near = near
                .map(|number| (distance(lattice.position(self.near[number as usize].site), corner), number));
            // No two sites are within the snapping distance of one point.
            if let Some((apart, number)) = near.reduce(|a, b| if b.0 < a.0 { b } else { a })
                && apart <= snap
            {
                let one = &mut self.near[number as usize];
                let home = lattice.position(one.site);
                // Of two corners the nearer one gets the site; the other is a particle of its own.
                if one.point == home || distance(one.point, home) > apart {
                    (one.state, one.point) = (State::On { place, moved: true }, corner);
                }
            }
        }
    }

    /// Moves what is near enough onto the outline or a line; of the others says on which side of the outline they are.
    fn snap(&mut self, lattice: &Lattice, outline: &Partition, scale: &Scale, bounds: &[Bound]) {
        let snap = SNAP * scale.altitude;
        for (one, bound) in self.near.iter_mut().zip(bounds) {
            let State::On { place, .. } = one.state else { continue };
            let (home, target) = (lattice.position(one.site), outline.point(place));
            let apart = distance(target, home);
            if apart <= snap {
                let moved = apart > STAYS * scale.spacing;
                one.state = State::On { place, moved };
                one.point = if moved { target } else { home };
            } else {
                let outline = outline.outline();
                let inside = bound.place.map_or(bound.was, |place| is_left(outline, place, home));
                one.state = if inside { State::Inside } else { State::Outside };
            }
        }
    }
}

/// Whether a point is to the left of the outline, whose place nearest to it is given.
fn is_left(outline: &Outline, place: Place, p: [f64; 2]) -> bool {
    let at = outline.point(place);
    let off = [p[0] - at[0], p[1] - at[1]];
    let ring = &outline.rings()[place.ring];
    let count = ring.len();
    let outward = |piece: usize, t: f64| {
        let n = ring[piece].normal(t);
        n[0] * off[0] + n[1] * off[1]
    };
    let (before, after) = match place.t {
        0.0 => ((place.piece + count - 1) % count, place.piece),
        1.0 => (place.piece, (place.piece + 1) % count),
        t => return outward(place.piece, t) < 0.0,
    };
    let (a, b) = (ring[before].tangent(1.0), ring[after].tangent(0.0));
    let turns_left = a[0] * b[1] - a[1] * b[0] >= 0.0;
    let (first, second) = (outward(before, 1.0) < 0.0, outward(after, 0.0) < 0.0);
    if turns_left { first && second } else { first || second }
}
