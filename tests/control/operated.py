"""Sessions on fakes that an operator runs, and what it did."""

from navapp.control.commands import Command
from navapp.control.operators import Operator
from navapp.control.runner import run_headless
from tests.control.fakes import Bench


def commands_of(bench: Bench, operator: Operator) -> list[Command]:
    """What the operator did during the whole sequence."""
    given: list[Command] = []
    submit = bench.controller.submit
    bench.controller.submit = lambda command: (given.append(command), submit(command))
    run_headless(bench.controller, operator)
    return given


def kinds(commands: list[Command]) -> list[str]:
    return [type(command).__name__ for command in commands]
