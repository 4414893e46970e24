"""Removes a patient's identity from texts about a DICOM series."""

import re
from collections.abc import Iterable
from typing import Any

# What names the patient, or what a hospital's systems find the patient by.
NAMING_TAGS = (
    "PatientName", "PatientID", "PatientBirthDate", "OtherPatientNames", "OtherPatientIDs",
    "PatientBirthName", "PatientMotherBirthName", "PatientAddress", "PatientTelephoneNumbers",
    "AccessionNumber", "StudyID",
)  # fmt: skip
_HIDDEN = "[hidden]"
_BETWEEN_WORDS = re.compile(r"[\^=\\\s,;/]+")
# Shorter words are hidden only where they stand alone: they are parts of too many others.
_SHORT = 3


class Identity:
    """The words that identify a patient; `hide_in` takes them out of a text."""

    def __init__(self, values: Iterable[str] = ()) -> None:
        texts = {value.strip() for value in values}
        words = texts | {word for text in texts for word in _BETWEEN_WORDS.split(text)}
        # Longest first, so that no part of a longer one is left over.
        ordered = sorted((word for word in words if len(word) > 1), key=len, reverse=True)
        patterns = [_pattern(word) for word in ordered]
        self._any_word = re.compile("|".join(patterns), re.IGNORECASE) if patterns else None

    def hide_in(self, text: object) -> str:
        """The text without any of the words."""
        return self._any_word.sub(_HIDDEN, str(text)) if self._any_word else str(text)


def find_naming_values(header: Any) -> set[str]:
    """Values of a header's naming tags; `header` is pydicom's."""
    return {str(header.get(tag) or "") for tag in NAMING_TAGS} - {""}


def _pattern(word: str) -> str:
    escaped = re.escape(word)
    return escaped if len(word) >= _SHORT else rf"(?<![^\W_]){escaped}(?![^\W_])"
