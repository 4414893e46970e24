import dataclasses

import cv2
import numpy as np
import pytest

from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.rig import RigQuality, StereoRig
from navapp.geometry.rig_files import read_rig, write_rig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from tests.geometry.shapes import STRONG, camera, toed_in_rig

NUMBERS = ("K1", "D1", "K2", "D2", "R", "T")


def numbers_of(rig):
    return [
        rig.left.matrix,
        rig.left.distortion,
        rig.right.matrix,
        rig.right.distortion,
        rig.right_from_left.matrix,
    ]


def storage_file(path, entries):
    """A file as another program would write it."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in entries.items():
        if isinstance(value, tuple):
            storage.startWriteStruct(name, cv2.FILE_NODE_SEQ | cv2.FILE_NODE_FLOW)
            for item in value:
                storage.write("", item)
            storage.endWriteStruct()
        else:
            storage.write(name, value)
    storage.release()
    return path


def plain_entries():
    rig = toed_in_rig()
    return {
        "image_width": 640,
        "image_height": 480,
        "K1": np.array(rig.left.matrix),
        "D1": rig.left.distortion.reshape(1, -1).copy(),
        "K2": np.array(rig.right.matrix),
        "D2": rig.right.distortion.reshape(-1, 1).copy(),
        "R": np.array(rig.right_from_left.rotation),
        "T": rig.right_from_left.translation_mm.reshape(3, 1).copy(),
    }


def test_a_rig_reads_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(8)
    for _ in range(20):
        left = camera(rng.normal(size=12) / 7.0, focal_px=700 + rng.random())
        right = camera(rng.normal(size=5) / 7.0, focal_px=700 + rng.random())
        pose = RigidTransform.from_parts(
            "right", "left", rotation_from_vector(rng.normal(size=3) / 9), rng.normal(size=3) * 40
        )
        rig = StereoRig(left, right, pose, ("A1", "B2"), RigQuality(True, (), 0.1 + 1 / 3), "bench")
        write_rig(tmp_path / "rig.yml", rig)
        again = read_rig(tmp_path / "rig.yml")
        for before, after in zip(numbers_of(rig), numbers_of(again), strict=True):
            assert after.tobytes() == before.tobytes()
        assert (again.width, again.height) == (640, 480)
        assert (again.serials, again.quality, again.name) == (rig.serials, rig.quality, rig.name)
        assert again.rig_id == rig.rig_id


def test_a_rig_without_distortion_keeps_its_identity(tmp_path):
    rig = StereoRig(camera(), camera(), toed_in_rig().right_from_left)
    write_rig(tmp_path / "rig.yml", rig)
    again = read_rig(tmp_path / "rig.yml")
    assert again.rig_id == rig.rig_id
    assert not again.left.is_distorted


def test_the_file_is_plain_opencv_yaml(tmp_path):
    write_rig(tmp_path / "rig.yml", toed_in_rig())
    assert (tmp_path / "rig.yml").read_text(encoding="utf-8").startswith("%YAML:1.0\n")
    storage = cv2.FileStorage(str(tmp_path / "rig.yml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("K2").mat(), toed_in_rig().right.matrix)
    np.testing.assert_array_equal(
        storage.getNode("T").mat().reshape(-1), toed_in_rig().right_from_left.translation_mm
    )
    assert storage.getNode("image_width").real() == 640
    storage.release()


@pytest.mark.parametrize("ending", ["yml", "yaml", "xml", "json"])
def test_storage_of_other_programs_is_read(tmp_path, ending):
    rig = read_rig(storage_file(tmp_path / f"stereo.{ending}", plain_entries()))
    for before, after in zip(numbers_of(toed_in_rig()), numbers_of(rig), strict=True):
        np.testing.assert_allclose(after, before, rtol=1e-14, atol=1e-16)
    assert rig.quality is None
    assert rig.serials == ("", "")
    assert rig.name == "stereo"


@pytest.mark.parametrize(
    "names",
    [
        ("M1", "D1", "M2", "D2"),
        ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"),
        (
            "camera_matrix_1",
            "distortion_coefficients_1",
            "camera_matrix_2",
            "distortion_coefficients_2",
        ),
    ],
)
def test_synonyms_are_understood(tmp_path, names):
    entries = plain_entries()
    for ours, theirs in zip(("K1", "D1", "K2", "D2"), names, strict=True):
        entries[theirs] = entries.pop(ours)
    assert read_rig(storage_file(tmp_path / "r.yml", entries)).rig_id == toed_in_rig().rig_id


@pytest.mark.parametrize("name", ["size", "image_size"])
@pytest.mark.parametrize("form", [(640, 480), np.array([[640.0], [480.0]])])
def test_the_size_may_be_one_entry(tmp_path, name, form):
    entries = plain_entries()
    del entries["image_width"], entries["image_height"]
    rig = read_rig(storage_file(tmp_path / "r.yml", {name: form, **entries}))
    assert (rig.width, rig.height) == (640, 480)


@pytest.mark.parametrize("size", [(640,), (), 640, "large", (640.0, float("inf"))])
def test_a_size_that_is_none_is_refused(tmp_path, size):
    entries = plain_entries()
    del entries["image_width"], entries["image_height"]
    with pytest.raises(RigError, match=r"r\.yml"):
        read_rig(storage_file(tmp_path / "r.yml", {"size": size, **entries}))


@pytest.mark.parametrize("missing", NUMBERS)
def test_a_missing_key_is_named(tmp_path, missing):
    entries = plain_entries()
    del entries[missing]
    with pytest.raises(RigError, match=rf"r\.yml lacks {missing}:"):
        read_rig(storage_file(tmp_path / "r.yml", entries))


@pytest.mark.parametrize("missing", ["image_width", "image_height"])
def test_a_missing_size_is_named(tmp_path, missing):
    entries = plain_entries()
    del entries[missing]
    with pytest.raises(RigError, match="lacks image_width and image_height"):
        read_rig(storage_file(tmp_path / "r.yml", entries))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("K1", np.eye(2)),
        ("K1", 7.0),
        ("K2", "sharp"),
        ("D1", np.zeros((1, 3))),
        ("D1", np.full((1, 5), np.nan)),
        ("R", np.diag([1.0, 1.0, -1.0])),
        ("R", np.array([[0.01], [0.02], [0.03]])),
        ("T", np.zeros((3, 1))),
        ("T", np.ones((4, 1))),
        ("image_width", -640),
        ("image_width", "wide"),
        ("image_height", float("inf")),
        ("accepted", "perhaps"),
    ],
)
def test_impossible_numbers_are_refused_by_file_name(tmp_path, key, value):
    path = storage_file(tmp_path / "r.yml", {**plain_entries(), key: value})
    with pytest.raises(RigError, match=r"r\.yml") as caught:
        read_rig(path)
    assert caught.value.subject == str(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\n",
        b"just words",
        bytes(range(256)) * 8,
        b"%YAML:1.0\n---\n",
        b"%YAML:1.0\n---\nK1: [1, 2",
        b"%YAML:1.0\n---\n- 1\n- 2\n",
        b"%YAML:1.0\n---\nK1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1. ]\n",
        b'<?xml version="1.0"?>\n<opencv_storage>\n<K1>',
        b'{"K1": ',
        b"\x89PNG\r\n\x1a\n",
    ],
)
@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_garbage_is_refused_by_file_name(tmp_path, content, ending):
    path = tmp_path / f"garbage.{ending}"
    path.write_bytes(content)
    with pytest.raises(RigError, match=rf"garbage\.{ending}"):
        read_rig(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RigError, match=r"nowhere\.yml does not exist"):
        read_rig(tmp_path / "nowhere.yml")


def test_a_file_cut_anywhere_never_loses_its_verdict(tmp_path):
    """A cut file is refused, or it still says everything: above all that it was not accepted."""
    quality = RigQuality(False, ("the holdout error is too large",), 0.9)
    rig = dataclasses.replace(toed_in_rig(), quality=quality)
    write_rig(tmp_path / "whole.yml", rig)
    content = (tmp_path / "whole.yml").read_bytes()
    refused = 0
    for length in range(len(content)):
        (tmp_path / "cut.yml").write_bytes(content[:length])
        try:
            again = read_rig(tmp_path / "cut.yml")
        except RigError:
            refused += 1
            continue
        assert again.rig_id == rig.rig_id, length
        assert (again.quality, again.serials) == (quality, rig.serials), length
    assert refused > 0.95 * len(content)


@pytest.mark.parametrize(
    "quality",
    [
        None,
        RigQuality(True),
        RigQuality(True, (), 0.0),
        RigQuality(True, (), 0.12345678901234568),
        RigQuality(False, ("baseline: 5 % off", 'it says "no"', "größer als erlaubt"), 1.5),
        RigQuality(False, ("first; second", "third"), None),
    ],
)
def test_the_quality_record_comes_back(tmp_path, quality):
    write_rig(tmp_path / "r.yml", dataclasses.replace(toed_in_rig(), quality=quality))
    assert read_rig(tmp_path / "r.yml").quality == quality


@pytest.mark.parametrize("text", ["", "plain", "with: colon", "größe", '"quoted" and \\', "12345"])
def test_names_and_serials_come_back(tmp_path, text):
    write_rig(
        tmp_path / "r.yml", dataclasses.replace(toed_in_rig(), name=text, serials=(text, "R"))
    )
    again = read_rig(tmp_path / "r.yml")
    assert (again.name, again.serials) == (text, (text, "R"))


def test_the_identity_changes_with_any_number():
    rig = toed_in_rig()

    def with_camera(side, matrix=None, distortion=None, size=(640, 480)):
        old = getattr(rig, side)
        new = Camera(
            old.matrix if matrix is None else matrix,
            old.distortion if distortion is None else distortion,
            *size,
        )
        return dataclasses.replace(rig, **{side: new})

    others = []
    for side in ("left", "right"):
        for place in ((0, 0), (1, 1), (0, 2), (1, 2)):
            matrix = np.array(getattr(rig, side).matrix)
            matrix[place] += 1e-6
            others.append(with_camera(side, matrix=matrix))
        for place in range(5):
            distortion = np.array(getattr(rig, side).distortion)
            distortion[place] += 1e-9
            others.append(with_camera(side, distortion=distortion))
    for axis in range(3):
        twist = np.zeros(6)
        for place, amount in ((axis, 1e-6), (axis + 3, 1e-7)):
            twist[:] = 0.0
            twist[place] = amount
            moved = rig.right_from_left.move(twist, np.zeros(3))
            others.append(dataclasses.replace(rig, right_from_left=moved))
    others.append(rig.scale(0.5))
    assert len({rig.rig_id, *(other.rig_id for other in others)}) == len(others) + 1


def test_the_identity_is_of_the_numbers_only():
    rig = toed_in_rig()
    named = dataclasses.replace(rig, name="other", serials=("1", "2"), quality=RigQuality(True))
    assert named.rig_id == rig.rig_id
    # Coefficients that are zero, written or not, are the same lens.
    padded = dataclasses.replace(
        rig,
        left=Camera(rig.left.matrix, np.r_[rig.left.distortion, 0.0, 0.0, -0.0], 640, 480),
    )
    assert padded.rig_id == rig.rig_id


def test_a_scaled_rig_sees_the_same_rays():
    rig = dataclasses.replace(toed_in_rig(), quality=RigQuality(True))
    half = rig.scale(0.5)
    points = np.random.default_rng(1).uniform((-50, -50, 300), (50, 50, 600), (20, 3))
    np.testing.assert_allclose(
        half.right.project(half.right_from_left.apply(points)),
        0.5 * (rig.right.project(rig.right_from_left.apply(points)) + 0.5) - 0.5,
        atol=1e-9,
    )
    assert (half.width, half.height) == (320, 240)
    assert (half.baseline_mm, half.serials) == (rig.baseline_mm, rig.serials)
    assert (half.quality, half.name) == (rig.quality, rig.name)


def test_impossible_rigs_are_refused():
    pose = toed_in_rig().right_from_left
    with pytest.raises(ValueError, match="same picture size"):
        StereoRig(camera(), camera((), 320, 240), pose)
    with pytest.raises(ValueError, match="right_from_left"):
        StereoRig(camera(), camera(), pose.inverse())
    with pytest.raises(ValueError, match="no baseline"):
        StereoRig(camera(), camera(STRONG), RigidTransform.identity("right", "left"))
