"""Encodes messages with rosbags (PyPI): JSON lines {"type": "package/Name", "value": ...} in, hexadecimal CDR out; for lines
without a value the hash of the type.

Usage: reference_cdr.py PATH_OF_FLOCKFORM_MSGS
"""

import json
import pathlib
import sys

import numpy
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.interfaces import Nodetype


def register(store, package):
    """Adds the definitions of an interface package; the halves of a service become two messages."""
    types = {}
    for path in sorted(package.glob("msg/*.msg")):
        types.update(get_types_from_msg(path.read_text(), f"{package.name}/msg/{path.stem}"))
    for path in sorted(package.glob("srv/*.srv")):
        request, response = path.read_text().split("\n---\n")
        types.update(get_types_from_msg(request, f"{package.name}/msg/{path.stem}_Request"))
        types.update(get_types_from_msg(response, f"{package.name}/msg/{path.stem}_Response"))
    store.register(types)


def build(store, kind, value):
    """The value as the store's class of a field type."""
    node, detail = kind
    if node == Nodetype.NAME:
        return message(store, detail, value)
    if node == Nodetype.BASE:
        return value
    member = detail[0]
    if member[0] == Nodetype.BASE and member[1][0] not in ("string", "wstring"):
        return numpy.array(value, dtype=member[1][0])
    return [build(store, member, one) for one in value]


def message(store, name, value):
    fields = store.fielddefs[name][1]
    assert [field for field, _ in fields] == list(value), f"{name}: {list(value)}"
    return store.types[name](**{field: build(store, kind, value[field]) for field, kind in fields})


def main():
    store = get_typestore(Stores.ROS2_JAZZY)
    register(store, pathlib.Path(sys.argv[1]))
    for line in sys.stdin:
        asked = json.loads(line)
        package, name = asked["type"].split("/")
        kind = f"{package}/msg/{name}"
        if "value" not in asked:
            print(store.hash_rihs01(kind))
            continue
        print(bytes(store.serialize_cdr(message(store, kind, asked["value"]), kind)).hex())


if __name__ == "__main__":
    main()
