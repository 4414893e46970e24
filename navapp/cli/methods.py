"""The option that chooses how a bone's pose is estimated."""

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from navapp.registration.register import Method as RegisterMethod
    from navapp.tracking import Method

# The method of a session, and the one of `navapp register` that it uses in each frame.
REGISTER_METHODS: "dict[Method, RegisterMethod]" = {
    "bimcc": "bimcc",
    "paper": "bimcc-literal",
    "icp": "icp",
}


def add_method(parser: argparse.ArgumentParser) -> None:
    """Declare `--method`."""
    paper, icp = REGISTER_METHODS["paper"], REGISTER_METHODS["icp"]
    parser.add_argument(
        "--method",
        choices=tuple(REGISTER_METHODS),
        help="to compare with: paper is the paper's proposal, icp its state of the art "
        f"(what `navapp register` calls {paper} and {icp})",
    )
