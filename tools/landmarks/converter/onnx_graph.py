"""ONNX graphs from TFLite operators: channels first, padding and activations in the convolutions' terms."""

import numpy as np
import tflite
from onnx import TensorProto, helper, numpy_helper

from .tflite_graph import Operator, TfliteGraph

# Version of ONNX' operators; Resize with half pixels is there from 11 on.
OPSET = 13


class OnnxGraph:
    """Nodes and weights of one or several converted graphs, which share nothing but the file."""

    def __init__(self):
        self.inputs, self.outputs, self.nodes, self.weights = [], [], [], []

    def add(self, prefix: str, source: TfliteGraph, outputs: dict[str, int]):
        """Converts what `outputs`, a name for each kept output's place, depends on; the input is `prefix.image`."""
        _Conversion(self, prefix, source).run(outputs)

    def model(self, properties: dict[str, str]):
        """The file's content, with texts about it."""
        graph = helper.make_graph(self.nodes, "landmarks", self.inputs, self.outputs, self.weights)
        opset = helper.make_opsetid("", OPSET)
        # The version of the container that ONNX gives to operators of this age.
        model = helper.make_model(graph, opset_imports=[opset], ir_version=7, producer_name="tools/landmarks")
        helper.set_model_props(model, properties)
        return model


class _Conversion:
    """State of one graph's conversion."""

    def __init__(self, out: OnnxGraph, prefix: str, source: TfliteGraph):
        self.out, self.prefix, self.source = out, prefix, source
        self.names: dict[int, str] = {}
        # Padded tensors that are not computed: the tensor before, rows and columns of padding.
        self.padded: dict[int, tuple[int, list[int]]] = {}
        # Enlarged tensors that are not computed: the tensor before, rows and columns.
        self.enlarged: dict[int, tuple[int, list[int]]] = {}

    def run(self, outputs: dict[str, int]):
        [image] = self.source.inputs
        self.names[image] = f"{self.prefix}.image"
        self.out.inputs.append(self._value(self.names[image], _channels_first(self.source.shape(image))))
        tensors = {name: self.source.outputs[place] for name, place in outputs.items()}
        self.names |= {tensor: f"{self.prefix}.{name}" for name, tensor in tensors.items()}
        for operator in self.source.needed(list(tensors.values())):
            convert = getattr(self, f"_{operator.kind.lower()}", None)
            if convert is None:
                raise SystemExit(f"{self.prefix}: the operator {operator.kind} has no conversion")
            convert(operator)
        for tensor in tensors.values():
            self.out.outputs.append(self._value(self.names[tensor], self.source.shape(tensor)))

    # Operators.

    def _pad(self, operator: Operator):
        pads = self.source.constant(operator.inputs[1])
        if pads[0].any() or pads[3].any():
            raise SystemExit(f"{self.prefix}: padding of channels {pads.tolist()}")
        self.padded[operator.outputs[0]] = (operator.inputs[0], pads[1:3].T.ravel().tolist())

    def _conv_2d(self, operator: Operator):
        weights = self.source.constant(operator.inputs[1]).transpose(0, 3, 1, 2)
        self._convolution(operator, operator.options(tflite.Conv2DOptions), weights, 1)

    def _depthwise_conv_2d(self, operator: Operator):
        weights = self.source.constant(operator.inputs[1]).transpose(3, 0, 1, 2)
        options = operator.options(tflite.DepthwiseConv2DOptions)
        self._convolution(operator, options, weights, weights.shape[0] // options.DepthMultiplier())

    def _convolution(self, operator: Operator, options, weights: np.ndarray, groups: int):
        size, strides = weights.shape[2:], [options.StrideH(), options.StrideW()]
        dilations = [options.DilationHFactor(), options.DilationWFactor()]
        source, pads = self._window(operator, options, size, strides)
        source, enlarged = self.enlarged.get(source, (source, None))
        if enlarged and (size != (1, 1) or strides != [1, 1]):
            raise SystemExit(f"{self.prefix}: only convolutions of single pixels of an enlarged tensor are converted")
        inputs = [self.names[source], self._weight(operator, 1, weights)]
        inputs.append(self._weight(operator, 2, self.source.constant(operator.inputs[2])))
        self._activated(operator, options, "Conv", inputs, enlarged, kernel_shape=size, strides=strides, pads=pads,
                        dilations=dilations, group=groups)

    def _max_pool_2d(self, operator: Operator):
        options = operator.options(tflite.Pool2DOptions)
        size = (options.FilterHeight(), options.FilterWidth())
        strides = [options.StrideH(), options.StrideW()]
        source, pads = self._window(operator, options, size, strides)
        self._activated(operator, options, "MaxPool", [self.names[source]], kernel_shape=size, strides=strides,
                        pads=pads)

    def _add(self, operator: Operator):
        inputs = [self.names[i] for i in operator.inputs]
        self._activated(operator, operator.options(tflite.AddOptions), "Add", inputs)

    def _logistic(self, operator: Operator):
        self._node("Sigmoid", [self.names[operator.inputs[0]]], self._name(operator))

    def _depth_to_space(self, operator: Operator):
        block = operator.options(tflite.DepthToSpaceOptions).BlockSize()
        source = self.names[operator.inputs[0]]
        self._node("DepthToSpace", [source], self._name(operator), blocksize=block, mode="DCR")

    def _resize_bilinear(self, operator: Operator):
        options = operator.options(tflite.ResizeBilinearOptions)
        if options.AlignCorners() or not options.HalfPixelCenters():
            raise SystemExit(f"{self.prefix}: only resizing by half pixel centres is converted")
        [enlarged] = operator.outputs
        self.enlarged[enlarged] = (operator.inputs[0], self.source.shape(enlarged)[1:3])

    def _reshape(self, operator: Operator):
        source, name = operator.inputs[0], self._name(operator)
        last = f"{name}.channels_last"
        self._node("Transpose", [self.names[source]], last, perm=[0, 2, 3, 1])
        # Of 1×1 pixels too, whose order is the same: running it takes nothing.
        shape = np.array(self.source.shape(operator.outputs[0]), np.int64)
        self._node("Reshape", [last, self._weight(operator, 1, shape)], name)

    def _concatenation(self, operator: Operator):
        options = operator.options(tflite.ConcatenationOptions)
        self._node("Concat", [self.names[i] for i in operator.inputs], self._name(operator), axis=options.Axis())

    # Parts of them.

    def _window(self, operator: Operator, options, size, strides) -> tuple[int, list[int]]:
        """Tensor that a sliding window reads, and its padding: above, left, below, right."""
        source = operator.inputs[0]
        before, explicit = self.padded.get(source, (source, [0, 0, 0, 0]))
        if options.Padding() == tflite.Padding.VALID:
            return before, explicit
        # TensorFlow's SAME: as many outputs as strides fit, the odd pixel below and at the right.
        rows, columns = self.source.shape(source)[1:3]
        totals = [max((-(-n // s) - 1) * s + k - n, 0) for n, k, s in zip((rows, columns), size, strides)]
        same = [t // 2 for t in totals] + [t - t // 2 for t in totals]
        return before, [a + b for a, b in zip(explicit, same)]

    def _activated(self, operator: Operator, options, kind: str, inputs: list[str], enlarged=None, **attributes):
        """Node with its activation. A mean of pixels may come after a weighted sum of channels: that enlarges fewer."""
        activation, name = options.FusedActivationFunction(), self._name(operator)
        is_linear = activation == tflite.ActivationFunctionType.NONE
        linear = name if is_linear else f"{name}.linear"
        small = f"{name}.small" if enlarged else linear
        self._node(kind, inputs, small, **attributes)
        if enlarged:
            sizes = np.array([1, self.source.shape(operator.outputs[0])[3], *enlarged], np.int64)
            self._node("Resize", [small, "", "", self._weight(operator, 3, sizes)], linear, mode="linear",
                       coordinate_transformation_mode="half_pixel")
        if activation == tflite.ActivationFunctionType.RELU:
            self._node("Relu", [linear], name)
        elif activation == tflite.ActivationFunctionType.RELU6:
            bounds = [self._shared("zero", 0.0), self._shared("six", 6.0)]
            self._node("Clip", [linear, *bounds], name)
        elif not is_linear:
            raise SystemExit(f"{self.prefix}: the activation {activation} has no conversion")

    def _name(self, operator: Operator) -> str:
        [out] = operator.outputs
        return self.names.setdefault(out, f"{self.prefix}.{out}")

    def _node(self, kind: str, inputs: list[str], output: str, **attributes):
        self.out.nodes.append(helper.make_node(kind, inputs, [output], output, **attributes))

    def _weight(self, operator: Operator, place: int, values: np.ndarray) -> str:
        name = f"{self._name(operator)}.{place}"
        self.out.weights.append(numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    def _shared(self, name: str, value: float) -> str:
        if all(weight.name != name for weight in self.out.weights):
            self.out.weights.append(numpy_helper.from_array(np.array(value, np.float32), name))
        return name

    def _value(self, name: str, shape: list[int]):
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)


def _channels_first(shape: list[int]) -> list[int]:
    rows, columns, channels = shape[1:]
    return [shape[0], channels, rows, columns]
