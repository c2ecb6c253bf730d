"""Holds drawings that other programs made against other programs that read them.

    python tests/independent/drawings.py GRAVER MACHINE FILE...

Every SVG and DXF file is simulated by the program GRAVER on the machine file MACHINE, scaled to 20 mm, and the
light that really fell is compared:

- SVG: as pixels of 0.1 mm, hatched with that distance, with the raster of resvg. No light may fall on a
  pixel that resvg leaves empty, and no pixel that resvg fills may be dark, lines apart, which are marked along
  their middle.
- DXF: with the polylines of ezdxf. The extent must be the same within 1 um, and
  marks and polylines must lie within 30 um of each other. Where no more than two ends meet in any point, the
  number of strokes must be that of ezdxf's pieces joined. Texts, those of attributes too, are in other fonts: each must
  have strokes near the box that ezdxf has for it, and those strokes are compared no further.

Needs numpy, scipy, Pillow, resvg-py and ezdxf. Prints one line a file, and ends with 1 where something differs.
"""

import csv
import io
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.spatial import cKDTree

SIZE = 20.0  # mm
PIXEL = 0.1  # mm
NEAR = 0.03  # mm
SAGITTA = 5e-6  # of chords, as a part of the drawing's size
TAKEN = {"LINE", "CIRCLE", "ARC", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE"}
TEXTS = {"TEXT", "MTEXT", "ATTRIB"}


class Difference(Exception):
    """What differs."""


class Skipped(Exception):
    """Why nothing is compared."""


def graver(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=600)


def simulated(program, machine, file, settings, folder):
    """Strokes of the artwork and lit pieces, from home [mm], and the notes."""
    changes = [word for setting in settings for word in ("--set", setting)]
    run = Path(folder) / "run"
    ended = graver(program, "simulate", str(file), "--machine", machine, "--out", str(run), *changes)
    if ended.returncode != 0:
        raise Skipped("refused: " + " ".join(ended.stderr.split())[:160])
    home = np.array(HOME)
    strokes, goes_on = [], False
    for line in (run / "artwork.jsonl").read_text().splitlines():
        part = json.loads(line)
        points = np.array(part["points"])[:, :2] * 1e3 - home
        if goes_on:
            strokes[-1] = np.vstack([strokes[-1], points])
        else:
            strokes.append(points)
        goes_on = part["goes_on"]
    table = graver(program, "export", str(run)).stdout
    rows = csv.DictReader(io.StringIO(table))
    values = np.array(
        [[float(row[name] or 0) for name in ("tool_x", "tool_y", "lit")] for row in rows]
    )
    tool, lit = values[:, :2] * 1e3 - home, values[:, 2]
    pieces = []
    for cycle in np.nonzero(lit > 0)[0]:
        start, end = tool[cycle - 1], tool[cycle]
        if lit[cycle] < 1.0:
            # A cycle that is lit in part begins or ends a mark.
            if lit[cycle - 1] == 0 and cycle + 1 < len(lit) and lit[cycle + 1] > 0:
                start = end + (start - end) * lit[cycle]
            elif lit[cycle - 1] > 0 and (cycle + 1 == len(lit) or lit[cycle + 1] == 0):
                end = start + (end - start) * lit[cycle]
            else:
                # Where within the cycle is not told.
                continue
        pieces.append((start, end))
    summary = json.loads((run / "summary.json").read_text())
    return strokes, pieces, summary


def sampled(pieces, distance):
    """Points along straight pieces, at most so far apart."""
    points = []
    for start, end in pieces:
        count = max(1, math.ceil(np.linalg.norm(end - start) / distance))
        points.append(start + (end - start) * np.linspace(0, 1, count + 1)[:, None])
    return np.vstack(points) if points else np.zeros((0, 2))


def compare_svg(program, machine, file, folder):
    import resvg_py
    from PIL import Image

    text = file.read_text(encoding="utf-8", errors="replace")
    sides = resvg_size(resvg_py, text)
    factor = SIZE / (max(sides) * 25.4 / 96)
    pixels_wide = round(sides[0] * 25.4 / 96 * factor / PIXEL)
    picture = Image.open(io.BytesIO(bytes(resvg_py.svg_to_bytes(svg_string=text, width=pixels_wide))))
    alpha = np.asarray(picture.convert("RGBA"))[:, :, 3].astype(float) / 255
    rows, columns = alpha.shape
    settings = [
        "drawing.anchor=page",
        f"drawing.scale={float(factor)!r}",
        "drawing.layer=all",
        "layers.all.speed=50 mm/s",
        f"layers.all.hatch.spacing={PIXEL} mm",
    ]
    strokes, pieces, summary = simulated(program, machine, file, settings, folder)
    # Rows of the raster are counted from the top of the page, which may end within one.
    height = sides[1] * 25.4 / 96 * factor
    points = sampled(pieces, PIXEL / 8)
    column = np.floor(points[:, 0] / PIXEL).astype(int)
    row = np.floor((height - points[:, 1]) / PIXEL).astype(int)
    # What is drawn beyond the page is marked, and cut off by resvg.
    beyond = np.maximum(-points, points - [columns * PIXEL, height]).max(axis=1) > NEAR
    inside = (0 <= row) & (row < rows) & (0 <= column) & (column < columns)
    lit = np.zeros(alpha.shape, bool)
    lit[row[inside], column[inside]] = True
    around = np.ones((3, 3), bool)
    # A pixel apart: rows of light and of pixels need not lie on each other.
    stray = lit & ~binary_dilation(alpha > 0.0, around)
    dark = ~binary_dilation(lit, around) & (alpha > 0.99)
    has_lines = "stroke" in text
    told = f"{int(lit.sum())} lit, {int((alpha > 0.5).sum())} painted, {int(stray.sum())} stray, {int(dark.sum())} dark"
    told += f", error {summary['marks']['error_max'] * 1e6:.1f} um"
    told += f", {int(beyond.sum())} beyond the page" if beyond.any() else ""
    if stray.any() or (dark.any() and not has_lines):
        raise Difference(told)
    return told + (" (lines)" if has_lines else "")


def resvg_size(resvg_py, text):
    """Width and height of a page in px."""
    from PIL import Image

    finer = Image.open(io.BytesIO(bytes(resvg_py.svg_to_bytes(svg_string=text, zoom=50)))).size
    return finer[0] / 50, finer[1] / 50


def compare_dxf(program, machine, file, folder):
    import ezdxf.bbox
    from ezdxf import disassemble, recover

    if file.read_bytes().startswith(b"AutoCAD Binary DXF"):
        document = ezdxf.readfile(file)
    else:
        document, _ = recover.readfile(file)
    unit = {1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 8: 25.4e-6, 9: 25.4e-3, 10: 914.4, 13: 1e-3, 14: 100.0}
    scale = unit.get(document.header.get("$INSUNITS", 0), 1.0)
    bounds = ezdxf.bbox.extents(document.modelspace())
    if not bounds.has_data:
        raise Skipped("it is empty")
    extents = max(bounds.size.xy) or 1.0
    lines, texts, kinds = [], [], set()
    for entity in disassemble.recursive_decompose(document.modelspace()):
        layer = entity.dxf.get("layer", "0")
        if document.layers.has_entry(layer):
            entry = document.layers.get(layer)
            if entry.is_off() or entry.is_frozen():
                continue
        if entity.dxf.get("invisible", 0):
            continue
        kinds.add(entity.dxftype())
        if entity.dxftype() in TEXTS:
            corners = disassemble.make_primitive(entity).vertices()
            box = np.array([(corner.x, corner.y) for corner in corners])
            if len(box) > 0:
                texts.append((box.min(axis=0) * scale, box.max(axis=0) * scale))
            continue
        if entity.dxftype() not in TAKEN:
            continue
        if entity.dxftype() == "POLYLINE" and (entity.is_polygon_mesh or entity.is_poly_face_mesh):
            continue
        for flat in polylines(entity, SAGITTA * extents):
            points = np.array([(point[0], point[1]) for point in flat]) * scale
            if len(points) > 1 and np.ptp(points, axis=0).max() > 0:
                lines.append((points, (layer, entity.dxf.get("color", 256), entity.dxf.get("true_color", 0))))
    if not lines:
        raise Skipped("nothing to compare of " + ", ".join(sorted(kinds)))
    everything = np.vstack([points for points, _ in lines])
    low, high = everything.min(axis=0), everything.max(axis=0)
    factor = SIZE / (high - low).max()
    if not (kinds <= TAKEN | TEXTS | {"POINT", "ATTDEF", "VIEWPORT"}):
        raise Skipped("others are drawn by " + ", ".join(sorted(kinds - TAKEN - TEXTS)))
    x, y = (-low * factor).tolist()
    settings = ["drawing.anchor=page", f'drawing.at=["{x!r} mm", "{y!r} mm"]', f"drawing.scale={float(factor)!r}",
                "drawing.layer=all", "layers.all.mode=line", "layers.all.speed=50 mm/s", "order.by=file"]
    if sum(len(points) for points, _ in lines) > 60_000:
        raise Skipped("too large to be simulated here")
    strokes, pieces, summary = simulated(program, machine, file, settings, folder)
    lines = [((points - low) * factor, key) for points, key in lines]
    strokes, pieces, blank = without_texts(strokes, pieces, texts, lines, low, factor)
    extent = np.vstack(strokes)
    span = np.abs(np.array([extent.min(axis=0), extent.max(axis=0)]) - [[0, 0], (high - low) * factor]).max()
    reference = sampled([pair for points, _ in lines for pair in zip(points, points[1:])], NEAR / 4)
    marked = sampled(pieces, NEAR / 4)
    stray = cKDTree(reference).query(marked)[0].max()
    missing = cKDTree(marked).query(reference)[0].max()
    right = joined([(points / factor, key) for points, key in lines])
    # A curve is several strokes where it has corners.
    count = len(strokes) - sum(
        np.linalg.norm(one[-1] - other[0]) < 1e-3 for one, other in zip(strokes, strokes[1:])
    )
    told = (f"{blank} texts missing of {len(texts)}, {count} curves of {'?' if right is None else right}, extent {span * 1e3:.2f} um, "
            f"stray {stray * 1e3:.1f} um, missing {missing * 1e3:.1f} um")
    if blank or span > 1e-3 or stray > NEAR or missing > NEAR or right not in (None, count):
        raise Difference(told)
    return told


def without_texts(strokes, pieces, texts, lines, low, factor):
    """What is not near the box of a text, and how many boxes nothing is near. What lies on a line is no text."""
    if not texts:
        return strokes, pieces, 0
    tree = cKDTree(sampled([pair for points, _ in lines for pair in zip(points, points[1:])], NEAR / 4))
    boxes = []
    for lower, upper in texts:
        lower, upper = (lower - low) * factor, (upper - low) * factor
        around = 0.2 * (upper - lower) + min(upper - lower)
        boxes.append((lower - around, upper + around))
    is_found = [False] * len(boxes)

    def is_text(points):
        points = np.asarray(points)
        if tree.query(sampled(list(zip(points, points[1:])), NEAR))[0].max() <= NEAR:
            return False
        near = [(lower <= points).all() and (points <= upper).all() for lower, upper in boxes]
        is_found[:] = [one or other for one, other in zip(is_found, near)]
        return any(near)

    kept = [stroke for stroke in strokes if len(stroke) < 2 or not is_text(stroke)]
    lit = [piece for piece in pieces if not is_text(piece)]
    return kept, lit, is_found.count(False)


def polylines(entity, sagitta):
    """The chords of an entity, in units of the file: of arcs and ellipses by their own formulas, as paths of
    ezdxf have cubics in their place, which are 5 um off in 20 mm."""
    from ezdxf.path import make_path

    kind = entity.dxftype()
    if kind == "SPLINE" and entity.control_point_count():
        yield list(entity.flattening(sagitta))
    elif kind in ("ARC", "CIRCLE", "ELLIPSE"):
        if kind == "ELLIPSE" or entity.dxf.radius > 0:
            yield list(entity.flattening(sagitta))
    elif kind in ("LWPOLYLINE", "POLYLINE") and entity.has_arc:
        for part in entity.virtual_entities():
            if part.dxftype() == "ARC":
                yield list(part.flattening(sagitta))
            else:
                yield [part.dxf.start, part.dxf.end]
    else:
        for path in make_path(entity).sub_paths():
            yield list(path.flattening(sagitta, 32))


def joined(lines):
    """How many strokes they make, joined where they touch within 1 um; None where more than two ends meet."""
    ends = {}
    parent = list(range(len(lines)))

    def root(index):
        while parent[index] != index:
            index = parent[index]
        return index

    for index, (points, key) in enumerate(lines):
        if np.linalg.norm(points[0] - points[-1]) < 1e-3:
            continue
        for point in (points[0], points[-1]):
            place = (key, *np.round(point / 2e-3).astype(int))
            ends.setdefault(place, []).append(index)
    for meeting in ends.values():
        if len(meeting) > 2:
            return None
        if len(meeting) == 2:
            parent[root(meeting[0])] = root(meeting[1])
    return len({root(index) for index in range(len(lines))})


def main(program, machine, *files):
    global HOME
    import tomllib

    given = tomllib.loads(Path(machine).read_text())["home"]
    HOME = [float(value.split()[0]) for value in given[:2]]
    wrong = 0
    for file in map(Path, files):
        compare = compare_dxf if file.suffix.lower() == ".dxf" else compare_svg
        with tempfile.TemporaryDirectory() as folder:
            try:
                print(f"same     {file.name}: {compare(program, machine, file, folder)}", flush=True)
            except Skipped as reason:
                print(f"skipped  {file.name}: {reason}", flush=True)
            except Difference as difference:
                wrong += 1
                print(f"DIFFERS  {file.name}: {difference}", flush=True)
            except Exception as error:
                print(f"unread   {file.name}: {type(error).__name__} {str(error)[:100]}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
