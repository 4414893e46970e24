"""The tables of the configuration: frozen models that refuse unknown keys."""

from typing import Annotated, Literal, Self, TypeVar

from pydantic import AfterValidator, Field, model_validator

from navapp.config.camera_sections import CameraSection
from navapp.config.section import NotNegative, Pixels, Positive, Section, check_rising

S = TypeVar("S", bound="Section")


def _with_port(section: S, needs_port: bool, port: str) -> S:
    if needs_port and not port:
        raise ValueError("this backend needs a port")
    return section


class DisplaySimulationSection(Section):
    """The display that `navapp calibrate latency` shows to simulated cameras."""

    delay_ms: NotNegative = 40.0
    """From the call to the first refresh that can show it."""
    refresh_hz: Positive = 59.94
    """Refreshes in a second; a picture waits for the next one."""


class DisplaySection(Section):
    """Where the overlay is shown."""

    backend: Literal["simulated", "window", "desktop"] = "simulated"
    """simulated; window: covers a monitor or projector; desktop: can be moved (run --window)."""
    output: str = ""
    """Name of the window's monitor or projector; empty: the only one."""
    size_px: tuple[Pixels, Pixels] | None = None
    """Width and height of that output, or of the other displays' pictures; a window needs it."""
    flip_horizontally: bool = False
    """The window shows every picture with left and right exchanged."""
    flip_vertically: bool = False
    """The window shows every picture upside down."""
    model: str | None = None
    """File of the display in the half-silvered mirror (calibrate mirror): guides are for it."""
    valid_ms: Positive = 500.0
    """A picture without a newer one turns black after this."""
    delay_ms: NotNegative = 0.0
    """What is shown is seen so much later (calibrate latency), and withdrawn so much earlier."""
    delay_bound_ms: NotNegative = 0.0
    """95 % bound of that delay's error (calibrate latency); 0: not known."""
    simulated: DisplaySimulationSection = DisplaySimulationSection()
    """The display that simulated cameras see."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.backend == "window" and self.size_px is None:
            raise ValueError("a window needs size_px")
        if self.model is not None and self.backend == "desktop":
            raise ValueError("a display with a model covers an output from edge to edge")
        if self.model is not None and (self.flip_horizontally or self.flip_vertically):
            raise ValueError("a display with a model is not flipped: the model knows its flips")
        if self.delay_ms >= self.valid_ms:
            raise ValueError("delay_ms must be smaller than valid_ms")
        return self

    @property
    def withdrawn_ms(self) -> float:
        """After this a picture is withdrawn, so that its light is gone after `valid_ms`."""
        return self.valid_ms - self.delay_ms


class ProjectorSection(Section):
    """The projector's control line."""

    backend: Literal["none", "pjlink", "escvp21"] = "none"
    """none; pjlink: PJLink class 1 over the network; escvp21: Epson's protocol on a serial line."""
    host: str = ""
    """Address of a PJLink projector."""
    tcp_port: Annotated[int, Field(gt=0, lt=65536)] = 4352
    """Port of a PJLink projector."""
    password_file: str | None = None
    """File that holds the password of a PJLink projector, and nothing else."""
    port: str = ""
    """Of an ESC/VP21 projector: serial port (/dev/serial/by-id/...) or socket://host:port."""
    serial: str = ""
    """Serial number of the rig's ESC/VP21 projector; others are refused. Empty: the first read."""

    @model_validator(mode="after")
    def _has_a_host(self) -> Self:
        if self.backend == "pjlink" and not self.host:
            raise ValueError("pjlink needs a host")
        return _with_port(self, self.backend == "escvp21", self.port)


class MirrorSection(Section):
    """The mount of the half-silvered mirror."""

    backend: Literal["fixed", "zaber"] = "fixed"
    """fixed, or zaber: a rotary stage that speaks Zaber's ASCII protocol."""
    calibrated_deg: float = 45.0
    """Angle at which the display was calibrated; of a stage from its home position."""
    eyes: Literal["both", "left", "right"] = "both"
    """That look into the mirror; with both, guides 1 mm off for the other eye are refused."""
    check_minutes: Positive = 30.0
    """What is seen in the mirror is checked again after this."""
    port: str = ""
    """Serial port (/dev/serial/by-id/...) or socket://host:port."""
    serial: str = ""
    """Serial number of the rig's mount; others are refused. Empty: the first one read."""
    device: Annotated[int, Field(ge=1, le=99)] = 1
    """Its number on the line."""
    axis: Annotated[int, Field(ge=1, le=9)] = 1
    """The axis' number in the device."""

    @model_validator(mode="after")
    def _has_a_port(self) -> Self:
        return _with_port(self, self.backend == "zaber", self.port)


class PlanSection(Section):
    """The pre-operative plan."""

    path: str | None = None
    """Plan folder; the simulated rig brings its own."""
    prior: str | None = None
    """JSON file that tells where the bone is (navapp prior makes it)."""


class TrackingSection(Section):
    """Tracking of the bones."""

    method: Literal["bimcc", "paper", "icp"] = "bimcc"
    """paper is the paper's proposal, icp its state of the art: both to compare with."""
    follow_refused: bool = False
    """Carry on poses that the judge refuses, to measure them; they stay refused, without guides."""


class ToolsSection(Section):
    """Hand-held tools with a printed plate."""

    pointer: str | None = None
    """File of the pointer (calibrate pivot)."""
    drill: str | None = None
    """File of the drill (calibrate pivot --tool drill)."""

    @property
    def files(self) -> dict[str, str]:
        """Those that are named."""
        named = {"pointer": self.pointer, "drill": self.drill}
        return {kind: path for kind, path in named.items() if path is not None}


class CalibrationSection(Section):
    """Calibration of the stereo rig."""

    stop_capture_mm: Positive = 0.15
    """A capture may end when half of the working volume has a predicted 95 % error below."""
    accept_mm: Positive = 0.40
    """A rig is accepted when nearly all of the working volume has a predicted 95 % error below."""
    working_depth_mm: Annotated[tuple[Positive, Positive], AfterValidator(check_rising)] = (
        350.0,
        550.0,
    )
    """Nearest and farthest surface of the working volume."""
    valid_days: Annotated[int, Field(gt=0)] = 180
    """A rig is refused when it is older."""
    board: str | None = None
    """A board's file (JSON, mm): whenever a session sees that board, it measures the rig by it."""

    @property
    def worst_length(self) -> float:
        """Share of a length, and so of a depth, that may be wrong."""
        return self.accept_mm / (0.5 * sum(self.working_depth_mm))


class StagesSection(Section):
    """The surgical stages."""

    first: str = "opening"
    """Where a session starts: opening, drilling, implant, patella or spacer, or its number."""
    check_minutes: Annotated[float, Field(gt=0.0)] = 30.0
    """How long a check on the patient counts, before a stage that asks for one is entered."""


class RecordingSection(Section):
    """Session folders."""

    folder: str | None = None
    """Record every session into this new folder."""
    pictures: bool = True
    """Keep the raw pairs (lossless PNG), so that the session can be replayed."""


class EmptySection(Section):
    """A table without keys."""


class UiSection(Section):
    """The operator's screen."""

    pictures: Literal["auto", "kitty", "sixel", "blocks"] = "auto"
    """How the terminal gets pictures; auto: the best that it answers for; blocks: half blocks."""


class Configuration(Section):
    """The whole configuration file."""

    camera: CameraSection = CameraSection()
    display: DisplaySection = DisplaySection()
    projector: ProjectorSection = ProjectorSection()
    mirror: MirrorSection = MirrorSection()
    plan: PlanSection = PlanSection()
    stereo: EmptySection = EmptySection()
    registration: EmptySection = EmptySection()
    tracking: TrackingSection = TrackingSection()
    tools: ToolsSection = ToolsSection()
    calibration: CalibrationSection = CalibrationSection()
    overlay: EmptySection = EmptySection()
    stages: StagesSection = StagesSection()
    recording: RecordingSection = RecordingSection()
    link: EmptySection = EmptySection()
    ui: UiSection = UiSection()
