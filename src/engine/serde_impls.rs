//! How the flock's types stand in a checkpoint: the core itself knows no format.

/// Positions, as two arrays of numbers.
pub(crate) mod points {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::flock::vectors::Vectors;

    pub fn serialize<S: Serializer>(points: &Vectors, to: S) -> Result<S::Ok, S::Error> {
        (&points.x, &points.y).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vectors, D::Error> {
        let (x, y): (Vec<f64>, Vec<f64>) = Deserialize::deserialize(from)?;
        if x.len() != y.len() {
            return Err(serde::de::Error::custom("as many x as y"));
        }
        Ok(Vectors { x, y })
    }
}

/// Roles, as their place in [`Role::ALL`](crate::flock::role::Role::ALL).
pub(crate) mod roles {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::flock::role::Role;

    pub fn serialize<S: Serializer>(roles: &[Role], to: S) -> Result<S::Ok, S::Error> {
        let number = |role: &Role| Role::ALL.iter().position(|one| one == role).unwrap_or(0) as u8;
        roles.iter().map(number).collect::<Vec<u8>>().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Role>, D::Error> {
        let numbers: Vec<u8> = Deserialize::deserialize(from)?;
        let role = |&number: &u8| Role::ALL.get(usize::from(number)).copied();
        let roles: Option<Vec<Role>> = numbers.iter().map(role).collect();
        roles.ok_or_else(|| serde::de::Error::custom("a role"))
    }
}

/// Broken bonds: step, pair, place, length.
pub(crate) mod breaks {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::flock::fracture::Break;

    type Stored = (usize, [u32; 2], [f64; 2], f64);

    pub fn serialize<S: Serializer>(breaks: &[Break], to: S) -> Result<S::Ok, S::Error> {
        let stored = |one: &Break| (one.step, one.pair, one.place, one.length);
        breaks.iter().map(stored).collect::<Vec<Stored>>().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Break>, D::Error> {
        let stored: Vec<Stored> = Deserialize::deserialize(from)?;
        Ok(stored
            .into_iter()
            .map(|(step, pair, place, length)| Break { step, pair, place, length })
            .collect())
    }
}
