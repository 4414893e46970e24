"""Lists the outputs of the X server, in a child process.

SDL takes signals, threads and a connection for good when it starts, and a broken graphics library
may end the process: neither is for the application. `python -m drivers.discovery.screens` prints
one line of JSON: the outputs, or why there are none.
"""

import json
import subprocess
import sys
from dataclasses import asdict

from drivers.child_python import find_last_words, run_python
from drivers.discovery.listing import Listing, Unseen
from drivers.window_outputs import Output, list_outputs, start_sdl
from navapp.errors import DeviceError

_PATIENCE_S = 15.0


def list_screens() -> Listing[Output]:
    """Every output, and what keeps SDL from seeing or telling them apart."""
    try:
        done = run_python("-m", "drivers.discovery.screens", timeout_s=_PATIENCE_S)
        answer = json.loads(done.stdout)
    except subprocess.TimeoutExpired:
        return _blind(f"the X server does not answer within {_PATIENCE_S:.0f} s", "start it again")
    except ValueError:
        return _blind(
            f"SDL ended while it was asked ({find_last_words(done)})", "see navapp doctor"
        )
    if "problem" in answer:
        return _blind(answer["problem"], answer["remedy"])
    found = tuple(Output(**output) for output in answer["outputs"])
    return Listing(found, tuple(_twins(found)))


def _twins(found: tuple[Output, ...]) -> list[Unseen]:
    """Outputs that no name tells apart."""
    names = [output.name for output in found]
    return [
        Unseen(
            name,
            f"{names.count(name)} outputs are called '{name}', so that none can be chosen by name",
            "connect only one of them, or give them other connectors",
        )
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]


def _blind(problem: str, remedy: str) -> Listing[Output]:
    return Listing((), (Unseen("display", problem, remedy),))


def main() -> None:
    """Tell the outputs."""
    answer: dict[str, object]
    try:
        start_sdl()
        answer = {"outputs": [asdict(output) for output in list_outputs()]}
    except DeviceError as error:
        answer = {"problem": error.problem, "remedy": error.remedy}
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    main()
