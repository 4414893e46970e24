"""Recognises the format of a rig's file, and reads and writes rigs in every known format."""

from pathlib import Path
from typing import Literal, get_args

from calibration.exchange import kalibr, ros
from calibration.exchange.yaml_files import read_mapping
from navapp.errors import UsageError
from navapp.geometry.rig import StereoRig
from navapp.geometry.rig_files import read_rig, write_rig

Format = Literal["opencv-yaml", "opencv-xml", "ros", "kalibr"]
FORMATS: tuple[Format, ...] = get_args(Format)
_ENDINGS: dict[Format, tuple[str, ...]] = {
    "opencv-yaml": (".yml", ".yaml"),
    "opencv-xml": (".xml",),
    "ros": ("",),
    "kalibr": (".yml", ".yaml"),
}


def read_any(path: str | Path) -> tuple[StereoRig, Format]:
    """Read a rig, and tell its format by what is in it.

    Raises:
        RigError: as the reader of its format.
    """
    path = Path(path)
    if path.is_dir():
        return ros.read_ros(path), "ros"
    start = path.read_bytes()[:200].lstrip() if path.is_file() else b""
    if start.startswith(b"<"):
        return read_rig(path), "opencv-xml"
    # OpenCV's YAML has a first line that plain YAML does not allow, its JSON a brace.
    if not start.startswith((b"%YAML", b"{")) and path.is_file():
        keys = read_mapping(path, "rig")
        if any(str(key).startswith("cam") and str(key)[3:].isdigit() for key in keys):
            return kalibr.read_kalibr(path), "kalibr"
        if "camera_matrix" in keys:
            raise UsageError(
                f"{path} is one camera of a ROS pair", remedy="give the folder that holds both"
            )
    return read_rig(path), "opencv-yaml"


def format_of_name(path: str | Path) -> Format:
    """The format that the name of a new file stands for.

    Raises:
        UsageError: none.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending in _ENDINGS["kalibr"] and "camchain" in path.name.lower():
        return "kalibr"
    for form in FORMATS:
        if ending in _ENDINGS[form]:
            return form
    raise UsageError(
        f"{path} does not say what format is wanted",
        remedy=f"let it end in .yml or .xml, or be a folder, or add --to {'|'.join(FORMATS)}",
    )


def write_as(form: Format, path: str | Path, rig: StereoRig) -> None:
    """Write a rig.

    Raises:
        UsageError: a name that does not suit the format.
        RigError: the format cannot say what the rig is.
    """
    path = Path(path)
    if path.suffix.lower() not in _ENDINGS[form]:
        names = (
            " or ".join(_ENDINGS[form]) if _ENDINGS[form] != ("",) else "no ending: it is a folder"
        )
        raise UsageError(f"{path} does not suit {form}", remedy=f"a name with {names}")
    if form == "ros":
        ros.write_ros(path, rig)
    elif form == "kalibr":
        kalibr.write_kalibr(path, rig)
    else:
        write_rig(path, rig)


def list_losses(rig: StereoRig, form: Format) -> list[str]:
    """What a format cannot say of a rig, one sentence each."""
    if form in ("opencv-yaml", "opencv-xml"):
        return []
    told = []
    if any(rig.serials):
        told.append(f"{form} has no place for serial numbers: other cameras will not be noticed")
    if rig.quality is not None:
        told.append(
            f"{form} has no place for the quality record: verdict, date, expiry and covariance "
            "are lost"
        )
    if rig.quality is not None and not rig.quality.is_accepted:
        why = "; ".join(rig.quality.reasons) or "no reason is recorded"
        told.append(f"the rig was not accepted ({why}), and the new file does not say so")
    return told
