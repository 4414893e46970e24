"""The option that chooses how a bone's pose is estimated."""

import argparse


def add_method(parser: argparse.ArgumentParser) -> None:
    """Declare `--method`."""
    parser.add_argument(
        "--method",
        choices=("bimcc", "paper", "icp"),
        help="to compare with: paper is the paper's proposal, icp its state of the art "
        "(what `navapp register` calls bimcc-literal and icp)",
    )
