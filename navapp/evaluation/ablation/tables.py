"""The tables of an ablation as Markdown."""

from collections.abc import Sequence

from navapp.evaluation.ablation.rows import ALIKE_MM, ALL, SituationOrAll, VariantRow
from navapp.evaluation.methods import OURS, WITHOUT_FILL
from navapp.evaluation.paper.cases import SITUATIONS
from navapp.evaluation.report_parts import (
    format_mm,
    format_number,
    format_share,
    format_table,
    make_quick_note,
)

_ABOUT = (
    "`bimcc` is the method of the product; every other row leaves one part of it out, and follows "
    "the same pictures. TRE: mean over the stage's targets, of frames that are OK, and of all with "
    "a pose, refused ones too: where a bone is lost, these are poses that a search came upon. OK "
    "and wrong: OK, more than 1 mm off and more than the predicted bound. Within: share of OK "
    "frames within their bound. Alike: share of frames whose status is that of `bimcc`, and whose "
    f"TRE is within {ALIKE_MM:g} mm of it. ms: processing time of a frame from rectification to "
    "overlay, median and mean; the variants are timed one after the other, and rows with the same "
    "answers show how much such times scatter.\n"
)
_PARTS = (
    "- without filled depth: the fill of the depth around the bone tells what stands in front of "
    "it, so that guides are hidden behind hands and instruments. It is no part of the pose: what "
    "is measured here is its time.",
    "- without bidirectional pairs: measured points look for partners on the model, as in plain "
    "ICP; the model's points look for none. In a frame that begins within millimetres of the pose "
    "the whole method pairs this way as well: what can differ is the first registration, and the "
    "search for a bone that was lost.",
    "- without contour: the pose is that of the surface alone.",
    "- without second look: a bone whose pose is in doubt is not measured again without the "
    "highlights, the lamps that are mirrored in it.",
    "- without judge: every pose that is found is taken as OK and carried on, so that doubt begins "
    "no search either. This is what would have been shown.",
)
_COLUMNS = (
    "OK", "TRE mean OK, mm", "TRE mean of all poses, mm", "worst OK, mm", "OK and wrong", "within",
    "alike", "ms median", "ms mean",
)  # fmt: skip


def make_ablation_tables(
    rows: Sequence[VariantRow], about: Sequence[str], *, is_quick: bool
) -> str:
    """The whole of `ablation.md`.

    Args:
        rows: of all stages and situations, those of `ALL` among them.
        about: how it was made, a line each.
        is_quick: it is a short look, and says so.
    """
    parts = ["# What each part is worth, on simulated knees", ""]
    if is_quick:
        parts += make_quick_note("one short test of each case, times taken while others ran")
    parts += [*(f"- {line}" for line in about), "", _ABOUT, *_PARTS, ""]
    places = list(dict.fromkeys((row.stage, row.situation) for row in rows))
    for place in places:
        some = [row for row in rows if (row.stage, row.situation) == place]
        parts += [*_format_place(*place, some), ""]
    return "\n".join(parts)


def _format_place(stage: str, situation: SituationOrAll, rows: Sequence[VariantRow]) -> list[str]:
    """The table of one stage and situation; that of all has the registration's time as well."""
    is_all = situation == ALL
    head = ["", *_COLUMNS, *(["registration, s"] if is_all else [])]
    lines = [
        "## All stages and situations"
        if situation == ALL
        else f"## Stage {stage}, {SITUATIONS[situation].title}",
        "",
        f"Tests: {rows[0].n_tests}, frames: {rows[0].figures.n_frames}.",
        "",
        *format_table(head, (_format_row(row, has_registration=is_all) for row in rows)),
    ]
    return [*lines, "", _tell_fill(rows)] if is_all else lines


def _format_row(row: VariantRow, *, has_registration: bool) -> list[str]:
    figures = row.figures
    cells = [
        f"`{row.variant}`" if row.variant == OURS else row.variant,
        format_share(figures.ok_share),
        format_mm(figures.ok.mean_mm),
        format_mm(figures.mean_mm),
        format_mm(figures.ok.worst_mm),
        str(figures.n_wrong),
        format_share(figures.bound_coverage),
        format_share(row.n_alike / max(figures.n_frames, 1)),
        format_number(row.median_ms),
        format_number(row.mean_ms),
    ]
    return [*cells, format_number(row.registration_s, 2)] if has_registration else cells


def _tell_fill(rows: Sequence[VariantRow]) -> str:
    """What the fill changes and costs, of the rows of one place."""
    found = {row.variant: row for row in rows}
    whole, without = found[OURS], found[WITHOUT_FILL]
    told = (
        f"Without filled depth {without.n_same} of {without.figures.n_frames} frames have the same "
        "verdict, errors and bound to the last bit."
    )
    if whole.median_ms is None or without.median_ms is None:
        return told
    return (
        f"{told} The median frame took {whole.median_ms:.1f} ms with the fill, and "
        f"{without.median_ms:.1f} ms without it and the hiding of guides."
    )
