"""Hypothesis strategies for every message on the wire, built from the types themselves."""

import re

import msgspec.inspect as mi
from hypothesis import strategies as st

from zenocap.common import messages as m
from zenocap.common.messages import AssignQuery, AssignReply, CameraHost, FilmQuery, FilmReply, ServiceInfo
from zenocap.common.topics import TOPICS

MESSAGE_TYPES = (
    *(topic.message for topic in TOPICS), m.ClockQuery, m.PaceQuery, ServiceInfo, FilmQuery, FilmReply, CameraHost,
    AssignQuery, AssignReply,
)  # fmt: skip
NAMES = st.from_regex(r"[A-Za-z0-9_.\-]{1,12}", fullmatch=True)


def values(kind: mi.Type) -> st.SearchStrategy[object]:
    """Valid values of a type as msgspec describes it."""
    match kind:
        case mi.Metadata(type=inner):
            return values(inner)
        case mi.StructType(cls=cls, fields=fields):
            return st.builds(cls, **{field.name: values(field.type) for field in fields})
        case mi.DictType(key_type=key, value_type=value):
            return st.dictionaries(values(key), values(value), max_size=4)
        case mi.ListType(item_type=item, min_length=least, max_length=most):
            return st.lists(values(item), min_size=least or 0, max_size=min(most or 4, (least or 0) + 4))
        case mi.TupleType(item_types=items):
            return st.tuples(*(values(item) for item in items))
        case mi.UnionType(types=kinds):
            return st.one_of([values(member) for member in kinds])
    return scalars(kind)


def scalars(kind: mi.Type) -> st.SearchStrategy[object]:
    match kind:
        case mi.FloatType(ge=ge, le=le):
            return st.floats(min_value=ge, max_value=le)
        case mi.IntType(ge=ge, le=le):
            return st.integers(min_value=ge, max_value=le)
        case mi.BoolType():
            return st.booleans()
        case mi.BytesType():
            return st.binary(max_size=64)
        case mi.EnumType(cls=cls):
            return st.sampled_from(cls)
        case mi.LiteralType(values=allowed):
            return st.sampled_from(allowed)
        case mi.StrType(pattern=str(pattern)):
            return NAMES.filter(lambda name: re.match(pattern, name) is not None)
        case mi.StrType(min_length=least, max_length=most):
            return st.text(min_size=least or 0, max_size=min(most or 20, 20))
        case mi.NoneType():
            return st.none()
    raise NotImplementedError(kind)


def messages_of(kind: type[m.Message]) -> st.SearchStrategy[m.Message]:
    return st.deferred(lambda: values(mi.type_info(kind)))


MESSAGES = st.sampled_from(MESSAGE_TYPES).flatmap(messages_of)
