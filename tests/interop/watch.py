#!/usr/bin/env python3
"""Somebody who looks at a formation's node and calls its services, on Cyclone DDS.

Usage: watch.py DOMAIN NODE, the node's fully qualified name. Prints {"state": ...}, {"diagnostics": ...} and {"log": ...} as they
come and {"reply": ...} for every command {"call": SERVICE, "with": BODY} on the standard input; SERVICES says what
bodies mean.
"""

from wire import *


def parameters(pairs):
    return ([Parameter(name, ParameterValue(type=3, double_value=value)) for name, value in pairs.items()],)


def formation(body):
    pairs = [("name", ""), ("translate", [0, 0]), ("rotate", 0), ("stretch", [1, 1]), ("shear", [0, 0]), ("duration", 1)]
    return tuple(number(body.get(name, default)) if name != "name" else body.get(name, "") for name, default in pairs)


def number(given):
    """JSON has neither NaN nor infinity: they come as words."""
    return [float(one) for one in given] if isinstance(given, list) else float(given)


SERVICES = {
    "list_parameters": (ListParametersRequest, ListParametersReply, lambda _: ([], 0)),
    "describe_parameters": (DescribeParametersRequest, DescribeParametersReply, lambda names: (names,)),
    "get_parameters": (GetParametersRequest, GetParametersReply, lambda names: (names,)),
    "set_parameters": (SetParametersRequest, SetParametersReply, parameters),
    "get_state": (GetStateRequest, GetStateReply, lambda _: ()),
    "change_state": (ChangeStateRequest, ChangeStateReply, lambda label: (Transition(0, label),)),
    "emergency_stop": (TriggerRequest, TriggerReply, lambda _: ()),
    "resume": (TriggerRequest, TriggerReply, lambda _: ()),
    "set_formation": (SetFormationRequest, SetFormationReply, formation),
}


def watch(participant, node):
    states = DataReader(participant, Topic(participant, f"rt{node}/state", FormationState), qos=RELIABLE)
    reports = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray), qos=RELIABLE)
    logs = DataReader(participant, Topic(participant, "rt/rosout", Log), qos=LATCHED)
    clients, orders = {}, commands()
    tell(ready=True)
    while True:
        for state in states.take(N=10):
            if state.sample_info.valid_data:
                tell(state=state)
        for report in reports.take(N=10):
            if report.sample_info.valid_data:
                status = report.status[0]
                values = {one.key: one.value for one in status.values}
                tell(diagnostics={"level": status.level, "message": status.message, **values})
        for log in logs.take(N=10):
            if log.sample_info.valid_data:
                tell(log={"level": log.level, "name": log.name, "message": log.msg, "file": log.file})
        while not orders.empty():
            order = orders.get()
            name = order["call"]
            request, reply, body = SERVICES[name]
            if name not in clients:
                clients[name] = Client(participant, f"{node}/{name}", request, reply)
            tell(reply=clients[name].call(*body(order.get("with"))))
        time.sleep(0.005)


if __name__ == "__main__":
    watch(DomainParticipant(int(sys.argv[1])), sys.argv[2])
