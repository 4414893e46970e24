"""The part of a plan's summary in which a person scrolls through slices, without any network."""

import base64
import json
import math
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.preop.plan_view import PlanView
from navapp.preop.slice_drawing import (
    BONE_COLOURS,
    OTHER_COLOUR,
    POINT_COLOURS,
    WINDOWS_HU,
    choose_scale_mm,
)
from navapp.preop.slices import DIRECTIONS, Direction, Picture

# Every second slice, and fewer of a large volume: the page stays below some megabytes.
_LEAST_STEP = 2
_MOST_PIXELS = 8_000_000
_JPEG_QUALITY = 80
# Contours are written in tenths of a pixel.
_FINER = 10

SLICES_STYLE = """
.slices { display: flex; flex-wrap: wrap; gap: 1.2em; align-items: flex-start; }
.slices figure { margin: 0; flex: 1 1 20em; max-width: 34em; }
.slices svg { width: 100%; background: #000; display: block; }
.slices input { width: 100%; }
.slices text { fill: #fff; font: 5px system-ui, sans-serif; paint-order: stroke; stroke: #000;
  stroke-width: .8px; }
.bone { padding: 0 .5em; background: #1a202c; border-radius: .3em; margin-right: .4em; }
"""

_SCRIPT = """
const data = JSON.parse(document.getElementById("slice-data").textContent);
const make = (kind, into, facts, text) => {
  const part = document.createElementNS("http://www.w3.org/2000/svg", kind);
  for (const name in facts) part.setAttribute(name, facts[name]);
  if (text !== undefined) part.textContent = text;
  into.appendChild(part);
  return part;
};
const build = (direction, into) => {
  const [w, h] = direction.size, figure = document.createElement("figure");
  const said = document.createElement("figcaption"), range = document.createElement("input");
  const list = document.createElement("div");
  into.appendChild(figure);
  figure.appendChild(said);
  const svg = make("svg", figure, {viewBox: `0 0 ${w} ${h}`});
  const image = make("image", svg, {width: w, height: h, preserveAspectRatio: "none"});
  const lines = make("g", svg, {transform: `scale(${1 / data.finer})`, fill: "none"});
  const points = make("g", svg, {});
  const [left, right, top, bottom] = direction.marks;
  make("text", svg, {x: 2, y: h / 2}, left);
  make("text", svg, {x: w - 6, y: h / 2}, right);
  make("text", svg, {x: w / 2, y: 6}, top);
  make("text", svg, {x: w / 2, y: h - 2}, bottom);
  make("rect", svg, {x: 3, y: h - 5, width: direction.scale_mm / data.step_mm, height: 1,
    fill: "#fff", stroke: "#000", "stroke-width": .3});
  make("text", svg, {x: 3, y: h - 7}, `${direction.scale_mm} mm`);
  const show = () => {
    const slice = direction.slices[range.value];
    said.textContent = `${direction.name}, ${direction.letter} = ${slice.at_mm.toFixed(1)} mm`
      + ` (LPS); slider right: to the ${direction.towards}`;
    if (slice.jpeg) image.setAttribute("href", "data:image/jpeg;base64," + slice.jpeg);
    image.setAttribute("filter", document.getElementById("soft").checked ? "url(#window)" : "");
    lines.replaceChildren();
    points.replaceChildren();
    for (const [name, path] of Object.entries(slice.contours))
      make("path", lines, {d: path, stroke: data.colours[name], "stroke-width": .4 * data.finer});
    list.replaceChildren();
    slice.points.forEach(([name, x, y], k) => {
      const colour = data.point_colours[k % data.point_colours.length];
      make("path", points, {d: `M${x - 3} ${y}h6M${x} ${y - 3}v6`, stroke: colour,
        "stroke-width": .5});
      make("text", points, {x: x + 1, y: y - 1, style: `font-size:4px;fill:${colour}`}, k + 1);
      list.appendChild(document.createElement("div")).textContent = `${k + 1} ${name}`;
    });
  };
  Object.assign(range, {type: "range", min: 0, max: direction.slices.length - 1});
  range.setAttribute("aria-label", direction.name);
  range.value = direction.first;
  range.addEventListener("input", show);
  document.getElementById("soft").addEventListener("change", show);
  figure.append(range, list);
  show();
};
for (const direction of data.directions) build(direction, document.querySelector(".slices"));
"""


def make_slices_section(view: PlanView) -> str:
    """HTML with all that it needs in it."""
    names = list(view.plan.bones)
    colours = {name: _css(BONE_COLOURS.get(name, OTHER_COLOUR)) for name in names}
    step = _choose_step(view)
    data = {
        "finer": _FINER,
        "step_mm": view.grid.step_mm,
        "colours": colours,
        "point_colours": [_css(colour) for colour in POINT_COLOURS],
        "directions": [_describe(view, direction, step) for direction in DIRECTIONS],
    }
    # A name may not end the script.
    content = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    legend = "".join(
        f'<span class="bone" style="color:{colours[name]}">{escape(name)}</span>' for name in names
    )
    is_ct = view.volume.range_hu is not None
    return "".join([
        "<h2>Slices</h2>",
        f'<p class="note">{view.slices_words} One in {step * view.grid.step_mm:g} mm. Drag, or ',
        "click a slider and press the arrow keys. R, L, A, P, H, F: the patient's right, left, ",
        "front, back, head, feet. Crosses: landmarks and targets near the slice.</p>",
        f'<p>{legend}<label{"" if is_ct else " hidden"}>',
        '<input type="checkbox" id="soft"> soft tissue</label></p>',
        _make_window(view),
        '<div class="slices"></div><noscript><p>The slices need a browser with scripts.</p>',
        f'</noscript><script type="application/json" id="slice-data">{content}</script>',
        f"<script>{_SCRIPT}</script>",
    ])  # fmt: skip


def _css(colour: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


def _choose_step(view: PlanView) -> int:
    """How many slices further the next one is."""
    pixels = len(DIRECTIONS) * math.prod(view.grid.size)
    return max(_LEAST_STEP, math.ceil(pixels / _MOST_PIXELS))


def _make_window(view: PlanView) -> str:
    """A filter that makes of the stored densities those of soft tissue."""
    window = WINDOWS_HU["soft tissue"]
    if view.volume.range_hu is None or window is None:
        return ""
    (black, white), (low, high) = view.volume.range_hu, window
    slope, intercept = (white - black) / (high - low), (black - low) / (high - low)
    parts = "".join(
        f'<feFunc{one} type="linear" slope="{slope:.4f}" intercept="{intercept:.4f}"/>'
        for one in "RGB"
    )
    return (
        '<svg width="0" height="0" style="position:absolute"><filter id="window" '
        'color-interpolation-filters="sRGB">'
        f"<feComponentTransfer>{parts}</feComponentTransfer></filter></svg>"
    )


def _describe(view: PlanView, direction: Direction, step: int) -> dict[str, Any]:
    """All slices of a direction, for the script."""
    rows, columns = view.grid.shape_of(direction)
    n = view.grid.count_slices(direction)
    indices = range(min(step // 2, n - 1), n, step)
    points = _place_points(view, direction, indices)
    return {
        "name": direction.name,
        "letter": direction.letter,
        "marks": direction.marks,
        "towards": direction.towards,
        "size": (columns, rows),
        "scale_mm": choose_scale_mm(columns * view.grid.step_mm),
        "first": len(indices) // 2,
        "slices": [
            {
                "at_mm": view.grid.position_mm(direction, index),
                "jpeg": _encode(view, direction, index),
                "contours": {
                    name: write_path(segments)
                    for name, segments in view.find_contours(direction, index).items()
                },
                "points": points.get(index, []),
            }
            for index in indices
        ],
    }


def _place_points(
    view: PlanView, direction: Direction, indices: range
) -> dict[int, list[tuple[str, float, float]]]:
    """Shown slice -> landmarks and targets that are nearest to it, with their places."""
    placed: dict[int, list[tuple[str, float, float]]] = {}
    shown = np.array(indices)
    for name, point_mm in view.points_mm.items():
        index = int(view.grid.find_slices(direction, point_mm[None])[0])
        nearest = int(shown[np.abs(shown - index).argmin()])
        x, y = (view.grid.find_pixels(direction, point_mm) + 0.5).round(1).tolist()
        placed.setdefault(nearest, []).append((name, x, y))
    return placed


def _encode(view: PlanView, direction: Direction, index: int) -> str:
    """A slice as JPEG in base64; an empty text without a CT."""
    import cv2

    if not view.has_pictures:
        return ""
    picture: Picture = np.ascontiguousarray(view.volume.slice_of(direction, index))
    _, encoded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return base64.b64encode(encoded.tobytes()).decode("ascii")


def write_path(segments: FloatArray) -> str:
    """SVG path of (S, 2, 2) segments in a slice's pixels, joined end to end.

    In whole tenths of a pixel, its upper left corner at 0, 0.
    """
    whole = np.rint((segments + 0.5) * _FINER).astype(int)
    return "".join(_write_line(line) for line in _join(whole))


def _write_line(line: list[tuple[int, int]]) -> str:
    steps = np.diff(np.array(line), axis=0)
    return f"M{line[0][0]} {line[0][1]}l" + " ".join(f"{x} {y}" for x, y in steps.tolist())


def _join(segments: NDArray[np.int_]) -> list[list[tuple[int, int]]]:
    """Lines of segments that share their ends, each segment once."""
    ends = [((a[0], a[1]), (b[0], b[1])) for a, b in segments.tolist() if a != b]
    at: dict[tuple[int, int], set[int]] = {}
    for k, pair in enumerate(ends):
        for end in pair:
            at.setdefault(end, set()).add(k)
    lines = []
    for k, (start, end) in enumerate(ends):
        if k not in at[start]:
            continue
        line, here = [start, end], end
        _take(at, ends, k)
        while at[here]:
            k_next = min(at[here])
            a, b = ends[k_next]
            here = b if here == a else a
            line.append(here)
            _take(at, ends, k_next)
        lines.append(line)
    return lines


def _take(
    at: dict[tuple[int, int], set[int]],
    ends: list[tuple[tuple[int, int], tuple[int, int]]],
    k: int,
) -> None:
    """A segment is part of a line now."""
    for end in ends[k]:
        at[end].discard(k)
