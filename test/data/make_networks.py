#!/usr/bin/env python3
"""Writes the networks bright_cells_*.onnx beside this file; needs Debian's python3-onnx (1.12).

Their answer is known. The input of 64x64 px is cut into 8x8 cells; each is one candidate whose box is 10 px wide and 6 high, 1 px right of and 2 below the
cell's middle, and again, 1 px farther right and by a tenth less sure. Class 0 is how bright the cell is on average, 0 to 1, class 1 how dark.
  v8        output 1 x 6 x 128, as of YOLOv8: boxes in cells, times the cell's pixels for each candidate at last, a constant of 1 x 128
  shares    the same without that factor, boxes of 1/64 of these pixels
  v5        output 1 x 128 x 7, as of YOLOv5, objectness 0.8
  pictures  output 1 x 1 x 8 x 8, as of no detector
"""
import pathlib

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

CELLS = 8
CELL_PX = 8


def constant(name, values):
    return numpy_helper.from_array(np.asarray(values, np.float32), name)


def network(kind):
    centre = CELL_PX * (np.arange(CELLS) + 0.5)
    v, u = (grid.ravel() for grid in np.meshgrid(centre, centre, indexing="ij"))
    ones = np.ones_like(u)
    first = np.stack([u + 1, v + 2, 10 * ones, 6 * ones])
    boxes = np.concatenate([first, first + np.array([[1], [0], [0], [0]])], axis=1)[None]
    # Brightness and darkness from the mean of each channel.
    weights = np.array([[1, 1, 1], [-1, -1, -1]]).reshape(2, 3, 1, 1) / 3
    nodes = [
        helper.make_node("AveragePool", ["image"], ["means"], kernel_shape=[CELL_PX] * 2, strides=[CELL_PX] * 2),
        helper.make_node("Conv", ["means", "weights", "bias"], ["cells"], kernel_shape=[1, 1]),
    ]
    tensors = [constant("weights", weights), constant("bias", [0, 1])]
    if kind == "pictures":
        nodes[1] = helper.make_node("Conv", ["means", "weights", "bias"], ["output"], kernel_shape=[1, 1])
        tensors = [constant("weights", weights[:1]), constant("bias", [0])]
        shape = [1, 1, CELLS, CELLS]
    else:
        tensors += [numpy_helper.from_array(np.array([1, 2, CELLS**2], np.int64), "flat"), constant("less", [0.9]), constant("boxes", boxes)]
        nodes += [
            helper.make_node("Reshape", ["cells", "flat"], ["scores"]),
            helper.make_node("Mul", ["scores", "less"], ["lower"]),
            helper.make_node("Concat", ["scores", "lower"], ["both"], axis=2),
        ]
        if kind in ("v8", "shares"):
            # Boxes are no constants, or the product would be one.
            tensors[-1] = constant("boxes", boxes / (CELL_PX if kind == "v8" else CELL_PX * CELLS))
            tensors += [constant("nothing", [0]), constant("strides", np.full([1, 2 * CELLS**2], CELL_PX))]
            nodes += [
                helper.make_node("Mul", ["both", "nothing"], ["zeros"]),
                helper.make_node("Concat", ["zeros", "zeros"], ["four_zeros"], axis=1),
                helper.make_node("Add", ["four_zeros", "boxes"], ["unscaled"]),
                helper.make_node("Mul", ["unscaled", "strides"], ["scaled"]),
                helper.make_node("Concat", ["scaled" if kind == "v8" else "unscaled", "both"], ["output"], axis=1),
            ]
            if kind == "shares":
                del nodes[-2], tensors[-1]
            shape = [1, 6, 2 * CELLS**2]
        else:
            tensors.append(constant("objectness", np.full([1, 1, 2 * CELLS**2], 0.8)))
            nodes += [
                helper.make_node("Concat", ["boxes", "objectness", "both"], ["values"], axis=1),
                helper.make_node("Transpose", ["values"], ["output"], perm=[0, 2, 1]),
            ]
            shape = [1, 2 * CELLS**2, 7]
    size = CELLS * CELL_PX
    graph = helper.make_graph(
        nodes, "bright_cells",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, size, size])],
        [helper.make_tensor_value_info("output", TensorProto.FLOAT, shape)], tensors)
    model = helper.make_model(graph, producer_name="alidade", opset_imports=[helper.make_opsetid("", 12)])
    model.ir_version = 7
    onnx.checker.check_model(model)
    return model


for kind in ("v8", "shares", "v5", "pictures"):
    onnx.save(network(kind), pathlib.Path(__file__).parent / f"bright_cells_{kind}.onnx")
