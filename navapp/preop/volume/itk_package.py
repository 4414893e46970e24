"""Imports SimpleITK at first use, and captures what its codecs print."""

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# How the codecs within say that bytes are wrong; they go on, and hand out what they made of them.
_COMPLAINT = re.compile(rb"corrupt|premature|not read completely|error", re.IGNORECASE)


def import_simple_itk() -> Any:
    """The module, its C++ warnings switched off, leaning NIfTI axes allowed (see volume_files)."""
    import SimpleITK as module  # noqa: N813 (a package's name)

    module.ProcessObject.GlobalWarningDisplayOff()
    # Else a NIfTI file with leaning axes is refused or, worse, read by another of its matrices.
    os.environ["ITK_NIFTI_SFORM_PERMISSIVE"] = "ON"
    return module


def voxels_of(image: Any) -> NDArray[Any]:
    """A copy of an image's voxels, axes k, j, i."""
    voxels: NDArray[Any] = np.asarray(import_simple_itk().GetArrayFromImage(image))
    return voxels


def lps_from_index_of(image: Any) -> NDArray[np.float64]:
    """(4, 4) matrix of an image: direction, spacing and origin, which SimpleITK holds in LPS."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(image.GetDirection(), (3, 3)) * image.GetSpacing()
    matrix[:3, 3] = image.GetOrigin()
    return matrix


@contextmanager
def listen_to_codecs() -> Iterator[Callable[[], bool]]:
    """Nothing written to file descriptor 2 shows; the value tells whether a codec complained.

    A JPEG codec that meets wrong bytes says so there alone, and its picture counts as read.
    """
    with tempfile.TemporaryFile() as heard:
        shown = os.dup(2)
        try:
            os.dup2(heard.fileno(), 2)

            def has_complained() -> bool:
                # By descriptor: the writer's place in the file is shared and must stay its own.
                size = os.fstat(heard.fileno()).st_size
                return _COMPLAINT.search(os.pread(heard.fileno(), size, 0)) is not None

            yield has_complained
        finally:
            os.dup2(shown, 2)
            os.close(shown)


def read_image(path: Path, image_io: str = "") -> Any:
    """An image from a file.

    Raises:
        RuntimeError: SimpleITK cannot read it; the text may name anything that is in the file.
    """
    reader = import_simple_itk().ImageFileReader()
    if image_io:
        reader.SetImageIO(image_io)
    reader.SetFileName(str(path))
    return reader.Execute()
