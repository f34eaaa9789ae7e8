//! The store behind its services.

use super::{Change, Refusal, Store, Value};
use crate::messages::builtin_interfaces::Time;
use crate::messages::{rcl_interfaces as msgs, said};
use crate::ros::edge::{EdgeError, Node, Publisher, Quality, Service};

/// A node's parameters and the services `~/get_parameters`, `~/set_parameters`,
/// `~/set_parameters_atomically`, `~/list_parameters`, `~/describe_parameters`, `~/get_parameter_types`, with
/// the topic `/parameter_events`.
pub struct Parameters {
    store: Store,
    node: String,
    /// None where peers have no part in them.
    services: Option<Services>,
    announced: bool,
}

struct Services {
    get: Service<msgs::GetParameters>,
    types: Service<msgs::GetParameterTypes>,
    describe: Service<msgs::DescribeParameters>,
    list: Service<msgs::ListParameters>,
    set: Service<msgs::SetParameters>,
    set_atomically: Service<msgs::SetParametersAtomically>,
    events: Publisher<msgs::ParameterEvent>,
}

impl Services {
    fn new(node: &Node) -> Result<Self, EdgeError> {
        Ok(Self {
            get: node.service(&node.private("get_parameters")?)?,
            types: node.service(&node.private("get_parameter_types")?)?,
            describe: node.service(&node.private("describe_parameters")?)?,
            list: node.service(&node.private("list_parameters")?)?,
            set: node.service(&node.private("set_parameters")?)?.from_now_on(),
            set_atomically: node.service(&node.private("set_parameters_atomically")?)?.from_now_on(),
            events: node.publisher(&node.topic("/parameter_events")?, Quality::reliable(1000))?,
        })
    }

    fn answer_questions(&self, store: &Store) {
        let unset = msgs::ParameterValue::default;
        self.get.serve(|request| msgs::GetParametersResponse {
            values: each(&request, |name| store.get(name).map_or_else(unset, Value::to_wire)),
        });
        self.types.serve(|request| msgs::GetParameterTypesResponse {
            types: each(&request, |name| store.get(name).map_or(0, Value::kind)),
        });
        self.describe.serve(|request| msgs::DescribeParametersResponse {
            descriptors: each(&request, |name| store.descriptor(name)),
        });
        self.list.serve(|request| {
            let (names, prefixes) = store.list(&request.prefixes, request.depth);
            msgs::ListParametersResponse { names, prefixes }
        });
    }

    /// Takes new values from peers; with a reason in `locked`, none.
    fn take_values(&self, store: &mut Store, locked: Option<&str>) {
        let may = |name: &str| match locked {
            Some(reason) => Err(Refusal::Vetoed { name: said(name), reason: reason.into() }),
            None => Ok(()),
        };
        self.set.serve(|request| {
            let set = |parameter: msgs::Parameter| {
                let name = parameter.name;
                result(may(&name).and_then(|()| store.set(&name, Value::from_wire(parameter.value))))
            };
            msgs::SetParametersResponse { results: request.parameters.into_iter().map(set).collect() }
        });
        self.set_atomically.serve(|request| {
            let wanted = |parameter: msgs::Parameter| (parameter.name, Value::from_wire(parameter.value));
            let settings: Vec<_> = request.parameters.into_iter().map(wanted).collect();
            let set = may(settings.first().map_or("", |(name, _)| name));
            let set = set.and_then(|()| store.set_atomically(settings));
            msgs::SetParametersAtomicallyResponse { result: result(set) }
        });
    }
}

impl Parameters {
    /// Holds what the store declares, and serves it if `is_served`.
    ///
    /// # Errors
    /// As [`Node::service`].
    pub fn open(node: &Node, store: Store, is_served: bool) -> Result<Self, EdgeError> {
        let services = is_served.then(|| Services::new(node)).transpose()?;
        Ok(Self { store, node: node.name().into(), services, announced: false })
    }

    pub fn get(&self, name: &str) -> Option<&Value> {
        self.store.get(name)
    }

    /// Names and values, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.store.iter()
    }

    /// Sets one from inside; the next [`Parameters::poll`] returns and announces it.
    ///
    /// # Errors
    /// As from outside.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) -> Result<(), Refusal> {
        self.store.set(name, Some(value.into()))
    }

    /// Answers the requests since the last tick and returns the changes. `now` \[s\] stamps the event. With a reason in
    /// `locked`, peers may set no parameter.
    pub fn poll(&mut self, now: f64, locked: Option<&str>) -> Vec<Change> {
        if let Some(services) = &self.services {
            services.answer_questions(&self.store);
            services.take_values(&mut self.store, locked);
        }
        self.changes(now)
    }

    /// The changes since the last call, which are announced; answers no request. `now` \[s\] stamps the event.
    pub fn changes(&mut self, now: f64) -> Vec<Change> {
        let changes = self.store.take_changes();
        self.announce(&changes, now);
        changes
    }

    fn announce(&mut self, changes: &[Change], now: f64) {
        let Some(services) = &self.services else { return };
        let parameter =
            |name: &str, value: &Value| msgs::Parameter { name: name.into(), value: value.to_wire() };
        let mut event = msgs::ParameterEvent {
            stamp: Time::from_seconds(now),
            node: self.node.clone(),
            ..msgs::ParameterEvent::default()
        };
        if !std::mem::replace(&mut self.announced, true) {
            event.new_parameters = self.store.iter().map(|(name, value)| parameter(name, value)).collect();
        }
        event.changed_parameters =
            changes.iter().map(|change| parameter(&change.name, &change.value)).collect();
        if event.new_parameters.is_empty() && event.changed_parameters.is_empty() {
            return;
        }
        if let Err(error) = services.events.publish(&event) {
            tracing::warn!("{error}");
        }
    }
}

fn each<T>(request: &msgs::Names, answer: impl Fn(&str) -> T) -> Vec<T> {
    request.names.iter().map(|name| answer(name)).collect()
}

fn result(set: Result<(), Refusal>) -> msgs::SetParametersResult {
    let reason = set.as_ref().err().map(ToString::to_string).unwrap_or_default();
    msgs::SetParametersResult { successful: set.is_ok(), reason }
}
