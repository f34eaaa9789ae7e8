//! The report as a person reads it.

use std::fmt;

use super::{Effect, Gradient, GradientLength, Material, MaterialReport, Request, Waves, Weight};

/// Width of the names of a table.
const NAMES: usize = 26;

impl fmt::Display for MaterialReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts: Vec<usize> = (0..self.diagonal.len())
            .map(|s| self.weights.iter().filter(|weight| weight.sublattice == s).count())
            .collect();
        // Both sublattices of a honeycomb see as many neighbours.
        let neighbours = counts.first().copied().unwrap_or_default();
        let (lattice, spacing) = (self.lattice.kind, self.lattice.spacing);
        writeln!(
            f,
            "{lattice} lattice, nearest sites {} apart, {neighbours} neighbours: {}",
            lengths([spacing], 6)[0],
            self.rule
        )?;
        if let Some(asked) = &self.asked {
            row(f, "asked for", asked)?;
        }
        if self.asked.is_some() || !self.is_scalar() {
            self.blocks(f)?;
        } else {
            self.scalars(f)?;
        }
        self.material.table(f)?;
        self.gradient.table(f)?;
        self.waves.table(f)?;
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))
    }
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, value: impl fmt::Display) -> fmt::Result {
    writeln!(f, "  {name:NAMES$}  {value}")
}

impl MaterialReport {
    fn blocks(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "weights W = D^-1 K of each neighbour (columns, rows; vector; direction), which sum to the identity"
        )?;
        for (s, d) in self.diagonal.iter().enumerate() {
            if self.diagonal.len() > 1 {
                writeln!(f, "  sublattice {s}")?;
            }
            for weight in self.weights.iter().filter(|weight| weight.sublattice == s) {
                place(f, weight)?;
                let [[a, b], [c, d]] = weight.weight.map(|row| row.map(settled));
                writeln!(f, "  [{a:13.9} {b:13.9}; {c:13.9} {d:13.9}]")?;
            }
            let [[a, b], [_, d]] = *d;
            let b = if b.abs() < 1e-14 * a { 0.0 } else { b };
            row(f, "D = sum of K", format_args!("[{a:.6e} {b:.6e}; {b:.6e} {d:.6e}]"))?;
        }
        Ok(())
    }

    fn scalars(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "weights of each neighbour (columns, rows; vector; direction), which sum to 1")?;
        for weight in &self.weights {
            place(f, weight)?;
            writeln!(f, "  {:12.9}", weight.weight[0][0])?;
        }
        Ok(())
    }
}

/// A number without the minus of a zero that is rounding.
fn settled(value: f64) -> f64 {
    if value.abs() < 1e-14 { 0.0 } else { value }
}

/// Components of a vector, to so many digits behind the point, or in powers of ten where that is shorter.
fn lengths<const N: usize>(vector: [f64; N], digits: usize) -> [String; N] {
    let size = vector.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let is_plain = size == 0.0 || (1e-2..1e5).contains(&size);
    // What is left of a cancellation is no length.
    vector.map(|x| if x.abs() < 1e-14 * size { 0.0 } else { x }).map(|x| match is_plain {
        true => format!("{x:.digits$}"),
        false => format!("{x:.digits$e}"),
    })
}

fn place(f: &mut fmt::Formatter<'_>, weight: &Weight) -> fmt::Result {
    let ([i, j], [x, y]) = (weight.offset, lengths(weight.vector, 5));
    let width = if x.contains('e') { 12 } else { 9 };
    write!(f, "  {i:3} {j:3}   [{x:>width$} {y:>width$}]  {:7.2} deg", settled(weight.direction))
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Request::Isotropic { young, poisson, plane, thickness } => {
                write!(f, "E = {young}, nu = {poisson}, plane {plane}, thickness {thickness}")
            }
            Request::Orthotropic { young: [along, across], poisson_12, shear, fibres, thickness } => write!(
                f,
                "E1 = {along}, E2 = {across}, nu12 = {poisson_12}, G = {shear}, fibres at {fibres:.4} deg, thickness {thickness}"
            ),
        }
    }
}

impl Material {
    fn table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = if self.up_to_scale {
            "in units of the shear modulus: the rule has no force"
        } else {
            "force / length, whole thickness"
        };
        writeln!(f, "material of long waves")?;
        let largest = self.stiffness.iter().flatten().fold(0f64, |most, c| most.max(c.abs()));
        for (k, stiffness) in self.stiffness.iter().enumerate() {
            // Relative to the largest, for what is left of a cancellation.
            let [a, b, c] = stiffness.map(|c| if c.abs() < 1e-14 * largest { 0.0 } else { c });
            let name = if k == 0 { "stiffness (xx, yy, xy)" } else { "" };
            let unit = if k == 0 { format!("   {unit}") } else { String::new() };
            row(f, name, format_args!("[{} {} {}]{unit}", number(a), number(b), number(c)))?;
        }
        if self.isotropic {
            row(f, "isotropic", "yes")?;
        } else if self.misfit < super::ROUNDING {
            let words = "nu and E below are those of the nearest isotropic material";
            row(f, "isotropic", format_args!("no, {:.3} % away; {words}", 100.0 * self.anisotropy))?;
        } else {
            let words = "the acoustic tensor is that of no symmetric stress; what stands here is the nearest";
            row(f, "isotropic", format_args!("no, {:.3} % away", 100.0 * self.anisotropy))?;
            row(f, "misfit", format_args!("{:.3} %: {words}", 100.0 * self.misfit))?;
        }
        self.constants(f)
    }

    fn constants(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scale = if self.up_to_scale { " (in units of the shear modulus)" } else { "" };
        row(f, "nu in plane stress", format_args!("{:.9}", settled(self.poisson_plane_stress)))?;
        match self.poisson_plane_strain {
            Some(poisson) => row(f, "nu in plane strain", format_args!("{:.9}", settled(poisson)))?,
            None => row(f, "nu in plane strain", "none: no solid has these constants in plane strain")?,
        }
        let young =
            if self.young_plane_stress.abs() < 1e-9 * self.mu.abs() { 0.0 } else { self.young_plane_stress };
        row(f, "E in plane stress", format_args!("{}{scale}", number(young).trim_start()))?;
        match self.young_plane_strain {
            Some(young) => {
                row(f, "E in plane strain", format_args!("{}{scale}", number(young).trim_start()))?
            }
            None => row(f, "E in plane strain", "none")?,
        }
        match &self.engineering {
            Some(found) if !self.isotropic => {
                let [along, across] = found.young.map(number);
                let (along, across, shear) = (along.trim_start(), across.trim_start(), number(found.shear));
                let words = format!(
                    "E1 = {along}, E2 = {across}, nu12 = {:.9}, G = {}",
                    found.poisson_12,
                    shear.trim_start()
                );
                row(f, &format!("along {:.4} deg", found.angle), words)
            }
            Some(_) => Ok(()),
            None => row(f, "engineering constants", "none: some strain costs nothing or less"),
        }
    }
}

/// Ten significant digits, in powers of ten where that is shorter.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e5).contains(&size) {
        format!("{value:14.9}")
    } else {
        format!("{value:14.8e}")
    }
}

impl Gradient {
    fn table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "gradient length squared l^2 (length^2)")?;
        let squared = |value: f64| number(value).trim_start().to_owned();
        let words = match self.effect {
            Effect::Stiffens => "positive: stiffens short waves, a second gradient",
            Effect::Softens => "negative: softens short waves, not a second gradient",
            Effect::Mixed => "its sign depends on the direction: no second gradient",
        };
        let GradientLength { longitudinal_x, transverse_x, least, greatest } = self.length;
        let [along, across] = [longitudinal_x, transverse_x].map(squared);
        row(f, "waves along x", format_args!("{along} along, {across} across"))?;
        let ends = [least, greatest].map(squared);
        row(f, "over all directions", format_args!("{} to {}; {words}", ends[0], ends[1]))
    }
}

impl Waves {
    fn table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "all waves")?;
        let ([x, y], [length]) = (lengths(self.worst, 4), lengths([self.worst_length], 4));
        let wave = format!("wave vector [{x} {y}], wavelength {length}");
        if self.stable {
            row(f, "stable", "yes: every wave costs energy")?;
            row(f, "cheapest wave", format_args!("{wave}: {:.4} of what springs would cost", self.least))?;
        } else {
            row(f, "stable", "NO: some wave costs nothing or gives energy; no update makes it die out")?;
            row(f, "worst wave", format_args!("{wave}: {:.4} of what springs would cost", self.least))?;
        }
        if let Some(limit) = self.damping_limit {
            let words = if limit < 1.0 - 1e-9 {
                "an undamped one diverges"
            } else {
                "an undamped one is at worst marginal"
            };
            row(
                f,
                "synchronous update",
                format_args!(
                    "inside a body damp below {limit:.6} (largest eigenvalue {:.6}): {words}",
                    self.largest
                ),
            )?;
        }
        Ok(())
    }
}
