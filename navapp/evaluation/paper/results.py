"""Writes what a campaign has found: tables, report, JSON and every frame as CSV."""

from collections.abc import Iterator, Sequence
from typing import Any

from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.frame_figures import FrameFigures
from navapp.evaluation.judge.figures import JudgeFigures, judge_method
from navapp.evaluation.judge.findings import JudgeFindings, examine_judge
from navapp.evaluation.methods import OURS
from navapp.evaluation.paper.cases import INSTRUMENT_S, SWEEP_FRAMES, Case, CaseTest
from navapp.evaluation.paper.charts import draw_errors, draw_stages
from navapp.evaluation.paper.report import make_report
from navapp.evaluation.paper.rows import Row, make_row
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.paper.summary import compare_with_paper
from navapp.evaluation.paper.tables import make_tables
from navapp.evaluation.peers.rows import make_peer_rows
from navapp.evaluation.peers.scores import read_peers
from navapp.evaluation.peers.tables import format_peers, make_peer_csv
from navapp.evaluation.provenance import describe_origin, name_processor
from navapp.evaluation.report_parts import SIMULATED_NOTE, make_frames_csv
from navapp.evaluation.scores import FrameScore
from navapp.geometry.whole_files import write_whole


def write_results(folder: CampaignFolder[CaseTest], settings: TableSettings) -> dict[str, Any]:
    """Write tables, report, charts and every frame of what is done; the rows for programs.

    Where other people's trackers were run: their rows too, and `peers.csv`.
    """
    done = list(folder.read(is_timed=False))
    timed = done if settings.is_quick else list(folder.read(is_timed=True))
    rows = [
        make_row(case, method, _select_case(case, done), _select_case(case, timed))
        for case in settings.cases
        for method in settings.methods
        if _select_case(case, done)
    ]
    judged = [judge_method(method, _list_knees(method, done)) for method in settings.methods]
    findings = _examine(done)
    peers = read_peers(folder.path, settings.tests)
    peer_rows = make_peer_rows(peers, done, timed)
    tables = make_tables(
        rows,
        judged,
        _describe_run(settings, done, timed),
        [*findings.to_lines(), *format_peers(peer_rows)],
        is_quick=settings.is_quick,
    )
    write_whole(folder.path / "tables.md", tables.encode())
    pictures = _find_pictures(folder, settings, done)
    report = make_report(tables, rows, pictures, findings.draw())
    write_whole(folder.path / "report.html", report.encode())
    write_whole(folder.path / "stages.svg", draw_stages(rows).encode())
    write_whole(folder.path / "errors.svg", draw_errors(rows).encode())
    write_whole(folder.path / "frames.csv", make_case_csv(done, "method").encode())
    if peers:
        write_whole(folder.path / "peers.csv", make_peer_csv(peers).encode())
    return {
        "origin": describe_origin(),
        "rows": [row.to_json() for row in rows],
        "peers": [row.to_json() for row in peer_rows],
        "summary": _summarise(rows, judged, settings, done) | findings.to_json(),
    }


def _select_case(case: Case, done: Sequence[Done[CaseTest]]) -> list[Done[CaseTest]]:
    return [one for one in done if one.test.case == case]


def _list_knees(
    method: str, done: Sequence[Done[CaseTest]]
) -> list[tuple[int, Sequence[FrameScore]]]:
    return [(one.test.seed, one.scores[method].frames) for one in done]


def _examine(done: Sequence[Done[CaseTest]]) -> JudgeFindings:
    """Our method alone: the judge was made for it."""
    knees: dict[str, list[Sequence[FrameScore]]] = {}
    for one in done:
        if OURS in one.scores:
            knees.setdefault(one.test.case.situation, []).append(one.scores[OURS].frames)
    return examine_judge(knees)


def _describe_run(
    settings: TableSettings, done: Sequence[Done[CaseTest]], timed: Sequence[Done[CaseTest]]
) -> list[str]:
    return [
        describe_origin(),
        f"{len(done)} of {len(settings.tests)} tests, each another knee, {settings.n_frames} "
        f"frames each after the registration; first seed {settings.first_seed}",
        _tell_sweep(settings),
        "age changes the fine relief of the simulated bones only: 0.10 mm (20 to 30) against "
        "0.15 mm (35 to 45), root mean square",
        *_tell_machines(timed),
        SIMULATED_NOTE,
    ]


def _tell_machines(timed: Sequence[Done[CaseTest]]) -> list[str]:
    """Where times were taken, unless that is told already."""
    machines = {one.machine for one in timed}
    if machines <= {name_processor()}:
        return []
    return [f"times were taken on: {'; '.join(sorted(machines))}"]


def _tell_sweep(settings: TableSettings) -> str:
    """How much of an instrument's passing the tests have."""
    if settings.is_quick:
        return (
            f"a quick look ends before an instrument comes, {INSTRUMENT_S[0]:g} s after the start"
        )
    return (
        f"tests with an instrument have {max(settings.n_frames, SWEEP_FRAMES)} frames: it lies "
        f"before the bone from {INSTRUMENT_S[0]:g} to {INSTRUMENT_S[1]:g} s, and has passed once"
    )


def _summarise(
    rows: Sequence[Row],
    judged: Sequence[JudgeFigures],
    settings: TableSettings,
    done: Sequence[Done[CaseTest]],
) -> dict[str, Any]:
    return {
        "tests": len(done),
        "of": len(settings.tests),
        "quick": settings.is_quick,
        "judged": {one.method: one.to_json() for one in judged},
        "beside_the_paper": compare_with_paper(rows),
    }


def _find_pictures(
    folder: CampaignFolder[CaseTest], settings: TableSettings, done: Sequence[Done[CaseTest]]
) -> dict[Case, bytes]:
    """For each case, the picture of the test with the largest error that is OK."""
    pictures = {}
    for case in settings.cases:
        with_picture = [
            one for one in _select_case(case, done) if folder.picture_of(one.test).is_file()
        ]
        if with_picture:
            worst = max(with_picture, key=_worst_mm)
            pictures[case] = folder.picture_of(worst.test).read_bytes()
    return pictures


def _worst_mm(done: Done[CaseTest]) -> float:
    ours = done.scores.get(OURS)
    return 0.0 if ours is None else FrameFigures(ours.frames).ok.worst_mm or 0.0


def make_case_csv(done: Sequence[Done[CaseTest]], what: str) -> str:
    """Every frame of the tests as CSV; `what` heads the column of names: method or variant."""

    def list_frames() -> Iterator[tuple[Sequence[object], FrameScore]]:
        for one in done:
            test, case = one.test, one.test.case
            for name, scores in one.scores.items():
                keys = case.sample, case.stage, case.situation, test.number, test.seed, name
                yield from ((keys, frame) for frame in scores.frames)

    return make_frames_csv(("sample", "stage", "situation", "test", "seed", what), list_frames())
