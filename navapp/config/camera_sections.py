"""The table `[camera]` with those of its backends: simulated, OpenCV and DepthAI."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from navapp.config.section import NotNegative, Positive, Section, check_rising


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
    tool: Literal["none", "pointer", "drill"] = "none"
    """Held into the view: its tip touches places on the femur, one after the other."""
    contrast: Annotated[float, Field(ge=0.0, le=0.2)] = 0.05
    """Of the bone's texture: standard deviation of its grey levels over their mean."""
    blood: Annotated[float, Field(ge=0.0, le=1.0)] = 0.3
    """0: dry; 1: very bloody."""
    highlights: Annotated[float, Field(ge=0.0, le=32.0)] = 1.0
    """Area of the wet highlights, times the usual one; 0: matt."""
    covered: Annotated[float, Field(ge=0.0, le=0.95)] = 0.0
    """Share of the bone behind a cloth, from the second picture on; 0: no cloth."""
    distance_mm: Annotated[float, Field(ge=200.0, le=1000.0)] = 450.0
    """Of the knee from the cameras."""
    baseline_mm: Annotated[float, Field(ge=20.0, le=300.0)] = 80.0
    """Distance of the two cameras."""
    light: Annotated[float, Field(gt=0.0, le=32.0)] = 1.0
    """On the sensors, times the usual light."""
    full_well_e: Annotated[float, Field(ge=50.0)] = 20000.0
    """Electrons of a saturated pixel: the fewer, the more noise."""
    read_noise_e: NotNegative = 7.0
    """Standard deviation of the noise of reading a pixel, electrons."""
    defocus_px: Annotated[float, Field(ge=0.0, le=20.0)] = 0.5
    """Standard deviation of the lenses' blur, px of the picture; usual is a sharp one."""
    misses: Annotated[float, Field(ge=0.0, le=2.0)] = 1.0
    """By how much saw and drill miss their plan: times 1 mm and 1.5 deg (standard deviations)."""
    scale: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """Size of the pictures: 1.0 is 1280 x 720."""
    stepped: bool | None = None
    """Whether frames wait to be read; by default in headless sessions only."""
    skew_ms: float = 0.0
    """The right camera exposes later by this."""
    unstamped_skew_ms: float = 0.0
    """The right camera exposes later by this as well, and its time stamps do not say so."""
    blur: bool = False
    """Whether what moves while a picture is exposed (8 ms) is blurred."""
    shutter_ms: Annotated[float, Field(ge=0.0, le=50.0)] = 0.0
    """Rolling shutter: the last row is exposed later than the first by this; 0: all at once."""
    shake_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0
    """Amplitude with which the arm that carries the cameras shakes; 0: it stands still."""
    shake_hz: Annotated[float, Field(gt=0.0, le=50.0)] = 8.0
    """Frequency of the shake."""
    drift_mm_s: Annotated[float, Field(ge=0.0, le=300.0)] = 0.0
    """Speed at which the leg is moved to and fro across the view, on top of its motion; 0: not."""
    grey: bool = False
    """Grey pictures, like those of an OAK camera."""
    board_s: Annotated[tuple[NotNegative, Positive], AfterValidator(check_rising)] | None = None
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
    depth_mm: Annotated[tuple[Positive, Positive], AfterValidator(check_rising)] = (300.0, 700.0)
    """Nearest and farthest surface that the rig is used for."""
    simulated: SimulationSection = SimulationSection()
    """The simulated patient and rig."""
    opencv: OpencvSection = OpencvSection()
    """USB cameras through OpenCV."""
    depthai: DepthaiSection = DepthaiSection()
    """The mono pair of an OAK camera."""
