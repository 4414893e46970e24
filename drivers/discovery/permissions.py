"""Whether this user may use a device file, and how to become one who may."""

import getpass
import grp
import os
from pathlib import Path


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


def group_of(path: Path, usual: str) -> str:
    """The group that owns a device file; the usual one when that cannot be told, or is root's."""
    try:
        name = grp.getgrgid(path.stat().st_gid).gr_name
    except (OSError, KeyError):
        return usual
    return usual if name == "root" else name


def joining(group: str) -> str:
    """What to do to become a member."""
    try:
        is_listed = getpass.getuser() in grp.getgrnam(group).gr_mem
    except (KeyError, OSError):
        is_listed = False
    if is_listed and not is_member(group):
        return f"log out and in again: the user is in the group {group}, this session is not yet"
    return f"sudo usermod -aG {group} $USER, then log out and in again"
