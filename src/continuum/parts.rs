//! A body of which each rank lays out a part, and none the whole.
//!
//! A part is some columns of the lattice ([`Part`]). Before anything is laid out the ranks count the particles of the columns,
//! each those of as many; the counts say where the body is cut, and which number a particle has in the whole. Each rank then
//! lays out the columns that are its own, as many around them as its halos take, and a few more for these to have their
//! neighbours: what it has is a body like any other. The checks that need the whole are made together, and what one rank
//! refuses all refuse.

use std::ops::Range;
use std::sync::Arc;

use super::layout::{Layout, outlay_of, refuse_body};
use crate::flock::body::{Census, Cut, Extent, Outlay, Part, cell_width};
use crate::flock::neighbourhood::Neighbourhood;
use crate::material::boundary::Boundary;
use crate::material::cells::{Cells, templates};
use crate::ranks::Team;
use crate::scene::{BodySource, LeaderMotion, Load, RoleEntry, Scene, SceneError, SceneRegion, Weights};
use crate::sweep::Order;
use crate::sweep::caches::Caches;
use crate::sweep::domain::{Share, cuts, steps_of};
use crate::sweep::rows::usual_band;

/// The key for which a scene has to be laid out as a whole, on every rank; `None` where each can lay out its part.
pub fn laid_out_whole_for(scene: &Scene) -> Option<String> {
    let weights = matches!(scene.weights, Some(Weights::Solved | Weights::Gradient { .. }));
    let keys: [(bool, &str); 8] = [
        (!matches!(scene.body, BodySource::Cut(_)), "body.shape"),
        (scene.is_fitted, "body.outline"),
        (matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. }), "neighbours.kind"),
        (weights, "rule.weights"),
        (scene.update.order == Order::Sequential, "update.order"),
        (scene.equilibrium.is_some(), "equilibrium"),
        (scene.load_steps.is_some(), "load_steps"),
        (scene.actions.iter().any(|action| !action.is_cut()), "actions"),
    ];
    let of_role = |(k, entry): (usize, &RoleEntry)| {
        let is_led_by_truth = matches!(entry.motion, Some(LeaderMotion::Reference { .. }));
        is_led_by_truth.then(|| format!("roles[{k}].motion"))
    };
    let key = keys.into_iter().find(|(is, _)| *is).map(|(_, key)| key.to_owned());
    key.or_else(|| scene.roles.iter().enumerate().find_map(of_role))
}

/// Which columns of a body are whose.
#[derive(Clone, Debug)]
pub struct Parting {
    /// The first column, and the one after the last.
    columns: Range<i32>,
    /// Particles before each column, and in all; shape \[columns + 1\].
    before: Vec<u64>,
    extent: Extent,
    /// Columns around a particle that decide on it.
    reach: i32,
    /// Columns around those of a part, beyond its reach, that decide on which cells it has.
    margin: i32,
    /// Where the parts begin, and where the last one ends: numbers of columns, shape \[ranks + 1\].
    cuts: Vec<usize>,
    /// Particles of a halo on either side.
    halo: u64,
    /// The boundary of the body's cells, where something is on it.
    boundary: Option<Arc<Boundary>>,
}

/// A particle by the number of its column, its place in that from the bottom, and its row; column and row of the lattice.
type Corner = [i32; 3];

/// What is counted of some columns: particles of each, how far they reach, sides of cells that begin there.
type Counted = (Vec<u64>, Extent, Vec<[Corner; 2]>);

/// Most columns that are counted at once where one process counts them all.
const AT_ONCE: i32 = 256;

impl Parting {
    /// Counted by all ranks together.
    ///
    /// # Errors
    /// The body that cannot be laid out, on all ranks alike.
    pub fn among(scene: &Scene, team: &Team) -> Result<Self, SceneError> {
        let columns = agreed(scene, team, columns_of(scene))?;
        let cut = |rank: usize| columns.start + (columns.len() * rank / team.count()) as i32;
        let census = agreed(scene, team, census(scene, cut(team.rank())..cut(team.rank() + 1)))?;
        let sizes: Vec<usize> = (0..team.count()).map(|rank| (cut(rank + 1) - cut(rank)) as usize).collect();
        let counts = team.gather(&census.counts, &sizes);
        let extents = team.each(extent_words(&census.extent)).into_iter().map(extent_of);
        let extent = extents.fold(Extent::NONE, Extent::or);
        let sides = agreed(scene, team, sides(scene, cut(team.rank())..cut(team.rank() + 1)))?;
        let sides: Vec<u64> = sides.into_iter().flatten().flatten().map(|n| i64::from(n) as u64).collect();
        let sides = team.gather_all(&sides);
        let corner = |of: &[u64]| std::array::from_fn(|k| of[k] as i64 as i32);
        let sides = sides.chunks_exact(6).map(|of| [corner(&of[..3]), corner(&of[3..])]).collect();
        Self::new(scene, columns, (counts, extent, sides), (team.count(), agreed_caches(team)))
    }

    /// Counted by this process alone, for so many ranks.
    ///
    /// # Errors
    /// The body that cannot be laid out.
    pub fn alone(scene: &Scene, ranks: usize) -> Result<Self, SceneError> {
        let columns = columns_of(scene)?;
        let (mut counts, mut extent, mut all) = (Vec::new(), Extent::NONE, Vec::new());
        for start in columns.clone().step_by(AT_ONCE as usize) {
            let here = start..(start + AT_ONCE).min(columns.end);
            let census = census(scene, here.clone())?;
            counts.extend(census.counts);
            extent = extent.or(census.extent);
            all.extend(sides(scene, here)?);
        }
        Self::new(scene, columns, (counts, extent, all), (ranks, Caches::here()))
    }

    fn new(
        scene: &Scene,
        columns: Range<i32>,
        (counts, extent, sides): Counted,
        (ranks, caches): (usize, Caches),
    ) -> Result<Self, SceneError> {
        let outlay = outlay(scene)?;
        if extent.bounds.0[0] > extent.bounds.1[0] {
            return Err(refuse_body(scene, &outlay.empty()));
        }
        let reach = outlay.reach().map_err(|error| refuse_body(scene, &error))?;
        // A cell's neighbours say over which others it averages its dilatation.
        let margin = 2 * cell_width(&outlay.cells);
        let cuts = cuts(counts.iter().map(|&count| count as usize), ranks);
        let mut before = vec![0];
        before.extend(counts.iter().scan(0, |sum, count| {
            *sum += count;
            Some(*sum)
        }));
        let largest = counts.iter().copied().max().unwrap_or(0);
        let total = *before.last().unwrap_or(&0);
        let share = Share { ranks, caches, ..Share::whole() };
        let band = usual_band((reach as u64 * largest) as usize, total as usize, share) as u64;
        let sizes = cuts.windows(2).map(|ends| before[ends[1]] - before[ends[0]]);
        let least = sizes.filter(|&size| size > 0).min().unwrap_or(0);
        let halo = (steps_of((least / band) as usize) as u64 + 1) * band;
        let index = |[column, k, _]: Corner| before[(column - columns.start) as usize] as usize + k as usize;
        let place = |[column, _, row]: Corner| scene.lattice.position([column, row]);
        let boundary = is_along_outline(scene).then(|| Boundary {
            ends: sides.iter().map(|side| side.map(index)).collect(),
            places: sides.iter().map(|side| side.map(place)).collect(),
        });
        let boundary = boundary.map(Arc::new);
        Ok(Self { columns, before, extent, reach, margin, cuts, halo, boundary })
    }

    /// Particles of each rank, shape \[ranks\].
    pub fn counts(&self) -> Vec<usize> {
        self.cuts.windows(2).map(|ends| self.particles(&(ends[0]..ends[1]))).collect()
    }

    /// Particles of the body.
    pub fn total(&self) -> usize {
        self.before.last().map_or(0, |&total| total as usize)
    }

    /// The rank whose part takes most memory.
    pub fn largest(&self) -> usize {
        let held = |rank: &usize| self.particles(&self.window(&self.exact(*rank)));
        (0..self.cuts.len() - 1).max_by_key(held).unwrap_or(0)
    }

    fn particles(&self, columns: &Range<usize>) -> usize {
        (self.before[columns.end] - self.before[columns.start]) as usize
    }

    fn owned(&self, rank: usize) -> Range<usize> {
        self.cuts[rank]..self.cuts[rank + 1]
    }

    /// The columns of a rank with those around them that its halos take: at least what a frame may look at across an edge, and
    /// back.
    fn exact(&self, rank: usize) -> Range<usize> {
        let Range { start, end } = self.owned(rank);
        let (from, to) = (self.before[start].saturating_sub(self.halo), self.before[end] + self.halo);
        let least = (4 * self.reach + self.margin) as usize;
        let low = self.before.partition_point(|&before| before < from).min(start.saturating_sub(least));
        let high = self.before.partition_point(|&before| before < to).max(end + least);
        low..high.min(self.columns.len())
    }

    /// The same with those that their neighbours stand in.
    fn window(&self, exact: &Range<usize>) -> Range<usize> {
        let reach = (self.reach + self.margin) as usize;
        exact.start.saturating_sub(reach)..(exact.end + reach).min(self.columns.len())
    }

    /// Lays out the part of a rank.
    ///
    /// # Errors
    /// As [`Layout::new`], but for what needs the whole body.
    pub fn lay_out(&self, scene: &Scene, rank: usize) -> Result<Layout, SceneError> {
        let outlay = outlay(scene)?;
        let (owned, exact) = (self.owned(rank), self.exact(rank));
        let column = |number: usize| self.columns.start + number as i32;
        let window = self.window(&exact);
        let laid_out = outlay.lay_out(Some(column(window.start)..column(window.end)));
        let (mut body, neighbours) = laid_out.map_err(|error| refuse_body(scene, &error))?;
        let before = |number: usize| body.sites.partition_point(|site| site[0] < column(number));
        let here = |columns: &Range<usize>| before(columns.start)..before(columns.end);
        let (total, whole) = (self.total(), self.extent);
        let (owned_here, exact_here) = (here(&owned), here(&exact));
        debug_assert_eq!(owned_here.len(), self.particles(&owned));
        debug_assert_eq!(exact_here.len(), self.particles(&exact));
        let first = self.before[owned.start] as usize - owned_here.start;
        body.part = Some(Part { first, total, owned: owned_here, exact: exact_here, whole });
        Layout::of_part(scene, (body, neighbours), self.boundary.clone())
    }
}

fn outlay(scene: &Scene) -> Result<Outlay<'_>, SceneError> {
    match &scene.body {
        BodySource::Cut(cut) => Ok(outlay_of(scene, cut)),
        _ => Err(scene.refuse("body.shape", "points are no columns", "run it as a whole")),
    }
}

fn columns_of(scene: &Scene) -> Result<Range<i32>, SceneError> {
    outlay(scene)?.columns().map_err(|error| refuse_body(scene, &error))
}

fn census(scene: &Scene, columns: Range<i32>) -> Result<Census, SceneError> {
    outlay(scene)?.count(columns).map_err(|error| refuse_body(scene, &error))
}

/// Whether something of a scene is on the boundary of the body's cells, or its outline is taken from that.
fn is_along_outline(scene: &Scene) -> bool {
    let is_by_count = matches!(scene.body, BodySource::Cut(Cut::Count { .. }));
    let of_role = |entry: &RoleEntry| matches!(entry.region, SceneRegion::Outline(_));
    scene.loads.iter().any(|load| matches!(load, Load::Outline { .. }))
        || (scene.material.is_some() && is_by_count && scene.roles.iter().any(of_role))
}

/// The boundary of the cells whose first corner is in some columns, in their order; nothing where nothing is on it.
fn sides(scene: &Scene, columns: Range<i32>) -> Result<Vec<[Corner; 2]>, SceneError> {
    if !is_along_outline(scene) || columns.is_empty() {
        return Ok(Vec::new());
    }
    let outlay = outlay(scene)?;
    let refuse = |error| refuse_body(scene, &error);
    // Corners are a cell's width away, and so are the cells that decide on them.
    let far = outlay.reach().map_err(refuse)? + 2 * cell_width(&templates(&scene.lattice));
    let (body, _) = outlay.lay_out(Some(columns.start - far..columns.end + far)).map_err(refuse)?;
    let cells = Cells::of_body(&body);
    let begin = |column: i32| body.sites.partition_point(|site| site[0] < column);
    let own = cells.before(begin(columns.start))..cells.before(begin(columns.end));
    let corner = |i: u32| {
        let [column, row] = body.sites[i as usize];
        [column, (i as usize - begin(column)) as i32, row]
    };
    let sides = cells.boundary_sides_of(own, &cells.incidence(body.count()));
    Ok(sides.into_iter().map(|side| side.map(corner)).collect())
}

/// The first rank's caches: halos are measured by them.
fn agreed_caches(team: &Team) -> Caches {
    let Caches { whole_body, band } = Caches::here();
    let [whole_body, band] = team.of_first([whole_body as u64, band.map_or(u64::MAX, |band| band as u64)]);
    Caches { whole_body: whole_body as usize, band: Some(band as usize).filter(|_| band != u64::MAX) }
}

fn extent_words(Extent { bounds: (low, high), lowest, neighbours }: &Extent) -> [u64; 7] {
    let [a, b, c, d] = [low[0], low[1], high[0], high[1]].map(f64::to_bits);
    let [column, row] = lowest.map(|k| i64::from(k) as u64);
    [a, b, c, d, column, row, *neighbours as u64]
}

fn extent_of([a, b, c, d, column, row, neighbours]: [u64; 7]) -> Extent {
    let [a, b, c, d] = [a, b, c, d].map(f64::from_bits);
    let lowest = [column, row].map(|k| k as i64 as i32);
    Extent { bounds: ([a, b], [c, d]), lowest, neighbours: neighbours as usize }
}

/// The result of all ranks: if one refuses, all refuse with the words of the first that does.
///
/// # Errors
/// The first rank's that has one.
pub fn agreed<T>(scene: &Scene, team: &Team, own: Result<T, SceneError>) -> Result<T, SceneError> {
    let problem = own.as_ref().err().and_then(|error| error.problems().first());
    let words = problem.map_or_else(Vec::new, |problem| {
        let help = problem.help.as_deref().unwrap_or_default();
        [&problem.key, &problem.message, help].join("\0").into_bytes()
    });
    let all = team.each_bytes(&words);
    let first = all.iter().find(|words| !words.is_empty());
    match (own, first) {
        (Ok(own), None) => Ok(own),
        (own, Some(first)) => {
            let text = String::from_utf8_lossy(first);
            let mut parts = text.split('\0');
            let [key, message, help] = std::array::from_fn(|_| parts.next().unwrap_or_default());
            let own = own.err().filter(|_| words == *first);
            Err(own.unwrap_or_else(|| scene.refuse(key, message, help)))
        }
        (Err(own), None) => Err(own),
    }
}
