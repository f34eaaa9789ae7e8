//! Neighbours that are found anew in every period.

use super::*;

/// Three robots that lead and one that follows, whose place is `d`.
fn four(d: [f64; 2]) -> SwarmPlan {
    let text = format!(
        "title = \"x\"\nradius = 0.1\nlinks = {{ kind = \"present\", radius = 2.5 }}\n\
         robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = [2.0, 0.0] }}, \
         {{ name = \"c\", place = [0.0, 2.0] }}, {{ name = \"d\", place = {d:?} }}]\n\
         leaders = [{{ robots = [\"a\", \"b\", \"c\"], program = {{ kind = \"external\" }} }}]\n"
    );
    planned(&text, &[])
}

#[test]
fn neighbours_that_do_not_last_are_those_at_the_start() {
    let near = four([0.7, 0.7]);
    assert_eq!((near.neighbours, &near.cautions[..]), (3.0, &[][..]), "{near}");
    // Of b alone, and of none.
    assert_eq!(four([4.0, 0.0]).neighbours, 1.0);
    let far = four([9.0, 0.0]);
    assert_eq!(far.neighbours, 0.0, "{far}");
    assert!(
        matches!(&far.cautions[..], [one] if one.contains("no leader reaches `d` at the start")),
        "{far}"
    );
    let square = |radius: f64| {
        let near = format!("neighbours={{ kind = \"dynamic\", radius = {radius} }}");
        plan("square", &[&near, "rule={}"])
    };
    let dynamic = square(2.5);
    assert!(dynamic.neighbours > 4.0 && dynamic.cautions.is_empty(), "{dynamic}");
    let short = square(1.1);
    assert_eq!(short.neighbours, 0.0, "{short}");
    assert!(
        short.cautions.iter().any(|one| one.contains("`robot_2`") && one.contains("at the start")),
        "{short}"
    );
}
