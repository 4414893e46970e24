"""What the keys of the pages ask of the session: a base of the application."""

from collections.abc import Callable

from navapp.control.commands import (
    CheckPicks,
    Command,
    ConfirmCondition,
    ConfirmStep,
    DropPoint,
    EnterStage,
    ForgetPoints,
    OverrideGate,
    ReadThickness,
    Register,
    SetProjector,
    ToggleLayer,
    TouchPoint,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.geometry.box import Box
from navapp.ui.gates_page import REASONS, condition_of_key
from navapp.ui.pages import PowerQuestion
from navapp.ui.picks_page import PicksChecked
from navapp.ui.quiet_app import QuietApp
from navapp.ui.session import Session
from navapp.ui.start_page import StartChosen
from navapp.ui.steps_page import step_of_key
from navapp.ui.thickness_question import ThicknessQuestion
from navapp.ui.tools_page import landmark_of_key
from navapp.ui.view import View


class PageCommands(QuietApp):
    """Turns keys of pages into commands; a session that gives no answer is told of instead.

    Args:
        session: that takes the commands.
        view: that the pages show first.
    """

    def __init__(self, session: Session, view: View) -> None:
        super().__init__()
        self._session = session
        self._view = view  # the newest
        self._start_box: Box | None = None  # as it was drawn last

    def on_start_chosen(self, message: StartChosen) -> None:
        """Search for the bone where an operator has drawn or picked it."""
        if message.start.box is not None:
            self._start_box = Box(*message.start.box)
        if self._view.is_silent:
            self._say_silent("register")
        else:
            self._session.submit(Register(message.start, message.bone))

    def on_picks_checked(self, message: PicksChecked) -> None:
        """Compare picked landmarks with the accepted registration."""
        if self._view.is_silent:
            self._say_silent("the check")
        else:
            self._session.submit(CheckPicks(message.picks))

    def action_confirm_condition(self, key: str) -> None:
        """Say that a condition is met: from the gates' page."""
        self._say_of(condition_of_key(self._view.snapshot, key), ConfirmCondition)

    def action_withdraw_condition(self, key: str) -> None:
        """Say that it is not met after all."""
        self._say_of(condition_of_key(self._view.snapshot, key), WithdrawCondition)

    def action_pass_gate(self) -> None:
        """Enter the stage whose gate the page shows."""
        self._session.submit(EnterStage(self._view.snapshot.gate_stage))

    def action_override_gate(self, number: str) -> None:
        """Enter it whatever is open, with one of the page's reasons."""
        reason = REASONS[int(number) - 1]
        self._session.submit(OverrideGate(self._view.snapshot.gate_stage, reason))

    def action_toggle_layer(self, name: str) -> None:
        """Draw a layer, or no longer: from the page that lists them."""
        self._session.submit(ToggleLayer(name))

    def action_confirm_step(self, key: str) -> None:
        """Say that a step has been made: from the steps' page."""
        self._say_of(step_of_key(self._view.snapshot, key), ConfirmStep)

    def action_withdraw_step(self, key: str) -> None:
        """Say that a step has not been made after all."""
        self._say_of(step_of_key(self._view.snapshot, key), WithdrawStep)

    def action_read_thickness(self) -> None:
        """Ask what a caliper reads below a cut: from the steps' page."""
        made = [one for one in self._view.snapshot.steps if one.is_made]
        step = next((one for one in made if one.is_caliper_readable), None)
        if step is None:
            why = next((one.caliper_refusal for one in made if one.caliper_refusal), "")
            self.bell()
            self.notify(why or "no cut that is made needs a thickness", severity="warning")
            return
        if self._view.is_silent:
            self._say_silent(step.name)
            return

        def finish(reading: tuple[float, ...] | None) -> None:
            if reading:
                self._session.submit(ReadThickness(step.name, reading))

        self.push_screen(ThicknessQuestion(self._view, step), finish)

    def action_touch_point(self, landmark: str) -> None:
        """Take a point of the check on the patient: from the tools' page."""
        if self._view.is_silent:
            self._say_silent("a point")
        else:
            self._session.submit(TouchPoint(landmark))

    def action_touch_landmark(self, key: str) -> None:
        """Take a point on the landmark that a letter means."""
        self._say_of(landmark_of_key(self._view.snapshot, key), TouchPoint)

    def action_drop_point(self) -> None:
        """Forget the point that was taken last."""
        self._session.submit(DropPoint())

    def action_forget_points(self) -> None:
        """Begin the check anew."""
        self._session.submit(ForgetPoints())

    def action_set_projector(self, name: str) -> None:
        """Tell the projector a setting: from the devices' page; asked before it goes off."""

        def finish(is_sure: bool | None) -> None:
            if is_sure:
                self._say_of(name, SetProjector)

        if name == "off":
            self.push_screen(PowerQuestion(self._view), finish)
        else:
            finish(is_sure=True)

    def _say_of(self, name: str | None, word: Callable[[str], Command]) -> None:
        """A person's word for what a letter of a page means; nothing where it means nothing."""
        if name is None:
            return
        if self._view.is_silent:
            self._say_silent(name)
        else:
            self._session.submit(word(name))

    def _say_silent(self, what: str) -> None:
        """No key is dropped in silence."""
        self.bell()
        self.notify(f"{what} needs a session that answers", severity="warning")
