"""What the program answers, bit for bit, to compare two checkouts on one machine.

usage: python -m tests.bench.freeze make FILE [--checkout FOLDER] [--only TEXT]
       python -m tests.bench.freeze compare BEFORE AFTER

`make` runs a fixed list of replays, simulated sessions and registrations through the command line
of a checkout (this one by default) and writes poses, verdicts, reasons and bounds to FILE.
`compare` prints one line for each case that differs and exits with 1 if there is one; with them
come the medians of error and bound, and the counts of OK and of wrong OK frames. Processors round
differently: make both files on the same machine. Only the command line is used, so that modules
and names may change between the two.
"""

import argparse
import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

DATA = Path(os.environ.get("NAVAPP_DATA", "../shared/data")).resolve()
_PHANTOMS = ("phantom_a", "phantom_c")
# Its femur is not its plan's any more: most frames are refused, after long searches.
_CUT = "cut_a"
_BONES = ("femur", "tibia")
# The paper's situations: motion of the leg, and what passes in front of it.
_SITUATIONS = {
    "registration": ("still", "none"),
    "overlay": ("breathing", "none"),
    "patient": ("patient", "none"),
    "instrument": ("breathing", "sweep"),
}
_SEEDS = (301, 302, 303, 304)
_SIMULATED_FRAMES = 24
_LOOP_FRAMES = 40
# A pose further off than this at the plan's targets must not be OK.
_WRONG_MM = 1.0
_WORKERS = 2
_TIMES = ("timing_ms", "register_ms")


@dataclass(frozen=True)
class Case:
    """One call of the command line.

    Attributes:
        name: of the case, unique.
        words: of the command line, without `--json`.
        files: name -> text, written next to the result; `{folder}` in the words stands for there.
        plan: bone -> PLY file of the plan `{plan}`; made first, once for all cases with the same.
        side: of that plan.
    """

    name: str
    words: tuple[str, ...]
    files: dict[str, str] = field(default_factory=dict)
    plan: dict[str, Path] = field(default_factory=dict)
    side: str = "right"

    @property
    def plan_name(self) -> str:
        """The same for cases with the same plan."""
        words = [*(f"{path.parent.name}-{path.stem}" for path in self.plan.values()), self.side]
        return "-".join(words)


def main() -> int:
    """Make a freeze, or compare two."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    make = verbs.add_parser("make")
    make.add_argument("file", type=Path)
    make.add_argument("--checkout", type=Path, default=Path.cwd())
    make.add_argument("--only", default="", help="cases whose name contains this")
    compare = verbs.add_parser("compare")
    compare.add_argument("before", type=Path)
    compare.add_argument("after", type=Path)
    options = parser.parse_args()
    if options.verb == "make":
        return write_freeze(options.file, options.checkout.resolve(), options.only)
    before, after = (json.loads(path.read_text()) for path in (options.before, options.after))
    return print_differences(before, after)


def write_freeze(path: Path, checkout: Path, only: str = "") -> int:
    """Run all cases in a checkout and write what they answer."""
    cases = [case for case in _cases() if only in case.name]
    with (
        tempfile.TemporaryDirectory() as plans,
        concurrent.futures.ThreadPoolExecutor(_WORKERS) as pool,
    ):
        runner = _Runner(checkout, Path(plans))
        list(pool.map(runner.make_plan, {case.plan_name: case for case in cases}.values()))
        answers = list(pool.map(runner.answer, cases))
    content = {case.name: answer for case, answer in zip(cases, answers, strict=True)}
    path.write_text(json.dumps(content, indent=1))
    return 0


def print_differences(before: dict[str, Any], after: dict[str, Any]) -> int:
    """Print the cases that differ and what became of errors, bounds and counts in them."""
    names = [name for name in before if name in after]
    changed = [name for name in names if before[name] != after[name]]
    print(f"{len(names)} cases, {len(changed)} differ; {len(set(before) ^ set(after))} in one only")
    if changed:
        print("| case | changed | OK | wrong OK | error mm, median | bound mm, median |")
        print("|---|---|---|---|---|---|")
    for name in changed:
        print(_row(name, before[name], after[name]))
    if changed:
        print(_row("all", *([one for k in names for one in some[k]] for some in (before, after))))
    return 1 if changed or set(before) != set(after) else 0


def _row(name: str, before: list[dict[str, Any]], after: list[dict[str, Any]]) -> str:
    n_changed = sum(a != b for a, b in zip(before, after, strict=False))
    n_changed += abs(len(before) - len(after))
    pairs = [
        " -> ".join(dict.fromkeys((one(before), one(after))))
        for one in (_count_ok, _count_wrong, _median_of("tre_mm"), _median_of("predicted_tre_mm"))
    ]
    return f"| {name} | {n_changed} of {len(before)} | " + " | ".join(pairs) + " |"


def _count_ok(answers: list[dict[str, Any]]) -> str:
    return str(sum(one.get("status") in ("OK", "CONVERGED") for one in answers))


def _count_wrong(answers: list[dict[str, Any]]) -> str:
    ok = [one for one in answers if one.get("status") == "OK"]
    return str(sum((one.get("tre_mm") or 0.0) > _WRONG_MM for one in ok))


def _median_of(key: str) -> Any:
    def median(answers: list[dict[str, Any]]) -> str:
        values = [one[key] for one in answers if one.get(key) is not None]
        return f"{np.median(values):.4f}" if values else "-"

    return median


def _cases() -> Iterator[Case]:
    """The fixed list; recorded cases are left out, and counted, where there are no data."""
    found = [DATA / name for name in (*_PHANTOMS, _CUT) if (DATA / name).is_dir()]
    if len(found) < len(_PHANTOMS) + 1:
        print(f"{len(_PHANTOMS) + 1 - len(found)} recorded knees are missing", file=sys.stderr)
    for phantom in found:
        yield from _recorded(phantom) if phantom.name in _PHANTOMS else _cut(phantom)
    for situation in _SITUATIONS:
        for seed in _SEEDS:
            yield _simulated(f"simulated/{situation}/{seed}", seed, situation)
    yield from _simulated_faults()
    yield from _registered()


def _recorded(phantom: Path) -> Iterator[Case]:
    """Every order of every sequence and bone; lost bones, boxes, cones; what is wrong for good."""
    for bone in _BONES:
        plan = {bone: phantom / f"{bone}.ply"}
        for sequence in ("registration", "patient", "instrument"):
            folder = phantom / sequence
            # Unrelated frames in a row lose the bone and search for it.
            yield _replay(f"{bone}/forward", folder, plan, bone, "--order", "forward")
            yield _replay(f"{bone}/each", folder, plan, bone, "--order", "each", "--frames", "4")
            if sequence == "patient":
                words = ("--order", "pingpong", "--frames", str(_LOOP_FRAMES))
                yield _replay(f"{bone}/pingpong", folder, plan, bone, *words)
    femur = {"femur": phantom / "femur.ply"}
    both = {name: phantom / f"{name}.ply" for name in _BONES}
    folder = phantom / "patient"
    yield _replay("femur/also", folder, both, "femur", "--also", "tibia")
    for sequence in ("registration", "instrument"):
        words = ("--order", "each", "--frames", "2", "--method", "icp")
        yield _replay("femur/icp", phantom / sequence, femur, "femur", *words)
    for keys in (("approach_cone",), ("approach_cone", "box")):
        prior = json.loads((phantom / "registration" / "prior.json").read_text())
        text = json.dumps({key: prior[key] for key in keys})
        case = _replay(
            f"femur/{'-'.join(keys)}", phantom / "registration", femur, "femur",
            "--order", "each", "--frames", "1", prior="{folder}/prior.json",
        )  # fmt: skip
        yield Case(case.name, case.words, {"prior.json": text}, case.plan)
    case = _replay("femur/other_side", phantom / "registration", femur, "femur", "--frames", "2")
    yield Case(case.name, case.words, {"mirrored": ""}, case.plan, "left")
    case = _replay("femur/swapped", phantom / "patient", femur, "femur", "--frames", "3")
    words = tuple("{folder}/swapped" if word == str(folder) else word for word in case.words)
    yield Case(case.name, words, {"swapped": str(folder)}, case.plan)


def _cut(phantom: Path) -> Iterator[Case]:
    """A bone that is not the plan's any more, registered and followed."""
    for bone in _BONES:
        plan = {bone: phantom / f"{bone}.ply"}
        words = ("--order", "each", "--frames", "2")
        yield _replay(f"{bone}/each", phantom / "registration", plan, bone, *words)
        yield _replay(f"{bone}/forward", phantom / "patient", plan, bone, "--frames", "4")


def _replay(
    name: str, folder: Path, plan: dict[str, Path], bone: str, *words: str, prior: str = ""
) -> Case:
    return Case(
        f"{folder.parent.name}/{folder.name}/{name}",
        (
            "replay", str(folder), "--rig", str(folder.parent / "rig.yml"), "--plan",
            "{plan}", "--prior", prior or str(folder / "prior.json"), "--bone", bone, *words,
        ),
        plan=plan,
    )  # fmt: skip


def _simulated(name: str, seed: int, situation: str, faults: str = "") -> Case:
    motion, instrument = _SITUATIONS.get(situation, (situation, "none"))
    side = "left" if seed % 2 else "right"
    settings = (
        f'[camera.simulated]\nseed = {seed}\nside = "{side}"\nmotion = "{motion}"\n'
        f'instrument = "{instrument}"\n{faults}'
    )
    words = ("run", "--headless", "--frames", str(_SIMULATED_FRAMES))
    return Case(name, ("--config", "{folder}/navapp.toml", *words), {"navapp.toml": settings})


def _simulated_faults() -> Iterator[Case]:
    """What loses the bone, or speaks against the pair."""
    yield _simulated("simulated/jump", 305, "jump")
    kinds = {
        "blackout": 'kind = "blackout_left"\nstart_s = 0.8\nduration_s = 0.4\n',
        "turn": 'kind = "turn"\nstart_s = 0.8\nduration_s = inf\nturn_deg = [0.1, 0.0, 0.0]\n',
    }
    for name, fault in kinds.items():
        text = f"[[camera.simulated.faults]]\n{fault}"
        yield _simulated(f"simulated/{name}", 306, "overlay", text)


def _registered() -> Iterator[Case]:
    """`navapp register` on whole bones and on partial scans."""
    bones, scans = DATA / "bones", DATA / "reg"
    if not bones.is_dir() or not scans.is_dir():
        return
    tibiae = bones / "pymskt/tibia_2.ply", bones / "knee_dess_R/tibia.ply"
    femora = bones / "pymskt/femur_2.ply", bones / "pymskt/femur_1.ply"
    for method in ("bimcc", "icp"):
        yield _register(f"{method}/tibia", *tibiae, "--method", method)
        yield _register(f"{method}/femur", *femora, "--method", method)
    yield _register("camera", *tibiae, "--camera", "0", "-400", "0")
    yield _register("whole", *femora, "--global")
    bunny = scans / "pcl_bunny"
    yield _register("bunny", bunny / "bun4.pcd", bunny / "bun0.pcd", "--units", "m", "--global")
    fricp = scans / "fricp_example"
    yield _register("fricp", fricp / "target.ply", fricp / "source.ply", "--units", "none")


def _register(name: str, scene: Path, model: Path, *words: str) -> Case:
    return Case(f"register/{name}", ("register", str(scene), str(model), *words))


class _Runner:
    """Runs cases in a checkout; plans are kept in a folder."""

    def __init__(self, checkout: Path, plans: Path) -> None:
        self._checkout, self._plans = checkout, plans

    def make_plan(self, case: Case) -> None:
        """Make the plan of a case."""
        if not case.plan:
            return
        folder = self._plans / case.plan_name
        folder.mkdir()
        surfaces = [
            word
            for bone, path in case.plan.items()
            for word in ("--surface", f"{bone}={_surface(case, path, folder)}")
        ]
        self._run(["plan", *surfaces, "--side", case.side, "--out", str(folder / "plan")])

    def answer(self, case: Case) -> list[dict[str, Any]]:
        """What is answered, without times; tells how long it took."""
        started = time.perf_counter()
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            _write_files(case, folder)
            result, plan = folder / "result.json", self._plans / case.plan_name / "plan"
            words = [
                word.replace("{folder}", name).replace("{plan}", str(plan)) for word in case.words
            ]
            said = self._run([*words, "--json", str(result)])
            answers = (
                list(_answers_of(json.loads(result.read_text())))
                if result.is_file()
                else [{"said": said.replace(name, "")}]
            )
        print(f"{time.perf_counter() - started:6.1f} s  {case.name}", file=sys.stderr, flush=True)
        return answers

    def _run(self, words: list[str]) -> str:
        """Run the command line; answers with its exit code and the last line of its errors."""
        done = subprocess.run(
            [sys.executable, "-m", "navapp", "--quiet", *words],
            cwd=self._checkout,
            env={**os.environ, "PYTHONPATH": str(self._checkout)},
            capture_output=True,
            text=True,
            check=False,
        )
        if "Traceback" in done.stderr:
            raise RuntimeError(f"{' '.join(words)}\n{done.stderr}")
        lines = done.stderr.strip().splitlines()
        return f"{done.returncode} {lines[-1] if lines else ''}"


def _write_files(case: Case, folder: Path) -> None:
    for name, text in case.files.items():
        if name == "swapped":
            (folder / name).mkdir()
            for picture in Path(text).glob("*.jpg"):
                side, number = picture.name.split("_")
                other = "right" if side == "left" else "left"
                (folder / name / f"{other}_{number}").symlink_to(picture)
        elif name != "mirrored":
            (folder / name).write_text(text)


def _surface(case: Case, path: Path, folder: Path) -> Path:
    """A plan's surface; of the other side's knee where the case asks for one."""
    if "mirrored" not in case.files:
        return path
    head, body = path.read_bytes().split(b"end_header\n", 1)
    n_vertices = int(head.split(b"element vertex ")[1].split()[0])
    kinds = [line.split()[1:] for line in head.splitlines() if line.startswith(b"property")]
    columns = [(name.decode(), "<f4") for kind, name, *_ in kinds if kind in (b"float", b"float32")]
    vertices = np.frombuffer(body, np.dtype(columns), n_vertices).copy()
    vertices["x"] *= -1.0
    faces = body[vertices.nbytes :]
    triangles = np.frombuffer(faces, np.dtype([("n", "u1"), ("v", "<i4", 3)])).copy()
    triangles["v"] = triangles["v"][:, ::-1]
    mirrored = folder / "mirrored.ply"
    mirrored.write_bytes(head + b"end_header\n" + vertices.tobytes() + triangles.tobytes())
    return mirrored


def _answers_of(result: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Each answer of a result without its times, bones apart."""
    if "frames" not in result:
        yield {key: value for key, value in result.items() if key not in _TIMES}
    for frame in result.get("frames", ()):
        kept = {key: value for key, value in frame.items() if key not in ("timing_ms", "bodies")}
        yield kept
        for name, body in frame["bodies"].items():
            yield {"bone": name, **{key: body[key] for key in body if key != "timing_ms"}}


if __name__ == "__main__":
    sys.exit(main())
