"""The paper's contour refinement: the pose whose outline lies on the edges of both pictures.

Source: the paper, section 3.1, equation (4): contour points of the model are searched along their
normals in the left and the right picture; the mean of the squared distances is least.
"""

import numpy as np

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel
from navapp.tracking.outline import OutlineMeter
from navapp.values import DisparityMap

# All chosen. The outline slides over the surface as the bone turns: it is found anew so often.
_ROUNDS = 2
# So few edges move nothing.
_FEWEST = 12
# Length at which a turn counts as much as a shift, and the least share of the largest singular
# value at which a direction is moved: the outline may leave some of them free.
_ARM_MM, _LEAST_SHARE = 30.0, 0.05


class ContourRefiner:
    """Refines poses of one bone under one rig."""

    def __init__(self, model: RegistrationModel, outline: OutlineMeter) -> None:
        self._model, self._outline = model, outline

    def refine(
        self, pair: RectifiedPair, pose: RigidTransform, measured: DisparityMap
    ) -> RigidTransform:
        """The pose (rectified left camera from bone) on the contour; unmoved without edges.

        Args:
            pair: rectified around the bone.
            pose: of the bone.
            measured: surface; an edge counts only where the bone is measured inside it.
        """
        model = self._model
        arm = np.repeat((1.0, _ARM_MM), 3)
        for _ in range(_ROUNDS):
            view = model.render(pose, pair.geometry, measured.box)
            block = self._outline.block(pair, pose, view, measured)
            if len(block.residual) < _FEWEST:
                break
            step = np.linalg.lstsq(block.jacobian / arm, block.residual, _LEAST_SHARE)[0] / arm
            pose = pose.move(step, pose.apply(model.centre_mm))
        return pose
