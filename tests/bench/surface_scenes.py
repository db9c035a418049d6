# SPDX-License-Identifier: Apache-2.0
"""Volumes and scenes of the experiment `surfaces`: opacity curves with narrow peaks, as in the figures of Knoll et al.
2009, on the volumes that we have."""
import base64
import math
import struct
import zlib

# The peaks' colours, and that of the smooth part.
COLORS = ["#e03020", "#e0c030", "#30b050", "#b040c0", "#f08030", "#40c0c0"]
SMOOTH = "#3060e0"
LIGHT = {"type": "directional", "direction": [-1, 0.3, -1], "intensity": 1.2}


def camera(eye, target, angle):
    return {"eye": eye, "target": target, "up": [0, 0, 1], "fovY": angle}


# Per volume: its file, the range of values, the position of one peak (an outer surface), the position from which a smooth
# ramp rises, the view of the whole and, of some, one from within. No peak is at a value that a voxel can have.
VOLUMES = {
    "heptane": {"file": "scalar/heptane.nii.gz", "range": [0, 255], "peak": 0.21, "smooth": 0.45,
                "far": camera([230, -290, 170], [-22, 0, -8], 34)},
    "bonsai": {"file": "scalar/bonsai.nii.gz", "range": [0, 255], "peak": 0.22, "smooth": 0.4,
               "far": camera([260, -330, 170], [5, 5, 20], 28), "close": camera([70, -90, 60], [0, 0, 30], 40)},
    "engine": {"file": "scalar/engine.nii.gz", "range": [0, 255], "peak": 0.3, "smooth": 0.7,
               "far": camera([260, -300, 220], [0, 0, 0], 34), "close": camera([90, -110, 60], [10, 0, 0], 40)},
    "embryo": {"file": "scalar/embryo_256.vti", "range": [0, 150], "peak": 0.25, "smooth": 0.45,
               "far": camera([300, -250, 250], [125, 120, 120], 28)},
    "tooth": {"file": "scalar/tooth.nhdr", "range": [350, 1300], "peak": 0.25, "smooth": 0.7,
              "far": camera([221, -244, 170], [51, 46, 80], 32)},
}


def tent(middle, width, top):
    return [[middle - width / 2, 0], [middle, top], [middle + width / 2, 0]]


def scene(volume, side, peaks=None, width=1e-4, extinction=0.5, smooth=0.05, view="far", shading=True):
    """A scene with peaks (positions; by default the volume's one) of this width at their base, as shares of the range.
    Extinctions per voxel: of the peaks, at which one as thick as a voxel absorbs 40 %, and of the smooth part at its end,
    where the curve has no peak."""
    look = VOLUMES[volume]
    peaks = [look["peak"]] if peaks is None else peaks
    density = max(extinction, smooth)
    opacity = [[0, 0]] + [knot for peak in peaks for knot in tent(peak, width, extinction / density)]
    borders = [(a + b) / 2 for a, b in zip(peaks, peaks[1:])]
    if smooth > 0:
        low = max(look["smooth"], opacity[-1][0])
        opacity += [[low, 0], [1, smooth / density]]
        borders.append(low)
    colors = [*COLORS[:len(peaks)], SMOOTH]
    colormap = [[0, colors[0]]]
    for border, before, after in zip(borders, colors, colors[1:]):
        colormap += [[border, before], [border, after]]
    return {"channels": [{"range": look["range"], "opacity": opacity, "colormap": colormap, "density": density}],
            "camera": look[view], "lights": [LIGHT], "shading": shading, "integrator": {"seed": 1},
            "image": {"width": side, "height": side, "filter": "point"}}


def with_isovalues(made, factor):
    """The scene with surfaces at the peaks' values, given as isovalues, of extinctions `factor` times the peaks'."""
    channel = made["channels"][0]
    lo, hi = channel["range"]
    knots = channel["opacity"]
    tops = [knot for before, knot, after in zip(knots, knots[1:], knots[2:]) if before[1] < knot[1] > after[1]]
    surfaces = [{"value": lo + at * (hi - lo), "opacity": 1 - math.exp(-factor * channel["density"] * top)}
                for at, top in tops]
    return {**made, "channels": [{**channel, "isovalues": surfaces}]}


def vti_to_nrrd(path, out, edge):
    """Converts a cube of bytes from VTK's XML format (appended, base64, zlib), which the program does not read."""
    with open(path, encoding="latin1") as file:
        text = file.read()
    begin = text.index("_", text.index("<AppendedData")) + 1
    coded = text[begin:text.index("</AppendedData>")].strip()
    # Number of blocks, their size, that of the last, and for each its compressed size; coded apart from the blocks.
    count = struct.unpack("<I", base64.b64decode(coded[:8])[:4])[0]
    header = 4 * ((4 * (3 + count) + 2) // 3)
    sizes = struct.unpack(f"<{3 + count}I", base64.b64decode(coded[:header]))[3:]
    blocks, at = base64.b64decode(coded[header:]), 0
    with open(out, "wb") as file:
        file.write(f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {edge} {edge} {edge}\nspace dimension: 3\n"
                   "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n".encode())
        for size in sizes:
            file.write(zlib.decompress(blocks[at:at + size]))
            at += size
