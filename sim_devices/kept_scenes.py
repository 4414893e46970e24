"""Scenes of the operation's states and what draws them: made when asked for, and kept."""

import threading
from dataclasses import dataclass, field, replace

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from sim_devices.anatomy import mirror_mesh
from sim_devices.fitted_parts import FittedParts
from sim_devices.operation import State
from sim_devices.renderer import Part, Renderer, Surfaces
from sim_devices.rigs import NO_TURN, Turn
from sim_devices.scenes import Scene, make_scene
from sim_devices.sensor import Eye
from sim_devices.site import Site
from sim_devices.textures import make_noise_tile

# What moves in the picture only as the rig shakes: half of a picture's cost, so it is kept.
STILL = frozenset({"drape"})
# States that are shown again soon: going back and forth makes none anew.
_KEPT_STATES = 4


@dataclass(slots=True)
class KeptScenes:
    """Scenes and renderers of the newest states. All methods may be called from any thread.

    Args:
        rig: that looks.
        site: as for a right knee.
        fitted: parts that are put in.
        surfaces: materials, texture, and lamps.
        seed: of the texture.
        is_left: the scenes are those of a left knee.
    """

    rig: StereoRig
    site: Site
    fitted: FittedParts
    surfaces: Surfaces
    seed: int
    is_left: bool
    _lock: threading.RLock = field(default_factory=threading.RLock, init=False)
    _scenes: dict[State, Scene] = field(default_factory=dict, init=False)
    _of_eyes: dict[tuple[State, Eye, float, Turn], Renderer] = field(
        default_factory=dict, init=False
    )
    _of_others: dict[tuple[State, Camera], Renderer] = field(default_factory=dict, init=False)

    def scene(self, state: State) -> Scene:
        """Made at the first call, and kept until others have taken its place."""
        with self._lock:
            if state not in self._scenes:
                self._forget_all_but_newest()
                made = make_scene(self.site, self.fitted, state)
                parts = tuple(self._mirror_if_left(part) for part in made.parts)
                self._scenes[state] = replace(made, parts=parts)
            return self._scenes[state]

    def renderer(self, state: State, eye: Eye, scale: float, turn_rad: Turn = NO_TURN) -> Renderer:
        """That of an eye of the rig as it stands: what lies still is drawn once and kept."""
        key = (state, eye, scale, turn_rad)
        with self._lock:
            if key not in self._of_eyes:
                rig = self.rig if scale == 1.0 else self.rig.scale(scale)
                camera = rig.left if eye == "left" else rig.right
                self._of_eyes[key] = self._make_renderer(state, camera, scale)
            return self._of_eyes[key]

    def renderer_for(self, state: State, camera: Camera) -> Renderer:
        """That of another camera, kept likewise."""
        key = (state, camera)
        with self._lock:
            if key not in self._of_others:
                self._of_others[key] = self._make_renderer(state, camera)
            return self._of_others[key]

    def _make_renderer(self, state: State, camera: Camera, scale: float = 1.0) -> Renderer:
        return Renderer(camera, self.scene(state).parts, self._surfaces_at(scale), STILL)

    def _forget_all_but_newest(self) -> None:
        """A renderer takes hundreds of MB, and an operation passes through a dozen states."""
        for old in list(self._scenes)[: -_KEPT_STATES + 1]:
            del self._scenes[old]
            self._of_eyes = {k: one for k, one in self._of_eyes.items() if k[0] != old}
            self._of_others = {k: one for k, one in self._of_others.items() if k[0] != old}

    def _surfaces_at(self, scale: float) -> Surfaces:
        """Smaller pictures need a blurred texture, or its finest octave would flicker."""
        if scale >= 0.8:
            return self.surfaces
        blur = 0.6 * (1.0 / scale - 1.0)
        tile = make_noise_tile(self.seed, round(blur, 1))
        return Surfaces(self.surfaces.materials, tile, self.surfaces.lamps)

    def _mirror_if_left(self, part: Part) -> Part:
        if not self.is_left:
            return part
        return Part(
            part.body, mirror_mesh(part.mesh), part.material, part.mark, part.exposure, -1.0
        )
