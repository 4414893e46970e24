"""Surgical content read from files, before it is put into a plan."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TypeVar

from navapp.errors import PlanError
from navapp.geometry.transform import FloatArray
from navapp.values import Plan, SurgicalContent

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class PlannedContent:
    """Surgical content, targets and curves (as `Plan` has them) with what was assumed."""

    content: SurgicalContent = field(default_factory=SurgicalContent)
    targets: Mapping[str, FloatArray] = field(default_factory=dict)
    curves: Mapping[str, FloatArray] = field(default_factory=dict)
    absent: tuple[str, ...] = ()  # centres that are said to be unknown: keys of landmarks
    warnings: tuple[str, ...] = ()

    def union(self, other: "PlannedContent") -> "PlannedContent":
        """Both together.

        Raises:
            PlanError: both have something of the same kind and name.
        """
        kinds = {
            one.name: _union(
                one.name, getattr(self.content, one.name), getattr(other.content, one.name)
            )
            for one in fields(SurgicalContent)
        }
        return PlannedContent(
            SurgicalContent(**kinds),
            _union("targets", self.targets, other.targets),
            _union("curves", self.curves, other.curves),
            self.absent + other.absent,
            self.warnings + other.warnings,
        )

    def put_into(self, plan: Plan) -> Plan:
        """The plan with all of this; its hash is made anew."""
        return replace(
            plan,
            targets={**plan.targets, **self.targets},
            curves={**plan.curves, **self.curves},
            content=self.content,
            digest="",
        )


def _union(kind: str, first: Mapping[str, T], second: Mapping[str, T]) -> dict[str, T]:
    for name in first:
        if name in second:
            raise PlanError(
                f"'{name}' is given twice among the {kind} of --contents and --markups",
                subject=name,
                remedy="keep one of them",
            )
    return {**first, **second}
