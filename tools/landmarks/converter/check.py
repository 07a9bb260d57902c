"""Converted graphs against LiteRT, which runs the TFLite files themselves."""

import json
from pathlib import Path

import numpy as np
from ai_edge_litert.interpreter import Interpreter
from onnx.reference import ReferenceEvaluator

from .inputs import SOURCES

# Largest difference allowed, of the largest magnitude: float32 sums in another order reach 2e-5.
MOST = 1e-4
# Values of each output that the file of expectations holds.
KEPT = 600


def test_image(shape: list[int], low: float) -> np.ndarray:
    """Image of `shape`, channels first, `low` to 1, with gradients and edges in every channel."""
    channel, row, column = np.indices(shape[1:])
    pattern = (7 * channel + 13 * row + 29 * column + row * column // 16) % 256
    return (low + (1.0 - low) * pattern / 255.0).astype(np.float32)[None]


def images(shape: list[int], low: float) -> list[np.ndarray]:
    """The test image, one colour, and noise."""
    noise = np.random.default_rng(1).uniform(low, 1.0, shape).astype(np.float32)
    return [test_image(shape, low), np.full(shape, 0.5, np.float32), noise]


def lite_rt(data: bytes, image: np.ndarray, places: list[int]) -> list[np.ndarray]:
    """Outputs of a TFLite file at `places`."""
    interpreter = Interpreter(model_content=data, num_threads=1)
    interpreter.allocate_tensors()
    interpreter.set_tensor(interpreter.get_input_details()[0]["index"], image.transpose(0, 2, 3, 1))
    interpreter.invoke()
    outputs = interpreter.get_output_details()
    return [interpreter.get_tensor(outputs[place]["index"]).copy() for place in places]


def check(model, data: dict[str, bytes], expected: Path | None):
    """Compares all outputs, says the differences, and writes what LiteRT gives for the test image to `expected`."""
    evaluator, worst, kept = ReferenceEvaluator(model), 0.0, {}
    for prefix, source in SOURCES.items():
        [shape] = [[d.dim_value for d in i.type.tensor_type.shape.dim] for i in model.graph.input
                   if i.name == f"{prefix}.image"]
        names = [f"{prefix}.{name}" for name in source.outputs]
        # The other graph of the file wants an input too.
        others = {i.name: np.zeros([d.dim_value for d in i.type.tensor_type.shape.dim], np.float32)
                  for i in model.graph.input}
        for n, image in enumerate(images(shape, -1.0 if prefix == "detector" else 0.0)):
            truth = lite_rt(data[prefix], image, list(source.outputs.values()))
            found = evaluator.run(names, others | {f"{prefix}.image": image})
            for name, a, b in zip(names, found, truth):
                difference, size = float(abs(a - b).max()), max(float(abs(b).max()), 1.0)
                print(f"image {n} {name:20} largest difference {difference:.2e} of {size:.3g}")
                worst = max(worst, difference / size)
                if n == 0:
                    step = -(-b.size // KEPT)
                    kept[name] = {"step": step, "values": [float(f"{v:.7g}") for v in b.ravel()[::step]]}
    if worst > MOST:
        raise SystemExit(f"the converted file differs from LiteRT by {worst:.2e} of the largest value (at most {MOST})")
    if expected is not None:
        expected.write_text(json.dumps(kept) + "\n")
