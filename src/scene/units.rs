//! Units of the numbers, as text for tables, figures and messages.

use super::Scene;

/// Units by name. A scene names that of length and may name that of stress; the others follow.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Units {
    /// Of lengths and displacements.
    pub length: String,
    /// Of Young's modulus, tractions and stresses.
    pub stress: String,
    /// Of loads and reactions.
    pub force: String,
    /// Of moments, energies and work.
    pub moment: String,
}

/// Stress times the square of a length that has a name of its own.
const FORCES: [(&str, &str, &str); 14] = [
    ("Pa", "m", "N"),
    ("kPa", "m", "kN"),
    ("MPa", "m", "MN"),
    ("GPa", "m", "GN"),
    ("kPa", "mm", "mN"),
    ("MPa", "mm", "N"),
    ("GPa", "mm", "kN"),
    ("Pa", "mm", "µN"),
    ("N/mm^2", "mm", "N"),
    ("N/mm²", "mm", "N"),
    ("N/m^2", "m", "N"),
    ("N/m²", "m", "N"),
    ("psi", "in", "lbf"),
    ("ksi", "in", "kip"),
];

/// Names of units of length, and the metres in one.
const LENGTHS: [(&str, f64); 11] = [
    ("m", 1.0),
    ("km", 1e3),
    ("dm", 1e-1),
    ("cm", 1e-2),
    ("mm", 1e-3),
    ("µm", 1e-6),
    ("μm", 1e-6),
    ("um", 1e-6),
    ("nm", 1e-9),
    ("in", 0.0254),
    ("ft", 0.3048),
];

/// Metres in a unit of length of this name; `None` for any other name.
pub fn metres(unit: &str) -> Option<f64> {
    LENGTHS.iter().find(|(name, _)| *name == unit).map(|(_, metres)| *metres)
}

impl Units {
    /// Of the numbers in a scene and in its results.
    pub fn of(scene: &Scene) -> Self {
        Self::new(scene.unit(), scene.raw.stress_unit.as_deref())
    }

    fn new(length: &str, stress: Option<&str>) -> Self {
        let Some(stress) = stress else {
            // The unit of Young's modulus, which has no name here.
            let times = |power: &str| format!("unit of young × {length}{power}");
            return Self {
                length: length.into(),
                stress: "unit of young".into(),
                force: times("²"),
                moment: times("³"),
            };
        };
        let named =
            FORCES.iter().find(|(of_stress, of_length, _)| (*of_stress, *of_length) == (stress, length));
        let (force, moment) = match named {
            Some((.., force)) => ((*force).to_owned(), format!("{force} {length}")),
            None => (format!("{stress} {length}²"), format!("{stress} {length}³")),
        };
        Self { length: length.into(), stress: stress.into(), force, moment }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_force_follows_from_those_of_stress_and_length() {
        let force = |stress: Option<&str>, length: &str| Units::new(length, stress).force;
        assert_eq!(force(Some("Pa"), "m"), "N");
        assert_eq!(force(Some("MPa"), "mm"), "N");
        assert_eq!(force(Some("bar"), "cm"), "bar cm²");
        assert_eq!(force(None, "m"), "unit of young × m²");
        assert_eq!(Units::new("m", Some("Pa")).moment, "N m");
    }
}
