//! `flockform material`: what material a rule is, and the weights of a material.

mod neighbours;

use clap::{Args, ValueEnum};
use flockform::continuum::bulk_response;
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::material::elastic::{Constants, Elastic, ElasticError, Plane};
use flockform::material::gradient::{GradientWeights, layer_note};
use flockform::material::homogenise::Crystal;
use flockform::material::report::MaterialReport;

use super::Refusal;
use super::names::{FileName, Overrides, SceneArguments};

/// Options that say what a scene says. The changes to a scene conflict with them too: clap waives a requirement that
/// what is given conflicts with.
#[rustfmt::skip]
const WITHOUT_SCENE: [&str; 14] = [
    "lattice", "spacing", "a", "b", "angle", "orientation", "neighbours", "weights", "young", "poisson",
    "shear", "fiber_angle", "plane", "thickness",
];

/// A question: a scene's rule, a rule given by its lattice and weights, or a material given by its
/// constants.
#[derive(Debug, Args)]
#[command(mut_arg("set", |set| set.requires("scene").conflicts_with_all(WITHOUT_SCENE)))]
pub struct MaterialArguments {
    /// Name of a bundled scene or path of a scene file whose rule to examine
    #[arg(
        value_parser = FileName::SCENE,
        hide_possible_values = true,
        conflicts_with_all = WITHOUT_SCENE
    )]
    scene: Option<String>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    lattice: LatticeArguments,
    /// Neighbours of a particle: first, first:3, chebyshev:1, second, collinear, within:1.5, or offsets in columns
    /// and rows, offsets:1,0;-1,0 [default: first]
    #[arg(long, value_name = "KIND", requires = "lattice", conflicts_with = "young")]
    neighbours: Option<String>,
    /// A weight for each neighbour in the neighbourhood's order, 4,4,1,1; or distance:POWER; or
    /// gradient:LENGTH, a second gradient [default: equal weights, Eq. 1]
    #[arg(
        long,
        value_name = "WEIGHTS",
        requires = "lattice",
        conflicts_with = "young",
        allow_hyphen_values = true
    )]
    weights: Option<String>,
    #[command(flatten)]
    constants: ConstantArguments,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Lattice")]
struct LatticeArguments {
    /// The lattice
    #[arg(long, value_name = "KIND")]
    lattice: Option<KindName>,
    /// Distance between neighbours: square, hexagonal, honeycomb [default: 1]
    #[arg(long, requires = "lattice", allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// First edge of the cell: rectangular, centred-rectangular, oblique
    #[arg(long, requires = "lattice", allow_negative_numbers = true)]
    a: Option<f64>,
    /// Second edge of the cell
    #[arg(long, requires = "lattice", allow_negative_numbers = true)]
    b: Option<f64>,
    /// Angle between the edges in degrees: oblique
    #[arg(long, requires = "lattice", allow_negative_numbers = true)]
    angle: Option<f64>,
    /// Angle of the lattice from the axes, in degrees [default: 0]
    #[arg(long, value_name = "DEGREES", requires = "lattice", allow_negative_numbers = true)]
    orientation: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Material, to get its weights")]
struct ConstantArguments {
    /// Young's modulus; two, along and across the fibres, for an orthotropic sheet: 9,1
    #[arg(long, value_name = "E", requires_all = ["lattice", "poisson"], value_delimiter = ',', allow_negative_numbers = true)]
    young: Vec<f64>,
    /// Poisson's ratio; that of tension along the fibres for an orthotropic sheet
    #[arg(long, value_name = "NU", requires = "young", allow_negative_numbers = true)]
    poisson: Option<f64>,
    /// Shear modulus of an orthotropic sheet
    #[arg(long, value_name = "G", requires = "young", allow_negative_numbers = true)]
    shear: Option<f64>,
    /// Angle of the fibres from x in degrees [default: 0]
    #[arg(long, value_name = "DEGREES", requires = "shear", allow_negative_numbers = true)]
    fiber_angle: Option<f64>,
    /// Assumption across the thickness [default: stress]
    #[arg(long, requires = "young", conflicts_with = "shear")]
    plane: Option<Plane>,
    /// Thickness of the sheet [default: 1]
    #[arg(long, value_name = "T", requires = "young", allow_negative_numbers = true)]
    thickness: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum KindName {
    Square,
    Rectangular,
    CentredRectangular,
    Hexagonal,
    Oblique,
    Honeycomb,
}

/// A wrong option: the fault and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{option}: {message}\n  help: {help}")]
pub struct WrongOption {
    option: &'static str,
    message: String,
    help: String,
}

pub fn wrong(option: &'static str, message: impl Into<String>, help: impl Into<String>) -> WrongOption {
    WrongOption { option, message: message.into(), help: help.into() }
}

/// The report asked for, as it is printed.
pub fn answer(arguments: &MaterialArguments) -> Result<String, Refusal> {
    let report = match &arguments.scene {
        Some(scene) => {
            let scene = SceneArguments::new(scene, &arguments.overrides.set).load()?;
            bulk_response::material(&scene)?
        }
        None => {
            let lattice = arguments.lattice.lattice()?;
            match arguments.constants.elastic()? {
                Some(elastic) => of_material(&lattice, &elastic)?,
                None => of_rule(&lattice, arguments.neighbours.as_deref(), arguments.weights.as_deref())?,
            }
        }
    };
    Ok(if arguments.json { format!("{:#}\n", serde_json::json!(report)) } else { report.to_string() })
}

fn of_material(lattice: &Lattice, elastic: &Elastic) -> Result<MaterialReport, WrongOption> {
    MaterialReport::of_material(lattice, elastic)
        .map_err(|error| wrong("--lattice", error.to_string(), bulk_response::remedy(&error)))
}

fn of_rule(
    lattice: &Lattice,
    given: Option<&str>,
    weights: Option<&str>,
) -> Result<MaterialReport, WrongOption> {
    if let Some(length) = weights.and_then(|weights| weights.strip_prefix("gradient:")) {
        return second_gradient(lattice, given, length);
    }
    let offsets = neighbours::neighbourhood(given.unwrap_or("first"), lattice)?;
    let (option, name) = match weights {
        None => ("--neighbours", "barycentre (Eq. 1)"),
        Some(_) => ("--weights", "barycentre with weights given"),
    };
    let weights = weights.map(|text| neighbours::weights(text, lattice, &offsets)).transpose()?;
    Crystal::scalar(lattice, &offsets, weights.as_deref())
        .and_then(|crystal| MaterialReport::of_rule(lattice, name.to_owned(), &crystal))
        .map_err(|error| wrong(option, error.to_string(), bulk_response::remedy(&error)))
}

fn second_gradient(
    lattice: &Lattice,
    given: Option<&str>,
    length: &str,
) -> Result<MaterialReport, WrongOption> {
    if given.is_some_and(|kind| kind != "collinear") {
        let message = "a second gradient reaches the sites behind the first neighbours";
        return Err(wrong("--neighbours", message, "leave it out, or give --neighbours collinear"));
    }
    let length = number("--weights", length)?;
    let name = format!("second gradient of length {length}");
    let report = GradientWeights::new(lattice, length)
        .and_then(|weights| Ok(MaterialReport::of_rule(lattice, name, &weights.crystal(lattice)?)?));
    let help =
        "give gradient:LENGTH with a length that the lattice carries, on one of the five Bravais lattices";
    let mut report = report.map_err(|error| wrong("--weights", error.to_string(), help))?;
    report.notes.push(layer_note(length));
    Ok(report)
}

impl LatticeArguments {
    fn lattice(&self) -> Result<Lattice, WrongOption> {
        let Some(name) = self.lattice else {
            let help = "name a scene, as in `flockform material tension`, or give --lattice square";
            return Err(wrong("SCENE", "there is neither a scene nor a lattice to ask about", help));
        };
        self.require_no_other(name)?;
        let needed = |option: &'static str, value: Option<f64>| {
            let Some(value) = value else {
                return Err(wrong(
                    option,
                    "this lattice needs it",
                    "give the edges of the cell: --a 1 --b 1.5",
                ));
            };
            positive(option, value)
        };
        let spacing = positive("--spacing", self.spacing.unwrap_or(1.0))?;
        let kind = match name {
            KindName::Square => LatticeKind::Square { spacing },
            KindName::Hexagonal => LatticeKind::Hexagonal { spacing },
            KindName::Honeycomb => LatticeKind::Honeycomb { spacing },
            _ => {
                let (a, b) = (needed("--a", self.a)?, needed("--b", self.b)?);
                match name {
                    KindName::Rectangular => LatticeKind::Rectangular { a, b },
                    KindName::CentredRectangular => LatticeKind::CentredRectangular { a, b },
                    _ => LatticeKind::Oblique { a, b, angle: self.oblique_angle()? },
                }
            }
        };
        if kind.is_out_of_proportion() {
            return Err(wrong(
                "--b",
                "it makes the cell more than a million times as long as it is high",
                "give edges of a like length, and an --angle farther from 0 and 180 degrees",
            ));
        }
        let orientation = self.orientation.unwrap_or(0.0);
        if !orientation.is_finite() {
            return Err(wrong("--orientation", format!("{orientation} is no angle"), "give degrees"));
        }
        Ok(Lattice::new(kind, [0.0; 2], orientation.to_radians()))
    }

    /// Angle between the edges of an oblique cell \[rad\].
    fn oblique_angle(&self) -> Result<f64, WrongOption> {
        let help = "give degrees between 0 and 180, ends excluded";
        match self.angle {
            None => Err(wrong("--angle", "an oblique lattice needs it", help)),
            Some(angle) if angle > 0.0 && angle < 180.0 => Ok(angle.to_radians()),
            Some(angle) => Err(wrong("--angle", format!("{angle} is not the angle of a cell"), help)),
        }
    }

    /// Refuses sizes that the lattice does not have: they would be ignored.
    fn require_no_other(&self, name: KindName) -> Result<(), WrongOption> {
        let by_spacing = matches!(name, KindName::Square | KindName::Hexagonal | KindName::Honeycomb);
        let given = [
            ("--spacing", self.spacing, by_spacing),
            ("--a", self.a, !by_spacing),
            ("--b", self.b, !by_spacing),
            ("--angle", self.angle, name == KindName::Oblique),
        ];
        match given.into_iter().find(|(_, value, belongs)| value.is_some() && !belongs) {
            None => Ok(()),
            Some((option, ..)) => {
                let help = if by_spacing {
                    "give --spacing"
                } else {
                    "give --a and --b, and --angle if it is oblique"
                };
                Err(wrong(option, "this lattice has no such size", help))
            }
        }
    }
}

impl ConstantArguments {
    /// The sheet asked for; none where the question is what a rule is.
    fn elastic(&self) -> Result<Option<Elastic>, WrongOption> {
        let Some(poisson) = self.poisson else { return Ok(None) };
        let constants = match (self.young.as_slice(), self.shear) {
            (&[young], None) => {
                Constants::Isotropic { young, poisson, plane: self.plane.unwrap_or(Plane::Stress) }
            }
            (&[along, across], Some(shear)) => {
                let angle = self.fiber_angle.unwrap_or(0.0).to_radians();
                Constants::Orthotropic { young: [along, across], poisson_12: poisson, shear, angle }
            }
            (young, shear) => {
                let moduli = young.len();
                let shear = if shear.is_some() { "and a shear modulus" } else { "and no shear modulus" };
                let message = format!("{moduli} of them {shear} make no sheet");
                let help = "give one for an isotropic sheet; two and --shear for an orthotropic one: --young 9,1 --shear 0.6";
                return Err(wrong("--young", message, help));
            }
        };
        let thickness = self.thickness.unwrap_or(1.0);
        Elastic::new(constants, thickness).map(Some).map_err(|error| {
            let (option, help) = place(&error);
            wrong(option, error.to_string(), help)
        })
    }
}

/// Which option an inadmissible constant came from, and the remedy.
fn place(error: &ElasticError) -> (&'static str, &'static str) {
    match error {
        ElasticError::NotPositive { name: "the thickness", .. } => ("--thickness", "give a positive number"),
        ElasticError::NotPositive { name: "the shear modulus", .. } => ("--shear", "give a positive number"),
        ElasticError::NotPositive { .. } => ("--young", "give positive numbers"),
        ElasticError::Poisson { .. } => {
            ("--poisson", "give a ratio inside the range; rubber is 0.49 to 0.4999")
        }
        ElasticError::PoissonOrthotropic { .. } => ("--poisson", "give a ratio inside the range"),
        ElasticError::Angle { .. } => ("--fiber-angle", "give degrees"),
        ElasticError::Range => ("--young", "use units in which the constants are of ordinary size"),
    }
}

fn positive(option: &'static str, value: f64) -> Result<f64, WrongOption> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(wrong(option, format!("{value} is not a positive number"), "give a length greater than 0"))
}

fn number(option: &'static str, text: &str) -> Result<f64, WrongOption> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => {
            Err(wrong(option, format!("`{text}` is not a finite number"), "give numbers as 1, -0.25 or 2e-3"))
        }
    }
}
