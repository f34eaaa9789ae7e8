//! Materials close to incompressible that are fitted to their outline, in parts.

use super::parts::{PLATE, assert_scene_parted_the_same, plate};
use super::written::{SEVERAL, assert_frames_the_same, assert_tables_the_same};

const SOFT: &str = "material={kind=\"isotropic\",young=1000.0,poisson=0.49,plane=\"strain\"}";
const WOVEN: &str =
    "material={kind=\"orthotropic\",young=[1000.0,250.0],poisson_12=1.9,shear=150.0,angle=20.0}";
const FITTED: &str = "body.outline=\"fitted\"";

#[test]
fn averaged_dilatations_beside_cut_cells_in_parts_have_the_bits_of_those_of_a_whole() {
    let [hexagonal, honeycomb] =
        ["hexagonal", "honeycomb"].map(|kind| format!("lattice={{kind=\"{kind}\",spacing=1.0}}"));
    let rotates = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[15.6,5.4],radius=2.6},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.495,plane=\"strain\"}}]";
    let stiff = "material={kind=\"isotropic\",young=1000.0,poisson=0.3,plane=\"strain\"}";
    let long = "body={shape={kind=\"polygon\",vertices=[[0.2,0.1],[60.3,-0.4],[120.1,3.7],[90.0,10.9],[1.1,8.3]]},\
         holes=[{kind=\"disc\",centre=[30.4,4.3],radius=2.1},{kind=\"disc\",centre=[70.1,5.3],radius=2.6}]}";
    let aligned = "body={shape={kind=\"rectangle\",max=[22,9]}}";
    let places = "record.places=[[16.3,5.8],[2.1,5.5],[20.9,5.0]]";
    for sets in [
        &[SOFT, "body.outline=\"lattice\"", rotates][..],
        &[SOFT],
        &[SOFT, SEVERAL, places],
        &[SOFT, rotates, SEVERAL],
        &[SOFT, &hexagonal],
        &[SOFT, &hexagonal, rotates],
        &[SOFT, &honeycomb, SEVERAL],
        &[SOFT, "lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}"],
        &[stiff, inclusion, SEVERAL],
        &[SOFT, inclusion, rotates],
        &[SOFT, long, SEVERAL],
        &[SOFT, long, &hexagonal],
        &[SOFT, aligned, places],
        &[WOVEN, SEVERAL, places],
        &[WOVEN, &hexagonal, rotates],
    ] {
        let sets = [&[FITTED], sets].concat();
        assert_scene_parted_the_same(&plate(PLATE, &sets), &format!("{sets:?}"), 25);
    }
}

#[test]
fn their_tables_and_frames_too() {
    let ramp = "load_steps={ramp={steps=30},every=7}";
    assert_tables_the_same(&plate(PLATE, &[FITTED, SOFT, SEVERAL, ramp, "record.probes=[]"]));
    let frames = ["record={probes=[],vtk_every=20}", "stop.steps=40"];
    assert_frames_the_same(&plate(PLATE, &[FITTED, SOFT, SEVERAL, frames[0], frames[1]]), &[0, 20, 40]);
}
