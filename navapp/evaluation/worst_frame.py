"""The frame of a test in which an accepted pose was worst, drawn with both outlines."""

from collections.abc import Sequence

import numpy as np

from navapp.evaluation.following import Answers
from navapp.evaluation.scores import FrameScore
from navapp.evaluation.sequence import KnownSequence
from navapp.geometry.box import Box
from navapp.geometry.zbuffer import render

# BGR: where the bone is, and where it is drawn.
_TRUE, _DRAWN = (255, 255, 255), (80, 220, 60)
_MARGIN_PX, _WIDTH_PX, _QUALITY = 30, 420, 80


def draw_worst_frame(
    sequence: KnownSequence, answers: Answers, scores: Sequence[FrameScore]
) -> bytes | None:
    """A JPEG around the bone: true outline white, the estimated one green; None without a frame.

    Of all frames that the judge calls OK the one with the largest error, else the first one.
    """
    ok = [one for one in scores if one.is_ok and one.tre_mm is not None]
    index = max(ok, key=lambda one: one.tre_mm or 0.0).index if ok else 0
    return None if sequence.truth[index] is None else draw_frame(sequence, answers, index)


def draw_frame(sequence: KnownSequence, answers: Answers, index: int) -> bytes | None:
    """A JPEG of one frame around the bone; None when neither pose is known, or it is out of view.

    Where the truth is not known as a pose, the estimated outline stands alone.
    """
    import cv2

    true, drawn = sequence.truth[index], answers.poses[index]
    around = true or drawn
    if around is None:
        return None
    surface = answers.surface
    left = sequence.frames[index].left
    image = np.repeat(left[:, :, None], 3, axis=2) if left.ndim == 2 else left.copy()
    camera = sequence.rig.left
    for pose, colour in ((true, _TRUE), (drawn, _DRAWN)):
        if pose is not None:
            mask = render(surface, pose, camera).mask.astype(np.uint8)
            rims, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            cv2.drawContours(image, rims, -1, colour, 1, cv2.LINE_AA)
    box = Box.around(camera.project(around.apply(surface.vertices_mm)))
    part = None if box is None else box.grow(_MARGIN_PX).clip(camera.width, camera.height)
    if part is None or part.is_empty:
        return None
    shown = image[part.slices]
    height = max(1, round(shown.shape[0] * _WIDTH_PX / shown.shape[1]))
    reduced = cv2.resize(shown, (_WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    done, encoded = cv2.imencode(".jpg", reduced, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return encoded.tobytes() if done else None
