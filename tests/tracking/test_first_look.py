from dataclasses import replace

from navapp.tracking.first_look import doubted
from navapp.values import Reason
from tests.tracking.rooms import room


def test_a_different_pose_that_explains_as_much_makes_the_best_a_guess() -> None:
    a = room()
    frame = a.frames[0]
    truth = a.truth(frame)
    line = a.line
    pair, _ = line._rectified_pair(frame.left, frame.right, line._rectified(truth))
    pose = line._rectified(truth)
    fit = line.locator.search(pair, pose, line.settings.locator.tracking)
    turned = fit.pose.moved((0, 0, 0, 0, 0, 0.4), fit.pose.apply(line.centre_mm))
    other = replace(fit, estimate=replace(fit.estimate, camera_from_bone=turned))
    best, second = doubted([other, fit], [0.5, 0.52], line.model)
    assert best.pose is fit.pose
    assert second is other
    assert Reason.AMBIGUOUS in best.estimate.reasons
    assert doubted([other, fit], [0.3, 0.52], line.model)[0] is fit
    assert doubted([fit, fit], [0.5, 0.52], line.model)[0] is fit
