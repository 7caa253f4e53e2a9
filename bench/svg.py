"""Parts of the figures that programs of this folder draw, and their files' text."""


def text(x, y, content, attributes=""):
    return f"<text x='{x:.1f}' y='{y:.1f}' {attributes}>{content}</text>"


def line(x0, y0, x1, y1, attributes):
    return f"<line x1='{x0:.1f}' y1='{y0:.1f}' x2='{x1:.1f}' y2='{y1:.1f}' {attributes}/>"


def document(width, height, parts):
    return "\n".join([
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' font-family='sans-serif' "
        "font-size='13'>", "<rect width='100%' height='100%' fill='white'/>", *parts, "</svg>", ""])
