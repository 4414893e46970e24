"""Lists the DICOM series in a folder, and chooses one."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from navapp.errors import InputError
from navapp.preop.volume.dicom_headers import NO_UID, OtherFile, SliceHeader, is_dicom, read_header
from navapp.preop.volume.dicom_identity import Identity

# The directory of a medium: DICOM, but never a picture.
_DIRECTORY = "DICOMDIR"


@dataclass(frozen=True, slots=True)
class SeriesInfo:
    """One series of a folder."""

    uid: str  # SeriesInstanceUID, by which it is chosen; "none" where there is none
    description: str  # the series' own words, without the patient's identity
    modality: str  # "CT" or another
    n_slices: int  # files of it
    size: tuple[int, int]  # pixels along a row and along a column
    is_localizer: bool  # an overview to plan the scan on, not a volume

    def __str__(self) -> str:
        words = self.description or "no description"
        return f"{self.uid} ({self.modality} '{words}', {_count_text(self.n_slices, 'slice')})"


@dataclass(frozen=True, slots=True)
class Folder:
    """All DICOM headers of a folder."""

    shown: str  # the folder's path, fit to be shown
    series: dict[str, list[SliceHeader]]  # slices by series
    others: tuple[OtherFile, ...]  # DICOM files that are no slices
    n_foreign: int  # files that are not DICOM at all
    identity: Identity  # takes the patient out of a text

    def make_error(self, problem: str, remedy: str) -> InputError:
        """An error about this folder; the problem follows the folder's name."""
        return InputError(f"{self.shown} {problem}", subject=self.shown, remedy=remedy)

    def name_of(self, file: Path) -> str:
        """A file's name, fit to be shown."""
        return self.identity.hide_in(file.name)

    def infos(self) -> tuple[SeriesInfo, ...]:
        """Its series, the one with most slices first."""
        infos = [self._info(uid, slices) for uid, slices in self.series.items()]
        return tuple(sorted(infos, key=lambda info: (-info.n_slices, info.uid)))

    def _info(self, uid: str, slices: Sequence[SliceHeader]) -> SeriesInfo:
        first = slices[0]
        return SeriesInfo(
            uid,
            self.identity.hide_in(first.description),
            first.modality,
            len(slices),
            (first.columns, first.rows),
            "LOCALIZER" in first.image_type,
        )


def list_series(folder: str | Path) -> tuple[SeriesInfo, ...]:
    """The series of a folder and of those below it, the one with most slices first.

    Raises:
        InputError: no folder, nothing in it, or no DICOM slice.
    """
    return scan_folder(Path(folder)).infos()


def scan_folder(path: Path) -> Folder:
    """Read all headers of a folder and of those below it.

    Raises:
        InputError: nothing in it, or no DICOM slice.
    """
    if not path.is_dir():
        raise InputError(
            f"{path} is no folder", subject=str(path), remedy="name the folder of a DICOM series"
        )
    files = sorted(
        file
        for file in path.rglob("*")
        # A link that leads nowhere may stand for a slice.
        if (file.is_file() or not file.exists())
        and not file.name.startswith(".")
        and file.name.upper() != _DIRECTORY
    )
    dicom = [file for file in files if is_dicom(file)]
    found, names = [], set()
    for file in dicom:
        header, naming = read_header(file)
        found.append(header)
        names |= naming
    identity = Identity(names)
    series: dict[str, list[SliceHeader]] = {}
    for header in found:
        if isinstance(header, SliceHeader):
            series.setdefault(header.series_uid, []).append(header)
    folder = Folder(
        identity.hide_in(path),
        series,
        tuple(header for header in found if isinstance(header, OtherFile)),
        len(files) - len(dicom),
        identity,
    )
    if not series:
        raise _without_slices(folder, n_files=len(files))
    return folder


def choose_series(folder: Folder, uid: str | None) -> tuple[SeriesInfo, list[str]]:
    """The series to read, and what was passed over: the one that is named, or the only volume.

    Raises:
        InputError: none of that name, or several volumes and no name.
    """
    infos = folder.infos()
    listed = "; ".join(str(info) for info in infos)
    if uid is not None:
        named = [info for info in infos if info.uid == uid]
        if not named:
            raise folder.make_error(
                "holds no series of that UID", remedy=f"choose one with --series UID: {listed}"
            )
        return named[0], []
    volumes = [info for info in infos if info.n_slices > 1 and not info.is_localizer]
    if len(volumes) > 1 or (not volumes and len(infos) > 1):
        raise folder.make_error(
            f"holds {len(infos)} series", remedy=f"choose one with --series UID: {listed}"
        )
    chosen = volumes[0] if volumes else infos[0]
    passed = [
        f"left out: series {info}, which is no volume" for info in infos if info is not chosen
    ]
    return chosen, passed


def check_others(folder: Folder, uid: str) -> list[str]:
    """Refuse a series that may be short of a slice; say how many files were left out.

    Raises:
        InputError: a file of the series, or one that does not say whose it is, is damaged.
    """
    unusable = [other for other in folder.others if other.why]
    for other in unusable:
        if other.series_uid in (NO_UID, uid):
            raise folder.make_error(
                f"holds the file {folder.name_of(other.file)}, and {other.why}",
                remedy="export the series again, or move that file away if it is not of the series",
            )
    warnings = []
    if unusable:
        files = _count_text(len(unusable), "file")
        warnings.append(f"left out: {files} of another series, because {unusable[0].why}")
    if folder.n_foreign:
        warnings.append(f"left out: {_count_text(folder.n_foreign, 'file')} without DICOM in it")
    return warnings


def _count_text(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _without_slices(folder: Folder, n_files: int) -> InputError:
    if not n_files:
        return folder.make_error("is empty", remedy="name the folder of a DICOM series")
    whys = Counter(other.why for other in folder.others if other.why)
    if whys:
        why, count = whys.most_common(1)[0]
        return folder.make_error(
            f"holds no slice that can be used: of {count} files each fails because {why}",
            remedy="export the series again as single slices, or as NIfTI",
        )
    if folder.others:
        return folder.make_error(
            "holds DICOM files but no pictures", remedy="name the folder of a CT series"
        )
    return folder.make_error(
        "holds no DICOM file",
        remedy="name the folder of a DICOM series, or a NIfTI, NRRD or MHA file itself",
    )
