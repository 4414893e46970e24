"""One table of methods, of a session and of a registration."""

from typing import get_args

from navapp.cli.methods import REGISTER_METHODS
from navapp.registration.register import Method as RegisterMethod
from navapp.tracking import Method


def test_the_methods_of_a_session_are_those_of_a_registration() -> None:
    assert set(REGISTER_METHODS) == set(get_args(Method))
    assert set(REGISTER_METHODS.values()) == set(get_args(RegisterMethod))
