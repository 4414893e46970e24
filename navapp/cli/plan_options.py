"""Options of `navapp plan` of the form BONE=VALUE, and `--cartilage`."""

from pathlib import Path
from typing import TYPE_CHECKING

from navapp.errors import UsageError
from navapp.values import FOLLOWED_BONES

if TYPE_CHECKING:
    from navapp.preop import ImportedSurface
    from navapp.values import BoneModel


def parse_by_bone(option: str, entries: list[str], value: str, example: str) -> dict[str, str]:
    """Values of an option that is given once a bone, in the order given."""
    found: dict[str, str] = {}
    for entry in entries:
        name, equals, text = entry.partition("=")
        if not equals or not name or not text:
            raise UsageError(f"{option} {entry} is not NAME={value}", remedy=example)
        if name not in FOLLOWED_BONES:
            raise UsageError(
                f"{option}: '{name}' is no bone of the knee that is followed",
                remedy="use femur, tibia or patella",
            )
        if name in found:
            raise UsageError(
                f"{option}: the {name} is given twice", remedy=f"give one {option} a bone"
            )
        found[name] = text
    return found


def add_cartilage(bone: "BoneModel", text: str) -> "ImportedSurface":
    """The bone with the cartilage of a file, or of MEAN_MM:SD_MM."""
    from navapp.preop import ImportedSurface, import_cartilage, make_even_cartilage
    from navapp.preop.cartilage import LARGEST_MM

    if text.lower().endswith(".ply") or Path(text).is_file():
        return import_cartilage(bone, text)
    try:
        mean_mm, sd_mm = (float(word) for word in text.split(":"))
    except ValueError as error:
        raise UsageError(
            f"--cartilage {bone.name}={text} is neither a PLY file nor MEAN_MM:SD_MM",
            remedy=f"{bone.name}=cartilage.ply or {bone.name}=2.0:0.6",
        ) from error
    for what, value_mm in (("mean", mean_mm), ("standard deviation", sd_mm)):
        if not 0.0 <= value_mm <= LARGEST_MM:
            raise UsageError(
                f"--cartilage {bone.name}={text}: a {what} of {value_mm:g} mm is not possible",
                remedy=f"give 0 to {LARGEST_MM:g} mm",
            )
    return ImportedSurface(make_even_cartilage(bone, mean_mm, sd_mm), ())
