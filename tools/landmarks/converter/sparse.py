"""Sparse tensors of TFLite files, after the schema's `SparsityParameters`.

Dimensions are stored in traversal order, each dense or as compressed rows (TACO's format); trailing ones may be blocks.
"""

import numpy as np
import tflite

_INDEX_VECTORS = {
    tflite.SparseIndexVector.Int32Vector: (tflite.Int32Vector, "<i4"),
    tflite.SparseIndexVector.Uint16Vector: (tflite.Uint16Vector, "<u2"),
    tflite.SparseIndexVector.Uint8Vector: (tflite.Uint8Vector, "u1"),
}


def densify(values: np.ndarray, shape: list[int], sparsity) -> np.ndarray:
    """Dense tensor of `shape` from the stored `values`; what is not stored is 0."""
    order = sparsity.TraversalOrderAsNumpy().tolist()
    blocks = sparsity.BlockMapAsNumpy()
    blocks = blocks.tolist() if isinstance(blocks, np.ndarray) else []
    levels = [sparsity.DimMetadata(k) for k in range(sparsity.DimMetadataLength())]

    # One column of coordinates a level, one row a stored value.
    coordinates, parents = [], np.zeros(1, np.int64)
    for level in levels:
        rows, column = _children(level, len(parents))
        coordinates = [c[rows] for c in coordinates] + [column]
        parents = column
    if len(parents) != len(values):
        raise SystemExit(f"sparse tensor {shape}: {len(values)} values for {len(parents)} places")

    place = [np.zeros(len(values), np.int64) for _ in shape]
    for level, dimension in enumerate(order[: len(shape)]):
        place[dimension] = coordinates[level]
    for k, dimension in enumerate(blocks):
        level = len(shape) + k
        size = levels[level].DenseSize()
        place[dimension] = place[dimension] * size + coordinates[level]
    dense = np.zeros(shape, values.dtype)
    dense[tuple(place)] = values
    return dense


def _children(level, parents: int) -> tuple[np.ndarray, np.ndarray]:
    """Parent's row and own coordinate of each entry of a level."""
    if level.Format() == tflite.DimensionType.DENSE:
        size = level.DenseSize()
        return np.repeat(np.arange(parents), size), np.tile(np.arange(size), parents)
    segments = _indices(level.ArraySegments(), level.ArraySegmentsType())
    column = _indices(level.ArrayIndices(), level.ArrayIndicesType())
    return np.repeat(np.arange(parents), np.diff(segments)), column


def _indices(table, kind: int) -> np.ndarray:
    schema, _ = _INDEX_VECTORS[kind]
    vector = schema()
    vector.Init(table.Bytes, table.Pos)
    return vector.ValuesAsNumpy().astype(np.int64)
