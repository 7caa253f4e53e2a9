"""Parts of the figures that programs of this folder draw, and their files' text."""
import math

COLOURS = ("#d95f02", "#1b6ca8", "#2a9d5c", "#8e44ad", "#b8860b", "#555555")


def text(x, y, content, attributes=""):
    return f"<text x='{x:.1f}' y='{y:.1f}' {attributes}>{content}</text>"


def line(x0, y0, x1, y1, attributes):
    return f"<line x1='{x0:.1f}' y1='{y0:.1f}' x2='{x1:.1f}' y2='{y1:.1f}' {attributes}/>"


def document(width, height, parts):
    return "\n".join([
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' font-family='sans-serif' "
        "font-size='13'>", "<rect width='100%' height='100%' fill='white'/>", *parts, "</svg>", ""])


def part_between(value, ends, is_log):
    """Where a value lies between two ends, 0 to 1."""
    low, high = ends
    return math.log(value / low) / math.log(high / low) if is_log else (value - low) / (high - low)


class Plot:
    """Axes that are linear or logarithmic, with ticks and a title. Values beyond the ends of y are drawn there."""

    def __init__(self, left, top, width, height, xs, ys, x_ticks, y_ticks, title, x_title, log_x=False, log_y=True):
        self.left, self.top, self.width, self.height = left, top, width, height
        self.xs, self.ys, self.log_x, self.log_y = xs, ys, log_x, log_y
        self.parts = [text(left, top - 12, title, "font-weight='bold'")]
        for tick in y_ticks:
            self.parts.append(line(left, self.y(tick), left + width, self.y(tick), "stroke='#e4e4e4'"))
            self.parts.append(text(left - 6, self.y(tick) + 4, f"{tick:g}", "text-anchor='end' font-size='11'"))
        for tick in x_ticks:
            self.parts.append(text(self.x(tick), top + height + 16, f"{tick:,}", "text-anchor='middle' font-size='11'"))
        self.parts.append(text(left + width / 2, top + height + 34, x_title, "text-anchor='middle' fill='#555'"))

    def x(self, value):
        return self.left + self.width * part_between(value, self.xs, self.log_x)

    def y(self, value):
        low, high = self.ys
        return self.top + self.height * (1 - part_between(min(max(value, low), high), self.ys, self.log_y))

    def curve(self, points, colour, attributes=""):
        path = " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in points)
        self.parts.append(f"<polyline fill='none' stroke='{colour}' stroke-width='1.8' points='{path}' {attributes}/>")

    def dots(self, points, colour, is_filled=True, radius=3.2):
        fill = colour if is_filled else "white"
        self.parts += [f"<circle cx='{self.x(x):.1f}' cy='{self.y(y):.1f}' r='{radius}' fill='{fill}' stroke='{colour}'/>"
                       for x, y in points]

    def label(self, x, y, content, colour):
        self.parts.append(text(x, y, content, f"fill='{colour}' font-size='12'"))
