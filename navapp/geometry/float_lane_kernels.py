"""Eight float32 numbers at once, inside compiled kernels.

Spelled out, because the compiler's own vectors stop at loops that read some arrays and write
others: it cannot know that they do not overlap. Lanes are added, subtracted, multiplied and divided
by + - * / among themselves. `stereo/matching/byte_lane_kernels.py` has whole numbers.

All but `lanes_for` is for compiled code only. Arrays are flat and C-contiguous; an index is not
checked.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable

# What all processors of interest hold in a register; a sum of several powers needs many registers.
LANES = 8
_INDEX = ir.IntType(32)
_VECTOR = ir.VectorType(ir.FloatType(), LANES)


def lanes_for(count: int) -> int:
    """The next multiple of `LANES`."""
    return -(-count // LANES) * LANES


class FloatLanes(types.Type):  # type: ignore[misc]
    """The compiled type of `LANES` float32 numbers."""

    def __init__(self) -> None:
        super().__init__(name="FloatLanes")


_LANES_TYPE = FloatLanes()


@register_model(FloatLanes)
class _FloatLanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, lanes: FloatLanes) -> None:
        super().__init__(manager, lanes, _VECTOR)


def _place(context: Any, builder: Any, array: tuple[Any, Any], index: Any) -> Any:
    """Pointer to the lanes that begin at an element."""
    array_type, value = array
    data = context.make_array(array_type)(context, builder, value).data
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


def _is_flat(array: Any) -> bool:
    return bool(array == types.Array(types.float32, 1, "C"))


@intrinsic
def load(_: Any, array: Any, __: Any) -> Any:
    """The lanes of an array that begin at an index."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (signature.args[0], values[0]), values[1])
        # Any element may be the first.
        return builder.load(place, align=4)

    return (_LANES_TYPE(array, types.intp), generate) if _is_flat(array) else None


@intrinsic
def load_grey(_: Any, array: Any, __: Any) -> Any:
    """The lanes of a flat uint8 array that begin at an index, as float32."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        bytes_type = ir.VectorType(ir.IntType(8), LANES)
        place = builder.bitcast(builder.gep(data, [values[1]]), bytes_type.as_pointer())
        return builder.uitofp(builder.load(place, align=1), _VECTOR)

    is_grey = bool(array == types.Array(types.uint8, 1, "C"))
    return (_LANES_TYPE(array, types.intp), generate) if is_grey else None


@intrinsic
def store(_: Any, array: Any, __: Any, lanes: Any) -> Any:
    """Write lanes into an array from an index on."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (signature.args[0], values[0]), values[1])
        builder.store(values[2], place, align=4)
        return context.get_dummy_value()

    return (types.void(array, types.intp, lanes), generate) if _is_flat(array) else None


@intrinsic
def store_grey(_: Any, array: Any, __: Any, lanes: Any) -> Any:
    """Write the whole parts of lanes, 0 to 255, into a flat uint8 array from an index on."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        bytes_type = ir.VectorType(ir.IntType(8), LANES)
        place = builder.bitcast(builder.gep(data, [values[1]]), bytes_type.as_pointer())
        numbers = builder.fptosi(values[2], ir.VectorType(_INDEX, LANES))
        builder.store(builder.trunc(numbers, bytes_type), place, align=1)
        return context.get_dummy_value()

    is_grey = bool(array == types.Array(types.uint8, 1, "C"))
    return (types.void(array, types.intp, lanes), generate) if is_grey else None


@intrinsic
def spread(_: Any, __: Any) -> Any:
    """The same float32 number in every lane."""

    def generate(___: Any, builder: Any, ____: Any, values: Any) -> Any:
        nothing = ir.Constant(_VECTOR, ir.Undefined)
        first = builder.insert_element(nothing, values[0], ir.Constant(_INDEX, 0))
        zeros = ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES)
        return builder.shuffle_vector(first, nothing, zeros)

    return _LANES_TYPE(types.float32), generate


@intrinsic
def whole(_: Any, lanes: Any) -> Any:
    """The next whole numbers below, lane by lane."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        of_lanes = ir.FunctionType(_VECTOR, [_VECTOR])
        floor = builder.module.declare_intrinsic(f"llvm.floor.v{LANES}f32", (), of_lanes)
        return builder.call(floor, values)

    return _LANES_TYPE(lanes), generate


@intrinsic
def lane_numbers(_: Any) -> Any:
    """0, 1, 2 and so on."""

    def generate(__: Any, ___: Any, ____: Any, _____: Any) -> Any:
        return ir.Constant(_VECTOR, [float(number) for number in range(LANES)])

    return _LANES_TYPE(), generate


def _of_two(operate: Callable[[Any, Any, Any], Any], doc: str) -> Any:
    def declare(_: Any, first: Any, second: Any) -> Any:
        def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
            return operate(builder, *values)

        return _LANES_TYPE(first, second), generate

    declare.__doc__ = doc
    return intrinsic(declare)


smaller = _of_two(
    lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b),
    "Minimum, lane by lane.",
)
larger = _of_two(
    lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b),
    "Maximum, lane by lane.",
)


@intrinsic
def where_positive(_: Any, test: Any, chosen: Any, other: Any) -> Any:
    """The second's lanes where the first is above 0; the third's elsewhere."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        is_positive = builder.fcmp_ordered(">", values[0], ir.Constant(_VECTOR, [0.0] * LANES))
        return builder.select(is_positive, values[1], values[2])

    return _LANES_TYPE(test, chosen, other), generate


@intrinsic
def all_positive(_: Any, lanes: Any) -> Any:
    """Whether every lane is above 0."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        is_positive = builder.fcmp_ordered(">", values[0], ir.Constant(_VECTOR, [0.0] * LANES))
        bits = ir.IntType(LANES)
        return builder.icmp_unsigned(
            "==", builder.bitcast(is_positive, bits), ir.Constant(bits, 2**LANES - 1)
        )

    return types.boolean(lanes), generate


def _operator(symbol: Callable[[Any, Any], Any], name: str) -> None:
    """Let lanes understand an operator."""

    def declare(_: Any) -> Any:
        def result(a: Any, b: Any) -> Any:
            return _LANES_TYPE if a == b == _LANES_TYPE else None

        return result

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        return getattr(builder, name)(*values)

    type_callable(symbol)(declare)
    lower_builtin(symbol, FloatLanes, FloatLanes)(generate)


_operator(operator.add, "fadd")
_operator(operator.sub, "fsub")
_operator(operator.mul, "fmul")
_operator(operator.truediv, "fdiv")
