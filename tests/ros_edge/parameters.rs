//! Parameters from outside.

use flockform::messages::builtin_interfaces::Time;
use flockform::messages::rcl_interfaces;
use flockform::ros::edge::parameters::{Change, Declaration, Parameters, Store, Value};
use flockform::ros::edge::{Node, Quality};
use ros2_client::ServiceMapping;

use super::support::*;

fn parameters(node: &Node) -> Parameters {
    let mut store = Store::default();
    for declaration in [
        Declaration::new("rate", 50.0).describe("ticks per second [Hz]").range(1.0..=500.0),
        Declaration::new("gains.p", 1.0).checked("not 0.5", |_, value| {
            if value == &Value::Double(0.5) { Err("0.5 is unlucky".into()) } else { Ok(()) }
        }),
        Declaration::new("use_sim_time", false).read_only(),
    ] {
        store.declare(declaration, None).expect("declared once");
    }
    Parameters::open(node, store, true).expect("services")
}

fn settings(settings: &[(&str, Value)]) -> rcl_interfaces::Settings {
    let parameters = settings
        .iter()
        .map(|(name, value)| rcl_interfaces::Parameter { name: (*name).into(), value: value.to_wire() })
        .collect();
    rcl_interfaces::Settings { parameters }
}

fn names(names: &[&str]) -> rcl_interfaces::Names {
    rcl_interfaces::Names { names: names.iter().map(|&name| name.into()).collect() }
}

#[test]
fn parameters_are_got_and_described_from_outside() {
    use rcl_interfaces::{DescribeParameters, GetParameterTypes, GetParameters, ListParameters};
    let mut peers = peers();
    let node = peers.ours.node("/", "described").expect("a node");
    let mut parameters = parameters(&node);
    for mapping in MAPPINGS {
        let get = client::<GetParameters>(&mut peers, mapping, "/described/get_parameters");
        let types = client::<GetParameterTypes>(&mut peers, mapping, "/described/get_parameter_types");
        let describe = client::<DescribeParameters>(&mut peers, mapping, "/described/describe_parameters");
        let list = client::<ListParameters>(&mut peers, mapping, "/described/list_parameters");
        let mut tick = || assert_eq!(parameters.poll(0.0, None), []);
        let some = names(&["rate", "none"]);
        let got = call::<GetParameters>(&get, &some, &mut tick).values;
        assert_eq!(got, [Value::Double(50.0).to_wire(), rcl_interfaces::ParameterValue::default()]);
        assert_eq!(call::<GetParameterTypes>(&types, &some, &mut tick).types, [3, 0]);
        let described = call::<DescribeParameters>(&describe, &some, &mut tick).descriptors;
        assert_eq!(described[0].description, "ticks per second [Hz]");
        assert_eq!(described[0].floating_point_range[0].to_value, 500.0);
        let all = rcl_interfaces::ListParametersRequest::default();
        let listed = call::<ListParameters>(&list, &all, &mut tick);
        assert_eq!(listed.names, ["gains.p", "rate", "use_sim_time"]);
        assert_eq!(listed.prefixes, ["gains"]);
    }
}

#[test]
fn parameters_are_set_from_outside_within_their_bounds() {
    use rcl_interfaces::{ParameterEvent, SetParameters, SetParametersAtomically};
    let mut peers = peers();
    let node = peers.ours.node("/", "tuned").expect("a node");
    let mut parameters = parameters(&node);
    let observer = peers.theirs.node("/", "observer").expect("a node");
    let events =
        observer.subscription::<ParameterEvent>("/parameter_events", Quality::reliable(100)).expect("in");
    until("a match", || (events.matched() >= 1).then_some(()));
    let set = client::<SetParameters>(&mut peers, ServiceMapping::Cyclone, "/tuned/set_parameters");
    let atomically = client::<SetParametersAtomically>(
        &mut peers,
        ServiceMapping::Enhanced,
        "/tuned/set_parameters_atomically",
    );

    let wanted = settings(&[
        ("rate", Value::Integer(100)),
        ("rate", Value::Double(0.0)),
        ("rate", Value::String("fast".into())),
        ("gains.p", Value::Double(0.5)),
        ("use_sim_time", Value::Bool(true)),
        ("none", Value::Bool(true)),
    ]);
    let mut changes = Vec::new();
    let mut tick = || changes.extend(parameters.poll(3.5, None));
    let results = call::<SetParameters>(&set, &wanted, &mut tick).results;
    let reasons: Vec<&str> = results.iter().map(|result| result.reason.as_str()).collect();
    assert!(results[0].successful, "{reasons:?}");
    assert!(results[1..].iter().all(|result| !result.successful && !result.reason.is_empty()), "{reasons:?}");
    assert!(reasons[3].contains("unlucky"), "{reasons:?}");

    let half = settings(&[("rate", Value::Double(200.0)), ("gains.p", Value::Double(0.5))]);
    let result = call::<SetParametersAtomically>(&atomically, &half, &mut tick).result;
    assert!(!result.successful && result.reason.contains("unlucky"), "{}", result.reason);
    let rate = Change { name: "rate".into(), value: Value::Double(100.0) };
    assert!(!changes.is_empty() && changes.iter().all(|change| *change == rate), "{changes:?}");

    let event = until("an event", || {
        let (event, _) = events.take()?;
        (event.node == "/tuned" && !event.changed_parameters.is_empty()).then_some(event)
    });
    assert_eq!(event.changed_parameters, settings(&[("rate", Value::Double(100.0))]).parameters);
    assert_eq!(event.stamp, Time { sec: 3, nanosec: 500_000_000 });
}
