"""The errors of navapp: one tree, each branch with the exit code of the command line.

    NavappError                    1  anything of ours that has no better branch
    |-- UsageError                 2  arguments that do not go together or name nothing
    |   `-- ConfigurationError     2  a configuration file: unknown key, wrong type, out of bounds
    |-- InputError                 3  a file or folder: missing, unreadable, damaged, inconsistent
    |   |-- RigError               3  a stereo rig's file, or a rig that does not fit the pictures
    |   |-- SequenceError          3  a recorded sequence: unequal counts, a corrupt picture
    |   |-- PlanError              3  a plan folder or a surface in it
    |   `-- PriorError             3  a start pose, approach cone or box
    |-- ResultError                4  the work was done, but the result misses its limits
    |-- EndOfSequence              -  a finite source has no further frame: an outcome, not a fault
    `-- DeviceError                5  a device; say which
        |-- DeviceNotFound         5  it was never there: not connected, wrong name
        |-- DeviceLost             5  it was open and is gone; reopening may help
        |-- DeviceTimeout          5  it is there but did not answer in time
        |-- DeviceProtocolError    5  it answered what it must not answer
        |-- WrongDevice            5  another serial number or size than the rig is bound to
        `-- UnsupportedControl     5  it has no such control, or refused the value

Which one: a picture that cannot be decoded in a recorded folder is a SequenceError, the same from a
live camera a DeviceProtocolError. A device that stops answering is DeviceTimeout until reopening
was tried, then DeviceLost. An expected outcome (no board seen, bone lost) is a value, not an error.
"""


class NavappError(Exception):
    """Root of the tree. The text is one sentence that names the thing and the remedy.

    Attributes:
        subject: what it is about (a path, a key, a device), for programs.
        remedy: what the user can do, or an empty text.
    """

    exit_code = 1

    def __init__(self, problem: str, *, subject: str = "", remedy: str = "") -> None:
        self.problem = problem
        self.subject = subject
        self.remedy = remedy
        super().__init__(f"{problem}: {remedy}" if remedy else problem)


class UsageError(NavappError):
    """Arguments that do not go together, or name something that does not exist."""

    exit_code = 2


class ConfigurationError(UsageError):
    """A configuration file with an unknown key, a wrong type or a value out of bounds."""


class InputError(NavappError):
    """A file or folder that is missing, unreadable, damaged or inconsistent."""

    exit_code = 3


class RigError(InputError):
    """A rig file, or a rig that does not fit the pictures."""


class SequenceError(InputError):
    """A recorded sequence: missing half of a pair, a corrupt picture, nothing in it."""


class PlanError(InputError):
    """A plan folder or one of its surfaces."""


class PriorError(InputError):
    """A prior: start pose, picks, box, approach cone."""


class ResultError(NavappError):
    """The work was done but its result does not meet its limits."""

    exit_code = 4


class EndOfSequence(NavappError):  # noqa: N818 (an outcome, not an error)
    """A finite source has no further frame."""


class DeviceError(NavappError):
    """Something about a device; `subject` says which."""

    exit_code = 5


class DeviceNotFound(DeviceError):  # noqa: N818
    """Not connected, or no device of that name."""


class DeviceLost(DeviceError):  # noqa: N818
    """Was open and is gone."""


class DeviceTimeout(DeviceError):  # noqa: N818
    """Did not answer within the time given."""


class DeviceProtocolError(DeviceError):
    """Answered something that its protocol forbids."""


class WrongDevice(DeviceError):  # noqa: N818
    """Another serial number or picture size than the rig is bound to."""


class UnsupportedControl(DeviceError):  # noqa: N818
    """The device has no such control, or refused the value."""
