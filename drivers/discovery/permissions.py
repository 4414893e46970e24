"""Whether this user may open a device file, and the command that grants it."""

import getpass
import grp
import os
import stat
from pathlib import Path

_GROUP_MAY = stat.S_IRGRP | stat.S_IWGRP


def may_use(path: Path) -> bool:
    """Whether it can be read and written: by its group, by a desktop's own grant, or as root."""
    return os.access(path, os.R_OK | os.W_OK)


def is_member(group: str) -> bool:
    """Whether this process belongs to a group; root needs none."""
    if os.geteuid() == 0:
        return True
    try:
        return grp.getgrnam(group).gr_gid in (os.getegid(), *os.getgroups())
    except KeyError:
        return False


def make_permission_remedy(path: Path, usual: str) -> str:
    """What to do so that this user may use a device file, whose group is usually that."""
    try:
        status = path.stat()
        group = grp.getgrgid(status.st_gid).gr_name
    except (OSError, KeyError):
        return make_group_remedy(usual)
    if group != "root" and status.st_mode & _GROUP_MAY == _GROUP_MAY:
        return make_group_remedy(group)
    return f"let udev give {path} to the group {usual} (MODE 0660); {make_group_remedy(usual)}"


def make_group_remedy(group: str) -> str:
    """What to do to become a member."""
    try:
        is_listed = getpass.getuser() in grp.getgrnam(group).gr_mem
    except (KeyError, OSError):
        is_listed = False
    if is_listed and not is_member(group):
        return f"log out and in again: the user is in the group {group}, this session is not yet"
    return f"sudo usermod -aG {group} $USER, then log out and in again"
