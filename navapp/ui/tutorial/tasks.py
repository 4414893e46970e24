"""The tasks of the tutorial's steps that have a live screen."""

from navapp.control.capture.states import CaptureSnapshot
from navapp.control.states import SessionState, Snapshot
from navapp.ui.tutorial.guide import Guide, Task

_BEGINNING = (SessionState.OFFLINE, SessionState.STARTING)
_ACCEPTED = (SessionState.NAVIGATING, SessionState.SUSPENDED)

_READY: Task[Snapshot] = Task(
    "Wait until the state at the top right is READY.",
    "the session runs: this is the simulated knee, opened",
    lambda snapshot: snapshot.state not in _BEGINNING,
)
_FIND: Task[Snapshot] = Task(
    "Press g: the bone is searched for in the pictures. That takes some seconds, the first time "
    "longer.",
    "a candidate: nobody has accepted it, so its outline is amber",
    lambda snapshot: snapshot.is_candidate or snapshot.state in _ACCEPTED,
)
_ACCEPT: Task[Snapshot] = Task(
    "Look whether the outline follows the bone's edge. If so, press a; if not, r and then g again.",
    "accepted: the bone is followed, with the error that is predicted for it at the right",
    lambda snapshot: snapshot.state in _ACCEPTED,
)
_TIME_OUT: Task[Snapshot] = Task(
    "Guides wait for the time-out. Press t, confirm patient, side and plan with b, c and d, leave "
    "with ESC.",
    "the time-out is done: guides are shown, the outline is green",
    lambda snapshot: all(line.is_met for line in snapshot.time_out) and snapshot.is_navigable,
)


def make_room_guide() -> Guide[Snapshot]:
    """Step 1: see the room."""
    return Guide(
        (
            _READY,
            _FIND,
            _ACCEPT,
            _TIME_OUT,
            Task(
                "Press SPACE: the display is dark at once, from every page.",
                "the display is dark",
                lambda snapshot: snapshot.is_blanked,
            ),
            Task(
                "Press v: the guides come back.",
                "the guides are back",
                lambda snapshot: not snapshot.is_blanked and snapshot.is_navigable,
            ),
        ),
        "Look around: w the whole picture, z its depth, l the layers, ? all keys. q and y end this "
        "step.",
    )


def make_capture_guide() -> Guide[CaptureSnapshot]:
    """Step 2: pictures of a board."""
    return Guide(
        (
            Task(
                "Press m: the simulated hand holds the board where it is wanted, view after view.",
                "the hand follows: a pair is kept when both cameras see the board still and sharp",
                lambda snapshot: snapshot.is_following or snapshot.n_kept > 0,
            ),
            Task(
                "Wait for the first five pairs. The drawn outline is the view that is wanted next.",
                "the rig is solved after each pair; its error is the bar below",
                lambda snapshot: snapshot.n_kept >= 5,
            ),
            Task(
                "Wait for ENOUGH at the top right: the bar is below its limit. About a minute.",
                "enough: the rig is as good as it has to be",
                lambda snapshot: snapshot.is_enough,
            ),
            Task(
                "Press f: the rig is solved from all pairs, and judged.",
                "the rig is accepted",
                lambda snapshot: snapshot.outcome is not None and snapshot.outcome.is_accepted,
            ),
        ),
        "Press q: this screen ends. The same pairs are then solved by `navapp calibrate stereo`.",
    )


def make_navigation_guide() -> Guide[Snapshot]:
    """Step 4: navigate with what was made."""
    return Guide(
        (
            _READY,
            _FIND,
            _ACCEPT,
            _TIME_OUT,
            Task(
                "Press ]: the next stage is drilling. Its gate is not met yet, so its page opens.",
                "the gate says what is open",
                lambda snapshot: snapshot.refused_stage == 2 or snapshot.stage.number == 2,
            ),
            Task(
                "On the page of the gates confirm with f and g what a person answers for (it is "
                "practice), then ENTER.",
                "stage 2: the planned hole is shown where the drill enters",
                lambda snapshot: snapshot.stage.number == 2,
            ),
            Task(
                "Leave the page with ESC, and see the planned hole over the bone.",
                "the guide of the hole lies on the bone, from the CT's plan",
                lambda snapshot: snapshot.stage.number == 2 and snapshot.is_navigable,
            ),
        ),
        "That was all. l switches layers, k says that the hole is made. q and y end the session.",
    )
