//! Tables: `final.csv`, every particle at the end; `probes.csv`, a few of them at every step;
//! `breaks.csv`, every broken bond; `residuals.csv`, how a solver came to rest.
//!
//! Ids count from 1, columns and rows from the lowest site, frame included, which is the paper's
//! numbering; a body given as points has its own ids and order, and no columns; nor have particles along an outline. Stresses (`stress_xx`,
//! `stress_yy`, `stress_xy`) are along x and y under small rotations; of a corotated rule in axes that turn with the
//! material, which were along x and y in the reference configuration. `rotation` is in radians.
//! Numbers are the shortest that read back as the same.

use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;
use std::path::PathBuf;

use csv::{Writer, WriterBuilder};
use rayon::prelude::*;
use serde::Serialize;

use super::OutputFolder;
use super::error::ExportError;
use super::manifest::{create, create_buffered};
use crate::continuum::record::ProbeSeries;
use crate::engine::Engine;
use crate::flock::body::Body;
use crate::flock::fracture::Break;
use crate::material::stress::StressState;
use crate::ranks::Team;

/// A row of a table: its columns by name, each with its value or that of the variable of this name.
macro_rules! row {
    ($($column:ident $(: $value:expr)?),* $(,)?) => {{
        #[allow(non_camel_case_types, non_snake_case, reason = "a column gives the type of its values its name")]
        let row = {
            #[derive(::serde::Serialize)]
            struct Row<$($column),*> {
                $($column: $column),*
            }
            Row { $($column $(: $value)?),* }
        };
        row
    }};
}
pub(super) use row;

#[derive(Serialize)]
struct FinalRow {
    id: usize,
    column: Option<i64>,
    row: Option<i64>,
    role: &'static str,
    #[serde(rename = "X")]
    reference_x: f64,
    #[serde(rename = "Y")]
    reference_y: f64,
    x: f64,
    y: f64,
    pe1: f64,
    pe2: f64,
    strain_xx: Option<f64>,
    strain_yy: Option<f64>,
    strain_xy: Option<f64>,
    rotation: Option<f64>,
    /// Absent without a material, empty for a particle in no cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    stress_xx: Option<Option<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stress_yy: Option<Option<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stress_xy: Option<Option<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    von_mises: Option<Option<f64>>,
}

/// Writes every particle at the end: reference and present place \[length\], PE1 \[length^2\], PE2 \[length\], the
/// strain \[1\] and the rotation \[rad\] of its surroundings, empty where it sees too few. Where the scene has a material,
/// `stresses` follow \[force / length^2\]: the mean over the particle's cells, each weighted by its area, and the von
/// Mises stress of that mean. Such a mean lies below a peak at a free edge or a notch.
///
/// Where each rank has a part of the body all ranks write it together, into the `folder` of the first one, which receives the
/// rows of the others in pieces; it alone can fail.
pub(super) fn write_final(
    folder: Option<&OutputFolder>,
    engine: &Engine,
    stresses: Option<&[Option<StressState>]>,
) -> Result<Option<PathBuf>, ExportError> {
    let (body, team) = (engine.body(), engine.parted());
    let rows = FinalRows::new(engine, stresses);
    // Those along an outline come after all others, in their own order.
    let last = body.owned().filter(|&i| body.index_after_all(i).is_some()).count();
    let all = body.owned().len();
    let (before, last) = (pieces(0..all - last), all - last..all);
    // The first rank may have no particle, and a row is what the names of the columns are known from.
    let own = rows.header().unwrap_or_default();
    let mut headers = team.map_or_else(|| vec![own.clone()], |team| team.each_bytes(&own)).into_iter();
    let header = headers.find(|header| !header.is_empty()).unwrap_or_default();
    let Some(folder) = folder else {
        let Some(team) = team else { return Ok(None) };
        team.bring(before.into_iter().map(|piece| rows.text(piece).unwrap_or_default()), |_| ());
        let _ = sorted(team, &rows, last);
        return Ok(None);
    };
    let path = folder.path("final.csv");
    let mut file = create_buffered(&path).and_then(|mut file| {
        file.write_all(&header).and_then(|()| rows.write(before, &mut file)).map(|()| file)
    });
    // What the others send is received in any case: they wait until it is.
    let mut append = |piece: &[u8]| {
        if let Ok(to) = &mut file
            && let Err(error) = to.write_all(piece)
        {
            file = Err(error);
        }
    };
    if let Some(team) = team {
        team.bring([], &mut append);
        append(&sorted(team, &rows, last));
    }
    file.and_then(|mut file| file.flush()).map_err(ExportError::io("write", &path))?;
    Ok(Some(path))
}

/// Rows that a thread makes text of, or a rank sends, at once: few, for all threads have theirs in memory.
const ROWS_OF_A_PIECE: usize = 1 << 10;

fn pieces(rows: Range<usize>) -> Vec<Range<usize>> {
    let from = rows.clone().step_by(ROWS_OF_A_PIECE);
    from.map(|start| start..rows.end.min(start + ROWS_OF_A_PIECE)).collect()
}

/// These rows of all ranks, in the order of their ids.
fn sorted(team: &Team, rows: &FinalRows<'_>, own: Range<usize>) -> Vec<u8> {
    let all = team.each_bytes(&rows.text(own).unwrap_or_default()).concat();
    let mut lines: Vec<&[u8]> = all.split_inclusive(|&byte| byte == b'\n').collect();
    let digits = |line: &&[u8]| line.iter().take_while(|byte| byte.is_ascii_digit()).count();
    // Without zeros before them, the shorter number is the smaller one.
    lines.sort_by_key(|line| (digits(line), *line));
    lines.concat()
}

fn write_rows(mut writer: Writer<impl Write>, rows: impl Iterator<Item = impl Serialize>) -> io::Result<()> {
    for row in rows {
        writer.serialize(row).map_err(io::Error::from)?;
    }
    writer.flush()
}

/// A row for each particle of the body; of a part, for each of its own.
struct FinalRows<'a> {
    engine: &'a Engine,
    stresses: Option<&'a [Option<StressState>]>,
    first_column: i64,
    first_row: i64,
    /// Of a part: its particles in the order of the whole body.
    order: Option<Vec<usize>>,
}

impl<'a> FinalRows<'a> {
    fn new(engine: &'a Engine, stresses: Option<&'a [Option<StressState>]>) -> Self {
        let body = engine.body();
        let at_sites = (0..body.count()).filter(|&i| is_of_lattice(body, i)).map(|i| body.sites[i]);
        let lowest = |axis: usize| at_sites.clone().map(|site| site[axis]).min().unwrap_or(0);
        let lowest = body.part.as_ref().map_or_else(|| [lowest(0), lowest(1)], |part| part.whole.lowest);
        let [first_column, first_row] = lowest.map(i64::from);
        let order = body.part.as_ref().map(|_| body.owned_in_order());
        Self { engine, stresses, first_column, first_row, order }
    }

    /// Writes pieces of them, of which as many are made at once as there are threads.
    fn write(&self, pieces: Vec<Range<usize>>, to: &mut impl Write) -> io::Result<()> {
        for some in pieces.chunks(rayon::current_num_threads().max(1)) {
            let texts: Vec<_> = some.par_iter().map(|rows| self.text(rows.clone())).collect();
            texts.into_iter().try_for_each(|text| to.write_all(&text?))?;
        }
        Ok(())
    }

    /// The line above them; nothing without a row.
    fn header(&self) -> io::Result<Vec<u8>> {
        let first = 0..self.engine.body().owned().len().min(1);
        let mut text = self.csv(first, true)?;
        text.truncate(text.iter().position(|&byte| byte == b'\n').map_or(0, |end| end + 1));
        Ok(text)
    }

    fn text(&self, rows: Range<usize>) -> io::Result<Vec<u8>> {
        self.csv(rows, false)
    }

    fn csv(&self, rows: Range<usize>, has_headers: bool) -> io::Result<Vec<u8>> {
        let mut text = Vec::new();
        let writer = WriterBuilder::new().has_headers(has_headers).from_writer(&mut text);
        write_rows(writer, rows.map(|n| self.row(n)))?;
        Ok(text)
    }

    /// Energies and strains are found as they are written: all of them at once would take as much memory as the body.
    fn row(&self, n: usize) -> FinalRow {
        let Self { engine, stresses, first_column, first_row, ref order } = *self;
        let body = engine.body();
        let i = order.as_ref().map_or_else(|| body.in_row(n), |order| order[n]);
        let (strain, is_of_lattice) = (engine.strain(i), is_of_lattice(body, i));
        let stress = |k: usize| stresses.map(|all| all[i].map(|stress| stress.components[k]));
        FinalRow {
            id: body.id(i),
            column: is_of_lattice.then(|| i64::from(body.sites[i][0]) - first_column + 1),
            row: is_of_lattice.then(|| i64::from(body.sites[i][1]) - first_row + 1),
            role: engine.roles()[i].name(),
            reference_x: body.reference.x[i],
            reference_y: body.reference.y[i],
            x: engine.present().x[i],
            y: engine.present().y[i],
            pe1: engine.pe1(i),
            pe2: engine.pe2(i),
            strain_xx: strain.map(|strain| strain.components[0]),
            strain_yy: strain.map(|strain| strain.components[1]),
            strain_xy: strain.map(|strain| strain.components[2]),
            rotation: strain.map(|strain| strain.rotation),
            stress_xx: stress(0),
            stress_yy: stress(1),
            stress_xy: stress(2),
            von_mises: stresses.map(|all| all[i].map(|stress| stress.von_mises)),
        }
    }
}

/// Whether a particle stands at a site, which has a column and a row.
fn is_of_lattice(body: &Body, i: usize) -> bool {
    body.numbering.is_none() && body.sites[i][0] != Body::ALONG_OUTLINE
}

/// Writes every broken bond in the order they broke: its step (0 for those cut before the first), its
/// two particles, its middle in the reference configuration \[length\] and along the body \[1\], and the
/// length at which it broke \[length\].
pub(crate) fn write_breaks(
    folder: &OutputFolder,
    body: &Body,
    breaks: &[Break],
) -> Result<PathBuf, ExportError> {
    let along = body.along();
    let rows = breaks.iter().map(|one| {
        let [id_a, id_b] = body.ids(one.pair);
        let ([x, y], along) = (one.place, along(one.place));
        row! { step: one.step, id_a, id_b, X: x, Y: y, along, length: one.length }
    });
    write(folder, "breaks.csv", rows)
}

/// Writes the residual before the first iteration of a solver and after each.
pub(crate) fn write_residuals(folder: &OutputFolder, residuals: &[f64]) -> Result<PathBuf, ExportError> {
    let row = |(iteration, &residual): (usize, &f64)| row! { iteration, residual };
    write(folder, "residuals.csv", residuals.iter().enumerate().map(row))
}

/// Writes the probed particles step by step.
pub fn write_probes(
    folder: &OutputFolder,
    body: &Body,
    probes: &[ProbeSeries],
) -> Result<PathBuf, ExportError> {
    let steps = probes.iter().map(|probe| probe.positions.len()).max().unwrap_or(0);
    let rows = (0..steps).flat_map(|step| {
        probes.iter().filter(move |probe| step < probe.positions.len()).map(move |probe| {
            let [x, y] = probe.positions.get(step);
            let id = body.id_of(probe.particle);
            row! { step, id, x, y, pe1: probe.pe1[step], pe2: probe.pe2[step] }
        })
    });
    write(folder, "probes.csv", rows)
}

pub(super) fn write(
    folder: &OutputFolder,
    name: &str,
    rows: impl Iterator<Item = impl Serialize>,
) -> Result<PathBuf, ExportError> {
    write_with(folder, name, |file| write_rows(Writer::from_writer(file), rows))
}

/// Writes a table whose columns are known only now, under this line of their names.
pub(super) fn write_below(
    head: &[impl AsRef<[u8]>],
    folder: &OutputFolder,
    name: &str,
    rows: impl Iterator<Item = impl Serialize>,
) -> Result<PathBuf, ExportError> {
    write_with(folder, name, |file| {
        let mut writer = WriterBuilder::new().has_headers(false).from_writer(file);
        writer.write_record(head).map_err(io::Error::from)?;
        write_rows(writer, rows)
    })
}

fn write_with(
    folder: &OutputFolder,
    name: &str,
    write: impl FnOnce(File) -> io::Result<()>,
) -> Result<PathBuf, ExportError> {
    let path = folder.path(name);
    create(&path).and_then(write).map_err(ExportError::io("write", &path))?;
    Ok(path)
}
