"""DICOM series written for tests, and the check that every voxel was read where it was written."""

import locale
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import SimpleITK as sitk  # noqa: N813
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

UID = "1.2.826.0.1.3680043.8.498.1"


@dataclass
class Series:
    """A stack as it was recorded: stored values, and where each slice lies."""

    stored: np.ndarray
    positions_mm: np.ndarray
    row: tuple[float, float, float] = (1.0, 0.0, 0.0)
    column: tuple[float, float, float] = (0.0, 1.0, 0.0)
    pixel_mm: tuple[float, float] = (0.7, 0.5)
    tags: dict[str, Any] = field(default_factory=dict)

    def points_lps_mm(self) -> np.ndarray:
        """(D, H, W, 3) centres of all pixels, by the standard's equation C.7.6.2.1-1."""
        _, rows, columns = self.stored.shape
        down = np.arange(rows)[:, None, None] * self.pixel_mm[0] * np.array(self.column)
        along = np.arange(columns)[None, :, None] * self.pixel_mm[1] * np.array(self.row)
        return self.positions_mm[:, None, None, :] + (down + along)[None]

    def write(self, folder: Path, names: list[str] | None = None) -> list[Path]:
        """One file a slice."""
        folder.mkdir(exist_ok=True)
        names = names or [f"slice{k}" for k in range(len(self.stored))]
        files = [folder / name for name in names]
        for k, file in enumerate(files):
            self.dataset(k).save_as(file, enforce_file_format=True)
        return files

    def write_compressed(self, folder: Path, compressor: str) -> list[Path]:
        """The same by SimpleITK with "JPEG" (lossless) or "JPEG2000"; stacks along z only."""
        files = [folder / f"slice{k}.dcm" for k in range(len(self.stored))]
        writer = sitk.ImageFileWriter()
        writer.KeepOriginalImageUIDOn()
        writer.UseCompressionOn()
        writer.SetCompressor(compressor)
        # GDCM's writer leaves another locale behind.
        locale_before = locale.setlocale(locale.LC_CTYPE)
        for file, picture, place in zip(files, self.stored, self.positions_mm, strict=True):
            image = sitk.GetImageFromArray(picture.astype(np.int16)[None])
            image.SetSpacing((*self.pixel_mm[::-1], 2.0))
            image.SetOrigin(place.tolist())
            for key, value in (
                ("0008|0060", "CT"), ("0020|000e", UID), ("0020|0052", "1.2.3"),
                ("0020|0032", "\\".join(map(str, place))), ("0020|0037", "1\\0\\0\\0\\1\\0"),
            ):  # fmt: skip
                image.SetMetaData(key, value)
            writer.SetFileName(str(file))
            writer.Execute(image)
        locale.setlocale(locale.LC_CTYPE, locale_before)
        return files

    def dataset(self, k: int) -> FileDataset:
        """One slice."""
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = CTImageStorage
        meta.MediaStorageSOPInstanceUID = generate_uid()
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        slice_ = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
        slice_.SOPClassUID = CTImageStorage
        slice_.SOPInstanceUID = meta.MediaStorageSOPInstanceUID
        slice_.Modality = "CT"
        slice_.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
        slice_.SeriesInstanceUID = UID
        slice_.FrameOfReferenceUID = "1.2.3"
        slice_.SamplesPerPixel, slice_.PhotometricInterpretation = 1, "MONOCHROME2"
        slice_.Rows, slice_.Columns = self.stored.shape[1:]
        slice_.BitsAllocated, slice_.BitsStored, slice_.HighBit = 16, 16, 15
        slice_.PixelRepresentation = 1
        slice_.ImagePositionPatient = [float(f"{x:.6f}") for x in self.positions_mm[k]]
        slice_.ImageOrientationPatient = [float(f"{x:.9f}") for x in (*self.row, *self.column)]
        slice_.PixelSpacing = list(self.pixel_mm)
        slice_.RescaleSlope, slice_.RescaleIntercept = 1, 0
        slice_.PixelData = self.stored[k].astype("<i2").tobytes()
        for tag, value in self.tags.items():
            setattr(slice_, tag, value)
        return slice_


def axial(n: int = 6, step_mm: float = 2.0, **tags: Any) -> Series:
    """A stack that goes up, of values that are all different."""
    stored = np.random.default_rng(n).permutation(n * 12 * 10).reshape(n, 12, 10) - 700
    up = np.arange(n)[:, None] * [0.0, 0.0, step_mm]
    return Series(stored, np.array([-10.0, -20.0, 400.0]) + up, tags=tags)


def change(file: Path, **tags: Any) -> None:
    """Write a slice's file again with other tags; None removes one."""
    slice_ = pydicom.dcmread(file)
    for tag, value in tags.items():
        if value is None:
            delattr(slice_, tag)
        else:
            setattr(slice_, tag, value)
    slice_.save_as(file)


def assert_in_place(volume: Any, series: Series, hu: np.ndarray | None = None) -> None:
    """Every voxel that was recorded is in the volume, at its own place, and there are no more."""
    expected = series.stored if hu is None else hu
    indices = volume.indices_of(series.points_lps_mm().reshape(-1, 3))
    whole = np.round(indices).astype(int)
    np.testing.assert_allclose(indices, whole, atol=1e-5)
    assert len({tuple(index) for index in whole}) == volume.hu.size == expected.size
    i, j, k = whole.T
    np.testing.assert_allclose(volume.hu[k, j, i], expected.ravel(), rtol=1e-6)
