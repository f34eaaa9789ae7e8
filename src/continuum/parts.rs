//! A body of which each rank lays out a part, and none the whole.
//!
//! A part is some columns of the lattice ([`Part`]). Before anything is laid out the ranks count the particles of the columns,
//! each those of as many; the counts say where the body is cut, and which number a particle has in the whole. Each rank then
//! lays out the columns that are its own, as many around them as its halos take, and a few more for these to have their
//! neighbours: what it has is a body like any other. The checks that need the whole are made together, and what one rank
//! refuses all refuse.

use std::ops::Range;
use std::sync::Arc;

use super::among::followed;
use super::layout::refusals::{refuse_body, refuse_fit};
use super::layout::regions::FLAT;
use super::layout::{Layout, outlay_of, to_be_fitted};
use crate::engine::shared::agreed_caches;
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::Lattice;
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::outlay::{Census, Outlay, cell_width};
use crate::flock::part::{AlongOutline, Extent, Part};
use crate::geometry::partition::Partition;
use crate::material::boundary::Boundary;
use crate::material::cells::{Cells, templates};
use crate::material::fit::{Band, Fitted, Numbers};
use crate::material::recovery::REACH;
use crate::ranks::Team;
use crate::scene::{BodySource, LeaderMotion, Load, RoleEntry, Scene, SceneError, SceneRegion};
use crate::sweep::Order;
use crate::sweep::caches::Caches;
use crate::sweep::domain::{Share, cuts, steps_of};
use crate::sweep::rows::usual_band;

/// The key for which a scene has to be laid out as a whole, on every rank; `None` where each can lay out its part.
pub fn laid_out_whole_for(scene: &Scene) -> Option<String> {
    let keys: [(bool, &str); 5] = [
        (!matches!(scene.body, BodySource::Cut(_)), "body.shape"),
        (matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. }), "neighbours.kind"),
        (scene.update.order == Order::Sequential, "update.order"),
        (scene.equilibrium.is_some_and(|asked| asked.accuracy.is_some()), "equilibrium"),
        (followed(scene).any(|(_, changed)| is_laid_out_otherwise(scene, changed)), "actions"),
    ];
    let of_role = |(k, entry): (usize, &RoleEntry)| {
        let is_led_by_truth = matches!(entry.motion, Some(LeaderMotion::Reference { .. }));
        is_led_by_truth.then(|| format!("roles[{k}].motion"))
    };
    let key = keys.into_iter().find(|(is, _)| *is).map(|(_, key)| key.to_owned());
    key.or_else(|| scene.roles.iter().enumerate().find_map(of_role))
}

/// Whether keys that change on the way ask for other columns around those of a part, or for the whole.
fn is_laid_out_otherwise(scene: &Scene, changed: &Scene) -> bool {
    changed.is_fitted != scene.is_fitted
        || changed.neighbourhood != scene.neighbourhood
        || laid_out_whole_for(changed).is_some()
}

/// Whether a material of the body is so close to incompressible that its dilatations are averaged over cells.
pub(super) fn averages_dilatations(scene: &Scene) -> bool {
    let mut materials = scene.material.iter().chain(scene.inclusions.iter().map(|part| &part.material));
    materials.any(|elastic| elastic.averaged().is_some())
}

/// Which columns of a body are whose.
#[derive(Clone, Debug)]
pub struct Parting {
    /// The first column, and the one after the last.
    columns: Range<i32>,
    /// Particles before each column, and in all; shape \[columns + 1\].
    before: Vec<u64>,
    /// The same of those that stand at sites.
    regular: Vec<u64>,
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
    /// The outline that the body is fitted to.
    fitted: Option<Arc<FittedBand>>,
}

/// A band of cells along the outline of a body, which all ranks have.
#[derive(Debug)]
struct FittedBand {
    band: Band,
    partition: Partition,
    /// Whether no cell is cut: then the body is that of the lattice.
    is_whole: bool,
}

/// A particle by the number of its column, its place in that from the bottom, and its row; column and row of the lattice. Of one
/// along an outline that stands at no site [`Body::ALONG_OUTLINE`] and its number.
type Corner = [i32; 3];

/// A side of a cell, with the place of the cell among those that come after all others, or 0.
type Side = (u64, [Corner; 2]);

/// What is counted of some columns: particles of each, how far they reach, sides of cells that begin there, and whether all stand
/// where those of the outline do.
struct Counted {
    counts: Vec<u64>,
    extent: Extent,
    sides: Vec<Side>,
    keeps_outline: bool,
}

/// Most columns that are counted at once where one process counts them all.
const AT_ONCE: i32 = 256;

impl Parting {
    /// Counted by all ranks together.
    ///
    /// # Errors
    /// The body that cannot be laid out, on all ranks alike.
    pub fn among(scene: &Scene, team: &Team) -> Result<Self, SceneError> {
        let (fitted, columns) = agreed(scene, team, source(scene))?;
        let cut = |rank: usize| columns.start + (columns.len() * rank / team.count()) as i32;
        let own = cut(team.rank())..cut(team.rank() + 1);
        let counted = agreed(scene, team, Counted::of(scene, fitted.as_ref(), own))?;
        let sizes: Vec<usize> = (0..team.count()).map(|rank| (cut(rank + 1) - cut(rank)) as usize).collect();
        let counts = team.gather(&counted.counts, &sizes);
        let Extent { bounds, lowest, neighbours } = counted.extent;
        let extents = team.gather_all(&[(bounds, lowest, neighbours)]).into_iter();
        let extents = extents.map(|(bounds, lowest, neighbours)| Extent { bounds, lowest, neighbours });
        let sides = team.gather_all(&counted.sides);
        let keeps_outline = !team.any(!counted.keeps_outline);
        let counted =
            Counted { counts, extent: extents.fold(Extent::NONE, Extent::or), sides, keeps_outline };
        Self::new(scene, (fitted, columns), counted, (team.count(), agreed_caches(team)))
    }

    /// Counted by this process alone, for so many ranks.
    ///
    /// # Errors
    /// The body that cannot be laid out.
    pub fn alone(scene: &Scene, ranks: usize) -> Result<Self, SceneError> {
        let (fitted, columns) = source(scene)?;
        let mut all =
            Counted { counts: Vec::new(), extent: Extent::NONE, sides: Vec::new(), keeps_outline: true };
        for start in columns.clone().step_by(AT_ONCE as usize) {
            let counted = Counted::of(scene, fitted.as_ref(), start..(start + AT_ONCE).min(columns.end))?;
            all.counts.extend(counted.counts);
            all.extent = all.extent.or(counted.extent);
            all.sides.extend(counted.sides);
            all.keeps_outline &= counted.keeps_outline;
        }
        Self::new(scene, (fitted, columns), all, (ranks, Caches::here()))
    }

    fn new(
        scene: &Scene,
        (fitted, columns): (Option<FittedBand>, Range<i32>),
        Counted { counts, extent, mut sides, keeps_outline }: Counted,
        (ranks, caches): (usize, Caches),
    ) -> Result<Self, SceneError> {
        let outlay = outlay(scene)?;
        if extent.bounds.0[0] > extent.bounds.1[0] {
            return Err(refuse_body(scene, &outlay.empty()));
        }
        let reach = outlay.reach().map_err(|error| refuse_body(scene, &error))?;
        // Particles along an outline see each other as far as those of the lattice do.
        let cells_away = if averages_dilatations(scene) { 2 } else { 1 };
        let reach = fitted.iter().map(|fitted| cells_away * fitted.band.reach()).fold(reach, i32::max);
        // A cell's neighbours say over which others it averages its dilatation; along an outline stress is recovered from cells
        // that are farther away.
        let later = followed(scene).filter_map(|(_, changed)| outlay_if_cut(changed));
        let width = |outlay: &Outlay<'_>| cell_width(&outlay.cells);
        let margin = 2 * later.map(|later| width(&later)).fold(width(&outlay), i32::max);
        let margin = fitted.iter().map(|_| 2 * reach + recovery_reach(&scene.lattice)).fold(margin, i32::max);
        let cuts = cuts(counts.iter().map(|&count| count as usize), ranks);
        let before = sums(counts.iter().copied());
        let largest = counts.iter().copied().max().unwrap_or(0);
        let total = *before.last().unwrap_or(&0);
        let share = Share { ranks, caches, ..Share::whole() };
        let band = usual_band((reach as u64 * largest) as usize, total as usize, share) as u64;
        let sizes = cuts.windows(2).map(|ends| before[ends[1]] - before[ends[0]]);
        let least = sizes.filter(|&size| size > 0).min().unwrap_or(0);
        let halo = (steps_of((least / band) as usize) as u64 + 1) * band;
        let is_cut = |fitted: &&FittedBand| !fitted.is_whole;
        let along = fitted.as_ref().filter(is_cut).map(|fitted| fitted.band.count_along(columns.clone()));
        let regular = match &along {
            Some(along) => sums(counts.iter().zip(along).map(|(all, along)| all - along)),
            None => before.clone(),
        };
        let places: Vec<[f64; 2]> = fitted.iter().flat_map(|fitted| fitted.band.along()).collect();
        let at_sites = *regular.last().unwrap_or(&0) as usize;
        let index = |[column, k, _]: Corner| match column {
            Body::ALONG_OUTLINE => at_sites + k as usize,
            _ => regular[(column - columns.start) as usize] as usize + k as usize,
        };
        let place = |[column, k, row]: Corner| match column {
            Body::ALONG_OUTLINE => places[k as usize],
            _ => scene.lattice.position([column, row]),
        };
        sides.sort_by_key(|(place, _)| *place);
        let boundary = is_along_outline(scene).then(|| Boundary {
            ends: sides.iter().map(|(_, side)| side.map(index)).collect(),
            places: sides.iter().map(|(_, side)| side.map(place)).collect(),
        });
        let boundary = boundary.map(Arc::new);
        let fitted = fitted.filter(|fitted| !fitted.is_whole || keeps_outline).map(Arc::new);
        Ok(Self { columns, before, regular, extent, reach, margin, cuts, halo, boundary, fitted })
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
        let (owned, exact) = (self.owned(rank), self.exact(rank));
        let column = |number: usize| self.columns.start + number as i32;
        let window = self.window(&exact);
        let laid_out = lay_out(scene, self.fitted.as_deref(), column(window.start)..column(window.end))?;
        let before = |number: usize| laid_out.columns.partition_point(|&other| other < column(number));
        let here = |columns: &Range<usize>| before(columns.start)..before(columns.end);
        let (total, whole) = (self.total(), self.extent);
        let (owned_here, exact_here) = (here(&owned), here(&exact));
        let first = self.before[owned.start] as usize - owned_here.start;
        let mut part = Part { first, total, owned: owned_here, exact: exact_here, whole, along: None };
        let fitted = self.fitted.as_deref();
        let mut layout = match laid_out.of {
            Of::Lattice(mut body, neighbours) => {
                let kept = |fitted: &FittedBand| {
                    let outline = fitted.band.outline_of(&body.sites);
                    (Some(Arc::new(outline)), fitted.partition.clone())
                };
                let kept = fitted.map(kept);
                body.part = Some(part);
                Layout::of_part(scene, (body, neighbours), kept, self.boundary.clone())?
            }
            Of::Fitted(mut cut, Numbers { along, cut: numbers, .. }) => {
                let regular = [self.regular.len() - 1, window.start].map(|of| self.regular[of] as usize);
                part.along = Some(Arc::new(AlongOutline::new(regular.into(), along, numbers)));
                cut.body.part = Some(part);
                let partition = fitted.map(|fitted| fitted.partition.clone()).expect("it is fitted");
                let boundary = self.boundary.clone();
                Layout { boundary, ..Layout::of_cut_cells(scene, cut, partition)? }
            }
        };
        layout.flat = fitted.map(|fitted| self.flat(scene, fitted));
        Ok(layout)
    }

    /// On which sides several particles stand farthest out: those of the outline do.
    fn flat(&self, scene: &Scene, FittedBand { band, .. }: &FittedBand) -> [bool; 4] {
        let (low, high) = self.extent.bounds;
        let (spacing, mut counts) = (scene.lattice.spacing(), [0; 4]);
        for [x, y] in band.places() {
            let depths = [x - low[0], high[0] - x, y - low[1], high[1] - y];
            // As a region along a side picks them.
            let is_there = depths.map(|depth| depth <= FLAT * spacing + 1e-9 * spacing);
            counts.iter_mut().zip(is_there).for_each(|(count, is)| *count += usize::from(is));
        }
        counts.map(|count| count > 1)
    }
}

/// Columns within which stress along an outline is recovered from cells.
fn recovery_reach(lattice: &Lattice) -> i32 {
    let size = lattice.spacing().max((lattice.cell_area() * lattice.sublattices() as f64).sqrt());
    let column = |place: [f64; 2]| lattice.grid_coordinates(place)[0];
    let across = [[size, 0.0], [0.0, size]].map(|place| column(place) - column([0.0; 2]));
    ((REACH + 1.0) * f64::hypot(across[0], across[1])).ceil() as i32
}

/// 0, and the sums of the first numbers.
fn sums(numbers: impl Iterator<Item = u64>) -> Vec<u64> {
    let sums = numbers.scan(0, |sum, number| {
        *sum += number;
        Some(*sum)
    });
    std::iter::once(0).chain(sums).collect()
}

/// Where the particles of a body are taken from: the outline that it is fitted to, if it is, and the columns.
fn source(scene: &Scene) -> Result<(Option<FittedBand>, Range<i32>), SceneError> {
    let outlay = outlay(scene)?;
    let of_lattice = || outlay.columns().map_err(|error| refuse_body(scene, &error));
    let Some(partition) = to_be_fitted(scene)? else { return Ok((None, of_lattice()?)) };
    let band = Band::of(&scene.lattice, &partition).map_err(|error| refuse_fit(scene, &error))?;
    let is_whole = band.is_whole();
    let columns = if is_whole { of_lattice()? } else { band.columns() };
    Ok((Some(FittedBand { band, partition, is_whole }), columns))
}

/// The particles in some columns.
struct LaidOut {
    of: Of,
    /// The column of each, ascending.
    columns: Vec<i32>,
}

enum Of {
    Lattice(Body, Neighbours),
    Fitted(Fitted, Numbers),
}

fn lay_out(scene: &Scene, fitted: Option<&FittedBand>, columns: Range<i32>) -> Result<LaidOut, SceneError> {
    if let Some(fitted) = fitted.filter(|fitted| !fitted.is_whole) {
        let laid_out = fitted.band.lay_out(Some(columns));
        let (fitted, mut numbers) = laid_out.map_err(|error| refuse_fit(scene, &error))?;
        let columns = std::mem::take(&mut numbers.columns);
        return Ok(LaidOut { of: Of::Fitted(fitted, numbers), columns });
    }
    let laid_out = outlay(scene)?.lay_out(Some(columns));
    let (body, neighbours) = laid_out.map_err(|error| refuse_body(scene, &error))?;
    let columns = body.sites.iter().map(|site| site[0]).collect();
    Ok(LaidOut { of: Of::Lattice(body, neighbours), columns })
}

impl Counted {
    fn of(scene: &Scene, fitted: Option<&FittedBand>, columns: Range<i32>) -> Result<Self, SceneError> {
        let refuse = |error| refuse_fit(scene, &error);
        let cut = fitted.filter(|fitted| !fitted.is_whole);
        let Census { counts, extent } = match cut {
            Some(fitted) => fitted.band.count(columns.clone()).map_err(refuse)?,
            None => census(scene, columns.clone())?,
        };
        let keeps_outline = match fitted.filter(|fitted| fitted.is_whole) {
            Some(fitted) => {
                let Of::Lattice(body, _) = lay_out(scene, None, wider(&columns, reach(scene, None)?))?.of
                else {
                    unreachable!("it is not fitted");
                };
                let sites = body.sites.into_iter().filter(|site| columns.contains(&site[0]));
                sites.eq(fitted.band.sites(columns.clone()).map_err(refuse)?)
            }
            None => true,
        };
        let sides = sides(scene, fitted, columns)?;
        Ok(Self { counts, extent, sides, keeps_outline })
    }
}

fn wider(columns: &Range<i32>, by: i32) -> Range<i32> {
    columns.start - by..columns.end + by
}

/// Columns to the corners of a particle's cells, and the cells that decide on these.
fn reach(scene: &Scene, fitted: Option<&FittedBand>) -> Result<i32, SceneError> {
    let near = outlay(scene)?.reach().map_err(|error| refuse_body(scene, &error))?;
    let cells = fitted.map_or(0, |fitted| fitted.band.reach()).max(cell_width(&templates(&scene.lattice)));
    Ok(near + 2 * cells)
}

fn outlay(scene: &Scene) -> Result<Outlay<'_>, SceneError> {
    let refused = || scene.refuse("body.shape", "points are no columns", "run it as a whole");
    outlay_if_cut(scene).ok_or_else(refused)
}

fn outlay_if_cut(scene: &Scene) -> Option<Outlay<'_>> {
    match &scene.body {
        BodySource::Cut(cut) => Some(outlay_of(scene, cut)),
        _ => None,
    }
}

fn census(scene: &Scene, columns: Range<i32>) -> Result<Census, SceneError> {
    outlay(scene)?.count(columns).map_err(|error| refuse_body(scene, &error))
}

/// Whether something of a scene is on the boundary of the body's cells, or its outline is taken from that.
fn is_along_outline(scene: &Scene) -> bool {
    let is_by_count = matches!(scene.body, BodySource::Cut(Cut::Count { .. }));
    let of_role = |entry: &RoleEntry| matches!(entry.region, SceneRegion::Outline(_));
    scene.is_fitted
        || scene.loads.iter().any(|load| matches!(load, Load::Outline { .. }))
        || (scene.material.is_some() && is_by_count && scene.roles.iter().any(of_role))
        || followed(scene).any(|(_, changed)| is_along_outline(changed))
}

/// The boundary of the cells whose first corner is in some columns, in their order; nothing where nothing is on it.
fn sides(scene: &Scene, fitted: Option<&FittedBand>, columns: Range<i32>) -> Result<Vec<Side>, SceneError> {
    if !is_along_outline(scene) || columns.is_empty() {
        return Ok(Vec::new());
    }
    let laid_out = lay_out(scene, fitted, wider(&columns, reach(scene, fitted)?))?;
    let (body, cells, numbers) = match laid_out.of {
        Of::Lattice(body, _) => {
            let cells = Cells::of_body(&body);
            (body, cells, None)
        }
        Of::Fitted(Fitted { body, cells }, numbers) => (body, cells, Some(numbers)),
    };
    let begin = |column: i32| laid_out.columns.partition_point(|&other| other < column);
    let own = begin(columns.start)..begin(columns.end);
    let corner = |i: u32| match (body.sites[i as usize], &numbers) {
        ([Body::ALONG_OUTLINE, _], Some(Numbers { along, .. })) => {
            let k = along.partition_point(|of| of[0] < i as usize);
            [Body::ALONG_OUTLINE, along[k][1] as i32, 0]
        }
        ([column, row], _) => [column, (i as usize - begin(column)) as i32, row],
    };
    let (whole, incidence) = (cells.count_whole(), cells.incidence(body.count()));
    let of_cell = |cell: usize| {
        let place = match &numbers {
            Some(Numbers { cut, .. }) if cell >= whole => 1 + cut[cell - whole] as u64,
            _ => 0,
        };
        let sides = cells.boundary_sides_of(cell..cell + 1, &incidence).into_iter();
        sides.map(move |side| (place, side))
    };
    let own = (0..cells.count()).filter(|&cell| own.contains(&(cells.of(cell)[0] as usize)));
    Ok(own.flat_map(of_cell).map(|(place, side)| (place, side.map(corner))).collect())
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
