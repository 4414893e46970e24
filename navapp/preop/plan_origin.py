"""Where a plan's surfaces come from: facts for people, without the patient's identity."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

OriginKind = Literal["CT", "labels", "surfaces"]


@dataclass(frozen=True, slots=True)
class PlanOrigin:
    """Facts beside the plan's content; nothing that names the patient."""

    kind: OriginKind = "surfaces"  # what it was made from
    description: str = ""  # the series' own words, or an empty text
    spacing_mm: tuple[float, ...] = ()  # (i, j, k) of the volume; empty without one
    size: tuple[int, ...] = ()  # voxels (i, j, k)
    threshold_hu: float | None = None  # what is denser was looked at as bone
    cortex_hu: float | None = None  # density that cortex was found to have
    # standard deviations of the scanner's blur, in the slices and across.
    blur_mm: tuple[float, ...] = ()
    # bone -> share of its surface where the density told the edge.
    measured: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()  # what was assumed, mended or not found

    @property
    def ct(self) -> dict[str, Any] | None:
        """The volume as programs are told of it; None without one."""
        if not self.spacing_mm:
            return None
        return {
            "spacing_mm": list(self.spacing_mm),
            "size": list(self.size),
            "threshold_hu": self.threshold_hu,
            "cortex_hu": self.cortex_hu,
            "blur_mm": list(self.blur_mm),
        }


def origin_to_json(origin: PlanOrigin) -> dict[str, Any]:
    """What goes into plan.json."""
    return asdict(origin)


def origin_from_json(content: Mapping[str, Any]) -> PlanOrigin:
    """What `origin_to_json` made.

    Raises:
        KeyError, TypeError, ValueError: it is something else.
    """
    if content["kind"] not in ("CT", "labels", "surfaces"):
        raise ValueError(f"origin is of the unknown kind {content['kind']}")
    return PlanOrigin(
        content["kind"],
        str(content["description"]),
        tuple(float(step) for step in content["spacing_mm"]),
        tuple(int(n) for n in content["size"]),
        _number(content["threshold_hu"]),
        _number(content["cortex_hu"]),
        tuple(float(blur) for blur in content["blur_mm"]),
        {str(name): float(share) for name, share in content["measured"].items()},
        tuple(str(warning) for warning in content["warnings"]),
    )


def _number(value: Any) -> float | None:
    return None if value is None else float(value)
