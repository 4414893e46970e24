import inspect
import pickle
import re

import pytest

from navapp import errors
from navapp.errors import NavappError

ERRORS = [
    value
    for value in vars(errors).values()
    if inspect.isclass(value) and issubclass(value, NavappError)
]


def test_the_tree_in_the_documentation_is_the_tree():
    told = re.findall(r"^[ |`-]*(\w+) {2,}(\d|-) {2}", errors.__doc__, re.MULTILINE)
    # `-` stands for an outcome that never ends a program.
    codes = {error.__name__: str(error.exit_code) for error in ERRORS}
    assert {name for name, _ in told} == set(codes)
    for name, code in told:
        assert code in ("-", codes[name]), name


def test_the_text_is_one_sentence_with_the_remedy():
    error = errors.RigError("rig file a.yml lacks K1", subject="a.yml", remedy="calibrate again")
    assert str(error) == "rig file a.yml lacks K1: calibrate again"
    assert (error.problem, error.subject, error.remedy) == (
        "rig file a.yml lacks K1",
        "a.yml",
        "calibrate again",
    )
    assert str(NavappError("it broke")) == "it broke"


@pytest.mark.parametrize("kind", ERRORS)
def test_errors_pass_between_processes(kind):
    error = kind("a problem", subject="a thing", remedy="a way out")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error)
    assert (again.problem, again.subject, again.remedy) == ("a problem", "a thing", "a way out")


def test_what_a_user_may_catch_together_belongs_together():
    for kind in (errors.RigError, errors.PlanError, errors.SequenceError, errors.PriorError):
        assert issubclass(kind, errors.InputError)
    for kind in (errors.DeviceLost, errors.DeviceTimeout, errors.WrongDevice):
        assert issubclass(kind, errors.DeviceError)
    assert not issubclass(errors.EndOfSequence, errors.DeviceError)
