"""What Maharjan et al. 2020 print in their tables 1 to 3, and where the paper contradicts itself.

Alignment error of their state of the art and overlay error of their proposal, mm, each with frames
a second; copied as printed, judged by nobody.
"""

from dataclasses import dataclass

from navapp.evaluation.paper.cases import SITUATIONS, STAGE_NAMES, Case, SampleName


@dataclass(frozen=True, slots=True)
class Published:
    """A row of the paper's tables."""

    # state of the art, then proposal.
    icp_mm: float
    icp_fps: float
    paper_mm: float
    paper_fps: float


_Row = tuple[float, float, float, float]
# By stage, then situation, in the paper's order.
_TABLES: dict[SampleName, tuple[_Row, ...]] = {
    "man": (
        (0.65, 7, 0.52, 15), (0.46, 9, 0.40, 10), (0.50, 10, 0.40, 12), (0.61, 10, 0.55, 11),
        (0.77, 8, 0.62, 12), (0.56, 9, 0.44, 10), (0.60, 10, 0.37, 11), (0.56, 11, 0.42, 10),
        (0.73, 10, 0.65, 9), (0.71, 8, 0.64, 10), (0.82, 12, 0.69, 15), (0.79, 15, 0.58, 19),
        (0.58, 4, 0.51, 5), (0.76, 10, 0.61, 10), (0.63, 9, 0.55, 8), (0.71, 12, 0.58, 14),
        (0.98, 6, 0.72, 8), (0.76, 8, 0.71, 9), (0.73, 9, 0.71, 11), (0.71, 12, 0.58, 16),
    ),
    "woman": (
        (0.69, 8, 0.49, 10), (0.50, 9, 0.40, 10), (0.52, 10, 0.44, 12), (0.66, 10, 0.59, 11),
        (0.72, 8, 0.62, 12), (0.66, 9, 0.54, 10), (0.69, 10, 0.68, 11), (0.57, 11, 0.43, 10),
        (0.60, 10, 0.55, 9), (0.72, 8, 0.67, 9), (0.72, 12, 0.65, 12), (0.80, 16, 0.68, 19),
        (0.58, 4, 0.51, 4), (0.72, 13, 0.66, 12), (0.63, 9, 0.61, 10), (0.74, 12, 0.68, 15),
        (0.94, 6, 0.73, 8), (0.74, 8, 0.71, 9), (0.76, 8, 0.74, 11), (0.73, 11, 0.68, 15),
    ),
    "adult": (
        (0.64, 7, 0.53, 12), (0.44, 10, 0.42, 11), (0.55, 9, 0.45, 13), (0.67, 11, 0.56, 14),
        (0.73, 9, 0.65, 10), (0.54, 9, 0.47, 12), (0.63, 12, 0.47, 12), (0.53, 11, 0.44, 12),
        (0.75, 10, 0.65, 9), (0.72, 9, 0.63, 11), (0.84, 11, 0.79, 15), (0.79, 12, 0.68, 14),
        (0.68, 8, 0.61, 10), (0.76, 10, 0.61, 10), (0.64, 7, 0.61, 8), (0.73, 11, 0.68, 14),
        (0.93, 7, 0.82, 8), (0.76, 8, 0.71, 12), (0.71, 9, 0.65, 11), (0.76, 11, 0.53, 15),
    ),
}  # fmt: skip

CONTRADICTIONS: tuple[str, ...] = (
    "The abstract, section 4 and table 4 give the proposal 7.4 to 11.74 frames a second, and "
    "section 4 and table 4 give 9.4 to 13.94 to the state of the art. In tables 1 to 3 the "
    "proposal is faster in 48 of 60 rows and slower in 7: the two seem to be swapped there.",
    "Section 5 gives other figures: of the proposal 9.45 to 11.25 frames a second and 0.56 to "
    "0.67 mm, where the abstract has 0.57 to 0.61 mm; of the state of the art 12 to 15 and 0.6 to "
    "0.9 mm. 9.45 and 11.25 are the means of the two columns of table 1, of which one is the state "
    "of the art's.",
    "The state of the art's error is given as 0.69 to 0.72 mm; the means of tables 1 to 3 are 0.68 "
    "to 0.69 mm.",
    "Section 5 refers to a table 6; there is none.",
    "17 patients are named in section 4; tables 1 to 3 list 15, one for each sample and stage.",
    "All three tables are headed 'Sample 1'.",
    "The error is called alignment error of the one method and overlay error of the other, and no "
    "formula is given for either.",
)


def find_published(case: Case) -> Published:
    """The paper's row of a case."""
    place = STAGE_NAMES.index(case.stage) * len(SITUATIONS)
    place += tuple(SITUATIONS).index(case.situation)
    return Published(*_TABLES[case.sample][place])
