import grp
import os
from types import SimpleNamespace

import pytest

from drivers.discovery import permissions
from drivers.discovery.permissions import is_member, make_group_remedy, make_permission_remedy

GID = 4044


@pytest.fixture
def group(monkeypatch):
    """A group of its own and a user who is not root; its members can be changed."""
    group = SimpleNamespace(gr_name="video", gr_gid=GID, gr_mem=[])

    def by_name(name):
        if name != "video":
            raise KeyError(name)
        return group

    monkeypatch.setattr(grp, "getgrnam", by_name)
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(os, "getgroups", lambda: [1000])
    monkeypatch.setattr(permissions.getpass, "getuser", lambda: "ann")
    return group


def test_a_stranger_to_the_group_is_told_how_to_join(group):
    assert not is_member("video")
    assert make_group_remedy("video") == "sudo usermod -aG video $USER, then log out and in again"


def test_who_joined_after_logging_in_is_told_to_log_in_again(group):
    group.gr_mem.append("ann")
    assert make_group_remedy("video").startswith(
        "log out and in again: the user is in the group video"
    )


def test_a_member_is_one(group, monkeypatch):
    monkeypatch.setattr(os, "getgroups", lambda: [1000, GID])
    assert is_member("video")


def test_root_needs_no_group(group, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert is_member("video")


def test_a_group_that_the_system_does_not_have_has_no_members(group):
    assert not is_member("nobody-has-this")
    assert "usermod -aG nobody-has-this" in make_group_remedy("nobody-has-this")


@pytest.fixture
def device(tmp_path):
    path = tmp_path / "ttyUSB0"
    path.touch()
    path.chmod(0o660)
    return path


def test_a_device_is_opened_by_joining_the_group_that_owns_it(group, device, monkeypatch):
    monkeypatch.setattr(grp, "getgrgid", lambda gid: SimpleNamespace(gr_name="plugdev"))
    assert make_permission_remedy(device, "dialout").startswith("sudo usermod -aG plugdev $USER")


@pytest.mark.parametrize(("owner", "mode"), [("root", 0o660), ("dialout", 0o600)])
def test_of_a_device_that_no_group_may_use_udev_is_asked(group, device, monkeypatch, owner, mode):
    monkeypatch.setattr(grp, "getgrgid", lambda gid: SimpleNamespace(gr_name=owner))
    device.chmod(mode)
    assert make_permission_remedy(device, "dialout").startswith(
        f"let udev give {device} to the group dialout"
    )


def test_of_an_absent_device_the_usual_group_is_named(group, tmp_path):
    assert make_permission_remedy(tmp_path / "absent", "video").startswith("sudo usermod -aG video")
