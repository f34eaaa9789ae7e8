//! From the roles of particles to what holds the shape.
//!
//! A region that was given by its place holds that place of the shape: a part of the outline, or, where it takes in
//! whole cells, a part of the plane, from its first particle to its last. Particles that were picked one by one hold
//! the straight lines between those that share a side of a cell, and single points.

use std::collections::{BTreeMap, BTreeSet};

use crate::continuum::layout::Layout;
use crate::engine::setup::{RoleChange, of_first_roles};
use crate::fem::{Field, Holding, Support, WayField};
use crate::flock::motion::Motion;
use crate::flock::region::Region;
use crate::flock::role::Role;
use crate::flock::vectors::distance;
use crate::geometry::outline::Outline;
use crate::geometry::point::{Point, bounds};
use crate::geometry::portion::{Area, Portion, Selection};
use crate::material::cells::Cells;
use crate::scene::{Scene, SceneError, SceneRegion};

/// Particles nearer to the outline than this part of the spacing are on it.
const ON_OUTLINE: f64 = 1e-6;

/// The supports of the shape at `step`: roles that hold from the start, the later ones before the earlier where they
/// overlap. Leaders led by a truth that is not known yet hold nothing.
///
/// # Errors
/// Names a region of the outline that is empty.
pub fn supports(
    scene: &Scene,
    layout: &Layout,
    outline: &Outline,
    changes: &[RoleChange],
    step: f64,
) -> Result<Vec<Support<'static>>, SceneError> {
    let mut supports = Vec::new();
    // As the rule's own equilibrium has it: the way ends where the last leader rests.
    let motions = changes.iter().filter_map(|change| change.motion.as_ref());
    let durations =
        motions.map(|motion| motion.duration().map_or(step, |steps| f64::min(steps as f64, step)));
    let end = durations.fold(0.0, f64::max);
    let holders = of_first_roles(changes, layout.body.count(), |k, change| holds(change).then_some(k));
    for (k, change) in changes.iter().enumerate().filter(|(_, change)| holds(change)) {
        let axes = change.axis.map_or([0, 1].as_slice(), |axis| &[0, 1][axis as usize..=axis as usize]);
        let is_own = |i: usize| axes.iter().any(|&axis| holders[i][axis] == Some(k));
        let own: Vec<usize> = change.particles.iter().copied().filter(|&i| is_own(i)).collect();
        // A region of which a later entry frees some particles holds the others alone.
        let is_whole = change.particles.iter().all(|&i| axes.iter().all(|&axis| holders[i][axis].is_some()));
        let picked = Picked { layout, outline, particles: &own };
        let of_region = match (is_whole, own.is_empty()) {
            (_, true) => continue,
            (true, false) => picked.region(scene, k, &scene.roles[k].region, &change.particles)?,
            (false, false) => None,
        };
        let mut components = [false; 2];
        axes.iter().for_each(|&axis| components[axis] = true);
        for on in of_region.map_or_else(|| picked.one_by_one(), |on| vec![on]) {
            let displacement = displacement(layout, change, step);
            supports.push(Support { on, components, displacement, way: way(change, end) });
        }
    }
    Ok(supports)
}

fn holds(change: &RoleChange) -> bool {
    let is_known = change.role == Role::Clamped || (change.role == Role::Leader && change.motion.is_some());
    change.is_at_once() && is_known
}

/// The places at which an entry holds its particles \[length\].
fn displacement(layout: &Layout, change: &RoleChange, step: f64) -> Field<'static> {
    match &change.motion {
        None => Box::new(|_| [0.0; 2]),
        Some(Motion::Table { .. }) => {
            let reference = &layout.body.reference;
            let moved = |(which, &i): (usize, &usize)| {
                let base = reference.get(i);
                let motion = change.motion.as_ref().map(|motion| motion.displacement(step, which, base));
                (base, motion.unwrap_or_default())
            };
            let known: Vec<(Point, Point)> = change.particles.iter().enumerate().map(moved).collect();
            Box::new(move |p| between(&known, p))
        }
        Some(motion) => {
            let motion = motion.clone();
            Box::new(move |p| motion.displacement(step, 0, p))
        }
    }
}

/// How an entry's particles get there, `end` steps being the whole way; none where that is straight.
fn way(change: &RoleChange, end: f64) -> Option<WayField<'static>> {
    match change.motion.clone()? {
        Motion::Table { .. } | Motion::Velocity { .. } => None,
        motion => Some(Box::new(move |part, p| motion.displacement(part * end, 0, p))),
    }
}

/// Displacements known at points, carried to a place: in a straight line between the nearest two on either side of it,
/// or, where there are none, by the inverse squares of the distances (D. Shepard, Proc. 23rd ACM Nat. Conf. (1968) 517).
fn between(known: &[(Point, Point)], p: Point) -> Point {
    let mut by_distance: Vec<(f64, usize)> =
        known.iter().enumerate().map(|(k, (at, _))| (distance(*at, p), k)).collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(apart, first)) = by_distance.first() else { return [0.0; 2] };
    let (at, u) = known[first];
    if apart == 0.0 {
        return u;
    }
    for &(_, second) in by_distance.iter().skip(1).take(8) {
        let (other, v) = known[second];
        let length = distance(at, other);
        let share =
            ((p[0] - at[0]) * (other[0] - at[0]) + (p[1] - at[1]) * (other[1] - at[1])) / (length * length);
        let foot = [0, 1].map(|k| at[k] + share * (other[k] - at[k]));
        if share > 0.0 && distance(foot, p) <= 0.05 * length {
            return [0, 1].map(|k| u[k] + share * (v[k] - u[k]));
        }
    }
    let (mut sum, mut shares) = ([0.0; 2], 0.0);
    for (at, u) in known {
        let share = distance(*at, p).powi(-2);
        sum = [sum[0] + share * u[0], sum[1] + share * u[1]];
        shares += share;
    }
    sum.map(|s| s / shares)
}

/// The particles that an entry holds.
struct Picked<'a> {
    layout: &'a Layout,
    outline: &'a Outline,
    particles: &'a [usize],
}

impl Picked<'_> {
    fn at(&self, particle: usize) -> Point {
        self.layout.body.reference.get(particle)
    }

    fn spacing(&self) -> f64 {
        self.layout.body.lattice.spacing()
    }

    /// The part of the shape that a region stands for; none where it is its particles alone. `all` are those it takes in.
    fn region(
        &self,
        scene: &Scene,
        entry: usize,
        region: &SceneRegion,
        all: &[usize],
    ) -> Result<Option<Holding>, SceneError> {
        let on_outline = || self.layout.portions(scene, &format!("roles[{entry}]"), region);
        let known = match region {
            SceneRegion::Outline(_) | SceneRegion::Outermost(_) => {
                return Ok(Some(Holding::Portions(on_outline()?)));
            }
            SceneRegion::Known(known) => known,
        };
        let near = ON_OUTLINE * self.spacing();
        let (min, max) = bounds(all.iter().map(|&i| self.at(i)));
        let has_cell = self.has_whole_cell(all);
        let is_outer = all.iter().all(|&i| self.outline.nearest(self.at(i)).1 <= near);
        let on = |selection: Selection| self.outline.portions(&selection, near);
        let along = |portions: Vec<Portion>| {
            (is_outer && !portions.is_empty()).then_some(Holding::Portions(portions))
        };
        let spanned = Area::Box { min, max };
        let around = |centre| Area::Disc { centre, radius: self.farthest(all, centre) };
        Ok(match known {
            Region::Boundary => Some(Holding::Portions(self.outline.portions(&Selection::All, near))),
            Region::Ids(_) => None,
            Region::All => Some(Holding::Region(spanned)),
            Region::In(Area::Disc { centre, .. }) if has_cell => Some(Holding::Region(around(*centre))),
            Region::In(_) | Region::Edge { .. } if has_cell => Some(Holding::Region(spanned)),
            Region::Edge { .. } if !is_outer => Some(Holding::Portions(on_outline()?)),
            Region::In(disc @ Area::Disc { .. }) => {
                along(common(&on(Selection::In(*disc)), &on(Selection::In(spanned))))
            }
            Region::In(Area::Box { .. }) | Region::Edge { .. } => along(on(Selection::In(spanned))),
        })
    }

    /// The distance of the farthest of some particles from a point \[length\].
    fn farthest(&self, particles: &[usize], from: Point) -> f64 {
        particles.iter().map(|&i| distance(self.at(i), from)).fold(0.0, f64::max)
    }

    fn has_whole_cell(&self, particles: &[usize]) -> bool {
        let inside: BTreeSet<u32> = particles.iter().map(|&i| i as u32).collect();
        let cells = self.layout.cells.as_ref();
        cells.is_some_and(|cells| cells.iter().any(|cell| cell.iter().all(|i| inside.contains(i))))
    }

    /// Lines between particles that share a side of a cell, and points.
    fn one_by_one(&self) -> Vec<Holding> {
        let inside: BTreeSet<u32> = self.particles.iter().map(|&i| i as u32).collect();
        let sides =
            self.layout.cells.as_ref().map_or_else(BTreeSet::new, |cells| sides_within(cells, &inside));
        let near = ON_OUTLINE * self.spacing();
        let mut joined: BTreeSet<u32> = BTreeSet::new();
        let (mut portions, mut segments) = (Vec::new(), Vec::new());
        for [a, b] in sides {
            joined.extend([a, b]);
            let [from, to] = [a, b].map(|i| self.at(i as usize));
            let middle = [0, 1].map(|k| 0.5 * (from[k] + to[k]));
            let sagitta = self.outline.nearest(middle).1;
            let is_outer = [from, to].iter().all(|&p| self.outline.nearest(p).1 <= near)
                && sagitta <= 0.1 * distance(from, to);
            if is_outer {
                portions.extend(self.outline.portions(&Selection::Between { from, to }, near));
            } else {
                segments.push([from, to]);
            }
        }
        let mut found: Vec<Holding> = merged(segments, near).into_iter().map(Holding::Segment).collect();
        if !portions.is_empty() {
            found.push(Holding::Portions(joined_portions(portions)));
        }
        let is_inside = |p: Point| self.outline.contains(p) || self.outline.nearest(p).1 <= near;
        let single = self.particles.iter().filter(|&&i| !joined.contains(&(i as u32)));
        found.extend(single.map(|&i| self.at(i)).filter(|&p| is_inside(p)).map(Holding::Point));
        found
    }
}

/// Sides of cells both of whose ends are given, the lower first.
fn sides_within(cells: &Cells, inside: &BTreeSet<u32>) -> BTreeSet<[u32; 2]> {
    let of_cell = |cell: &[u32]| {
        let side = |k: usize| [cell[k], cell[(k + 1) % cell.len()]];
        (0..cell.len()).map(side).collect::<Vec<_>>()
    };
    let all = cells.iter().flat_map(of_cell).map(|[a, b]| [a.min(b), a.max(b)]);
    all.filter(|side| side.iter().all(|i| inside.contains(i))).collect()
}

/// The portions that two selections have in common.
fn common(some: &[Portion], others: &[Portion]) -> Vec<Portion> {
    let both = |a: &Portion, b: &Portion| {
        let t = [a.t[0].max(b.t[0]), a.t[1].min(b.t[1])];
        ((a.ring, a.piece) == (b.ring, b.piece) && t[0] <= t[1]).then_some(Portion { t, ..*a })
    };
    some.iter().flat_map(|a| others.iter().filter_map(move |b| both(a, b))).collect()
}

/// Portions of one piece that follow each other are one.
fn joined_portions(mut portions: Vec<Portion>) -> Vec<Portion> {
    portions.sort_by(|a, b| (a.ring, a.piece).cmp(&(b.ring, b.piece)).then(a.t[0].total_cmp(&b.t[0])));
    let mut joined: Vec<Portion> = Vec::new();
    for portion in portions {
        match joined.last_mut() {
            Some(last)
                if (last.ring, last.piece) == (portion.ring, portion.piece)
                    && portion.t[0] <= last.t[1] + 1e-9 =>
            {
                last.t[1] = last.t[1].max(portion.t[1]);
            }
            _ => joined.push(portion),
        }
    }
    joined
}

/// From where to where along its line, and its ends.
type Stretch = ([f64; 2], [Point; 2]);

/// Segments on one line that touch are one.
fn merged(segments: Vec<[Point; 2]>, near: f64) -> Vec<[Point; 2]> {
    let mut lines: BTreeMap<[i64; 2], Vec<Stretch>> = BTreeMap::new();
    for [from, to] in segments {
        let length = distance(from, to);
        let mut along = [0, 1].map(|k| (to[k] - from[k]) / length);
        if along[0] < -1e-9 || (along[0].abs() <= 1e-9 && along[1] < 0.0) {
            along = along.map(|v| -v);
        }
        let offset = along[0] * from[1] - along[1] * from[0];
        let key = [(along[1].atan2(along[0]) * 1e6).round() as i64, (offset / (10.0 * near)).round() as i64];
        let place = |p: Point| along[0] * p[0] + along[1] * p[1];
        let (a, b) = if place(from) < place(to) { (from, to) } else { (to, from) };
        lines.entry(key).or_default().push(([place(a), place(b)], [a, b]));
    }
    let mut found = Vec::new();
    for (_, mut on_line) in lines {
        on_line.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let mut last: Option<Stretch> = None;
        for (range, ends) in on_line {
            last = match last {
                Some((whole, [from, to])) if range[0] <= whole[1] + near => {
                    let further = range[1] > whole[1];
                    Some(([whole[0], whole[1].max(range[1])], [from, if further { ends[1] } else { to }]))
                }
                other => {
                    found.extend(other.map(|(_, ends)| ends));
                    Some((range, ends))
                }
            };
        }
        found.extend(last.map(|(_, ends)| ends));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_on_one_line_become_one() {
        let chain = vec![[[0.0, 0.0], [1.0, 1.0]], [[2.0, 2.0], [1.0, 1.0]], [[2.0, 2.0], [2.0, 3.0]]];
        let found = merged(chain, 1e-6);
        assert_eq!(found.len(), 2);
        assert!(found.contains(&[[0.0, 0.0], [2.0, 2.0]]) && found.contains(&[[2.0, 2.0], [2.0, 3.0]]));
    }

    #[test]
    fn displacements_are_carried_in_a_straight_line_between_particles() {
        let known = [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [2.0, 1.0]), ([2.0, 0.0], [0.0, 5.0])];
        for (p, expected) in [([0.25, 0.0], [0.5, 1.0]), ([1.5, 0.0], [1.0, 3.0]), ([1.0, 0.0], [2.0, 1.0])] {
            let found = between(&known, p);
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{p:?}: {found:?}");
        }
    }
}
