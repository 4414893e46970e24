"""The unknowns of a solve by views, and where they put every mark."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.seen_views import Marks
from navapp.geometry.camera import Camera, distort
from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, rotation_from_vector

# Numbers that all views share: fx fy cx cy k1 k2 p1 p2 of the eye's camera; of the screen a turn
# (rad), a shift (mm), relative pitch, bulge (mm); of the glass thickness (mm) and two tilts (rad).
N_LENS, N_SCREEN, N_SHARED = 8, 16, 19
# Numbers of a view: turn and shift of the eye's camera, turn and shift of the board.
N_VIEW = 12


@dataclass(frozen=True, slots=True, eq=False)
class ViewState:
    """Values of all unknowns."""

    lens: FloatArray  # (8,) fx fy cx cy k1 k2 p1 p2, px
    screen: VirtualScreen
    glass: Glass
    # eye_turn, eye_shift: (V, 3, 3), (V, 3) mm, eye's camera from left camera, per view.
    eye_turn: FloatArray
    eye_shift: FloatArray
    # board_turn, board_shift: (V, 3, 3), (V, 3) mm, left camera from board, per view.
    board_turn: FloatArray
    board_shift: FloatArray

    @property
    def centres_mm(self) -> FloatArray:
        """(V, 3) of the eye's camera in the left camera's frame."""
        centres: FloatArray = -np.einsum("vji,vj->vi", self.eye_turn, self.eye_shift)
        return centres

    def camera(self, size: tuple[int, int]) -> Camera:
        """The eye's camera, whose pictures have that width and height."""
        fx, fy, cx, cy = self.lens[:4]
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        return Camera(matrix, self.lens[4:], *size)

    def move(self, shared: FloatArray, views: FloatArray) -> "ViewState":
        """Changed by (19,) and (V, 12), in the order of the numbers above."""
        screen, glass = self.screen, self.glass
        if shared[16:].any():
            axes = perpendicular_axes(glass.normal[None])[0]
            glass = Glass(
                max(0.0, glass.thickness_mm + float(shared[16])),
                rotation_from_vector(shared[17:19] @ axes) @ glass.normal,
                glass.refractive_index,
            )
        if shared[8:16].any():
            screen = screen.move(shared[8:11], shared[11:14]).resize(
                screen.pitch_mm * (1.0 + float(shared[14])), screen.bulge_mm + float(shared[15])
            )
        turns, board_turns = _turns(views[:, :3]), _turns(views[:, 6:9])
        return ViewState(
            self.lens + shared[:N_LENS],
            screen,
            glass,
            turns @ self.eye_turn,
            np.einsum("vij,vj->vi", turns, self.eye_shift) + views[:, 3:6],
            board_turns @ self.board_turn,
            self.board_shift + views[:, 9:],
        )

    def only(self, kept: NDArray[np.bool_]) -> "ViewState":
        """Of some views."""
        return replace(
            self,
            eye_turn=self.eye_turn[kept],
            eye_shift=self.eye_shift[kept],
            board_turn=self.board_turn[kept],
            board_shift=self.board_shift[kept],
        )


def _turns(vectors_rad: FloatArray) -> FloatArray:
    """(V, 3, 3) of rotation vectors (V, 3)."""
    if not vectors_rad.any():
        return np.repeat(np.eye(3)[None], len(vectors_rad), axis=0)
    return np.array([rotation_from_vector(one) for one in vectors_rad])


def predict(state: ViewState, marks: dict[str, Marks], rig: StereoRig) -> dict[str, FloatArray]:
    """(n, 2) px of every mark, by its kind."""
    found = {}
    if "eye_screen" in marks:
        table = marks["eye_screen"]
        found["eye_screen"] = _see(state, state.screen.points_mm(table.places), table.view)
    if "eye_site" in marks:
        table = marks["eye_site"]
        points = on_board_mm(state, table)
        apparent = state.glass.apparent_mm(points, state.centres_mm[table.view])
        found["eye_site"] = _see(state, apparent, table.view)
    if "left" in marks:
        found["left"] = rig.left.project(on_board_mm(state, marks["left"]))
    if "right" in marks:
        points = rig.right_from_left.apply(on_board_mm(state, marks["right"]))
        found["right"] = rig.right.project(points)
    return found


def on_board_mm(state: ViewState, table: Marks) -> FloatArray:
    """(n, 3) of marks on the board, in the left camera's frame."""
    turned = np.einsum("nij,nj->ni", state.board_turn[table.view], table.places)
    points: FloatArray = turned + state.board_shift[table.view]
    return points


def _see(state: ViewState, points_mm: FloatArray, view: NDArray[np.intp]) -> FloatArray:
    """(n, 2) px in the eye's camera of points (n, 3) of the left camera's frame."""
    in_eye = np.einsum("nij,nj->ni", state.eye_turn[view], points_mm) + state.eye_shift[view]
    depth = np.where(in_eye[:, 2] > 1.0, in_eye[:, 2], np.nan)
    x, y = distort(in_eye[:, 0] / depth, in_eye[:, 1] / depth, state.lens[4:])
    fx, fy, cx, cy = state.lens[:4]
    return np.column_stack([fx * x + cx, fy * y + cy])
