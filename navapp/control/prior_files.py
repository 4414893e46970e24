"""Where a bone is searched for first, as JSON: of a file, and of a recorded command."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import PriorError
from navapp.geometry.directions import ViewCone
from navapp.geometry.transform import RigidTransform
from navapp.values import Pick, Prior

_POSE_KEY, _CONE_KEY = "camera_from_model", "approach_cone"


def read_prior(path: str | Path) -> Prior:
    """Read a prior file.

    Raises:
        PriorError: missing, no JSON, or values that are none.
    """
    path = Path(path)
    try:
        return prior_from_json(json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise PriorError(
            f"prior {path} cannot be read ({error.strerror})",
            subject=str(path),
            remedy="give the JSON file with the rough start pose",
        ) from error
    except (ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
        raise PriorError(
            f"prior {path} is damaged ({error})",
            subject=str(path),
            remedy="it holds camera_from_model (4x4), approach_cone, box and picks",
        ) from error


def prior_from_json(content: Mapping[str, Any]) -> Prior:
    """The prior of such a content; what is missing is not known.

    Raises:
        ValueError, TypeError, KeyError, IndexError, AttributeError: it is none.
    """
    poses = {
        key.removeprefix(_POSE_KEY).lstrip("_") or "femur": value
        for key, value in content.items()
        if key == _POSE_KEY or key.startswith(f"{_POSE_KEY}_")
    }
    cones = {
        key.removeprefix(_CONE_KEY).lstrip("_") or "femur": ViewCone.from_json(value)
        for key, value in content.items()
        if key == _CONE_KEY or key.startswith(f"{_CONE_KEY}_")
    }
    box = content.get("box")
    return Prior(
        {bone: RigidTransform("left", bone, value) for bone, value in poses.items()},
        cones,
        None if box is None else (int(box[0]), int(box[1]), int(box[2]), int(box[3])),
        tuple(_read_pick(pick) for pick in content.get("picks", ())),
    )


def _read_pick(pick: Mapping[str, Any]) -> Pick:
    u, v = pick["left_px"]
    model_mm = np.asarray(pick["model_mm"], dtype=np.float64).reshape(3)
    return Pick(str(pick["name"]), str(pick["bone"]), (float(u), float(v)), model_mm)


def prior_to_json(prior: Prior) -> dict[str, Any]:
    """The content of a prior file."""
    content: dict[str, Any] = {}
    for bone, pose in prior.left_from_bone.items():
        content[_POSE_KEY if bone == "femur" else f"{_POSE_KEY}_{bone}"] = pose.to_list()
    for bone, cone in prior.cones.items():
        content[_CONE_KEY if bone == "femur" else f"{_CONE_KEY}_{bone}"] = cone.to_json()
    if prior.box is not None:
        content["box"] = list(prior.box)
    if prior.picks:
        content["picks"] = [
            {
                "name": pick.name,
                "bone": pick.bone,
                "left_px": list(pick.left_px),
                "model_mm": np.asarray(pick.model_mm).tolist(),
            }
            for pick in prior.picks
        ]
    return content
