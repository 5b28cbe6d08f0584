from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class DescribeRequest(_message.Message):
    __slots__ = ("protocol",)
    PROTOCOL_FIELD_NUMBER: _ClassVar[int]
    protocol: int
    def __init__(self, protocol: _Optional[int] = ...) -> None: ...

class Description(_message.Message):
    __slots__ = ("protocol", "name", "says", "states", "parameters", "outputs", "inputs", "restart", "deterministic", "observers", "hosts", "measures")
    PROTOCOL_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    SAYS_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    OUTPUTS_FIELD_NUMBER: _ClassVar[int]
    INPUTS_FIELD_NUMBER: _ClassVar[int]
    RESTART_FIELD_NUMBER: _ClassVar[int]
    DETERMINISTIC_FIELD_NUMBER: _ClassVar[int]
    OBSERVERS_FIELD_NUMBER: _ClassVar[int]
    HOSTS_FIELD_NUMBER: _ClassVar[int]
    MEASURES_FIELD_NUMBER: _ClassVar[int]
    protocol: int
    name: str
    says: str
    states: _containers.RepeatedCompositeFieldContainer[Quantity]
    parameters: _containers.RepeatedCompositeFieldContainer[Quantity]
    outputs: _containers.RepeatedCompositeFieldContainer[Quantity]
    inputs: _containers.RepeatedCompositeFieldContainer[Quantity]
    restart: bool
    deterministic: bool
    observers: _containers.RepeatedScalarFieldContainer[str]
    hosts: _containers.RepeatedScalarFieldContainer[str]
    measures: _containers.RepeatedCompositeFieldContainer[Measure]
    def __init__(self, protocol: _Optional[int] = ..., name: _Optional[str] = ..., says: _Optional[str] = ..., states: _Optional[_Iterable[_Union[Quantity, _Mapping]]] = ..., parameters: _Optional[_Iterable[_Union[Quantity, _Mapping]]] = ..., outputs: _Optional[_Iterable[_Union[Quantity, _Mapping]]] = ..., inputs: _Optional[_Iterable[_Union[Quantity, _Mapping]]] = ..., restart: _Optional[bool] = ..., deterministic: _Optional[bool] = ..., observers: _Optional[_Iterable[str]] = ..., hosts: _Optional[_Iterable[str]] = ..., measures: _Optional[_Iterable[_Union[Measure, _Mapping]]] = ...) -> None: ...

class Quantity(_message.Message):
    __slots__ = ("name", "unit", "size", "role", "lo", "hi", "default_value", "says")
    NAME_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    LO_FIELD_NUMBER: _ClassVar[int]
    HI_FIELD_NUMBER: _ClassVar[int]
    DEFAULT_VALUE_FIELD_NUMBER: _ClassVar[int]
    SAYS_FIELD_NUMBER: _ClassVar[int]
    name: str
    unit: str
    size: int
    role: str
    lo: float
    hi: float
    default_value: float
    says: str
    def __init__(self, name: _Optional[str] = ..., unit: _Optional[str] = ..., size: _Optional[int] = ..., role: _Optional[str] = ..., lo: _Optional[float] = ..., hi: _Optional[float] = ..., default_value: _Optional[float] = ..., says: _Optional[str] = ...) -> None: ...

class Measure(_message.Message):
    __slots__ = ("output", "state")
    OUTPUT_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    output: str
    state: str
    def __init__(self, output: _Optional[str] = ..., state: _Optional[str] = ...) -> None: ...

class RunRequest(_message.Message):
    __slots__ = ("particle", "record", "parameters", "initial", "state", "start", "times", "outputs", "observed", "observer", "inputs", "terms", "constants", "scratch", "traceparent")
    PARTICLE_FIELD_NUMBER: _ClassVar[int]
    RECORD_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    INITIAL_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    START_FIELD_NUMBER: _ClassVar[int]
    TIMES_FIELD_NUMBER: _ClassVar[int]
    OUTPUTS_FIELD_NUMBER: _ClassVar[int]
    OBSERVED_FIELD_NUMBER: _ClassVar[int]
    OBSERVER_FIELD_NUMBER: _ClassVar[int]
    INPUTS_FIELD_NUMBER: _ClassVar[int]
    TERMS_FIELD_NUMBER: _ClassVar[int]
    CONSTANTS_FIELD_NUMBER: _ClassVar[int]
    SCRATCH_FIELD_NUMBER: _ClassVar[int]
    TRACEPARENT_FIELD_NUMBER: _ClassVar[int]
    particle: int
    record: int
    parameters: bytes
    initial: _containers.RepeatedCompositeFieldContainer[Named]
    state: bytes
    start: float
    times: bytes
    outputs: _containers.RepeatedScalarFieldContainer[str]
    observed: bytes
    observer: Observer
    inputs: _containers.RepeatedCompositeFieldContainer[Signal]
    terms: _containers.RepeatedCompositeFieldContainer[Term]
    constants: _containers.RepeatedCompositeFieldContainer[Named]
    scratch: str
    traceparent: str
    def __init__(self, particle: _Optional[int] = ..., record: _Optional[int] = ..., parameters: _Optional[bytes] = ..., initial: _Optional[_Iterable[_Union[Named, _Mapping]]] = ..., state: _Optional[bytes] = ..., start: _Optional[float] = ..., times: _Optional[bytes] = ..., outputs: _Optional[_Iterable[str]] = ..., observed: _Optional[bytes] = ..., observer: _Optional[_Union[Observer, _Mapping]] = ..., inputs: _Optional[_Iterable[_Union[Signal, _Mapping]]] = ..., terms: _Optional[_Iterable[_Union[Term, _Mapping]]] = ..., constants: _Optional[_Iterable[_Union[Named, _Mapping]]] = ..., scratch: _Optional[str] = ..., traceparent: _Optional[str] = ...) -> None: ...

class Named(_message.Message):
    __slots__ = ("name", "value")
    NAME_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    name: str
    value: float
    def __init__(self, name: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...

class Observer(_message.Message):
    __slots__ = ("kind", "gain")
    KIND_FIELD_NUMBER: _ClassVar[int]
    GAIN_FIELD_NUMBER: _ClassVar[int]
    kind: str
    gain: float
    def __init__(self, kind: _Optional[str] = ..., gain: _Optional[float] = ...) -> None: ...

class Signal(_message.Message):
    __slots__ = ("times", "values")
    TIMES_FIELD_NUMBER: _ClassVar[int]
    VALUES_FIELD_NUMBER: _ClassVar[int]
    times: bytes
    values: bytes
    def __init__(self, times: _Optional[bytes] = ..., values: _Optional[bytes] = ...) -> None: ...

class Term(_message.Message):
    __slots__ = ("state", "expression")
    STATE_FIELD_NUMBER: _ClassVar[int]
    EXPRESSION_FIELD_NUMBER: _ClassVar[int]
    state: str
    expression: str
    def __init__(self, state: _Optional[str] = ..., expression: _Optional[str] = ...) -> None: ...

class RunReply(_message.Message):
    __slots__ = ("progress", "finished", "failure")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    FINISHED_FIELD_NUMBER: _ClassVar[int]
    FAILURE_FIELD_NUMBER: _ClassVar[int]
    progress: Progress
    finished: Finished
    failure: Failure
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., finished: _Optional[_Union[Finished, _Mapping]] = ..., failure: _Optional[_Union[Failure, _Mapping]] = ...) -> None: ...

class Progress(_message.Message):
    __slots__ = ("time",)
    TIME_FIELD_NUMBER: _ClassVar[int]
    time: float
    def __init__(self, time: _Optional[float] = ...) -> None: ...

class Finished(_message.Message):
    __slots__ = ("outputs", "state")
    OUTPUTS_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    outputs: bytes
    state: bytes
    def __init__(self, outputs: _Optional[bytes] = ..., state: _Optional[bytes] = ...) -> None: ...

class Failure(_message.Message):
    __slots__ = ("kind", "text", "time")
    class Kind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        SOLVER: _ClassVar[Failure.Kind]
        NOT_FINITE: _ClassVar[Failure.Kind]
        BAD_REQUEST: _ClassVar[Failure.Kind]
        OUTSIDE_DOMAIN: _ClassVar[Failure.Kind]
        UNAVAILABLE: _ClassVar[Failure.Kind]
    SOLVER: Failure.Kind
    NOT_FINITE: Failure.Kind
    BAD_REQUEST: Failure.Kind
    OUTSIDE_DOMAIN: Failure.Kind
    UNAVAILABLE: Failure.Kind
    KIND_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    TIME_FIELD_NUMBER: _ClassVar[int]
    kind: Failure.Kind
    text: str
    time: float
    def __init__(self, kind: _Optional[_Union[Failure.Kind, str]] = ..., text: _Optional[str] = ..., time: _Optional[float] = ...) -> None: ...
