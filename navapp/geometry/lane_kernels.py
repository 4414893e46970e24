"""Eight float32 or thirty-two whole numbers at once, inside compiled kernels.

Spelled out, because the compiler's own vectors stop at loops that read some arrays and write
others: it cannot know that they do not overlap. Every processor has such vectors: where its
registers are narrower, LLVM splits them.

Lanes understand + - * among themselves, floats also /, whole numbers also | and ^ (all of them
modulo their range). Arrays are C-contiguous, of float32 or of unsigned whole numbers; an index
counts elements of the flattened array and is not checked. All but `lanes_for` is for compiled code.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils, errors
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable

FLOAT_LANES = 8  # a sum of several powers needs many registers
WHOLE_LANES = 32
_INDEX = ir.IntType(32)


def lanes_for(count: int, lanes: int) -> int:
    """The next multiple of `FLOAT_LANES` or `WHOLE_LANES`."""
    return -(-count // lanes) * lanes


class Lanes(types.Type):  # type: ignore[misc]
    """The compiled type of neighbours of one dtype."""

    def __init__(self, dtype: Any) -> None:
        self.dtype = dtype
        self.is_float = dtype == types.float32
        if not (self.is_float or (isinstance(dtype, types.Integer) and not dtype.signed)):
            raise errors.TypingError("lanes are of float32 or of unsigned whole numbers")
        super().__init__(name=f"Lanes({dtype})")

    @property
    def vector(self) -> Any:
        """LLVM's type."""
        if self.is_float:
            return ir.VectorType(ir.FloatType(), FLOAT_LANES)
        return ir.VectorType(ir.IntType(self.dtype.bitwidth), WHOLE_LANES)


_FLOATS = Lanes(types.float32)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, lanes.vector)


def _lanes_of(array: Any) -> Lanes:
    if array.layout != "C":
        raise errors.TypingError("lanes lie in C-contiguous arrays: make a contiguous copy")
    return Lanes(array.dtype)


def _place(context: Any, builder: Any, array: tuple[Any, Any], index: Any, vector: Any) -> Any:
    """Pointer to the lanes that begin at an element."""
    array_type, value = array
    data = context.make_array(array_type)(context, builder, value).data
    return builder.bitcast(builder.gep(data, [index]), vector.as_pointer())


def _call(builder: Any, name: str, result: Any, arguments: list[Any]) -> Any:
    """Result of an intrinsic function of LLVM on lanes."""
    lanes = arguments[0].type
    element = "f32" if isinstance(lanes.element, ir.FloatType) else f"i{lanes.element.width}"
    function = cgutils.get_or_insert_function(
        builder.module,
        ir.FunctionType(result, [argument.type for argument in arguments]),
        f"llvm.{name}.v{lanes.count}{element}",
    )
    return builder.call(function, arguments)


@intrinsic
def load(_: Any, array: Any, __: Any) -> Any:
    """The lanes of an array that begin at an index."""
    lanes = _lanes_of(array)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (array, values[0]), values[1], lanes.vector)
        # Any element may be the first.
        return builder.load(place, align=array.dtype.bitwidth // 8)

    return lanes(array, types.intp), generate


@intrinsic
def store(_: Any, array: Any, __: Any, lanes: Any) -> Any:
    """Write lanes into an array of their type from an index on."""
    if _lanes_of(array) != lanes:
        raise errors.TypingError(f"{lanes} do not fit into an array of {array.dtype}")

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (array, values[0]), values[1], lanes.vector)
        builder.store(values[2], place, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), generate


_GREYS = ir.VectorType(ir.IntType(8), FLOAT_LANES)


def _is_grey(array: Any) -> bool:
    return bool(array == types.Array(types.uint8, 1, "C"))


@intrinsic
def load_grey(_: Any, array: Any, __: Any) -> Any:
    """Eight elements of a flat uint8 array from an index on, as float32."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (array, values[0]), values[1], _GREYS)
        return builder.uitofp(builder.load(place, align=1), _FLOATS.vector)

    return (_FLOATS(array, types.intp), generate) if _is_grey(array) else None


@intrinsic
def store_grey(_: Any, array: Any, __: Any, ___: Any) -> Any:
    """Write the whole parts of eight float32, 0 to 255, into a flat uint8 array from an index."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, (array, values[0]), values[1], _GREYS)
        numbers = builder.fptosi(values[2], ir.VectorType(_INDEX, FLOAT_LANES))
        builder.store(builder.trunc(numbers, _GREYS), place, align=1)
        return context.get_dummy_value()

    return (types.void(array, types.intp, _FLOATS), generate) if _is_grey(array) else None


@intrinsic
def spread(_: Any, number: Any) -> Any:
    """The same number in every lane; its type decides about theirs."""
    lanes = Lanes(number)

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        nothing = ir.Constant(lanes.vector, ir.Undefined)
        first = builder.insert_element(nothing, values[0], ir.Constant(_INDEX, 0))
        zeros = ir.Constant(ir.VectorType(_INDEX, lanes.vector.count), None)
        return builder.shuffle_vector(first, nothing, zeros)

    return lanes(number), generate


@intrinsic
def lane_numbers(_: Any) -> Any:
    """0, 1, 2 and so on, as floats."""

    def generate(__: Any, ___: Any, ____: Any, _____: Any) -> Any:
        return ir.Constant(_FLOATS.vector, [float(number) for number in range(FLOAT_LANES)])

    return _FLOATS(), generate


@intrinsic
def widened(_: Any, lanes: Any, array: Any) -> Any:
    """The same whole numbers with as many bits as an array's elements, which are no fewer."""
    wide = Lanes(array.dtype)

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        return values[0] if wide == lanes else builder.zext(values[0], wide.vector)

    are_whole = not lanes.is_float and not wide.is_float
    is_wider = are_whole and wide.dtype.bitwidth >= lanes.dtype.bitwidth
    return (wide(lanes, array), generate) if is_wider else None


def _of_two(of_floats: Any, of_whole: Callable[[Any, Any, Any], Any], doc: str) -> Any:
    """A function of two lanes of one type, from what generates it for either."""

    def declare(_: Any, first: Any, second: Any) -> Any:
        operate = of_floats if first.is_float else of_whole

        def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
            return operate(builder, *values)

        return (first(first, second), generate) if first == second and operate else None

    declare.__doc__ = doc
    return intrinsic(declare)


smaller = _of_two(
    lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b),
    lambda builder, a, b: _call(builder, "umin", a.type, [a, b]),
    "Minimum, lane by lane.",
)
larger = _of_two(
    lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b),
    lambda builder, a, b: _call(builder, "umax", a.type, [a, b]),
    "Maximum, lane by lane.",
)
capped_sum = _of_two(
    None,
    lambda builder, a, b: _call(builder, "uadd.sat", a.type, [a, b]),
    "a + b, at most the largest whole number.",
)


def _is_positive(builder: Any, lanes: Any) -> Any:
    zeros = ir.Constant(lanes.type, None)
    is_float = isinstance(lanes.type.element, ir.FloatType)
    compare = builder.fcmp_ordered if is_float else builder.icmp_unsigned
    return compare(">", lanes, zeros)


@intrinsic
def where_positive(_: Any, test: Any, chosen: Any, other: Any) -> Any:
    """The second's lanes where the first is above 0; the third's elsewhere."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        return builder.select(_is_positive(builder, values[0]), values[1], values[2])

    fits = chosen == other and test.vector.count == chosen.vector.count
    return (chosen(test, chosen, other), generate) if fits else None


@intrinsic
def all_positive(_: Any, lanes: Any) -> Any:
    """Whether every lane is above 0."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        count = lanes.vector.count
        bits = builder.bitcast(_is_positive(builder, values[0]), ir.IntType(count))
        return builder.icmp_unsigned("==", bits, ir.Constant(ir.IntType(count), 2**count - 1))

    return types.boolean(lanes), generate


def _of_one(name: str, is_of_floats: bool, doc: str) -> Any:
    """A function of LLVM, lane by lane."""

    def declare(_: Any, lanes: Any) -> Any:
        def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
            return _call(builder, name, values[0].type, [values[0]])

        return (lanes(lanes), generate) if lanes.is_float is is_of_floats else None

    declare.__doc__ = doc
    return intrinsic(declare)


whole = _of_one("floor", True, "The next whole numbers below, lane by lane.")
ones = _of_one("ctpop", False, "Number of ones in each lane's bits.")


@intrinsic
def smallest(_: Any, lanes: Any) -> Any:
    """The smallest of whole numbers."""

    def generate(__: Any, builder: Any, ___: Any, values: Any) -> Any:
        return _call(builder, "vector.reduce.umin", values[0].type.element, [values[0]])

    return None if lanes.is_float else (lanes.dtype(lanes), generate)


def _operator(symbol: Callable[[Any, Any], Any], of_floats: str, of_whole: str) -> None:
    """Let lanes understand an operator, by the names of LLVM's instructions ('' for none)."""

    def declare(_: Any) -> Any:
        def result(a: Any, b: Any) -> Any:
            is_known = isinstance(a, Lanes) and a == b and (of_floats if a.is_float else of_whole)
            return a if is_known else None

        return result

    def generate(_: Any, builder: Any, signature: Any, values: Any) -> Any:
        name = of_floats if signature.return_type.is_float else of_whole
        return getattr(builder, name)(*values)

    type_callable(symbol)(declare)
    lower_builtin(symbol, Lanes, Lanes)(generate)


_operator(operator.add, "fadd", "add")
_operator(operator.sub, "fsub", "sub")
_operator(operator.mul, "fmul", "mul")
_operator(operator.truediv, "fdiv", "")
_operator(operator.or_, "", "or_")
_operator(operator.xor, "", "xor")
