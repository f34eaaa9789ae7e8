//! VTK for ParaView: `steps/step_000020.vtu` at every recorded step, `steps.pvd` that lists them.
//!
//! An unstructured grid of the present configuration. Where the scene has a material, its cells are those between the
//! particles, as triangles, quadrilaterals or polygons, so that a viewer fills them with colour; a rule that is the
//! material has no others. Under the paper's rules particles, as vertices, and bonds, as lines, come before them. Cell
//! data `broken` (1 or 0; threshold it to see a crack as what is missing) and `stretch` (length over that in the
//! reference configuration, less one \[1\]), both 0 for all but bonds, and with a material `stress` (xx, yy, xy) and
//! `von_mises` \[force / length^2\]: of a cell its own, NaN where a bond across it is broken; of a particle that of the
//! point data; of a bond the mean of its ends.
//!
//! Of a body of which each rank has a part every rank writes its piece, `steps/step_000020_0003.vtu`, and
//! `steps/step_000020.pvtu` lists them. A bond belongs to the piece of the particle that lists it first; its other end, where
//! that is another piece's, is a point there too, with 1 in `vtkGhostType`.
//!
//! Points are in the user's order. Point data: `id`, `role` (0 follower, 1 leader, 2 clamped, 3 frame, 4 ghost),
//! `displacement` \[length\], `pe1` \[length^2\], `pe2` \[length\], `strain` (xx, yy, xy) \[1\] and `rotation` \[rad\] of a
//! particle's surroundings, NaN for one that sees too few, and with a material `stress` and `von_mises` as in
//! `final.csv`: the mean over the particle's cells. Stresses are in the axes of the reference configuration. Arrays are
//! base64 within the XML: a number costs 11 bytes, loses nothing, and the file stays well-formed, which raw appended
//! data would not.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use rayon::prelude::*;

use super::error::{ExportError, write_file};
use super::manifest::{Written, create, create_buffered};
use super::parts::write_each;
use super::{OutputFolder, bonds};
use crate::continuum::mechanics::Stresses;
use crate::continuum::memory::neighbour_entries;
use crate::continuum::plan::Plan;
use crate::engine::Engine;
use crate::flock::body::Body;
use crate::flock::law::Weights;
use crate::flock::role::Role;
use crate::flock::strain::Strain;
use crate::flock::vectors::{Vectors, distance};
use crate::material::cells::Cells;
use crate::material::stress::StressState;
use crate::ranks::Team;

const FOLDER: &str = "steps";
/// The name by which readers of VTK know points that belong to another piece.
const GHOSTS: &str = "vtkGhostType";
const VERTEX: u8 = 1;
const LINE: u8 = 3;
const TRIANGLE: u8 = 5;
const POLYGON: u8 = 7;
const QUADRILATERAL: u8 = 9;

/// Writes frames while a run goes on; none is kept in memory.
#[derive(Debug)]
pub struct VtkSeries {
    files: Arc<Written>,
    /// Steps that have one, and the ranks that wrote it, where these were several.
    frames: Vec<(usize, Option<usize>)>,
    /// Number of them that are known to be on the disk.
    synced: usize,
}

impl VtkSeries {
    /// Makes the folder for the frames.
    pub fn create(folder: &OutputFolder) -> Result<Self, ExportError> {
        let steps = folder.path(FOLDER);
        fs::create_dir_all(&steps).map_err(ExportError::io("create", &steps))?;
        Ok(Self { files: folder.files(), frames: Vec::new(), synced: 0 })
    }

    /// Goes on after the frames of these `steps`, which an earlier run has written below `from`.
    ///
    /// # Errors
    /// A frame that is not there.
    pub fn resume(
        folder: &OutputFolder,
        from: &Path,
        steps: impl IntoIterator<Item = usize>,
    ) -> Result<Self, ExportError> {
        let mut series = Self::create(folder)?;
        for step in steps {
            let pieces = (0..).take_while(|&rank| from.join(FOLDER).join(piece_name(step, rank)).is_file());
            let frame = (step, Some(pieces.count()).filter(|&pieces| pieces > 0));
            for name in names(frame) {
                let (former, path) = (from.join(&name), series.files.path(&name));
                if !former.is_file() {
                    return Err(ExportError::MissingFrame(former));
                }
                if former != path {
                    let copied = fs::read(&former).and_then(|bytes| create(&path)?.write_all(&bytes));
                    copied.map_err(ExportError::io("copy a frame to", &path))?;
                }
            }
            series.frames.push(frame);
        }
        series.remove_others()?;
        Ok(series)
    }

    /// Removes frames that are none of the series: of the step at which an earlier run was interrupted.
    fn remove_others(&self) -> Result<(), ExportError> {
        let kept: HashSet<PathBuf> = self.paths(&self.frames).into_iter().collect();
        let steps = self.files.path(Path::new(FOLDER));
        let listed = fs::read_dir(&steps).map_err(ExportError::io("read", &steps))?;
        for path in
            listed.flatten().map(|entry| entry.path()).filter(|path| is_frame(path) && !kept.contains(path))
        {
            fs::remove_file(&path).map_err(ExportError::io("remove", &path))?;
        }
        Ok(())
    }

    /// The present paths of some frames: a folder may take another name while it is filled.
    fn paths(&self, frames: &[(usize, Option<usize>)]) -> Vec<PathBuf> {
        frames.iter().flat_map(|&frame| names(frame)).map(|name| self.files.path(&name)).collect()
    }

    /// Brings the frames to the disk, so that a checkpoint may count on them.
    pub fn sync(&mut self) -> Result<(), ExportError> {
        for path in self.paths(&self.frames[self.synced..]) {
            File::open(&path).and_then(|file| file.sync_all()).map_err(ExportError::io("write", &path))?;
        }
        self.synced = self.frames.len();
        Ok(())
    }

    /// Writes the engine's present state. Of a body of which each rank has a part all ranks write it together, the others by
    /// [`write_piece`].
    ///
    /// # Errors
    /// A file that cannot be written, by any rank.
    pub fn write(&mut self, engine: &Engine) -> Result<(), ExportError> {
        if let Some(team) = engine.parted() {
            return self.write_pieces(engine, team);
        }
        let path = self.files.path(&Path::new(FOLDER).join(file_name(engine.step())));
        let values = Values::of(engine);
        write_frame(&path, &values).map_err(ExportError::io("write", &path))?;
        self.frames.push((engine.step(), None));
        Ok(())
    }

    fn write_pieces(&mut self, engine: &Engine, team: &Team) -> Result<(), ExportError> {
        let frame = (engine.step(), Some(team.count()));
        let list = &self.paths(&[frame])[0];
        let listed = write_own_piece((list.parent(), team), engine)?;
        write_file(list, list_of_pieces(engine.step(), team.count(), listed))?;
        self.frames.push(frame);
        Ok(())
    }

    /// Writes the list of frames; returns every file of the series, the list first.
    pub fn finish(self) -> Result<Vec<PathBuf>, ExportError> {
        let mut text = String::from(concat!(
            "<?xml version=\"1.0\"?>\n",
            "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n",
            "<Collection>\n"
        ));
        for &(step, ranks) in &self.frames {
            let name = if ranks.is_some() { parted_name } else { file_name };
            text += &format!("<DataSet timestep=\"{step}\" file=\"{FOLDER}/{}\"/>\n", name(step));
        }
        text += "</Collection>\n</VTKFile>\n";
        let collection = self.files.path(Path::new("steps.pvd"));
        write_file(&collection, text)?;
        Ok(std::iter::once(collection).chain(self.paths(&self.frames)).collect())
    }
}

/// Whether a file has a name that a frame, or a piece of one, has.
fn is_frame(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with("step_") && (name.ends_with(".vtu") || name.ends_with(".pvtu"))
}

/// The files of a frame, below the folder of outputs.
fn names((step, ranks): (usize, Option<usize>)) -> Vec<PathBuf> {
    let pieces = (0..ranks.unwrap_or(0)).map(|rank| piece_name(step, rank));
    let first = if ranks.is_some() { parted_name(step) } else { file_name(step) };
    std::iter::once(first).chain(pieces).map(|name| Path::new(FOLDER).join(name)).collect()
}

fn file_name(step: usize) -> String {
    format!("step_{step:06}.vtu")
}

fn parted_name(step: usize) -> String {
    format!("step_{step:06}.pvtu")
}

fn piece_name(step: usize, rank: usize) -> String {
    format!("step_{step:06}_{rank:04}.vtu")
}

/// Writes this rank's piece of a frame, with the stress in a body that has a material, into the folder of the first rank, which has
/// to be there for all of them; to be called by all ranks but the first while that one [writes](VtkSeries::write) the frame.
///
/// # Errors
/// A piece that cannot be written, by any rank.
pub fn write_piece(engine: &Engine, team: &Team) -> Result<(), ExportError> {
    write_own_piece((None, team), engine).map(|_| ())
}

fn write_own_piece((folder, team): (Option<&Path>, &Team), engine: &Engine) -> Result<Listed, ExportError> {
    let name = |rank: usize| piece_name(engine.step(), rank);
    let values = Values::of(engine);
    let write = |path: &Path| write_frame(path, &values).map_err(ExportError::io("write", path));
    write_each(folder, name, team, write)
}

/// What a list of pieces says of the arrays of points and of cells.
type Listed = [String; 2];

/// What all pieces of a frame have in common, and their names.
fn list_of_pieces(step: usize, ranks: usize, [points, cells]: Listed) -> String {
    let pieces = (0..ranks).map(|rank| format!("<Piece Source=\"{}\"/>\n", piece_name(step, rank)));
    let attributes =
        "type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile {attributes}>\n<PUnstructuredGrid GhostLevel=\"0\">\n\
         <PPointData Scalars=\"pe1\" Vectors=\"displacement\">\n{points}</PPointData>\n\
         <PCellData Scalars=\"broken\">\n{cells}</PCellData>\n\
         <PPoints>\n<PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n</PPoints>\n{}\
         </PUnstructuredGrid>\n</VTKFile>\n",
        pieces.collect::<String>()
    )
}

fn write_frame(path: &Path, values: &Values<'_>) -> io::Result<Listed> {
    let mut out = create_buffered(path)?;
    let engine = values.engine;
    let grid = Grid::of(engine);
    let points = grid.points.len();
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    let attributes = "type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\"";
    writeln!(out, "<VTKFile {attributes} header_type=\"UInt64\">")?;
    let roles = Role::ALL.map(|role| format!("{} {}", role.number(), role.name())).join(", ");
    writeln!(out, "<!-- step {}; role: {roles} -->", engine.step())?;
    writeln!(out, "<UnstructuredGrid>")?;
    writeln!(out, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{}\">", grid.count())?;
    let of_points = write_point_data(&mut out, values, &grid.points)?;
    let of_cells = grid.write_data(&mut out, values)?;
    writeln!(out, "<Points>")?;
    let places = grid.points.clone().map(|row| engine.present().get(engine.body().in_row(row)));
    Arrays::new(&mut out, points).threes("Points", "", places.map(|[x, y]| [x, y, 0.0]))?;
    writeln!(out, "</Points>")?;
    grid.write(&mut out, engine.body())?;
    writeln!(out, "</Piece>\n</UnstructuredGrid>\n</VTKFile>")?;
    out.flush()?;
    Ok([of_points, of_cells])
}

/// Numbers of particles that are found from those around them: what stands around those of other parts the others know.
struct Values<'a> {
    engine: &'a Engine,
    stresses: Option<Stresses>,
    energies_of_others: HashMap<usize, [f64; 2]>,
    strains_of_others: HashMap<usize, [f64; 4]>,
    stresses_of_others: HashMap<usize, [f64; 4]>,
}

impl<'a> Values<'a> {
    /// At the engine's present places; of a body in parts found by all ranks together.
    fn of(engine: &'a Engine) -> Self {
        let own = Self {
            engine,
            stresses: Stresses::at_present(engine),
            energies_of_others: HashMap::new(),
            strains_of_others: HashMap::new(),
            stresses_of_others: HashMap::new(),
        };
        Self {
            energies_of_others: engine.of_others(|i| own.energies(i)),
            strains_of_others: engine.of_others(|i| own.strain(i)),
            stresses_of_others: engine.of_others(|i| own.stress(i)),
            ..own
        }
    }

    /// PE1 \[length^2\] and PE2 \[length\].
    fn energies(&self, particle: usize) -> [f64; 2] {
        let known = self.energies_of_others.get(&particle).copied();
        known.unwrap_or_else(|| [self.engine.pe1(particle), self.engine.pe2(particle)])
    }

    /// Components and rotation, NaN for a particle that sees too few \[1, rad\].
    fn strain(&self, particle: usize) -> [f64; 4] {
        let own = || {
            self.engine.strain(particle).map_or([f64::NAN; 4], |Strain { components, rotation, .. }| {
                let [xx, yy, xy] = components;
                [xx, yy, xy, rotation]
            })
        };
        self.strains_of_others.get(&particle).copied().unwrap_or_else(own)
    }

    /// Components and von Mises stress, NaN for a particle in no whole cell \[force / length^2\].
    fn stress(&self, particle: usize) -> [f64; 4] {
        let own = || self.stresses.as_ref().and_then(|stresses| stresses.particles[particle]);
        let known = self.stresses_of_others.get(&particle).copied();
        known.unwrap_or_else(|| own().map_or([f64::NAN; 4], |stress| with_von_mises(&stress)))
    }
}

fn write_point_data(out: &mut impl Write, values: &Values<'_>, rows: &Range<usize>) -> io::Result<String> {
    let engine = values.engine;
    let (count, body) = (rows.len(), engine.body());
    let rows = || rows.clone().map(|row| body.in_row(row));
    writeln!(out, "<PointData Scalars=\"pe1\" Vectors=\"displacement\">")?;
    let mut arrays = Arrays::new(out, count);
    if body.part.is_some() {
        // Points of other parts, at the ends of bonds that lead there.
        arrays.bytes(GHOSTS, rows().map(|i| u8::from(!body.owned().contains(&i))))?;
    }
    arrays.integers("id", rows().map(|i| body.id(i) as i64))?;
    arrays.bytes("role", rows().map(|i| engine.roles()[i].number()))?;
    let moved = rows().map(|i| (engine.present().get(i), body.reference.get(i)));
    let displacement = moved.map(|(now, initial)| [now[0] - initial[0], now[1] - initial[1], 0.0]);
    arrays.threes("displacement", "", displacement)?;
    arrays.floats("pe1", rows().map(|i| values.energies(i)[0]))?;
    arrays.floats("pe2", rows().map(|i| values.energies(i)[1]))?;
    let particles: Vec<usize> = rows().collect();
    let strains: Vec<[f64; 4]> = particles.into_par_iter().map(|i| values.strain(i)).collect();
    arrays.threes("strain", PLANE, strains.iter().map(|&[xx, yy, xy, _]| [xx, yy, xy]))?;
    arrays.floats("rotation", strains.iter().map(|strain| strain[3]))?;
    if values.stresses.is_some() {
        arrays.stresses(rows().map(|i| values.stress(i)))?;
    }
    writeln!(arrays.out, "</PointData>")?;
    Ok(arrays.listed)
}

fn with_von_mises(stress: &StressState) -> [f64; 4] {
    let [xx, yy, xy] = stress.components;
    [xx, yy, xy, stress.von_mises]
}

/// Bytes of a frame of a plan while it is written, beside what is measured for it.
pub(super) fn bytes(plan: &Plan) -> usize {
    let cells = plan.setup.cells.as_ref().map_or(0, Cells::count);
    let is_material = matches!(plan.setup.flock.weights, Weights::Matrix(_));
    let bonds = if is_material { 0 } else { neighbour_entries(plan) / 2 };
    let of_points = (size_of::<usize>() + size_of::<[f64; 4]>()) * plan.count();
    size_of::<(usize, [u32; 2])>() * bonds
        + size_of::<&[u32]>() * cells
        + of_points.max(size_of::<[f64; 4]>() * cells)
}

/// The points and the cells of the file, in their order.
struct Grid<'a> {
    /// The rows of the particles that are points: of a part those of others too that bonds of its own lead to.
    points: Range<usize>,
    /// The rows of those that are vertices: all of the body or of the part, or none.
    vertices: Range<usize>,
    /// Bonds, with their places in the neighbours' index list.
    bonds: Vec<(usize, [u32; 2])>,
    /// Of a part those that are its own.
    polygons: Vec<&'a [u32]>,
}

impl<'a> Grid<'a> {
    fn of(engine: &'a Engine) -> Self {
        let (flock, owned) = (engine.flock(), engine.body().owned());
        let of_cells = |cells: &'a Cells| engine.owned_cells().map(|cell| cells.of(cell));
        let polygons: Vec<&[u32]> = engine.cells().into_iter().flat_map(of_cells).collect();
        // Those of a material lie over one another, and none breaks.
        let is_material = matches!(flock.weights, Weights::Matrix(_));
        let is_own = |(_, [j, _]): &(usize, [u32; 2])| !is_material && owned.contains(&(*j as usize));
        let bonds: Vec<_> = bonds::listed_once(&flock.neighbours).filter(is_own).collect();
        let corners = polygons.iter().copied().flatten();
        let ends = bonds.iter().flat_map(|(_, pair)| pair).chain(corners).map(|&end| end as usize);
        let (low, high) = (ends.clone().min().unwrap_or(owned.start), ends.max().map_or(0, |high| high + 1));
        let points = low.min(owned.start)..high.max(owned.end);
        Self { points, vertices: if is_material { 0..0 } else { owned }, bonds, polygons }
    }

    fn polygons(&self) -> impl Iterator<Item = &'a [u32]> + Clone + '_ {
        self.polygons.iter().copied()
    }

    fn count(&self) -> usize {
        self.vertices.len() + self.bonds.len() + self.polygons.len()
    }

    fn write_data(&self, out: &mut impl Write, values: &Values<'_>) -> io::Result<String> {
        let Values { engine, stresses, .. } = values;
        let bonds = engine.flock().bonds.as_ref();
        let is_broken = |&(bond, _): &(usize, _)| bonds.is_some_and(|bonds| bonds.is_broken(bond));
        let length = |of: &Vectors, [a, b]: [u32; 2]| distance(of.get(a as usize), of.get(b as usize));
        let stretch = |&(_, pair): &(usize, [u32; 2])| {
            length(engine.present(), pair) / length(&engine.body().reference, pair) - 1.0
        };
        let polygons = self.polygons.len();
        let scalars = if self.bonds.is_empty() && stresses.is_some() { "von_mises" } else { "broken" };
        writeln!(out, "<CellData Scalars=\"{scalars}\">")?;
        let mut arrays = Arrays::new(out, self.count());
        let broken = self.bonds.iter().map(|bond| u8::from(is_broken(bond)));
        let vertices = self.vertices.len();
        let (before, after) = (std::iter::repeat_n(0, vertices), std::iter::repeat_n(0, polygons));
        arrays.bytes("broken", before.chain(broken).chain(after))?;
        let (before, after) = (std::iter::repeat_n(0.0, vertices), std::iter::repeat_n(0.0, polygons));
        arrays.floats("stretch", before.chain(self.bonds.iter().map(stretch)).chain(after))?;
        if let Some(stresses) = stresses {
            let rows = self.vertices.clone().map(|row| engine.body().in_row(row));
            let particles = rows.map(|i| values.stress(i));
            let between = |&(_, pair): &(usize, [u32; 2])| {
                let [a, b] = pair.map(|end| values.stress(end as usize));
                std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
            };
            let own: Vec<_> =
                engine.owned_cells().map(|cell| with_von_mises(&stresses.cells[cell])).collect();
            let own = own.into_iter();
            arrays.stresses(particles.chain(self.bonds.iter().map(between)).chain(own))?;
        }
        writeln!(arrays.out, "</CellData>")?;
        Ok(arrays.listed)
    }

    fn write(&self, out: &mut impl Write, body: &Body) -> io::Result<()> {
        let mut row_of = vec![0; body.count()];
        body.rows().zip(0..).for_each(|(particle, row)| row_of[particle] = row);
        let first = self.points.start as i64;
        let row = |&particle: &u32| row_of[particle as usize] - first;
        let bonds = || self.bonds.iter().flat_map(|(_, pair)| pair);
        let corners = self.polygons().map(<[u32]>::len).sum::<usize>();
        writeln!(out, "<Cells>")?;
        let vertices = self.vertices.len();
        let own = self.vertices.clone().map(|row| row as i64 - first);
        let connected = own.chain(bonds().map(row)).chain(self.polygons().flatten().map(row));
        Arrays::new(&mut *out, vertices + 2 * self.bonds.len() + corners)
            .integers("connectivity", connected)?;
        let sizes = std::iter::repeat_n(1, vertices)
            .chain(std::iter::repeat_n(2, self.bonds.len()))
            .chain(self.polygons().map(<[u32]>::len));
        let ends = sizes.scan(0, |end, size| {
            *end += size as i64;
            Some(*end)
        });
        let mut arrays = Arrays::new(&mut *out, self.count());
        arrays.integers("offsets", ends)?;
        let kind = |cell: &[u32]| match cell.len() {
            3 => TRIANGLE,
            4 => QUADRILATERAL,
            _ => POLYGON,
        };
        let types = std::iter::repeat_n(VERTEX, vertices)
            .chain(std::iter::repeat_n(LINE, self.bonds.len()))
            .chain(self.polygons().map(kind));
        arrays.bytes("types", types)?;
        writeln!(out, "</Cells>")
    }
}

/// What names the components of a symmetric tensor in the plane.
const PLANE: &str = " ComponentName0=\"xx\" ComponentName1=\"yy\" ComponentName2=\"xy\"";

/// Arrays with a value, or three, for each of so many points or cells.
struct Arrays<'a, W> {
    out: &'a mut W,
    count: usize,
    /// What a list of pieces says of those that have been written.
    listed: String,
}

impl<'a, W: Write> Arrays<'a, W> {
    fn new(out: &'a mut W, count: usize) -> Self {
        Self { out, count, listed: String::new() }
    }

    fn bytes(&mut self, name: &str, values: impl Iterator<Item = u8>) -> io::Result<()> {
        self.array(&format!("type=\"UInt8\" Name=\"{name}\""), self.count, values.map(u8::to_le_bytes))
    }

    fn integers(&mut self, name: &str, values: impl Iterator<Item = i64>) -> io::Result<()> {
        self.array(&format!("type=\"Int64\" Name=\"{name}\""), self.count, values.map(i64::to_le_bytes))
    }

    fn floats(&mut self, name: &str, values: impl Iterator<Item = f64>) -> io::Result<()> {
        self.array(&format!("type=\"Float64\" Name=\"{name}\""), self.count, values.map(f64::to_le_bytes))
    }

    /// Vectors, or with [`PLANE`] tensors.
    fn threes(&mut self, name: &str, more: &str, values: impl Iterator<Item = [f64; 3]>) -> io::Result<()> {
        let attributes = format!("type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"3\"{more}");
        self.array(&attributes, 3 * self.count, values.flatten().map(f64::to_le_bytes))
    }

    /// Components and von Mises stress.
    fn stresses(&mut self, stresses: impl Iterator<Item = [f64; 4]> + Clone) -> io::Result<()> {
        self.threes("stress", PLANE, stresses.clone().map(|[xx, yy, xy, _]| [xx, yy, xy]))?;
        self.floats("von_mises", stresses.map(|stress| stress[3]))
    }

    /// One array of `count` values of `SIZE` bytes, after the length that the format asks for.
    fn array<const SIZE: usize>(
        &mut self,
        attributes: &str,
        count: usize,
        values: impl Iterator<Item = [u8; SIZE]>,
    ) -> io::Result<()> {
        self.listed += &format!("<PDataArray {attributes}/>\n");
        write!(self.out, "<DataArray {attributes} format=\"binary\">")?;
        let mut encoder = EncoderWriter::new(&mut *self.out, &STANDARD);
        encoder.write_all(&((count * SIZE) as u64).to_le_bytes())?;
        for value in values {
            encoder.write_all(&value)?;
        }
        encoder.finish()?;
        drop(encoder);
        writeln!(self.out, "</DataArray>")
    }
}
