"""What the browser does by itself: files, pictures, the address, and saying when it has painted."""

from __future__ import annotations

from bokeh.models import ColumnDataSource, CustomJS, Model

#: A text from the server becomes a file, or goes to the clipboard.
_DELIVER = """
const [name, text, kind] = ["name", "text", "kind"].map((key) => outbox.data[key][0])
if (kind == "clipboard") {
    navigator.clipboard?.writeText(text).catch(() => {})
} else {
    const link = document.createElement("a")
    link.href = URL.createObjectURL(new Blob([text], {type: kind}))
    link.download = name
    link.click()
    setTimeout(() => URL.revokeObjectURL(link.href), 10000)
}
"""

#: The four panels as they stand, drawn by the browser.
_PICTURE = """
const save = async () => {
    const view = Bokeh.index.find_one_by_id(panels.id)
    const blob = await view.export(format, true).to_blob()
    const link = document.createElement("a")
    link.href = URL.createObjectURL(blob)
    link.download = `peel_opt.${format}`
    link.click()
    setTimeout(() => URL.revokeObjectURL(link.href), 10000)
}
save()
"""

#: The address bar always holds a link to what is seen.
_ADDRESS = """
const query = address.data.query[0]
history.replaceState(null, "", location.pathname + (query ? "?" + query : ""))
"""


#: After the picture has been painted, not before: a browser that cannot keep up sets the pace.
_PULSE = """
const sent = pulse.data.sent[0]
if (pulse.data.seen[0] != sent) {
    requestAnimationFrame(() => setTimeout(() => { pulse.data = {sent: [sent], seen: [sent]} }, 0))
}
"""


def pulse() -> ColumnDataSource:
    """Return a source with the number of the last picture sent, and of the last one painted."""
    source = ColumnDataSource({"sent": [0], "seen": [0]}, name="pulse")
    source.js_on_change("data", CustomJS(args={"pulse": source}, code=_PULSE))
    return source


def outbox() -> ColumnDataSource:
    """Return a source; rows put into it are delivered as files or to the clipboard."""
    source = ColumnDataSource({"name": [""], "text": [""], "kind": [""], "number": [0]}, name="outbox")
    source.js_on_change("data", CustomJS(args={"outbox": source}, code=_DELIVER))
    return source


def address() -> ColumnDataSource:
    """Return a source whose query string the address bar follows."""
    source = ColumnDataSource({"query": [""]}, name="address")
    source.js_on_change("data", CustomJS(args={"address": source}, code=_ADDRESS))
    return source


def picture(panels: Model, kind: str) -> CustomJS:
    """Return what saves ``panels`` as a PNG or SVG file."""
    return CustomJS(args={"panels": panels, "format": kind}, code=_PICTURE)
