"""The tables of the configuration: frozen models that refuse unknown keys."""

from typing import Annotated, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Pixels = Annotated[int, Field(gt=0)]


def _rising(values: tuple[float, float]) -> tuple[float, float]:
    if values[0] >= values[1]:
        raise ValueError("the first must be smaller than the second")
    return values


class Section(BaseModel):
    """One table of the file."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )


S = TypeVar("S", bound="Section")


def _with_port(section: S, needs_port: bool, port: str) -> S:
    if needs_port and not port:
        raise ValueError("this backend needs a port")
    return section


class FaultSection(Section):
    """One scripted fault of the simulated camera; seconds since it was opened first."""

    kind: Literal[
        "unplug", "freeze", "drop", "delay", "blackout_left", "blackout_right", "wrong_serial",
        "turn",
    ]  # fmt: skip
    """What goes wrong."""
    start_s: Annotated[float, Field(ge=0.0)]
    """When it begins."""
    duration_s: Annotated[float, Field(gt=0.0, allow_inf_nan=True)]
    """How long it lasts; inf: for good."""
    delay_s: Annotated[float, Field(ge=0.0)] = 0.3
    """Of a delay: how much later frames come."""
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of a turn of the right camera about its axes: x up and down, y sideways, z in its plane."""

    @model_validator(mode="after")
    def _has_its_own_keys(self) -> Self:
        if "delay_s" in self.model_fields_set and self.kind != "delay":
            raise ValueError(f"delay_s belongs to a delay, not to {self.kind}")
        if ("turn_deg" in self.model_fields_set) is not (self.kind == "turn"):
            raise ValueError("turn_deg belongs to a turn, and a turn needs it")
        return self


class SimulationSection(Section):
    """The simulated patient and rig."""

    seed: Annotated[int, Field(ge=0)] = 1
    """Of the anatomy, the textures, the placement and the motion."""
    side: Literal["left", "right"] = "right"
    """Of the knee."""
    sex: Literal["female", "male"] = "female"
    """Of the patient."""
    age_group: Literal["young", "middle", "old"] = "middle"
    """Of the patient."""
    cartilage_mm: Annotated[float, Field(ge=0.0, le=2.6)] = 0.0
    """Mean thickness of the cartilage that the camera sees and the plan does not; 0: bare bone."""
    motion: Literal["still", "breathing", "patient", "jump"] = "breathing"
    """Of the leg."""
    instrument: Literal["none", "sweep"] = "none"
    """What passes in front of the bone."""
    scale: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """Size of the pictures: 1.0 is 1280 x 720."""
    stepped: bool | None = None
    """Whether frames wait to be read; by default in headless sessions only."""
    skew_ms: float = 0.0
    """The right camera exposes later by this."""
    unstamped_skew_ms: float = 0.0
    """The right camera exposes later by this as well, and its time stamps do not say so."""
    grey: bool = False
    """Grey pictures, like those of an OAK camera."""
    board_s: Annotated[tuple[NotNegative, Positive], AfterValidator(_rising)] | None = None
    """From when to when, in seconds, the board of [calibration] is held into the view."""
    faults: tuple[FaultSection, ...] = ()
    """Scripted faults: kind, start_s, duration_s; delay_s of a delay, turn_deg of a turn."""


class OpencvSection(Section):
    """USB cameras through OpenCV."""

    left: str = ""
    """Serial number, or a path below /dev/v4l/by-id or /dev/v4l/by-path."""
    right: str | None = None
    """The same; left out when the left camera sends both eyes side by side."""
    fourcc: Annotated[str, Field(min_length=4, max_length=4)] = "MJPG"
    """Pixel format: MJPG, YUYV, ..."""
    width: Annotated[int, Field(gt=0)] = 1280
    """Of the picture of one eye, px."""
    height: Annotated[int, Field(gt=0)] = 720
    """Of the picture of one eye, px."""
    exposure_ms: Positive | None = None
    """Left out, it stays where the camera has it, like the other controls; none is automatic."""
    gain: NotNegative | None = None
    """In the camera's own unit."""
    white_balance_k: Positive | None = None
    """Colour temperature."""
    focus: NotNegative | None = None
    """In the camera's own unit."""
    max_skew_ms: NotNegative = 5.0
    """Pictures that are farther apart in time make no pair; below half of the frame period."""
    max_age_ms: Positive = 250.0
    """Older pictures are dropped."""

    @property
    def controls(self) -> dict[str, float]:
        """Those that are asked for."""
        asked = {
            "exposure_ms": self.exposure_ms,
            "gain": self.gain,
            "white_balance_k": self.white_balance_k,
            "focus": self.focus,
        }
        return {name: value for name, value in asked.items() if value is not None}


class DepthaiSection(Section):
    """The mono pair of an OAK camera."""

    device: str = ""
    """Its id; empty when only one is connected."""
    width: Annotated[int, Field(gt=0)] = 1280
    """Of one picture, px."""
    height: Annotated[int, Field(gt=0)] = 720
    """Of one picture, px."""
    exposure_ms: Positive = 5.0
    """Of both eyes."""
    iso: Annotated[float, Field(ge=100.0, le=1600.0)] = 200.0
    """Sensitivity of both eyes."""
    ir_dots: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Brightness of the infrared dot projector; 0: off."""
    ir_flood: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Brightness of the infrared lamp; 0: off."""

    @property
    def controls(self) -> dict[str, float]:
        """By the driver's names."""
        return {
            "exposure_ms": self.exposure_ms,
            "iso": self.iso,
            "ir_dots": self.ir_dots,
            "ir_flood": self.ir_flood,
        }


class CameraSection(BaseModel):
    """Where the pictures come from."""

    # Tables of third-party devices, [camera.NAME], are passed through unchecked.
    model_config = ConfigDict(
        frozen=True,
        extra="allow",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    backend: str = "simulated"
    """simulated, opencv, depthai, or the name of an installed device."""
    rig: str | None = None
    """Rig file (OpenCV YAML); simulated cameras bring their own."""
    rate_hz: Positive = 15.0
    """Pairs per second asked for, or assumed where a recording has no times."""
    depth_mm: Annotated[tuple[Positive, Positive], AfterValidator(_rising)] = (300.0, 700.0)
    """Nearest and farthest surface that the rig is used for."""
    simulated: SimulationSection = SimulationSection()
    """The simulated patient and rig."""
    opencv: OpencvSection = OpencvSection()
    """USB cameras through OpenCV."""
    depthai: DepthaiSection = DepthaiSection()
    """The mono pair of an OAK camera."""


class DisplaySimulationSection(Section):
    """The display that `navapp calibrate latency` shows to simulated cameras."""

    delay_ms: NotNegative = 40.0
    """From the call to the first refresh that can show it."""
    refresh_hz: Positive = 59.94
    """Refreshes in a second; a picture waits for the next one."""


class DisplaySection(Section):
    """Where the overlay is shown."""

    backend: Literal["simulated", "window"] = "simulated"
    """simulated, or window: a monitor or projector of this computer, covered from edge to edge."""
    output: str = ""
    """Name of the window's monitor or projector; empty: the only one."""
    size_px: tuple[Pixels, Pixels] | None = None
    """Width and height of that output; a window needs it."""
    flip_horizontally: bool = False
    """The window shows every picture with left and right exchanged."""
    flip_vertically: bool = False
    """The window shows every picture upside down."""
    valid_ms: Positive = 500.0
    """A picture without a newer one turns black after this."""
    delay_ms: NotNegative = 0.0
    """What is shown is seen so much later (calibrate latency), and withdrawn so much earlier."""
    simulated: DisplaySimulationSection = DisplaySimulationSection()
    """The display that simulated cameras see."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.backend == "window" and self.size_px is None:
            raise ValueError("a window needs size_px")
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
    """JSON file with the rough start pose."""


class TrackingSection(Section):
    """The line."""

    method: Literal["bimcc", "icp"] = "bimcc"
    """icp is the paper's baseline."""


class CalibrationSection(Section):
    """Calibration of the stereo rig."""

    stop_capture_mm: Positive = 0.15
    """A capture may end when half of the working volume has a predicted 95 % error below."""
    accept_mm: Positive = 0.40
    """A rig is accepted when nearly all of the working volume has a predicted 95 % error below."""
    working_depth_mm: Annotated[tuple[Positive, Positive], AfterValidator(_rising)] = (350.0, 550.0)
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
    """Name or number of the stage that a session starts in."""


class RecordingSection(Section):
    """Session folders."""

    folder: str | None = None
    """Record every session into this new folder."""
    pictures: bool = True
    """Keep the raw pairs (lossless PNG), so that the session can be replayed."""


class EmptySection(Section):
    """A table without keys."""


class Configuration(Section):
    """The whole file."""

    camera: CameraSection = CameraSection()
    display: DisplaySection = DisplaySection()
    projector: ProjectorSection = ProjectorSection()
    mirror: MirrorSection = MirrorSection()
    plan: PlanSection = PlanSection()
    stereo: EmptySection = EmptySection()
    registration: EmptySection = EmptySection()
    tracking: TrackingSection = TrackingSection()
    calibration: CalibrationSection = CalibrationSection()
    overlay: EmptySection = EmptySection()
    stages: StagesSection = StagesSection()
    recording: RecordingSection = RecordingSection()
    link: EmptySection = EmptySection()
    ui: EmptySection = EmptySection()
