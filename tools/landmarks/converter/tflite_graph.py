"""A TFLite graph as operators and constants, with stored weights decoded.

Weights are stored as float16 behind DEQUANTIZE, in part sparse behind DENSIFY; both are folded into constants.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import tflite

from .sparse import densify

_TYPES = {
    tflite.TensorType.FLOAT32: np.dtype("<f4"),
    tflite.TensorType.FLOAT16: np.dtype("<f2"),
    tflite.TensorType.INT32: np.dtype("<i4"),
}
_KINDS = {code: name for name, code in vars(tflite.BuiltinOperator).items() if isinstance(code, int)}
# Operators whose result is a constant when their input is one.
_DECODERS = ("DEQUANTIZE", "DENSIFY")


@dataclass(frozen=True)
class Operator:
    """One operator: its kind, and the indices of its tensors."""

    kind: str
    inputs: list[int]
    outputs: list[int]
    table: object

    def options(self, schema):
        """Options, read as the class `schema` of the `tflite` package."""
        options = schema()
        options.Init(self.table.Bytes, self.table.Pos)
        return options


class TfliteGraph:
    """First subgraph of a TFLite file."""

    def __init__(self, data: bytes):
        self._model = tflite.Model.GetRootAs(data, 0)
        self._graph = self._model.Subgraphs(0)
        self.inputs = self._graph.InputsAsNumpy().tolist()
        self.outputs = self._graph.OutputsAsNumpy().tolist()

    @cached_property
    def operators(self) -> list[Operator]:
        """Operators in order of execution."""
        return [self._operator(i) for i in range(self._graph.OperatorsLength())]

    @cached_property
    def producers(self) -> dict[int, Operator]:
        """Operator that computes each tensor."""
        return {out: operator for operator in self.operators for out in operator.outputs}

    def shape(self, tensor: int) -> list[int]:
        """Sizes of a tensor, channels last."""
        return self._graph.Tensors(tensor).ShapeAsNumpy().tolist()

    def constant(self, tensor: int) -> np.ndarray | None:
        """Values of a stored tensor, as float32 or int32; `None` for a computed one."""
        producer = self.producers.get(tensor)
        if producer is None:
            stored = self._stored(tensor)
        elif producer.kind in _DECODERS:
            stored = self.constant(producer.inputs[0])
        else:
            return None
        is_half = stored is not None and stored.dtype == np.float16
        return stored.astype(np.float32) if is_half else stored

    def needed(self, outputs: list[int]) -> list[Operator]:
        """Operators that the tensors `outputs` depend on, in order, without those folded into constants."""
        wanted, needed = set(outputs), []
        for operator in reversed(self.operators):
            if operator.kind not in _DECODERS and wanted.intersection(operator.outputs):
                wanted.update(operator.inputs)
                needed.append(operator)
        return needed[::-1]

    def _operator(self, index: int) -> Operator:
        operator = self._graph.Operators(index)
        code = self._model.OperatorCodes(operator.OpcodeIndex())
        # Old files have the code in one byte, new ones in four.
        kind = _KINDS[max(code.BuiltinCode(), code.DeprecatedBuiltinCode())]
        inputs, outputs = operator.InputsAsNumpy().tolist(), operator.OutputsAsNumpy().tolist()
        return Operator(kind, inputs, outputs, operator.BuiltinOptions())

    def _stored(self, tensor: int) -> np.ndarray | None:
        described = self._graph.Tensors(tensor)
        buffer = self._model.Buffers(described.Buffer())
        if not buffer.DataLength():
            return None
        if described.Type() not in _TYPES:
            raise SystemExit(f"tensor {tensor}: type {described.Type()} is not float32, float16 or int32")
        values = np.frombuffer(buffer.DataAsNumpy().tobytes(), _TYPES[described.Type()])
        sparsity = described.Sparsity()
        if sparsity is not None:
            return densify(values, self.shape(tensor), sparsity)
        return values.reshape(self.shape(tensor))
