//! How the flock's types stand in a checkpoint: the core itself knows no format. What is written is never copied first:
//! a checkpoint takes no second body's memory.

/// Positions, as two arrays of numbers.
pub(crate) mod points {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::flock::vectors::Vectors;

    pub fn serialize<S: Serializer>(points: &Vectors, to: S) -> Result<S::Ok, S::Error> {
        (&points.x, &points.y).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>, T: From<Vectors>>(from: D) -> Result<T, D::Error> {
        let (x, y): (Vec<f64>, Vec<f64>) = Deserialize::deserialize(from)?;
        if x.len() != y.len() {
            return Err(serde::de::Error::custom("as many x as y"));
        }
        Ok(T::from(Vectors { x, y }))
    }
}

/// Roles, as their place in [`Role::ALL`](crate::flock::role::Role::ALL).
pub(crate) mod roles {
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::flock::role::Role;

    pub fn serialize<S: Serializer>(roles: &[Role], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(roles.iter().map(|role| role.number()))
    }

    pub fn deserialize<'de, D: Deserializer<'de>, T: From<Vec<Role>>>(from: D) -> Result<T, D::Error> {
        let numbers: Vec<u8> = Deserialize::deserialize(from)?;
        let role = |&number: &u8| Role::ALL.get(usize::from(number)).copied();
        let roles: Option<Vec<Role>> = numbers.iter().map(role).collect();
        roles.map(T::from).ok_or_else(|| serde::de::Error::custom("a role"))
    }
}

/// Broken bonds: step, pair, place, length.
pub(crate) mod breaks {
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::flock::fracture::Break;

    type Stored = (usize, [u32; 2], [f64; 2], f64);

    pub fn serialize<S: Serializer>(breaks: &[Break], to: S) -> Result<S::Ok, S::Error> {
        let stored = |one: &Break| -> Stored { (one.step, one.pair, one.place, one.length) };
        to.collect_seq(breaks.iter().map(stored))
    }

    pub fn deserialize<'de, D: Deserializer<'de>, T: From<Vec<Break>>>(from: D) -> Result<T, D::Error> {
        let stored: Vec<Stored> = Deserialize::deserialize(from)?;
        let one = |(step, pair, place, length)| Break { step, pair, place, length };
        Ok(T::from(stored.into_iter().map(one).collect::<Vec<Break>>()))
    }
}
