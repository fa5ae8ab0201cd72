"""One layer of a network in compiled code: its sums, its activation, and the way back.

A batch of N states is a matrix with a row per state. Weights are [inputs, outputs], in a flat array
of parameters that begins with them at `offset` and goes on with the biases [outputs].
"""

import numpy as np

from qbumpers.compilation import compiled, compiled_apart
from qbumpers.networks.simd import column_sums, multiply, multiply_add, transposed


@compiled
def matrix(numbers: np.ndarray, first: int, rows: int, columns: int) -> np.ndarray:
    """The view [rows, columns] of a flat array that begins at `first`."""
    return numbers[first : first + rows * columns].reshape(rows, columns)


@compiled_apart
def weighted_sums(
    parameters: np.ndarray, offset: int, below: np.ndarray, above: np.ndarray
) -> np.ndarray:
    """Weights times the units below, into `above` [N, outputs]; returns the biases, to be added."""
    inputs, outputs = below.shape[1], above.shape[1]
    end = offset + outputs * inputs
    weights = matrix(parameters, offset, inputs, outputs)
    multiply(below, False, weights, above)
    return parameters[end : end + outputs]


@compiled
def add_biases(sums: np.ndarray, bias: np.ndarray) -> None:
    """Add biases [outputs] to sums [N, outputs], in offset."""
    for n in range(sums.shape[0]):
        for i in range(sums.shape[1]):
            sums[n, i] += bias[i]


@compiled_apart
def activate(units: np.ndarray, bias: np.ndarray, relu: bool) -> None:
    """Add biases to sums [N, units] and apply the activation, in offset."""
    kind = units.dtype.type
    if relu:
        for n in range(units.shape[0]):
            for i in range(units.shape[1]):
                total = units[n, i] + bias[i]
                units[n, i] = total if total > kind(0) else kind(0)
        return
    # tanh as a rational function, to 1.2e-8 and rounding: it runs in vector registers.
    limit, one = kind(8.5), kind(1)
    p0, p1, p2, p3, p4 = (
        kind(0.999999988209),
        kind(0.134132367476),
        kind(0.00353401451464),
        kind(2.12508293174e-05),
        kind(1.42689019343e-08),
    )
    q1, q2, q3, q4 = (
        kind(0.467465594881),
        kind(0.0260227050596),
        kind(0.000334884413341),
        kind(8.1449963106e-07),
    )
    for n in range(units.shape[0]):
        for i in range(units.shape[1]):
            x = units[n, i] + bias[i]
            x = limit if x > limit else x
            x = -limit if x < -limit else x
            z = x * x
            above = multiply_add(z, multiply_add(z, multiply_add(z, p4, p3), p2), p1)
            under = multiply_add(z, multiply_add(z, multiply_add(z, q4, q3), q2), q1)
            y = x * multiply_add(z, above, p0) / multiply_add(z, under, one)
            y = one if y > one else y
            units[n, i] = -one if y < -one else y


@compiled_apart
def activation_gradient(deltas: np.ndarray, units: np.ndarray, relu: bool) -> None:
    """Multiply deltas [N, units] by the derivative of the activation at its results `units`."""
    kind = units.dtype.type
    for n in range(units.shape[0]):
        for i in range(units.shape[1]):
            y = units[n, i]
            if relu:
                deltas[n, i] = deltas[n, i] if y > kind(0) else kind(0)
            else:
                deltas[n, i] *= multiply_add(-y, y, kind(1))


@compiled_apart
def gradient_of_layer(
    gradient: np.ndarray, offset: int, below: np.ndarray, deltas: np.ndarray
) -> None:
    """Write the gradient of a layer from the units below it and the deltas above it."""
    inputs, outputs = below.shape[1], deltas.shape[1]
    end = offset + outputs * inputs
    multiply(below, True, deltas, matrix(gradient, offset, inputs, outputs))
    column_sums(deltas, gradient[end : end + outputs])


@compiled_apart
def backpropagate(
    parameters: np.ndarray, offset: int, deltas: np.ndarray, units: np.ndarray, relu: bool,
    below: np.ndarray,
) -> None:  # fmt: skip
    """Deltas of the layer below, into `below` [N, inputs]; `units` are that layer's results."""
    weights = matrix(parameters, offset, units.shape[1], deltas.shape[1])
    multiply(deltas, False, transposed(weights), below)
    activation_gradient(below, units, relu)
