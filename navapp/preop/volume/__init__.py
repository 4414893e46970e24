"""Reads a CT: voxels in HU with their places, checked before use."""

from navapp.preop.volume.ct_volume import CtVolume, LabelVolume
from navapp.preop.volume.dicom_listing import SeriesInfo, list_series
from navapp.preop.volume.volume_reading import CtSource, ReadCt, read_ct, read_labels

__all__ = [
    "CtSource",
    "CtVolume",
    "LabelVolume",
    "ReadCt",
    "SeriesInfo",
    "list_series",
    "read_ct",
    "read_labels",
]
