"""PCD files made by hand."""

import struct

import numpy as np

CLOUD = np.array([[1000.125, -2.5, 3.0], [4.0, 5.0, -6.0], [0.5, 0.25, 0.125]])


def lines(table):
    return "".join(" ".join(str(value) for value in row) + "\n" for row in table).encode()


def pcd_head(n, kind, fields="x y z", letter="F", size=4, counts=None):
    names = fields.split()
    return (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
        f"FIELDS {fields}\nSIZE {' '.join([str(size)] * len(names))}\n"
        f"TYPE {' '.join([letter] * len(names))}\n"
        f"COUNT {' '.join(counts or ['1'] * len(names))}\n"
        f"WIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {kind}\n"
    ).encode()


def pcd(kind, table=CLOUD, fields="x y z", letter="F", size=4, counts=None):
    """A file made by hand; packed data is written as runs only, which is allowed."""
    head = pcd_head(len(table), kind, fields, letter, size, counts)
    if kind == "ascii":
        return head + lines(table)
    stored = np.asarray(table).astype(f"<{letter.lower()}{size}")
    if kind == "binary":
        return head + stored.tobytes()
    widths = [int(n) for n in counts or ["1"] * len(fields.split())]
    parts = np.split(stored, np.cumsum(widths)[:-1], axis=1)
    raw = b"".join(part.tobytes() for part in parts)
    packed = b"".join(
        bytes([len(raw[at : at + 32]) - 1]) + raw[at : at + 32] for at in range(0, len(raw), 32)
    )
    return head + struct.pack("<II", len(packed), len(raw)) + packed
