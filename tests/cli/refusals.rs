//! Scenes, arguments and files that are refused, and what is said of them.

use crate::program::*;

/// As [`refused`] for a scene that is the bundled one with overrides.
fn refused_with(scene: &str, overrides: &[&str], words: &[&str]) {
    let mut arguments = vec!["run", scene];
    overrides.iter().for_each(|set| arguments.extend(["--set", set]));
    refused(&arguments, words);
}

#[test]
fn a_missing_scene_is_refused_with_the_nearest_name() {
    refused(&["run", "tensoin"], &["no bundled scene `tensoin`", "`tension`", "flockform list scenes"]);
    refused(&["run", "scenes/nowhere.toml"], &["scenes/nowhere.toml", "cannot be read"]);
    refused(&["plan", "fractur"], &["`fracture`"]);
    let both =
        ["no scene or swarm file", "bundled swarm is `square`", "list scenes` and `flockform list swarms`"];
    refused(&["live", "sqare"], &both);
}

#[test]
fn a_misspelt_key_is_refused_with_line_and_nearest_key() {
    let folder = temporary();
    let path = folder.path().join("mine.toml");
    let scene = "title = \"t\"\n[lattice]\nkind = \"square\"\nspcaing = 1.0\n[body]\nshape = { kind = \"grid\", columns = 3, rows = 3 }\n";
    std::fs::write(&path, scene).expect("written");
    let path = path.display().to_string();
    refused(&["run", &path], &["mine.toml:4", "spcaing", "`spacing`"]);
}

#[test]
fn values_out_of_range_are_refused_with_the_range() {
    refused_with("tension", &["lattice.spacing=-1.0"], &["--set lattice.spacing=-1.0", "greater than 0"]);
    refused_with("tension", &["lattice.spacing=nan"], &["finite"]);
    refused_with("tension", &["roles[1].motion.per_step=[0.6, inf]"], &["finite"]);
    refused_with("tension", &["update.damping=0"], &["greater than 0"]);
    refused_with("tension", &["update.damping=2.5"], &["2"]);
    refused_with("lattice-oblique", &["lattice.angle=180"], &["less than 180"]);
    refused_with("lattice-oblique", &["lattice.angle=1e-5"], &["million times"]);
    refused_with("tension", &["body.shape.columns=0"], &["body.shape.columns", "1"]);
    refused_with("fracture", &["fracture.distance=0"], &["greater than 0"]);
    refused_with("tension", &["stop.steps=0"], &["stop.steps"]);
}

#[test]
fn wrong_choices_are_refused_with_the_choices() {
    refused_with("tension", &["lattice.kind=sqare"], &["did you mean \"square\""]);
    refused_with("tension", &["frame=laged"], &["did you mean \"lagged\""]);
    refused_with("tension", &["roles[0].role=ghots"], &["did you mean \"ghost\""]);
    refused_with("tension", &["lattice={kind=\"square\",spacing=1.0,a=2.0}"], &["a"]);
}

#[test]
fn cuts_on_the_way_are_refused_where_cuts_from_the_start_are() {
    let cut = "{at=2,what={kind=\"cut\",from=[6.5,-5.0],to=[6.5,20.0]}}";
    let alone = format!("actions=[{cut}]");
    refused_with("drop", &[&alone], &["actions", "cannot go with neighbours that are found anew"]);
    refused_with("beam-loaded", &[&alone], &["actions", "not in bonds that could be cut"]);
    let material = "material={kind=\"isotropic\",young=1000.0,poisson=0.33}";
    let then = "{at=3,what={kind=\"set\",keys=[\"rule.mean={kind=\\\"material\\\"}\"]}}";
    let both = format!("actions=[{cut},{then}]");
    let overrides = ["frame=none", "neighbours={kind=\"chebyshev\",radius=1}", material, &both];
    refused_with("tension", &overrides, &["actions[1].what.keys", "not in bonds that could be cut"]);
}

#[test]
fn a_body_that_cannot_be_is_refused_with_the_remedy() {
    refused_with(
        "tension",
        &["body.shape={kind=\"disc\",radius=0.1}", "body.anchor=[0.5,0.5]", "roles=[]", "record={}"],
        &["holds no lattice site", "smaller spacing"],
    );
    refused_with(
        "shear",
        &[
            "body={shape={kind=\"rectangle\",max=[20,20]},holes=[{kind=\"rectangle\",min=[-1,5.5],max=[21,9.5]}]}",
        ],
        &["body.shape", "parts", "not connected"],
    );
    refused_with("tension", &["body.shape={kind=\"rectangle\",min=[4,4],max=[1,9]}"], &["max", "min"]);
    refused_with(
        "tension",
        &["lattice.spacing=1e-9", "body.shape={kind=\"disc\",radius=9.0}"],
        &["more than"],
    );
}

#[test]
fn regions_roles_and_probes_that_miss_the_body_are_refused() {
    refused_with(
        "tension",
        &["roles[0].region={kind=\"box\",min=[90,90],max=[99,99]}"],
        &["roles[0].region", "no particle", "spans"],
    );
    refused_with(
        "tension",
        &["roles[0].region={kind=\"ids\",ids=[9999]}"],
        &["no particle 9999", "1 to 144"],
    );
    refused_with("tension", &["roles[0].region={kind=\"ids\",ids=[1]}"], &["belongs to the frame"]);
    refused_with("tension", &["record.probes=[0]"], &["record.probes[0]", "at least 1"]);
    refused_with(
        "tension",
        &["record.probes=[1,99999]"],
        &["record.probes[1]", "no particle 99999", "help:"],
    );
    refused_with("tension", &["roles[0].role=leader"], &["a leader needs a motion"]);
    refused_with(
        "tension",
        &["roles[2].motion={kind=\"velocity\",per_step=[1,0]}"],
        &["has no motion of its own"],
    );
    refused_with("tension", &["roles[2].when={quantity=\"pe1\"}"], &["no bound", "above"]);
    let never = "roles[2].when={quantity=\"x\",above=4,below=4}";
    refused_with("tension", &[never], &["roles[2].when.above", "above 4 and below 4", "lower bound"]);
}

#[test]
fn rules_that_contradict_themselves_are_refused() {
    refused_with("tension", &["neighbours={kind=\"first\",keep=9}"], &["4 first neighbours"]);
    refused_with("lattice-honeycomb", &["neighbours={kind=\"chebyshev\",radius=1}"], &["honeycomb"]);
    refused_with("lattice-hexagonal", &["neighbours={kind=\"offsets\",offsets=[[1,0]]}"], &["no site"]);
    refused_with("tension", &["rule.weights={kind=\"list\",values=[1,1,-1,-1]}"], &["add up to 0"]);
    let huge = "rule.weights={kind=\"list\",values=[1e308,1e308,1e308,1e308]}";
    refused_with("tension", &[huge], &["too large", "smaller"]);
    let steep = ["rule.weights={kind=\"distance\",power=3000}", "neighbours={kind=\"chebyshev\",radius=1}"];
    refused_with("tension", &steep, &["rule.weights.power", "add up to inf", "nearer to 0"]);
    let own = "neighbours={kind=\"offsets\",offsets=[[1,0],[0,0]]}";
    refused_with("tension", &[own], &["neighbours.offsets[1]", "not its own neighbour"]);
    refused_with("tension", &["unit=\"\""], &["unit", "at least 1 character"]);
    refused_with("tension", &["rule.weights={kind=\"list\",values=[1,1]}"], &["2 weights", "4 neighbours"]);
    refused_with("tension", &["rule.mean={kind=\"power\",exponent=0}"], &["geometric"]);
    refused_with("drop", &["frame=lagged"], &["found anew at every step"]);
    refused_with("fracture", &["fracture.stretch=1.5"], &["both a distance and a stretch"]);
    refused_with(
        "shear",
        &["roles[1].motion.frames=[{step=9,displacement=[1,0]},{step=3,displacement=[2,0]}]"],
        &["ascending"],
    );
}

#[test]
fn feedback_that_leaves_no_place_of_rest_is_named() {
    let roles = "roles=[{region={kind='edge',side='left'},role='clamped'},{region={kind='edge',side='right'},\
                 role='leader',motion={kind='velocity',per_step=[0.1,0]}}]";
    for (factor, why) in [("-1", "no follower ever moves"), ("0.8", "stretches"), ("-2.5", "stretches")] {
        let factor = format!("rule.feedback={{factor={factor}}}");
        let keys = [roles, &factor, "frame=none", "record={}", "equilibrium={}"];
        refused_with("tension", &keys, &["rule.feedback.factor", why, "between -1 and 0"]);
    }
}

#[test]
fn overrides_that_cannot_be_placed_are_refused() {
    refused_with("tension", &["lattice.spacing"], &["--set lattice.spacing", "="]);
    refused_with("tension", &["roles[9].role=follower"], &["roles"]);
    refused_with("tension", &["title.more=1"], &["title"]);
}

#[test]
fn a_broken_displacement_file_is_refused_with_its_line() {
    let csv = "roles[1].motion={kind=\"csv\",file=\"FILE\"}";
    refused_with(
        "tension",
        &[&csv.replace("FILE", "nowhere.csv")],
        &["nowhere.csv", "relative to the scene file"],
    );
    let folder = temporary();
    let path = folder.path().join("led.csv");
    std::fs::write(&path, "id,ux,uy\n1,oops,0\n").expect("written");
    let path = path.display().to_string();
    refused_with("tension", &[&csv.replace("FILE", &path)], &["line 2", "oops", "not a finite number"]);
    std::fs::write(&path, "id,ux,uy\n1,0,0\n").expect("written");
    refused_with("tension", &[&csv.replace("FILE", &path)], &["no row for particle 122"]);
}

#[test]
fn old_names_are_refused_with_the_new_ones() {
    refused(&["scenes"], &["`list scenes`"]);
    refused(&["trade", "grips", "--most-particles", "9"], &["`--max-particles`"]);
    refused(&["run", "tension", "--set", "stop.growth=9"], &["`divergence_ratio`"]);
    refused(&["run", "tension", "--set", "neighbours={ kind = 'ring', radius = 1 }"], &["\"chebyshev\""]);
}

#[test]
fn unknown_arguments_are_refused() {
    refused(&["run"], &["SCENE"]);
    refused(&["fly"], &["fly"]);
    refused(&["run", "tension", "--threads", "0"], &["--threads"]);
    refused(&["run", "tension", "--steps", "-3"], &["-3"]);
    let both = ["run", "tension", "--steps", "3", "--set", "stop.steps=2"];
    refused(&both, &["--steps", "`--set stop.steps=2`", "leave one of the two out"]);
}

#[test]
fn an_output_that_cannot_be_written_is_refused() {
    let folder = temporary();
    std::fs::write(folder.path().join("file"), "").expect("written");
    refused_in(&["run", "tension", "--out", "file"], folder.path(), &["is no folder"]);
}
