//! Services.

use flockform::messages::std_srvs;

use super::support::*;

#[test]
fn one_service_answers_clients_of_either_mapping() {
    let mut peers = peers();
    let node = peers.ours.node("/", "server").expect("a node");
    let service = node.service::<std_srvs::SetBool>("/server/switch").expect("a service");
    let clients = MAPPINGS.map(|mapping| client::<std_srvs::SetBool>(&mut peers, mapping, "/server/switch"));
    until("both clients", || (service.matched() == 2).then_some(()));
    for data in [true, false, true] {
        for client in &clients {
            let mut serve = || {
                service.serve(|request| std_srvs::Outcome {
                    success: request.data,
                    message: format!("was {}", request.data),
                });
            };
            let answer = call::<std_srvs::SetBool>(client, &std_srvs::SetBoolRequest { data }, &mut serve);
            assert_eq!(answer, std_srvs::Outcome { success: data, message: format!("was {data}") });
        }
    }
    assert_eq!(service.refused(), 0);
}
