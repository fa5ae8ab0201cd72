"""Products of small matrices in vector registers, with the same sums on every processor.

A linear algebra library picks its code, and with it the order of its sums, by the processor; the
rounding errors that differ grow until two learners of one seed have little in common. Here every
sum runs in one fixed order and every multiplication and addition is fused (rounded once), however
wide the registers are. For matrices as small as a learner's that is also faster.
"""

# llvmlite has no types, Numba few.
# pyright: basic

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic, models, register_model

from qbumpers.compilation import compiled, compiled_apart, compiles
from qbumpers.networks import interpreted

WIDE, NARROW, SCALAR = 32, 4, 1
"""How many numbers are worked on together, if so many are left."""

_ROWS = 8  # of a tile; its 8 times 32 sums fill the registers of a processor with AVX-512


class Vector(types.Type):
    """Numba's type of `width` floats that are worked on together.

    Args:
        number: Numba's type of each.
        width: how many.
    """

    def __init__(self, number: Any, width: int) -> None:
        self.number, self.width = number, width
        super().__init__(f"Vector({number}, {width})")

    @property
    def key(self) -> tuple[Any, int]:
        """What tells one such type from another."""
        return self.number, self.width


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, vector: Vector) -> None:
        number = manager.lookup(vector.number).get_value_type()
        super().__init__(manager, vector, ir.VectorType(number, vector.width))


def _instructions(build: Callable[..., Any]) -> Callable[..., Any]:
    """A function whose calls become a few instructions, built from the types of its arguments."""
    if not compiles():
        return getattr(interpreted, build.__name__)
    return intrinsic(prefer_literal=True)(build)


@_instructions
def zeros(typing: Any, numbers: Any, width: Any) -> Any:
    """So many zeros of an array's kind of number: `zeros(array, 4)`."""
    vector = Vector(numbers.dtype, width.literal_value)

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The zeros as a constant of LLVM."""
        return ir.Constant(context.get_value_type(vector), None)

    return vector(numbers, width), build


@_instructions
def load(typing: Any, numbers: Any, at: Any, like: Any) -> Any:
    """Numbers of a contiguous array from a place on, as many as `like` has."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """One load of all the numbers."""
        pointer = _pointer(context, builder, numbers, arguments, like)
        return builder.load(pointer, align=numbers.dtype.bitwidth // 8)

    return like(numbers, types.intp, like), build


@_instructions
def store(typing: Any, numbers: Any, at: Any, vector: Any) -> Any:
    """Write a vector into a contiguous array from a place on."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """One store of all the numbers."""
        pointer = _pointer(context, builder, numbers, arguments, vector)
        builder.store(arguments[2], pointer, align=numbers.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(numbers, types.intp, vector), build


def _pointer(context: Any, builder: Any, kind: Any, arguments: Any, vector: Any) -> Any:
    data = context.make_array(kind)(context, builder, arguments[0]).data
    place = builder.gep(data, [arguments[1]])
    return builder.bitcast(place, context.get_value_type(vector).as_pointer())


@_instructions
def multiply_add(typing: Any, factor: Any, other: Any, total: Any) -> Any:
    """`factor` times `other` plus `total`, rounded once; each a number or a vector like `total`."""
    number = total.number if isinstance(total, Vector) else total

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """One fused multiply-add of all lanes; a plain number stands in each of them."""
        kind = arguments[2].type
        splats = [_splat(builder, value, kind) for value in arguments]
        suffix = f"f{number.bitwidth}"
        if isinstance(total, Vector):
            suffix = f"v{total.width}{suffix}"
        fused = get_or_insert_function(
            builder.module, ir.FunctionType(kind, [kind] * 3), f"llvm.fma.{suffix}"
        )
        return builder.call(fused, splats)

    def suited(given: Any) -> Any:
        """The type of an argument: a vector stays, any number becomes one like `total`'s."""
        return given if isinstance(given, Vector) else number

    return total(suited(factor), suited(other), total), build


def _splat(builder: Any, value: Any, kind: Any) -> Any:
    """A number in every lane of a vector; a value that has the kind already is left as it is."""
    if value.type == kind:
        return value
    nothing = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(
        first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), kind.count), None)
    )


@compiled_apart
def multiply(left: np.ndarray, transpose: bool, right: np.ndarray, out: np.ndarray) -> None:
    """Product of two contiguous matrices of equal kind, each of its sums in ascending order.

    Args:
        left: float [rows, depth], or [depth, rows] if `transpose`.
        transpose: whether the left matrix is taken transposed.
        right: float [depth, columns].
        out: float [rows, columns], overwritten.
    """
    columns, column = right.shape[1], 0
    while column + WIDE <= columns:
        _panel(left, transpose, right, out, column, zeros(right, WIDE))
        column += WIDE
    while column + NARROW <= columns:
        _panel(left, transpose, right, out, column, zeros(right, NARROW))
        column += NARROW
    while column < columns:
        _panel(left, transpose, right, out, column, zeros(right, SCALAR))
        column += SCALAR


@compiled
def _panel(
    left: np.ndarray, transpose: bool, right: np.ndarray, out: np.ndarray, column: int, zero: Any
) -> None:
    """As many columns of a product as `zero` has lanes, from `column` on."""
    depth, columns = right.shape
    rows, row, one = out.shape[0], 0, right.dtype.type(0)
    down, along = (1, rows) if transpose else (depth, 1)
    while row + _ROWS <= rows:
        a = b = c = d = e = f = g = h = zero
        for k in range(depth):
            vector = load(right, k * columns + column, zero)
            at = row * down + k * along
            a = multiply_add(load(left, at, one), vector, a)
            b = multiply_add(load(left, at + down, one), vector, b)
            c = multiply_add(load(left, at + 2 * down, one), vector, c)
            d = multiply_add(load(left, at + 3 * down, one), vector, d)
            e = multiply_add(load(left, at + 4 * down, one), vector, e)
            f = multiply_add(load(left, at + 5 * down, one), vector, f)
            g = multiply_add(load(left, at + 6 * down, one), vector, g)
            h = multiply_add(load(left, at + 7 * down, one), vector, h)
        at = row * columns + column
        store(out, at, a)
        store(out, at + columns, b)
        store(out, at + 2 * columns, c)
        store(out, at + 3 * columns, d)
        store(out, at + 4 * columns, e)
        store(out, at + 5 * columns, f)
        store(out, at + 6 * columns, g)
        store(out, at + 7 * columns, h)
        row += _ROWS
    while row < rows:
        total = zero
        for k in range(depth):
            vector = load(right, k * columns + column, zero)
            total = multiply_add(load(left, row * down + k * along, one), vector, total)
        store(out, row * columns + column, total)
        row += 1


@compiled_apart
def column_sums(numbers: np.ndarray, out: np.ndarray) -> None:
    """Sum of each column of a contiguous matrix, its rows in ascending order.

    Args:
        numbers: float [rows, columns].
        out: float [columns], overwritten.
    """
    columns, column = numbers.shape[1], 0
    while column + WIDE <= columns:
        _sums_of_panel(numbers, out, column, zeros(numbers, WIDE))
        column += WIDE
    while column < columns:
        _sums_of_panel(numbers, out, column, zeros(numbers, SCALAR))
        column += SCALAR


@compiled
def _sums_of_panel(numbers: np.ndarray, out: np.ndarray, column: int, total: Any) -> None:
    """As many sums of columns as `total` has lanes, from `column` on."""
    rows, columns = numbers.shape
    one = numbers.dtype.type(1)
    for row in range(rows):
        total = multiply_add(one, load(numbers, row * columns + column, total), total)
    store(out, column, total)


@compiled_apart
def transposed(numbers: np.ndarray) -> np.ndarray:
    """A matrix [N, M] as a contiguous one [M, N]."""
    rows, columns = numbers.shape
    turned = np.empty((columns, rows), numbers.dtype)
    for column in range(columns):
        for row in range(rows):
            turned[column, row] = numbers[row, column]
    return turned


@compiled_apart
def sum_of_squares(numbers: np.ndarray) -> float:
    """Sum of the squares of an array [N], `WIDE` interleaved sums and then those in turn."""
    totals, place = zeros(numbers, WIDE), 0
    while place + WIDE <= len(numbers):
        vector = load(numbers, place, totals)
        totals = multiply_add(vector, vector, totals)
        place += WIDE
    each = np.empty(WIDE, numbers.dtype)
    store(each, 0, totals)
    total = numbers.dtype.type(0)
    for i in range(WIDE):
        total += each[i]
    for i in range(place, len(numbers)):
        total += numbers[i] * numbers[i]
    return total
