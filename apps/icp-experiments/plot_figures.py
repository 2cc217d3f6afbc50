"""Draws the figures of icp-experiments.

    python3 plot_figures.py FIGURES.json OUTPUT_FOLDER

FIGURES.json holds panels with numbers that are ready to be drawn, see figure.h. Each figure becomes
NAME.png and NAME.svg. Exit code 3: there is no matplotlib.
"""
import io
import json
import math
import os
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.lines import Line2D
    from PIL import Image
    from matplotlib.ticker import FixedLocator, FormatStrFormatter, LogLocator, MaxNLocator, NullLocator
except ImportError as problem:
    print(problem)
    sys.exit(3)

WIDTH, PANEL_HEIGHT = 8.8, 3.1  # inches
DPI = 100
plt.rcParams.update({
    "font.size": 12, "axes.titlesize": 12, "axes.labelsize": 12, "legend.fontsize": 12,
    "xtick.labelsize": 11, "ytick.labelsize": 11,
    "svg.fonttype": "none", "svg.hashsalt": "icp-experiments",  # text stays text; the same bytes every time
    "axes.grid": True, "grid.color": "#dddddd", "axes.axisbelow": True, "lines.markersize": 6,
})


def main():
    figures_file, folder = sys.argv[1:]
    with open(figures_file, encoding="utf-8") as file:
        figures = json.load(file)
    for figure in figures:
        draw_figure(figure, os.path.join(folder, figure["name"]))


def draw_figure(figure, path):
    columns = int(figure["columns"])
    rows = math.ceil(len(figure["panels"]) / columns)
    styles = {style["id"]: style for style in figure["legend"]}
    entries = legend_entries(figure)
    legend_columns = legend_columns_for(entries)
    head = 0.5 + 0.26 * math.ceil(len(entries) / legend_columns)  # title and legend
    height = (PANEL_HEIGHT + (0.4 if columns > 2 else 0)) * rows + head
    fig, axes = plt.subplots(rows, columns, figsize=(WIDTH, height), squeeze=False)
    for ax in axes.flat[len(figure["panels"]):]:
        ax.remove()
    for panel, ax in zip(figure["panels"], axes.flat):
        draw_panel(panel, ax, styles)
    share_y(figure["panels"], axes.flat)
    fig.tight_layout(rect=(0, 0, 1, 1 - head / height), h_pad=1.2, w_pad=1.2)
    fig.suptitle(figure["title"], y=1 - 0.08 / height, va="top", fontsize=13)
    fig.legend(handles=entries, loc="upper center", bbox_to_anchor=(0.5, 1 - 0.38 / height),
               ncol=legend_columns, frameon=False, borderaxespad=0, columnspacing=1.4, handlelength=2.2)
    check_layout(fig, figure["name"])
    fig.savefig(path + ".svg", metadata={"Date": None, "Creator": None})
    save_small_png(fig, path + ".png", styles)
    plt.close(fig)


def save_small_png(fig, path, styles):
    """256 colours are enough, and a third of the size; those of the styles are among them as they are."""
    buffer = io.BytesIO()
    fig.savefig(buffer, format="png", dpi=DPI)
    picture = Image.open(buffer).convert("RGB")
    exact = [int(style["color"][k:k + 2], 16) for style in styles.values() for k in (1, 3, 5)]
    others = 256 - len(exact) // 3
    palette = Image.new("P", (1, 1))
    palette.putpalette(exact + picture.quantize(others, Image.Quantize.MAXCOVERAGE).getpalette()[:3 * others])
    picture.quantize(palette=palette, dither=Image.Dither.NONE).save(path, optimize=True)


def legend_columns_for(entries):
    longest = max(len(entry.get_label()) for entry in entries)
    return max(1, min(len(entries), int(WIDTH / (0.75 + 0.088 * longest))))


def legend_entries(figure):
    drawn_as_line = {s["style"] for p in figure["panels"] for s in p["lines"]}
    has_boxes = any(p["boxes"] for p in figure["panels"])
    entries = []
    for style in figure["legend"]:
        if style["id"] in drawn_as_line:
            entries.append(Line2D([], [], color=style["color"], marker=style["marker"] or None,
                                  linestyle=dashes(style), label=style["label"]))
        else:
            entries.append(Line2D([], [], color=style["color"], linewidth=7, alpha=0.55, label=style["label"]))
    if has_boxes:
        entries.append(Line2D([], [], color="black", marker="d", markersize=5, markerfacecolor="white",
                              linestyle="", label="RMSE"))
    return entries


def draw_panel(panel, ax, styles):
    draw_boxes(panel["boxes"], ax, styles)
    for k, series in enumerate(panel["lines"]):
        draw_line(series, ax, styles[series["style"]], k, len(panel["lines"]), behind=bool(panel["boxes"]))
    ax.set_title(panel["title"] + ("\n" + panel["note"] if panel["note"] else ""))
    ax.set_xlabel(panel["x_label"])
    ax.set_ylabel(panel["y_label"])
    set_scales(panel, ax)


def set_scales(panel, ax):
    if panel["y_scale"] == "log":
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(numticks=8))
        ax.yaxis.set_minor_locator(NullLocator())
    if panel["y_from"] != panel["y_to"]:
        ax.set_ylim(panel["y_from"], panel["y_to"])
    if panel["x_scale"] == "category":
        count = len(panel["categories"])
        ax.set_xticks(range(count), panel["categories"])
        letters = sum(max(map(len, category.split("\n"))) for category in panel["categories"])
        if letters > ax.get_window_extent().width / 9:  # they would touch
            plt.setp(ax.get_xticklabels(), rotation=30, ha="right", rotation_mode="anchor")
        ax.set_xlim(-0.5, count - 0.5)
        ax.grid(False, axis="x")
    else:
        ax.set_xscale(panel["x_scale"])


def share_y(panels, all_axes):
    """Panels of the same quantity get the same limits, so that they can be compared."""
    groups = {}
    for panel, ax in zip(panels, all_axes):
        groups.setdefault((panel["y_label"], panel["y_scale"], panel["y_from"] != panel["y_to"]), []).append(ax)
    for (_, scale, fixed), group in groups.items():
        limits = [ax.get_ylim() for ax in group]
        low, high = min(l[0] for l in limits), max(l[1] for l in limits)
        for ax in group:
            if not fixed:
                ax.set_ylim(low, high)
            if scale == "log" and high / low < 30:  # too narrow for powers of ten
                ax.yaxis.set_major_locator(narrow_ticks(low, high))
                ax.yaxis.set_major_formatter(FormatStrFormatter("%.3g"))


def narrow_ticks(low, high):
    """1, 2 and 5 times powers of ten, or even steps where there would be less than three of them."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [m * 10**d for d in decades for m in (1, 2, 5) if low <= m * 10**d <= high]
    return FixedLocator(ticks) if len(ticks) >= 3 else MaxNLocator(5, steps=[1, 2, 5, 10])


def draw_boxes(all_series, ax, styles):
    """The boxes of one category stand side by side."""
    count = len(all_series)
    if all(len(series["boxes"]) == 1 for series in all_series) and count > 1:  # a category each
        for series in all_series:
            draw_boxes([series], ax, styles)
        return
    width = 0.8 / max(1, count)
    for k, series in enumerate(all_series):
        color = styles[series["style"]]["color"]
        shift = (k - (count - 1) / 2) * width
        boxes = [b for b in series["boxes"] if b["median"] is not None]
        if not boxes:
            continue
        stats = [{"whislo": b["q05"], "q1": b["q25"], "med": b["median"], "q3": b["q75"], "whishi": b["q95"]}
                 for b in boxes]
        positions = [b["x"] + shift for b in boxes]
        ax.bxp(stats, positions=positions, widths=0.85 * width if count > 1 else 0.45, showfliers=False,
               manage_ticks=False, patch_artist=True,
               boxprops={"facecolor": color + "8c", "edgecolor": color}, medianprops={"color": "black"},
               whiskerprops={"color": color}, capprops={"color": color})
        ax.plot(positions, [b["rmse"] for b in boxes], linestyle="", marker="d", markersize=4.5,
                markerfacecolor="white", markeredgecolor="black", markeredgewidth=0.8, zorder=4)


def draw_line(series, ax, style, index, count, behind):
    """Lines that coincide stay visible: the later ones are thinner, their markers smaller."""
    points = [(x, y) for x, y in zip(series["x"], series["y"]) if y is not None]
    if not points:
        return
    x, y = zip(*points)
    is_bound = style["id"] == "bound"
    thickness = 1 - index / max(1, count - 1)
    ax.plot(x, y, color=style["color"], linestyle=dashes(style), marker=style["marker"] or None,
            linewidth=2 if is_bound else 1.2 + 2.3 * thickness, markersize=5 + 4 * thickness,
            zorder=1.5 if behind else 3, markerfacecolor="none" if style["dashed"] else style["color"])
    if series["low"]:
        ax.fill_between(series["x"], series["low"], series["high"], color=style["color"], alpha=0.15, linewidth=0)


def dashes(style):
    return (0, (4, 2)) if style["dashed"] else "-"


def check_layout(fig, name):
    """Nothing may cover the data or another title, and nothing may be cut off."""
    legend = fig.legends[0].get_window_extent()
    titles = [ax.title.get_window_extent() for ax in fig.axes]
    for k, (ax, title) in enumerate(zip(fig.axes, titles)):
        if legend.overlaps(ax.get_window_extent()) or any(title.overlaps(other) for other in [legend] + titles[:k]):
            sys.exit(f"{name}: the legend or a title covers something")
    for item in [legend] + titles:
        if item.x0 < 0 or item.x1 > fig.bbox.x1 or item.y0 < 0 or item.y1 > fig.bbox.y1:
            sys.exit(f"{name}: something does not fit into the picture")


main()
