"""Arrays that cost nothing in a compiled loop.

Numba counts references to arrays, atomically, even if a loop only reads an element; and the
length of `table[state]` is known only at run time. Arrays borrowed here are not counted, and rows
have a length known to the compiler, which then unrolls every loop over actions. Together they make
the simulation several times as fast. Whoever borrows must hold the array until the loop is over.

What rules and learners are given to read is read-only, which in compiled code is a matter of types.
"""

import functools
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload
from numba.np import arrayobj

from qbumpers.compilation import INLINE


def borrow(arrays: Any) -> Any:
    """The same arrays, not reference-counted in compiled code.

    Args:
        arrays: an array, a NamedTuple or tuple of arrays and numbers, or None.

    Returns:
        The same, to be used only while the caller holds `arrays`.
    """
    return arrays


@overload(borrow, strict=False, jit_options=INLINE)
def _compiled_borrow(arrays: Any) -> Any:
    uncounted: Any = _uncounted
    return lambda arrays: uncounted(arrays)


@intrinsic
def _uncounted(typing_context: Any, arrays: Any) -> Any:
    def strip(context: Any, builder: Any, kind: Any, value: Any) -> Any:
        """A value with no array in it counted; `kind` is its type."""
        if isinstance(kind, types.Array):
            view: Any = arrayobj.make_array(kind)(context, builder, value)
            view.meminfo = cgutils.get_null_value(view.meminfo.type)
            return view._getvalue()
        if isinstance(kind, types.BaseTuple):
            parts: Any = kind
            for index, part in enumerate(parts):
                stripped = strip(context, builder, part, builder.extract_value(value, index))
                value = builder.insert_value(value, stripped, index)
        return value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: the same value, uncounted."""
        return strip(context, builder, arrays, arguments[0])

    return arrays(arrays), generate


def hold(arrays: Any) -> None:
    """Keep what was borrowed alive up to here: compiled code frees an array after its last use.

    Args:
        arrays: an array, or a NamedTuple or tuple of arrays and numbers.
    """


@overload(hold, strict=False, jit_options=INLINE)
def _compiled_hold(arrays: Any) -> Any:
    used: Any = _used
    return lambda arrays: used(arrays)


@intrinsic
def _used(typing_context: Any, arrays: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: nothing but a use of the argument."""
        return context.get_dummy_value()

    return types.none(arrays), generate


def read_only(arrays: Any) -> Any:
    """The same arrays, which whoever gets them cannot change.

    Args:
        arrays: an array; in Python also a NamedTuple or tuple of arrays and numbers, or None.

    Returns:
        Views of the arrays.
    """
    if isinstance(arrays, np.ndarray):
        view = arrays.view()
        view.flags.writeable = False
        return view
    if isinstance(arrays, tuple):
        parts: Any = map(read_only, arrays)
        make = getattr(arrays, "_make", tuple)
        return make(parts)
    return arrays


@overload(read_only, strict=False, jit_options=INLINE)
def _compiled_read_only(arrays: Any) -> Any:
    typed: Any = _typed_read_only
    return lambda arrays: typed(arrays)


@intrinsic
def _typed_read_only(typing_context: Any, arrays: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: the same array, counted once more."""
        if context.enable_nrt:
            context.nrt.incref(builder, arrays, arguments[0])
        return arguments[0]

    return arrays.copy(readonly=True)(arrays), generate


def row(table: np.ndarray, index: int, width: tuple[int, ...]) -> np.ndarray:
    """What a table has at an index, borrowed; it must not outlive the table.

    Args:
        table: float64 [S, A] or [S, K, A], C-contiguous.
        index: in [0, S); not checked, not wrapped.
        width: any tuple of A integers; its length tells the compiler A.

    Returns:
        The view [A] or [K, A].
    """
    return table[index]


@overload(row, strict=False, jit_options=INLINE)
def _compiled_row(table: Any, index: Any, width: Any) -> Any:
    borrowed: Any = _borrowed
    return lambda table, index, width: borrowed(table, index, width)


@intrinsic
def _borrowed(typing_context: Any, table: Any, index: Any, width: Any) -> Any:
    row_type = types.Array(table.dtype, table.ndim - 1, "C", readonly=not table.mutable)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: a view into the table."""
        source = arrayobj.make_array(table)(context, builder, arguments[0])
        integer = context.get_value_type(types.intp)
        size = integer(context.get_abi_sizeof(context.get_data_type(table.dtype)))
        inner = [builder.extract_value(source.shape, axis) for axis in range(1, table.ndim - 1)]
        shape, strides = [*inner, integer(width.count)], [size]
        for length in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], length))
        first = functools.reduce(builder.mul, shape, arguments[1])
        view: Any = arrayobj.make_array(row_type)(context, builder)
        arrayobj.populate_array(
            view,
            data=builder.gep(source.data, [first], inbounds=True),
            shape=cgutils.pack_array(builder, shape),
            strides=cgutils.pack_array(builder, strides),
            itemsize=size,
            meminfo=None,
        )
        return view._getvalue()

    return row_type(table, types.intp, width), generate


def scratch(shape: Any, value: Any) -> np.ndarray:
    """An array for the intermediate results of one step, of which nothing may be kept after it.

    On a graphics card nothing can be allocated: there it is a part of memory that each trial has,
    and uses again from step to step.

    Args:
        shape: a whole number, or a tuple of them.
        value: with which it is filled; its type, bool, int or float, is that of the array.
    """
    return np.full(shape, value)


@overload(scratch, strict=False, jit_options=INLINE)
def _compiled_scratch(shape: Any, value: Any) -> Any:
    return lambda shape, value: np.full(shape, value)


def clear_scratch() -> None:
    """Give up everything that `scratch` has given."""


@overload(clear_scratch, strict=False, jit_options=INLINE)
def _compiled_clear_scratch() -> Any:
    return lambda: None
