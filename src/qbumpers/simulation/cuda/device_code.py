"""What the compiler for cards needs beside the functions that processors run.

Nothing counts references on a card, and nothing can be allocated: what `qbumpers.borrowing` does on
a processor is done otherwise here. Importing this module registers it.
"""

import functools
from typing import Any

from llvmlite import ir
from numba import cuda as numba_cuda
from numba import types as numba_types
from numba.cuda import cgutils  # pyright: ignore[reportAttributeAccessIssue]
from numba.cuda.core import ir as ir_of_numba  # pyright: ignore[reportMissingImports]
from numba.cuda.core import ir_utils  # pyright: ignore[reportMissingImports]
from numba.cuda.extending import intrinsic, overload  # pyright: ignore[reportAttributeAccessIssue]
from numba.cuda.np import arrayobj  # pyright: ignore[reportMissingImports]

from qbumpers import borrowing
from qbumpers.assistants import dispatch
from qbumpers.simulation.cuda import layout
from qbumpers.simulation.cuda.layout import LANES, WORD, Far, Near

cuda: Any = numba_cuda
types: Any = numba_types

_SHARED_MEMORY = 3  # address space
_SETTINGS: dict[str, Any] = {"target": "cuda", "strict": False, "inline": "always"}

# Where a function is inlined, the compiler leaves out what is stored into an array of which it does
# not know that others see it, and it does not know that of rows. So all stores are kept.


def _keep_stores(statement: Any, *about: Any) -> None:
    """Note that others see what a statement stores; see `find_potential_aliases` of Numba."""
    *_, seen_by_others = about
    seen_by_others.add(statement.target.name)


for _kind in ir_of_numba.setitem_types:
    ir_utils.alias_analysis_extensions[_kind] = _keep_stores


@overload(borrowing.borrow, **_SETTINGS)
def _borrow(arrays: Any) -> Any:
    return lambda arrays: arrays


@overload(borrowing.hold, **_SETTINGS)
def _hold(arrays: Any) -> Any:
    return lambda arrays: None


@overload(borrowing.read_only, **_SETTINGS)
def _read_only(arrays: Any) -> Any:
    typed: Any = _typed_read_only
    return lambda arrays: typed(arrays)


@intrinsic
def _typed_read_only(typing_context: Any, arrays: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: the same array."""
        return arguments[0]

    return arrays.copy(readonly=True)(arrays), generate


@overload(borrowing.row, **_SETTINGS)
def _row(table: Any, index: Any, width: Any) -> Any:
    row: Any = _row_of
    return lambda table, index, width: row(table, index, width)


def _view(
    context: Any, builder: Any, kind: Any, data: Any, shape: list[Any], strides: list[Any]
) -> Any:
    """An array of a type that begins at an address."""
    view: Any = arrayobj.make_array(kind)(context, builder)
    integer = context.get_value_type(types.intp)
    arrayobj.populate_array(
        view,
        data=builder.bitcast(data, context.get_data_type(kind.dtype).as_pointer()),
        shape=cgutils.pack_array(builder, shape, ty=integer),
        strides=cgutils.pack_array(builder, strides, ty=integer),
        itemsize=integer(_bytes(context, kind.dtype)),
        meminfo=None,
    )
    return view._getvalue()


def _bytes(context: Any, dtype: Any) -> int:
    return context.get_abi_sizeof(context.get_data_type(dtype))


def _at(builder: Any, data: Any, offset: Any) -> Any:
    """The address so many bytes on."""
    byte = builder.bitcast(data, ir.IntType(8).as_pointer())
    return builder.gep(byte, [offset])


def _c_strides(builder: Any, shape: list[Any], size: int) -> list[Any]:
    """Strides of an array without gaps."""
    found = [ir.Constant(shape[-1].type, size)]
    for length in reversed(shape[1:]):
        found.insert(0, builder.mul(found[0], length))
    return found


@intrinsic
def _row_of(typing_context: Any, table: Any, index: Any, width: Any) -> Any:
    kind = types.Array(table.dtype, table.ndim - 1, table.layout, readonly=not table.mutable)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: a view into the table, its last length known to the compiler."""
        source = arrayobj.make_array(table)(context, builder, arguments[0])
        integer = context.get_value_type(types.intp)
        size = _bytes(context, table.dtype)
        inner = [builder.extract_value(source.shape, axis) for axis in range(1, table.ndim - 1)]
        shape = [*inner, integer(width.count)]
        if table.layout == "C":
            strides = _c_strides(builder, shape, size)
            step = functools.reduce(builder.mul, shape, integer(size))
        else:
            strides = [builder.extract_value(source.strides, axis) for axis in range(table.ndim)]
            step = strides.pop(0)
        data = _at(builder, source.data, builder.mul(arguments[1], step))
        return _view(context, builder, kind, data, shape, strides)

    return kind(table, types.intp, width), generate


@overload(layout.own_part, **_SETTINGS)
def _own_part(parts: Any, desk: Any, trial: Any) -> Any:
    own: Any = _own
    return lambda parts, desk, trial: own(parts, desk, trial)


def _is(kind: Any, part: type) -> bool:
    return isinstance(kind, types.BaseNamedTuple) and kind.instance_class is part


def _own_type(kind: Any) -> Any:
    """The type of what a trial has in the place of a part."""
    if not isinstance(kind, types.BaseTuple):
        return kind
    if _is(kind, Near):
        return types.Array(kind.types[0].dtype, kind.types[0].ndim, "C")
    if _is(kind, Far):
        return types.Array(kind.types[0].dtype, kind.types[0].ndim - 2, "A")
    made_of = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else tuple
    return types.BaseTuple.from_types([_own_type(part) for part in kind.types], made_of)


@intrinsic
def _own(typing_context: Any, parts: Any, desk: Any, trial: Any) -> Any:
    found = _own_type(parts)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: views in the place of `Near` and `Far`."""
        place = _Place(context, builder, desk, arguments[1], arguments[2])
        return place.part(parts, found, arguments[0])

    return found(parts, desk, types.intp), generate


class _Place:
    """Makes the code that finds what a trial has of its own."""

    def __init__(self, context: Any, builder: Any, desk: Any, space: Any, trial: Any) -> None:
        self.context, self.builder, self.trial = context, builder, trial
        self.desk = arrayobj.make_array(desk)(context, builder, space)

    def part(self, kind: Any, found: Any, value: Any) -> Any:
        """What is in the place of a part of type `kind`; `found` is its own type."""
        if _is(kind, Near):
            return self._near(kind, found, value)
        if _is(kind, Far):
            return self._far(kind, found, value)
        if isinstance(kind, types.BaseTuple) and len(kind) > 0:
            parts = [
                self.part(one, other, self.builder.extract_value(value, index))
                for index, (one, other) in enumerate(zip(kind.types, found.types, strict=True))
            ]
            return self.context.make_tuple(self.builder, found, parts)
        return value

    def _near(self, kind: Any, found: Any, value: Any) -> Any:
        builder, context = self.builder, self.context
        first = arrayobj.make_array(kind.types[0])(
            context, builder, builder.extract_value(value, 0)
        )
        size, integer = _bytes(context, found.dtype), context.get_value_type(types.intp)
        offset = builder.mul(builder.extract_value(value, 1), integer(WORD))
        data = builder.bitcast(_at(builder, self.desk.data, offset), first.data.type)
        with cgutils.for_range(builder, first.nitems) as loop:
            item = builder.load(builder.gep(first.data, [loop.index]))
            builder.store(item, builder.gep(data, [loop.index]))
        shape = cgutils.unpack_tuple(builder, first.shape, found.ndim)
        strides = _c_strides(builder, shape, size)
        return _view(context, builder, found, data, shape, strides)

    def _far(self, kind: Any, found: Any, value: Any) -> Any:
        builder, context = self.builder, self.context
        arrays = arrayobj.make_array(kind.types[0])(
            context, builder, builder.extract_value(value, 0)
        )
        size, integer = _bytes(context, found.dtype), context.get_value_type(types.intp)
        group = builder.udiv(self.trial, integer(LANES))
        lane = builder.urem(self.trial, integer(LANES))
        shape = cgutils.unpack_tuple(builder, arrays.shape, found.ndim + 2)[1:]
        axis = max(1, found.ndim - 1)
        shape[axis] = integer(LANES)
        strides = _c_strides(builder, shape, size)
        whole = builder.mul(strides[0], shape[0])
        offset = builder.add(builder.mul(group, whole), builder.mul(lane, strides[axis]))
        del shape[axis], strides[axis]
        data = _at(builder, arrays.data, offset)
        return _view(context, builder, found, data, shape, strides)


overload(dispatch.observe, **_SETTINGS)(dispatch.compiled_observe)
"""Inlined, as a function cannot return an array that it got from another one."""


# Every thread has the address of its space for intermediate results, and how many bytes of it are
# in use, at its place of the block's shared memory, where any function finds them.


_ADDRESS, _USED, _SIZE = range(3)
_WORDS = 3


@overload(layout.open_scratch, **_SETTINGS)
def _open_scratch(space: Any) -> Any:
    put: Any = _put
    address: Any = _address_of

    def opened(space: Any) -> None:
        place = _WORDS * cuda.threadIdx.x
        put(place + _ADDRESS, address(space))
        put(place + _USED, 0)
        put(place + _SIZE, space.size * space.itemsize)

    return opened


@overload(borrowing.clear_scratch, **_SETTINGS)
def _clear_scratch() -> Any:
    put: Any = _put
    return lambda: put(_WORDS * cuda.threadIdx.x + _USED, 0)


@overload(borrowing.scratch, **_SETTINGS)
def _scratch(shape: Any, value: Any) -> Any:
    put: Any = _put
    got: Any = _got
    taken: Any = _taken
    fill: Any = _fill

    def filled(shape: Any, value: Any) -> Any:
        place = _WORDS * cuda.threadIdx.x
        used = got(place + _USED)
        found = taken(shape, value, got(place + _ADDRESS) + used)
        used += (found.size * found.itemsize + WORD - 1) // WORD * WORD
        if used > got(place + _SIZE):
            raise MemoryError  # the processor does this trial
        put(place + _USED, used)
        fill(found, value)
        return found

    return filled


@intrinsic
def _fill(typing_context: Any, array: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: every number of an array without gaps becomes the value."""
        found = arrayobj.make_array(array)(context, builder, arguments[0])
        filling = context.cast(builder, arguments[1], value, array.dtype)
        filling = context.get_value_as_data(builder, array.dtype, filling)
        with cgutils.for_range(builder, found.nitems) as loop:
            builder.store(filling, builder.gep(found.data, [loop.index]))
        return context.get_dummy_value()

    return types.none(array, value), generate


# Shared memory by a name of its own: that of numba.cuda is another one in every function, and what
# is stored into an array that is not read again would be left out.


def _shared(builder: Any, place: Any) -> Any:
    """The address of a word of the block's shared memory, the same in every function."""
    name, words = "qbumpers_scratch", ir.ArrayType(ir.IntType(64), 0)
    found: Any = builder.module.globals.get(name)
    if found is None:
        found = ir.GlobalVariable(builder.module, words, name, _SHARED_MEMORY)
        found.linkage, found.align = "external", WORD
    first = builder.bitcast(found, ir.IntType(64).as_pointer(_SHARED_MEMORY))
    return builder.gep(first, [place])


@intrinsic
def _got(typing_context: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: a word of shared memory."""
        return builder.load(_shared(builder, arguments[0]))

    return types.int64(types.intp), generate


@intrinsic
def _put(typing_context: Any, place: Any, word: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: a word of shared memory is overwritten."""
        builder.store(arguments[1], _shared(builder, arguments[0]))
        return context.get_dummy_value()

    return types.none(types.intp, types.int64), generate


@intrinsic
def _address_of(typing_context: Any, space: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: where an array begins."""
        array = arrayobj.make_array(space)(context, builder, arguments[0])
        return builder.ptrtoint(array.data, ir.IntType(64))

    return types.int64(space), generate


@intrinsic
def _taken(typing_context: Any, shape: Any, value: Any, address: Any) -> Any:
    lengths = 1 if isinstance(shape, types.Integer) else len(shape)
    kind = types.Array(types.unliteral(value), lengths, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """The code of a call: an array that begins at an address."""
        numbered = isinstance(shape, types.Integer)
        given = [(shape, arguments[0])] if numbered else [
            (axis, builder.extract_value(arguments[0], place))
            for place, axis in enumerate(shape.types)
        ]  # fmt: skip
        sizes = [context.cast(builder, length, axis, types.intp) for axis, length in given]
        data = builder.inttoptr(arguments[2], ir.IntType(8).as_pointer())
        strides = _c_strides(builder, sizes, _bytes(context, kind.dtype))
        return _view(context, builder, kind, data, sizes, strides)

    return kind(shape, value, types.int64), generate
