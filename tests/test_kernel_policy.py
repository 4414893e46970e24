"""What every compiled kernel promises: found in the sources, not by running them."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("navapp", "sim_devices", "drivers", "calibration")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
COMPILERS = {"jit", "njit", "vectorize", "guvectorize", "cfunc", "stencil", "generated_jit"}


def last_name(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def kernels_of(tree: ast.AST) -> list[tuple[ast.FunctionDef, ast.expr]]:
    return [
        (node, decorator)
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        for decorator in node.decorator_list
        if last_name(decorator.func if isinstance(decorator, ast.Call) else decorator) in COMPILERS
    ]


def is_listener_import(node: ast.AST) -> bool:
    """The events of the compiler, by which it is told when it works: nothing can be compiled."""
    if not isinstance(node, ast.ImportFrom) or node.module != "numba.core":
        return False
    return [alias.name for alias in node.names] == ["event"]


def faults_of(source: str, file_name: str) -> list[str]:
    """What a file does that kernels must not do."""
    if not re.search("numba|jit|vectorize|prange", source):
        return []
    tree = ast.parse(source)
    faults = []
    kernels = kernels_of(tree)
    uses_numba = False
    for node in ast.walk(tree):
        if is_listener_import(node):
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if any(module.split(".")[0] == "numba" for module in modules):
                uses_numba = True
                names = {alias.name for alias in node.names}
                faults += [
                    f"imports {name}" for name in names & (COMPILERS - {"njit"} | {"prange"})
                ]
        elif isinstance(node, ast.Attribute | ast.Name) and last_name(node) == "prange":
            faults.append("uses prange")
    if (kernels or uses_numba) and not file_name.endswith("kernels.py"):
        faults.append("has a kernel outside a *kernels.py file")
    for function, decorator in kernels:
        given = (
            {word.arg: word.value for word in decorator.keywords}
            if isinstance(decorator, ast.Call)
            else {}
        )
        for name in ("cache", "nogil"):
            if not (isinstance(given.get(name), ast.Constant) and given[name].value is True):
                faults.append(f"{function.name} lacks {name}=True")
        faults += [f"{function.name} says {name}" for name in {"parallel", "fastmath"} & set(given)]
    return faults


def test_kernels_are_cached_let_others_run_and_stay_exact() -> None:
    faults = {
        str(path.relative_to(ROOT)): faults_of(path.read_text(encoding="utf-8"), path.name)
        for path in SOURCES
    }
    assert {path: found for path, found in faults.items() if found} == {}


def test_there_are_kernels_to_check() -> None:
    kernel_files = [path for path in SOURCES if path.name.endswith("kernels.py")]
    found = sum(len(kernels_of(ast.parse(path.read_text("utf-8")))) for path in kernel_files)
    assert found >= 5


GOOD = "from numba import njit\n@njit(cache=True, nogil=True)\ndef f(): pass\n"


@pytest.mark.parametrize(
    ("source", "file_name"),
    [
        (GOOD, "maths.py"),
        (GOOD.replace("cache=True, ", ""), "a_kernels.py"),
        (GOOD.replace("nogil=True", "nogil=False"), "a_kernels.py"),
        (GOOD.replace("(cache=True, nogil=True)", ""), "a_kernels.py"),
        (GOOD.replace("nogil=True", "nogil=True, parallel=True"), "a_kernels.py"),
        (GOOD.replace("nogil=True", "nogil=True, fastmath=True"), "a_kernels.py"),
        (GOOD.replace("njit\n", "njit, prange\n"), "a_kernels.py"),
        (GOOD.replace("from numba import njit", "import numba").replace("@n", "@numba.n"), "a.py"),
        (GOOD.replace("pass", "numba.prange(3)"), "a_kernels.py"),
        ("import numba\nf = numba.njit(len)\n", "a.py"),
        (GOOD.replace("njit", "vectorize"), "a_kernels.py"),
        ("from numba.core import event\n" + GOOD, "a.py"),
        ("from numba.core import event, dispatcher\n", "a.py"),
        ("from numba.core import dispatcher as event\n", "a.py"),
    ],
)
def test_a_broken_promise_is_found(source: str, file_name: str) -> None:
    assert faults_of(GOOD, "a_kernels.py") == []
    assert faults_of(source, file_name) != []


def test_listening_to_the_compiler_is_no_kernel() -> None:
    assert faults_of("from numba.core import event\n", "a.py") == []
