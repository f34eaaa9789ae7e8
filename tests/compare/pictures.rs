//! The figures of a comparison show what they say.

use flockform::compare::measures::von_mises;
use flockform::export::figures::{self, Compared};
use flockform::flock::body::Body;
use flockform::flock::neighbourhood::Neighbourhood;
use flockform::flock::points::Points;
use flockform::flock::role::Role;
use flockform::material::cells::Cells;
use flockform::material::weights::MaterialWeights;

use crate::support::*;

/// A beam by a rule and in truth, both end columns led by the truth.
struct Beam {
    body: Body,
    cells: Cells,
    roles: Vec<Role>,
    rule: Points,
    truth: Points,
}

impl Beam {
    fn of(aspect: u32, weights: impl FnOnce(&Body, &Cells) -> MaterialWeights) -> Self {
        let (body, cells) = beam(aspect);
        let truth = beam_truth(&body, &cells, 3).displacement;
        let follows = between_the_ends(&body);
        let rule = equilibrium(&weights(&body, &cells), &follows, &truth);
        let role = |&follows: &bool| if follows { Role::Follower } else { Role::Leader };
        Self { roles: follows.iter().map(role).collect(), body, cells, rule, truth }
    }

    fn by_the_paper(aspect: u32) -> Self {
        Self::of(aspect, |body, _| barycentre(body, &Neighbourhood::First { keep: None }))
    }

    fn by_the_material(aspect: u32) -> Self {
        let assemble = |body: &Body, cells: &Cells| {
            MaterialWeights::assemble(cells, body, cells.mates(body.count()), &polypropylene())
        };
        Self::of(aspect, |body, cells| assemble(body, cells).expect("assembles"))
    }

    fn compared<'a>(&'a self, title: &'a str) -> Compared<'a> {
        Compared {
            title,
            unit: "m",
            stress_unit: "N/m²",
            spacing: self.body.lattice.spacing(),
            cells: &self.cells,
            roles: &self.roles,
            reference: &self.body.reference,
            rule: &self.rule,
            truth: &self.truth,
        }
    }

    fn stresses(&self) -> [Vec<f64>; 2] {
        [&self.rule, &self.truth].map(|u| von_mises(&self.cells, &polypropylene(), u))
    }
}

#[test]
#[ignore = "draws into out/, to be looked at"]
fn pictures_to_look_at() {
    for (name, beam) in [
        ("paper-1", Beam::by_the_paper(1)),
        ("material-1", Beam::by_the_material(1)),
        ("paper-5", Beam::by_the_paper(5)),
        ("material-5", Beam::by_the_material(5)),
    ] {
        std::fs::create_dir_all("out").expect("writable");
        let compared = beam.compared("The beam whose end columns the truth leads");
        let [rule, truth] = beam.stresses();
        for (what, svg) in [
            ("overlay", figures::overlay(&compared)),
            ("von_mises", figures::von_mises(&compared, &rule, &truth)),
        ] {
            let path = format!("out/{name}-{what}");
            figures::write(&svg, path.as_ref()).expect("renders");
        }
    }
}
