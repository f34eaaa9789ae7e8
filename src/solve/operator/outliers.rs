//! Particles that stand along an outline and at no site.

use std::sync::Arc;

use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::ranks::Team;

/// Where the particles along an outline are. They have a column of their own, [`Body::ALONG_OUTLINE`], in which their rows count
/// along the outline; they are numbered after the others of the column that they are closest to.
#[derive(Clone, Debug, Default)]
pub struct Outliers {
    /// Columns and rows, by the row in that column; not a number of those that are not known.
    places: Arc<Vec<[f64; 2]>>,
}

impl Outliers {
    /// Rows and places of the particles.
    pub fn new(known: impl IntoIterator<Item = (i32, [f64; 2])>) -> Self {
        let mut places = Vec::new();
        for (row, place) in known {
            if places.len() <= row as usize {
                places.resize(row as usize + 1, [f64::NAN; 2]);
            }
            places[row as usize] = place;
        }
        Self { places: Arc::new(places) }
    }

    /// Those of all ranks, of which each names some: they are few, and rows lead from everywhere to them.
    pub fn among(team: &Team, own: impl Iterator<Item = (i32, [f64; 2])>) -> Self {
        Self::new(team.gather_all(&own.collect::<Vec<_>>()))
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// By row.
    pub fn places(&self) -> &[[f64; 2]] {
        &self.places
    }

    /// Where a particle with this site is, in columns and rows.
    pub fn place(&self, site: Site) -> [f64; 2] {
        if site[0] == Body::ALONG_OUTLINE { self.places[site[1] as usize] } else { site.map(f64::from) }
    }

    /// The column that a particle with this site belongs to.
    pub fn column(&self, site: Site) -> i32 {
        if site[0] == Body::ALONG_OUTLINE { self.place(site)[0].round() as i32 } else { site[0] }
    }

    /// Columns beyond its own in which a particle may be closest to a site: those along an outline are up to half a column away.
    pub fn beside(&self) -> i32 {
        i32::from(!self.is_empty())
    }
}
