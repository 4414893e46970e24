"""Thirty-two neighbours of an array at once, inside compiled kernels.

The compiler's own vectors stop at loops that write several arrays: it cannot know that they do not
overlap. Spelled out, one loop follows four paths. Every processor has them: where its registers are
narrower, LLVM splits the lanes.

All but `lanes_for` is for compiled code only. An index counts elements of the flattened
C-contiguous array and is not checked.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils, errors
from numba.extending import intrinsic, models, register_model

LANES = 32
_INDEX = ir.IntType(32)


def lanes_for(count: int) -> int:
    """The next multiple of `LANES`."""
    return -(-count // LANES) * LANES


class Lanes(types.Type):  # type: ignore[misc]
    """The compiled type of `LANES` whole numbers."""

    def __init__(self, dtype: Any) -> None:
        self.dtype = dtype
        super().__init__(name=f"Lanes({dtype})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        vector = ir.VectorType(ir.IntType(lanes.dtype.bitwidth), LANES)
        super().__init__(manager, lanes, vector)


def _lanes_of(array: Any) -> Lanes:
    if array.layout != "C":
        raise errors.TypingError("lanes lie in C-contiguous arrays: make a contiguous copy")
    return Lanes(array.dtype)


def _place(context: Any, builder: Any, array: tuple[Any, Any], index: Any) -> Any:
    """Pointer to the lanes that begin at an element."""
    array_type, value = array
    data = context.make_array(array_type)(context, builder, value).data
    lanes = context.get_value_type(_lanes_of(array_type))
    return builder.bitcast(builder.gep(data, [index]), lanes.as_pointer())


def _call(builder: Any, name: str, result: Any, arguments: list[Any]) -> Any:
    """Result of an intrinsic function of LLVM on lanes."""
    lanes = arguments[0].type
    function = cgutils.get_or_insert_function(
        builder.module,
        ir.FunctionType(result, [argument.type for argument in arguments]),
        f"llvm.{name}.v{LANES}i{lanes.element.width}",
    )
    return builder.call(function, arguments)


@intrinsic
def load(_: Any, array: Any, __: Any) -> Any:
    """The lanes of an array that begin at an index."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (signature.args[0], values[0]), values[1])
        # Any element may be the first.
        return builder.load(place, align=array.dtype.bitwidth // 8)

    return _lanes_of(array)(array, types.intp), generate


@intrinsic
def store(_: Any, array: Any, __: Any, lanes: Any) -> Any:
    """Write lanes into an array from an index on."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (signature.args[0], values[0]), values[1])
        builder.store(values[2], place, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), generate


@intrinsic
def spread(_: Any, number: Any) -> Any:
    """The same number in every lane; its type decides about theirs."""

    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        nothing = ir.Constant(context.get_value_type(Lanes(number)), ir.Undefined)
        first = builder.insert_element(nothing, values[0], ir.Constant(_INDEX, 0))
        zeros = ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES)
        return builder.shuffle_vector(first, nothing, zeros)

    return Lanes(number)(number), generate


@intrinsic
def widened(_: Any, lanes: Any, array: Any) -> Any:
    """The same numbers with as many bits as an array's elements, which are no fewer."""
    wide = Lanes(array.dtype)

    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        if wide == lanes:
            return values[0]
        return builder.zext(values[0], context.get_value_type(wide))

    return wide(lanes, array), generate


def _of_two(operate: Callable[[Any, Any, Any], Any], doc: str) -> Any:
    def declare(_: Any, first: Any, second: Any) -> Any:
        def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
            return operate(builder, *values)

        return first(first, second), generate

    declare.__doc__ = doc
    return intrinsic(declare)


added = _of_two(lambda builder, a, b: builder.add(a, b), "a + b, which must not overflow.")
less = _of_two(lambda builder, a, b: builder.sub(a, b), "a - b, modulo the range.")
capped_sum = _of_two(
    lambda builder, a, b: _call(builder, "uadd.sat", a.type, [a, b]),
    "a + b, at most the largest number.",
)
what_exceeds = _of_two(
    lambda builder, a, b: _call(builder, "usub.sat", a.type, [a, b]), "a - b, at least 0."
)
differing = _of_two(lambda builder, a, b: builder.xor(a, b), "Bits that differ.")
both_bits = _of_two(lambda builder, a, b: builder.or_(a, b), "Bits of either.")
smaller = _of_two(
    lambda builder, a, b: _call(builder, "umin", a.type, [a, b]), "Minimum, lane by lane."
)
larger = _of_two(
    lambda builder, a, b: _call(builder, "umax", a.type, [a, b]), "Maximum, lane by lane."
)


@intrinsic
def chosen(_: Any, mask: Any, where: Any, elsewhere: Any) -> Any:
    """The second's lanes where the first, a mask, is not 0; the third's elsewhere."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        mask, where, elsewhere = values
        is_set = builder.icmp_unsigned("!=", mask, ir.Constant(mask.type, None))
        return builder.select(is_set, where, elsewhere)

    return where(mask, where, elsewhere), generate


@intrinsic
def ones(_: Any, lanes: Any) -> Any:
    """Number of ones in each lane's bits."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        return _call(builder, "ctpop", values[0].type, [values[0]])

    return lanes(lanes), generate


def _shift_left(bits: Callable[[int], int], doc: str) -> Any:
    def declare(_: Any, lanes: Any) -> Any:
        def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
            vector = values[0].type
            return builder.shl(values[0], ir.Constant(vector, [bits(vector.element.width)] * LANES))

        return lanes(lanes), generate

    declare.__doc__ = doc
    return intrinsic(declare)


eightfold = _shift_left(lambda _: 3, "8 * a, which must not overflow.")
in_upper_half = _shift_left(lambda width: width // 2, "Moved into the upper half of the bits.")


@intrinsic
def smallest(_: Any, lanes: Any) -> Any:
    """The smallest of the lanes."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        return _call(builder, "vector.reduce.umin", values[0].type.element, [values[0]])

    return lanes.dtype(lanes), generate
