"""Tables of numbers in text files of other programs."""

import io
import re

import numpy as np

from navapp.geometry.raw_surface import UnusableContentError
from navapp.geometry.transform import FloatArray


def whole_text(content: bytes) -> str:
    """Decoded; refused when the last line has no end, as it may have lost digits."""
    text = content.decode("utf-8-sig", errors="replace")
    last = text[max(text.rfind("\n"), text.rfind("\r")) + 1 :].strip()
    if last and not last.startswith("#"):
        raise UnusableContentError("it may be cut short, as its last line has no line break")
    return text


def number_table(text: str) -> FloatArray:
    """(N, C) numbers of a text; a line is divided by commas or by blanks."""
    body = re.sub(r"#[^\r\n]*", "", text)
    if not body.strip():
        raise UnusableContentError("it holds no numbers")
    delimiter = "," if "," in body else None
    try:
        return np.loadtxt(io.StringIO(body), delimiter=delimiter, comments=None, ndmin=2)
    except ValueError as error:
        raise UnusableContentError(
            "its lines do not hold numbers alone, and as many in each of them"
        ) from error
