# SPDX-License-Identifier: Apache-2.0
"""Line plots as small SVG files."""
import matplotlib

matplotlib.use("svg")
matplotlib.rcParams.update({"svg.hashsalt": "scolopax", "svg.fonttype": "none", "font.size": 8, "lines.markersize": 3,
                            "lines.linewidth": 1})
from matplotlib import pyplot  # noqa: E402  (after the choice of a backend)

COLORS = {"auto": "#000000", "superposed": "#d62728", "sync-dda": "#1f77b4", "n-dda": "#17becf", "cumulative": "#9467bd",
          "raymarch": "#2ca02c", "hybrid": "#ff7f0e"}


def lines(panels, xlabel, ylabel, logx=True, logy=True):
    """panels: (title, [(method, xs, ys)]), side by side, four in a row. Returns a figure."""
    columns = min(4, len(panels))
    rows = (len(panels) + columns - 1) // columns
    figure, axes = pyplot.subplots(rows, columns, figsize=(2.7 * columns + 0.4, 2.2 * rows + 0.3), squeeze=False)
    for axis in axes.flat[len(panels):]:
        axis.axis("off")
    for axis, (title, series) in zip(axes.flat, panels):
        for method, xs, ys in series:
            axis.plot(xs, ys, "o-", label=method, color=COLORS.get(method))
        axis.set_title(title)
        axis.set_xlabel(xlabel)
        axis.set_xscale("log" if logx else "linear")
        axis.set_yscale("log" if logy else "linear")
        axis.grid(True, which="major", linewidth=0.3)
    axes.flat[0].set_ylabel(ylabel)
    axes.flat[0].legend(fontsize=6)
    figure.tight_layout()
    return figure


def save(figure, path):
    figure.savefig(path, format="svg", metadata={"Date": None})
    pyplot.close(figure)
