//! Which sites of a lattice are inside an outline, and which move onto it or onto the lines inside.

use std::collections::HashMap;
use std::ops::Range;

use super::near::stretches;
use super::{FitError, ROUNDING, SNAP, STAYS, Scale, is_kept_corner};
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

/// The sites of a lattice that are near an outline, and where it has its inside.
#[derive(Debug)]
pub struct Sites {
    /// The bounds of the outline, and a few sites around them.
    window: Window,
    inside: Inside,
    /// Of the regions of the body, where it has several; only far from any line they are exact.
    regions: Vec<Inside>,
    /// Number of each site near the outline in `near`.
    numbers: HashMap<Site, u32>,
    near: Vec<NearSite>,
}

/// The rows of each column of a window between the crossings of an outline: first and last ones.
#[derive(Debug)]
struct Inside {
    low: i32,
    rows: Vec<Vec<[i32; 2]>>,
}

/// The sites of some columns, each where it is.
#[derive(Debug)]
pub struct Columns<'a> {
    sites: &'a Sites,
    window: Window,
    /// Number of each site near the outline in [`Sites::near`], or one of the marks below.
    marks: Vec<u32>,
    /// Region of each site, where the body has several.
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

/// Whether the bounds of an outline hold no more sites than may be looked at together.
///
/// # Errors
/// If they hold more.
pub fn require_few(lattice: &Lattice, outline: &Outline) -> Result<(), FitError> {
    Sites::window(lattice, outline).and_then(require_fits).map(drop)
}

fn require_fits(window: Window) -> Result<Window, FitError> {
    if window.count() <= MOST_SITES { Ok(window) } else { Err(FitError::TooLarge { limit: MOST_SITES }) }
}

impl Inside {
    /// Between the crossings, where arcs may be taken for short chords, as sites near them are looked at again.
    fn of(outline: &Outline, lattice: &Lattice, window: &Window, scale: &Scale) -> Self {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); window.columns as usize];
        let low = window.low.map(i64::from);
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
                for column in first.max(low[0])..last.min(low[0] + window.columns) {
                    let share = (column as f64 - from[0]) / (to[0] - from[0]);
                    let row = from[1] + share * (to[1] - from[1]);
                    crossings[(column - low[0]) as usize].push(row);
                }
                from = to;
            }
        }
        let between = |mut rows: Vec<f64>| {
            rows.sort_by(f64::total_cmp);
            let most = low[1] + window.rows - 1;
            let rows = rows.chunks_exact(2).map(|pair| {
                [(pair[0].ceil() as i64).max(low[1]), (pair[1].floor() as i64).min(most)]
                    .map(|row| row as i32)
            });
            rows.filter(|[first, last]| first <= last).collect()
        };
        Self { low: window.low[0], rows: crossings.into_iter().map(between).collect() }
    }

    fn of_column(&self, column: i32) -> &[[i32; 2]] {
        let number = column.checked_sub(self.low).and_then(|k| usize::try_from(k).ok());
        number.and_then(|k| self.rows.get(k)).map_or(&[], Vec::as_slice)
    }

    fn has(&self, [column, row]: Site) -> bool {
        self.of_column(column).iter().any(|[first, last]| (*first..=*last).contains(&row))
    }
}

impl Sites {
    pub fn find(lattice: &Lattice, outline: &Partition, scale: &Scale) -> Result<Self, FitError> {
        let window = Self::window(lattice, outline.outline())?;
        let inside = |outline: &Outline| Inside::of(outline, lattice, &window, scale);
        let mut sites = Self {
            window,
            inside: inside(outline.outline()),
            regions: outline.regions().iter().map(inside).collect(),
            numbers: HashMap::new(),
            near: Vec::new(),
        };
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
        self.numbers.get(&site).copied()
    }

    /// The columns in which something may stand.
    pub fn all_columns(&self) -> Range<i32> {
        self.window.low[0]..self.window.low[0] + self.window.columns as i32
    }

    /// The sites of some columns.
    ///
    /// # Errors
    /// More than can be looked at together.
    pub fn columns(&self, lattice: &Lattice, columns: Range<i32>) -> Result<Columns<'_>, FitError> {
        let Window { low, rows, .. } = self.window;
        let all = self.all_columns();
        let (from, to) = (columns.start.max(all.start), columns.end.min(all.end));
        let window = Window { low: [from, low[1]], columns: i64::from((to - from).max(0)), rows };
        let mut marks = vec![FAR_OUTSIDE; require_fits(window)?.count() as usize];
        let mut regions = vec![0; if self.regions.is_empty() { 0 } else { marks.len() }];
        let each = |inside: &Inside, set: &mut dyn FnMut(usize)| {
            for column in from..to {
                for [first, last] in inside.of_column(column) {
                    let sites =
                        (*first..=*last).map(|row| [column, row]).filter(|&site| lattice.is_site(site));
                    sites.filter_map(|site| window.number(site)).for_each(&mut *set);
                }
            }
        };
        each(&self.inside, &mut |cell| marks[cell] = FAR_INSIDE);
        for (k, region) in (1..).zip(&self.regions) {
            each(region, &mut |cell| regions[cell] = k);
        }
        for (number, near) in (0..).zip(&self.near) {
            if let Some(cell) = window.number(near.site) {
                marks[cell] = number;
            }
        }
        Ok(Columns { sites: self, window, marks, regions })
    }

    /// Whether a site is inside and not on the outline.
    pub fn is_inside(&self, site: Site) -> bool {
        match self.number(site) {
            Some(number) => self.near[number as usize].state == State::Inside,
            None => self.inside.has(site),
        }
    }

    fn window(lattice: &Lattice, outline: &Outline) -> Result<Window, FitError> {
        let (low, high) = lattice.grid_bounds(outline.bounds());
        // Far enough for the cells around every site near the outline.
        let (lows, highs) = (low.map(|v| v.floor() - 8.0), high.map(|v| v.ceil() + 8.0));
        if !lows.iter().chain(&highs).all(|v| v.abs() < 1e9) {
            return Err(FitError::TooLarge { limit: MOST_SITES });
        }
        Ok(Window::new(lows.map(|v| v as i32), highs.map(|v| v as i32)))
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
                let around = (low.map(|v| v - reach), high.map(|v| v + reach));
                let (least, most) = lattice.grid_bounds(around);
                let range = |k: usize| least[k].ceil() as i32..=most[k].floor() as i32;
                for site in range(0).flat_map(|i| range(1).map(move |j| [i, j])) {
                    if !lattice.is_site(site) || self.window.number(site).is_none() {
                        continue;
                    }
                    let point = lattice.position(site);
                    let t = piece.nearest(point);
                    let apart = distance(piece.point(t), point);
                    if apart > reach {
                        continue;
                    }
                    let place = Place { ring, piece: number, t };
                    let state = State::On { place, moved: true };
                    let fresh = self.near.len() as u32;
                    let known = *self.numbers.entry(site).or_insert(fresh);
                    let (is_new, known) = (known == fresh, known as usize);
                    if is_new {
                        self.near.push(NearSite { site, state, point });
                        distances.push(apart);
                        let was = self.inside.has(site);
                        bounds.push(Bound { place: None, apart: f64::INFINITY, was });
                    } else if apart < distances[known] * (1.0 - ROUNDING) {
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
            if let Some((apart, number)) =
                near.reduce(|a, b| if b.0 < a.0 * (1.0 - ROUNDING) { b } else { a })
                && apart <= snap * (1.0 + ROUNDING)
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
            if apart <= snap * (1.0 + ROUNDING) {
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

impl Columns<'_> {
    pub fn has_column(&self, column: i32) -> bool {
        (0..self.window.columns).contains(&(i64::from(column) - i64::from(self.window.low[0])))
    }

    pub fn window(&self) -> Window {
        self.window
    }

    /// See [`Sites::is_inside`].
    pub fn is_inside(&self, site: Site) -> bool {
        match self.window.number(site).map(|cell| self.marks[cell]) {
            None | Some(FAR_OUTSIDE) => false,
            Some(FAR_INSIDE) => true,
            Some(number) => self.sites.near[number as usize].state == State::Inside,
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

    /// The sites far inside, and those near the outline whose number in [`Sites::near`] is taken; ascending.
    pub fn sites(&self, is_taken: impl Fn(u32) -> bool) -> Vec<Site> {
        let Window { low, rows, .. } = self.window;
        let is_taken = |mark: u32| mark == FAR_INSIDE || (mark != FAR_OUTSIDE && is_taken(mark));
        let mut sites = Vec::new();
        for (column, marks) in (low[0]..).zip(self.marks.chunks_exact(rows as usize)) {
            let rows = (low[1]..).zip(marks).filter(|(_, mark)| is_taken(**mark));
            sites.extend(rows.map(|(row, _)| [column, row]));
        }
        sites
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
